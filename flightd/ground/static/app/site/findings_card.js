// What the check says, beside the drawing: each finding leads to its element.
import { html } from "../html.js";
import { english, plain, quoted, say } from "../language.js";
import { fieldId } from "./field.js";
import { FIELDS } from "./fields.js";
import { nodesOf, rowsOf } from "./draft.js";
import { focusOn } from "./hand.js";
import { choose, site } from "./site_state.js";

const KINDS = { error: english("Mistake"), problem: english("Not read"), note: english("Note") };

export function FindingsCard() {
  const { checked, checkedDraft, draft } = site();
  const isOld = checkedDraft !== draft;
  const words = !checked || isOld ? say("Checking …") : checked.sound ? say("Sound: a drone can fly by it.") : say("Not sound yet: no drone can fly by it.");
  return html`
    <section class="card findings" aria-labelledby="findings">
      <h3 id="findings">${say("Check")}</h3>
      <p class=${!checked || isOld ? "quiet" : checked.sound ? "ready" : "refusal"} role="status">${words}</p>
      ${checked?.findings.length > 0 && html`
        <ul class="finding-list" aria-label=${say("Findings")}>
          ${checked.findings.map((finding, i) => html`<li key=${i}><${Finding} finding=${finding} /></li>`)}
        </ul>
      `}
      ${checked?.sound && html`<details><summary>${say("In figures")}</summary><${Facts} facts=${checked.facts} /></details>`}
    </section>
  `;
}

function Facts({ facts }) {
  const size = `${plain(facts.length_m)} × ${plain(facts.width_m)} m`;
  const told = [
    [say("floor"), size], [say("nodes"), facts.nodes], [say("places"), facts.locations], [say("paint"), `${plain(facts.paint_m)} m`],
    [say("whole route"), `${plain(facts.route_m)} m`], [say("closed lines"), facts.closed],
  ];
  return html`<dl class="site-facts">${told.map(([name, value]) => html`<div key=${name}><dt>${name}</dt><dd>${value}</dd></div>`)}</dl>`;
}

function Finding({ finding }) {
  const place = placeOf(finding);
  const body = html`<b class=${`finding-${finding.kind}`}>${say(KINDS[finding.kind])}</b> ${quoted(finding.text)}`;
  return place ? html`<button class="finding" onClick=${() => lead(place, finding)}>${body}</button>` : html`<p class="finding">${body}</p>`;
}

// The element that a finding is about: {table, index, node}; null where it is about none.
function placeOf({ table, index, nodes, aisle }) {
  const { draft } = site();
  if (nodes?.length) {
    const node = nodesOf(draft).find(({ id }) => id === nodes[0]);
    return node && { table: "aisle", index: node.aisle, node: node.number };
  }
  if (aisle) return { table: "aisle", index: rowsOf(draft, "aisle").findIndex(({ values }) => values.id === aisle), node: null };
  if (table === "site") return { table, index: 0, node: null };
  return table && Number.isInteger(index) && rowsOf(draft, table)[index] ? { table, index, node: null } : null;
}

function lead({ table, index, node }, { field }) {
  choose(table, index, node);
  const known = FIELDS[table].find(({ key }) => key === field);
  focusOn(known ? fieldId(field, known.at ?? null) : "element");
}
