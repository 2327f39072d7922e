// The site that is edited, flown in the simulator: begun here, seen on Live as a drone more, its end told here.
import { mayChange, mayOperate } from "../access/session.js";
import { unlessBusy } from "../busy.js";
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { goTo } from "../router.js";
import { selectDrone, state } from "../store.js";
import { endFlight, fly } from "./site_source.js";
import { isChanged, site } from "./site_state.js";

export function SimulationBar() {
  const told = state.simulation;
  const { name, stamp, busy } = site();
  const may = told && (told.admins_only ? mayChange() : mayOperate());
  const mayFly = may && stamp && !told.drone;
  if (!told || (!mayFly && !told.site)) return null;
  return html`
    <div class="simulation">
      ${mayFly && html`<button class="order" disabled=${isChanged()} ...${unlessBusy(busy, () => fly(name))}>${told.site === name ? say("Fly again in simulation") : say("Fly it in simulation")}</button>`}
      ${mayFly && isChanged() && html`<p class="quiet">${say("Save it first: the file is flown.")}</p>`}
      ${told.drone && html`<button class="order" onClick=${() => look(told.drone)}>${say("See it on Live")}</button>`}
      ${told.drone && may && html`<button class="order" onClick=${endFlight}>${say("End the flight")}</button>`}
      <p role="status">${told.site && html`${words(told)} ${quoted(told.last)}`}</p>
    </div>
  `;
}

function words({ site: name, drone, good, folder }) {
  const site_ = html`<b>${name}</b>`;
  if (drone) return sayWith("{site} is flown in the simulator, as the drone {drone}.", { site: site_, drone: html`<b>${drone}</b>` });
  const told = { site: site_, folder: html`<code>${folder}</code>` };
  return good ? sayWith("{site} was flown, into {folder}; Flights and Stock show it.", told) : sayWith("The flight of {site} into {folder} was not good.", told);
}

function look(drone) {
  selectDrone(drone);
  goTo("/");
}
