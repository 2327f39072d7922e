// On the shelf fronts: bays, those of the rack that is chosen, stretches and places that are not read.
import { html } from "../html.js";
import { say } from "../language.js";
import { valuesOf } from "./draft.js";
import { site } from "./site_state.js";

const M = 100;

export function Fronts({ sound }) {
  const { racks } = sound.floor;
  const gaps = sound.findings.filter(({ from_m: from }) => from !== undefined);
  const frontOf = ({ aisle, side }) => racks.find((rack) => rack.aisle === aisle && rack.side === side);
  return html`
    <g class="bays" aria-hidden="true">
      ${racks.filter(isOfChosen()).map(({ x0_m: from, x1_m: to, y_m: y }) => html`<line class="front-chosen" x1=${from * M} x2=${to * M} y1=${y * M} y2=${y * M} />`)}
      ${sound.bays.map(([from, to, y]) => html`<path d=${`M${from * M} ${y * M - 9}v18M${to * M} ${y * M - 9}v18`} />`)}
      ${gaps.map((gap) => html`<line class="gap" x1=${gap.from_m * M} x2=${gap.to_m * M} y1=${frontOf(gap).y_m * M} y2=${frontOf(gap).y_m * M} />`)}
      ${(sound.coverage?.lost ?? []).map(([code, x, y]) => html`<circle class="lost" cx=${x * M} cy=${y * M} r="7"><title>${say("{code}: not read", { code })}</title></circle>`)}
    </g>
  `;
}

// Whether a front belongs to the rack that is chosen.
function isOfChosen() {
  const { chosen, draft } = site();
  const values = chosen.table === "rack" ? valuesOf(draft, chosen) : null;
  return ({ aisle, side }) => values && (values.aisles ?? [aisle]).includes(aisle) && (values.sides ?? [side]).includes(side);
}
