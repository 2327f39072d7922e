// A map under the editor's hands: {site, lists: {aisle: [{values, at}], …}, text}.  Functions here give new drafts
// and leave the old ones as they are; what the station said of a draft is never worked out here.
import { say } from "../language.js";

export const LISTS = ["aisle", "cross", "blocked", "keep_out", "rack", "pad", "marker"];

export const rounded = (value) => Math.round(value * 1e6) / 1e6;
const isNumber = (value) => typeof value === "number" && Number.isFinite(value);
const measure = (value) => (isNumber(value) ? value : 0);

export const rowsOf = (draft, table) => draft.lists[table] ?? [];

export function valuesOf(draft, { table, index }) {
  return table === "site" ? draft.site : rowsOf(draft, table)[index]?.values;
}

const withList = (draft, table, rows) => ({ ...draft, lists: { ...draft.lists, [table]: rows } });

// With other values of one table; a value of undefined takes its key out.
export function withValues(draft, { table, index }, changes) {
  const values = { ...valuesOf(draft, { table, index }), ...changes };
  for (const key of Object.keys(values)) if (values[key] === undefined) delete values[key];
  if (table === "site") return { ...draft, site: values };
  return withList(draft, table, rowsOf(draft, table).map((row, i) => (i === index ? { ...row, values } : row)));
}

export function withNew(draft, table, values) {
  return withList(draft, table, [...rowsOf(draft, table), { values, at: null }]);
}

// Without one element, and without the lines and pads on it that would hang in the air.
export function without(draft, { table, index }) {
  const gone = rowsOf(draft, table)[index];
  const rest = withList(draft, table, rowsOf(draft, table).filter((_, i) => i !== index));
  if (table !== "aisle" || typeof gone?.values.id !== "string") return rest;
  const { id } = gone.values;
  const renamed = (node) => (aisleOf(node) === id ? null : node);
  return withNodes(rest, renamed, (aisle) => (aisle === id ? null : aisle));
}

export const aisleOf = (node) => (typeof node === "string" ? node.replace(/\d+$/, "") : "");

// Every node: {id, x_m, y_m, aisle: index of its aisle, number from 0}.
export function nodesOf(draft) {
  return rowsOf(draft, "aisle").flatMap(({ values }, aisle) =>
    placesOf(values).map((x, number) => ({ id: `${values.id}${number + 1}`, x_m: x, y_m: measure(values.y_m), aisle, number })),
  );
}

// x of each node of an aisle
export function placesOf(values) {
  const steps = Array.isArray(values.spacing_m) ? values.spacing_m.map(measure) : [];
  return steps.reduce((places, step) => [...places, rounded(places.at(-1) + step)], [measure(values.x_m)]);
}

function withPlaces(draft, index, places) {
  const spacing = places.slice(1).map((x, i) => rounded(x - places[i]));
  return withValues(draft, { table: "aisle", index }, { x_m: rounded(places[0]), spacing_m: spacing });
}

// A node elsewhere along its aisle, between its neighbours; the others stay.
export function withNodeAt(draft, index, number, x) {
  const places = placesOf(rowsOf(draft, "aisle")[index].values);
  const near = 0.05;
  const least = number > 0 ? places[number - 1] + near : -Infinity;
  const most = number < places.length - 1 ? places[number + 1] - near : Infinity;
  places[number] = Math.min(Math.max(x, least), most);
  return withPlaces(draft, index, places);
}

// One more node behind a node: in the middle of the way to the next one, or as far on as the last one.
export function withNodeAfter(draft, index, number) {
  const { values } = rowsOf(draft, "aisle")[index];
  const places = placesOf(values);
  const isLast = number === places.length - 1;
  const step = places.length > 1 ? places.at(-1) - places.at(-2) : 1.5;
  const x = isLast ? places[number] + step : (places[number] + places[number + 1]) / 2;
  places.splice(number + 1, 0, rounded(x));
  const grown = withPlaces(draft, index, places);
  return renumbered(grown, values.id, (n) => (n > number + 1 ? n + 1 : n));
}

// Without a node; an aisle keeps two.
export function withoutNode(draft, index, number) {
  const { values } = rowsOf(draft, "aisle")[index];
  const places = placesOf(values);
  if (places.length < 3) return draft;
  places.splice(number, 1);
  const shrunk = withPlaces(draft, index, places);
  return renumbered(shrunk, values.id, (n) => (n === number + 1 ? null : n > number + 1 ? n - 1 : n));
}

function renumbered(draft, id, toNumber) {
  return withNodes(draft, (node) => {
    if (aisleOf(node) !== id) return node;
    const number = toNumber(Number(node.slice(id.length)));
    return number === null ? null : `${id}${number}`;
  });
}

// An aisle of another name, and everything that names it or its nodes.
export function withAisleNamed(draft, index, id) {
  const before = rowsOf(draft, "aisle")[index].values.id;
  const named = withValues(draft, { table: "aisle", index }, { id });
  if (typeof before !== "string" || rowsOf(draft, "aisle").filter(({ values }) => values.id === before).length > 1) return named;
  return withNodes(
    named,
    (node) => (aisleOf(node) === before ? `${id}${node.slice(before.length)}` : node),
    (aisle) => (aisle === before ? id : aisle),
  );
}

// With nodes, and aisles of racks, named otherwise wherever they are named; null: what names it goes.
function withNodes(draft, renamed, aisleRenamed = (aisle) => aisle) {
  const pairs = (rows) =>
    rows
      .map((row) => (Array.isArray(row.values.nodes) ? changed(row, "nodes", row.values.nodes.map(renamed)) : row))
      .filter(({ values }) => !(Array.isArray(values.nodes) && values.nodes.includes(null)));
  const pads = rowsOf(draft, "pad")
    .map((row) => changed(row, "node", renamed(row.values.node)))
    .filter(({ values }) => values.node !== null);
  const racks = rowsOf(draft, "rack").map((row) =>
    Array.isArray(row.values.aisles)
      ? changed(row, "aisles", row.values.aisles.map(aisleRenamed).filter((aisle) => aisle !== null))
      : row,
  );
  const lists = { cross: pairs(rowsOf(draft, "cross")), blocked: pairs(rowsOf(draft, "blocked")), pad: pads, rack: racks };
  return { ...draft, lists: { ...draft.lists, ...lists } };
}

function changed(row, key, value) {
  return JSON.stringify(row.values[key]) === JSON.stringify(value) ? row : { ...row, values: { ...row.values, [key]: value } };
}

// How an element is called in lists and headings.
export function titleOf(draft, { table, index }) {
  const values = valuesOf(draft, { table, index }) ?? {};
  const pair = (values.nodes ?? []).join(` ${say("to")} `);
  switch (table) {
    case "site": return say("Site {site}", { site: values.name ?? "" });
    case "aisle": return say("Aisle {id}", { id: values.id ?? "?" });
    case "cross": return say("Cross {pair}", { pair });
    case "blocked": return say("Blocked {pair}", { pair });
    case "keep_out": return say("Keep-out {number}", { number: index + 1 });
    case "rack": return say("Rack {rack}", { rack: index + 1 });
    case "pad": return say("Pad {id}", { id: values.id ?? "?" });
    default: return say("Marker {id}", { id: values.id ?? "?" });
  }
}
