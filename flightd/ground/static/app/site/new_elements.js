// The values with which a new element begins: what fits most likely beside what is there.
import { nodesOf, placesOf, rounded, rowsOf } from "./draft.js";

const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
const PITCH_M = 3;

export function freshValues(draft, table, given = {}) {
  return { ...FRESH[table](draft), ...given };
}

const FRESH = {
  aisle: freshAisle,
  cross: (draft) => ({ nodes: unjoinedPair(draft) }),
  blocked: (draft) => ({ nodes: nodesOf(draft).slice(0, 2).map(({ id }) => id) }),
  keep_out: (draft) => {
    const [x, y] = middle(draft);
    return { x0_m: rounded(x - 0.5), y0_m: rounded(y + 0.5), x1_m: rounded(x + 0.5), y1_m: rounded(y + 1) };
  },
  rack: freshRack,
  pad: (draft) => {
    const taken = new Set(rowsOf(draft, "pad").map(({ values }) => values.node));
    const node = nodesOf(draft).find(({ id }) => !taken.has(id));
    const isFirst = rowsOf(draft, "pad").length === 0;
    return { id: isFirst ? "home" : `pad-${rowsOf(draft, "pad").length + 1}`, node: node?.id ?? "A1" };
  },
  marker: (draft) => {
    const markers = rowsOf(draft, "marker").map(({ values }) => values);
    const [x, y] = middle(draft);
    const id = markers.reduce((most, marker) => Math.max(most, Number(marker.id) || 0), -1) + 1;
    return { id, dictionary: markers[0]?.dictionary ?? "4x4_50", x_m: rounded(x + 0.7), y_m: rounded(y + 0.7) };
  },
};

// As the aisle before it, as far on as the last two are apart.
function freshAisle(draft) {
  const aisles = rowsOf(draft, "aisle").map(({ values }) => values);
  const ids = new Set(aisles.map(({ id }) => id));
  const id = [...LETTERS].find((letter) => !ids.has(letter)) ?? [...LETTERS].map((letter) => `A${letter}`).find((two) => !ids.has(two));
  const last = aisles.at(-1);
  if (!last) return { id: "A", x_m: 0, y_m: 0, spacing_m: [1.5, 1.5, 1.5] };
  const ys = aisles.map(({ y_m: y }) => Number(y) || 0).sort((a, b) => a - b);
  const pitch = ys.length > 1 ? ys.at(-1) - ys.at(-2) : PITCH_M;
  return { ...structuredClone(last), id, y_m: rounded(ys.at(-1) + pitch) };
}

// Two ends side by side that no cross joins yet.
function unjoinedPair(draft) {
  const joined = new Set(rowsOf(draft, "cross").map(({ values }) => [...(values.nodes ?? [])].sort().join(" ")));
  const ends = rowsOf(draft, "aisle")
    .map(({ values }) => ({ id: values.id, y: Number(values.y_m) || 0, places: placesOf(values) }))
    .sort((a, b) => a.y - b.y);
  for (let i = 1; i < ends.length; i += 1) {
    for (const at of [0, -1]) {
      const [a, b] = [ends[i - 1], ends[i]].map(({ id, places }) => ({ id: `${id}${at ? places.length : 1}`, x: places.at(at) }));
      if (Math.abs(a.x - b.x) <= 0.01 && !joined.has([a.id, b.id].sort().join(" "))) return [a.id, b.id];
    }
  }
  return ends.length > 1 ? [`${ends[0].id}1`, `${ends[1].id}1`] : ["A1", "B1"];
}

// For the aisles that no rack has yet.
function freshRack(draft) {
  const racks = rowsOf(draft, "rack").map(({ values }) => values);
  const begin = { bay_width_m: 1.35, levels_m: [0.3, 1.5], positions: 1 };
  if (!racks.length) return begin;
  const taken = new Set(racks.flatMap(({ aisles }) => aisles ?? []));
  const free = rowsOf(draft, "aisle").map(({ values }) => values.id).filter((id) => !taken.has(id));
  return { aisles: free.length ? free : ["A"], ...begin };
}

function middle(draft) {
  const nodes = nodesOf(draft);
  if (!nodes.length) return [0, 0];
  const node = nodes[Math.floor(nodes.length / 2)];
  return [node.x_m, node.y_m];
}
