// What is drawn on a map over the site: nodes, tracks, ways, drones.  The same live and played back.
import { html } from "../html.js";
import { say } from "../language.js";

export const M = 100; // units of the drawing per metre
const SURE = 2; // standard deviations that are drawn
const AROUND_M = [12, 8]; // what is shown around a drone that is followed
const LARGEST = 4;

const at = ({ x_m: x, y_m: y }) => `${x * M},${y * M}`;

// [x, y, width, height] of the surroundings of a place, m
export const around = ({ x_m: x, y_m: y }) => [x - AROUND_M[0] / 2, y - AROUND_M[1] / 2, ...AROUND_M];

// Nodes and drone stay legible however large the hall is.
export function markScale([, , width, height]) {
  return Math.min(Math.max(1, width / AROUND_M[0], height / AROUND_M[1]), LARGEST);
}

// `way` are the nodes that are flown over next, the first of them from here.
export function Way({ from, way }) {
  if (!from || !way.length) return null;
  return html`
    <g aria-hidden="true">
      <polyline class="way" points=${way.map(at).join(" ")} />
      <polyline class="leg" points=${`${at(from)} ${at(way[0])}`} />
    </g>
  `;
}

// `points` are [x_m, y_m].
export function Track({ points, kind = "" }) {
  const line = points.map(([x, y]) => `${Math.round(x * M)},${Math.round(y * M)}`).join(" ");
  return html`<polyline class=${kind ? `track ${kind}` : "track"} points=${line} aria-hidden="true" />`;
}

// Lines that the drone sees: [x0_m, y0_m, x1_m, y1_m].
export function Seen({ lines }) {
  return html`
    <g class="seen" aria-hidden="true">
      ${lines.map(([x0, y0, x1, y1]) => html`<line x1=${x0 * M} y1=${y0 * M} x2=${x1 * M} y2=${y1 * M} />`)}
    </g>
  `;
}

// The nodes, to look at.
export function Nodes({ floor, visited, goal, scale }) {
  return floor.nodes.map(
    (node) => html`
      <g
        key=${node.id}
        class=${`${nodeClass(node.id, false, visited, goal)} still`}
        transform=${nodeTransform(node, scale)}
        aria-hidden="true"
      >
        <${NodeMark} id=${node.id} />
      </g>
    `,
  );
}

export const NodeMark = ({ id, r = 9 }) => html`<circle class="mark" r=${r} /><text x="14" y="32">${id}</text>`;

export const nodeTransform = (node, scale) => `translate(${node.x_m * M} ${node.y_m * M}) scale(${scale})`;

export function nodeClass(id, isChosen, visited, goal) {
  const classes = ["node"];
  if (visited.has(id)) classes.push("visited");
  if (goal === id) classes.push("goal");
  if (isChosen) classes.push("chosen");
  return classes.join(" ");
}

// A drone with its heading and how sure it is of both; sigmas may be null.
export function Drone({ position, scale, name = say("The drone"), kind = "" }) {
  const { x_m: x, y_m: y, yaw_rad: yaw } = position;
  const turn = (yaw * 180) / Math.PI;
  const spread = Math.min(SURE * (position.sigma_yaw_rad ?? 0), Math.PI / 2);
  const [cx, cy, r] = [Math.cos(spread) * 90, Math.sin(spread) * 90, 90];
  const isKnown = position.sigma_x_m != null && position.sigma_y_m != null;
  return html`
    <g class=${kind || null} transform=${`translate(${x * M} ${y * M})`} role="img" aria-label=${name}>
      ${isKnown && html`<ellipse class="sure" rx=${SURE * position.sigma_x_m * M} ry=${SURE * position.sigma_y_m * M} />`}
      <g transform=${`rotate(${turn}) scale(${scale})`}>
        <path class="heading" d=${`M0 0L${cx} ${-cy}A${r} ${r} 0 0 1 ${cx} ${cy}Z`} />
        <path class="drone" d="M34 0L-22 -22L-11 0L-22 22Z" />
      </g>
    </g>
  `;
}

// `marks` are [mark, text]: the mark's class is mark-…
export function Legend({ marks }) {
  return html`
    <ul class="legend" aria-label=${say("Legend")}>
      ${marks.map(([mark, text]) => html`<li key=${mark}><i class=${`mark-${mark}`} />${say(text)}</li>`)}
    </ul>
  `;
}
