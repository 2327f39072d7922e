// The drawing: the floor as the station laid it out last, and over it what can be taken and moved.
import { html, useMemo, useRef } from "../html.js";
import { say } from "../language.js";
import { Floor } from "../live/site_plan.js";
import { nodesOf, placesOf, rowsOf } from "./draft.js";
import { Fronts } from "./fronts.js";
import { begin, cancel, isDragging, move, nudge, release } from "./hand.js";
import { zoomed } from "./zoom.js";
import { site } from "./site_state.js";

const M = 100;
const MARGIN_M = 1.2;

export function Plan() {
  const { draft, sound, checkedDraft, checked, chosen, tool, zoom } = site();
  const box = useRef(null);
  const drawn = useMemo(() => sound && { ...sound.floor, keep_outs: [], pads: [] }, [sound]);
  const floor = useMemo(() => drawn && html`<${Floor} floor=${drawn} />`, [drawn]);
  const nodes = useMemo(() => nodesOf(draft), [draft]);
  if (!box.current || !isDragging()) box.current = boxOf(draft, nodes, drawn); // it stays while something is dragged
  const isOld = !checked?.sound || checkedDraft !== draft;
  const view = zoomed(box.current);
  const scale = Math.min(2.4, Math.max(0.7, view[2] / 12));
  return html`
    <svg
      class=${`site-plan ${tool ? "drawing" : ""} ${zoom > 1 ? "zoomed" : ""}`} viewBox=${view.map((value) => value * M).join(" ")} style=${{ "--scale": scale }}
      tabindex="0" role="group" aria-label=${say("Drawing. Arrow keys move what is chosen, Shift and an arrow ten times as far; everything is in the list of elements, too.")}
      onKeyDown=${nudge} onPointerDown=${begin} onPointerMove=${move} onPointerUp=${release} onPointerCancel=${cancel}
    >
      <${Grid} view=${view} />
      <g class=${isOld ? "laid-out old" : "laid-out"}>
        ${floor}
        ${sound && html`<${Fronts} sound=${sound} />`}
      </g>
      <g aria-hidden="true">
        ${rowsOf(draft, "keep_out").map(({ values }, i) => html`<${KeepOut} key=${`k${i}`} values=${values} ...${taken("keep_out", i, chosen)} />`)}
        ${rowsOf(draft, "aisle").map(({ values }, i) => html`<${Aisle} key=${`a${i}`} values=${values} ...${taken("aisle", i, chosen)} />`)}
        <${Pairs} table="cross" nodes=${nodes} /><${Pairs} table="blocked" nodes=${nodes} />
        ${rowsOf(draft, "pad").map(({ values }, i) => html`<${Pad} key=${`p${i}`} values=${values} nodes=${nodes} ...${taken("pad", i, chosen)} />`)}
        ${nodes.map((node) => html`<${Node} key=${node.id} node=${node} chosen=${chosen} />`)}
        ${rowsOf(draft, "marker").map(({ values }, i) => html`<${Marker} key=${`m${i}`} values=${values} ...${taken("marker", i, chosen)} />`)}
        <${Sketch} />
      </g>
    </svg>
  `;
}

const taken = (table, index, chosen) => ({ table, index, isChosen: chosen.table === table && chosen.index === index });
const mark = (name, isChosen) => `take ${name} ${isChosen ? "chosen" : ""}`;
const metres = (value) => (typeof value === "number" ? value * M : 0);

function boxOf(draft, nodes, floor) {
  const areas = rowsOf(draft, "keep_out").map(({ values }) => values);
  const markers = rowsOf(draft, "marker").map(({ values }) => values);
  const lines = floor?.lines ?? [];
  const racks = floor?.racks ?? [];
  const xs = [nodes.map((n) => n.x_m), areas.flatMap((a) => [a.x0_m, a.x1_m]), markers.map((m) => m.x_m), lines.flatMap((l) => [l.x0_m, l.x1_m]), racks.flatMap((r) => [r.x0_m, r.x1_m])];
  const ys = [nodes.map((n) => n.y_m), areas.flatMap((a) => [a.y0_m, a.y1_m]), markers.map((m) => m.y_m), lines.flatMap((l) => [l.y0_m, l.y1_m]), racks.map((r) => r.y_m)];
  const [x0, x1] = span(xs);
  const [y0, y1] = span(ys);
  return [x0 - MARGIN_M, y0 - MARGIN_M, x1 - x0 + 2 * MARGIN_M, y1 - y0 + 2 * MARGIN_M];
}

function span(lists) {
  const values = lists.flat().filter(Number.isFinite);
  return values.length ? values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [values[0], values[0]]) : [0, 1];
}

function Grid({ view }) {
  const [x, y, width, height] = view;
  const many = Math.max(width, height) > 60;
  const step = many ? 10 : 1;
  const from = (value) => Math.ceil(value / step) * step;
  const lines = [];
  for (let at = from(x); at < x + width; at += step) lines.push([at, y, at, y + height]);
  for (let at = from(y); at < y + height; at += step) lines.push([x, at, x + width, at]);
  return html`<g class="site-grid" aria-hidden="true">${lines.map(([a, b, c, d]) => html`<line x1=${a * M} y1=${b * M} x2=${c * M} y2=${d * M} />`)}</g>`;
}

function Aisle({ values, table, index, isChosen }) {
  const places = placesOf(values);
  const over = metres(values.overrun_m ?? 0.4);
  const [x0, x1, y] = [places[0] * M - over, places.at(-1) * M + over, metres(values.y_m)];
  return html`
    <g class=${mark("aisle", isChosen)} data-table=${table} data-index=${index}>
      <line class="touch" x1=${x0} x2=${x1} y1=${y} y2=${y} /><line class="line" x1=${x0} x2=${x1} y1=${y} y2=${y} />
    </g>
  `;
}

function Node({ node, chosen }) {
  const isChosen = chosen.table === "aisle" && chosen.index === node.aisle && chosen.node === node.number;
  const [x, y] = [node.x_m * M, node.y_m * M];
  return html`
    <g class=${mark("node", isChosen)} data-table="aisle" data-index=${node.aisle} data-node=${node.number} data-id=${node.id}>
      <circle class="touch" cx=${x} cy=${y} r="26" /><circle class="mark" cx=${x} cy=${y} r="9" /><text x=${x + 14} y=${y - 14}>${node.id}</text>
    </g>
  `;
}

function Pairs({ table, nodes }) {
  const { draft, chosen } = site();
  return rowsOf(draft, table).map(({ values }, index) => {
    const ends = (values.nodes ?? []).map((id) => nodes.find((node) => node.id === id));
    if (!ends[0] || !ends[1]) return null;
    const at = { x1: ends[0].x_m * M, y1: ends[0].y_m * M, x2: ends[1].x_m * M, y2: ends[1].y_m * M };
    const isChosen = chosen.table === table && chosen.index === index;
    return html`<g key=${`${table}${index}`} class=${mark(table, isChosen)} data-table=${table} data-index=${index}><line class="touch" ...${at} /><line class="line" ...${at} /></g>`;
  });
}

function KeepOut({ values, table, index, isChosen }) {
  const [x0, y0, x1, y1] = ["x0_m", "y0_m", "x1_m", "y1_m"].map((key) => metres(values[key]));
  const corners = [[x0, y0, "x0_m y0_m"], [x1, y0, "x1_m y0_m"], [x0, y1, "x0_m y1_m"], [x1, y1, "x1_m y1_m"]];
  return html`
    <g class=${mark("keep-out", isChosen)} data-table=${table} data-index=${index}>
      <rect class="keep" x=${Math.min(x0, x1)} y=${Math.min(y0, y1)} width=${Math.abs(x1 - x0)} height=${Math.abs(y1 - y0)} />
      ${isChosen && corners.map(([x, y, keys]) => html`<rect class="corner" x=${x - 10} y=${y - 10} width="20" height="20" data-corner=${keys} />`)}
    </g>
  `;
}

function Pad({ values, nodes, table, index, isChosen }) {
  const node = nodes.find(({ id }) => id === values.node);
  if (!node) return null;
  const side = metres(values.size_m ?? 0.5);
  const [dx, dy] = Array.isArray(values.offset_m) ? values.offset_m : [0, 0];
  const [x, y] = [metres(node.x_m + (dx || 0)), metres(node.y_m + (dy || 0))];
  return html`<g class=${mark("pad-mark", isChosen)} data-table=${table} data-index=${index}><rect class="pad" x=${x - side / 2} y=${y - side / 2} width=${side} height=${side} rx="6" /></g>`;
}

function Marker({ values, table, index, isChosen }) {
  const side = Math.max(metres(values.size_m ?? 0.2), 12);
  const turn = `rotate(${Number(values.yaw_deg) || 0} ${metres(values.x_m)} ${metres(values.y_m)})`;
  return html`
    <g class=${mark("marker", isChosen)} data-table=${table} data-index=${index} transform=${turn}>
      <rect class="black" x=${metres(values.x_m) - side / 2} y=${metres(values.y_m) - side / 2} width=${side} height=${side} />
    </g>
  `;
}

// What is being drawn with the mouse.
function Sketch() {
  const { sketch } = site();
  if (!sketch) return null;
  const [[ax, ay], [bx, by]] = sketch.map((point) => point.map((value) => value * M));
  return html`<rect class="sketch" x=${Math.min(ax, bx)} y=${Math.min(ay, by)} width=${Math.max(Math.abs(bx - ax), 2)} height=${Math.max(Math.abs(by - ay), 2)} />`;
}
