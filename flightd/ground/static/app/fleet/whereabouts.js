// Where the drones of the station are, as far as they tell, and whose pad is whose.
import { isSilent } from "../hearing.js";
import { state } from "../store.js";
import { isGrounded } from "../words.js";


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
  const pad = padOf(floor);
  if (pad && stands(status, told)) return { x_m: pad.x_m, y_m: pad.y_m, yaw_rad: null, how: old ? "lost" : "stands" };
  const last = track[track.length - 1];
  if (last) return { x_m: last[0], y_m: last[1], yaw_rad: null, how: "lost" };
  return pad && { x_m: pad.x_m, y_m: pad.y_m, yaw_rad: null, how: "lost" };
}

// It is on its own pad: for the station's traffic only where that is certain.
export const stands = (status, told) => (told ? told.rests : Boolean(status) && isGrounded(status) && status.phase !== "pilot" && status.phase !== "aborted");

const padOf = (floor) => floor.pads.find((pad) => nodeOf(pad, floor)?.id === floor.home);

function nodeOf(pad, floor) {
  const apart = (node) => Math.hypot(node.x_m - pad.x_m, node.y_m - pad.y_m);
  return floor.nodes.reduce((best, node) => (!best || apart(node) < apart(best) ? node : best), null);
}

// The pads of a hall by their nodes: {node, owner, isThere, charges}; `owner` is empty where it is nobody's home.
export function padsOf(drones, told) {
  const pads = new Map();
  for (const { name, known, floor } of drones) {
    for (const pad of floor.pads) {
      const node = nodeOf(pad, floor)?.id ?? pad.id;
      const at = pads.get(node) ?? { node, owner: "", isThere: false, charges: false };
      const isOwn = node === floor.home;
      pads.set(node, isOwn ? { node, owner: name, isThere: stands(known.status, told?.drones?.[name]), charges: at.charges || pad.charge } : at);
    }
  }
  return [...pads.values()].sort((a, b) => a.node.localeCompare(b.node));
}
