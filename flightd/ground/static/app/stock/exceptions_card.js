// The places that need a look as a queue: what is the matter, who looks, what was decided.
import { mayOperate } from "../access/session.js";
import { isGivenUp } from "../fetching.js";
import { html, useMemo, useState } from "../html.js";
import { quoted, say } from "../language.js";
import { recount } from "../missions/missions_source.js";
import { goTo } from "../router.js";
import { DECISIONS, exceptions } from "./decisions.js";
import { outcomeWords } from "./expected_card.js";
import { STATES } from "./states.js";
import { change, stock } from "./stock_state.js";

const SHOWN = 200;
const MOST_RECOUNTED = 300; // fit into one request

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
        <h3 id="exceptions">${open.length ? say("{n} place to look at|{n} places to look at", { n: open.length }) : say("Nothing to look at")}</h3>
        ${all.length > open.length &&
        html`<button class="order" aria-pressed=${known.withClosed} onClick=${() => change({ withClosed: !known.withClosed })}>
          ${say("{n} closed place|{n} closed places", { n: all.length - open.length })}
        </button>`}
      </div>
      ${mayOperate() && html`<${Recount} places=${recounted(open)} source=${known.source} />`}
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
  return (ordered.length ? ordered : open).map(({ code }) => code).slice(0, MOST_RECOUNTED);
}

function Recount({ places, source }) {
  const [trouble, setTrouble] = useState("");
  if (!places.length) return null;
  const plan = async () => {
    try {
      await recount(source.name, places);
      goTo("/missions");
    } catch (error) {
      if (!isGivenUp(error)) setTrouble(error.message);
    }
  };
  return html`
    <div class="recount">
      <button class="order" onClick=${plan}>${say("Recount {n} place as a mission|Recount {n} places as a mission", { n: places.length })}</button>
      ${trouble && html`<p class="refusal" role="alert">${quoted(trouble)}</p>`}
    </div>
  `;
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
