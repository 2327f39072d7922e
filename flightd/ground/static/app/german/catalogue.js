// All German texts.  A text that is said on several pages stands in frame.js.
import access from "./access.js";
import autopilot from "./autopilot.js";
import checks from "./checks.js";
import doctor from "./doctor.js";
import fleet from "./fleet.js";
import flights from "./flights.js";
import frame from "./frame.js";
import guide from "./guide.js";
import live from "./live.js";
import missions from "./missions.js";
import refusals from "./refusals.js";
import reported from "./reported.js";
import site from "./site.js";
import stock from "./stock.js";
import studio from "./studio.js";

export { readerOf } from "./reading.js";
export const REPORTED = { ...autopilot, ...checks, ...refusals, ...reported };
export const TEXTS = Object.assign(
  Object.create(null), access, autopilot, checks, doctor, fleet, flights, frame, guide, live, missions, reported, refusals, site, stock, studio,
);
