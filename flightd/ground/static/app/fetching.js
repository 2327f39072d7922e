// The one gate to the station's /api/: so few requests at a time that the browser's six connections are never
// all held, and none for a page that was left.
import { english } from "./language.js";

const MOST = 3;
const ANSWER_MS = 20000;

let running = 0;
const waiting = []; // functions that let the next request begin
let page = new AbortController();

// Ends what was asked for the page that is left.
export function leavePage() {
  page.abort();
  page = new AbortController();
}

// Whether a request ended because its page was left, or it was not wanted any more: no news for a person.
export const isGivenUp = (error) => error.name === "AbortError";

// The whole answer as a Response; throws an Error with words for a person where the station does not answer.
// Questions end with their page; what a person does there (`goesOn`) is carried through.
export async function askStation(url, { signal, ms = ANSWER_MS, goesOn = false, ...options } = {}) {
  const ends = [signal, !goesOn && page.signal].filter(Boolean);
  const given = AbortSignal.any(ends);
  await turn();
  try {
    given.throwIfAborted();
    const answer = await fetch(url, { ...options, signal: AbortSignal.any([...ends, AbortSignal.timeout(ms)]) });
    const { status, headers } = answer;
    return new Response(await answer.blob(), { status, headers }); // its connection is free from here on
  } catch (error) {
    if (given.aborted) throw new DOMException("given up", "AbortError");
    throw new Error(english("the ground station does not answer"), { cause: error });
  } finally {
    const next = waiting.shift();
    if (next) next();
    else running -= 1;
  }
}

async function turn() {
  if (running >= MOST) return new Promise((begin) => waiting.push(begin)); // whoever ends hands its turn on
  running += 1;
  return undefined;
}

// What the station answers to a question, as JSON.  An Error with its words where it refuses.
export async function askJson(url, options) {
  const answer = await askStation(url, options);
  const told = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(told.refused ?? english("the ground station answers {status}", { status: answer.status }));
  return told;
}
