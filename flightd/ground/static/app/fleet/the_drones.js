// The drones of the station: how each is told from the others, by letter, shape and colour, where
// they are, as far as they tell, and whose pad is whose.
import { isSilent } from "../hearing.js";
import { html } from "../html.js";
import { state } from "../store.js";
import { isGrounded } from "../words.js";

const SHAPES = [
  "M0 -26A26 26 0 0 1 0 26A26 26 0 0 1 0 -26Z",
  "M-23 -23H23V23H-23Z",
  "M0 -32L32 0L0 32L-32 0Z",
  "M-16 -27H16L31 0L16 27H-16L-31 0Z",
  "M-30 -22H30L18 24H-18Z",
  "M-18 -24H18L30 22H-30Z",
];

// Each drone's mark, by its name: {letter, kind}; letters are the names' first ones where these differ.
export function marksOf(names) {
  const letters = names.map((name) => name.charAt(0).toUpperCase());
  const differ = new Set(letters).size === names.length;
  return new Map(names.map((name, i) => [name, { letter: differ ? letters[i] : `${i + 1}`, kind: i % SHAPES.length }]));
}

// Within a drawing of its own, centred on 0, 0.
export const Mark = ({ mark: { letter, kind } }) => html`
  <path class="badge-shape" d=${SHAPES[kind]} /><text class="badge-letter" y="10">${letter}</text>
`;

// Within a text.
export const Badge = ({ mark }) => html`
  <svg class=${`badge d${mark.kind}`} viewBox="-36 -36 72 72" aria-hidden="true"><${Mark} mark=${mark} /></svg>
`;

// Every drone that has told its map: {name, known, floor}.
export const heardOf = () =>
  (state.station?.drones ?? []).flatMap((name) => {
    const known = state.drones.get(name);
    return known?.welcome ? [{ name, known, floor: known.welcome.floor }] : [];
  });

// Where it is drawn: {x_m, y_m, yaw_rad, how}: "flies" where it tells, "stands" on its pad, "lost": seen there last.
export function placeOf({ known, floor }, told) {
  const { status, track } = known;
  const old = isSilent(known);
  if (status?.position) return { ...status.position, how: old ? "lost" : "flies" };
  const pad = padOf(floor, told?.rests ? told.at : floor.home);
  const isThere = pad && stands(status, told);
  const [x_m, y_m] = (!isThere && track.at(-1)) || (pad ? [pad.x_m, pad.y_m] : []);
  return x_m === undefined ? null : { x_m, y_m, yaw_rad: null, how: isThere && !old ? "stands" : "lost" };
}

// On a pad; by traffic only where that is certain.
export const stands = (status, told) => (told ? told.rests : Boolean(status) && isGrounded(status) && status.phase !== "pilot" && status.phase !== "aborted");

const padOf = (floor, at) => floor.pads.find((_, i) => nodesOf(floor)[i] === at);

// Of pads, found once.
const padNodes = new WeakMap();
function nodesOf(floor) {
  if (!padNodes.has(floor)) padNodes.set(floor, floor.pads.map((pad) => nearest(pad, floor.nodes)));
  return padNodes.get(floor);
}

function nearest(pad, nodes) {
  const apart = (node) => Math.hypot(node.x_m - pad.x_m, node.y_m - pad.y_m);
  return nodes.reduce((best, node) => (!best || apart(node) < apart(best) ? node : best), null)?.id ?? "";
}

// The pads of a hall, by node: {owner (none: nobody’s), isThere, charges, shared}.
export function padsOf(drones, told) {
  const pads = new Map();
  for (const { name, known: { status }, floor } of drones) {
    for (const [i, pad] of floor.pads.entries()) {
      const node = nodesOf(floor)[i];
      const it = told?.drones?.[name];
      if (node === floor.home) pads.set(node, { node, owner: name, isThere: stands(status, it) && (it?.at ?? node) === node, charges: pad.charge });
      else if (!pads.has(node)) {
        const shared = told?.docks?.find((dock) => dock.node === node);
        pads.set(node, { node, owner: shared?.drone, isThere: shared?.taken, charges: shared, shared });
      }
    }
  }
  return [...pads.values()].sort((a, b) => a.node.localeCompare(b.node));
}
