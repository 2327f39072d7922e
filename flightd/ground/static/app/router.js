// Moves between the pages: real paths in one document, so that the way to the drone stays open meanwhile.
import { leavePage } from "./fetching.js";
import { useEffect } from "./html.js";
import { language, say } from "./language.js";
import { pageAt } from "./pages.js";
import { state, update } from "./store.js";

// Where the person is: `page` of PAGES (undefined: none is there), `rest` of the path below it, query and hash.
function routeOf({ pathname, search, hash }) {
  const page = pageAt(pathname);
  const rest = page && pathname.slice(page.path.length).replace(/^\//, "");
  return { page, path: pathname, rest, query: new URLSearchParams(search), hash };
}

// `replace` leaves no step to go back to: for what is chosen on a page rather than gone to.
// `keepFocus`: by what the person does on and on, such as typing.
export function goTo(href, { replace = false, keepFocus = replace } = {}) {
  const url = new URL(href, location.href);
  try {
    if (url.href !== location.href) history[replace ? "replaceState" : "pushState"](null, "", url);
  } catch (error) {
    if (!replace) throw error; // a browser lets a page do so only so often: the next one is kept again
  }
  arrive({ keepFocus });
}

// Follow where the address bar points, and links to our own pages without leaving the document.
export function followLinks() {
  window.addEventListener("popstate", () => arrive());
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.("a[href]");
    if (!link || !isOurs(link) || isForTheBrowser(event)) return;
    event.preventDefault();
    goTo(link.href);
  });
  arrive();
}

// The title anew, in another language; what the page shows is put before it as it is drawn.
export function retitle() {
  if (state.route) document.title = titleOf(state.route);
}

const titleOf = ({ page }) => (page ? `${say(page.title)} · flightd` : "flightd");

// What the page shows now, as soon as it is known, before the page's own name in the title.
export function useTitle(what) {
  const { page, path } = state.route;
  useEffect(() => {
    if (what && page && what !== say(page.title)) document.title = `${what} · ${say(page.title)} · flightd`;
  }, [what, path, language()]);
}

function isOurs(link) {
  const isElsewhere = link.origin !== location.origin || link.target || link.hasAttribute("download");
  const isWithin = link.hash && link.pathname === location.pathname && link.search === location.search;
  return !isElsewhere && !isWithin && pageAt(link.pathname) !== undefined;
}

// Another tab, a download, a menu: what the person asks of the browser itself.
function isForTheBrowser(event) {
  return event.defaultPrevented || event.button !== 0 || event.ctrlKey || event.metaKey || event.shiftKey || event.altKey;
}

function arrive({ keepFocus = false } = {}) {
  const from = state.route;
  const route = routeOf(location);
  if (from && from.page !== route.page) leavePage();
  const isElsewhere = from && from.path !== route.path;
  if (!from || isElsewhere) document.title = titleOf(route);
  update((s) => {
    s.route = route;
  });
  if (!isElsewhere || keepFocus) return;
  window.scrollTo(0, 0);
  document.getElementById("main")?.focus({ preventScroll: true }); // the next Tab is the new page's first
}
