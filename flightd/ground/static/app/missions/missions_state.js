// What the page Missions knows: what is chosen, what the drone makes of it, and the missions that are kept.
import { english } from "../language.js";
import { toggled, toggledAll } from "../picks.js";
import { state, update } from "../store.js";

const EMPTY = {
  site: "", // the site that the rest belongs to
  nodes: [], // ids of the chosen nodes, in the order of their choice
  levels: [], // shelf levels that are counted; none: all
  best: true, // in the quickest order, not in that of the choice
  id: "", // of the kept mission that is open; empty: none is
  name: "",
  note: "", // what a person should know of this choice
  asked: 0, // places that it was chosen for; 0: it was chosen by nodes
  hall: "", // site that the inventory is of for which it was chosen; empty: of none, or nobody knows
  estimate: null, // {key, planned} or {key, trouble}
  list: null, // missions that are kept; null: not known yet
  kept: true, // this station has a folder to keep them in
  schedules: null, // {kept, list}: the site's schedules, and whether any are kept here; null: not known yet
  scheduleTrouble: "", // what the last act on a schedule came to
  trouble: "", // what the last act on a kept mission came to
  refused: false, // `flying` is why it was not
  flying: "", // what became of handing the mission over; empty: nothing is under way
};

// A choice that is not made for an inventory.
const BY_HAND = { note: "", asked: 0, hall: "" };

export const missions = () => state.missions ?? EMPTY;

export function change(changes) {
  update((s) => {
    s.missions = { ...(s.missions ?? EMPTY), ...changes };
  });
}

// Another site: nothing that was chosen on the one before stands for it.  What was chosen before any drone was
// heard (from an inventory) stands: the drone refuses what it does not know.
export function enter(site) {
  const { site: before, hall } = missions();
  const note = hall && hall !== site ? english("Nothing is chosen: the inventory is of {hall}, this drone flies in {site}.", { hall, site }) : "";
  change(before || note ? { ...EMPTY, site, note } : { site });
}

// What is chosen becomes another choice; an estimate is asked for anew.
export const choose = (changes) => change({ ...BY_HAND, flying: "", ...changes });

export const toggleNode = (id) => choose({ nodes: toggled(missions().nodes, id) });
export const toggleNodes = (ids) => choose({ nodes: toggledAll(missions().nodes, ids) });
export const toggleLevel = (level) => choose({ levels: toggled(missions().levels, level).sort((a, b) => a - b) });

export const open = ({ id, name, nodes, levels }) =>
  change({ id, name, nodes, levels, best: false, ...BY_HAND, flying: "", trouble: "" });

export const startAnew = () => change({ id: "", name: "", nodes: [], levels: [], best: true, ...BY_HAND, flying: "", trouble: "" });

// Whether what is chosen is what the open mission holds.
export function isKept() {
  const { id, list, nodes, levels, name } = missions();
  const kept = list?.find((mission) => mission.id === id);
  const same = (a, b) => a.length === b.length && a.every((one, i) => one === b[i]);
  return Boolean(kept && kept.name === name.trim() && same(kept.nodes, nodes) && same(kept.levels, levels));
}
