// The map to choose on: each node a button, numbered in the order in which it is flown.
import { html, useMemo } from "../html.js";
import { english, say } from "../language.js";
import { Drone, Legend, M, markScale } from "../live/map_marks.js";
import { NodeButtons } from "../live/node_buttons.js";
import { bounds, Floor } from "../live/site_plan.js";
import { shown } from "../store.js";
import { missions, toggleNode } from "./missions_state.js";

const MARKS = [
  ["chosen", english("chosen, in the order of flight")],
  ["way", english("the way")],
  ["keep", english("keep out")],
];

export function ChooseMap({ floor, planned }) {
  const box = useMemo(() => bounds(floor), [floor]);
  const plan = useMemo(() => html`<${Floor} floor=${floor} box=${box} />`, [floor]);
  const nodes = useMemo(() => new Map(floor.nodes.map((node) => [node.id, node])), [floor]);
  const scale = markScale(box);
  const way = (planned?.way ?? []).map((id) => nodes.get(id)).filter(Boolean);
  const { status } = shown();
  return html`
    <section class="card map choosing" aria-labelledby="choose-map">
      <h3 id="choose-map">${say("Choose nodes on the map")}</h3>
      <p class="quiet">${say("Click a node, or go from node to node with the arrow keys and choose with the space bar.")}</p>
      <svg
        viewBox=${box.map((value) => value * M).join(" ")}
        role="group"
        aria-label=${say("Map of {site} to choose on", { site: floor.name })}
        style=${{ "--scale": scale }}
      >
        ${plan}
        ${way.length > 1 &&
        html`<polyline class="planned-way" points=${way.map(({ x_m: x, y_m: y }) => `${x * M},${y * M}`).join(" ")} aria-hidden="true" />`}
        <${Nodes} floor=${floor} order=${planned?.nodes} scale=${scale} />
        <${Numbers} nodes=${nodes} order=${planned?.nodes ?? []} scale=${scale} />
        ${status?.position && html`<${Drone} position=${status.position} scale=${scale} />`}
      </svg>
      <div class="map-foot"><${Legend} marks=${MARKS} /></div>
    </section>
  `;
}

// Drawn over the nodes: each button's own text stays its name.
function Numbers({ nodes, order, scale }) {
  return html`
    <g class="numbers" aria-hidden="true">
      ${order.map((id, i) => {
        const { x_m: x, y_m: y } = nodes.get(id);
        return html`<text key=${id} transform=${`translate(${x * M} ${y * M}) scale(${scale})`} y="7">${i + 1}</text>`;
      })}
    </g>
  `;
}

// The order is told by the drone's plan; before it is known, the nodes are only marked.
function Nodes({ floor, order, scale }) {
  const { nodes: chosen } = missions();
  const name = (node, isChosen) => {
    const place = order ? order.indexOf(node) + 1 : 0;
    return say(isChosen && place ? english("Node {node}, flown as number {place}") : english("Node {node}"), { node, place });
  };
  return html`<${NodeButtons} picks floor=${floor} chosen=${chosen} entry=${chosen[0] ?? floor.home} onPress=${toggleNode} scale=${scale} name=${name} />`;
}
