// The hazards that hold, what the drone does about each, and since when.
import { html } from "../html.js";
import { quoted, say } from "../language.js";
import { ACTIONS, age, capital } from "../words.js";

export function Hazards({ hazards }) {
  return html`
    <div role="alert" class="alarm">
      ${hazards.length > 0 &&
      html`
        <section class="card hazards" aria-label=${say("Hazards")}>
          <h2>${say("A hazard|{n} hazards", { n: hazards.length })}</h2>
          <ul>
            ${hazards.map(
              (hazard) => html`
                <li key=${hazard.text}>
                  <span>${quoted(hazard.text, capital)}</span>
                  <span class="quiet">${say("{action}, for {age}", { action: say(ACTIONS[hazard.action] ?? hazard.action), age: age(hazard.age_s) })}</span>
                </li>
              `,
            )}
          </ul>
        </section>
      `}
    </div>
  `;
}
