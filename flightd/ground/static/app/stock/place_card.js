// One place: its picture with the codes' outlines, what is known of it, and its history.
import { mayOperate } from "../access/session.js";
import { html, useEffect, useState } from "../html.js";
import { decimal, english, quoted, say } from "../language.js";
import { dateAndTime } from "../words.js";
import { DecisionForm } from "./decision_form.js";
import { outcomeWords } from "./expected_card.js";
import { differs, inOrder, isShown, stock } from "./stock_state.js";
import { toggleSelected } from "./selection.js";
import { rackWords, STATES } from "./states.js";
import { outlinesOf, pictureUrl } from "./stock_source.js";

const STANDINGS = { pending: english("not booked yet"), confirmed: "", withdrawn: english("withdrawn") };

export function PlaceCard({ onChoose }) {
  const known = stock();
  const { chosen, places, looks } = known;
  const [shownLook, showLook] = useState(0);
  useEffect(() => showLook(0), [chosen]);
  const place = places[chosen];
  if (!place) return null;
  const told = looks?.code === chosen ? looks : null;
  const look = told?.looks[shownLook] ?? told?.looks[0];
  const onKeyDown = (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (step && event.target.tagName !== "INPUT" && !event.ctrlKey && !event.altKey && !event.metaKey) walk(step);
  };
  const walk = (step) => {
    const next = nextShown(known, step);
    if (next) onChoose(next);
  };
  return html`
    <section class="card place" aria-labelledby="place" onKeyDown=${onKeyDown}>
      <div class="place-head">
        <h2 id="place">${chosen}</h2>
        <button class="order" onClick=${() => walk(-1)} disabled=${!nextShown(known, -1)} aria-label=${say("Previous place")}>←</button>
        <button class="order" onClick=${() => walk(1)} disabled=${!nextShown(known, 1)} aria-label=${say("Next place")}>→</button>
        <button class="order" onClick=${() => onChoose("")} aria-label=${say("Close")}>${say("Close")}</button>
      </div>
      <p class="place-state" role="status">
        <i class=${`cell state-${place.state}`} aria-hidden="true">${STATES[place.state].mark}</i>
        <strong>${say(STATES[place.state].name)}</strong>
        <span class="quiet">${place.pending ? say("not booked yet") : say(STATES[place.state].means)}</span>
      </p>
      <p class="quiet">${whereIs(chosen, known.fronts)}</p>
      ${known.source.kind === "store" && mayOperate() &&
      html`<label class="check"><input type="checkbox" checked=${known.selected.has(chosen)} onChange=${() => toggleSelected(chosen)} /> ${say("Selected to be counted again")}</label>`}
      <${Outcome} />
      ${told?.trouble && html`<p class="refusal">${quoted(told.trouble)}</p>`}
      ${look?.evidence && html`<${Picture} key=${look.evidence} look=${look} place=${chosen} />`}
      ${look ? html`<${Facts} look=${look} />` : html`<${Told} place=${place} />`}
      <${DecisionForm} key=${chosen} />
      ${told?.looks.length > 0 && html`<${History} looks=${told.looks} shown=${look} onShow=${showLook} />`}
    </section>
  `;
}

function nextShown(known, step) {
  const codes = inOrder(known.fronts);
  for (let at = codes.indexOf(known.chosen) + step; at >= 0 && at < codes.length; at += step) {
    if (isShown(codes[at], known)) return codes[at];
  }
  return undefined;
}

function whereIs(code, fronts) {
  for (const { aisle, side, spots } of fronts) {
    const spot = spots.find(([other]) => other === code);
    if (!spot) continue;
    const [, bay, level, position] = spot;
    if (!bay) return "";
    return say("{rack} · bay {bay} · level {level} · position {position}", { rack: rackWords(aisle, side), bay, level, position });
  }
  return "";
}

function Outcome() {
  const { chosen, expected } = stock();
  const lines = expected?.lines?.filter((line) => line.location === chosen || line.found_at === chosen) ?? [];
  if (!lines.length) return null;
  return html`
    <ul class=${differs(chosen, expected) ? "outcomes differing" : "outcomes"} aria-label=${say("Against the expected stock")}>
      ${lines.map(
        ({ outcome, text, found, found_at: at, location }) => html`
          <li><strong>${outcomeWords(outcome)}</strong>${outcome === "unexpected" ? ": " : `, ${say("expected:")} `}${text}
            ${found && html`<span>, ${say("there is {found}", { found })}</span>`}
            ${at && html`<span>, ${location === chosen ? say("found at {at}", { at }) : say("by the books at {location}", { location })}</span>`}
          </li>
        `,
      )}
    </ul>
  `;
}

function Picture({ look, place }) {
  const { source } = stock();
  const [outlines, setOutlines] = useState([]);
  const [failed, setFailed] = useState(false);
  useEffect(() => {
    let gone = false;
    outlinesOf(source, look.evidence)
      .then((found) => gone || setOutlines(found))
      .catch(() => {}); // the picture is shown without them
    return () => {
      gone = true;
    };
  }, [look.evidence]);
  if (failed) return html`<p class="quiet">${say("Its picture was not kept.")}</p>`;
  const read = new Set(look.reads.map(({ text }) => text));
  return html`
    <figure class="evidence">
      <img src=${pictureUrl(source, look.evidence)} alt=${say("What the camera saw at {place}", { place })} onError=${() => setFailed(true)} />
      <svg viewBox="0 0 1 1" preserveAspectRatio="none" aria-hidden="true">
        ${outlines.map(
          ({ text, corners }) =>
            html`<polygon class=${read.has(text) ? "outline stock-code" : "outline"} points=${corners.join(" ")} />`,
        )}
      </svg>
    </figure>
  `;
}

function Facts({ look }) {
  const { pose, fill } = look;
  const facts = [
    [say("Filled"), fill && (fill.share === null ? say("unknown") : `${decimal(100 * fill.share)} %`)],
    [say("Overhang"), fill?.overhang_m && `${decimal(fill.overhang_m, 2)} m`],
    [say("Leans by"), fill?.share > 0 && (fill.lean_m === null ? say("unknown") : `${decimal(fill.lean_m, 2)} m`)],
    [say("Cases"), fill?.cases && `${fill.cases.columns} x ${fill.cases.rows}`],
    [say("Undecided"), look.undecided?.map(({ text }) => visible(text)).join(", ")],
    [say("Confidence"), `${Math.floor(look.confidence * 100)} %`],
    [say("Looked at"), when(look.utc)],
    [say("Run"), look.run],
    [say("From"), pose && say("node {node}, {height} m", { node: pose.node, height: decimal(pose.height_m, 2) })],
    [say("Standing"), STANDINGS[look.standing] && say(STANDINGS[look.standing])],
  ];
  return html`
    <div class="facts">
      ${look.reads.map((read) => html`<${Read} read=${read} />`)}
      <dl>
        ${facts.filter(([, value]) => value).map(([name, value]) => html`<div key=${name}><dt>${name}</dt><dd>${value}</dd></div>`)}
      </dl>
    </div>
  `;
}

function Read({ read }) {
  const elements = Object.entries(read.gs1);
  return html`
    <p class="read-code">
      <code>${visible(read.text)}</code>
      <span class="quiet">${read.symbology}${elements.length > 0 && ` · ${elements.map(([ai, value]) => `(${ai}) ${value}`).join(" ")}`}</span>
    </p>
  `;
}

// What a drone tells of a place has no picture and no history.
function Told({ place }) {
  return html`${place.texts.map((text) => html`<p class="read-code"><code>${visible(text)}</code></p>`)}`;
}

const visible = (text) => text.replaceAll("\u001d", "␝");

function History({ looks, shown, onShow }) {
  return html`
    <div class="history">
      <h3 id="history">${say("One look|{n} looks", { n: looks.length })}</h3>
      <ol aria-labelledby="history">
        ${looks.map(
          (look, i) => html`
            <li key=${i}>
              <button aria-pressed=${look === shown} onClick=${() => onShow(i)}>
                <i class=${`cell state-${look.state}`} aria-hidden="true">${STATES[look.state].mark}</i>
                <span>${when(look.utc)}</span>
                <span>${say(STATES[look.state].name)}${STANDINGS[look.standing] && `, ${say(STANDINGS[look.standing])}`}</span>
                <span class="quiet">${look.reads.map(({ text }) => visible(text)).join(", ")}</span>
              </button>
            </li>
          `,
        )}
      </ol>
    </div>
  `;
}

const when = (utc) => dateAndTime(new Date(utc));
