// How what drone and station say in English is read in German: as a whole, by a pattern with its figures in it, or
// as they put it together, FILE: KEY: WHAT; REMEDY, each part for itself.
const MOST_KEPT = 500;
const MOST_PARTS = 8; // of a text that is taken to pieces
const PLACE = /\{(\w+)\}/;
const NAME = /^(?:\S*|'.*'|".*"|\S+ \(\S*\)\S*)$/s; // one word, quoted, or a key as `pad[0] (home).node`

// A function from such a text to its parts: {text, foreign: it stays English}.  `texts`: {english: german}, with
// {names} in those that are `reported`; `decimal` writes a number with so many decimals.
export function readerOf(texts, reported, decimal) {
  const patterns = Object.entries(reported)
    .filter(([english]) => PLACE.test(english))
    .map(patternOf)
    .sort((a, b) => b.fixed - a.fixed);
  const kept = new Map();

  function read(text) {
    if (!kept.has(text)) kept.set(text, leastForeign(ways(text)) ?? [{ text, foreign: true }]);
    return kept.get(text);
  }

  function* ways(text) {
    const whole = texts[text] ?? texts[text.charAt(0).toLowerCase() + text.slice(1)];
    if (whole !== undefined) yield [{ text: whole }];
    for (const { pattern, names, german } of patterns) {
      const found = pattern.exec(text);
      if (found) yield german.flatMap((part, i) => (i % 2 ? figure(found[names.indexOf(part) + 1]) : [{ text: part }]));
    }
    if (text.endsWith(".")) yield [...read(text.slice(0, -1)), { text: "." }];
    const places = [...text.matchAll(/[;:] /g)];
    if (places.length >= MOST_PARTS) return;
    for (const { index, 0: between } of places) {
      if (index > 0) yield [...figure(text.slice(0, index)), { text: between }, ...figure(text.slice(index + 2))];
    }
  }

  // What stands in such a text: a number, a name, or another text.
  function figure(text) {
    const [, digits] = /^-?\d+\.(\d+)$/.exec(text) ?? [];
    if (digits) return [{ text: decimal(Number(text), digits.length) }];
    return NAME.test(text) || !/[a-z]{2}/.test(text) ? [{ text: texts[text] ?? text }] : read(text);
  }

  return (text) => {
    if (kept.size >= MOST_KEPT) kept.clear();
    return read(text);
  };
}

// Of the ways to read a text the first that leaves nothing English, else the one that leaves least.
function leastForeign(ways) {
  let best;
  let least = Infinity;
  for (const parts of ways) {
    const left = parts.reduce((sum, { text, foreign }) => sum + (foreign ? text.length : 0), 0);
    if (left < least) [best, least] = [parts, left];
    if (left === 0) break;
  }
  return best;
}

function patternOf([english, german]) {
  const escaped = english.replace(/[.*+?^$()|[\]\\]/g, "\\$&");
  return {
    pattern: new RegExp(`^${escaped.replace(/\{\w+\}/g, "(.+?)")}$`, "s"),
    names: [...english.matchAll(/\{(\w+)\}/g)].map(([, name]) => name),
    german: german.split(PLACE),
    fixed: english.replace(/\{\w+\}/g, "").length,
  };
}
