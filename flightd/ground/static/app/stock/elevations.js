// The fronts of the racks as who stands before them sees them, cell by cell, each with its state.
import { mayOperate } from "../access/session.js";
import { html, useMemo } from "../html.js";
import { language, say } from "../language.js";
import { isSelected, toggleSelected } from "./selection.js";
import { COUNTED, placeWords, rackWords, STATES } from "./states.js";
import { differs, isShown, stock } from "./stock_state.js";
import { neighbour, rowsOf } from "./walk.js";

const WIDE_COLUMNS = 24; // more of them take the page's whole width

export function Elevations({ onChoose }) {
  const { fronts } = stock();
  const racks = useMemo(() => fronts.map((front) => ({ front, rows: rowsOf(front) })), [fronts]);
  return html`
    <div class="fronts">
      ${racks.map(({ front, rows }, i) => html`<${Front} key=${i} front=${front} rows=${rows} onChoose=${onChoose} />`)}
    </div>
  `;
}

function Front({ front, rows, onChoose }) {
  const { places, chosen, fresh, states, found, expected, selected } = stock();
  const here = front.spots.some(([code]) => code === chosen) ? chosen : "";
  return useMemo(
    () => drawn(front, rows, { places, here, fresh, states, found, expected }, onChoose),
    [front, rows, places, here, fresh, states, found, expected, selected, language()],
  );
}

function drawn(front, rows, known, onChoose) {
  const title = titleOf(front);
  const counted = front.spots.filter(([code]) => COUNTED.has(known.places[code]?.state)).length;
  const inTabOrder = known.here || rows[0]?.find(Boolean)?.code;
  const onClick = (event) => {
    const code = event.target.closest("[data-code]")?.dataset.code;
    if (code && event.shiftKey && maySelect()) toggleSelected(code);
    else if (code) onChoose(code);
  };
  const onKeyDown = (event) => {
    const code = event.target.dataset?.code;
    if (!code || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === "Enter" && event.shiftKey && maySelect()) {
      event.preventDefault();
      toggleSelected(code);
      return;
    }
    const next = neighbour(stock().fronts, code, event.key);
    if (!next) return;
    event.preventDefault();
    onChoose(next);
    placeCell(next)?.focus({ preventScroll: true });
  };
  const wide = (rows[0]?.length ?? 0) > WIDE_COLUMNS || !front.placed;
  return html`
    <section class=${wide ? "card front wide" : "card front"} aria-label=${title}>
      <h3>${title} <small>${say("{counted} of {all} counted", { counted, all: front.spots.length })}</small></h3>
      <div class="rack-scroll" onClick=${onClick} onKeyDown=${onKeyDown}>
        ${front.placed ? rack(rows, known, inTabOrder) : html`<div class="loose">${rows[0].map((spot) => cell(spot, known, inTabOrder))}</div>`}
      </div>
    </section>
  `;
}

const maySelect = () => stock().source?.kind === "store" && mayOperate();

// The cell of a place as it stands on the page.
export const placeCell = (code) => document.querySelector(`[data-code="${CSS.escape(code)}"]`);

function titleOf({ aisle, side, placed }) {
  if (!placed) return say("Places whose rack is not known");
  if (!aisle) return say("Rack");
  return rackWords(aisle, side);
}

function rack(rows, known, inTabOrder) {
  const bays = [];
  rows[0].forEach((_, column) => {
    const bay = rows.map((row) => row[column]).find(Boolean).bay;
    if (bays.at(-1)?.bay !== bay) bays.push({ bay, from: column });
    bays.at(-1).to = column + 1;
  });
  return html`
    <div class="elevation">
      <div class="level-names" aria-hidden="true">
        ${rows.map((row) => html`<span>${row.find(Boolean).level}</span>`)}
      </div>
      ${bays.map(
        ({ bay, from, to }) => html`
          <div class="rack-bay" style=${{ "--positions": to - from }}>
            <div class="rack-cells">
              ${rows.flatMap((row) => row.slice(from, to).map((spot) => (spot ? cell(spot, known, inTabOrder) : html`<i />`)))}
            </div>
            <b aria-hidden="true">${bay}</b>
          </div>
        `,
      )}
    </div>
  `;
}

function cell({ code }, known, inTabOrder) {
  const place = known.places[code];
  if (!place) return html`<i />`;
  const classes = ["cell", `state-${place.state}`];
  if (place.pending) classes.push("pending");
  if (known.fresh.has(code)) classes.push("fresh");
  if (!isShown(code, known)) classes.push("aside");
  if (differs(code, known.expected)) classes.push("differs");
  const words = [placeWords(code, place)];
  if (differs(code, known.expected)) words.push(say("not as expected"));
  if (isSelected(code)) {
    classes.push("selected");
    words.push(say("selected"));
  }
  const label = words.join(", ");
  return html`
    <button
      key=${code}
      class=${classes.join(" ")}
      data-code=${code}
      aria-label=${label}
      aria-pressed=${code === known.here}
      title=${label}
      tabindex=${code === inTabOrder ? 0 : -1}
    >${STATES[place.state].mark}</button>
  `;
}
