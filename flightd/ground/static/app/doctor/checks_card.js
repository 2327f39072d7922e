// What the drone finds of itself: what is wrong first, with what to do about it, and what it sets right itself.
import { mayChange, signedInName } from "../access/session.js";
import { unlessBusy } from "../busy.js";
import { html, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { who } from "../stock/decisions.js";
import { sendDrone } from "./asking.js";

const LEVELS = {
  __proto__: null,
  error: { name: english("Error"), order: 0 },
  warning: { name: english("Look at it"), order: 1 },
  ok: { name: english("Good"), order: 2 },
  unseen: { name: english("Not seen"), order: 3 },
};

export function ChecksCard({ drone, known, look, take }) {
  const { report, trouble, looking } = known;
  const [fixing, setFixing] = useState("");
  const [outcome, setOutcome] = useState({ text: "", good: true });
  const fix = async (name) => {
    setFixing(name);
    setOutcome({ text: english("Setting {name} right …", { name }), good: true });
    try {
      const told = await sendDrone(drone, "fix", { name, person: signedInName() || who() });
      take(told);
      setOutcome({ text: `${told.outcome}.`, good: true });
    } catch (error) {
      setOutcome({ text: error.message, good: false });
    } finally {
      setFixing("");
    }
  };
  return html`
    <section class="card checks" aria-labelledby="checks-title" aria-busy=${looking}>
      <div class="checks-head">
        <h2 id="checks-title">${verdict(report, trouble)}</h2>
        <button class="order" ...${unlessBusy(looking, look)}>${looking ? say("Looking …") : say("Look again")}</button>
      </div>
      ${trouble && html`<p class="obstacles" role="alert">${quoted(trouble)}</p>`}
      <p class=${outcome.good ? "quiet" : "refusal"} role="status">${quoted(outcome.text)}</p>
      ${!report && looking && html`<p class="quiet">${say("The drone looks at itself: about two seconds.")}</p>`}
      ${report && html`<ul class="check-list">${worstFirst(report.checks).map((check, at) => html`
        <${CheckRow} key=${`${at} ${check.name}`} check=${check} busy=${fixing !== ""} isFixed=${fixing === check.fix && fixing !== ""} onFix=${fix} />`)}
      </ul>`}
    </section>
  `;
}

export function CheckRow({ check, busy, isFixed, onFix }) {
  const { name, level, text, remedy, fix } = check;
  return html`
    <li class=${`check-row is-${level}`}>
      <span class="level">${say(LEVELS[level]?.name ?? level)}</span>
      <div>
        <p><strong>${quoted(name)}</strong> ${quoted(text)}</p>
        ${remedy && html`<p class="remedy">${quoted(remedy)}</p>`}
      </div>
      ${fix && mayChange() && html`<button class="order" aria-label=${say("Set right: {fix}", { fix })} ...${unlessBusy(busy, () => onFix(fix))}>
        ${isFixed ? say("Writing …") : say("Set right")}</button>`}
    </li>
  `;
}

export const worstFirst = (checks) => checks.toSorted((a, b) => (LEVELS[a.level]?.order ?? 9) - (LEVELS[b.level]?.order ?? 9));

function verdict(report, trouble) {
  if (!report) return trouble ? say("Not looked at") : say("Checks");
  const { error = [], warning = [] } = Object.groupBy(report.checks, (check) => check.level);
  if (error.length) return say("Not fit to fly: {n} error|Not fit to fly: {n} errors", { n: error.length });
  return warning.length ? say("No error; {n} thing to look at|No error; {n} things to look at", { n: warning.length }) : say("No error found");
}
