// The page Missions: choose what to fly, see what it takes, keep it, fly it.
import { html, useEffect } from "../html.js";
import { say } from "../language.js";
import { shown, state } from "../store.js";
import { ChooseCard } from "./choose_card.js";
import { ChooseMap } from "./choose_map.js";
import { FlyCard } from "./fly_card.js";
import { KeptCard } from "./kept_card.js";
import { keyOf, loadEstimate, loadMissions } from "./missions_source.js";
import { enter, missions } from "./missions_state.js";
import { SchedulesCard } from "./schedules_card.js";
import { loadSchedules } from "./schedules_source.js";

const LIST_MS = 3000;
const CHOOSING_MS = 200;
const AGAIN_MS = 4000;

export default function MissionsPage() {
  const { welcome, status } = shown();
  const site = welcome?.floor.name ?? "";
  const known = missions();
  const key = known.nodes.length ? keyOf(known) : "";
  const waits = status?.phase === "preflight" || status?.phase === "swap";
  useEffect(() => {
    if (site && missions().site !== site) enter(site);
    if (!site) return undefined;
    const load = () => {
      loadMissions();
      loadSchedules();
    };
    load();
    const again = setInterval(() => document.hidden || load(), LIST_MS);
    return () => clearInterval(again);
  }, [site]);
  useEffect(() => {
    if (!key || !waits) return undefined;
    const soon = setTimeout(loadEstimate, CHOOSING_MS); // by the battery as it is told now, which changes
    const again = setInterval(() => document.hidden || loadEstimate(), AGAIN_MS);
    return () => {
      clearTimeout(soon);
      clearInterval(again);
    };
  }, [key, waits]);
  if (!welcome) {
    return html`<section class="card empty"><h2>${say("No drone yet")}</h2>
      <p>${say("A mission is planned by the drone that flies it, on its own map. Start one:")}
        <code>flightd sim --speed 1 --set ground.listen=127.0.0.1</code></p></section>`;
  }
  const estimate = known.estimate?.key === key ? known.estimate : null;
  return html`
    <div class="missions">
      <div class="missions-main">
        <h2 class="missions-title">${say("Missions")} <small>${known.name || say("a new one")}</small></h2>
        <${ChooseMap} floor=${welcome.floor} planned=${estimate?.planned} />
        <${ChooseCard} floor=${welcome.floor} />
      </div>
      <div class="missions-side">
        <${FlyCard} key=${state.selected} estimate=${estimate} waits=${waits} />
        <${KeptCard} />
        <${SchedulesCard} floor=${welcome.floor} />
      </div>
    </div>
  `;
}
