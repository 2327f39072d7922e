// The form of the element that is chosen: every number can be typed; an aisle's nodes are listed one by one.
import { html } from "../html.js";
import { say, sayWith } from "../language.js";
import { placesOf, rounded, rowsOf, titleOf, valuesOf, withAisleNamed, withNodeAfter, withNodeAt, without, withoutNode, withValues } from "./draft.js";
import { Field } from "./field.js";
import { FIELDS, REMOVE } from "./fields.js";
import { focusOn } from "./hand.js";
import { RackSketch } from "./rack_sketch.js";
import { choose, edit, site } from "./site_state.js";

const WHOLE = { table: "site", index: 0, node: null };

export function ElementCard() {
  const { draft, chosen } = site();
  const values = valuesOf(draft, chosen);
  if (!values) return null;
  const { table, index } = chosen;
  const onValue = (changes) => {
    if (table === "aisle" && changes.id) return edit(withAisleNamed(draft, index, changes.id));
    return edit(withValues(draft, chosen, changes), { what: `${table} ${index} ${Object.keys(changes)}` });
  };
  return html`
    <section class="card element" aria-labelledby="element">
      <div class="element-head">
        <h3 id="element" tabindex="-1">${titleOf(draft, chosen)}</h3>
        ${table !== "site" && html`<button class="order" onClick=${remove}>${say(REMOVE[table])}</button>`}
      </div>
      <div class="element-fields">
        ${FIELDS[table].map((field) => html`<${Field} key=${`${table}${index}${field.key}${field.at ?? ""}`} field=${field} values=${values} index=${index} onValue=${onValue} />`)}
      </div>
      ${table === "aisle" && html`<${Nodes} values=${values} index=${index} chosen=${chosen} />`}
      ${table === "rack" && html`<${Codes} index=${index} /><${RackSketch} values=${values} />`}
    </section>
  `;
}

// Take the chosen element out, or the chosen node.
export function remove() {
  const { draft, chosen } = site();
  if (chosen.table === "site") return;
  if (chosen.node !== null && chosen.node !== undefined) edit(withoutNode(draft, chosen.index, chosen.node), { chosen: { ...chosen, node: null } });
  else {
    edit(without(draft, chosen), { chosen: WHOLE });
    focusOn("element");
  }
}

function Nodes({ values, index, chosen }) {
  const { draft } = site();
  const places = placesOf(values);
  const at = chosen.node;
  const field = (number) => ({ key: `node${number}`, words: `${values.id}${number + 1}, x`, kind: "number", unit: "m" });
  const to = (number, x) => x !== undefined && edit(withNodeAt(draft, index, number, x), { what: `node ${index} ${number}` });
  return html`
    <details class="nodes" open=${at !== null}>
      <summary>${say("{n} node|{n} nodes", { n: places.length })}</summary>
      <ul>
        ${places.map((x, number) => html`
          <li key=${number} class=${number === at ? "chosen" : ""} onFocusIn=${() => number !== at && choose("aisle", index, number)}>
            <${Field} field=${field(number)} values=${{ [`node${number}`]: rounded(x) }} onValue=${(changes) => to(number, changes[`node${number}`])} />
            <button class="order" aria-label=${say("Add a node after {node}", { node: `${values.id}${number + 1}` })} onClick=${() => edit(withNodeAfter(draft, index, number), { chosen: { ...chosen, node: number + 1 } })}>${say("Add after")}</button>
            <button class="order" aria-label=${say("Remove node {node}", { node: `${values.id}${number + 1}` })} disabled=${places.length < 3} onClick=${() => edit(withoutNode(draft, index, number), { chosen: { ...chosen, node: null } })}>${say("Remove")}</button>
          </li>
        `)}
      </ul>
    </details>
  `;
}

function Codes({ index }) {
  const { sound, checked, checkedDraft, draft } = site();
  const codes = sound?.codes[index];
  if (!codes || !checked?.sound || rowsOf(checkedDraft, "rack").length !== rowsOf(draft, "rack").length) return null;
  const [first, last] = [codes.first, codes.last].map((code) => html`<code>${code}</code>`);
  const words = say("{bays} bays, {places} places", codes);
  return html`<p class="quiet" role="status">${words}${codes.places > 0 && [": ", sayWith("{first} to {last}", { first, last })]}</p>`;
}
