// The places that need a look as a queue: what is the matter, who looks, what was decided.
import { html, useMemo } from "../html.js";
import { count } from "../words.js";
import { DECISIONS, exceptions } from "./decisions.js";
import { outcomeWords } from "./expected_card.js";
import { STATES } from "./states.js";
import { change, stock } from "./stock_state.js";

const SHOWN = 200;

export function ExceptionsCard({ onChoose }) {
  const known = stock();
  const { fronts, places, expected, decisions } = known;
  const all = useMemo(() => exceptions(known), [fronts, places, expected, decisions]);
  if (known.source?.kind !== "store") return null;
  const open = all.filter((one) => one.open);
  const listed = known.withClosed ? all : open;
  return html`
    <section class="card exceptions" aria-labelledby="exceptions">
      <div class="expected-head">
        <h3 id="exceptions">${open.length ? `${count(open.length, "place")} to look at` : "Nothing to look at"}</h3>
        ${all.length > open.length &&
        html`<button class="order" aria-pressed=${known.withClosed} onClick=${() => change({ withClosed: !known.withClosed })}>
          ${count(all.length - open.length, "closed place")}
        </button>`}
      </div>
      ${listed.length > 0 &&
      html`
        <ol aria-labelledby="exceptions">
          ${listed.slice(0, SHOWN).map((one) => html`<${Row} key=${one.code} ...${one} onChoose=${onChoose} />`)}
        </ol>
      `}
      ${listed.length > SHOWN && html`<p class="quiet">and ${listed.length - SHOWN} more</p>`}
    </section>
  `;
}

function Row({ code, decision, open, onChoose }) {
  const { places, expected, chosen } = stock();
  const place = places[code];
  const matter = [STATES[place.state].name];
  if (expected?.outcomes?.[code]) matter.push(`against the books: ${outcomeWords(expected.outcomes[code])}`);
  return html`
    <li>
      <button class=${open ? "exception" : "exception closed"} aria-pressed=${code === chosen} onClick=${() => onChoose(code)}>
        <i class=${`cell state-${place.state}`} aria-hidden="true">${STATES[place.state].mark}</i>
        <strong>${code}</strong>
        <span>${matter.join(", ")}</span>
        ${decision && decision.what !== "open" &&
        html`<span class="quiet">${DECISIONS[decision.what].name}, ${decision.who}${decision.note && `: ${decision.note}`}</span>`}
      </button>
    </li>
  `;
}
