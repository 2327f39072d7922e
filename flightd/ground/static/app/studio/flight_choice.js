// The flights that something is learnt of or scored on: whole ones, newest first, of one site where that is asked.
import { say } from "../language.js";
import { dateAndTime } from "../words.js";


export const wholeFlights = (rows) => rows.filter((row) => !row.running && !row.trouble);

export const sitesOf = (rows) => [...new Set(rows.map(({ site }) => site))];

export const siteWords = (site) => site || say("no site told");

export const flightWords = ({ started_s: started, drone, path }) => [started ? dateAndTime(started * 1000) : "", drone, path].filter(Boolean).join(" · ");
