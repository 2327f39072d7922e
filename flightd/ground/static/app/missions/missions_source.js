// What the page Missions asks of the station, and has it do.
import { english, say } from "../language.js";
import { act, newId } from "../acts.js";
import { askJson, askStation, isGivenUp } from "../fetching.js";
import { selectDrone, shown, state } from "../store.js";
import { change, missions, open } from "./missions_state.js";

const LOOK_MS = 100;
const AGAIN_MS = 500;
const PATIENCE_MS = 6000;
const TAKEN_MS = 6000;
const JSON_BODY = { "Content-Type": "application/json" };

export async function loadMissions() {
  const { site } = missions();
  try {
    const { kept, missions: list } = await askJson(`/api/missions?site=${encodeURIComponent(site)}`);
    if (missions().site === site) change({ kept, list });
  } catch (error) {
    if (!isGivenUp(error)) change({ trouble: error.message, list: missions().list ?? [] });
  }
}

// What a flight is, by which its estimate is known.
export const keyOf = ({ nodes, levels, best }) => JSON.stringify([state.selected, nodes, levels, best]);

// Ask the drone what the chosen flight would be.
export async function loadEstimate() {
  const { nodes, levels, best } = missions();
  const key = keyOf(missions());
  const query = new URLSearchParams([
    ["drone", state.selected],
    ...nodes.map((node) => ["node", node]),
    ...levels.map((level) => ["level", level]),
    ["best", best ? "1" : "0"],
  ]);
  try {
    const planned = await askJson(`/api/missions/estimate?${query}`);
    if (key === keyOf(missions())) change({ estimate: { key, planned } });
  } catch (error) {
    if (isGivenUp(error) || key !== keyOf(missions())) return;
    change({ estimate: { key, trouble: error.message } });
  }
}

async function sent(method, id, body) {
  const options = { method, headers: JSON_BODY, goesOn: true, ...(body && { body: JSON.stringify(body) }) };
  try {
    const told = await askJson(`/api/missions/${id}`, options);
    change({ trouble: "" });
    return told;
  } catch (error) {
    change({ trouble: error.message });
    return undefined;
  } finally {
    loadMissions();
  }
}

export async function save({ id, name, nodes, levels }) {
  return sent("PUT", id || newId(), { site: missions().site, name, nodes, levels });
}

export async function saveChosen() {
  const { best, estimate } = missions();
  const planned = estimate?.key === keyOf(missions()) ? estimate.planned : null; // not that of the choice before
  // kept in the order in which it is flown, so that it is the same tomorrow
  const nodes = best && planned ? planned.nodes : missions().nodes;
  const kept = await save({ ...missions(), nodes });
  if (kept) open(kept);
}

export async function duplicate(mission) {
  const names = new Set((missions().list ?? []).map(({ name }) => name));
  const copy = say("{name} copy", { name: mission.name });
  let name = copy;
  for (let i = 2; names.has(name); i += 1) name = `${copy} ${i}`;
  const kept = await save({ ...mission, id: "", name });
  if (kept) open(kept);
}

export async function remove(mission) {
  await sent("DELETE", mission.id);
  if (missions().id === mission.id) change({ id: "", name: "" });
}

// Hand the flight to the drone, and order its start once the drone says that it has it.
export async function fly({ nodes, levels, best, id }) {
  const drone = state.selected;
  const { welcome, status } = shown();
  const given = { id: newId(), drone, nodes, levels, best_order: best, mission: id };
  const seen = { session: welcome?.session ?? "", seen_ns: status?.stamp_ns ?? 0 };
  change({ flying: english("Handing the nodes to the drone …"), refused: false });
  try {
    await handOver({ ...given, ...seen });
    await taken(given.id);
  } catch (error) {
    change({ flying: error.message, refused: true });
    return;
  }
  change({ flying: "" });
  if (drone === state.selected) act("start", "", given.id);
  loadMissions();
}

// The drone forgets the flight that was handed to it.
export async function flyConfigured() {
  try {
    await handOver({ id: newId(), drone: state.selected, nodes: [] });
    change({ flying: "" });
  } catch (error) {
    change({ flying: error.message, refused: true });
  }
}

// Sent again while the drone does not answer: by its id it is taken once.
async function handOver(given) {
  const until = performance.now() + PATIENCE_MS;
  const body = JSON.stringify(given);
  for (;;) {
    const answer = await askStation("/api/missions/fly", { method: "POST", headers: JSON_BODY, goesOn: true, body });
    if (answer.ok) return;
    const { refused } = await answer.json().catch(() => ({}));
    if (answer.status !== 503 || performance.now() > until) throw new Error(refused ?? english("the ground station answers {status}", { status: answer.status }));
    await passed(AGAIN_MS);
  }
}

const passed = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function taken(plan) {
  const until = performance.now() + TAKEN_MS;
  while (shown().status?.plan !== plan) {
    if (performance.now() > until) throw new Error(english("the drone has not taken the nodes: look at its events on Live"));
    await passed(LOOK_MS);
  }
}

// What has to be flown to count these places of an inventory again becomes the chosen flight of a drone in its hall.
export async function recount(store, places) {
  const body = JSON.stringify({ store, places });
  const { site: hall, nodes, levels, without } = await askJson("/api/missions/recount", { method: "POST", headers: JSON_BODY, body });
  if (!nodes.length) throw new Error(english("nobody knows from which node these places are seen"));
  const site = chooseDroneIn(hall);
  const asked = places.length - without.length;
  const note = noteOf({ n: asked, lost: without.length }, hall);
  const name = places.length === 1 ? say("Recount {place}", { place: places[0] }) : say("Recount {n} places", { n: places.length });
  change({ site, id: "", name, nodes, levels, best: true, note, asked, hall, flying: "", trouble: "", list: null });
}

function noteOf(counted, hall) {
  if (!hall && counted.lost) return english("Counts {n} places of the inventory again; {lost} more have no node and are left out; no flight log beside it says of which hall it is.", counted);
  if (!hall) return english("Counts {n} places of the inventory again; no flight log beside it says of which hall it is.", counted);
  if (counted.lost) return english("Counts {n} places of the inventory again; {lost} more have no node and are left out.", counted);
  return english("Counts {n} places of the inventory again.", counted);
}

// The drone that is shown, else the first other one, that flies in this hall; the site of whichever is shown then.
function chooseDroneIn(hall) {
  const siteOf = (name) => state.drones.get(name)?.welcome?.floor.name ?? "";
  const here = siteOf(state.selected);
  if (!hall || here === hall) return here;
  const other = (state.station?.drones ?? []).find((name) => siteOf(name) === hall);
  if (!other) {
    if (here) throw new Error(english("the inventory is of {hall}, and {drone} flies in {site}: link a drone of {hall}", { hall, drone: state.selected, site: here }));
    return ""; // no drone is heard yet: see missions_state.js
  }
  selectDrone(other);
  return hall;
}
