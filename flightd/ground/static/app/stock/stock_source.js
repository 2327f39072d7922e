// Asks the station for inventories, places, looks, and what words mean.
import { change, sourceQuery, stock } from "./stock_state.js";

const API = "/api/stock";
const ANSWER_MS = 20000;

// The answer's JSON; throws an Error with words for a person.
export async function asked(path, options = {}) {
  let answer;
  try {
    answer = await fetch(`${API}${path}`, { signal: AbortSignal.timeout(ANSWER_MS), ...options });
  } catch {
    throw new Error("the ground station does not answer");
  }
  if (!answer.ok) throw new Error(await refusal(answer));
  return answer;
}

async function refusal(answer) {
  try {
    return (await answer.json()).refused;
  } catch {
    return `the ground station answers ${answer.status}`;
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
    const source = stays ? current : (named ?? known[0] ?? null);
    change({ folder, stores, drones, trouble: "", picked: stock().picked || Boolean(named) });
    if (!is(source)(stock().source)) show(source);
  } catch (error) {
    change({ trouble: error.message });
  }
}

export function show(source) {
  change({
    source, tag: "", fronts: [], places: {}, fresh: new Set(), trouble: "", found: null, words: "", chosen: "", looks: null,
    expected: null, decisions: {},
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
      if (stock().trouble || stock().fresh.size) change({ trouble: "", fresh: new Set() });
      return;
    }
    const { fronts, places } = await answer.json();
    change({ tag, fronts, places, fresh: newlySeen(stock(), places), trouble: "" });
    const { chosen } = stock();
    if (chosen) loadLooks(chosen);
    if (stock().words) search(stock().words);
  } catch (error) {
    if (stock().source === source) change({ trouble: error.message });
  } finally {
    loading = false;
    if (stock().source !== source) loadPlaces();
  }
}

function newlySeen({ tag, places: before }, places) {
  if (!tag) return new Set();
  return new Set(Object.keys(places).filter((code) => places[code].seen_s !== before[code]?.seen_s));
}

export async function loadLooks(code) {
  const { source } = stock();
  if (source.kind === "drone") return change({ looks: { code, looks: [] } });
  try {
    const { looks } = await (await asked(`/place?${sourceQuery(source)}&code=${encodeURIComponent(code)}`)).json();
    if (stock().chosen === code) change({ looks: { code, looks } });
  } catch (error) {
    if (stock().chosen === code) change({ looks: { code, looks: [], trouble: error.message } });
  }
}

export async function search(words) {
  change({ words });
  const { source } = stock();
  if (!words.trim() || !source) return change({ found: null });
  try {
    const { found } = await (await asked(`/find?${sourceQuery(source)}&text=${encodeURIComponent(words)}`)).json();
    if (stock().words === words) change({ found: new Set(found) });
  } catch (error) {
    if (stock().words === words) change({ trouble: error.message });
  }
}

export const pictureUrl = (source, name) => `${API}/picture?${sourceQuery(source)}&name=${name}`;

export const exportUrl = (source, format) => `${API}/export?${sourceQuery(source)}&format=${format}`;

export async function outlinesOf(source, name) {
  return (await (await asked(`/outlines?${sourceQuery(source)}&name=${name}`)).json()).outlines;
}
