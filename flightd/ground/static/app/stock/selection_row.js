// What of the inventory is to be counted again: what a search or states pick out, or places selected one by one.
import { mayOperate } from "../access/session.js";
import { html } from "../html.js";
import { say } from "../language.js";
import { RecountButton } from "./recount_button.js";
import { clearSelection } from "./selection.js";
import { inOrder, isShown, stock } from "./stock_state.js";

export function SelectionRow() {
  const known = stock();
  const { source, fronts, places, states, found, selected } = known;
  if (source?.kind !== "store" || !mayOperate()) return null;
  const all = inOrder(fronts);
  const shown = states.size || found ? all.filter((code) => isShown(code, known)) : [];
  const chosen = selected.size ? all.filter((code) => selected.has(code) && places[code]) : [];
  return html`
    <div class="find-row selection" role="group" aria-label=${say("Count again")}>
      ${shown.length > 0 &&
      html`<${RecountButton} key="shown" places=${shown}>${say("Recount what is picked out ({n} place)|Recount what is picked out ({n} places)", { n: shown.length })}<//>`}
      <span role="status">${chosen.length > 0 ? say("{n} place selected|{n} places selected", { n: chosen.length }) : ""}</span>
      ${chosen.length > 0 &&
      html`
        <${RecountButton} key="selected" places=${chosen}>${say("Recount {n} selected place as a mission|Recount {n} selected places as a mission", { n: chosen.length })}<//>
        <button class="order" onClick=${clearSelection}>${say("Clear")}</button>
      `}
      ${!chosen.length && !shown.length &&
      html`<span class="quiet">${say("To count places again, select them: Shift and click, Shift and Enter, or at a place’s card.")}</span>`}
    </div>
  `;
}
