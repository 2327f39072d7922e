// Whole aisles and shelf levels at once, and in which order it is flown.
import { html } from "../html.js";
import { say } from "../language.js";
import { aislesOf, Chip } from "../picks.js";
import { choose, missions, toggleLevel, toggleNodes } from "./missions_state.js";

export function ChooseCard({ floor }) {
  const { nodes, levels, best } = missions();
  const aisles = aislesOf(floor);
  const all = floor.nodes.map(({ id }) => id);
  const known = levelsOf(floor);
  return html`
    <section class="card choose" aria-label=${say("Aisles, levels and order")}>
      <div class="choose-row" role="group" aria-labelledby="choose-aisles">
        <h3 id="choose-aisles">${say("Aisles")}</h3>
        ${aisles.map(
          ([aisle, ids]) => html`<${Chip} key=${aisle} on=${ids.every((id) => nodes.includes(id))}
            part=${ids.some((id) => nodes.includes(id))} onClick=${() => toggleNodes(ids)}>${aisle}<//>`,
        )}
        <${Chip} on=${all.every((id) => nodes.includes(id))} onClick=${() => toggleNodes(all)}>${say("Every node")}<//>
        <button class="order" disabled=${!nodes.length} onClick=${() => choose({ nodes: [] })}>${say("Clear")}</button>
      </div>
      ${known.length > 0 &&
      html`
        <div class="choose-row" role="group" aria-labelledby="choose-levels">
          <h3 id="choose-levels">${say("Levels")}</h3>
          <${Chip} on=${!levels.length} onClick=${() => choose({ levels: [] })}>${say("All")}<//>
          ${known.map((level) => html`<${Chip} key=${level} on=${levels.includes(level)} onClick=${() => toggleLevel(level)}>${level}<//>`)}
          <span class="quiet">${say("counted from the floor up")}</span>
        </div>
      `}
      <div class="choose-row" role="group" aria-labelledby="choose-order">
        <h3 id="choose-order">${say("Order")}</h3>
        <${Chip} on=${best} onClick=${() => choose({ best: true })}>${say("Quickest")}<//>
        <${Chip} on=${!best} onClick=${() => choose({ best: false })}>${say("As chosen")}<//>
        <span class="quiet">${nodes.length ? say("{n} node of {all} chosen|{n} nodes of {all} chosen", { n: nodes.length, all: all.length }) : say("nothing is chosen yet")}</span>
      </div>
    </section>
  `;
}

function levelsOf({ nodes }) {
  return [...new Set(nodes.flatMap((node) => node.levels))].sort((a, b) => a - b);
}
