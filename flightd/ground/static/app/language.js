// English or German.  Every text stands in English where it is said; its German is looked up here in german/, which
// is fetched only for who reads German.  Plural forms stand in one text, "{n} node|{n} nodes", and go by `n`.
import { html } from "./html.js";

const KEPT = "flightd.language";
export const LANGUAGES = { en: "English", de: "Deutsch" };

let current = "en";
let wanted = "en";
let german = null; // {english: german}, once it is fetched
let translated = null; // what somebody else says, in parts: {text, foreign: it stays English}

export const language = () => current;
const inGerman = (text) => (current === "de" ? german[text] : undefined);

// What was chosen in this browser, else what the browser is set to.
export function preferred() {
  const asked = navigator.languages.map((one) => one.split("-")[0]).find((one) => one in LANGUAGES) ?? "en";
  try {
    const kept = localStorage.getItem(KEPT);
    return kept in LANGUAGES ? kept : asked;
  } catch {
    return asked;
  }
}

export function keep(one) {
  try {
    localStorage.setItem(KEPT, one);
  } catch {
    // a browser that keeps nothing goes by its own setting when the page is loaded anew
  }
}

// Speak a language from now on: an Error where its texts cannot be had.
export async function speak(one) {
  wanted = one;
  if (one === "de" && !german) {
    const { TEXTS, REPORTED, readerOf } = await import("./german/catalogue.js");
    german = TEXTS;
    translated = readerOf(TEXTS, REPORTED, decimal);
  }
  if (wanted !== one) return; // another was chosen meanwhile
  current = one;
  document.documentElement.lang = one;
}

// A text in the reader's language, with its {names} filled in.
export const say = (text, values) => filled(formed(text, values), values);

// The same with what is drawn in it, such as a link: a list of texts and elements.
export const sayWith = (text, values) =>
  formed(text, values).split(/\{(\w+)\}/).map((part, i) => (i % 2 ? told(values[part]) : part));

// An English text that is said, or reported, later.
export const english = (text, values) => filled(text, values);

// What the drone or the station says, or an error: in German where that is known, else marked as English.
// `shaped` is done to its beginning.
export function quoted(text, shaped = (beginning) => beginning) {
  if (!text || current !== "de") return text && shaped(text);
  const [first, ...others] = translated(text);
  const parts = [{ ...first, text: shaped(first.text) }, ...others];
  if (!parts.some(({ foreign }) => foreign)) return joined(parts);
  return parts.map((part) => (part.foreign ? html`<span lang="en">${part.text}</span>` : part.text));
}

// The same where half a translation would be none: as a whole in German, or as a whole in English.
export function quotedWhole(text, shaped = (beginning) => beginning) {
  const isForeign = text && current === "de" && translated(text).some(({ foreign }) => foreign);
  return isForeign ? html`<span lang="en">${shaped(text)}</span>` : quoted(text, shaped);
}

// The same as a bare text, for titles and labels.
export const quotedText = (text) => (text && current === "de" ? joined(translated(text)) : text);

const joined = (parts) => parts.map(({ text }) => text).join("");

// A number with so many decimals, and its comma or point.
export const decimal = (value, digits = 0) => numbers(`${digits} ${locale()}`, { minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value);
export const plain = (value) => numbers(locale(), { maximumFractionDigits: 9 }).format(value);

// Dates in the reader's own zone.
export const dateFormat = (options) => ({
  format: (date) => formats(`${JSON.stringify(options)} ${locale()}`, () => new Intl.DateTimeFormat(locale(), options)).format(date),
});

const made = new Map();
function formats(key, make) {
  if (!made.has(key)) made.set(key, make());
  return made.get(key);
}
const numbers = (key, options) => formats(key, () => new Intl.NumberFormat(locale(), { useGrouping: false, ...options }));

// As the browser is set where it is set to this language: its dates may differ from country to country.
const locale = () => navigator.languages.find((one) => one.split("-")[0] === current && isKnown(one)) ?? { en: "en-GB", de: "de-DE" }[current];

function isKnown(one) {
  try {
    return Intl.getCanonicalLocales(one).length > 0;
  } catch {
    return false;
  }
}

function formed(text, values) {
  const [one, many = one] = (inGerman(text) ?? text).split("|");
  return one === many || formats(`plural ${current}`, () => new Intl.PluralRules(current)).select(values.n) === "one" ? one : many;
}

const filled = (text, values) => (values ? text.replace(/\{(\w+)\}/g, (whole, name) => told(values[name] ?? whole)) : text);
const told = (value) => (typeof value === "number" ? plain(value) : value);
