// The page Studio: all picture sets, installed profiles and the camera's exposure, or one set with its pictures in hand.
import { html, useEffect } from "../html.js";
import { quoted, say } from "../language.js";
import { ExposureCard } from "./exposure_card.js";
import { SetList } from "./set_list.js";
import { SetPage } from "./set_page.js";
import { loadOverview, openSet, studio } from "./studio_state.js";

export default function StudioPage({ route }) {
  const name = decodeURIComponent(route.rest);
  useEffect(() => {
    if (name) openSet(name);
    else loadOverview();
  }, [name]);
  const { overview, trouble } = studio();
  if (overview && !overview.folder) return html`<div class="studio"><${NoFolder} /><${ExposureCard} /></div>`;
  if (!overview && !trouble) return html`<p class="loading quiet" role="status">${say("Loading …")}</p>`;
  return html`
    <div class="studio">
      ${trouble && html`<p class="studio-trouble" role="alert">${quoted(trouble)}</p>`}
      ${name ? html`<${SetPage} name=${name} />` : overview && html`<${SetList} overview=${overview} /><${ExposureCard} />`}
    </div>
  `;
}

function NoFolder() {
  return html`
    <section class="card empty"><h2>${say("No folder to work in")}</h2>
      <p>${say("Pictures and profiles are kept in the station's folder. Start it with one:")} <code>flightd ground --folder out</code>.</p>
    </section>
  `;
}
