// Which part of the drawing is shown: all of it, or larger around what is chosen; the empty floor is dragged along.
import { nodesOf, rowsOf, valuesOf } from "./draft.js";
import { change, site } from "./site_state.js";

const M = 100;
const MOST = 40;
let whole = [0, 0, 1, 1]; // of the drawing, as it was shown last

// The part of the whole [x, y, width, height] that is shown, m.
export function zoomed(box) {
  whole = box;
  const { zoom, centre } = site();
  if (zoom <= 1) return box;
  const [x, y, width, height] = box;
  const [cx, cy] = centre ?? [x + width / 2, y + height / 2];
  return [cx - width / zoom / 2, cy - height / zoom / 2, width / zoom, height / zoom];
}

// So many times larger, around what is chosen; 0: the whole again.
export function zoomBy(factor) {
  const zoom = Math.min(MOST, Math.max(1, site().zoom * factor));
  change({ zoom, centre: zoom > 1 ? (site().zoom > 1 && site().centre) || middleOfChosen() : null });
}

function middleOfChosen() {
  const { draft, chosen } = site();
  const values = valuesOf(draft, chosen) ?? {};
  const nodes = nodesOf(draft);
  const named = values.nodes ?? [values.node];
  const on = chosen.table === "aisle" ? nodes.filter((node) => node.aisle === chosen.index) : nodes.filter(({ id }) => named.includes(id));
  const node = on[chosen.node ?? Math.floor(on.length / 2)];
  if (node) return [node.x_m, node.y_m];
  if (chosen.table === "keep_out") return [(values.x0_m + values.x1_m) / 2, (values.y0_m + values.y1_m) / 2];
  if (chosen.table === "marker" && rowsOf(draft, "marker").length) return [values.x_m, values.y_m];
  return [whole[0] + whole[2] / 2, whole[1] + whole[3] / 2];
}

// The empty floor under the pointer: a function that moves what is shown along with it.
export function beginPan(event) {
  const { zoom, centre } = site();
  const perPixel = 1 / (event.currentTarget.getScreenCTM().a * M);
  const [cx, cy] = centre ?? [whole[0] + whole[2] / 2, whole[1] + whole[3] / 2];
  const from = [event.clientX, event.clientY];
  return ({ clientX, clientY }) => {
    if (zoom > 1) change({ centre: [cx - (clientX - from[0]) * perPixel, cy - (clientY - from[1]) * perPixel] });
  };
}
