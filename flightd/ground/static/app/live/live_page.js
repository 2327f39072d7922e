// The live page: where the drone is, what it sees, what it does and why, and what a person may order.
import { hears } from "../hearing.js";
import { html } from "../html.js";
import { say } from "../language.js";
import { isAttending } from "../screen.js";
import { shown, state } from "../store.js";
import { Acts } from "./acts_card.js";
import { Camera } from "./camera.js";
import { Events } from "./events.js";
import { Facts } from "./facts.js";
import { FloorMap } from "./floor_map.js";
import { Hazards } from "./hazards.js";
import { Phase } from "./phase.js";

export default function LivePage() {
  const { welcome, status } = shown();
  if (!welcome) {
    return html`<section class="card empty"><h2>${say("No drone yet")}</h2>
      <p>${say("Start one:")} <code>flightd sim --speed 1 --set ground.listen=127.0.0.1</code></p></section>`;
  }
  return html`
    <div class=${hears().good ? "live" : "live old"}>
      <div class="side">
        ${status && html`<${Phase} status=${status} />`}
        ${status && html`<${Hazards} hazards=${status.hazards} />`}
        ${state.screen === "may lock" && isAttending(shown()) && html`<p class="quiet" role="status">${say("This browser cannot keep the screen on, and a page on a locked screen does not attend: keep it on in the settings of the device.")}</p>`}
        ${status && html`<${Acts} key=${state.selected} status=${status} welcome=${welcome} />`}
      </div>
      <div class="sight">
        <${FloorMap} floor=${welcome.floor} />
        <div class="cameras">
          ${welcome.cameras.map((camera) => html`<${Camera} key=${camera} camera=${camera} />`)}
        </div>
      </div>
      <div class="details">
        ${status && html`<${Facts} status=${status} />`}
        <${Events} />
      </div>
    </div>
  `;
}
