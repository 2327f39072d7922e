// Says what is wrong where the drone, or the station, is not heard.  Beside the flight it is an alarm only while
// a drone flies that is not heard, or the station itself is gone.
import { hears } from "./hearing.js";
import { html } from "./html.js";
import { state } from "./store.js";

export function Silence() {
  const { good, text, flies } = hears();
  const isQuiet = !good && state.socket.open && !flies && state.route.page?.path !== "/";
  return html`
    <div role="alert" class=${good || isQuiet ? "silence none" : "silence"}>${good || isQuiet ? "" : text}</div>
    ${isQuiet && html`<p class="quiet unheard" role="status">${text}</p>`}
  `;
}
