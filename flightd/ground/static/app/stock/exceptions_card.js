// The places that need a look, as a queue: why, who looks, what was decided.
import { mayOperate } from "../access/session.js";
import { html, useMemo } from "../html.js";
import { say } from "../language.js";
import { DECISIONS, exceptions } from "./decisions.js";
import { outcomeWords } from "./expected_card.js";
import { RecountButton } from "./recount_button.js";
import { STATES } from "./states.js";
import { change, stock } from "./stock_state.js";

const SHOWN = 200;

export function ExceptionsCard({ onChoose }) {
  const known = stock();
  const { fronts, places, expected, decisions } = known;
  const all = useMemo(() => exceptions(known), [fronts, places, expected, decisions]);
  if (known.source?.kind !== "store") return null;
  const open = all.filter((one) => one.open);
  const again = recounted(open);
  const listed = known.withClosed ? all : open;
  return html`
    <section class="card exceptions" aria-labelledby="exceptions">
      <div class="expected-head">
        <h3 id="exceptions">${open.length ? say("{n} place to look at|{n} places to look at", { n: open.length }) : say("Nothing to look at")}</h3>
        ${all.length > open.length &&
        html`<button class="order" aria-pressed=${known.withClosed} onClick=${() => change({ withClosed: !known.withClosed })}>
          ${say("{n} closed place|{n} closed places", { n: all.length - open.length })}
        </button>`}
      </div>
      ${mayOperate() && again.length > 0 &&
      html`<${RecountButton} places=${again}>${say("Recount {n} place as a mission|Recount {n} places as a mission", { n: again.length })}<//>`}
      ${listed.length > 0 &&
      html`
        <ol aria-labelledby="exceptions">
          ${listed.slice(0, SHOWN).map((one) => html`<${Row} key=${one.code} ...${one} onChoose=${onChoose} />`)}
        </ol>
      `}
      ${listed.length > SHOWN && html`<p class="quiet">${say("and {n} more", { n: listed.length - SHOWN })}</p>`}
    </section>
  `;
}

// What somebody ordered to be counted again, or else all that is open.
function recounted(open) {
  const ordered = open.filter(({ decision }) => decision?.what === "count_again");
  return (ordered.length ? ordered : open).map(({ code }) => code);
}

function Row({ code, decision, open, onChoose }) {
  const { places, expected, chosen } = stock();
  const place = places[code];
  const matter = [say(STATES[place.state].name)];
  if (expected?.outcomes?.[code]) matter.push(say("against the books: {outcome}", { outcome: outcomeWords(expected.outcomes[code]) }));
  return html`
    <li>
      <button class=${open ? "exception" : "exception closed"} aria-pressed=${code === chosen} onClick=${() => onChoose(code)}>
        <i class=${`cell state-${place.state}`} aria-hidden="true">${STATES[place.state].mark}</i>
        <strong>${code}</strong>
        <span>${matter.join(", ")}</span>
        ${decision && decision.what !== "open" &&
        html`<span class="quiet">${say(DECISIONS[decision.what].name)}, ${decision.who}${decision.note && `: ${decision.note}`}</span>`}
      </button>
    </li>
  `;
}
