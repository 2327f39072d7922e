// The figures of a flight: how each is named, told and compared.  The same in list, playback and comparison.
import { dateFormat, decimal, english, say } from "../language.js";
import { number } from "../words.js";

const cm = (value) => (value == null ? null : value * 100);

// `of` gives the number (null: unknown), `better` says which way is: "less", "more" or "".
export const FIGURES = [
  { key: "duration", name: english("Duration"), unit: "", of: (row) => row.duration_s, told: clock, better: "" },
  { key: "nodes", name: english("Nodes"), unit: "", of: (row) => row.nodes_visited, told: (value, row) => ofAll(value, row.nodes_planned), better: "more" },
  { key: "cross", name: english("Cross-track rms"), unit: "cm", of: (row) => cm(row.cross_track_rms_m), digits: 1, better: "less" },
  { key: "hover", name: english("Hover p95"), unit: "cm", of: (row) => cm(row.hover_error_p95_m), digits: 1, better: "less" },
  { key: "landing", name: english("Landing error"), unit: "cm", of: (row) => cm(row.landed_error_m), digits: 1, better: "less" },
  { key: "codes", name: english("Codes"), unit: "", of: (row) => (row.codes_expected ? row.codes_read : null), told: (value, row) => ofAll(value, row.codes_expected), better: "more" },
];

export function told(figure, row) {
  const value = figure.of(row);
  if (value == null) return "–";
  if (figure.told) return figure.told(value, row);
  return number(value, figure.digits ?? 0);
}

// A flight without a judge has some figures by what the drone itself believed.
export function withEstimates(row, flight) {
  const judged = Object.fromEntries(Object.entries(row ?? {}).filter(([, value]) => value !== null));
  return { ...flight.estimated, ...judged, estimated: { ...flight.estimated, ...Object.fromEntries(Object.keys(judged).map((key) => [key, null])) } };
}
export const isEstimate = (figure, row) => figure.of(row.estimated ?? {}) != null;

// The difference from `a` to `b` in words, and whether `b` is the better one (null: neither).
export function differenceIn(key, a, b) {
  const figure = FIGURES.find((one) => one.key === key);
  const [from, to] = [figure.of(a), figure.of(b)];
  if (from == null || to == null) return { text: "–", better: null };
  const by = to - from;
  const digits = figure.digits ?? 0;
  const size = figure.key === "duration" ? clock(Math.abs(by)) : number(Math.abs(by), digits);
  if (Number(Math.abs(by).toFixed(digits)) === 0) return { text: say("same"), better: null };
  const better = figure.better ? (by < 0) === (figure.better === "less") : null;
  return { text: `${by < 0 ? "−" : "+"}${size}${figure.unit ? ` ${figure.unit}` : ""}`, better };
}

function ofAll(value, all) {
  return all == null ? `${value}` : say("{value} of {all}", { value, all });
}

export function clock(seconds) {
  const whole = Math.round(Math.max(seconds, 0));
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  const rest = String(whole % 60).padStart(2, "0");
  return hours ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}

// To a tenth: where the playback is.
export function fineClock(seconds) {
  const tenths = Math.round(Math.max(seconds, 0) * 10);
  const rest = decimal((tenths % 600) / 10, 1).padStart(4, "0");
  return `${Math.floor(tenths / 600)}:${rest}`;
}

const DATE = dateFormat({ year: "numeric", month: "short", day: "numeric", hour: "2-digit", minute: "2-digit", hourCycle: "h23" });
const FULL_DATE = dateFormat({ dateStyle: "full", timeStyle: "long" });

// In the reader's own zone.
export const date = (row) => DATE.format(new Date(row.started_s * 1000));
export const fullDate = (row) => FULL_DATE.format(new Date(row.started_s * 1000));

const OUTCOMES = {
  __proto__: null,
  completed: english("Completed"), aborted: english("Aborted"), "taken over": english("Pilot took over"),
  unfinished: english("Unfinished"), flying: english("Flying"), "": english("No flight"),
};
export const outcomeWords = (row) => say(OUTCOMES[row.outcome] ?? row.outcome);
export const verdictWords = (row) => ({ good: say("Good"), bad: say("Bad") })[row.verdict] ?? "–";
const FAULTS = {
  __proto__: null,
  hit_rack: english("hit rack"), hit_ceiling: english("hit ceiling"), hit_keep_out: english("hit keep out"),
  left_leg: english("left leg"), too_high: english("too high"), out_of_control: english("out of control"),
  hard_landing: english("hard landing"), leaned_on_floor: english("leaned on floor"), stayed_up: english("stayed up"),
  stayed_armed: english("stayed armed"), record_lost: english("record lost"), truth_lost: english("truth lost"),
  aborted: english("aborted"), miscounted: english("miscounted"), not_visited: english("not visited"),
  off_pad: english("off pad"), codes_wrong: english("codes wrong"), empty_wrong: english("empty wrong"),
  unanswered: english("places unanswered"), not_found: english("not found"), found_late: english("found late"),
  other_action: english("other action"), other_end: english("other end"), down_late: english("down late"),
};
export const faultWords = (row) => row.faults.map((kind) => say(FAULTS[kind] ?? kind.replaceAll("_", " "))).join(", ");

// "good", "bad" or "open": how it is coloured.
export function tone(row) {
  if (row.verdict) return row.verdict === "good" ? "good" : "bad";
  return { completed: "good", aborted: "bad" }[row.outcome] ?? "open";
}
export const isBroken = (row) => row.outcome === "" || (row.trouble !== "" && !row.running);
