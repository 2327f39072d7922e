// The lens by pictures of a chessboard: where in the picture it was shown, how well one lens fits, the keys to copy.
import { html, useState } from "../html.js";
import { capital, count } from "../words.js";
import { asked, choosePicture, setPath, studio, told } from "./studio_state.js";

export function LensCard() {
  const [columns, setColumns] = useState(9);
  const [rows, setRows] = useState(6);
  const [study, setStudy] = useState(null);
  const [busy, setBusy] = useState(false);
  const look = async (event) => {
    event.preventDefault();
    setBusy(true);
    await told(async () => setStudy(await asked(setPath(`/boards?columns=${columns}&rows=${rows}`), "GET", undefined, BOARDS_MS)));
    setBusy(false);
  };
  const side = (name, value, set) => html`
    <label class="field">${name} <input type="number" min="3" max="40" required value=${value} onInput=${(event) => set(Number(event.target.value))} /></label>
  `;
  return html`
    <section class="card lens" aria-labelledby="lens"><h3 id="lens">Lens</h3>
      <p class="quiet">Show a flat chessboard, all of it, tilted and turned, in every part of the picture; take 8 pictures or more into a set of their own.</p>
      <form class="tools" onSubmit=${look}>
        ${side("Inner corners across", columns, setColumns)}${side("down", rows, setRows)}
        <button class="order" disabled=${busy || !studio().set.pictures.length}>${busy ? "Looking …" : "Look for the board"}</button>
      </form>
      ${study && html`<${Study} study=${study} />`}
    </section>
  `;
}

const BOARDS_MS = 250000;

function Study({ study }) {
  const cells = study.coverage.flat();
  const seen = cells.filter(Boolean).length;
  return html`
    <p role="status">The board is seen in ${study.boards.length} of ${count(study.pictures, "picture")}, in ${Math.round((100 * seen) / cells.length)} % of the picture.</p>
    ${study.boards.length > 0 &&
    html`
      <svg class="coverage" viewBox="0 0 160 90" role="img" aria-label=${`Where the board was shown: ${seen} of ${cells.length} parts of the picture`}>
        ${study.coverage.map((row, j) => row.map((many, i) => html`<rect key=${`${i} ${j}`} class=${many ? "seen" : "blank"} x=${i * 20} y=${j * 15} width="20" height="15" />`))}
        ${study.boards.map((one) => one.corners.map(([x, y], i) => html`<circle key=${`${one.file} ${i}`} cx=${x * 160} cy=${y * 90} r="0.7" />`))}
      </svg>
    `}
    ${study.refused && html`<p class="refusal">${capital(study.refused)}</p>`}
    ${study.config &&
    html`
      <p>One lens fits all of them to ${study.error_px.toFixed(2)} px, its focal length is sure to ${study.sigma_focal_px.toFixed(1)} px.</p>
      <ul class="residuals" aria-label="How well each picture fits">
        ${study.boards.map((one) => html`<li key=${one.file}><button class="tab" onClick=${() => choosePicture(one.file)}>${numberOf(one.file)}: ${one.error_px.toFixed(2)} px</button></li>`)}
      </ul>
      <p class="quiet">For the drone's configuration:</p><pre tabindex="0">${study.config}</pre>
    `}
  `;
}

const numberOf = (file) => `Picture ${studio().set.pictures.findIndex((one) => one.file === file) + 1}`;
