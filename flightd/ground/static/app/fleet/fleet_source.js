// The station's traffic as it tells it, and what a person asks of it.
import { askJson, askStation, isGivenUp } from "../fetching.js";
import { english } from "../language.js";
import { change, fleet } from "./fleet_state.js";

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

export async function askTour() {
  const { chosen: nodes, by: drone } = fleet();
  try {
    await askJson("/api/fleet/tour", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ nodes, drone }), goesOn: true,
    });
    change({ chosen: [], asked: { count: nodes.length } });
  } catch (error) {
    change({ asked: { refused: error.message } });
  }
  loadFleet();
}
