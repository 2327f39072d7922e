// What the drone says, in words and numbers for people.
import { dateFormat, decimal, english, say } from "./language.js";

const PHASES = {
  __proto__: null,
  preflight: english("On the ground"),
  recover: english("Taking over in the air"),
  arming: english("Arming"),
  take_off: english("Taking off"),
  acquire: english("Finding the lines"),
  follow: english("Flying to {goal}"),
  hover: english("Over {goal}"),
  turn: english("Turning"),
  climb: english("Changing height"),
  scan: english("Scanning the shelf at {goal}"),
  hold: english("Holding its place"),
  relocate: english("Finding its place again"),
  land: english("Landing"),
  swap: english("Waiting for a battery"),
  done: english("Flight over"),
  aborted: english("Flight ended early"),
  pilot: english("The pilot flies"),
};
const TROUBLED = new Set(["recover", "hold", "relocate", "aborted", "pilot"]);
const GROUNDED = new Set(["preflight", "swap", "done", "aborted", "pilot"]);

export const phaseWords = (status) => say(PHASES[status.phase] ?? status.phase, { goal: status.goal || say("its goal") });
export const isTroubled = (status) => TROUBLED.has(status.phase);
export const isGrounded = (status) => GROUNDED.has(status.phase);

export const COMMANDS = {
  __proto__: null,
  start: english("Start"), pause: english("Pause"), resume: english("Resume"), goto: english("Go to"), home: english("Fly home"),
  land: english("Land here"), stop: english("STOP"),
};

export const ACTIONS = {
  __proto__: null,
  hold: english("holds"), land: english("lands"), home: english("flies home"), report: english("reports it"),
  relocate: english("looks for its place"), hands_off: english("hands off"), stop: english("comes down at once"),
  continue: english("goes on"), configured: english("as configured"),
};

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

export const number = (value, digits = 0) =>
  value === null || value === undefined ? "–" : decimal(value, digits);

export const percent = (share) => (share === null || share === undefined ? "–" : `${Math.round(share * 100)} %`);

export function duration(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  if (seconds < 90) return `${Math.round(seconds)} s`;
  return `${Math.round(seconds / 60)} min`;
}

export function age(seconds) {
  if (seconds === null || seconds === undefined) return say("never");
  if (seconds < 1) return `${Math.round(seconds * 1000)} ms`;
  return duration(seconds);
}

const CLOCK = dateFormat({
  hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
});
export const time = (date) => CLOCK.format(date);

const DAY = dateFormat({ month: "short", day: "numeric" });
const DATE = dateFormat({ year: "numeric", month: "short", day: "numeric" });
export const dayAndTime = (date) => `${DAY.format(date)} ${time(date)}`;
export const dateAndTime = (date) => `${DATE.format(date)} ${time(date)}`;
