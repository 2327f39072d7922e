// A new schedule for the drone that is shown.
import { html, useState } from "../html.js";
import { say } from "../language.js";
import { state } from "../store.js";
import { keepSchedule } from "./schedules_source.js";
import { WEEKDAYS, weekdayName } from "./weekdays.js";

const ALL = "all", VALUE = "value";

export function ScheduleForm({ floor, kept, onKept }) {
  const aisles = [...new Set(floor.nodes.map(({ aisle }) => aisle))].filter(Boolean);
  const [given, setGiven] = useState({
    name: "", count: aisles.length ? `aisles ${aisles[0]}` : ALL, within: "7", most: "20", days: [], at: "22:00", late: "120", begin: "", end: "",
    zone: Intl.DateTimeFormat().resolvedOptions().timeZone,
  });
  const set = (key) => (event) => setGiven({ ...given, [key]: event.target.value });
  const turn = (day) => {
    const days = given.days.includes(day) ? given.days.filter((one) => one !== day) : [...given.days, day];
    setGiven({ ...given, days: days.sort() });
  };
  const onSubmit = async (event) => {
    event.preventDefault();
    if (await keepSchedule({ drone: state.selected, ...keptOf(given) })) onKept();
  };
  const input = (key, words, rest) => html`<label class="field">${words}<input autocomplete="off" spellcheck=${false} required value=${given[key]} onInput=${set(key)} ...${rest} /></label>`;
  return html`
    <form class="schedule-form" aria-labelledby="schedules" onSubmit=${onSubmit}>
      ${input("name", say("Name"), { maxlength: 80 })}
      <label class="field">${say("What is counted")}
        <select value=${given.count} onChange=${set("count")}>
          ${aisles.map((aisle) => html`<option key=${aisle} value=${`aisles ${aisle}`}>${say("Aisle {aisle}", { aisle })}</option>`)}
          ${kept.map(({ id, name }) => html`<option key=${id} value=${`mission ${id}`}>${name}</option>`)}
          <option value=${ALL}>${say("All of the site, exceptions first")}</option>
          <option value=${VALUE}>${say("Work by value")}</option>
        </select>
      </label>
      ${given.count === ALL && input("within", say("Each place within days"), { type: "number", min: 1, max: 366 })}
      ${given.count === VALUE && input("most", say("How many"), { type: "number", min: 1, max: 500 })}
      <div class="choose-row" role="group" aria-label=${say("Days of the week; none: every day")}>
        ${WEEKDAYS.map((day) => html`<button type="button" class="pick" key=${day} aria-pressed=${given.days.includes(day)} onClick=${() => turn(day)}>${weekdayName(day)}</button>`)}
      </div>
      ${input("at", say("Starts at"), { type: "time" })}
      ${input("zone", say("Time zone"), { maxlength: 64 })}
      ${input("late", say("Minutes late at most"), { type: "number", min: 5, max: 8640 })}
      ${input("begin", say("Nothing starts from"), { type: "time", required: false })}
      ${input("end", say("Nothing starts until"), { type: "time", required: false })}
      <button class="order">${say("Keep schedule")}</button>
    </form>
  `;
}

function keptOf({ name, count, within, most, days, at, zone, late, begin, end }) {
  const [kind, what] = count.split(" ");
  const counts = { aisles: { aisles: [what] }, mission: { mission: what }, all: { within_days: Number(within) }, value: { nodes: Number(most) } };
  return {
    name, at, zone, weekdays: days, late_minutes: Number(late), count: { kind, ...counts[kind] },
    quiet: begin && end ? [{ begin, end }] : [],
  };
}
