// The lens by pictures of a chessboard: where in the picture it was shown, how well one lens fits, the keys to copy;
// and what a flight tells of the down camera.
import { html, useState } from "../html.js";
import { decimal, english, quoted, say } from "../language.js";
import { capital, percent } from "../words.js";
import { ByFlight } from "./sensor_card.js";
import { asked, choosePicture, setPath, studio, told } from "./studio_state.js";

const CAMERAS = { down: english("Down camera"), front: english("Front camera") };

export function LensCard() {
  const [camera, setCamera] = useState("down");
  const [columns, setColumns] = useState(9);
  const [rows, setRows] = useState(6);
  const [study, setStudy] = useState(null);
  const [busy, setBusy] = useState(false);
  const look = async (event) => {
    event.preventDefault();
    if (busy) return; // the button keeps the focus meanwhile
    setBusy(true);
    await told(async () => setStudy(await asked(setPath(`/boards?columns=${columns}&rows=${rows}`), "GET", undefined, BOARDS_MS)));
    setBusy(false);
  };
  const side = (name, value, set) => html`
    <label class="field">${name} <input type="number" min="3" max="40" required value=${value} onInput=${(event) => set(Number(event.target.value))} /></label>
  `;
  return html`
    <section class="card lens" aria-labelledby="lens"><h3 id="lens">${say("Lens")}</h3>
      <div class="tools" role="group" aria-label=${say("Camera")}>
        ${Object.entries(CAMERAS).map(([key, name]) => html`<button key=${key} class="tab" aria-pressed=${key === camera} onClick=${() => setCamera(key)}>${say(name)}</button>`)}
      </div>
      <h4>${say("By a chessboard")}</h4>
      <p class="quiet">${say("Show a flat chessboard, all of it, tilted and turned, in every part of the picture; take 8 pictures or more into a set of their own.")}</p>
      <form class="tools" onSubmit=${look}>
        ${side(say("Inner corners across"), columns, setColumns)}${side(say("down"), rows, setRows)}
        <button class="order" disabled=${!studio().set.pictures.length} aria-disabled=${busy}>${busy ? say("Looking …") : say("Look for the board")}</button>
      </form>
      ${study && html`<${Study} study=${study} camera=${camera} />`}
      <h4>${say("By a flight")}</h4>
      ${camera === "down" ? html`<${ByFlight} />` : html`<p class="quiet">${say("A flight tells of the down camera alone: of its delay, mount and lens.")}</p>`}
    </section>
  `;
}

const BOARDS_MS = 250000;

function Study({ study, camera }) {
  const cells = study.coverage.flat();
  const seen = cells.filter(Boolean).length;
  return html`
    <p role="status">${say("The board is seen in {boards} of {n} picture, in {share} of the picture.|The board is seen in {boards} of {n} pictures, in {share} of the picture.", { boards: study.boards.length, n: study.pictures, share: percent(seen / cells.length) })}</p>
    ${study.boards.length > 0 &&
    html`
      <svg class="coverage" viewBox="0 0 160 90" role="img" aria-label=${say("Where the board was shown: {seen} of {all} parts of the picture", { seen, all: cells.length })}>
        ${study.coverage.map((row, j) => row.map((many, i) => html`<rect key=${`${i} ${j}`} class=${many ? "seen" : "blank"} x=${i * 20} y=${j * 15} width="20" height="15" />`))}
        ${study.boards.map((one) => one.corners.map(([x, y], i) => html`<circle key=${`${one.file} ${i}`} cx=${x * 160} cy=${y * 90} r="0.7" />`))}
      </svg>
    `}
    ${study.refused && html`<p class="refusal">${quoted(study.refused, capital)}</p>`}
    ${study.config[camera] &&
    html`
      <p>${say("One lens fits all of them to {error} px, its focal length is sure to {sigma} px.", { error: decimal(study.error_px, 2), sigma: decimal(study.sigma_focal_px, 1) })}</p>
      <ul class="residuals" aria-label=${say("How well each picture fits")}>
        ${study.boards.map((one) => html`<li key=${one.file}><button class="tab" onClick=${() => choosePicture(one.file)}>${`${numberOf(one.file)}: ${decimal(one.error_px, 2)} px`}</button></li>`)}
      </ul>
      <p class="quiet">${say("For the drone's configuration:")}</p><pre tabindex="0">${study.config[camera]}</pre>
    `}
  `;
}

const numberOf = (file) => say("Picture {number}", { number: studio().set.pictures.findIndex((one) => one.file === file) + 1 });
