// How a drone is told from the others: a letter in a shape of its own, in a colour of its own.
import { html } from "../html.js";

const SHAPES = [
  "M0 -26A26 26 0 0 1 0 26A26 26 0 0 1 0 -26Z",
  "M-23 -23H23V23H-23Z",
  "M0 -32L32 0L0 32L-32 0Z",
  "M-16 -27H16L31 0L16 27H-16L-31 0Z",
  "M-30 -22H30L18 24H-18Z",
  "M-18 -24H18L30 22H-30Z",
];

// Each drone's mark, by its name: {letter, kind}; letters are the names' first ones where these differ.
export function marksOf(names) {
  const letters = names.map((name) => name.charAt(0).toUpperCase());
  const differ = new Set(letters).size === names.length;
  return new Map(names.map((name, i) => [name, { letter: differ ? letters[i] : `${i + 1}`, kind: i % SHAPES.length }]));
}

// Within a drawing of its own, centred on 0, 0.
export const Mark = ({ mark: { letter, kind } }) => html`
  <path class="badge-shape" d=${SHAPES[kind]} /><text class="badge-letter" y="10">${letter}</text>
`;

// Within a text.
export const Badge = ({ mark }) => html`
  <svg class=${`badge d${mark.kind}`} viewBox="-36 -36 72 72" aria-hidden="true"><${Mark} mark=${mark} /></svg>
`;
