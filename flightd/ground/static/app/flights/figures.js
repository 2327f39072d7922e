// The figures of a flight: how each is named, told and compared.  The same in list, playback and comparison.
import { number } from "../words.js";

const cm = (value) => (value == null ? null : value * 100);

// `of` gives the number (null: unknown), `better` says which way is: "less", "more" or "".
export const FIGURES = [
  { key: "duration", name: "Duration", unit: "", of: (row) => row.duration_s, told: clock, better: "" },
  { key: "nodes", name: "Nodes", unit: "", of: (row) => row.nodes_visited, told: (value, row) => ofAll(value, row.nodes_planned), better: "more" },
  { key: "cross", name: "Cross-track rms", unit: "cm", of: (row) => cm(row.cross_track_rms_m), digits: 1, better: "less" },
  { key: "hover", name: "Hover p95", unit: "cm", of: (row) => cm(row.hover_error_p95_m), digits: 1, better: "less" },
  { key: "landing", name: "Landing error", unit: "cm", of: (row) => cm(row.landed_error_m), digits: 1, better: "less" },
  { key: "codes", name: "Codes", unit: "", of: (row) => (row.codes_expected ? row.codes_read : null), told: (value, row) => ofAll(value, row.codes_expected), better: "more" },
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
  if (Number(Math.abs(by).toFixed(digits)) === 0) return { text: "same", better: null };
  const better = figure.better ? (by < 0) === (figure.better === "less") : null;
  return { text: `${by < 0 ? "−" : "+"}${size}${figure.unit ? ` ${figure.unit}` : ""}`, better };
}

function ofAll(value, all) {
  return all == null ? `${value}` : `${value} of ${all}`;
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
  const rest = ((tenths % 600) / 10).toFixed(1).padStart(4, "0");
  return `${Math.floor(tenths / 600)}:${rest}`;
}

const DATE = new Intl.DateTimeFormat([], { year: "numeric", month: "short", day: "numeric", hour: "2-digit", minute: "2-digit", hourCycle: "h23" });
const FULL_DATE = new Intl.DateTimeFormat([], { dateStyle: "full", timeStyle: "long" });

// In the reader's own zone.
export const date = (row) => DATE.format(new Date(row.started_s * 1000));
export const fullDate = (row) => FULL_DATE.format(new Date(row.started_s * 1000));

const OUTCOMES = {
  __proto__: null,
  completed: "Completed", aborted: "Aborted", "taken over": "Pilot took over", unfinished: "Unfinished",
  flying: "Flying", "": "No flight",
};
export const outcomeWords = (row) => OUTCOMES[row.outcome] ?? row.outcome;
export const verdictWords = (row) => ({ good: "Good", bad: "Bad" })[row.verdict] ?? "–";
export const faultWords = (row) => row.faults.map((kind) => kind.replaceAll("_", " ")).join(", ");

// "good", "bad" or "open": how it is coloured.
export function tone(row) {
  if (row.verdict) return row.verdict === "good" ? "good" : "bad";
  return { completed: "good", aborted: "bad" }[row.outcome] ?? "open";
}
export const isBroken = (row) => row.outcome === "" || (row.trouble !== "" && !row.running);
