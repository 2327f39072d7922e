// The expected stock that the station keeps of an inventory for everybody.
import { isGivenUp } from "../fetching.js";
import { who } from "./decisions.js";
import { asked } from "./stock_source.js";
import { byKey, change, sourceQuery, stock } from "./stock_state.js";

const COMPARE_MS = 60000;

let acts = 0; // of this person so far: what was asked before the newest tells nothing any more
let acting = 0;
let loading = false;

// What is kept, compared with what is counted by now; not in place of what only this tab has.
export async function loadKept() {
  const { source, expected } = stock();
  if (source?.kind !== "store" || loading || acting || isOwn(expected)) return;
  const before = acts;
  loading = true;
  await load(source);
  loading = false;
  if (stock().source !== source || acts !== before) loadKept();
}

async function load(source) {
  const { tag } = stock();
  const before = acts;
  const isOld = () => stock().source !== source || acts !== before || isOwn(stock().expected);
  try {
    const answer = await asked(way(source), { ms: COMPARE_MS });
    const etag = answer.headers.get("etag");
    if (isOld() || (etag && stock().expected?.etag === etag)) return;
    const { kept, comparison } = await answer.json();
    if (isOld()) return;
    if (kept) change({ expected: { ...comparison, kept, etag, tag, name: kept.name, outcomes: byKey(comparison.outcomes) } });
    else if (stock().expected) showNone();
  } catch (error) {
    const { expected } = stock();
    if (expected && !isOld() && !isGivenUp(error)) change({ expected: { ...expected, etag: "", tag, trouble: error.message } });
  }
}

const isOwn = (expected) => Boolean(expected && !expected.kept);
const way = (source, more = "") => `/expected?${sourceQuery(source)}${more}`;

export function showNone() {
  const states = new Set(stock().states);
  states.delete("differs");
  change({ expected: null, states });
}

// Keep a file in place of the one before; one that is refused is shown with the reason, until it is removed.
export async function keep(file) {
  change({ expected: { file, name: file.name, busy: true } });
  const query = `&name=${encodeURIComponent(file.name)}&who=${encodeURIComponent(who())}`;
  const headers = { "Content-Type": "application/octet-stream" };
  if (await done("PUT", query, { headers, body: file })) change({ expected: { kept: {}, name: file.name, busy: true } });
  loadKept();
}

export async function chooseKept(chosen) {
  await done("POST", columnsQuery(chosen));
  loadKept();
}

export async function removeKept() {
  if (await done("DELETE", "")) showNone();
}

export const downloadKept = (format) => asked(way(stock().source, `&format=${format}`), { ms: COMPARE_MS });

// As the station is asked for columns.
export function columnsQuery(chosen) {
  if (!chosen) return "";
  const { place, code, quantity, heading } = chosen;
  return `&place=${place}&code=${code}&quantity=${quantity ?? ""}&heading=${heading ? "yes" : "no"}`;
}

// Whether it was, and its inventory is still shown.
async function done(method, query, options = {}) {
  const { source } = stock();
  acts += 1;
  acting += 1;
  let trouble = "";
  try {
    await asked(way(source, query), { method, ms: COMPARE_MS, goesOn: true, ...options });
  } catch (error) {
    trouble = error.message;
  }
  acting -= 1;
  const stays = stock().source === source && stock().expected;
  if (stays && trouble) change({ expected: { ...stock().expected, busy: false, trouble } });
  return Boolean(stays && !trouble);
}
