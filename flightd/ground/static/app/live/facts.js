// The numbers of a flight, the ones that decide something first.
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { shown, state } from "../store.js";
import { age, duration, number, percent } from "../words.js";

const LOW_CHARGE = 0.3;

export function Facts({ status }) {
  const { vehicle, position, latency_ms: latency, link } = status;
  const { socket } = state;
  const heard = shown().link;
  return html`
    <section class="card facts" aria-labelledby="facts">
      <h2 id="facts" class="unseen">${say("Figures")}</h2>
      <${Battery} status=${status} />
      <dl>
        <${Fact} name=${say("Height")} value=${withUnit(status.height_m, 2, "m")} more=${heightGoal(status)} />
        <${Fact} name=${say("Speed")} value=${withUnit(position?.speed_mps, 2, "m/s")} />
        <${Fact} name=${say("Nearest node")} value=${status.node || "–"} more=${certainty(position)} />
        <${Fact} name=${say("Position")} value=${place(position)} more=${sigma(position)} />
        <${Fact} name=${say("Lines")} value=${linesWords(status)} more=${linesAge(status)} />
        <${Fact} name=${say("Autopilot")} value=${vehicle?.mode ?? say("not heard")} more=${vehicleWords(vehicle)} />
        <${Fact} name=${say("Attending")} value=${attending(link, heard)} more=${pages(state.station)} />
      </dl>
      <h3>${say("On time")}</h3>
      <dl>
        <${Fact} name=${say("Picture to setpoint")} value=${withUnit(latency.total, 0, "ms")} />
        <${Fact} name=${say("Frames")} value=${withUnit(status.fps, 0, "/s")} more=${frames(status)} />
        <${Fact} name=${say("Drone to station")} value=${withUnit(heard?.round_trip_ms, 0, "ms")} more=${missed(heard)} />
        <${Fact} name=${say("Station to page")} value=${withUnit(socket.roundTripMs, 0, "ms")} more=${leftOut(socket)} />
      </dl>
      ${vehicle?.refusal && html`<p class="refusal">${sayWith("The autopilot refuses: {why}", { why: quoted(vehicle.refusal) })}</p>`}
    </section>
  `;
}

function Battery({ status }) {
  const charge = status.vehicle?.battery_frac ?? null;
  const low = charge !== null && charge < LOW_CHARGE;
  const volts = status.vehicle?.battery_v;
  return html`
    <div class=${low ? "battery low" : "battery"}>
      <div class="figure"><strong>${percent(charge)}</strong><span>${volts ? say("at {volts} V", { volts: number(volts, 1) }) : say("charge")}</span></div>
      <div class="figure"><strong>${duration(status.battery_left_s)}</strong><span>${say("in the air left")}</span></div>
      <div class="figure"><strong>${duration(status.home_s)}</strong><span>${say("to the pad")}</span></div>
      <meter min="0" max="1" low=${LOW_CHARGE} value=${charge ?? 0} aria-label=${say("Battery charge")} />
    </div>
  `;
}

function Fact({ name, value, more = "" }) {
  return html`<div><dt>${name}</dt><dd>${value}${more && html` <span class="quiet">${more}</span>`}</dd></div>`;
}

const withUnit = (value, digits, unit) => (value == null ? "–" : `${number(value, digits)} ${unit}`);
const heightGoal = ({ height_goal_m: goal }) => (goal ? say("of {goal} m", { goal: number(goal, 2) }) : "");
const certainty = (position) => (position ? say("{share} sure", { share: percent(position.integrity) }) : "");
const place = (position) =>
  position ? `${number(position.x_m, 2)}, ${number(position.y_m, 2)} m` : say("not known yet");
const sigma = (position) =>
  position?.sigma_x_m == null
    ? ""
    : `± ${number(position.sigma_x_m * 100)}, ${number(position.sigma_y_m * 100)} cm`;
const linesWords = ({ lines, lines_age_s: since }) => (since === null ? say("none seen yet") : say("{n} followed", { n: lines.length }));
const linesAge = ({ lines_age_s: since }) => (since === null ? "" : say("seen {age} ago", { age: age(since) }));
const vehicleWords = (vehicle) =>
  vehicle ? (vehicle.armed ? (vehicle.in_control ? say("armed") : say("armed, hands off")) : say("disarmed")) : "";
const frames = ({ frames: all, frames_dropped: dropped }) => (all ? say("{share} dropped", { share: percent(dropped / all) }) : "");
const missed = (heard) => (heard?.missed ? say("{n} message missed|{n} messages missed", { n: heard.missed }) : "");
const leftOut = ({ dropped, picturesDropped }) =>
  dropped + picturesDropped ? say("{n} message left out|{n} messages left out", { n: dropped + picturesDropped }) : "";
const attending = (link, heard) => {
  if (heard?.attends) return say("this station");
  return link.attending ? say("{n} other|{n} others", { n: link.attending }) : say("nobody");
};
const pages = (station) => (station ? say("{n} page open|{n} pages open", { n: station.browsers }) : "");
