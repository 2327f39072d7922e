// What the page Fleet knows beside what the drones tell: the station's traffic, what is chosen for a tour and asked
// for, the calendar, and STOP for all.
import { askJson, askStation, isGivenUp } from "../fetching.js";
import { english } from "../language.js";
import { toggled, toggledAll } from "../picks.js";
import { state, update } from "../store.js";

const EMPTY = {
  told: null, // as GET /api/fleet; null: not known, or the station flies no fleet
  none: false, // the station flies no fleet
  trouble: "", // why it is not known
  hall: "", // name of the site that is shown, as it was chosen; empty: the first drone's
  chosen: [], // ids of nodes for a tour
  by: "", // the drone for it; empty: whichever
  asked: null, // what became of the newest tour: {count} or {refused}
  valued: null, // the same of what was asked for by value
  closing: "", // why what was to be closed or opened was not
  calendar: null, // {kept, from, runs}
  calendarFrom: "", // first day that is shown, as 2026-11-26
  calendarTrouble: "",
  stop: null, // STOP for all: {stage: "armed", "sent" or "told", at, outcomes: {drone: "" or why not}}
};

export const fleet = () => state.fleet ?? EMPTY;

export function change(changes) {
  update((s) => {
    s.fleet = { ...(s.fleet ?? EMPTY), ...changes };
  });
}

export const choose = (chosen) => change({ chosen, asked: null });

export const toggleNode = (id) => choose(toggled(fleet().chosen, id));
export const toggleNodes = (ids) => choose(toggledAll(fleet().chosen, ids));

const NO_FLEET = 404;

export async function loadFleet() {
  try {
    const answer = await askStation("/api/fleet");
    if (answer.status === NO_FLEET) return change({ told: null, none: true, trouble: "" });
    const told = await answer.json();
    if (!answer.ok) throw new Error(told.refused ?? english("the ground station answers {status}", { status: answer.status }));
    return change({ told, none: false, trouble: "" });
  } catch (error) {
    if (!isGivenUp(error)) change({ trouble: error.message });
    return undefined;
  }
}

const post = (path, asked) =>
  askJson(`/api/fleet/${path}`, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(asked), goesOn: true });

export const closeAisle = (aisle) => changeClosed("close", { aisle });
export const closeBetween = (nodes) => changeClosed("close", { nodes });
export const openAgain = (name) => changeClosed("open", { name });

async function changeClosed(path, asked) {
  try {
    await post(path, asked);
    change({ closing: "" });
  } catch (error) {
    change({ closing: error.message });
  }
  loadFleet();
}

export async function askByValue(asked) {
  try {
    const answer = await post("value", asked);
    change({ valued: { count: answer.asked.length } });
  } catch (error) {
    change({ valued: { refused: error.message } });
  }
  loadFleet();
}

export async function askTour() {
  const { chosen: nodes, by: drone } = fleet();
  try {
    await post("tour", { nodes, drone });
    change({ chosen: [], asked: { count: nodes.length } });
  } catch (error) {
    change({ asked: { refused: error.message } });
  }
  loadFleet();
}
