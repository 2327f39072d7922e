// The paint of the lines: one of those that have a name, or any tone.
import { html } from "../html.js";
import { say } from "../language.js";
import { isTone, PAINTS, toneOf } from "../paints.js";

const OTHER = "#";
const FIRST_TONE = "#7a3fa0";

export function PaintInput({ id, words, paint, set }) {
  const known = paint in PAINTS || isTone(paint);
  return html`
    <div class="paint-field">
      <label class="field" for=${id}><span><i class="paint-swatch" style=${{ background: toneOf(paint) }} aria-hidden="true" />${words}</span>
        <select id=${id} value=${isTone(paint) ? OTHER : paint} onChange=${({ target }) => set(target.value === OTHER ? FIRST_TONE : target.value)}>
          ${!known && html`<option value=${paint}>${paint || say("choose")}</option>`}
          ${Object.keys(PAINTS).map((one) => html`<option key=${one} value=${one}>${say(one)}</option>`)}
          <option value=${OTHER}>${isTone(paint) ? `${paint} …` : say("another tone …")}</option>
        </select>
      </label>
      ${isTone(paint) &&
      html`<label class="field" for=${`${id}-tone`}>${say("Tone")}
        <input id=${`${id}-tone`} type="color" value=${paint} onChange=${(event) => set(event.target.value)} />
      </label>`}
    </div>
  `;
}
