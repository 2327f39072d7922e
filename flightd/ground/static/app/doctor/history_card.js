// The versions of the settings that the drone keeps: who changed what, when, and the way back.
import { mayChange, signedInName } from "../access/session.js";
import { html, useState } from "../html.js";
import { dateFormat, english, quoted, say } from "../language.js";
import { who } from "../stock/decisions.js";
import { sendDrone } from "./asking.js";
import { shownValue } from "./settings_keys.js";

const WHEN = dateFormat({ dateStyle: "medium", timeStyle: "short" });

export function HistoryCard({ drone, told, onTake }) {
  const [sure, setSure] = useState(0);
  const [outcome, setOutcome] = useState({ text: "", good: true });
  const takeBack = async (version) => {
    if (sure !== version) return setSure(version);
    setSure(0);
    setOutcome({ text: english("The drone checks that version as a whole …"), good: true });
    try {
      onTake(await sendDrone(drone, "take-back", { base: told.tag, version, person: signedInName() || who() }));
      setOutcome({ text: english("The settings are as they were before that change."), good: true });
    } catch (error) {
      setOutcome({ text: error.message, good: false });
    }
  };
  return html`
    <section class="card history-card" aria-labelledby="history-title">
      <h2 id="history-title">${say("Earlier changes")}</h2>
      <p class=${outcome.good ? "quiet" : "refusal"} role="status">${quoted(outcome.text)}</p>
      ${!told.versions.length && html`<p class="quiet">${say("None was made from the ground. Each is kept on the drone, with a way back.")}</p>`}
      <ol>
        ${told.versions.map(({ number, utc, person, client, changes }) => html`
          <li key=${number}>
            <p><b>${person || client}</b> <span class="quiet">${WHEN.format(new Date(utc))}</span></p>
            <ul>${changes.map(({ key, before, after }) => html`<li key=${key}><code>${key}</code> ${shownValue(before)} → ${shownValue(after)}</li>`)}</ul>
            ${mayChange() && html`<button class="order" disabled=${Boolean(told.locked)} onClick=${() => takeBack(number)}>
              ${sure === number ? say("Really go back") : say("Back to before this")}</button>`}
          </li>`)}
      </ol>
    </section>
  `;
}
