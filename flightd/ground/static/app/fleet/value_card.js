// Nobody says which nodes, only how many of the most valuable, or all.
import { html, useState } from "../html.js";
import { quoted, say } from "../language.js";
import { askByValue, fleet } from "./fleet_state.js";

export function ValueCard() {
  const { valued } = fleet();
  const [of, setOf] = useState("nodes");
  const [most, setMost] = useState(10);
  const onSubmit = (event) => {
    event.preventDefault();
    askByValue(of === "all" ? {} : { [of]: most });
  };
  return html`
    <section class="card" aria-labelledby="by-value">
      <h3 id="by-value">${say("Work by value")}</h3>
      <form class="tour-form" onSubmit=${onSubmit}>
        <p class="quiet">${say("First what the books contradict, then what was never counted, then the oldest.")}</p>
        <div class="tour-add">
          <label class="field">${say("Most valuable")}
            <select value=${of} onChange=${(event) => setOf(event.target.value)}>
              <option value="nodes">${say("Nodes")}</option>
              <option value="aisles">${say("Aisles")}</option>
              <option value="all">${say("All")}</option>
            </select>
          </label>
          ${of !== "all" && html`<label class="field">${say("How many")}<input type="number" min="1" max="500" required value=${most} onInput=${(event) => setMost(event.target.valueAsNumber)} /></label>`}
        </div>
        <button class="order">${say("Have it visited")}</button>
        <p class=${valued?.refused ? "refusal" : "quiet"} role="status">${valued && (valued.refused ? quoted(valued.refused) : say("{n} node was asked for.|{n} nodes were asked for.", { n: valued.count }))}</p>
      </form>
    </section>
  `;
}
