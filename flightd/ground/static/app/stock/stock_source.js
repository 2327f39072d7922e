// Asks the station for inventories, places, looks, and what words mean.
import { english } from "../language.js";
import { askStation, isGivenUp } from "../fetching.js";
import { byKey, change, NOTHING, sourceQuery, stock, tellTrouble } from "./stock_state.js";

const API = "/api/stock";
const LOOK_MS = 150;

// The answer's JSON; throws an Error with words for a person.
export async function asked(path, options = {}) {
  const answer = await askStation(`${API}${path}`, { goesOn: options.method === "POST", ...options });
  if (!answer.ok) throw new Error(await refusal(answer));
  return answer;
}

async function refusal(answer) {
  try {
    return (await answer.json()).refused;
  } catch {
    return english("the ground station answers {status}", { status: answer.status });
  }
}

// Which inventories there are; shows `wanted` of them, else the newest.
export async function loadSources(wanted) {
  try {
    const { folder, stores, drones } = await (await asked("")).json();
    const known = [
      ...stores.map(({ name }) => ({ kind: "store", name })),
      ...drones.map((name) => ({ kind: "drone", name })),
    ];
    const is = (a) => (b) => b && a && a.kind === b.kind && a.name === b.name;
    const named = known.find(is(wanted));
    const current = known.find(is(stock().source));
    // a store has pictures and history: one that appears takes the place of a drone that nobody picked
    const stays = current && (current.kind === "store" || stock().picked || stock().chosen);
    const source = named ?? (stays ? current : (known[0] ?? null));
    change({ folder, stores, drones, picked: stock().picked || Boolean(named) });
    tellTrouble("sources", "");
    if (source ? !is(source)(stock().source) : stock().source) show(source);
    if (wanted) tellTrouble("named", named ? "" : english("there is no inventory {name}", { name: wanted.name }));
  } catch (error) {
    if (!isGivenUp(error)) tellTrouble("sources", error.message);
  }
}

export function show(source) {
  change({
    source, tag: "", fronts: [], places: NOTHING, fresh: new Set(), troubles: {}, found: null, words: "", chosen: "", looks: null,
    selected: new Set(), expected: null, decisions: NOTHING,
  });
  return loadPlaces();
}

let loading = false;

export async function loadPlaces() {
  const { source } = stock();
  if (!source || loading) return;
  loading = true;
  try {
    const answer = await asked(`/places?${sourceQuery(source)}`);
    const tag = answer.headers.get("etag");
    if (stock().source !== source) return;
    if (tag === stock().tag) {
      tellTrouble("places", "");
      if (stock().fresh.size) change({ fresh: new Set() });
      return;
    }
    const { fronts, places: told } = await answer.json();
    const places = byKey(told);
    change({ tag, fronts, places, fresh: newlySeen(stock(), places) });
    tellTrouble("places", "");
    const { chosen } = stock();
    if (chosen) loadLooks(chosen);
    if (stock().words) search(stock().words);
  } catch (error) {
    if (stock().source === source && !isGivenUp(error)) tellTrouble("places", error.message);
  } finally {
    loading = false;
    if (stock().source !== source) loadPlaces();
  }
}

function newlySeen({ tag, places: before }, places) {
  if (!tag) return new Set();
  return new Set(Object.keys(places).filter((code) => places[code].seen_s !== before[code]?.seen_s));
}

let looking = new AbortController();
let lookedAt = -LOOK_MS;

// A key that is held goes from place to place faster than the station answers: only where it rests is asked.
export async function loadLooks(code) {
  looking.abort();
  looking = new AbortController();
  const { signal } = looking;
  const { source } = stock();
  if (source.kind === "drone") return change({ looks: { code, looks: [] } });
  const isQuick = performance.now() - lookedAt < LOOK_MS;
  lookedAt = performance.now();
  if (isQuick) await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
  if (signal.aborted) return undefined;
  try {
    const { looks } = await (await asked(`/place?${sourceQuery(source)}&code=${encodeURIComponent(code)}`, { signal })).json();
    if (stock().chosen === code) change({ looks: { code, looks } });
  } catch (error) {
    if (stock().chosen === code && !isGivenUp(error)) change({ looks: { code, looks: [], trouble: error.message } });
  }
}

export async function search(words) {
  change({ words });
  const { source } = stock();
  if (!words.trim() || !source) {
    tellTrouble("search", "");
    return change({ found: null });
  }
  try {
    const { found } = await (await asked(`/find?${sourceQuery(source)}&text=${encodeURIComponent(words)}`)).json();
    if (stock().words === words) change({ found: new Set(found) });
    tellTrouble("search", "");
  } catch (error) {
    if (stock().words === words && !isGivenUp(error)) tellTrouble("search", error.message);
  }
}

export const pictureUrl = (source, name) => `${API}/picture?${sourceQuery(source)}&name=${name}`;

export const exportUrl = (source, format) => `${API}/export?${sourceQuery(source)}&format=${format}`;

export async function outlinesOf(source, name) {
  return (await (await asked(`/outlines?${sourceQuery(source)}&name=${name}`)).json()).outlines;
}
