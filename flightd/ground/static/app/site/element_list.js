// Every element by name, to be chosen without the drawing; and what can be added.
import { html } from "../html.js";
import { rowsOf, titleOf } from "./draft.js";
import { GROUPS, ONE_OF } from "./fields.js";
import { add } from "./hand.js";
import { change, choose, site } from "./site_state.js";

const DRAWN = { aisle: "drag along its line", keep_out: "drag from corner to corner", cross: "click two nodes", blocked: "click two nodes", pad: "click a node", marker: "click its place" };

export function ElementList() {
  const { draft, chosen, checked } = site();
  const wrong = new Set((checked?.findings ?? []).filter(({ kind }) => kind === "error").map(({ table, index }) => `${table} ${index}`));
  const entry = (table, index) => {
    const isChosen = chosen.table === table && chosen.index === index;
    const isWrong = wrong.has(`${table} ${index}`);
    return html`
      <button key=${`${table}${index}`} class=${isWrong ? "entry wrong" : "entry"} aria-pressed=${isChosen} onClick=${() => choose(table, index)}>
        ${titleOf(draft, { table, index })}${isWrong && html`<span class="unseen">, has a mistake</span>`}
      </button>
    `;
  };
  return html`
    <section class="card elements" aria-labelledby="elements">
      <h3 id="elements">Elements</h3>
      ${entry("site", 0)}
      ${Object.entries(GROUPS).map(([table, words]) => html`
        <div key=${table} class="group" role="group" aria-label=${words}>
          <div class="group-head"><h4>${words} <small>${rowsOf(draft, table).length || ""}</small></h4><${Add} table=${table} /></div>
          ${rowsOf(draft, table).map((_, index) => entry(table, index))}
        </div>
      `)}
    </section>
  `;
}

function Add({ table }) {
  const { tool } = site();
  const isDrawing = tool === table;
  return html`
    ${DRAWN[table] && html`<button class="tab" aria-pressed=${isDrawing} title=${`On the drawing: ${DRAWN[table]}`} aria-label=${`Draw a new ${ONE_OF[table]}: ${DRAWN[table]}`}
      onClick=${() => change({ tool: isDrawing ? "" : table, picked: "", said: isDrawing ? "" : `New ${ONE_OF[table]}: ${DRAWN[table]}.` })}>Draw</button>`}
    <button class="tab" aria-label=${`Add ${ONE_OF[table]}`} onClick=${() => add(table)}>Add</button>
  `;
}
