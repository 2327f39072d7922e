// What a person decides about the place in the card, with a name and a note; and what was decided before.
import { mayOperate, signedInName } from "../access/session.js";
import { html, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { dayAndTime } from "../words.js";
import { DECISIONS, decide, needsALook, setWho, standing, who } from "./decisions.js";
import { stock } from "./stock_state.js";

export function DecisionForm() {
  const known = stock();
  const { chosen, source, decisions } = known;
  const [note, setNote] = useState("");
  const [name, setName] = useState(who());
  const [outcome, setOutcome] = useState({ text: "", good: true });
  const before = decisions[chosen] ?? [];
  if (source.kind !== "store" || (!mayOperate() && !needsALook(chosen, known) && !before.length)) return null;
  const now = standing(chosen, known)?.what ?? "open";
  const send = async (what) => {
    if (!signedInName() && !name.trim()) return setOutcome({ text: english("Say who you are first."), good: false });
    if (!signedInName()) setWho(name.trim());
    try {
      await decide(chosen, what, note);
      setNote("");
      setOutcome({ text: english("Noted."), good: true });
    } catch (error) {
      setOutcome({ text: error.message, good: false });
    }
  };
  return html`
    <div class="decision" role="group" aria-label=${say("Decision")}>
      ${!mayOperate() && html`<p class="quiet">${say("Only looking on: an operator decides.")}</p>`}
      ${mayOperate() && !signedInName() &&
      html`<label class="field">${say("Who")}
        <input value=${name} maxlength="60" autocomplete="name" onInput=${(event) => setName(event.target.value)} />
      </label>`}
      ${mayOperate() &&
      html`<label class="field">${say("Note")}
        <input value=${note} maxlength="500" onInput=${(event) => setNote(event.target.value)} />
      </label>
      <div class="decision-orders">
        ${Object.entries(DECISIONS)
          .filter(([what]) => (what === "open" ? now !== "open" : what === "count_again" || needsALook(chosen, known)))
          .map(([what, { order }]) => html`<button key=${what} class="order" aria-pressed=${now === what} onClick=${() => send(what)}>${say(order)}</button>`)}
      </div>`}
      <p class=${outcome.good ? "quiet" : "refusal"} role="status">${quoted(outcome.text)}</p>
      ${before.length > 0 &&
      html`
        <ol class="decided" aria-label=${say("Decided so far")}>
          ${before.toReversed().map(({ at_s: at, what, who: by, note: said }) => html`
            <li key=${at}><span class="quiet">${dayAndTime(at * 1000)}</span> ${say(DECISIONS[what].name)}, ${by}${said && `: ${said}`}</li>
          `)}
        </ol>
      `}
    </div>
  `;
}
