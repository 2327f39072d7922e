// The numbers of a flight, the ones that decide something first.
import { html } from "../html.js";
import { shown, state } from "../store.js";
import { age, count, duration, number, percent } from "../words.js";

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
        <${Fact} name="Height" value=${withUnit(status.height_m, 2, "m")} more=${heightGoal(status)} />
        <${Fact} name="Speed" value=${withUnit(position?.speed_mps, 2, "m/s")} />
        <${Fact} name="Nearest node" value=${status.node || "–"} more=${certainty(position)} />
        <${Fact} name="Position" value=${place(position)} more=${sigma(position)} />
        <${Fact} name="Lines" value=${linesWords(status)} more=${linesAge(status)} />
        <${Fact} name="Autopilot" value=${vehicle?.mode ?? "not heard"} more=${vehicleWords(vehicle)} />
        <${Fact} name="Attending" value=${attending(link, heard)} more=${pages(state.station)} />
      </dl>
      <h3>On time</h3>
      <dl>
        <${Fact} name="Picture to setpoint" value=${withUnit(latency.total, 0, "ms")} />
        <${Fact} name="Frames" value=${withUnit(status.fps, 0, "/s")} more=${frames(status)} />
        <${Fact} name="Drone to station" value=${withUnit(heard?.round_trip_ms, 0, "ms")} more=${missed(heard)} />
        <${Fact} name="Station to page" value=${withUnit(socket.roundTripMs, 0, "ms")} more=${leftOut(socket)} />
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
      <div class="figure"><strong>${percent(charge)}</strong><span>${volts ? `at ${number(volts, 1)} V` : "charge"}</span></div>
      <div class="figure"><strong>${duration(status.battery_left_s)}</strong><span>in the air left</span></div>
      <div class="figure"><strong>${duration(status.home_s)}</strong><span>to the pad</span></div>
      <meter min="0" max="1" low=${LOW_CHARGE} value=${charge ?? 0} aria-label="Battery charge" />
    </div>
  `;
}

function Fact({ name, value, more = "" }) {
  return html`<div><dt>${name}</dt><dd>${value}${more && html` <span class="quiet">${more}</span>`}</dd></div>`;
}

const withUnit = (value, digits, unit) => (value == null ? "–" : `${number(value, digits)} ${unit}`);
const heightGoal = ({ height_goal_m: goal }) => (goal ? `of ${number(goal, 2)} m` : "");
const certainty = (position) => (position ? `${percent(position.integrity)} sure` : "");
const place = (position) =>
  position ? `${number(position.x_m, 2)}, ${number(position.y_m, 2)} m` : "not known yet";
const sigma = (position) =>
  position?.sigma_x_m == null
    ? ""
    : `± ${number(position.sigma_x_m * 100)}, ${number(position.sigma_y_m * 100)} cm`;
const linesWords = ({ lines, lines_age_s: since }) => (since === null ? "none seen yet" : `${lines.length} followed`);
const linesAge = ({ lines_age_s: since }) => (since === null ? "" : `seen ${age(since)} ago`);
const vehicleWords = (vehicle) =>
  vehicle ? `${vehicle.armed ? "armed" : "disarmed"}${vehicle.armed && !vehicle.in_control ? ", hands off" : ""}` : "";
const frames = ({ frames: all, frames_dropped: dropped }) => (all ? `${percent(dropped / all)} dropped` : "");
const missed = (heard) => (heard?.missed ? `${count(heard.missed, "message")} missed` : "");
const leftOut = ({ dropped, picturesDropped }) =>
  dropped + picturesDropped ? `${count(dropped + picturesDropped, "message")} left out` : "";
const attending = (link, heard) => {
  if (heard?.attends) return "this station";
  return link.attending ? count(link.attending, "other") : "nobody";
};
const pages = (station) => (station ? `${count(station.browsers, "page")} open` : "");
