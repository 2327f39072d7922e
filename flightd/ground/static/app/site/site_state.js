// What the page knows: the sites there are, the one that is edited with what was before and after, what is chosen.
import { state, update } from "../store.js";
import { losesWork } from "../unsaved.js";

const MERGED_MS = 1500;
const MOST_STEPS = 300;

const EMPTY = {
  list: null, // {folder, sites: [{name, written_s}], camera}; null: not asked yet
  trouble: "", // why something could not be done
  said: "", // what was done
  name: "", // of the file; empty: it is none yet
  stamp: "", // of the version that was opened; empty: it is none yet
  versions: [], // when old versions were replaced, newest first
  losesComments: false,
  notes: [], // what a person should know of a new or imported map
  draft: null, // see draft.js
  kept: null, // the draft that lies in the file
  past: [],
  future: [],
  lastEdit: { what: "", at: 0 },
  chosen: { table: "site", index: 0, node: null },
  checked: null, // what the station said of a draft, see checking.js
  checkedDraft: null,
  sound: null, // the last answer of a sound map: what is drawn
  camera: null, // against which coverage is checked
  withCamera: true,
  snap_m: 0.1,
  zoom: 1, // how many times larger than the whole is shown
  centre: null, // [x, y] of what is shown, m; null: of the whole
  tool: "", // what the mouse draws: a table, or nothing: it chooses and moves
  busy: false,
};

export const site = () => state.site ?? EMPTY;

export function change(changes) {
  update((s) => {
    s.site = { ...(s.site ?? EMPTY), ...changes };
  });
}

export const isChanged = () => site().draft !== site().kept;
losesWork(isChanged);

// Put a draft in the place of the one that is shown, with a step to go back to.  Edits of the same thing in a row
// (`what`) are one step.
export function edit(draft, { what = "", chosen = site().chosen } = {}) {
  const { draft: before, past, lastEdit } = site();
  if (draft === before) return;
  const now = performance.now();
  const isSame = what && what === lastEdit.what && now - lastEdit.at < MERGED_MS;
  change({
    draft, chosen, future: [], said: "", lastEdit: { what, at: now },
    past: isSame ? past : [...past, { draft: before, chosen: site().chosen }].slice(-MOST_STEPS),
  });
}

// While something is dragged: shown and checked, and one step once it is let go.
export function drag(draft) {
  change({ draft, said: "" });
}
export function dropped(before) {
  if (site().draft === before) return;
  change({ past: [...site().past, { draft: before, chosen: site().chosen }].slice(-MOST_STEPS), future: [], lastEdit: { what: "", at: 0 } });
}

export function undo() {
  const { past, future, draft, chosen } = site();
  if (!past.length) return;
  const step = past.at(-1);
  change({ ...step, past: past.slice(0, -1), future: [{ draft, chosen }, ...future], said: "", lastEdit: { what: "", at: 0 } });
}

export function redo() {
  const { past, future, draft, chosen } = site();
  if (!future.length) return;
  change({ ...future[0], past: [...past, { draft, chosen }], future: future.slice(1), said: "", lastEdit: { what: "", at: 0 } });
}

export function choose(table, index, node = null) {
  change({ chosen: { table, index, node } });
}

// A map to be edited from its beginning.
export function begin(told, { name = "", stamp = "" } = {}) {
  change({
    ...EMPTY, list: site().list, camera: site().camera, withCamera: site().withCamera, snap_m: site().snap_m,
    draft: told.draft, kept: stamp ? told.draft : null, name, stamp, versions: told.versions ?? [],
    losesComments: told.loses_comments, notes: told.notes ?? [],
  });
}
