// One flight played back: map, picture, plots and events at one time.
import { html, useEffect, useMemo, useRef } from "../html.js";
import { english, language, quoted, quotedText, say, sayWith } from "../language.js";
import { useTitle } from "../router.js";
import { capital, phaseWords } from "../words.js";
import { isMark, lastBefore, momentAt, phaseSpans } from "./at_time.js";
import { clock, date, faultWords, FIGURES, fullDate, isEstimate, outcomeWords, told, tone, verdictWords, withEstimates } from "./figures.js";
import { flightsState, forgetFlight, opened } from "./flights_state.js";
import { Playhead } from "./playhead.js";
import { seek, usePlayback } from "./playing.js";
import { Plots } from "./plots.js";
import { ReplayMap } from "./replay_map.js";
import { ReplayPicture } from "./replay_picture.js";

export function Replay({ id }) {
  const known = opened(id);
  if (known.trouble) return html`<${Missing} id=${id} trouble=${known.trouble} />`;
  if (!known.flight) return html`<p class="loading quiet" role="status">${say("Reading the flight …")}</p>`;
  if (!known.flight.moments.length) return html`<${Missing} id=${id} trouble=${english("the log holds no flight")} />`;
  return html`<${Played} id=${id} flight=${known.flight} row=${known.row} />`;
}

export function Missing({ id, trouble }) {
  return html`
    <section class="card empty">
      <h2>${say("The flight cannot be shown")}</h2>
      <p>${quoted(trouble, capital)}.</p>
      <p><button class="order" onClick=${() => forgetFlight(id)}>${say("Try again")}</button> <a href="/flights">${say("All flights")}</a></p>
    </section>
  `;
}

function Played({ id, flight, row }) {
  useTitle(row ? `${title(row, flight)}, ${date(row)}` : title(row, flight));
  const span = useMemo(() => ({ low: 0, high: flight.duration_s }), [flight]);
  const pictures = useMemo(() => flight.pictures.map((picture) => picture.t_s), [flight]);
  const marks = useMemo(() => flight.events.filter(isMark), [flight]);
  const spans = useMemo(() => phaseSpans(flight), [flight]);
  usePlayback(span, pictures);
  const t = Math.min(flightsState().playing.at, flight.duration_s);
  const moment = momentAt(flight, t);
  return html`
    <div class="replay">
      <${ReplayHead} id=${id} flight=${flight} row=${row} />
      <div class="sight"><${ReplayMap} shown=${[{ flight, t, kind: "", name: say("The drone") }]} /></div>
      <div class="beside">
        <${ReplayPicture} id=${id} flight=${flight} t=${t} />
        <${Now} flight=${flight} moment=${moment} />
        <${EventList} flight=${flight} t=${t} span=${span} />
      </div>
      <${Plots} id=${id} flight=${flight} span=${span} marks=${marks} />
      <${Playhead} span=${span} lanes=${[{ name: "flight", spans, marks }]} says=${phaseWords(moment)} />
    </div>
  `;
}

function ReplayHead({ id, flight, row }) {
  return html`
    <header class="replay-head">
      <div>
        <p class="quiet"><a href="/flights">${say("Flights")}</a>${row?.path && html` / <span class="path">${row.path}</span>`}</p>
        <h2>${title(row, flight)} ${row?.verdict && html`<span class=${`badge ${tone(row)}`}>${verdictWords(row)}</span>`}</h2>
        ${row && html`<p class="quiet"><time title=${fullDate(row)}>${date(row)}</time> · ${outcomeWords(row)}${row.reason && [": ", quoted(row.reason)]}${row.faults.length > 0 && ` · ${faultWords(row)}`}</p>`}
        ${row?.running && html`<p class="quiet">${say("The log is being recorded: it goes on after the last time that is shown.")}</p>`}
        ${flight.damage && !row?.running && html`<p class="bad-line">${sayWith("The log is {damage}: what you see is what was recorded.", { damage: quoted(flight.damage) })}</p>`}
      </div>
      <div class="ways">
        ${row?.running && html`<button class="order" onClick=${() => forgetFlight(id)}>${say("Read again")}</button>`}
        <a class="order" href=${`/api/flights/${id}/report`} target="_blank" rel="noopener">${say("Report")}</a>
      </div>
      ${row && html`<${Figures} row=${row} flight=${flight} />`}
    </header>
  `;
}

export const title = (row, flight) =>
  [row?.site || flight.floor?.name || say("Flight"), quotedText(row?.mission)].filter(Boolean).join(", ");

function Figures({ row, flight }) {
  const filled = withEstimates(row, flight);
  return html`
    <dl class="figures">
      ${FIGURES.map(
        (figure) => html`
          <div key=${figure.key}>
            <dt>${say(figure.name)}</dt>
            <dd>${told(figure, filled)}${figure.unit && figure.of(filled) != null && html` <small>${figure.unit}</small>`}
              ${isEstimate(figure, filled) && html` <small class="quiet">${say("estimated")}</small>`}</dd>
          </div>
        `,
      )}
    </dl>
  `;
}

function Now({ flight, moment }) {
  return html`
    <section class="card now-card" aria-label=${say("What it does")}>
      <h3>${phaseWords(moment)}</h3>
      <p class="quiet">${quoted(moment.reason, capital)}</p>
      <p>${say("{done} of {planned} nodes visited", { done: moment.nodes_done, planned: moment.nodes_planned })}${moment.node && `, ${say("near {node}", { node: moment.node })}`}</p>
      <p class="quiet">flightd ${flight.version}</p>
    </section>
  `;
}

function EventList({ flight, t, span }) {
  const now = lastBefore(flight.events, t);
  return useMemo(() => html`<${EventsUntil} flight=${flight} now=${now} span=${span} />`, [flight, now, span, language()]);
}

// Drawn again only where another event is the newest one: there are thousands of them.
function EventsUntil({ flight, now, span }) {
  const list = useRef(null);
  useEffect(() => {
    const item = list.current?.children[Math.max(now, 0)];
    if (item) list.current.scrollTop = item.offsetTop - list.current.clientHeight / 2;
  }, [now]);
  return html`
    <section class="card events" aria-labelledby="replay-events">
      <h3 id="replay-events">${say("Events")}</h3>
      <ol ref=${list} class="event-list">
        ${flight.events.map(
          (event, place) => html`
            <li key=${place} class=${event.level} aria-current=${place === now ? "true" : null}>
              <button onClick=${() => seek(event.t_s, span)}>
                <time>${clock(event.t_s)}</time><span><span class="what">${quoted(event.name.replaceAll("_", " "))}</span> ${quoted(event.text)}</span>
              </button>
            </li>
          `,
        )}
        ${flight.events.length === 0 && html`<li class="quiet">${say("Nothing was reported.")}</li>`}
      </ol>
    </section>
  `;
}
