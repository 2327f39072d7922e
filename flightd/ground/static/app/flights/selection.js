// Which flights the list shows, and in which order: read from the address, so that it can be kept and sent.
import { english, quotedText } from "../language.js";
import { faultWords, FIGURES, isBroken, outcomeWords, verdictWords } from "./figures.js";

const text = (value) => (a, b) => value(a).localeCompare(value(b), undefined, { numeric: true });

// Each column: how two rows compare, and which way comes first.
export const COLUMNS = [
  { key: "date", name: english("Date"), compare: (a, b) => a.started_s - b.started_s, first: "down" },
  { key: "site", name: english("Site"), compare: text((row) => row.site), first: "up" },
  { key: "drone", name: english("Drone"), compare: text((row) => row.drone), first: "up" },
  { key: "mission", name: english("Mission"), compare: text((row) => row.mission), first: "up" },
  { key: "outcome", name: english("Outcome"), compare: text(outcomeWords), first: "up" },
  { key: "verdict", name: english("Verdict"), compare: text(verdictWords), first: "up" },
  ...FIGURES.map((figure) => ({
    key: figure.key, name: figure.name, unit: figure.unit, figure, compare: known(figure.of), first: "down",
  })),
];

export const SHOWN = [
  ["", english("All flights")],
  ["good", english("Good verdict")],
  ["bad", english("Bad verdict")],
  ["aborted", english("Not completed")],
  ["trouble", english("Broken or running logs")],
];

// What is unknown comes last, whichever way the others are sorted.
function known(of) {
  return (a, b, sign) => {
    const [x, y] = [of(a), of(b)];
    if (x == null || y == null) return ((x == null) - (y == null)) * sign;
    return x - y;
  };
}

export function readSelection(query) {
  const [key, way] = (query.get("sort") ?? "").split(".");
  const column = COLUMNS.find((one) => one.key === key) ?? COLUMNS[0];
  return {
    words: query.get("q") ?? "",
    shown: SHOWN.some(([one]) => one === query.get("show")) ? query.get("show") : "",
    column,
    way: way === "up" || way === "down" ? way : column.first,
  };
}

export function selectionHref({ words, shown, column, way }) {
  const query = new URLSearchParams();
  if (words) query.set("q", words);
  if (shown) query.set("show", shown);
  if (column.key !== COLUMNS[0].key || way !== column.first) query.set("sort", `${column.key}.${way}`);
  return `/flights${query.size ? `?${query}` : ""}`;
}

function selected(rows, { words, shown, column, way }) {
  const wanted = words.toLocaleLowerCase().split(/\s+/).filter(Boolean);
  const sign = way === "down" ? -1 : 1;
  return rows
    .filter((row) => isShown(row, shown) && wanted.every((word) => everything(row).includes(word)))
    .sort((a, b) => sign * column.compare(a, b, sign) || b.started_s - a.started_s);
}

// The rows that an address chooses.
export const selectedBy = (rows, query) => selected(rows, readSelection(new URLSearchParams(query)));

function isShown(row, shown) {
  if (shown === "good" || shown === "bad") return row.verdict === shown;
  if (shown === "aborted") return row.outcome !== "completed" && row.outcome !== "flying";
  if (shown === "trouble") return row.running || isBroken(row);
  return true;
}

// As the row says it, and as the log has it.
const everything = (row) =>
  [
    row.site, row.drone, row.mission, row.reason, row.verdict, row.path, row.world, row.trouble, ...row.faults,
    outcomeWords(row), verdictWords(row), faultWords(row), ...[row.mission, row.reason, row.trouble].map(quotedText),
  ]
    .join(" ")
    .toLocaleLowerCase();
