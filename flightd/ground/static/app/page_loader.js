// Fetches a page's module and styles once, when it is first shown.

const STYLES = "/static/style/";
const known = new Map(); // page -> {component} | {failed: true} | {}

// What is there of a page: its component, that it cannot be had, or nothing yet; `onChange` once that changes.
export function loaded(page, onChange) {
  const now = known.get(page);
  if (now) return now;
  known.set(page, {});
  Promise.all([page.load(), ...page.styles.map(styled)])
    .then(([module]) => known.set(page, { component: module.default }))
    .catch(() => known.set(page, { failed: true }))
    .then(onChange);
  return {};
}

// Try a page again that could not be had.
export const forget = (page) => known.delete(page);

function styled(name) {
  const href = `${STYLES}${name}`;
  const there = document.head.querySelector(`link[href="${href}"]`);
  if (there) return there.sheet ? undefined : settled(there);
  const link = Object.assign(document.createElement("link"), { rel: "stylesheet", href });
  document.head.append(link);
  return settled(link).catch((error) => {
    link.remove();
    throw error;
  });
}

function settled(link) {
  return new Promise((resolve, reject) => {
    link.addEventListener("load", resolve, { once: true });
    link.addEventListener("error", reject, { once: true });
  });
}
