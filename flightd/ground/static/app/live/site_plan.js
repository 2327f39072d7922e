// The site as it is painted and built: lines, racks, pads, keep-outs.  Drawn once per map.
import { html } from "../html.js";
import { isTone } from "../paints.js";

const M = 100;
const RACK_DEPTH_M = 0.8;
const MARGIN_M = 0.5;

// [x, y, width, height] of everything that is drawn, m
export function bounds(floor) {
  const xs = [];
  const ys = [];
  for (const line of floor.lines) {
    xs.push(line.x0_m, line.x1_m);
    ys.push(line.y0_m, line.y1_m);
  }
  for (const rack of floor.racks) {
    const { top, bottom } = depth(rack, floor.racks);
    xs.push(rack.x0_m, rack.x1_m);
    ys.push(top, bottom);
  }
  for (const node of floor.nodes) {
    xs.push(node.x_m);
    ys.push(node.y_m);
  }
  const low = (values) => values.reduce((a, b) => Math.min(a, b), Infinity) - MARGIN_M;
  const high = (values) => values.reduce((a, b) => Math.max(a, b), -Infinity) + MARGIN_M;
  return [low(xs), low(ys), high(xs) - low(xs), high(ys) - low(ys)];
}

// A rack reaches back to the middle between it and the rack behind.
function depth(rack, racks) {
  const outward = rack.side === "left" ? -1 : 1;
  const gaps = racks
    .filter((other) => other.side !== rack.side && (other.y_m - rack.y_m) * outward > 0)
    .map((other) => ((other.y_m - rack.y_m) * outward) / 2);
  const back = rack.y_m + outward * Math.min(RACK_DEPTH_M, ...gaps);
  return { top: Math.min(rack.y_m, back), bottom: Math.max(rack.y_m, back) };
}

export function Floor({ floor }) {
  return html`
    <g aria-hidden="true">
      ${floor.racks.map((rack) => html`<${Rack} rack=${rack} racks=${floor.racks} />`)}
      ${floor.pads.map((pad) => html`<${Pad} pad=${pad} />`)}
      <g class=${`paint ${floor.line_colour}`} style=${isTone(floor.line_colour) ? { "--tone": floor.line_colour } : null}>
        ${floor.lines.map(
          (line) => html`
            <line
              x1=${line.x0_m * M} y1=${line.y0_m * M} x2=${line.x1_m * M} y2=${line.y1_m * M}
              stroke-width=${Math.max(floor.line_width_m, 0.05) * M}
            />
          `,
        )}
      </g>
      ${floor.keep_outs.map((area) => html`<${KeepOut} area=${area} />`)}
      ${floor.ways.map((way) => html`<${Restriction} way=${way} nodes=${floor.nodes} />`)}
    </g>
  `;
}

function Rack({ rack, racks }) {
  const { top, bottom } = depth(rack, racks);
  const [x0, x1, y] = [rack.x0_m * M, rack.x1_m * M, rack.y_m * M];
  return html`
    <rect class="rack" x=${x0} y=${top * M} width=${x1 - x0} height=${(bottom - top) * M} />
    <line class="front" x1=${x0} x2=${x1} y1=${y} y2=${y} />
  `;
}

function Pad({ pad }) {
  const side = pad.size_m * M;
  return html`<rect class="pad" x=${pad.x_m * M - side / 2} y=${pad.y_m * M - side / 2} width=${side} height=${side} rx="6" />`;
}

function KeepOut({ area }) {
  const [x, y] = [area.x0_m * M, area.y0_m * M];
  return html`<rect class="keep" x=${x} y=${y} width=${area.x1_m * M - x} height=${area.y1_m * M - y} />`;
}

function Restriction({ way, nodes }) {
  const a = nodes.find((node) => node.id === way.a);
  const b = nodes.find((node) => node.id === way.b);
  const [x, y] = [((a.x_m + b.x_m) / 2) * M, ((a.y_m + b.y_m) / 2) * M];
  if (way.closed) return html`<path class="shut" d=${`M${x - 11} ${y - 11}l22 22m0 -22l-22 22`} />`;
  const turn = (Math.atan2(b.y_m - a.y_m, b.x_m - a.x_m) * 180) / Math.PI;
  return html`<path class="one-way" transform=${`translate(${x} ${y}) rotate(${turn})`} d="M-9 -9L12 0L-9 9Z" />`;
}
