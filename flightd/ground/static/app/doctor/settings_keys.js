// A configuration's keys: where they are in the file's table, and values as a person types and reads them.
import { say } from "../language.js";

export const nameOf = ({ section, key }) => `${section}.${key}`;

export const topSections = (keys) => [...new Set(keys.map(({ section }) => section.split(".")[0]))];

// The value that the file gives to a key; undefined where it leaves it out.
export const valueIn = (table, name) => name.split(".").reduce((inner, part) => inner?.[part], table);

// As it stands in a field: "" where it is left out.
export function typed(value) {
  if (value === undefined || value === null) return "";
  return Array.isArray(value) ? value.join(", ") : String(value);
}

export const shownValue = (value) => (value === undefined || value === null ? say("default") : typed(value) || say("empty"));

// What was typed as a value of a key: what is no number stays text, which the drone's own words then complain about.
export function readAs(type, text) {
  const said = text.trim();
  if (said === "") return null;
  if (type === "true or false") return said === "true" ? true : said === "false" ? false : said;
  if (type.startsWith("list")) return said.split(",").map((item) => single(type.includes("number") ? "number" : "text", item.trim()));
  return single(type, said);
}

function single(type, text) {
  const value = Number(text);
  return type.includes("number") && text !== "" && Number.isFinite(value) ? value : text;
}

// The changes to send, and this one with them; `undefined` takes it back.
export function withChange(changes, name, value) {
  const { [name]: _, ...others } = changes;
  return value === undefined ? others : { ...others, [name]: value };
}

export const isSame = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);
