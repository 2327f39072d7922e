// The map of the hall with all its drones: where each is, what is released to it, what it is still to visit, and
// the air that is closed for the others.  Its nodes may be chosen for a tour.
import { html, useMemo } from "../html.js";
import { english, say } from "../language.js";
import { Legend, M, markScale, Nodes } from "../live/map_marks.js";
import { NodeButtons } from "../live/node_buttons.js";
import { bounds, Floor } from "../live/site_plan.js";
import { phaseWords } from "../words.js";
import { fleet, toggleNode } from "./fleet_state.js";
import { Badge, Mark, padsOf, placeOf } from "./the_drones.js";

const MARKS = [
  ["base", english("released to a drone")],
  ["tour", english("still to be visited, by whom")],
  ["shut", english("closed for others")],
  ["closed", english("closed by a person")],
  ["keep", english("keep out")],
];
const OVER_NEXT = 2; // nodes of its way that are drawn of a drone that no traffic flies
const NONE = new Set();
const at = ({ x_m: x, y_m: y }) => `${x * M},${y * M}`;

export function HallMap({ drones, marks, told, mayChoose }) {
  const { floor } = drones[0];
  const box = useMemo(() => bounds(floor), [floor]);
  const plan = useMemo(() => html`<${Floor} floor=${floor} box=${box} />`, [floor]);
  const nodes = useMemo(() => new Map(floor.nodes.map((node) => [node.id, node])), [floor]);
  const scale = markScale(box);
  const { chosen } = fleet();
  const seen = drones.map((drone) => ({ ...drone, mark: marks.get(drone.name), told: told?.drones?.[drone.name] }));
  return html`
    <section class="card map hall" aria-labelledby="hall">
      <h3 id="hall">${say("Map of {site}", { site: floor.name })}</h3>
      ${mayChoose && html`<p class="quiet">${say("Click a node, or go from node to node with the arrow keys and choose with the space bar.")}</p>`}
      <svg
        viewBox=${box.map((value) => value * M).join(" ")}
        role="group"
        aria-label=${say("Map of {site} with its drones", { site: floor.name })}
        style=${{ "--scale": scale }}
      >
        <defs>
          <pattern id="shut" width="14" height="14" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect class="shut-stripe" width="6" height="14" /></pattern>
        </defs>
        ${plan}
        <${Closed} closed=${told?.closed ?? []} nodes=${nodes} />
        ${seen.map((one) => html`<${Shut} key=${one.name} told=${one.told} nodes=${nodes} />`)}
        ${seen.map((one) => html`<${Released} key=${one.name} ...${one} nodes=${nodes} />`)}
        ${mayChoose
          ? html`<${NodeButtons} picks floor=${floor} chosen=${chosen} entry=${chosen[0] ?? floor.home} onPress=${toggleNode} scale=${scale} />`
          : html`<${Nodes} floor=${floor} visited=${NONE} scale=${scale} />`}
        ${seen.map((one) => html`<${Tour} key=${one.name} ...${one} nodes=${nodes} scale=${scale} />`)}
        ${seen.map((one) => html`<${OnMap} key=${one.name} ...${one} scale=${scale} />`)}
      </svg>
      <div class="map-foot"><${Legend} marks=${told ? MARKS : MARKS.slice(4)} /></div>
      <${Pads} drones=${drones} told=${told} marks=${marks} />
    </section>
  `;
}

// By traffic its base, else the way that it tells.
function Released({ known, floor, told, mark, nodes }) {
  const from = placeOf({ known, floor }, told);
  const ids = told ? told.base : (known.status?.way ?? []).slice(0, OVER_NEXT);
  const way = ids.map((id) => nodes.get(id)).filter(Boolean);
  if (!from || !way.length) return null;
  return html`<polyline class=${`base d${mark.kind}`} points=${[from, ...way].map(at).join(" ")} aria-hidden="true" />`;
}

function Closed({ closed, nodes }) {
  const ways = closed.flatMap((one) => one.ways).map((ends) => ends.map((id) => nodes.get(id))).filter(([a, b]) => a && b);
  return html`<g class="closed-ways" aria-hidden="true">${ways.map(([a, b]) => html`<path d=${`M${at(a)}L${at(b)}`} />`)}</g>`;
}

function Shut({ told, nodes }) {
  const ways = (told?.closed.ways ?? []).map((ends) => ends.map((id) => nodes.get(id))).filter(([a, b]) => a && b);
  const around = (told?.closed.nodes ?? []).map((id) => nodes.get(id)).filter(Boolean);
  return html`
    <g class="shut-air" aria-hidden="true">
      ${ways.map(([a, b]) => html`<path d=${`M${at(a)}L${at(b)}`} />`)}
      ${around.map((node) => html`<circle cx=${node.x_m * M} cy=${node.y_m * M} r="40" />`)}
    </g>
  `;
}

function Tour({ told, mark, nodes, scale }) {
  return html`
    <g class=${`tour d${mark.kind}`} aria-hidden="true">
      ${(told?.tour ?? []).map((id) => nodes.get(id)).filter(Boolean).map(
        (node) => html`
          <g key=${node.id} transform=${`translate(${node.x_m * M} ${node.y_m * M}) scale(${scale})`}>
            <circle class="tour-ring" r="22" /><g transform="translate(-30 -26) scale(.55)"><${Mark} mark=${mark} /></g>
          </g>`,
      )}
    </g>
  `;
}

function OnMap({ name, known, floor, told, mark, scale }) {
  const place = placeOf({ known, floor }, told);
  if (!place) return null;
  const { x_m: x, y_m: y, yaw_rad: yaw, how } = place;
  const phase = known.status ? phaseWords(known.status) : say("Not heard yet");
  const words = how === "lost" ? say("{name}, seen here last: {phase}", { name, phase }) : `${name}: ${phase}`;
  return html`
    <g class=${`on-map d${mark.kind} ${how}`} transform=${`translate(${x * M} ${y * M}) scale(${scale})`} role="img" aria-label=${words}>
      ${yaw !== null && html`<path class="ahead" transform=${`rotate(${(yaw * 180) / Math.PI})`} d="M52 0L28 -17L28 17Z" />`}
      <${Mark} mark=${mark} />
      <text class="whose" x="0" y="-38">${name}</text>
    </g>
  `;
}

function Pads({ drones, told, marks }) {
  const pads = padsOf(drones, told);
  if (!pads.length) return null;
  return html`
    <ul class="pads" aria-label=${say("Pads")}>
      ${pads.map(
        ({ node, owner, isThere, charges, shared }) => html`
          <li key=${node} class=${isThere ? "pad-taken" : ""}>
            ${owner && html`<${Badge} mark=${marks.get(owner)} />`}
            <span><strong>${say("Pad {node}:", { node })}</strong> ${padWords(owner, isThere, shared)}${charges && `, ${say("charges")}`}</span>
          </li>
        `,
      )}
    </ul>
  `;
}

function padWords(name, isThere, shared) {
  if (!name) return shared ? say("shared, free") : say("nobody’s home");
  if (isThere) return say("{name} stands here", { name });
  return shared ? say("kept for {name}", { name }) : say("home of {name}, which is away", { name });
}
