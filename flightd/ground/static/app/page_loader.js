// Fetches a page's module and styles once, when it is first shown.

const STYLES = "/static/style/";
const known = new Map(); // page -> {component, sheets} | {failed: true} | {}
const fetched = new Map(); // name of a style sheet -> promise of it

// What is there of a page: its component, that it cannot be had, or nothing yet; `onChange` once that changes.
// A page that is there is dressed at once: in its own styles, in their order, and in no other page's.
export function loaded(page, onChange) {
  const now = known.get(page);
  if (now) {
    if (now.sheets) dressed(now.sheets);
    return now;
  }
  known.set(page, {});
  Promise.all([page.load(), ...page.styles.map(sheet)])
    .then(([module, ...sheets]) => known.set(page, { component: module.default, sheets }))
    .catch(() => known.set(page, { failed: true }))
    .then(onChange);
  return {};
}

function dressed(sheets) {
  const worn = document.adoptedStyleSheets;
  if (worn.length !== sheets.length || sheets.some((one, i) => worn[i] !== one)) document.adoptedStyleSheets = sheets;
}

// Try a page again that could not be had.
export const forget = (page) => known.delete(page);

function sheet(name) {
  if (!fetched.has(name)) {
    const coming = read(name);
    fetched.set(name, coming);
    coming.catch(() => fetched.delete(name));
  }
  return fetched.get(name);
}

async function read(name) {
  const answer = await fetch(`${STYLES}${name}`);
  if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
  const made = new CSSStyleSheet();
  made.replaceSync(await answer.text());
  return made;
}
