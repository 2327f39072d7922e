// The missions that are kept under names.
import { mayOperate } from "../access/session.js";
import { html, useState } from "../html.js";
import { dateFormat, english, quoted, say, sayWith } from "../language.js";
import { shown } from "../store.js";
import { duplicate, remove, saveChosen } from "./missions_source.js";
import { change, choose, isKept, missions, open, startAnew } from "./missions_state.js";

const DAY = dateFormat({ day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" });

const REST = { 1: english("The rest of {name}: 1 node of {all}."), many: english("The rest of {name}: {left} nodes of {all}.") };

export function KeptCard() {
  const { list, kept, trouble, id } = missions();
  return html`
    <section class="card kept" aria-labelledby="kept">
      <div class="kept-head">
        <h3 id="kept">${say("Kept missions")}</h3>
        ${id && html`<button class="order" onClick=${startAnew}>${say("New mission")}</button>`}
      </div>
      ${kept ? mayOperate() && html`<${Save} />` : html`<p class="quiet">${sayWith("This station keeps none: start it with {option}.", { option: html`<code>--folder</code>` })}</p>`}
      ${trouble && html`<p class="refusal" role="alert">${quoted(trouble)}</p>`}
      ${list === null && html`<p class="quiet" role="status">${say("Loading …")}</p>`}
      ${kept && list?.length === 0 && html`<p class="quiet">${mayOperate() ? say("None yet: choose nodes, give them a name and keep them.") : say("None yet.")}</p>`}
      ${list?.length > 0 && html`<ul>${list.map((mission) => html`<${Row} key=${mission.id} mission=${mission} />`)}</ul>`}
    </section>
  `;
}

function Save() {
  const { id, name, nodes } = missions();
  const done = isKept();
  const onSubmit = (event) => {
    event.preventDefault();
    saveChosen();
  };
  return html`
    <form class="save" onSubmit=${onSubmit}>
      <label class="field">${say("Name")}
        <input
          value=${name} maxlength="80" autocomplete="off" spellcheck=${false}
          onInput=${(event) => change({ name: event.target.value })}
        />
      </label>
      <button class="order" disabled=${!nodes.length || !name.trim() || done}>${done ? say("Kept") : id ? say("Keep changes") : say("Keep")}</button>
    </form>
  `;
}

function Row({ mission }) {
  const [asks, setAsks] = useState(false);
  const { id } = missions();
  const { plan, status } = shown();
  const flies = plan?.id === mission.plan && mission.plan && status && !["done", "aborted", "pilot", "preflight"].includes(status.phase);
  const cut = mission.flown_ns > 0 && mission.remaining.length > 0 && !flies;
  const flyRest = () => {
    open(mission);
    choose({ nodes: mission.remaining, note: english(REST[mission.remaining.length] ?? REST.many, { name: mission.name, left: mission.remaining.length, all: mission.nodes.length }) });
  };
  return html`
    <li class=${mission.id === id ? "row shown" : "row"}>
      <button class="name" aria-pressed=${mission.id === id} onClick=${() => open(mission)}>
        <strong>${mission.name}</strong><span class="quiet">${about(mission, flies && plan)}</span>
      </button>
      ${cut && mayOperate() && html`<button class="order" onClick=${flyRest}>${say("Fly the rest")}</button>`}
      ${mayOperate() &&
      html`<div class="row-acts">
        <button class="tab" onClick=${() => duplicate(mission)} aria-label=${say("Duplicate {name}", { name: mission.name })}>${say("Duplicate")}</button>
        ${asks
          ? html`<button class="tab sure-delete" onClick=${() => remove(mission)} aria-label=${say("Delete {name} for good", { name: mission.name })}>${say("Delete for good")}</button>
              <button class="tab" onClick=${() => setAsks(false)}>${say("Keep it")}</button>`
          : html`<button class="tab" onClick=${() => setAsks(true)} aria-label=${say("Delete {name}", { name: mission.name })}>${say("Delete")}</button>`}
      </div>`}
    </li>
  `;
}

// `flies`: the plan that is flown, if it is of this mission: newer than what is kept of it.
function about({ nodes, levels, flown_ns: flown, remaining }, flies) {
  const parts = [say("{n} node|{n} nodes", { n: nodes.length })];
  if (levels.length) parts.push(say("level {levels}", { levels: levels.join(", ") }));
  if (flies) parts.push(say("in flight, {left} left", { left: flies.remaining.length }));
  else if (flown && remaining.length) parts.push(say("{left} left of {day}", { left: remaining.length, day: DAY.format(new Date(flown / 1e6)) }));
  else if (flown) parts.push(say("flown {day}", { day: DAY.format(new Date(flown / 1e6)) }));
  return parts.join(" · ");
}
