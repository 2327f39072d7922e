// Will the labels be read from the nodes?  By which camera, and what the check says of it.
import { html } from "../html.js";
import { english, say } from "../language.js";
import { number, percent } from "../words.js";
import { Field } from "./field.js";
import { change, site } from "./site_state.js";

const FIELDS = [
  { key: "fov_deg", words: english("Field of view across"), kind: "number", unit: "°" },
  { key: "width_px", words: english("Picture's width"), kind: "number", unit: "px" },
  { key: "exposure_ms", words: english("Exposure"), kind: "number", unit: "ms" },
  { key: "module_mm", words: english("Module of the smallest label"), kind: "number", unit: "mm" },
  { key: "speed_mps", words: english("Speed while looking"), kind: "number", unit: "m/s" },
];

export function CoverageCard() {
  const { camera, withCamera, checked, sound } = site();
  if (!camera) return null;
  const reach = checked?.sound ? sound?.coverage : null;
  const set = (changes) => {
    const value = Object.values(changes)[0];
    if (value !== undefined) change({ camera: { ...camera, ...changes } });
  };
  return html`
    <section class="card coverage" aria-labelledby="coverage">
      <h3 id="coverage">${say("Scan coverage")}</h3>
      <label class="check"><input type="checkbox" checked=${withCamera} onChange=${(event) => change({ withCamera: event.target.checked })} /> ${say("Check the front camera")}</label>
      ${withCamera && reach && html`<${Reach} reach=${reach} places=${checked.facts.locations} />`}
      ${withCamera && html`
        <details><summary>${say("Camera and labels")}</summary>
          <div class="element-fields">${FIELDS.map((field) => html`<${Field} key=${field.key} field=${field} values=${camera} onValue=${set} />`)}</div>
        </details>
      `}
    </section>
  `;
}

function Reach({ reach, places }) {
  const share = reach.read_part < 1 ? Math.min(0.99, reach.read_part) : 1; // what is not all is no 100 %
  return html`
    <p class=${share === 1 ? "ready" : "refusal"} role="status">${places ? say("{share} of {n} places are read", { share: percent(share), n: places }) : say("No places yet: add a rack")}</p>
    <dl class="site-facts">
      <div><dt>${say("not in a picture")}</dt><dd>${reach.unseen}</dd></div><div><dt>${say("too small")}</dt><dd>${reach.unreadable}</dd></div>
      <div><dt>${say("pixels per module")}</dt><dd>${number(reach.px_per_module, 1)} <small>${say("of 2.5")}</small></dd></div>
      <div><dt>${say("blur")}</dt><dd>${number(reach.blur_modules, 2)} <small>${say("of 0.75 modules")}</small></dd></div>
    </dl>
  `;
}
