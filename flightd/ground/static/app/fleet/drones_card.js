// The drones one by one: what each does, who flies it and why, for whom it waits, and how long it stays in the air.
import { mayOperate } from "../access/session.js";
import { isSilent } from "../hearing.js";
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { handOver } from "../live/manager.js";
import { selectDrone, state } from "../store.js";
import { duration, percent, phaseWords } from "../words.js";
import { Badge } from "./the_drones.js";

export function DronesCard({ marks, told, hall }) {
  const names = state.station?.drones ?? [];
  return html`
    <section class="card fleet-drones" aria-labelledby="fleet-drones">
      <h3 id="fleet-drones">${say("Drones")}</h3>
      <ul>${names.map((name) => html`<${Row} key=${name} name=${name} mark=${marks.get(name)} told=${told?.drones?.[name]} hall=${hall} />`)}</ul>
    </section>
  `;
}

function Row({ name, mark, told, hall }) {
  const known = state.drones.get(name);
  const { status, welcome, manager } = known ?? {};
  const site = welcome?.floor.name ?? "";
  return html`
    <li class="fleet-drone">
      <${Badge} mark=${mark} />
      <div class="fleet-words">
        <p><strong>${name}</strong> <span>${status ? phaseWords(status) : say("Not heard yet")}</span></p>
        ${known && status && isSilent(known) && html`<p class="quiet">${say("It is silent: what is shown of it is old.")}</p>`}
        ${site && site !== hall && html`<p class="quiet">${say("It flies in {site}.", { site })}</p>`}
        ${told && html`<p class=${told.flown ? "flown" : "not-flown"}>${told.flown ? say("Flown by the fleet’s traffic") : ["● ", notFlown(told.why)]}</p>`}
        ${told?.waits_for.length > 0 && html`<p>${say("Waits for {names}", { names: told.waits_for.join(", ") })}</p>`}
        ${told?.doubt_m > 0 && html`<p>${say("Its place is doubted.")}</p>`}
        ${told && told.charges_to !== null && html`<p>${say("Charges: it takes new work from {charge} on.", { charge: percent(told.charges_to) })}</p>`}
        ${told?.cut_off && html`<p class="not-flown">${say("What is closed cuts it off from its pad: it holds.")}</p>`}
        ${told && html`<${ClosedAir} closed=${told.closed} />`}
        ${status && html`<p class="quiet">${chargeWords(status)}</p>`}
        ${manager?.refused && html`<p class="refusal" role="alert">${quoted(manager.refused)}</p>`}
      </div>
      <div class="fleet-acts">
        <a class="order" href="/" aria-label=${say("{name} on Live", { name })} onClick=${() => selectDrone(name)}>${say("Live")}</a>
        ${manager && !manager.flies && mayOperate() && html`<button class="order" aria-label=${say("Give it to the fleet: {name}", { name })} onClick=${() => handOver(name, true)}>${say("Give it to the fleet")}</button>`}
      </div>
    </li>
  `;
}

const notFlown = (why) => sayWith("Not flown by the fleet: {why}", { why: quoted(why) });

function ClosedAir({ closed }) {
  if (!closed.nodes.length && !closed.ways.length) return null;
  const names = [...closed.nodes, ...closed.ways.filter((ends) => !ends.every((id) => closed.nodes.includes(id))).map((ends) => ends.join("–"))];
  return html`<p class="quiet">${say("Closed for others: {air}", { air: names.join(", ") })}</p>`;
}

function chargeWords({ vehicle, battery_left_s: left }) {
  const charge = percent(vehicle?.battery_frac);
  return left === null ? say("Battery {charge}", { charge }) : say("Battery {charge}, {time} in the air left", { charge, time: duration(left) });
}
