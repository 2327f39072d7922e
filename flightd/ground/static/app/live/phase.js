// What the drone does now, why, and how far its mission is.
import { html } from "../html.js";
import { quoted, say } from "../language.js";
import { capital, isTroubled, phaseWords } from "../words.js";

export function Phase({ status }) {
  const { nodes_done: done, nodes_planned: planned, reason } = status;
  return html`
    <section class=${isTroubled(status) ? "card phase troubled" : "card phase"} aria-labelledby="phase">
      <h2 id="phase" aria-live="polite">${phaseWords(status)}</h2>
      <p class="reason">${quoted(reason, capital)}</p>
      <label class="progress">
        <progress max=${planned || 1} value=${done} />
        <span>${say("{done} of {planned} nodes visited", { done, planned })}</span>
      </label>
    </section>
  `;
}
