// Which picture sets there are, a new one, and the profiles that were installed.
import { mayOperate } from "../access/session.js";
import { html, useState } from "../html.js";
import { quoted, say } from "../language.js";
import { goTo } from "../router.js";
import { capital } from "../words.js";
import { Profile } from "./profile_card.js";
import { asked, told } from "./studio_state.js";

export function SetList({ overview }) {
  return html`
    <header class="studio-head"><h2>${say("Studio")}</h2>
      <p class="quiet">${say("Teach the drone the colour of your lines: show it paint and floor in a few pictures, see at once what it would take for a line, compare with what flies now, install.")}</p>
    </header>
    ${overview.missing && html`<p class="obstacles"><strong>${say("Nothing can be learnt yet.")}</strong> ${quoted(overview.missing, capital)}</p>`}
    <div class="studio-cards">
      <section class="card sets" aria-labelledby="sets"><h3 id="sets">${say("Picture sets")}</h3>
        ${overview.sets.length === 0 && html`<p class="quiet">${say("None yet. A set holds pictures of one floor and its paint; the profile has the set's name.")}</p>`}
        <ul>${overview.sets.map((name) => html`<li key=${name}><a class="order" href=${`/studio/${encodeURIComponent(name)}`}>${name}</a></li>`)}</ul>
        ${mayOperate() ? html`<${NewSet} paints=${overview.paints} />` : html`<p class="quiet">${say("Only looking on: an operator makes sets.")}</p>`}
      </section>
      ${overview.profiles.map((profile) => html`<${Profile} key=${profile.name} profile=${profile} />`)}
    </div>
  `;
}

const OTHER = "#";

function NewSet({ paints }) {
  const [name, setName] = useState("");
  const [paint, setPaint] = useState(paints[0]);
  const [tone, setTone] = useState("#7a3fa0");
  const make = async (event) => {
    event.preventDefault();
    const wanted = { name: name.trim(), paint: paint === OTHER ? tone : paint };
    if (await told(() => asked("/sets", "POST", wanted))) goTo(`/studio/${encodeURIComponent(wanted.name)}`);
  };
  return html`
    <form class="new-set" onSubmit=${make}>
      <label class="field">${say("Name of a new set")}
        <input value=${name} required maxlength="40" placeholder="hall-3" pattern="[a-z0-9][a-z0-9\\-]*" title=${say("small letters, digits and hyphens")}
          onInput=${(event) => setName(event.target.value)} />
      </label>
      <label class="field">${say("Paint")}
        <select value=${paint} onChange=${(event) => setPaint(event.target.value)}>
          ${paints.map((one) => html`<option key=${one} value=${one}>${say(one)}</option>`)}
          <option value=${OTHER}>${say("another …")}</option>
        </select>
      </label>
      ${paint === OTHER &&
      html`<label class="field">${say("Tone")} <input type="color" value=${tone} onInput=${(event) => setTone(event.target.value)} /></label>`}
      <button class="order main-order">${say("Make the set")}</button>
    </form>
  `;
}
