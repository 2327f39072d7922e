// The coming days with the runs of all schedules that the station keeps: each by its own schedule's clocks.
import { html, useEffect } from "../html.js";
import { dateFormat, quoted, say, sayWith } from "../language.js";
import { askJson, isGivenUp } from "../fetching.js";
import { state } from "../store.js";
import { isGrounded } from "../words.js";
import { change, fleet } from "./fleet_state.js";

const DAYS = 7;
const AGAIN_MS = 30000;
const DAY = dateFormat({ weekday: "short", day: "numeric", month: "short", timeZone: "UTC" });

export function CalendarCard() {
  const { calendar, calendarFrom, calendarTrouble } = fleet();
  const from = calendarFrom || today();
  useEffect(() => {
    loadCalendar(from);
    const again = setInterval(() => document.hidden || loadCalendar(from), AGAIN_MS);
    return () => clearInterval(again);
  }, [from]);
  const go = (days) => change({ calendarFrom: days ? later(from, days) : "" });
  const shown = calendar?.from === from ? calendar : null;
  return html`
    <section class="card calendar" aria-labelledby="calendar">
      <div class="kept-head">
        <h3 id="calendar">${say("Schedule")}</h3>
        <div class="calendar-acts">
          <button class="tab" aria-label=${say("A week earlier")} onClick=${() => go(-DAYS)}>←</button>
          <button class="tab" disabled=${!calendarFrom} onClick=${() => go(0)}>${say("Today")}</button>
          <button class="tab" aria-label=${say("A week later")} onClick=${() => go(DAYS)}>→</button>
        </div>
      </div>
      ${calendarTrouble && html`<p class="refusal" role="alert">${quoted(calendarTrouble)}</p>`}
      ${shown && !shown.kept && html`<p class="quiet">${sayWith("This station keeps none: start it with {option}.", { option: html`<code>--folder</code>` })}</p>`}
      ${shown?.troubles.map(({ name, why }) => html`<p key=${name} class="refusal">${sayWith("{name}: {why}", { name, why: quoted(why) })}</p>`)}
      ${(!shown || shown.kept) &&
      html`<ol class="week">${Array.from({ length: DAYS }, (_, i) => later(from, i)).map((day) => html`<${Day} key=${day} day=${day} runs=${shown?.runs.filter((run) => run.day === day) ?? []} />`)}</ol>`}
      ${shown?.kept && html`<p class="quiet">${sayWith("Schedules are kept on {missions}.", { missions: html`<a href="/missions">${say("Missions")}</a>` })}</p>`}
    </section>
  `;
}

function Day({ day, runs }) {
  const isToday = day === today();
  return html`
    <li class=${isToday ? "day today" : "day"}>
      <h4>${DAY.format(new Date(`${day}T12:00:00Z`))}${isToday && html` <small>${say("Today")}</small>`}</h4>
      ${runs.length > 0 && html`<ul>${runs.map((run) => html`<${Run} key=${`${run.schedule} ${run.at}`} run=${run} />`)}</ul>`}
    </li>
  `;
}

function Run({ run }) {
  const { words, kind } = stateOf(run);
  return html`
    <li class=${`run run-${kind}`}>
      <p><strong>${run.clock}</strong> ${run.name}</p>
      <p>${words}</p>
      <p class="quiet">${run.drone}${run.zone !== ownZone() && `, ${run.zone}`}</p>
    </li>
  `;
}

function stateOf({ state: how, cause, why, quiet, drone, plan }) {
  if ((how === "due" && quiet) || (how === "waiting" && cause === "quiet")) return { words: say("held back by quiet hours"), kind: "waiting" };
  if (how === "due") return { words: say("due"), kind: "due" };
  if (how === "suspended") return { words: say("suspended"), kind: "suspended" };
  if (how === "ordered") return { words: say("ordered"), kind: "due" };
  if (how === "started") return fliesNow(drone, plan) ? { words: say("flies now"), kind: "flies" } : { words: say("done: it was started"), kind: "done" };
  if (how === "waiting") return { words: sayWith("waits: {why}", { why: quoted(why) }), kind: "waiting" };
  if (how === "missed") return { words: why ? sayWith("missed: {why}", { why: quoted(why) }) : say("missed"), kind: "missed" };
  return { words: sayWith("nobody knows whether it flew: {why}", { why: quoted(why) }), kind: "missed" };
}

function fliesNow(drone, plan) {
  const status = state.drones.get(drone)?.status;
  return Boolean(plan) && status?.plan === plan && !isGrounded(status);
}

const ownZone = () => Intl.DateTimeFormat().resolvedOptions().timeZone;

// By the clock of whoever looks.
const today = () => later("", 0);

function later(day, days) {
  const now = new Date();
  const at = day ? new Date(`${day}T12:00:00Z`) : new Date(Date.UTC(now.getFullYear(), now.getMonth(), now.getDate(), 12));
  at.setUTCDate(at.getUTCDate() + days);
  return at.toISOString().slice(0, 10);
}

async function loadCalendar(from) {
  try {
    const calendar = await askJson(`/api/schedules/calendar?from=${from}&days=${DAYS}`);
    change({ calendar, calendarTrouble: "" });
  } catch (error) {
    if (!isGivenUp(error)) change({ calendarTrouble: error.message });
  }
}
