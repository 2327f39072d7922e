// The page Stock: every place of an inventory as it stands, filling while a flight counts.
import { HowFlightsCome } from "../how_flights_come.js";
import { html, useEffect } from "../html.js";
import { quoted, say } from "../language.js";
import { goTo } from "../router.js";
import { state } from "../store.js";
import { loadDecisions } from "./decisions.js";
import { Elevations, placeCell } from "./elevations.js";
import { ExceptionsCard } from "./exceptions_card.js";
import { ExpectedCard } from "./expected_card.js";
import { FindCard } from "./find_card.js";
import { loadKept } from "./kept_stock.js";
import { PlaceCard } from "./place_card.js";
import { change, stock } from "./stock_state.js";
import { loadLooks, loadPlaces, loadSources } from "./stock_source.js";
import { COUNTED } from "./states.js";

const AGAIN_MS = { store: 1000, drone: 2000 };
const SOURCES_MS = 10000;
const DECISIONS_MS = 4000;
const TROUBLE_MS = 2000;

export default function StockPage({ route }) {
  useEffect(() => stay(route), []);
  useEffect(() => follow(route), [route]);
  const { stores, source, troubles, tag, places, chosen } = stock();
  const trouble = [...new Set(Object.values(troubles).filter(Boolean))].flatMap((one, i) => [i ? "; " : "", quoted(one)]);
  if (!stores) return html`<p class="loading quiet" role="status">${trouble.length ? trouble : say("Loading …")}</p>`;
  if (!source) return html`<${Nothing} />`;
  const codes = Object.keys(places);
  const counted = codes.filter((code) => COUNTED.has(places[code].state)).length;
  return html`
    <div class=${chosen ? "stock with-place" : "stock"}>
      <div class="stock-main">
        <h2 class="stock-title">${say("Stock")} <small>${say("{counted} of {all} places counted", { counted, all: codes.length })}</small></h2>
        ${trouble.length > 0 && html`<p class="stock-trouble" role="alert">${trouble}</p>`}
        <${FindCard} onChoose=${choose} />
        ${codes.length > 0 && html`<${Elevations} onChoose=${choose} />`}
        ${codes.length === 0 && tag && html`<p class="quiet">${say("Nothing was counted yet.")}</p>`}
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
    <section class="card empty"><h2>${say("No inventory yet")}</h2>
      <p>${folder ? say("No inventory lies under the station's folder.") : say("Name the folder in which inventories lie:")}
        ${!folder && html` <code>flightd ground --folder out</code>`}</p>
      ${folder && html`<${HowFlightsCome} />`}</section>
  `;
}

// The inventory that an address names; null: none.
function wantedOf({ query }) {
  for (const kind of ["store", "drone"]) {
    if (query.has(kind)) return { kind, name: query.get(kind) };
  }
  return null;
}

// To another inventory that the address names while the page is shown.
function follow(route) {
  const { stores, source } = stock();
  const wanted = wantedOf(route);
  if (stores && wanted && !(source?.kind === wanted.kind && source.name === wanted.name)) loadSources(wanted);
}

// Asks again and again while the page is shown and can be seen.
function stay(route) {
  let asking = true;
  let arrived = false;
  let timer = 0;
  const arrive = async () => {
    await loadSources(wantedOf(route));
    if (!asking || stock().troubles.sources || !stock().stores) return;
    arrived = true;
    const place = route.query.get("place");
    const { chosen, looks } = stock();
    if (place && !stock().troubles.named) choose(place);
    else if (chosen && !looks) loadLooks(chosen); // given up as the page was left
    loadDecisions();
  };
  const again = async () => {
    if (!arrived && !document.hidden) await arrive();
    if (asking && !document.hidden) await loadPlaces();
    if (asking) timer = setTimeout(again, arrived ? (AGAIN_MS[stock().source?.kind] ?? SOURCES_MS) : TROUBLE_MS);
  };
  again();
  const said = () => {
    if (document.hidden) return;
    loadDecisions();
    loadKept();
  };
  const decisions = setInterval(said, DECISIONS_MS);
  const sources = setInterval(() => document.hidden || !arrived || loadSources(null), SOURCES_MS);
  return () => {
    asking = false;
    clearTimeout(timer);
    clearInterval(sources);
    clearInterval(decisions);
  };
}

function choose(code) {
  const { source } = stock();
  if (!source || state.route.page?.path !== "/stock") return; // the person has gone on meanwhile
  change({ chosen: code, looks: null });
  const query = new URLSearchParams({ [source.kind]: source.name, ...(code && { place: code }) });
  goTo(`/stock?${query}`, { replace: true });
  if (!code) return;
  loadLooks(code);
  requestAnimationFrame(() => placeCell(code)?.scrollIntoView({ block: "nearest", inline: "nearest" }));
}
