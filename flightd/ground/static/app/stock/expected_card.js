// The expected stock: upload, which column is what, and every difference to the count.
import { mayOperate } from "../access/session.js";
import { html, useEffect, useRef } from "../html.js";
import { english, quoted, quotedText, say, sayWith } from "../language.js";
import { dayAndTime } from "../words.js";
import { choose, compareAgain, download, forget, upload } from "./expected_stock.js";
import { loadKept } from "./kept_stock.js";
import { stock } from "./stock_state.js";

const OUTCOMES = {
  __proto__: null,
  match: english("as expected"),
  missing: english("missing"),
  wrong: english("another code there"),
  moved: english("elsewhere"),
  unexpected: english("unexpected"),
  empty_but_expected: english("empty"),
  uncounted: english("not countable"),
};
export const outcomeWords = (outcome) => say(OUTCOMES[outcome] ?? outcome);

export function ExpectedCard({ onChoose }) {
  const { expected, source, tag } = stock();
  useEffect(() => {
    const isRefused = expected?.trouble && !expected.chosen;
    if (expected && !expected.busy && !isRefused && expected.tag !== tag) compareAgain();
  }, [tag, expected?.tag, expected?.busy]);
  useEffect(() => {
    loadKept();
  }, [source]);
  if (source?.kind !== "store") return null;
  const mayRemove = expected && (!expected.kept || mayOperate());
  return html`
    <section class="card expected" aria-labelledby="expected">
      <div class="expected-head">
        <h3 id="expected">${say("Expected stock")}</h3>
        <${Choose} words=${expected ? say("Another file") : say("Upload CSV or XLSX")} />
        ${mayRemove && html`<button class="order" onClick=${forget}>${say("Remove")}</button>`}
      </div>
      ${!expected &&
      html`<p class="quiet">${mayOperate() ? say("What your books say lies where. It is compared with the count, and kept at this station for everybody until it is removed.") : say("What your books say lies where. It is compared with the count, and kept in this tab only.")}</p>`}
      ${expected?.kept?.at_s && html`<p class="quiet">${keptWords(expected.kept)}</p>`}
      ${expected?.busy && html`<p class="quiet" role="status">${say("Comparing {file} …", { file: expected.name })}</p>`}
      ${expected?.trouble && html`<p class="refusal" role="alert">${expected.name}: ${quoted(expected.trouble)}</p>`}
      ${expected?.columns && html`<${Columns} /><${Outcomes} /><${Differences} onChoose=${onChoose} />`}
    </section>
  `;
}

function keptWords({ at_s: at, who }) {
  const day = dayAndTime(at * 1000);
  return who ? say("Kept for everybody since {day}, by {who}.", { day, who }) : say("Kept for everybody since {day}.", { day });
}

function Choose({ words }) {
  const input = useRef(null);
  const onChange = () => {
    const [file] = input.current.files;
    input.current.value = ""; // the same file again is a change too
    if (file) upload(file);
  };
  return html`
    <button class="order" onClick=${() => input.current.click()}>${words}</button>
    <input ref=${input} hidden type="file" accept=".csv,.tsv,.txt,.xlsx" onChange=${onChange} />
  `;
}

function Columns() {
  const { expected } = stock();
  const { columns, chosen, sample, kind, rows, name } = expected;
  const fixed = Boolean(expected.kept) && !mayOperate();
  const pick = (role, words, optional) => html`
    <label class="field">${words}
      <select value=${chosen[role] ?? ""} disabled=${fixed} onChange=${(event) => choose({ [role]: event.target.value === "" ? null : Number(event.target.value) })}>
        ${optional && html`<option value="">${say("none")}</option>`}
        ${columns.map((column, i) => html`<option key=${i} value=${i}>${column}</option>`)}
      </select>
    </label>
  `;
  const roles = { [chosen.place]: say("place"), [chosen.code]: say("code"), [chosen.quantity ?? -1]: say("quantity") };
  return html`
    <p class="quiet">${say("{name}: {kind}, {n} row|{name}: {kind}, {n} rows", { name, kind: quotedText(kind), n: rows })}</p>
    <div class="find-row">
      ${pick("place", say("Places are in"))}${pick("code", say("Codes are in"))}${pick("quantity", say("Quantities are in"), true)}
      <label class="check"><input type="checkbox" checked=${chosen.heading} disabled=${fixed} onChange=${(event) => choose({ heading: event.target.checked })} /> ${say("The first row names the columns")}</label>
    </div>
    <details>
      <summary>${say("The first rows")}</summary>
      <div class="table-scroll" tabindex="0" role="group" aria-label=${say("The first rows")}>
        <table>
          <thead><tr>${columns.map((column, i) => html`<th key=${i} scope="col">${column}${roles[i] && html` <small>${roles[i]}</small>`}</th>`)}</tr></thead>
          <tbody>${sample.map((row, i) => html`<tr key=${i}>${row.map((cell, j) => html`<td key=${j}>${cell}</td>`)}</tr>`)}</tbody>
        </table>
      </div>
    </details>
    <${Problems} />
  `;
}

function Problems() {
  const { expected } = stock();
  return html`
    <${LeftOut}
      title=${english("One row is left out:|{n} rows are left out:")}
      lines=${expected.problems}
      total=${expected.problem_count}
    />
    <${LeftOut}
      title=${english("One place of the file is not in this inventory:|{n} places of the file are not in this inventory:")}
      lines=${expected.unknown_places}
      total=${expected.unknown_place_count}
    />
  `;
}

function LeftOut({ title, lines, total }) {
  if (!total) return null;
  return html`
    <div class="obstacles left-out">
      <p>${say(title, { n: total })}</p>
      <ul>${lines.map((line) => html`<li key=${line}>${quoted(line)}</li>`)}</ul>
      ${total > lines.length && html`<p>${say("and {n} more", { n: total - lines.length })}</p>`}
    </div>
  `;
}

function Outcomes() {
  const { outcome_counts: counts } = stock().expected;
  return html`
    <div class="find-row">
      <ul class="outcome-counts" aria-label=${say("Outcomes")}>
        ${Object.entries(counts)
          .filter(([, count]) => count)
          .map(([outcome, count]) => html`<li key=${outcome} class=${`outcome-${outcome}`}><b>${count}</b> ${outcomeWords(outcome)}</li>`)}
      </ul>
      <div class="downloads" role="group" aria-label=${say("Download the comparison")}>
        <button class="order" onClick=${() => download("csv")}>${say("Comparison CSV")}</button>
        <button class="order" onClick=${() => download("json")}>${say("Comparison JSON")}</button>
      </div>
    </div>
  `;
}

function Differences({ onChoose }) {
  const { expected, places } = stock();
  const { lines, difference_count: count } = expected;
  if (!count) return html`<p class="ready"><span class="dot" />${say("No difference.")}</p>`;
  return html`
    <div class="table-scroll" tabindex="0" role="group" aria-label=${say("Differences")}>
      <table>
        <thead><tr><th scope="col">${say("Place")}</th><th scope="col">${say("Outcome")}</th><th scope="col">${say("Expected")}</th><th scope="col">${say("Found")}</th></tr></thead>
        <tbody>
          ${lines.map((line, i) => html`
            <tr key=${i}>
              <td>${places[line.location] ? html`<button class="link" onClick=${() => onChoose(line.location)}>${line.location}</button>` : line.location}</td>
              <td>${outcomeWords(line.outcome)}</td>
              <td>${line.outcome === "unexpected" ? "" : line.text}${line.quantity && html` <small>${say("quantity {quantity}", { quantity: line.quantity })}</small>`}</td>
              <td>${line.outcome === "unexpected" ? line.text : line.found}
                ${line.found_at && sayWith("at {place}", { place: html`<button class="link" onClick=${() => onChoose(line.found_at)}>${line.found_at}</button>` })}</td>
            </tr>
          `)}
        </tbody>
      </table>
    </div>
    ${count > lines.length && html`<p class="quiet">${say("{n} more: download the comparison.", { n: count - lines.length })}</p>`}
  `;
}
