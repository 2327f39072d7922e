// One site: its orders, the drawing in the middle, elements beside it, the check under them.
import { html, useEffect, useState } from "../html.js";
import { dateFormat, english, quoted, say } from "../language.js";
import { CoverageCard } from "./coverage_card.js";
import { ElementCard, remove } from "./element_card.js";
import { ElementList } from "./element_list.js";
import { FindingsCard } from "./findings_card.js";
import { Plan } from "./plan.js";
import { SimulationBar } from "./simulation_bar.js";
import { zoomBy } from "./zoom.js";
import { checkSoon, download, openFile, save, showVersion } from "./site_source.js";
import { change, isChanged, redo, site, undo } from "./site_state.js";

const EXPORTS = [["toml", english("Site file (TOML)")], ["lif", english("VDMA LIF")], ["csv", english("Nodes (CSV)")], ["locations", english("Location codes (CSV)")], ["svg", english("Floor plan (SVG)")]];
const SNAPS = [[0, english("off")], [0.01, "1 cm"], [0.05, "5 cm"], [0.1, "10 cm"], [0.5, "50 cm"]];

export function Editor() {
  const { draft, camera, withCamera, name, trouble, said, notes, losesComments } = site();
  useEffect(checkSoon, [draft, camera, withCamera]);
  useEffect(() => listen(), []);
  return html`
    <div class="site-editor">
      <${Head} />
      <${SimulationBar} />
      ${trouble && html`<p class="site-trouble" role="alert">${quoted(trouble)}</p>`}
      <p class="quiet site-said" role="status">${quoted(said)}</p>
      ${losesComments && html`<p class="site-trouble">${say("{file} is not written as [site] and [[…]] tables: saving writes it anew, and its comments move to the top.", { file: name })}</p>`}
      ${notes.length > 0 && html`<${Notes} notes=${notes} />`}
      <section class="card site-drawing" aria-labelledby="drawing"><h3 id="drawing" class="unseen">${say("Drawing")}</h3><${Plan} /><${Foot} /></section>
      <${ElementList} />
      <div class="site-beside"><${FindingsCard} /><${ElementCard} /><${CoverageCard} /></div>
    </div>
  `;
}

function Notes({ notes }) {
  return html`<div class="obstacles site-notes"><p>${say("Before you go on:")}</p><ul>${notes.map((note) => html`<li key=${note}>${quoted(note)}</li>`)}</ul>
    <button class="order" onClick=${() => change({ notes: [] })}>${say("Understood")}</button></div>`;
}

function Head() {
  const { draft, name, stamp, past, future, busy } = site();
  const [asksAnew, setAsksAnew] = useState(false); // whether what is not saved may go
  const [newName, setNewName] = useState(null); // of a file to save as; null: not asked for
  const suggested = `${String(draft.site.name ?? "site").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "") || "site"}.toml`;
  const asked = newName ?? (stamp ? null : suggested);
  const onSave = async (event) => {
    event?.preventDefault();
    if (site().busy) return; // the button keeps the focus meanwhile
    const as = asked === null ? "" : asked.endsWith(".toml") ? asked : `${asked}.toml`;
    await save(as);
    if (!site().trouble) {
      setNewName(null);
      history.replaceState(null, "", `/site/edit?name=${encodeURIComponent(site().name)}`);
    }
  };
  const openAnew = () => {
    setAsksAnew(false);
    openFile(name);
  };
  return html`
    <form class="site-head" onSubmit=${onSave}>
      <h2>${draft.site.name ?? say("Site")} <small>${name || say("new, no file yet")}${stamp && isChanged() ? `, ${say("changed")}` : ""}</small></h2>
      <div class="site-orders">
        <button type="button" class="order" disabled=${!past.length} title=${say("Ctrl Z")} onClick=${undo}>${say("Undo")}</button>
        <button type="button" class="order" disabled=${!future.length} title=${say("Ctrl Shift Z")} onClick=${redo}>${say("Redo")}</button>
        ${asked !== null && html`<label class="field">${say("File")} <input value=${asked} maxlength="85" onInput=${(event) => setNewName(event.target.value)} /></label>`}
        <button class="order main-order" disabled=${!busy && asked === null && !isChanged()} aria-disabled=${busy} title=${say("Ctrl S")}>${busy ? say("Wait …") : say("Save")}</button>
        ${stamp && html`<button type="button" class="order" aria-expanded=${asked !== null} onClick=${() => setNewName(asked === null ? suggested : null)}>${asked === null ? say("Save as") : say("Not as another")}</button>`}
        <${Menu} words=${say("Export")} options=${EXPORTS} onChoice=${download} />
        ${site().versions.length > 0 && html`<${Menu} words=${say("Old versions")} options=${site().versions.map((at) => [at, whenOf(at)])} onChoice=${showVersion} />`}
        ${stamp && (asksAnew && isChanged()
          ? html`<button type="button" class="order sure-anew" onClick=${openAnew}>${say("Lose what is not saved")}</button>
              <button type="button" class="order" onClick=${() => setAsksAnew(false)}>${say("Keep it")}</button>`
          : html`<button type="button" class="order" onClick=${() => (isChanged() ? setAsksAnew(true) : openAnew())}>${say("Open anew")}</button>`)}
        <a class="order" href="/site">${say("All sites")}</a>
      </div>
    </form>
  `;
}

const WHEN = dateFormat({ month: "short", day: "numeric", hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });
const whenOf = (at) => say("replaced {when}", { when: WHEN.format(new Date(at.replace(/T(\d\d)-(\d\d)-/, "T$1:$2:"))) });

// A list that does something with what is chosen, and then shows its heading again.
function Menu({ words, options, onChoice }) {
  const choose = (event) => {
    const { value } = event.target;
    event.target.value = "";
    if (value) onChoice(value);
  };
  return html`<select class="order menu" aria-label=${words} value="" onChange=${choose}><option value="">${words} …</option>${options.map(([value, text]) => html`<option key=${value} value=${value}>${say(text)}</option>`)}</select>`;
}

function Foot() {
  const { snap_m: snap, tool, sound, checked, zoom } = site();
  return html`
    <div class="site-foot">
      <label class="field snap">${say("Snap to")} <select value=${snap} onChange=${(event) => change({ snap_m: Number(event.target.value) })}>${SNAPS.map(([value, words]) => html`<option key=${value} value=${value}>${say(words)}</option>`)}</select></label>
      <div class="zoom" role="group" aria-label=${say("Zoom")}>
        <button class="order" aria-label=${say("Larger")} onClick=${() => zoomBy(1.5)}>+</button>
        <button class="order" aria-label=${say("Smaller")} disabled=${zoom <= 1} onClick=${() => zoomBy(1 / 1.5)}>−</button>
        <button class="order" disabled=${zoom <= 1} onClick=${() => zoomBy(0)}>${say("Whole")}</button>
      </div>
      ${tool && html`<button class="order" onClick=${() => change({ tool: "", picked: "", sketch: null, said: "" })}>${say("Stop drawing")}</button>`}
      ${isLost(sound) && html`<p class="quiet lost-words"><i /> ${say("is not read")}</p>`}
      ${sound && checked?.sound === false && html`<p class="quiet">${say("In pale colours: the map as it was sound last.")}</p>`}
      <p class="quiet">${say("Drag aisles, nodes, pads, markers and keep-outs. x runs along the aisles, y to its right; the grid is {step}.", { step: sound && Math.max(sound.facts.length_m, sound.facts.width_m) > 57 ? "10 m" : "1 m" })}</p>
    </div>
  `;
}

const isLost = (sound) => sound?.coverage?.lost.length > 0 || sound?.findings.some(({ from_m: from }) => from !== undefined);

function listen() {
  const onKey = (event) => {
    const isTyping = event.target.closest?.("input:not([type=checkbox]), textarea");
    const key = event.key.toLowerCase();
    const isOrder = event.ctrlKey || event.metaKey;
    if (isOrder && key === "s") {
      event.preventDefault();
      document.activeElement?.blur(); // what is typed still is taken
      document.querySelector(".site-head")?.requestSubmit();
    } else if (isOrder && !isTyping && (key === "y" || (key === "z" && event.shiftKey))) {
      event.preventDefault();
      redo();
    } else if (isOrder && !isTyping && key === "z") {
      event.preventDefault();
      undo();
    } else if (key === "delete" && !isTyping && !isOrder) remove();
  };
  window.addEventListener("keydown", onKey);
  return () => window.removeEventListener("keydown", onKey);
}
