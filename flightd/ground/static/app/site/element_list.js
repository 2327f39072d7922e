// Every element by name, to be chosen without the drawing; and what can be added.
import { html } from "../html.js";
import { english, say } from "../language.js";
import { rowsOf, titleOf } from "./draft.js";
import { GROUPS, ONE_OF } from "./fields.js";
import { add } from "./hand.js";
import { change, choose, site } from "./site_state.js";

const CLICK_TWO = english("click two nodes");
const DRAWN = {
  aisle: english("drag along its line"), keep_out: english("drag from corner to corner"), cross: CLICK_TWO, blocked: CLICK_TWO,
  pad: english("click a node"), marker: english("click its place"),
};

export function ElementList() {
  const { draft, chosen, checked } = site();
  const wrong = new Set((checked?.findings ?? []).filter(({ kind }) => kind === "error").map(({ table, index }) => `${table} ${index}`));
  const entry = (table, index) => {
    const isChosen = chosen.table === table && chosen.index === index;
    const isWrong = wrong.has(`${table} ${index}`);
    return html`
      <button key=${`${table}${index}`} class=${isWrong ? "entry wrong" : "entry"} aria-pressed=${isChosen} onClick=${() => choose(table, index)}>
        ${titleOf(draft, { table, index })}${isWrong && html`<span class="unseen">, ${say("has a mistake")}</span>`}
      </button>
    `;
  };
  return html`
    <section class="card elements" aria-labelledby="elements">
      <h3 id="elements">${say("Elements")}</h3>
      ${entry("site", 0)}
      ${Object.entries(GROUPS).map(([table, words]) => html`
        <div key=${table} class="group" role="group" aria-label=${say(words)}>
          <div class="group-head"><h4>${say(words)} <small>${rowsOf(draft, table).length || ""}</small></h4><${Add} table=${table} /></div>
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
    ${DRAWN[table] && html`<button class="tab" aria-pressed=${isDrawing} title=${say("On the drawing: {how}", { how: say(DRAWN[table]) })} aria-label=${say("Draw a new {element}: {how}", { element: say(ONE_OF[table]), how: say(DRAWN[table]) })}
      onClick=${() => change({ tool: isDrawing ? "" : table, picked: "", said: isDrawing ? "" : english("New {element}: {how}.", { element: ONE_OF[table], how: DRAWN[table] }) })}>${say("Draw")}</button>`}
    <button class="tab" aria-label=${say("Add {element}", { element: say(ONE_OF[table]) })} onClick=${() => add(table)}>${say("Add")}</button>
  `;
}
