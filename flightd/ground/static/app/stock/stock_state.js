// What the page knows: which inventory is shown, its places as the station read them last, and what is chosen.
import { state, update } from "../store.js";

// By names from outside: a place may be called `constructor`.
export const byKey = (told) => Object.assign(Object.create(null), told);
export const NOTHING = Object.freeze(byKey({}));

const EMPTY = {
  folder: "", // name of the folder in which inventories lie; empty: the station was told none
  stores: null, // [{name, written_s}], newest first; null: not asked yet
  drones: [],
  source: null, // {kind: "store" | "drone", name}
  picked: false, // the person has said which
  tag: "", // of what is shown, as the station names it
  fronts: [],
  places: NOTHING, // code -> {state, texts, confidence, pending, seen_s}
  fresh: new Set(), // places that changed with the newest answer
  troubles: {}, // of each thing that is asked for: sources, named (by the address), places, decisions, search
  states: new Set(), // that are picked out; empty: all
  words: "", // that are looked for
  found: null, // codes of places that the words mean; null: none are looked for
  selected: new Set(), // codes of places that are to be counted again: see selection.js
  chosen: "", // code of the place in the card
  looks: null, // {code, looks} or {code, trouble}
  expected: null, // see expected_stock.js
  decisions: NOTHING, // of each place, oldest first: see decisions.js
  withClosed: false, // places that were decided are listed too
};

export const stock = () => state.stock ?? EMPTY;

export function change(changes) {
  update((s) => {
    s.stock = { ...(s.stock ?? EMPTY), ...changes };
  });
}

// What is the matter with one of the things that are asked for; empty: nothing.
export function tellTrouble(what, text) {
  if ((stock().troubles[what] ?? "") === text) return;
  change({ troubles: { ...stock().troubles, [what]: text } });
}

export function sourceQuery(source) {
  return `${source.kind}=${encodeURIComponent(source.name)}`;
}

// The places in the order in which one walks along them: front by front, level by level.
export const inOrder = (fronts) => fronts.flatMap((front) => front.spots.map(([code]) => code));

// Whether a place is among those that are picked out by states and words.
export function isShown(code, { places, states, found, expected }) {
  const place = places[code];
  if (!place) return false;
  const fits = !states.size || states.has(place.state) || (states.has("differs") && differs(code, expected));
  return fits && (!found || found.has(code));
}

export const differs = (code, expected) => Boolean(expected?.outcomes?.[code]);
