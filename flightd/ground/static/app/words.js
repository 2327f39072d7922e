// What the drone says, in words and numbers for people.

const PHASES = {
  __proto__: null,
  preflight: () => "On the ground",
  recover: () => "Taking over in the air",
  arming: () => "Arming",
  take_off: () => "Taking off",
  acquire: () => "Finding the lines",
  follow: (goal) => `Flying to ${goal}`,
  hover: (goal) => `Over ${goal}`,
  turn: () => "Turning",
  climb: () => "Changing height",
  scan: (goal) => `Scanning the shelf at ${goal}`,
  hold: () => "Holding its place",
  relocate: () => "Finding its place again",
  land: () => "Landing",
  swap: () => "Waiting for a battery",
  done: () => "Flight over",
  aborted: () => "Flight ended early",
  pilot: () => "The pilot flies",
};
const TROUBLED = new Set(["recover", "hold", "relocate", "aborted", "pilot"]);
const GROUNDED = new Set(["preflight", "swap", "done", "aborted", "pilot"]);

export const phaseWords = (status) => (PHASES[status.phase] ?? (() => status.phase))(status.goal || "its goal");
export const isTroubled = (status) => TROUBLED.has(status.phase);
export const isGrounded = (status) => GROUNDED.has(status.phase);

export const COMMANDS = {
  __proto__: null,
  start: "Start", pause: "Pause", resume: "Resume", goto: "Go to", home: "Fly home", land: "Land here", stop: "STOP",
};

export const ACTIONS = {
  __proto__: null,
  hold: "holds", land: "lands", home: "flies home", report: "reports it", relocate: "looks for its place",
  hands_off: "hands off", stop: "comes down at once", continue: "goes on", configured: "as configured",
};

export const count = (amount, one) => `${amount} ${one}${amount === 1 ? "" : "s"}`;

export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

export const number = (value, digits = 0) =>
  value === null || value === undefined ? "–" : value.toFixed(digits);

export const percent = (share) => (share === null || share === undefined ? "–" : `${Math.round(share * 100)} %`);

export function duration(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  if (seconds < 90) return `${Math.round(seconds)} s`;
  return `${Math.round(seconds / 60)} min`;
}

export function age(seconds) {
  if (seconds === null || seconds === undefined) return "never";
  if (seconds < 1) return `${Math.round(seconds * 1000)} ms`;
  return duration(seconds);
}

const CLOCK = new Intl.DateTimeFormat([], {
  hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23",
});
export const time = (date) => CLOCK.format(date);
