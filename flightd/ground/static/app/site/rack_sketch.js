// One bay of a rack as one stands before it, to scale: its levels with their labels, its places side by side.
import { html } from "../html.js";
import { plain, say } from "../language.js";

const M = 100;
const MOST = 400; // more places than anybody could tell apart

export function RackSketch({ values }) {
  const { bay_width_m: width, positions = 1 } = values;
  const levels = Array.isArray(values.levels_m) ? values.levels_m.filter(Number.isFinite) : [];
  if (!(width > 0) || !levels.length || !Number.isInteger(positions) || positions < 1 || positions * levels.length > MOST) return null;
  const top = Math.max(...levels) + 0.4;
  const [w, h] = [width * M, top * M];
  const place = w / positions;
  const below = levels.length > 1 ? 0.4 * (levels[1] - levels[0]) : 0.4;
  const drop = (Number.isFinite(values.deck_below_label_m) ? values.deck_below_label_m : below) * M;
  const left = h * 0.16;
  const size = Math.max(h, w) / 17;
  return html`
    <svg class="rack-sketch" viewBox=${`${-left} ${-size} ${w + 2 * left} ${h + 2 * size}`} role="img" aria-label=${say("One bay: {levels} levels of {positions} places, {width} m wide", { levels: levels.length, positions, width })}>
      <path class="posts" d=${`M0 0V${h}M${w} 0V${h}M${-left} ${h}H${w + left}`} />
      ${levels.map((level, i) => {
        const y = h - level * M;
        return html`
          <g key=${i}>
            <line class="deck" x1="0" x2=${w} y1=${Math.min(y + drop, h)} y2=${Math.min(y + drop, h)} />
            ${Array.from({ length: positions }, (_, p) => html`<rect class="label" x=${(p + 0.5) * place - size * 0.4} y=${y - size * 0.25} width=${size * 0.8} height=${size * 0.5} />`)}
            <text x=${w + left * 0.2} y=${y + size * 0.35} font-size=${size}>${`${plain(level)} m`}</text><text x=${-left * 0.75} y=${y + size * 0.35} font-size=${size}>${i + 1}</text>
          </g>
        `;
      })}
    </svg>
  `;
}
