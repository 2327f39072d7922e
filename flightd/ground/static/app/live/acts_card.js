// What a person may order now, what keeps the drone on the ground, and what became of the newest order.
import { mayOperate } from "../access/session.js";
import { act } from "../acts.js";
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { hasSingleKeys, SingleKeys } from "../single_keys.js";
import { state, update } from "../store.js";
import { capital, COMMANDS, isGrounded } from "../words.js";
import { HoldButton } from "./hold_button.js";

const SHOWN_MS = 20000;

export function Acts({ status, welcome }) {
  const may = (command) => status.possible.includes(command);
  if (welcome.role !== "operator") {
    return html`<section class="card acts"><h2>${say("Only looking on")}</h2>
      <p class="quiet">${say("The key of this station has the role {role}; orders need an operator's.", { role: say(welcome.role) })}</p></section>`;
  }
  if (!mayOperate()) {
    return html`<section class="card acts" aria-labelledby="acts"><h2 id="acts">${say("Only looking on")}</h2>
      <p class="quiet">${say("{name} is a viewer: what flies needs an operator. STOP and Pause are everybody’s.", { name: state.session.name })}</p>
      <div class="buttons"><${Order} command="pause" may=${may("pause")} key_="P" /></div>
      <${SingleKeys} />
      <${Outcome} /></section>`;
  }
  const waits = status.phase === "preflight" || status.phase === "swap";
  return html`
    <section class="card acts" aria-labelledby="acts">
      <h2 id="acts" class="unseen">${say("Orders")}</h2>
      ${waits && html`<${Obstacles} obstacles=${status.obstacles} />`}
      ${waits && status.plan && html`<p class="quiet">${sayWith("A start flies the {n} node handed over on {missions}.|A start flies the {n} nodes handed over on {missions}.", { n: status.nodes_planned, missions: html`<a href="/missions">${say("Missions")}</a>` })}</p>`}
      <div class="buttons">
        ${waits &&
        html`<${HoldButton} disabled=${!may("start")} onHeld=${() => act("start")}>${say("Start")}<//>`}
        <${Order} command="pause" may=${may("pause")} key_="P" />
        <${Order} command="resume" may=${may("resume")} key_="R" />
        <${Order} command="home" may=${may("home")} />
        <${Order} command="land" may=${may("land") && !isGrounded(status)} />
      </div>
      <${GoTo} nodes=${welcome.floor.nodes} may=${may("goto")} />
      <${SingleKeys} />
      <${Outcome} />
    </section>
  `;
}

function Order({ command, may, key_ }) {
  return html`
    <button class="order" disabled=${!may} onClick=${() => act(command)}>
      ${say(COMMANDS[command])}${key_ && hasSingleKeys() && html` <kbd>${key_}</kbd>`}
    </button>
  `;
}

export function Obstacles({ obstacles }) {
  if (!obstacles.length) return html`<p class="ready"><span class="dot" />${say("Ready to fly")}</p>`;
  return html`
    <div class="obstacles">
      <p>${say("It stays on the ground:")}</p>
      <ul>${obstacles.map((text) => html`<li key=${text}>${quoted(text, capital)}</li>`)}</ul>
    </div>
  `;
}

function GoTo({ nodes, may }) {
  const choose = (event) => {
    const node = event.target.value;
    update((s) => {
      s.chosenNode = node;
    });
  };
  const node = state.chosenNode;
  return html`
    <div class="goto">
      <label for="goto-node">${say("Node")}</label>
      <select id="goto-node" value=${node} onChange=${choose}>
        <option value="">${say("choose here or on the map")}</option>
        ${nodes.map(({ id }) => html`<option key=${id} value=${id}>${id}</option>`)}
      </select>
      <button class="order" disabled=${!may || !node} onClick=${() => act("goto", node)}>
        ${say("Go to {node}", { node: node || "…" })}
      </button>
    </div>
  `;
}

function Outcome() {
  const given = state.acts.get(state.selected);
  const newest = given && performance.now() - given.at < SHOWN_MS ? given : undefined;
  const words = newest && `${say(COMMANDS[newest.command])}${newest.node ? ` ${newest.node}` : ""}`;
  const text = {
    sent: newest?.text ? sayWith("not accepted yet: {why}", { why: quoted(newest.text) }) : say("sent …"),
    accepted: say("accepted"),
    refused: quoted(newest?.text),
  }[newest?.stage];
  return html`
    <p class=${`outcome ${newest?.stage ?? ""}`} role="status">${newest && [`${words}: `, text]}</p>
  `;
}
