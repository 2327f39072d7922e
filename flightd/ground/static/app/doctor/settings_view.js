// The settings of a drone: a section's keys as a form, what was changed and sent, and the versions that are kept.
import { mayChange } from "../access/session.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, quoted, quotedWhole, say, sayWith } from "../language.js";
import { goTo } from "../router.js";
import { shown, state, update } from "../store.js";
import { losesWork } from "../unsaved.js";
import { askDrone, sendDrone } from "./asking.js";
import { ChangesBar } from "./changes_bar.js";
import { HistoryCard } from "./history_card.js";
import { SettingField } from "./setting_field.js";
import { nameOf, topSections, withChange } from "./settings_keys.js";

const TYPED_MS = 250;
const NONE = {};

// What was typed and not sent outlives this view.
const typedFor = (drone) => state.typedSettings[drone] ?? NONE;
losesWork(() => Object.values(state.typedSettings).some((changes) => Object.keys(changes).length > 0));

// Settings as whoever reads them may change them.
export const forReader = (settings) => (mayChange() || settings.locked ? settings : { ...settings, locked: english("an admin changes settings") });

export function SettingsView({ drone, section }) {
  const [known, setTold] = useState(null);
  const told = known && forReader(known);
  const [trouble, setTrouble] = useState("");
  const changes = typedFor(drone);
  const setChanges = (made) =>
    update((s) => {
      s.typedSettings = { ...s.typedSettings, [drone]: made };
    });
  const complaint = useComplaint(drone, told, changes);
  const session = shown().welcome?.session ?? "";
  const load = () =>
    askDrone(drone, "settings").then(
      (settings) => {
        setTold(settings);
        setTrouble("");
      },
      (error) => error.name !== "AbortError" && setTrouble(error.message),
    );
  useEffect(() => {
    load();
  }, [session]);
  const change = (name, value) => setChanges(withChange(typedFor(drone), name, value));
  const take = (settings) => {
    setTold(settings);
    setChanges(NONE);
  };
  if (!told) {
    return html`<section class="card settings-none"><h2>${say("Settings")}</h2>
      ${trouble
        ? html`<p class="obstacles" role="alert">${quoted(trouble)}</p><button class="order" onClick=${load}>${say("Ask again")}</button>`
        : html`<p class="quiet" role="status">${say("Asking the drone …")}</p>`}</section>`;
  }
  const sections = topSections(told.keys);
  const current = sections.includes(section) ? section : sections[0];
  return html`
    <div class="settings">
      <${Sections} names=${sections} current=${current} changes=${changes} />
      <div class="settings-main">
        ${trouble && html`<p class="obstacles" role="alert">${quoted(trouble)}</p>`}
        ${told.locked && html`<p class="obstacles">${sayWith("Only to look at: {why}.", { why: quoted(told.locked) })}</p>`}
        <${SectionForm} told=${told} current=${current} changes=${changes} complaint=${complaint} onChange=${change} />
      </div>
      <div class="doctor-side">
        <${ChangesBar} drone=${drone} told=${told} changes=${changes} complaint=${complaint} onTake=${take}
          onDrop=${() => setChanges(NONE)} onUndo=${(name) => change(name, undefined)} />
        <${HistoryCard} drone=${drone} told=${told} onTake=${take} />
      </div>
    </div>
  `;
}

// What speaks against what is typed, by the configuration's own models; "" where nothing does.
export function useComplaint(drone, told, changes) {
  const [complaint, setComplaint] = useState("");
  const asked = useRef(new AbortController());
  const typed = JSON.stringify(changes);
  useEffect(() => {
    asked.current.abort();
    asked.current = new AbortController();
    const { signal } = asked.current;
    if (!told || typed === "{}") return setComplaint("");
    const timer = setTimeout(() => {
      sendDrone(drone, "check", { base: told.tag, changes }, { signal }).then(
        (answer) => setComplaint(answer.complaint),
        (error) => error.name !== "AbortError" && setComplaint(error.message),
      );
    }, TYPED_MS);
    return () => clearTimeout(timer);
  }, [typed, told?.tag]);
  return complaint;
}

function Sections({ names, current, changes }) {
  const changed = (name) => Object.keys(changes).filter((key) => key.split(".")[0] === name).length;
  const mark = (name) => (changed(name) ? ` (${changed(name)})` : "");
  return html`
    <nav class="settings-sections" aria-label=${say("Sections")}>
      <ul>
        ${names.map((name) => html`<li key=${name}>
          <a href=${`/doctor/settings/${name}`} aria-current=${name === current ? "page" : null}>${name}${mark(name)}</a></li>`)}
      </ul>
      <label class="field settings-choice">${say("Section")}
        <select value=${current} onChange=${(event) => goTo(`/doctor/settings/${event.target.value}`, { keepFocus: true })}>
          ${names.map((name) => html`<option key=${name} value=${name}>${name}${mark(name)}</option>`)}
        </select>
      </label>
    </nav>
  `;
}

function SectionForm({ told, current, changes, complaint, onChange }) {
  const keys = told.keys.filter((key) => key.section.split(".")[0] === current);
  const tables = [...new Set(keys.map((key) => key.section))];
  return tables.map((table) => {
    const fields = keys.filter((key) => key.section === table).map((key) => {
      const name = nameOf(key);
      return html`<${SettingField} key=${name} about=${key} table=${told.table} change=${changes[name]} onChange=${onChange}
        complaint=${complaint.startsWith(`${name}:`) || complaint.startsWith(`${name}[`) ? complaint : ""} locked=${told.locked} />`;
    });
    const isExpert = table.includes(".expert");
    const text = html`<p class="quiet">${quotedWhole(told.sections[table])}</p>`;
    return isExpert
      ? html`<details key=${table} class="card settings-table"><summary><h2>${table}</h2></summary>${text}${fields}</details>`
      : html`<section key=${table} class="card settings-table"><h2>${table}</h2>${text}${fields}</section>`;
  });
}
