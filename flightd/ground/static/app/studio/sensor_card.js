// What the drone's own calibration found in a flight: configured, estimated in the air, fitted afterwards, and the keys.
import { flightsState, watchList } from "../flights/flights_state.js";
import { html, useEffect, useState } from "../html.js";
import { plain, quoted, say } from "../language.js";
import { capital } from "../words.js";
import { flightWords, siteWords, wholeFlights } from "./flight_choice.js";
import { asked, told } from "./studio_state.js";

const FITTING_MS = 250000;
const DIGITS = 4;

export function ByFlight() {
  const { rows, looked } = flightsState().list;
  const [flight, setFlight] = useState("");
  const [study, setStudy] = useState(null);
  const [busy, setBusy] = useState(false);
  useEffect(watchList, []);
  const flights = wholeFlights(rows);
  const chosen = flights.find(({ id }) => id === flight) ?? flights[0];
  const look = async (event) => {
    event.preventDefault();
    if (busy) return; // the button keeps the focus meanwhile
    setBusy(true);
    setStudy(null);
    await told(async () => setStudy({ flight: chosen.id, ...(await asked(`/flights/${encodeURIComponent(chosen.id)}/sensors`, "GET", undefined, FITTING_MS)) }));
    setBusy(false);
  };
  if (!chosen) return html`<p class="quiet">${looked ? say("No flight log lies below the station's folder yet.") : say("Looking for flights …")}</p>`;
  return html`
    <form class="tools" onSubmit=${look}>
      <label class="field">${say("Flight")}
        <select value=${chosen.id} onChange=${(event) => setFlight(event.target.value)}>
          ${flights.map((row) => html`<option key=${row.id} value=${row.id}>${siteWords(row.site)} · ${flightWords(row)}</option>`)}
        </select>
      </label>
      <button class="order" aria-disabled=${busy}>${busy ? say("Looking …") : say("Look what it found")}</button>
    </form>
    ${busy && html`<p class="quiet" role="status">${say("All of the flight is fitted at once: up to some minutes.")}</p>`}
    ${study?.flight === chosen.id && html`<${Found} study=${study} />`}
  `;
}

function Found({ study }) {
  return html`
    <p role="status">${say("By {n} frame of the flight:|By {n} frames of the flight:", { n: study.frames })}</p>
    <div class="table-scroll" tabindex="0" role="group" aria-label=${say("What the flight tells of the sensors")}>
      <table>
        <thead><tr><th scope="col">${say("Sensor")}</th><th scope="col">${say("Configured")}</th><th scope="col">${say("Estimated in flight")}</th><th scope="col">${say("Fitted")}</th></tr></thead>
        <tbody>${study.sensors.map((one) => html`<${Sensor} key=${one.name} one=${one} />`)}</tbody>
      </table>
    </div>
    ${study.config
      ? html`<p class="quiet">${say("For the drone's configuration, what differs by more than two sigmas:")}</p><pre tabindex="0">${study.config}</pre>`
      : html`<p>${say("Nothing differs surely from what is configured.")}</p>`}
  `;
}

const Sensor = ({ one }) => html`
  <tr class=${one.change ? "differs" : ""}>
    <th scope="row">${quoted(one.name, capital)}${one.unit !== "1" && `, ${one.unit}`}${one.key && html` <code>${one.key}</code>`}${one.note && html`<small>${quoted(one.note, capital)}</small>`}</th>
    <td>${figure(one.configured)}</td><td>${withSigma(one.online, one.online_sigma)}</td><td>${withSigma(one.fitted, one.sigma)}</td>
  </tr>
`;

const figure = (value, digits = DIGITS) => plain(Number(value.toPrecision(digits)));
const withSigma = (value, sigma) => (value === null ? "–" : sigma === null ? figure(value) : `${figure(value)} ± ${figure(sigma, 2)}`);
