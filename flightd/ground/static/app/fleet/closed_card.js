// What people closed to the drones, who may still be in it, and closing and opening.  What is opened takes a
// second press: people may be in there.
import { mayOperate } from "../access/session.js";
import { html, useEffect, useState } from "../html.js";
import { quoted, say } from "../language.js";
import { aislesOf } from "../picks.js";
import { dayAndTime } from "../words.js";
import { closeAisle, closeBetween, fleet, openAgain } from "./fleet_state.js";

const ARMED_MS = 5000;

export function ClosedCard({ told, floor }) {
  const { chosen, closing, trouble } = fleet();
  const closed = new Set(told.closed.map(({ name }) => name));
  const open = aislesOf(floor).filter(([aisle]) => !closed.has(aisle));
  return html`
    <section class="card closed-card" aria-labelledby="closed">
      <h3 id="closed">${say("Closed to drones")}</h3>
      <p class="quiet">${say("The fleet does not fly in, and leaves it. People’s orders and drones’ own rules do not heed it.")}</p>
      ${told.closed.length > 0
        ? html`<ul>${told.closed.map((one) => html`<${Closed} key=${one.name} one=${trouble ? { ...one, inside: null } : one} />`)}</ul>`
        : html`<p class="quiet">${say("Nothing is closed.")}</p>`}
      ${mayOperate() &&
      html`<div class="choose-row" role="group" aria-label=${say("Close aisles")}>
          ${open.map(([aisle]) => html`<button key=${aisle} class="order" onClick=${() => closeAisle(aisle)}>${say("Close aisle {aisle}", { aisle })}</button>`)}
          ${chosen.length > 1 && html`<button class="order" onClick=${() => closeBetween(chosen)}>${say("Close what is between the chosen nodes")}</button>`}
        </div>`}
      <p class="refusal" role="status">${closing && quoted(closing)}</p>
    </section>
  `;
}

function Closed({ one: { name, why, by, utc_s: at, inside } }) {
  const [isArmed, arm] = useState(false);
  useEffect(() => {
    if (!isArmed) return undefined;
    const over = setTimeout(() => arm(false), ARMED_MS);
    return () => clearTimeout(over);
  }, [isArmed]);
  const press = () => (isArmed ? openAgain(name) : arm(true));
  return html`
    <li>
      <div>
        <p><strong>${quoted(why)}</strong></p>
        <p class=${inside?.length === 0 ? "flown" : "not-flown"}>${insideWords(inside)}</p>
        <p class="quiet">${say("by {name}, {at}", { name: by, at: dayAndTime(new Date(at * 1000)) })}</p>
      </div>
      ${mayOperate() && html`<button class="order" onClick=${press}>${isArmed ? say("Press again: drones fly there ({name})", { name }) : say("Open again: {name}", { name })}</button>`}
    </li>
  `;
}

function insideWords(inside) {
  if (!inside) return say("Nobody knows whether a drone is in it.");
  return inside.length ? say("Perhaps still in it: {names}", { names: inside.join(", ") }) : say("No drone is in it.");
}
