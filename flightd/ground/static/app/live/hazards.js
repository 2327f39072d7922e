// The hazards that hold, what the drone does about each, and since when.
import { html } from "../html.js";
import { ACTIONS, age, capital } from "../words.js";

export function Hazards({ hazards }) {
  return html`
    <div role="alert" class="alarm">
      ${hazards.length > 0 &&
      html`
        <section class="card hazards" aria-label="Hazards">
          <h2>${hazards.length === 1 ? "A hazard" : `${hazards.length} hazards`}</h2>
          <ul>
            ${hazards.map(
              (hazard) => html`
                <li key=${hazard.text}>
                  <span>${capital(hazard.text)}</span>
                  <span class="quiet">${ACTIONS[hazard.action] ?? hazard.action}, for ${age(hazard.age_s)}</span>
                </li>
              `,
            )}
          </ul>
        </section>
      `}
    </div>
  `;
}
