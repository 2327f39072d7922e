// The flights that something is learnt of or scored on: whole ones, newest first, of one site where that is asked.
import { dateFormat, say } from "../language.js";
import { time } from "../words.js";

const DAY = dateFormat({ year: "numeric", month: "short", day: "numeric" });

export const wholeFlights = (rows) => rows.filter((row) => !row.running && !row.trouble);

export const sitesOf = (rows) => [...new Set(rows.map(({ site }) => site))];

export const siteWords = (site) => site || say("no site told");

export const flightWords = ({ started_s: started, drone, path }) => [started ? `${DAY.format(started * 1000)} ${time(started * 1000)}` : "", drone, path].filter(Boolean).join(" · ");
