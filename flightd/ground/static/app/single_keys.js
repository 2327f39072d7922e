// Keys of one character act wherever nobody types.  Whoever speaks to the browser, or touches keys unawares, switches
// them off here; this browser keeps that.
import { html } from "./html.js";
import { say } from "./language.js";
import { state, update } from "./store.js";

const KEPT = "flightd.keys";
const OFF = "off";
const SHOWN = ["P", "R", "/", ",", "."];

export const hasSingleKeys = () => state.singleKeys;

// As it was chosen in this browser.
export function rememberSingleKeys() {
  try {
    state.singleKeys = localStorage.getItem(KEPT) !== OFF;
  } catch {
    // a browser that keeps nothing has them
  }
}

function choose(on) {
  update((s) => {
    s.singleKeys = on;
  });
  try {
    localStorage.setItem(KEPT, on ? "on" : OFF);
  } catch {
    // until the page is loaded anew
  }
}

export function SingleKeys() {
  return html`
    <label class="quiet single-keys">
      <input type="checkbox" checked=${state.singleKeys} onChange=${(event) => choose(event.target.checked)} />
      ${say("Keys of one character")} <span aria-hidden="true">${SHOWN.map((key) => html`<kbd key=${key}>${key}</kbd> `)}</span>
    </label>
  `;
}
