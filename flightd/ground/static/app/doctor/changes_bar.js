// What was changed and not sent yet, who sends it, and what came of it.
import { mayChange, signedInName } from "../access/session.js";
import { unlessBusy } from "../busy.js";
import { html, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { setWho, who } from "../stock/decisions.js";
import { sendDrone } from "./asking.js";
import { shownValue, valueIn } from "./settings_keys.js";

export function ChangesBar({ drone, told, changes, complaint, onTake, onDrop, onUndo }) {
  const [person, setPerson] = useState(who());
  const [outcome, setOutcome] = useState({ text: "", good: true });
  const [busy, setBusy] = useState(false);
  const names = Object.keys(changes);
  const act = async (what, body, words) => {
    const acts = signedInName() || person.trim();
    if (!acts) return setOutcome({ text: english("Say who you are first."), good: false });
    if (!signedInName()) setWho(acts);
    setBusy(true);
    setOutcome({ text: words.meanwhile, good: true });
    try {
      const answer = await sendDrone(drone, what, { ...body, person: acts });
      if (answer.table) onTake(answer);
      setOutcome({ text: words.done, good: true });
    } catch (error) {
      setOutcome({ text: error.message, good: false });
    } finally {
      setBusy(false);
    }
  };
  const send = () =>
    act("settings", { base: told.tag, changes }, { meanwhile: english("The drone checks them as a whole …"), done: english("The drone has written them.") });
  const restart = () => act("restart", {}, { meanwhile: english("Asking …"), done: english("flightd starts anew: a few seconds.") });
  return html`
    <section class="card changes" aria-labelledby="changes-title">
      <h2 id="changes-title">${names.length ? say("{n} change not sent yet|{n} changes not sent yet", { n: names.length }) : say("Changes")}</h2>
      ${!names.length && !told.locked && html`<p class="quiet">${say("Type a value, look at what is said of it, and send it to the drone while it stands disarmed. What is sent is taken at the next start of flightd.")}</p>`}
      ${told.locked && html`<p class="quiet">${say("Nothing can be changed now.")}</p>`}
      <ul>
        ${names.map((name) => html`
          <li key=${name}><span><code>${name}</code> ${shownValue(valueIn(told.table, name))} → <b>${shownValue(changes[name])}</b></span>
            <button class="link" aria-label=${say("Undo {name}", { name })} onClick=${() => onUndo(name)}>${say("Undo")}</button></li>`)}
      </ul>
      ${complaint && html`<p class="refusal" role="status">${quoted(complaint)}</p>`}
      ${(names.length > 0 || told.pending) && mayChange() && !signedInName() && html`
        <label class="field">${say("Who")}
          <input value=${person} maxlength="60" autocomplete="name" onInput=${(event) => setPerson(event.target.value)} />
        </label>`}
      ${names.length > 0 && html`
        <div class="changes-orders">
          <button class="order" disabled=${Boolean(complaint) || Boolean(told.locked)} ...${unlessBusy(busy, send)}>${say("Send to {drone}", { drone })}</button>
          <button class="order" ...${unlessBusy(busy, onDrop)}>${say("Drop")}</button>
        </div>`}
      <p class=${outcome.good ? "quiet" : "refusal"} role="status">${quoted(outcome.text)}</p>
      ${told.pending && html`
        <div class="obstacles"><p>${say("flightd still runs by older settings: it takes these at its next start.")}</p>
          ${told.restarts && mayChange()
            ? html`<button class="order" disabled=${names.length > 0} ...${unlessBusy(busy, restart)}>${say("Start flightd anew")}</button>`
            : html`<p>${mayChange() ? say("Start it anew on the drone.") : say("An admin starts it anew.")}</p>`}
        </div>`}
    </section>
  `;
}
