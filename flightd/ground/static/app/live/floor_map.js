// The map: the site to scale, and on it the drone, how sure it is of its place, where it was and flies next.
import { html, useMemo } from "../html.js";
import { shown, state, update } from "../store.js";
import { nextInDirection } from "./map_keys.js";
import { Floor, bounds } from "./site_plan.js";

const M = 100; // units of the drawing per metre
const SURE = 2; // standard deviations that are drawn
const AROUND_M = [12, 8]; // what is shown around a drone that is followed
const LARGEST = 4;

export function FloorMap({ floor }) {
  const box = useMemo(() => bounds(floor), [floor]);
  const plan = useMemo(() => html`<${Floor} floor=${floor} box=${box} />`, [floor]);
  const nodes = useMemo(() => new Map(floor.nodes.map((node) => [node.id, node])), [floor]);
  const { status, visited } = shown();
  const view = state.followed ? around(status?.position ?? nodes.get(floor.home)) : box;
  const scale = markScale(view);
  return html`
    <section class="card map" aria-labelledby="map">
      <h2 id="map" class="unseen">Map</h2>
      <svg
        viewBox=${view.map((value) => value * M).join(" ")}
        role="group"
        aria-label=${`Map of ${floor.name}`}
        style=${{ "--scale": scale }}
      >
        ${plan}
        <${Way} status=${status} nodes=${nodes} />
        <${Track} />
        <${Nodes} floor=${floor} visited=${visited} status=${status} scale=${scale} />
        ${status?.position && html`<${Drone} position=${status.position} scale=${scale} />`}
      </svg>
      <div class="map-foot">
        <${Legend} />
        <${Follow} />
      </div>
    </section>
  `;
}

const around = ({ x_m: x, y_m: y }) => [x - AROUND_M[0] / 2, y - AROUND_M[1] / 2, ...AROUND_M];

// Nodes and drone stay legible however large the hall is.
function markScale([, , width, height]) {
  return Math.min(Math.max(1, width / AROUND_M[0], height / AROUND_M[1]), LARGEST);
}

function Follow() {
  const turn = () =>
    update((s) => {
      s.followed = !s.followed;
    });
  return html`<button class="order follow" aria-pressed=${state.followed} onClick=${turn}>Follow the drone</button>`;
}

function Way({ status, nodes }) {
  if (!status?.position || !status.way.length) return null;
  const points = status.way.map((id) => nodes.get(id)).filter(Boolean);
  if (!points.length) return null;
  const at = ({ x_m: x, y_m: y }) => `${x * M},${y * M}`;
  return html`
    <g aria-hidden="true">
      <polyline class="way" points=${points.map(at).join(" ")} />
      <polyline class="leg" points=${`${at(status.position)} ${at(points[0])}`} />
    </g>
  `;
}

function Track() {
  const { track } = shown();
  return html`<polyline class="track" points=${track.map(([x, y]) => `${x * M},${y * M}`).join(" ")} aria-hidden="true" />`;
}

function Nodes({ floor, visited, status, scale }) {
  const chosen = state.chosenNode;
  const inTabOrder = chosen || floor.home;
  const choose = (id) =>
    update((s) => {
      s.chosenNode = id;
    });
  const onKey = (event, node) => {
    const next = nextInDirection(floor.nodes, node, event.key);
    if (next) {
      choose(next.id);
      document.getElementById(`node-${next.id}`)?.focus();
    } else if (event.key === "Enter" || event.key === " ") choose(node.id);
    else return;
    event.preventDefault();
  };
  return floor.nodes.map(
    (node) => html`
      <g
        key=${node.id}
        id=${`node-${node.id}`}
        class=${nodeClass(node.id, chosen, visited, status)}
        transform=${`translate(${node.x_m * M} ${node.y_m * M}) scale(${scale})`}
        role="button"
        aria-pressed=${node.id === chosen}
        aria-label=${`Node ${node.id}${visited.has(node.id) ? ", visited" : ""}`}
        tabindex=${node.id === inTabOrder ? 0 : -1}
        onClick=${() => choose(node.id)}
        onKeyDown=${(event) => onKey(event, node)}
      >
        <circle class="touch" r="32" /><circle class="mark" r="9" />
        <text x="14" y="30">${node.id}</text>
      </g>
    `,
  );
}

function nodeClass(id, chosen, visited, status) {
  const classes = ["node"];
  if (visited.has(id)) classes.push("visited");
  if (status?.goal === id) classes.push("goal");
  if (id === chosen) classes.push("chosen");
  return classes.join(" ");
}

function Drone({ position, scale }) {
  const { x_m: x, y_m: y, yaw_rad: yaw } = position;
  const turn = (yaw * 180) / Math.PI;
  const spread = Math.min(SURE * (position.sigma_yaw_rad ?? 0), Math.PI / 2);
  const [cx, cy, r] = [Math.cos(spread) * 90, Math.sin(spread) * 90, 90];
  return html`
    <g transform=${`translate(${x * M} ${y * M})`} role="img" aria-label="The drone">
      ${position.sigma_x_m !== null &&
      html`<ellipse class="sure" rx=${SURE * position.sigma_x_m * M} ry=${SURE * position.sigma_y_m * M} />`}
      <g transform=${`rotate(${turn}) scale(${scale})`}>
        <path class="heading" d=${`M0 0L${cx} ${-cy}A${r} ${r} 0 0 1 ${cx} ${cy}Z`} />
        <path class="drone" d="M34 0L-22 -22L-11 0L-22 22Z" />
      </g>
    </g>
  `;
}

function Legend() {
  const marks = [
    ["leg", "next leg"],
    ["way", "way after it"],
    ["track", "track"],
    ["visited", "visited"],
    ["keep", "keep out"],
  ];
  return html`
    <ul class="legend" aria-label="Legend">
      ${marks.map(([mark, text]) => html`<li key=${mark}><i class=${`mark-${mark}`} />${text}</li>`)}
    </ul>
  `;
}
