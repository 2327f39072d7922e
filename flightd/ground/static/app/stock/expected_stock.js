// The books that a person uploads: sent to the station with the columns chosen, compared there, kept nowhere.
import { asked } from "./stock_source.js";
import { change, sourceQuery, stock } from "./stock_state.js";

const COMPARE_MS = 60000;

// What is known of the upload: {name, busy, trouble} and, once it was compared, all that the station answers.
export async function upload(file) {
  change({ expected: { file, name: file.name, busy: true } });
  await compare("");
}

// Compare anew with other columns.
export async function choose(columns) {
  const chosen = { ...stock().expected.chosen, ...columns };
  change({ expected: { ...stock().expected, chosen, busy: true } });
  await compare(columnsQuery(chosen));
}

// Again with what was counted since.
export const compareAgain = () => compare(columnsQuery(stock().expected.chosen));

export function forget() {
  const states = new Set(stock().states);
  states.delete("differs");
  change({ expected: null, states });
}

let newest = 0;

async function compare(columns) {
  const number = ++newest;
  const { expected, source, tag } = stock();
  const isOld = () => number !== newest || stock().source !== source || stock().expected?.file !== expected.file;
  try {
    const answer = await (await posted(columns)).json();
    if (!isOld()) change({ expected: { file: expected.file, name: expected.name, tag, ...answer } });
  } catch (error) {
    if (!isOld()) change({ expected: { ...stock().expected, busy: false, tag, trouble: error.message } });
  }
}

function posted(query) {
  const { expected, source } = stock();
  return asked(`/compare?${sourceQuery(source)}${query}`, {
    method: "POST",
    headers: { "Content-Type": "application/octet-stream" },
    body: expected.file,
    signal: AbortSignal.timeout(COMPARE_MS),
  });
}

function columnsQuery(chosen) {
  if (!chosen) return "";
  const { place, code, quantity, heading } = chosen;
  return `&place=${place}&code=${code}&quantity=${quantity ?? ""}&heading=${heading ? "yes" : "no"}`;
}

// Hand the whole comparison to the person as a file.
export async function download(format) {
  try {
    const answer = await posted(`${columnsQuery(stock().expected.chosen)}&format=${format}`);
    const url = URL.createObjectURL(await answer.blob());
    Object.assign(document.createElement("a"), { href: url, download: `comparison.${format}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  } catch (error) {
    change({ expected: { ...stock().expected, trouble: error.message } });
  }
}
