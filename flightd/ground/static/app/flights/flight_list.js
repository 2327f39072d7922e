// The list of flights: sorted, filtered, and two of them chosen to be compared.
import { HowFlightsCome } from "../how_flights_come.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { goTo } from "../router.js";
import { hasSingleKeys } from "../single_keys.js";
import { capital } from "../words.js";
import { date, faultWords, FIGURES, fullDate, outcomeWords, told, tone, verdictWords } from "./figures.js";
import { flightsState, turnChosen, watchList } from "./flights_state.js";
import { Thumbnail } from "./thumbnail.js";
import { COLUMNS, readSelection, selectedBy, selectionHref, SHOWN } from "./selection.js";

const AT_ONCE = 100;

export function FlightList({ route }) {
  useEffect(watchList, []);
  const { list, chosen } = flightsState();
  const selection = readSelection(route.query);
  const [most, setMost] = useState(AT_ONCE);
  const choose = (change) => goTo(selectionHref({ ...selection, ...change }), { replace: true });
  if (!list.folder) return html`<${NoFolder} />`;
  const rows = selectedBy(list.rows, route.query);
  return html`
    <div class="flights">
      <div class="flights-head">
        <h2>${say("Flights")}</h2>
        <${Search} selection=${selection} choose=${choose} />
        <${Compare} chosen=${chosen} rows=${list.rows} />
      </div>
      <p class="quiet" role="status">${stateWords(list, rows)}</p>
      ${list.trouble && html`<p class="bad-line">${quoted(list.trouble, capital)}</p>`}
      ${list.looked && list.rows.length === 0 && !list.unread && html`<${HowFlightsCome} />`}
      ${rows.length > 0 &&
      html`<${Table} rows=${rows.slice(0, most)} selection=${selection} choose=${choose} chosen=${chosen} />`}
      ${rows.length > most &&
      html`<button class="order more" onClick=${() => setMost(most + AT_ONCE)}>
        ${say("Show {n} more of {all}", { n: Math.min(AT_ONCE, rows.length - most), all: rows.length })}
      </button>`}
    </div>
  `;
}

function NoFolder() {
  return html`
    <section class="card empty"><h2>${say("No folder of flights")}</h2>
      <p>${sayWith("Start the station with one: {command} lists every flight log below {folder}.", { command: html`<code>flightd ground --folder out</code>`, folder: html`<code>out</code>` })}</p>
    </section>
  `;
}

function stateWords(list, rows) {
  if (!list.looked && !list.rows.length) return say("Looking through the folder …");
  const n = list.rows.length;
  const parts = [rows.length === n ? say("{n} flight|{n} flights", { n }) : say("{shown} of {n} flight|{shown} of {n} flights", { shown: rows.length, n })];
  if (list.unread) parts.push(say("{n} still to be read", { n: list.unread }));
  if (list.cut) parts.push(say("more lie there than are listed"));
  return parts.join(", ");
}

function Search({ selection, choose }) {
  const field = useRef(null);
  useEffect(() => {
    const onKey = (event) => {
      if (event.key !== "/" || !hasSingleKeys() || event.target.closest?.("input, textarea, select")) return;
      event.preventDefault();
      field.current?.focus();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
  return html`
    <div class="search" role="search">
      <label class="unseen" for="flight-words">${say("Search flights")}</label>
      <input
        id="flight-words" type="search" ref=${field} placeholder=${hasSingleKeys() ? say("Search: site, node, reason …  ( / )") : say("Search flights")} value=${selection.words}
        onInput=${(event) => choose({ words: event.target.value })}
      />
      <label class="unseen" for="flight-show">${say("Show")}</label>
      <select id="flight-show" value=${selection.shown} onChange=${(event) => choose({ shown: event.target.value })}>
        ${SHOWN.map(([key, name]) => html`<option key=${key} value=${key}>${say(name)}</option>`)}
      </select>
    </div>
  `;
}

function Compare({ chosen, rows }) {
  const there = chosen.filter((id) => rows.some((row) => row.id === id));
  if (there.length < 2) {
    return html`<p class="quiet compare-hint">${there.length ? say("Choose one more to compare") : say("Choose two to compare")}</p>`;
  }
  return html`<a class="order" href=${`/flights/compare?a=${there[0]}&b=${there[1]}`}>${say("Compare both")}</a>`;
}

function Table({ rows, selection, choose, chosen }) {
  const body = useRef(null);
  return html`
    <table class="card list" role="table">
      <thead role="rowgroup">
        <tr role="row">
          <th role="columnheader" scope="col"><span class="unseen">${say("Compare")}</span></th>
          <th role="columnheader" scope="col" class="thumbnail-cell"><span class="unseen">${say("Picture")}</span></th>
          ${COLUMNS.map((column) => html`<${Head} key=${column.key} column=${column} selection=${selection} choose=${choose} />`)}
        </tr>
      </thead>
      <tbody role="rowgroup" ref=${body} onKeyDown=${(event) => moveInRows(event, body.current)}>
        ${rows.map((row) => html`<${Row} key=${row.id} row=${row} isChosen=${chosen.includes(row.id)} />`)}
      </tbody>
    </table>
  `;
}

function Head({ column, selection, choose }) {
  const isSorted = selection.column === column;
  const sorted = { up: "ascending", down: "descending" }[selection.way];
  const turn = () => {
    const other = selection.way === "up" ? "down" : "up";
    choose({ column, way: isSorted ? other : column.first });
  };
  return html`
    <th role="columnheader" scope="col" class=${column.figure ? "figure-cell" : `${column.key}-cell`} aria-sort=${isSorted ? sorted : null}>
      <button onClick=${turn}>
        ${say(column.name)}${column.unit && html` <small>${column.unit}</small>`}
        <span class="arrow" aria-hidden="true">${isSorted ? { up: "▲", down: "▼" }[selection.way] : ""}</span>
      </button>
    </th>
  `;
}

// From row to row by the arrow keys; Enter opens, Space chooses.
function moveInRows(event, body) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
  const row = event.target.closest("tr");
  if (!row || event.target.matches("input")) return;
  if (event.key === " ") {
    event.preventDefault();
    row.querySelector("input")?.click();
    return;
  }
  if (!step) return;
  const links = [...body.querySelectorAll("a.open")];
  links[links.indexOf(row.querySelector("a.open")) + step]?.focus();
  event.preventDefault();
}

function Row({ row, isChosen }) {
  const name = `${row.site || row.path}, ${date(row)}`;
  return html`
    <tr role="row" class=${isChosen ? "chosen" : ""}>
      <td role="cell" class="pick">
        <input type="checkbox" checked=${isChosen} aria-label=${say("Compare {name}", { name })} onChange=${() => turnChosen(row.id)} />
      </td>
      <td role="cell" class="thumbnail-cell"><${Thumbnail} row=${row} /></td>
      <td role="cell" class="date-cell"><a class="open" href=${`/flights/${row.id}`} title=${fullDate(row)}>${date(row)}</a></td>
      <td role="cell" class="site-cell">${row.site || "–"}</td>
      <td role="cell" class="drone-cell">${row.drone || "–"}${row.world && html` <span class="quiet">${row.world}</span>`}</td>
      <td role="cell" class="mission-cell">${quoted(row.mission) || "–"}</td>
      <td role="cell" class="outcome-cell">
        <span class=${`how ${row.outcome === "completed" ? "good" : row.outcome === "aborted" ? "bad" : "open"}`}>${outcomeWords(row)}</span>
        ${row.reason && html`<span class="quiet reason">${quoted(row.reason)}</span>`}
        ${row.trouble && html`<span class="quiet trouble-line">${quoted(row.trouble, capital)}</span>`}
      </td>
      <td role="cell" class="verdict-cell">
        ${row.verdict ? html`<span class=${`badge ${tone(row)}`}>${verdictWords(row)}</span>` : "–"}
        ${row.faults.length > 0 && html`<span class="quiet reason">${faultWords(row)}</span>`}
      </td>
      ${FIGURES.map(
        (figure) => html`
          <td role="cell" key=${figure.key} class=${figure.of(row) == null ? "figure-cell unknown" : "figure-cell"}>
            <span class="label" aria-hidden="true">${say(figure.name)}</span>${told(figure, row)}
            ${figure.unit && told(figure, row) !== "–" && html`<span class="unit"> ${figure.unit}</span>`}
          </td>
        `,
      )}
    </tr>
  `;
}
