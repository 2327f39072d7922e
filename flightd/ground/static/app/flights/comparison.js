// Two flights compared: both tracks on one map, plots over each other, figures side by side.
import { html, useMemo, useState } from "../html.js";
import { english, say } from "../language.js";
import { useTitle } from "../router.js";
import { capital, phaseWords } from "../words.js";
import { isMark, momentAt, phaseSpans, takeOff } from "./at_time.js";
import { date, differenceIn, FIGURES, isEstimate, outcomeWords, told, tone, verdictWords, withEstimates } from "./figures.js";
import { flightsState, opened } from "./flights_state.js";
import { Playhead } from "./playhead.js";
import { usePlayback } from "./playing.js";
import { ComparedPlots } from "./plots.js";
import { Missing, title } from "./replay.js";
import { ReplayMap } from "./replay_map.js";

const KINDS = [english("first"), english("second")];
const DRONES = { first: english("The first flight's drone"), second: english("The second flight's drone") };
const NO_PICTURES = [];

export function Comparison({ ids }) {
  const known = ids.map((id) => (id ? opened(id) : { trouble: english("choose two flights in the list") }));
  const missing = known.findIndex(({ trouble }) => trouble);
  if (missing >= 0) return html`<${Missing} id=${ids[missing]} trouble=${known[missing].trouble} />`;
  if (!known.every(({ flight }) => flight)) return html`<p class="loading quiet" role="status">${say("Reading both flights …")}</p>`;
  const empty = known.findIndex(({ flight }) => !flight.moments.length);
  if (empty >= 0) return html`<${Missing} id=${ids[empty]} trouble=${english("the log holds no flight")} />`;
  return html`<${Both} ids=${ids} known=${known} />`;
}

function Both({ ids, known }) {
  useTitle(say("Two flights compared"));
  const [byTakeOff, setByTakeOff] = useState(true);
  const flights = known.map(({ flight }, which) => ({
    id: ids[which], flight, row: known[which].row, kind: KINDS[which], shift: byTakeOff ? -takeOff(flight) : 0,
  }));
  const low = Math.min(...flights.map(({ shift }) => shift));
  const high = Math.max(...flights.map(({ flight, shift }) => flight.duration_s + shift));
  const span = useMemo(() => ({ low, high }), [low, high]);
  usePlayback(span, NO_PICTURES);
  const { at } = flightsState().playing;
  const timeOf = ({ flight, shift }) => Math.min(Math.max(at - shift, 0), flight.duration_s);
  const lanes = flights.map((one) => ({
    name: one.kind,
    spans: phaseSpans(one.flight).map((band) => ({ ...band, from: band.from + one.shift, to: band.to + one.shift })),
    marks: one.flight.events.filter(isMark).map((mark) => ({ ...mark, t_s: mark.t_s + one.shift })),
  }));
  const says = flights.map((one) => `${say(one.kind)}: ${phaseWords(momentAt(one.flight, timeOf(one)))}`).join("; ");
  const otherSite = flights[0].flight.floor?.name !== flights[1].flight.floor?.name;
  return html`
    <div class="replay compared">
      <header class="replay-head">
        <div>
          <p class="quiet"><a href="/flights">${say("Flights")}</a></p>
          <h2>${say("Two flights compared")}</h2>
        </div>
        <label class="align"><input type="checkbox" checked=${byTakeOff} onChange=${() => setByTakeOff(!byTakeOff)} /> ${say("Times count from take-off")}</label>
      </header>
      ${otherSite && html`<p class="bad-line">${say("They were flown on different maps; the first one's is drawn.")}</p>`}
      <div class="sight">
        <${ReplayMap} shown=${flights.map((one) => ({ flight: one.flight, t: timeOf(one), kind: one.kind, name: say(DRONES[one.kind]) }))} />
      </div>
      <div class="beside"><${FigureTable} flights=${flights} says=${flights.map((one) => phaseWords(momentAt(one.flight, timeOf(one))))} /></div>
      <${ComparedPlots} flights=${flights} span=${span} />
      <${Playhead} span=${span} lanes=${lanes} says=${says} />
    </div>
  `;
}

function FigureTable({ flights, says }) {
  const rows = flights.map(({ row, flight }) => withEstimates(row, flight));
  return html`
    <section class="card" aria-label=${say("Figures")}>
      <table class="side-by-side">
        <thead>
          <tr>
            <td></td>
            ${flights.map((one) => html`<th key=${one.kind} scope="col"><i class=${`line-own-${one.kind}`} />${capital(say(one.kind))}</th>`)}
            <th scope="col">${say("Difference")}</th>
          </tr>
        </thead>
        <tbody>
          <tr><th scope="row">${say("Flight")}</th>${flights.map(({ id, row, flight }) => html`<td key=${id}><a href=${`/flights/${id}`}>${title(row, flight)}</a></td>`)}<td></td></tr>
          <tr><th scope="row">${say("Date")}</th>${flights.map(({ id, row }) => html`<td key=${id}>${row ? date(row) : "–"}</td>`)}<td></td></tr>
          <tr><th scope="row">${say("Outcome")}</th>${flights.map(({ id, row }) => html`<td key=${id}>${row ? outcomeWords(row) : "–"}</td>`)}<td></td></tr>
          <tr><th scope="row">${say("Verdict")}</th>${flights.map(({ id, row }) => html`<td key=${id}>${row?.verdict ? html`<span class=${`badge ${tone(row)}`}>${verdictWords(row)}</span>` : "–"}</td>`)}<td></td></tr>
          ${FIGURES.map((figure) => html`<${FigureRow} key=${figure.key} figure=${figure} rows=${rows} />`)}
          <tr><th scope="row">${say("Now")}</th>${says.map((text, which) => html`<td key=${which}>${text}</td>`)}<td></td></tr>
        </tbody>
      </table>
    </section>
  `;
}

function FigureRow({ figure, rows }) {
  const { text, better } = differenceIn(figure.key, ...rows);
  const [tone, word] = better === null ? ["", ""] : better ? ["better", say("better")] : ["worse", say("worse")];
  return html`
    <tr>
      <th scope="row">${say(figure.name)}${figure.unit && html` <small class="quiet">${figure.unit}</small>`}</th>
      ${rows.map((row, which) => html`<td key=${which} class="number">${told(figure, row)}${isEstimate(figure, row) && html` <small class="quiet">${say("estimated")}</small>`}</td>`)}
      <td class=${`number ${tone}`}>${text}${word && html` <small>${word}</small>`}</td>
    </tr>
  `;
}
