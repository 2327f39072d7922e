// The numbers of a flight, the ones that decide something first.
import { html } from "../html.js";
import { shown, state } from "../store.js";
import { age, duration, number, percent } from "../words.js";

const LOW_CHARGE = 0.3;

export function Facts({ status }) {
  const { vehicle, position, latency_ms: latency, link } = status;
  const { socket } = state;
  const heard = shown().link;
  return html`
    <section class="card facts" aria-labelledby="facts">
      <h2 id="facts" class="unseen">Figures</h2>
      <${Battery} status=${status} />
      <dl>
        <${Fact} name="Height" value=${metres(status.height_m, 2)} more=${heightGoal(status)} />
        <${Fact} name="Speed" value=${`${number(position?.speed_mps, 2)} m/s`} />
        <${Fact} name="Nearest node" value=${status.node || "–"} more=${certainty(position)} />
        <${Fact} name="Position" value=${place(position)} more=${sigma(position)} />
        <${Fact} name="Autopilot" value=${vehicle?.mode ?? "–"} more=${vehicleWords(vehicle)} />
        <${Fact} name="Lines" value=${String(status.lines.length)} more=${`seen ${age(status.lines_age_s)} ago`} />
        <${Fact}
          name="Camera"
          value=${`${number(status.fps)} frames/s`}
          more=${`${status.frames_dropped} of ${status.frames} dropped`}
        />
        <${Fact} name="Exposure to setpoint" value=${`${number(latency.total)} ms`} />
        <${Fact} name="Drone to station" value=${`${number(heard?.round_trip_ms)} ms`} more=${missed(heard)} />
        <${Fact} name="Station to page" value=${`${number(socket.roundTripMs)} ms`} more=${dropped(socket)} />
        <${Fact} name="Attending" value=${attending(link, heard)} more=${`${state.station?.browsers ?? 0} pages open`} />
      </dl>
      ${vehicle?.refusal && html`<p class="refusal">The autopilot refuses: ${vehicle.refusal}</p>`}
    </section>
  `;
}

function Battery({ status }) {
  const charge = status.vehicle?.battery_frac ?? null;
  const low = charge !== null && charge < LOW_CHARGE;
  const volts = status.vehicle?.battery_v;
  return html`
    <div class=${low ? "battery low" : "battery"}>
      <div class="figure"><strong>${percent(charge)}</strong><span>Battery${volts ? `, ${number(volts, 1)} V` : ""}</span></div>
      <div class="figure"><strong>${duration(status.battery_left_s)}</strong><span>left to the reserve</span></div>
      <div class="figure"><strong>${duration(status.home_s)}</strong><span>to the pad</span></div>
      <meter min="0" max="1" low=${LOW_CHARGE} value=${charge ?? 0} aria-label="Battery charge" />
    </div>
  `;
}

function Fact({ name, value, more = "" }) {
  return html`<div><dt>${name}</dt><dd>${value}${more && html` <span class="quiet">${more}</span>`}</dd></div>`;
}

const metres = (value, digits) => (value === null ? "–" : `${number(value, digits)} m`);
const heightGoal = ({ height_goal_m: goal }) => (goal ? `makes for ${number(goal, 2)} m` : "");
const certainty = (position) => (position ? `${percent(position.integrity)} certain` : "");
const place = (position) =>
  position ? `${number(position.x_m, 2)}, ${number(position.y_m, 2)} m` : "not known yet";
const sigma = (position) =>
  position?.sigma_x_m == null ? "" : `± ${number(position.sigma_x_m * 100)} / ${number(position.sigma_y_m * 100)} cm`;
const vehicleWords = (vehicle) =>
  vehicle ? `${vehicle.armed ? "armed" : "disarmed"}${vehicle.in_control ? "" : ", hands off"}` : "not heard";
const missed = (heard) => (heard?.missed ? `${heard.missed} messages missed` : "");
const dropped = ({ dropped: states, picturesDropped: pictures }) =>
  states + pictures ? `${states} states, ${pictures} pictures left out` : "nothing left out";
const attending = (link, heard) =>
  heard?.attends ? "this station" : link.attending ? `${link.attending} others` : "nobody";
