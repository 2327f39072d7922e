// The page Stock: every place of an inventory as it stands, filling while a flight counts.
import { html, useEffect } from "../html.js";
import { goTo } from "../router.js";
import { loadDecisions } from "./decisions.js";
import { Elevations, placeCell } from "./elevations.js";
import { ExceptionsCard } from "./exceptions_card.js";
import { ExpectedCard } from "./expected_card.js";
import { FindCard } from "./find_card.js";
import { PlaceCard } from "./place_card.js";
import { change, stock } from "./stock_state.js";
import { loadLooks, loadPlaces, loadSources } from "./stock_source.js";
import { COUNTED } from "./states.js";

const AGAIN_MS = { store: 1000, drone: 2000 };
const SOURCES_MS = 10000;
const DECISIONS_MS = 4000;

export default function StockPage({ route }) {
  useEffect(() => stay(route), []);
  const { stores, drones, source, trouble, places, chosen } = stock();
  if (!stores) return html`<p class="loading quiet" role="status">${trouble || "Loading …"}</p>`;
  if (!source) return html`<${Nothing} />`;
  const codes = Object.keys(places);
  const counted = codes.filter((code) => COUNTED.has(places[code].state)).length;
  return html`
    <div class=${chosen ? "stock with-place" : "stock"}>
      <div class="stock-main">
        <h2 class="stock-title">Stock <small>${counted} of ${codes.length} places counted</small></h2>
        ${trouble && html`<p class="stock-trouble" role="alert">${trouble}</p>`}
        <${FindCard} onChoose=${choose} />
        ${codes.length > 0 && html`<${Elevations} onChoose=${choose} />`}
        ${codes.length === 0 && !trouble && html`<p class="quiet">Nothing was counted yet.</p>`}
        <${ExceptionsCard} onChoose=${choose} />
        <${ExpectedCard} onChoose=${choose} />
      </div>
      <${PlaceCard} onChoose=${choose} />
    </div>
  `;
}

function Nothing() {
  const { folder } = stock();
  return html`
    <section class="card empty"><h2>No inventory yet</h2>
      <p>${folder ? "No inventory lies under the station's folder." : "Name the folder in which inventories lie:"}
        ${!folder && html` <code>flightd ground --folder out</code>`}</p></section>
  `;
}

// Asks again and again while the page is shown and can be seen.
function stay(route) {
  const store = route.query.get("store");
  const drone = route.query.get("drone");
  const wanted = store !== null ? { kind: "store", name: store } : drone !== null ? { kind: "drone", name: drone } : null;
  const first = loadSources(wanted).then(() => {
    const place = route.query.get("place");
    if (place) choose(place);
  });
  let asking = true;
  let timer = 0;
  const again = async () => {
    if (!document.hidden) await loadPlaces();
    if (asking) timer = setTimeout(again, AGAIN_MS[stock().source?.kind] ?? SOURCES_MS);
  };
  first.then(again).then(loadDecisions);
  const decisions = setInterval(() => document.hidden || loadDecisions(), DECISIONS_MS);
  const sources = setInterval(() => document.hidden || loadSources(null), SOURCES_MS);
  return () => {
    asking = false;
    clearTimeout(timer);
    clearInterval(sources);
    clearInterval(decisions);
  };
}

function choose(code) {
  const { source } = stock();
  change({ chosen: code, looks: null });
  const query = new URLSearchParams({ [source.kind]: source.name, ...(code && { place: code }) });
  goTo(`/stock?${query}`, { replace: true });
  if (!code) return;
  loadLooks(code);
  requestAnimationFrame(() => placeCell(code)?.scrollIntoView({ block: "nearest", inline: "nearest" }));
}
