// What the chosen flight takes by the drone's own plan, and its start.
import { mayOperate } from "../access/session.js";
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { Obstacles } from "../live/acts_card.js";
import { HoldButton } from "../live/hold_button.js";
import { shown, state } from "../store.js";
import { capital, duration, isGrounded, percent } from "../words.js";
import { fly, flyConfigured } from "./missions_source.js";
import { missions } from "./missions_state.js";

const OUTCOME_MS = 20000;

export function FlyCard({ estimate, waits }) {
  const { nodes, note } = missions();
  const { status, plan, welcome } = shown();
  const flies = status && !waits && !isGrounded(status);
  const may = welcome.role === "operator" && mayOperate();
  return html`
    <section class="card fly" aria-labelledby="fly">
      <h3 id="fly">${flies ? say("In flight") : say("This flight")}</h3>
      ${note && html`<p class="note">${quoted(note)}</p>`}
      ${flies && plan && html`<${Under} plan=${plan} />`}
      ${waits && status.plan && html`<${Handed} status=${status} may=${may} />`}
      ${!nodes.length && !flies && html`<p class="quiet">${say("Choose aisles or nodes: what it takes is shown here at once.")}</p>`}
      ${nodes.length > 0 && !waits && html`<p class="quiet">${say("What a flight takes is told by the drone while it waits on the ground.")}</p>`}
      ${nodes.length > 0 && waits && html`<${Takes} estimate=${estimate} />`}
      ${nodes.length > 0 && waits && may && html`<${Start} estimate=${estimate} status=${status} />`}
      ${!may && html`<p class="quiet">${mayOperate() ? say("Only looking on: a start needs an operator’s key.") : say("Only looking on: {name} is a viewer; what is kept and flown needs an operator.", { name: state.session.name })}</p>`}
    </section>
  `;
}

// What the drone holds already: the next start flies it, wherever that is given.
function Handed({ status, may }) {
  return html`
    <p class="note">${say("The drone holds a flight over {n} node that was handed to it: the next start flies it.|The drone holds a flight over {n} nodes that was handed to it: the next start flies it.", { n: status.nodes_planned })}
      ${may && html`<button class="order" onClick=${flyConfigured}>${say("Fly as configured instead")}</button>`}</p>
  `;
}

// How far the flight is that is under way.
function Under({ plan }) {
  const done = new Set(plan.visited).size;
  const total = new Set(plan.nodes).size;
  return html`
    <p>${sayWith("{done} visited", { done: html`<strong>${say("{done} of {n} node|{done} of {n} nodes", { done, n: total })}</strong>` })}</p>
    <progress value=${done} max=${total} aria-label=${say("Nodes visited")} />
    ${plan.remaining.length > 0 && html`<p class="quiet">${say("Next: {nodes}", { nodes: plan.remaining.slice(0, 6).join(", ") })}${plan.remaining.length > 6 ? " …" : ""}</p>`}
  `;
}

function Takes({ estimate }) {
  if (!estimate) return html`<p class="quiet" role="status">${say("The drone plans it …")}</p>`;
  const { planned, trouble } = estimate;
  const { asked } = missions();
  if (trouble) return html`<p class="refusal" role="alert">${quoted(trouble, capital)}</p>`;
  const figures = [
    [say("Time in the air"), minutes(planned.seconds)],
    [say("Batteries"), planned.batteries],
    [say("Way"), `${Math.round(planned.way_m)} m`],
    [say("Places"), planned.places || say("none counted")],
  ];
  return html`
    <dl class="takes">
      ${figures.map(([name, value]) => html`<div key=${name}><dt>${name}</dt><dd>${value}</dd></div>`)}
    </dl>
    ${asked > 0 && planned.places > asked &&
    html`<p class="note">${say("Counts {places} places, {asked} were asked for: at a node, all on these levels are counted.", { places: planned.places, asked })}</p>`}
    <p class="quiet">
      ${say("The drone’s own estimate: its speeds and turns along this way, and each view of a shelf at its longest; mostly it takes less.")}
      ${" "}${say("Its battery has {charge}; a full one lasts {time} down to its reserve.", { charge: percent(planned.charge), time: duration(planned.battery_s) })}
    </p>
    ${planned.sweeps.length > 0 && html`<p class="quiet">${say("Counted in passing, then by stopping what that leaves open:")}</p><ul class="quiet">${planned.sweeps.map((text) => html`<li key=${text}>${quoted(text, capital)}</li>`)}</ul>`}
    <details class="flown-order">
      <summary>${say("Order of flight")}</summary>
      <ol>${planned.nodes.map((node) => html`<li key=${node}>${node}</li>`)}</ol>
    </details>
  `;
}

const minutes = (seconds) => {
  const whole = Math.round(seconds);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
};

function Start({ estimate, status }) {
  const known = missions();
  const may = status.possible.includes("start") && status.possible.includes("plan") && Boolean(estimate?.planned);
  return html`
    ${
      status.possible.includes("plan")
        ? html`<${Obstacles} obstacles=${status.obstacles} />`
        : html`<p class="note">${say("It takes a mission only before its first start, while it stands disarmed and no start is given.")}</p>`
    }
    <${HoldButton} disabled=${!may} onHeld=${() => fly({ ...known })}>${say("Start this mission")}<//>
    <${Outcome} />
  `;
}

// What became of the nodes that were handed over, and of the start.
function Outcome() {
  const { flying, refused } = missions();
  const newest = state.acts.get(state.selected);
  const start = newest?.command === "start" && performance.now() - newest.at < OUTCOME_MS ? newest : null;
  const words = { sent: say("Start: sent …"), accepted: say("Start: accepted"), refused: sayWith("Start: {why}", { why: quoted(start?.text) }) }[start?.stage];
  const kind = flying ? (refused ? "refused" : "") : (start?.stage ?? "");
  return html`<p class=${`outcome ${kind}`} role="status">${flying ? quoted(flying, capital) : words}</p>`;
}
