// Reads in German what drone and station say in English: as a whole, by a pattern with its figures in it, or in its
// parts, FILE: KEY: WHAT; REMEDY.
const MOST_KEPT = 500;
const MOST_PARTS = 8; // of a text that is taken to pieces
const PLACE = /\{(\w+)\}/;
const NAME = /^(?:\S*|'.*'|".*"|\S+ \(\S*\)\S*)$/s; // one word, quoted, or a key as `pad[0] (home).node`
const LIST = /^\S+(?:, \S+)+$/;
// Fields that are shown as they are, even where such a word has its German.
const VERBATIM = new Set(["columns", "drone", "file", "folder", "home", "key", "known", "name", "node", "pad", "person", "site", "url"]);

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
    const doubtful = []; // a name that looks like none may be another text
    for (const { pattern, names, german } of patterns) {
      const found = pattern.exec(text)?.slice(1);
      if (!found) continue;
      const parts = german.flatMap((part, i) => (i % 2 ? filled(part, found[names.indexOf(part)]) : [{ text: part }]));
      if (names.every((name, i) => !VERBATIM.has(name) || isName(found[i]))) yield parts;
      else doubtful.push(parts);
    }
    yield* composed(text);
    yield* doubtful;
  }

  // As what stands between signs.
  function* composed(text) {
    if (text.endsWith(".")) yield [...read(text.slice(0, -1)), { text: "." }];
    const places = [...text.matchAll(/[;:] /g)].filter(({ index }) => index > 0);
    if (places.length <= MOST_PARTS) {
      for (const { index, 0: sign } of places) {
        yield [...figure(text.slice(0, index)), { text: sign }, ...figure(text.slice(index + 2))];
      }
    }
    const [, found, remedy] = /^(.+?) \((.+)\)$/s.exec(text) ?? [];
    if (found) yield [...figure(found), { text: " (" }, ...figure(remedy), { text: ")" }];
    const listed = places.length ? [] : text.split(", ");
    if (listed.length > 1) yield* onlyKnown(listed.flatMap((one, i) => [...(i ? [{ text: ", " }] : []), ...figure(one)]));
    const [, count, counted] = /^(\d+ )(.+)$/s.exec(text) ?? [];
    if (count) yield* onlyKnown([{ text: count }, ...read(counted)]);
  }

  const isName = (text) => NAME.test(text) || LIST.test(text) || !/[a-z]{2}|: /.test(text);
  const filled = (name, text) => (VERBATIM.has(name) && isName(text) ? [{ text }] : figure(text));

  // What stands in such a text: a number, a name, or another text.
  function figure(text) {
    const [, digits] = /^-?\d+\.(\d+)$/.exec(text) ?? [];
    if (digits) return [{ text: decimal(Number(text), digits.length) }];
    return isName(text) && !LIST.test(text) ? [{ text: texts[text] ?? text }] : read(text);
  }

  return (text) => {
    if (kept.size >= MOST_KEPT) kept.clear();
    return read(text);
  };
}

const onlyKnown = (parts) => (parts.some(({ foreign }) => foreign) ? [] : [parts]);

// The first way that leaves nothing English, else the one that leaves least.
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
