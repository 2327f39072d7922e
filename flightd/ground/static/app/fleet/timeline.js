// What each drone did in the last minutes, does, and is to do, against time: what is released to it is filled, what is
// only planned is not.
import { html } from "../html.js";
import { english, say } from "../language.js";
import { capital, duration } from "../words.js";
import { Badge } from "./the_drones.js";

const LEAST_S = 60;
const MOST_S = 600;
const PAST_S = 120;
const STEPS_S = [15, 30, 60, 120];
const MOST_TICKS = 9;

const ACTS = {
  __proto__: null,
  fly: english("flies to {node}"), count: english("visits {node}"), turn: english("turns over {node}"),
  "take off": english("takes off over {node}"), land: english("lands at {node}"), climb: english("changes height over {node}"),
};

export function Timeline({ told, marks }) {
  const drones = Object.entries(told.drones);
  const end = Math.min(Math.max(LEAST_S, ...drones.flatMap(([, { plan }]) => plan.map((one) => one.end_s))), MOST_S);
  const begin = drones.some(([, { past }]) => past.some((one) => one.end_s > -PAST_S)) ? -Math.min(PAST_S, end / 2) : 0;
  const at = (seconds) => (100 * (Math.min(Math.max(seconds, begin), end) - begin)) / (end - begin);
  return html`
    <section class="card timeline" aria-labelledby="timeline">
      <h3 id="timeline">${say("Timeline")}</h3>
      <div class="timeline-rows">
        ${drones.map(([name, { past, plan, flown }]) => html`<${Row} key=${name} name=${name} mark=${marks.get(name)} past=${past.filter((one) => one.end_s > begin)} plan=${plan.filter((one) => one.begin_s < end)} flown=${flown} at=${at} />`)}
        <div class="timeline-scale" aria-hidden="true"><span class="timeline-name" /><div class="timeline-track">${ticks(begin, end).map(([seconds, kind]) => html`<span key=${seconds} class=${`tick ${kind}`} style=${{ left: `${at(seconds)}%` }}>${tickWords(seconds)}</span>`)}</div></div>
      </div>
      <ul class="legend" aria-label=${say("Legend")}>
        <li><i class="mark-released" />${say("released")}</li>
        <li><i class="mark-planned" />${say("planned")}</li>
        <li><i class="mark-visit" />${say("visits a node")}</li>
        ${begin < 0 && html`<li><i class="mark-past" />${say("done")}</li>`}
      </ul>
    </section>
  `;
}

function Row({ name, mark, past, plan, flown, at }) {
  return html`
    <div class=${`timeline-row d${mark.kind}`}>
      <span class="timeline-name"><${Badge} mark=${mark} /><strong>${name}</strong></span>
      <div class="timeline-track">
        <i class="timeline-now" style=${{ left: `${at(0)}%` }} />
        <ol aria-label=${say("What {name} does", { name })}>
          ${past.map((one, i) => html`<${Bar} key=${`past ${i}`} one=${one} kind="past" at=${at} />`)}
          ${plan.map((one, i) => html`<${Bar} key=${i} one=${one} kind=${one.released ? "released" : "planned"} at=${at} />`)}
        </ol>
        ${!plan.length && html`<span class="timeline-none">${flown ? say("nothing to do") : say("not flown by the fleet")}</span>`}
      </div>
    </div>
  `;
}

const SHORT = 3; // percent of the row: a bar that is shorter has no name in it

function Bar({ one, kind, at }) {
  const [left, right] = [at(one.begin_s), at(one.end_s)];
  const words = wordsOf(one, kind);
  return html`
    <li class=${`bar ${kind} act-${one.act.replace(" ", "-")}`} style=${{ left: `${left}%`, width: `${right - left}%` }} title=${words}>
      <span class="unseen">${words}</span>
      ${right - left > SHORT && one.act !== "turn" && html`<span aria-hidden="true">${one.act === "land" ? "⤓" : one.act === "take off" ? "⤒" : one.node}</span>`}
    </li>
  `;
}

function wordsOf({ act, node, begin_s: begin, end_s: end }, kind) {
  const what = capital(say(ACTS[act] ?? act, { node }));
  if (kind === "past") return say("{what}, done {time} ago", { what, time: duration(-end) });
  if (begin <= 0) return say("{what}, for {time} more", { what, time: duration(Math.max(end, 0)) });
  return kind === "released" ? say("{what} in {time}, released", { what, time: duration(begin) }) : say("{what} in {time}, planned", { what, time: duration(begin) });
}

function ticks(begin, end) {
  const step = STEPS_S.find((one) => (end - begin) / one <= MOST_TICKS) ?? STEPS_S.at(-1);
  const found = [];
  for (let at = Math.ceil(begin / step) * step; at <= end - step / 4; at += step) found.push([at, at === 0 ? "now" : (at / step) % 2 ? "minor" : ""]);
  return found;
}

const tickWords = (seconds) => (seconds === 0 ? say("now") : `${seconds > 0 ? "+" : "−"}${Math.floor(Math.abs(seconds) / 60)}:${String(Math.abs(seconds) % 60).padStart(2, "0")}`);
