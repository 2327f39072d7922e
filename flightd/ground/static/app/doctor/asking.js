// Asks the station, and over it the drone, what the page Doctor needs.
import { askJson } from "../fetching.js";

const LOOK_MS = 20000;
const PROPOSAL_MS = 90000; // the drone checks a proposal as a whole before it writes

const at = (drone, what) => `/api/doctor/${encodeURIComponent(drone)}/${what}`;

// What is told to a question; an Error with words for a person where it is refused.
export const askDrone = (drone, what) => askJson(at(drone, what), { ms: LOOK_MS });

// What is answered to an act, or to a check of what is typed; an act is carried through though the page is left.
export const sendDrone = (drone, what, body, { signal } = {}) =>
  askJson(at(drone, what), {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(body),
    ms: what === "check" ? LOOK_MS : PROPOSAL_MS,
    goesOn: what !== "check",
    signal,
  });
