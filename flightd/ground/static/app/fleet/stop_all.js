// STOP for every drone of the station.  The first press arms it, the second one within some seconds sends it: no
// dialog stands between, and a slip of the hand stops nobody.
import { act } from "../acts.js";
import { html, useEffect } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { state } from "../store.js";
import { change, fleet } from "./fleet_state.js";

const ARMED_MS = 5000;
const SOON_MS = 1000; // what POST has not answered by then goes over the open socket, drone by drone
const ANSWER_MS = 20000;

export function StopAll({ names }) {
  const { stop } = fleet();
  const isArmed = stop?.stage === "armed";
  useEffect(() => {
    if (!isArmed) return undefined;
    const over = setTimeout(() => change({ stop: null }), ARMED_MS);
    return () => clearTimeout(over);
  }, [isArmed]);
  if (!names.length) return null;
  const press = () => (isArmed ? stopAll(names) : change({ stop: { stage: "armed", outcomes: {} } }));
  const held = (event) => event.repeat && event.preventDefault(); // a key that is held is one press
  return html`
    <section class=${isArmed ? "stop-all armed" : "stop-all"} aria-label=${say("STOP for all drones")}>
      <button class="stop" onClick=${press} onKeyDown=${held} title=${say("Level at once and down at once, without steering")}>
        <strong>${isArmed ? say("Press again: STOP {n} drone|Press again: STOP all {n} drones", { n: names.length }) : say("STOP ALL")}</strong>
      </button>
      <div class="stop-all-said" role="status">
        ${!stop && html`<span class="quiet">${say("Press twice: every drone comes down at once.")}</span>`}
        ${isArmed && html`<span>${say("Armed for 5 seconds.")}</span><i class="stop-all-left" aria-hidden="true" />`}
        ${stop && !isArmed && html`<${Outcomes} names=${names} stop=${stop} />`}
      </div>
      ${stop?.stage === "told" && html`<button class="tab" onClick=${() => change({ stop: null })}>${say("Close")}</button>`}
    </section>
  `;
}

function Outcomes({ names, stop }) {
  return html`<ul>${names.map((name) => html`<li key=${name} class=${classOf(outcomeOf(name, stop))}><strong>${name}</strong>${" "}${outcomeWords(outcomeOf(name, stop))}</li>`)}</ul>`;
}

const classOf = ({ stage }) => (stage === "refused" ? "stop-refused" : stage === "accepted" ? "stop-accepted" : "");

function outcomeWords({ stage, text }) {
  if (stage === "accepted") return say("STOP accepted");
  if (stage === "refused") return sayWith("STOP refused: {why}", { why: quoted(text) });
  return text ? sayWith("STOP not accepted yet: {why}", { why: quoted(text) }) : say("STOP sent …");
}

// What a drone answered to the order for all, or to its own since.
function outcomeOf(name, { at, outcomes }) {
  const own = state.acts.get(name);
  if (own?.command === "stop" && own.at >= at) return own;
  const text = outcomes[name];
  if (text === undefined) return { stage: "sent", text: "" };
  return { stage: text ? "refused" : "accepted", text };
}

async function stopAll(names) {
  const at = performance.now();
  change({ stop: { stage: "sent", at, outcomes: {} } });
  const posting = posted();
  const soon = await Promise.race([posting, new Promise((resolve) => setTimeout(resolve, SOON_MS))]);
  const again = soon ? soon.again : names;
  const each = again.map((name) => act("stop", "", "", name));
  const told = soon ?? (await posting);
  if (told && fleet().stop?.at === at) {
    const outcomes = Object.fromEntries(names.filter((name) => !told.again.includes(name)).map((name) => [name, told.refused[name] ?? ""]));
    change({ stop: { stage: "told", at, outcomes } });
  }
  await Promise.all(each);
  if (fleet().stop?.at === at) change({ stop: { ...fleet().stop, stage: "told" } });
}

// Not through the gate for requests: it waits behind nobody's.
async function posted() {
  try {
    const answer = await fetch("/api/fleet/stop", { method: "POST", keepalive: true, signal: AbortSignal.timeout(ANSWER_MS) });
    return answer.ok ? await answer.json() : null;
  } catch {
    return null;
  }
}
