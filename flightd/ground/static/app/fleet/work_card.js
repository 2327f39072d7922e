// The fleet's work: what is asked for, by whom it is done, what is done and what is not, and why.
import { mayOperate, signedInName } from "../access/session.js";
import { html, useState } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { aislesOf, Chip } from "../picks.js";
import { askTour, change, choose, fleet, toggleNode, toggleNodes } from "./fleet_state.js";
import { Badge } from "./the_drones.js";

const MOST_SHOWN = 60;

export function WorkCard({ told, marks, floor }) {
  const given = Object.entries(told.given);
  const notDone = Object.entries(told.not_done);
  const by = Object.groupBy(given, ([, drone]) => drone);
  const isIdle = !told.open.length && !given.length && !told.done.length && !notDone.length;
  return html`
    <section class="card work" aria-labelledby="work">
      <h3 id="work">${say("Work")}</h3>
      ${mayOperate() ? html`<${TourForm} floor=${floor} drones=${Object.keys(told.drones)} />` : html`<p class="quiet">${say("{name} is a viewer: a tour needs an operator. STOP ALL is everybody’s.", { name: signedInName() })}</p>`}
      ${isIdle && html`<p class="quiet">${say("Nothing is asked for.")}</p>`}
      <dl>
        ${told.open.length > 0 && html`<div><dt>${say("Waits for a drone")}</dt><dd><${Names} nodes=${told.open} /></dd></div>`}
        ${Object.entries(by).map(
          ([drone, nodes]) => html`<div key=${drone}><dt class="given"><${Badge} mark=${marks.get(drone)} />${say("{name} visits", { name: drone })}</dt><dd><${Names} nodes=${nodes.map(([node]) => node)} /></dd></div>`,
        )}
        ${notDone.length > 0 && html`<div><dt class="not-flown">${say("Not done")}</dt><dd><ul>${notDone.slice(0, MOST_SHOWN).map(([node, why]) => html`<li key=${node}>${sayWith("{name}: {why}", { name: html`<strong>${node}</strong>`, why: quoted(why) })}</li>`)}</ul></dd></div>`}
        ${told.done.length > 0 && html`<div><dt class="flown">${say("Done")}</dt><dd><${Names} nodes=${told.done} /></dd></div>`}
      </dl>
    </section>
  `;
}

const Names = ({ nodes }) => (nodes.length > MOST_SHOWN ? [nodes.slice(-MOST_SHOWN).join(", "), " ", say("and {n} more", { n: nodes.length - MOST_SHOWN })] : nodes.join(", "));

function TourForm({ floor, drones }) {
  const { chosen, by, asked } = fleet();
  const [node, setNode] = useState("");
  const onSubmit = (event) => {
    event.preventDefault();
    if (chosen.length) askTour();
  };
  const all = floor.nodes.map(({ id }) => id);
  return html`
    <form class="tour-form" onSubmit=${onSubmit} aria-label=${say("Ask for a tour")}>
      <div class="choose-row" role="group" aria-label=${say("Aisles")}>
        ${aislesOf(floor).map(
          ([aisle, ids]) => html`<${Chip} key=${aisle} on=${ids.every((id) => chosen.includes(id))} part=${ids.some((id) => chosen.includes(id))} onClick=${() => toggleNodes(ids)}>${say("Aisle {aisle}", { aisle })}<//>`,
        )}
      </div>
      <div class="tour-add">
        <label class="field">${say("Node")}
          <select value=${node} onChange=${(event) => setNode(event.target.value)}>
            <option value="">${say("choose here or on the map")}</option>
            ${all.map((id) => html`<option key=${id} value=${id} disabled=${chosen.includes(id)}>${id}</option>`)}
          </select>
        </label>
        <button type="button" class="order" disabled=${!node || chosen.includes(node)} onClick=${() => toggleNode(node)}>${say("Add")}</button>
      </div>
      ${chosen.length > 0 &&
      html`<ul class="tour-nodes" aria-label=${say("Chosen nodes")}>
          ${chosen.map((id) => html`<li key=${id}><button type="button" class="pick" aria-label=${say("Leave out {node}", { node: id })} onClick=${() => toggleNode(id)}>${id} <span aria-hidden="true">×</span></button></li>`)}
        </ul>`}
      <label class="field">${say("Flown by")}
        <select value=${by} onChange=${(event) => change({ by: event.target.value, asked: null })}>
          <option value="">${say("whichever has the time")}</option>
          ${drones.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}
        </select>
      </label>
      <div class="tour-go">
        <button class="order ask" aria-disabled=${!chosen.length}>${say("Have {n} node visited|Have {n} nodes visited", { n: chosen.length })}</button>
        ${chosen.length > 0 && html`<button type="button" class="tab" onClick=${() => choose([])}>${say("Clear")}</button>`}
      </div>
      <p class=${asked?.refused ? "refusal" : "quiet"} role="status">${asked && (asked.refused ? quoted(asked.refused) : say("{n} node was asked for.|{n} nodes were asked for.", { n: asked.count }))}</p>
    </form>
  `;
}
