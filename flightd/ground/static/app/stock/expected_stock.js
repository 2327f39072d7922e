// The books that a viewer uploads: compared by the station, kept in this tab alone.
import { mayOperate } from "../access/session.js";
import { isGivenUp } from "../fetching.js";
import { chooseKept, columnsQuery, downloadKept, keep, loadKept, removeKept, showNone } from "./kept_stock.js";
import { asked } from "./stock_source.js";
import { byKey, change, sourceQuery, stock } from "./stock_state.js";

const COMPARE_MS = 60000;

// What is known of the upload: {name, busy, trouble}; once it was compared, all that the station answers; `kept`
// where the station keeps it, else `file`.
export async function upload(file) {
  if (mayOperate()) return keep(file);
  change({ expected: { file, name: file.name, busy: true } });
  return compare("");
}

// Compare anew with other columns.
export async function choose(columns) {
  const chosen = { ...stock().expected.chosen, ...columns };
  change({ expected: { ...stock().expected, chosen, busy: true } });
  return stock().expected.kept ? chooseKept(chosen) : compare(columnsQuery(chosen));
}

// Again with what was counted since; not while one runs: it is asked for again when that one ends.
export function compareAgain() {
  if (stock().expected.kept) loadKept();
  else if (!comparing) compare(columnsQuery(stock().expected.chosen));
}

export async function forget() {
  if (stock().expected.kept) return removeKept();
  showNone();
  return loadKept();
}

let comparing = null; // {file, source, ending} of the one comparison that runs
let columnsWanted = null; // of the one that comes next

// One at a time: of those that are asked for meanwhile the newest comes next.
async function compare(columns) {
  const { expected, source } = stock();
  columnsWanted = columns;
  if (comparing) {
    if (comparing.file !== expected.file || comparing.source !== source) comparing.ending.abort();
    return;
  }
  while (columnsWanted !== null && stock().expected) {
    const wanted = columnsWanted;
    columnsWanted = null;
    await compareOnce(wanted);
  }
  columnsWanted = null;
}

async function compareOnce(columns) {
  const { expected, source, tag } = stock();
  comparing = { file: expected.file, source, ending: new AbortController() };
  const isOld = () => columnsWanted !== null || stock().source !== source || stock().expected?.file !== expected.file;
  try {
    const answer = await (await posted(columns, { signal: comparing.ending.signal, goesOn: false })).json();
    if (!isOld()) change({ expected: { file: expected.file, name: expected.name, tag, ...answer, outcomes: byKey(answer.outcomes) } });
  } catch (error) {
    const known = isGivenUp(error) ? {} : { tag, trouble: error.message }; // given up: again when the page is back
    if (!isOld()) change({ expected: { ...stock().expected, busy: false, ...known } });
  } finally {
    comparing = null;
  }
}

function posted(query, options = {}) {
  const { expected, source } = stock();
  return asked(`/compare?${sourceQuery(source)}${query}`, {
    method: "POST",
    headers: { "Content-Type": "application/octet-stream" },
    body: expected.file,
    ms: COMPARE_MS,
    ...options,
  });
}

// Hand the whole comparison to the person as a file.
export async function download(format) {
  const { kept } = stock().expected;
  try {
    const answer = await (kept ? downloadKept(format) : posted(`${columnsQuery(stock().expected.chosen)}&format=${format}`));
    const url = URL.createObjectURL(await answer.blob());
    Object.assign(document.createElement("a"), { href: url, download: `comparison.${format}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  } catch (error) {
    change({ expected: { ...stock().expected, trouble: error.message } });
  }
}
