// The mouse, a finger and the arrow keys on the drawing: choosing, moving, drawing anew.
import { english } from "../language.js";
import { nodesOf, rounded, rowsOf, valuesOf, withNew, withNodeAt, withValues } from "./draft.js";
import { freshValues } from "./new_elements.js";
import { change, choose, drag, dropped, edit, site } from "./site_state.js";
import { beginPan } from "./zoom.js";

const M = 100;
const STEP_M = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const MOVED_M = 0.02; // less is a click
const NODES_TOOLS = new Set(["cross", "blocked"]);

let held = null; // {before, pointer, from: [x, y], table, index, node, corner} while a pointer is down
export const isDragging = () => held !== null;

const snapped = (value) => {
  const step = site().snap_m;
  return rounded(step ? Math.round(value / step) * step : Math.round(value * 1000) / 1000);
};

function pointOf(event) {
  const svg = event.currentTarget;
  const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
  return [x / M, y / M];
}

export function begin(event) {
  if (event.button !== 0 || !event.isPrimary) return; // a second finger draws nothing
  const { tool, draft } = site();
  const own = { before: draft, pointer: event.pointerId };
  const mark = event.target.closest("[data-table]");
  const from = pointOf(event);
  event.currentTarget.setPointerCapture(event.pointerId);
  if (tool) {
    held = { ...own, from, tool, id: mark?.dataset.id };
    return;
  }
  if (!mark) {
    held = { ...own, pan: beginPan(event) };
    return;
  }
  const { table, index, node, id } = mark.dataset;
  held = { ...own, from, table, index: Number(index), node: node === undefined ? null : Number(node), id, corner: event.target.dataset.corner };
  choose(table, held.index, held.node);
}

export function move(event) {
  if (held?.pointer !== event.pointerId) return;
  if (held.pan) {
    held.pan(event);
    return;
  }
  const to = pointOf(event);
  if (held.tool) {
    if (!NODES_TOOLS.has(held.tool)) change({ sketch: [held.from, to] });
    return;
  }
  const by = [to[0] - held.from[0], to[1] - held.from[1]];
  if (!held.moving && Math.hypot(...by) < MOVED_M) return;
  held.moving = true;
  drag(moved(held.before, held, by));
}

export function release(event) {
  if (held?.pointer !== event.pointerId) return;
  const { before, moving, tool, from, id } = held;
  held = null;
  if (tool) drawn(tool, from, pointOf(event), id);
  else if (moving) dropped(before);
  else change({}); // the drawing fits itself again
}

// The browser took the pointer for something else, as for scrolling: nothing was drawn, nothing moved.
export function cancel(event) {
  if (held?.pointer !== event.pointerId) return;
  const { before, moving } = held;
  held = null;
  change({ sketch: null, ...(moving && { draft: before }) });
}

export function nudge(event) {
  const step = STEP_M[event.key];
  const { chosen, draft, snap_m: grid } = site();
  if (!step || event.ctrlKey || event.metaKey || event.altKey || chosen.table === "site") return;
  event.preventDefault();
  const far = (grid || 0.01) * (event.shiftKey ? 10 : 1);
  edit(moved(draft, chosen, step.map((value) => value * far), rounded), { what: `${chosen.table} ${chosen.index} arrows` });
}

// The draft with an element elsewhere, `by` metres from where it was.
function moved(draft, { table, index, node, corner }, [dx, dy], place = snapped) {
  const values = valuesOf(draft, { table, index });
  const plus = (key, by) => ({ [key]: place((Number(values[key]) || 0) + by) });
  if (table === "aisle" && node !== null && node !== undefined) {
    const here = nodesOf(draft).find((one) => one.aisle === index && one.number === node);
    return withNodeAt(draft, index, node, place(here.x_m + dx));
  }
  if (table === "aisle" || table === "marker") {
    return withValues(draft, { table, index }, { ...(dx && plus("x_m", dx)), ...(dy && plus("y_m", dy)) });
  }
  if (table === "keep_out") {
    const keys = corner ? corner.split(" ") : ["x0_m", "x1_m", "y0_m", "y1_m"];
    return withValues(draft, { table, index }, Object.assign({}, ...keys.map((key) => plus(key, key.startsWith("x") ? dx : dy))));
  }
  if (table === "pad") {
    const node_ = nodesOf(draft).find(({ id }) => id === values.node);
    const to = node_ && nearestNode(draft, [node_.x_m + dx, node_.y_m + dy]);
    return to ? withValues(draft, { table, index }, { node: to.id }) : draft;
  }
  return draft;
}

function nearestNode(draft, [x, y]) {
  const far = (node) => Math.hypot(node.x_m - x, node.y_m - y);
  return nodesOf(draft).reduce((best, node) => (!best || far(node) < far(best) ? node : best), null);
}

// What the tool makes of a stroke from one point to another.
function drawn(tool, from, to, id) {
  const { draft, picked } = site();
  change({ sketch: null });
  if (NODES_TOOLS.has(tool)) {
    if (!id) return;
    if (!picked || picked === id) change({ picked: id, said: english("{id}: now click the other node.", { id }) });
    else add(tool, { nodes: [picked, id] });
    return;
  }
  const [x0, y0, x1, y1] = [Math.min(from[0], to[0]), Math.min(from[1], to[1]), Math.max(from[0], to[0]), Math.max(from[1], to[1])].map(snapped);
  if (tool === "keep_out" && x1 > x0 && y1 > y0) add(tool, { x0_m: x0, y0_m: y0, x1_m: x1, y1_m: y1 });
  if (tool === "marker") add(tool, { x_m: snapped(to[0]), y_m: snapped(to[1]) });
  if (tool === "pad") add(tool, { node: nearestNode(draft, to)?.id ?? "A1" });
  if (tool === "aisle" && x1 > x0) add(tool, { x_m: x0, y_m: snapped(from[1]), spacing_m: steps(x1 - x0, draft) });
}

// As many nodes as fit with the distances that the last aisle has.
function steps(length, draft) {
  const known = rowsOf(draft, "aisle").at(-1)?.values.spacing_m;
  const usual = Array.isArray(known) && known.length ? known : [1.5];
  const found = [];
  for (let left = length; left > 0 && found.length < 500; ) {
    const step = usual[found.length % usual.length];
    if (!(step > 0) || step > left + 1e-6) break;
    found.push(step);
    left -= step;
  }
  return found.length ? found : [rounded(length)];
}

// A new element, chosen at once.
export function add(table, given = {}) {
  const { draft } = site();
  const index = rowsOf(draft, table).length;
  edit(withNew(draft, table, freshValues(draft, table, given)), { chosen: { table, index, node: null } });
  change({ tool: "", picked: "", sketch: null });
  focusOn("element");
}

// To the part of the page with this id, once it is drawn.
export function focusOn(id) {
  requestAnimationFrame(() => requestAnimationFrame(() => document.getElementById(id)?.focus()));
}
