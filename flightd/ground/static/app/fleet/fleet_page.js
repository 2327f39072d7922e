// The page Fleet: all drones of the station on one map, what each does and why, and STOP for all, in reach.
import { mayOperate } from "../access/session.js";
import { html, useEffect } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { state } from "../store.js";
import { CalendarCard } from "./calendar_card.js";
import { ClosedCard } from "./closed_card.js";
import { DronesCard } from "./drones_card.js";
import { change, fleet, loadFleet } from "./fleet_state.js";
import { HallMap } from "./hall_map.js";
import { StopAll } from "./stop_all.js";
import { heardOf, marksOf } from "./the_drones.js";
import { Timeline } from "./timeline.js";
import { ValueCard } from "./value_card.js";
import { WorkCard } from "./work_card.js";

const AGAIN_MS = 1000;
const RARELY_MS = 10000; // a station that flies no fleet does not begin to

export default function FleetPage() {
  const { told, none, trouble, hall: wanted } = fleet();
  useEffect(() => often(loadFleet, none ? RARELY_MS : AGAIN_MS), [none]);
  const names = state.station?.drones ?? [];
  const marks = marksOf(names);
  const heard = heardOf();
  const halls = [...new Set(heard.map(({ floor }) => floor.name))];
  const hall = halls.includes(wanted) ? wanted : (halls[0] ?? "");
  const here = heard.filter(({ floor }) => floor.name === hall);
  const mayAsk = mayOperate() && Boolean(told?.flies);
  return html`
    <div class="fleet missions">
      <${StopAll} names=${names} />
      <div class="missions-main">
        <h2 class="missions-title">${say("Fleet")} <small>${say("{n} drone|{n} drones", { n: names.length })}</small></h2>
        ${halls.length > 1 && html`<${Halls} halls=${halls} hall=${hall} />`}
        ${here.length > 0 ? html`<${HallMap} key=${hall} drones=${here} marks=${marks} told=${told} mayChoose=${mayAsk} />` : html`<${NoMap} names=${names} />`}
        ${told?.drones && html`<${Timeline} told=${told} marks=${marks} />`}
        <${CalendarCard} />
      </div>
      <div class="missions-side">
        <${Traffic} told=${told} none=${none} trouble=${trouble} />
        ${names.length > 0 && html`<${DronesCard} marks=${marks} told=${told} hall=${hall} />`}
        ${told && here.length > 0 && html`<${ClosedCard} told=${told} floor=${here[0].floor} />`}
        ${told?.flies && here.length > 0 && html`<${WorkCard} told=${told} marks=${marks} floor=${here[0].floor} />`}
        ${mayAsk && html`<${ValueCard} />`}
      </div>
    </div>
  `;
}

// Again and again while the page is seen; what ends it.
function often(load, ms) {
  load();
  const again = setInterval(() => document.hidden || load(), ms);
  return () => clearInterval(again);
}

function Halls({ halls, hall }) {
  return html`
    <div class="choose-row" role="group" aria-label=${say("Halls")}>
      ${halls.map((one) => html`<button key=${one} class="pick" aria-pressed=${one === hall} onClick=${() => change({ hall: one })}>${one}</button>`)}
    </div>
  `;
}

function NoMap({ names }) {
  return html`
    <section class="card"><h3>${names.length ? say("Not heard yet") : say("No drone yet")}</h3>
      ${!names.length && html`<p>${say("Start one:")} <code>flightd sim --speed 1 --set ground.listen=127.0.0.1</code></p>`}
    </section>
  `;
}

// Who else flies them.
function Traffic({ told, none, trouble }) {
  if (trouble) return html`<p class="card refusal" role="alert">${quoted(trouble)}</p>`;
  if (none) {
    return html`
      <section class="card" aria-labelledby="no-fleet"><h3 id="no-fleet">${say("People fly these drones")}</h3>
        <p>${sayWith("The station flies them together where it is started with {option}.", { option: html`<code>--fleet</code>` })}</p>
        <p><a href="/guide/fleet">${say("In the guide")}</a></p>
      </section>`;
  }
  if (told && !told.flies) {
    return html`<section class="card troubled" aria-labelledby="no-traffic"><h3 id="no-traffic">${say("The fleet does not fly yet")}</h3><p>${quoted(told.trouble)}</p></section>`;
  }
  return null;
}
