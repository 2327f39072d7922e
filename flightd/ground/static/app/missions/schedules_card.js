// Flights that the station starts by itself.
import { mayOperate } from "../access/session.js";
import { html, useState } from "../html.js";
import { dateFormat, quoted, say, sayWith } from "../language.js";
import { missions } from "./missions_state.js";
import { ScheduleForm } from "./schedule_form.js";
import { enableSchedule, removeSchedule } from "./schedules_source.js";
import { weekdayName } from "./weekdays.js";

const WHEN = dateFormat({ weekday: "short", day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" });

export function SchedulesCard({ floor }) {
  const { schedules, scheduleTrouble, list: kept } = missions();
  const [adds, setAdds] = useState(false);
  const may = mayOperate() && schedules?.kept;
  return html`
    <section class="card kept" aria-labelledby="schedules">
      <div class="kept-head">
        <h3 id="schedules">${say("Schedules")}</h3>
        ${may && html`<button class="order" aria-expanded=${adds} onClick=${() => setAdds(!adds)}>${say("New schedule")}</button>`}
      </div>
      ${!floor.unattended_start && html`<p class="note">${sayWith("Nothing starts by itself on this site: its file does not say {key}.", { key: html`<code>unattended_start = true</code>` })}</p>`}
      ${schedules && !schedules.kept && html`<p class="quiet">${sayWith("This station keeps none: start it with {option}.", { option: html`<code>--folder</code>` })}</p>`}
      ${may && adds && html`<${ScheduleForm} floor=${floor} kept=${kept ?? []} onKept=${() => setAdds(false)} />`}
      ${scheduleTrouble && html`<p class="refusal" role="alert">${quoted(scheduleTrouble)}</p>`}
      ${schedules?.kept && !schedules.list.length && html`<p class="quiet">${say("None yet.")}</p>`}
      ${schedules?.list.length > 0 && html`<ul>${schedules.list.map((one) => html`<${Row} key=${one.id} schedule=${one} kept=${kept ?? []} />`)}</ul>`}
    </section>
  `;
}

function Row({ schedule, kept }) {
  const [asks, setAsks] = useState(false);
  const { name, enabled, newest, next, trouble } = schedule;
  return html`
    <li class="row">
      <div class="schedule">
        <strong>${name}</strong>
        <span class="quiet">${countWords(schedule, kept)} · ${daysWords(schedule)}</span>
        <span class="quiet">${trouble ? quoted(trouble) : enabled ? next.length > 0 && say("next {when}", { when: WHEN.format(new Date(next[0].at)) }) : say("suspended")}</span>
        ${newest && html`<span class=${newest.state === "started" ? "quiet" : "note"}>${runWords(newest)}</span>`}
      </div>
      ${mayOperate() &&
      html`<div class="row-acts">
        ${enabled
          ? html`<button class="tab" onClick=${() => enableSchedule(schedule, false)} aria-label=${say("Suspend {name}", { name })}>${say("Suspend")}</button>`
          : html`<button class="tab" onClick=${() => enableSchedule(schedule, true)} aria-label=${say("Resume {name}", { name })}>${say("Resume")}</button>`}
        ${asks
          ? html`<button class="tab sure-delete" onClick=${() => removeSchedule(schedule)} aria-label=${say("Delete {name} for good", { name })}>${say("Delete for good")}</button>
              <button class="tab" onClick=${() => setAsks(false)}>${say("Keep it")}</button>`
          : html`<button class="tab" onClick=${() => setAsks(true)} aria-label=${say("Delete {name}", { name })}>${say("Delete")}</button>`}
      </div>`}
    </li>
  `;
}

function countWords({ count }, kept) {
  if (count.kind === "mission") return kept.find(({ id }) => id === count.mission)?.name ?? say("a mission that is not kept any more");
  if (count.kind === "aisles") return say("aisles {aisles}", { aisles: count.aisles.join(", ") });
  if (count.kind === "value") return say("Work by value");
  return say("all within {n} day, exceptions first|all within {n} days, exceptions first", { n: count.within_days });
}

function daysWords({ weekdays, every_days: every, at, zone }) {
  const days = weekdays.length ? weekdays.map(weekdayName).join(", ") : say("every day|every {n} days", { n: every });
  return say("{days} at {time}, {zone}", { days, time: at, zone });
}

function runWords({ day, state, why }) {
  if (state === "started") return say("{day}: started", { day });
  if (state === "ordered") return say("{day}: ordered, not answered yet", { day });
  const because = quoted(why);
  if (state === "waiting") return sayWith("{day} waits: {why}", { day, why: because });
  if (state === "missed") return sayWith("{day} missed: {why}", { day, why: because });
  return sayWith("{day}: nobody knows whether it flew: {why}", { day, why: because });
}
