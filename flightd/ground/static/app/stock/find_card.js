// Which inventory is shown, what is looked for in it, and how many places are in which state.
import { html, useEffect, useRef } from "../html.js";
import { english, say } from "../language.js";
import { goTo } from "../router.js";
import { SelectionRow } from "./selection_row.js";
import { STATES } from "./states.js";
import { change, differs, inOrder, isShown, sourceQuery, stock } from "./stock_state.js";
import { exportUrl, search, show } from "./stock_source.js";

const TYPING_MS = 250;
const FORMATS = { csv: "CSV", xlsx: "XLSX", json: "JSON", epcis: "EPCIS" };

export function FindCard({ onChoose }) {
  return html`
    <section class="card find" aria-label=${say("Find and filter")}>
      <div class="find-row">
        <${Source} />
        <${Search} onChoose=${onChoose} />
        <${Downloads} />
      </div>
      <${StateFilters} />
      <${SelectionRow} />
    </section>
  `;
}

const valueOf = ({ kind, name }) => `${kind}/${name}`;

function Source() {
  const { source, stores, drones, folder } = stock();
  const all = [
    ...stores.map(({ name }) => ({ kind: "store", name, words: name === "." ? folder : name })),
    ...drones.map((name) => ({ kind: "drone", name, words: say("{drone}, as it tells now", { drone: name }) })),
  ];
  const choose = (event) => {
    const { kind, name } = all.find((one) => valueOf(one) === event.target.value);
    change({ picked: true });
    show({ kind, name });
    goTo(`/stock?${sourceQuery({ kind, name })}`, { replace: true });
  };
  return html`
    <label class="field">${say("Inventory")}
      <select value=${source ? valueOf(source) : ""} onChange=${choose}>
        ${all.map((one) => html`<option key=${valueOf(one)} value=${valueOf(one)}>${one.words}</option>`)}
      </select>
    </label>
  `;
}

function Search({ onChoose }) {
  const timer = useRef(0);
  const box = useRef(null);
  const { found, source } = stock();
  useEffect(() => () => clearTimeout(timer.current), []);
  useEffect(() => {
    if (box.current) box.current.value = stock().words;
  }, [source]);
  const onInput = (event) => {
    clearTimeout(timer.current);
    const words = event.target.value;
    timer.current = setTimeout(() => search(words), TYPING_MS);
  };
  const onKeyDown = async (event) => {
    if (event.key !== "Enter") return;
    clearTimeout(timer.current);
    await search(event.target.value);
    const first = inOrder(stock().fronts).find((code) => stock().found?.has(code));
    if (first) onChoose(first);
  };
  return html`
    <label class="field finder">${say("Code or place")}
      <input type="search" ref=${box} maxlength="200" spellcheck=${false} autocomplete="off" onInput=${onInput} onKeyDown=${onKeyDown} />
      <span class="quiet" role="status">${found && say("{n} place|{n} places", { n: found.size })}</span>
    </label>
  `;
}

function Downloads() {
  const { source } = stock();
  if (source?.kind !== "store") return null;
  return html`
    <div class="downloads" role="group" aria-label=${say("Download the inventory")}>
      ${Object.entries(FORMATS).map(
        ([format, name]) => html`<a key=${format} class="order" href=${exportUrl(source, format)} download>${name}</a>`,
      )}
    </div>
  `;
}

function StateFilters() {
  const { places, states, expected } = stock();
  const counts = {};
  for (const { state } of Object.values(places)) counts[state] = (counts[state] ?? 0) + 1;
  const toggle = (name) => {
    const next = new Set(states);
    if (!next.delete(name)) next.add(name);
    change({ states: next });
  };
  const chips = Object.entries(STATES)
    .filter(([name]) => counts[name] || states.has(name))
    .map(([name, { name: words, means }]) => ({ name, words, means, count: counts[name] ?? 0 }));
  if (expected?.outcomes) {
    const count = Object.keys(places).filter((code) => differs(code, expected)).length;
    chips.push({ name: "differs", words: english("Not as expected"), means: english("differs from the uploaded stock"), count });
  }
  const picked = states.size ? Object.keys(places).filter((code) => isShown(code, stock())).length : null;
  return html`
    <div class="states" role="group" aria-label=${say("States")}>
      ${chips.map(
        ({ name, words, means, count }) => html`
          <button key=${name} class="state-chip" aria-pressed=${states.has(name)} title=${say(means)} onClick=${() => toggle(name)}>
            <i class=${name === "differs" ? "cell differs" : `cell state-${name}`} aria-hidden="true">${STATES[name]?.mark}</i>${say(words)}
            <b>${count}</b>
          </button>
        `,
      )}
      ${picked !== null &&
      html`<button class="state-chip" onClick=${() => change({ states: new Set() })}>${say("Show all")}</button>`}
    </div>
  `;
}
