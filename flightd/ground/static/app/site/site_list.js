// The sites under the station's folder, a new one, and one from another program.
import { html, useEffect, useRef } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { goTo } from "../router.js";
import { dateAndTime } from "../words.js";
import { isChanged, site } from "./site_state.js";
import { loadList, takeIn } from "./site_source.js";


export function SiteList() {
  useEffect(() => void loadList(), []);
  const { list, trouble, draft, name } = site();
  if (!list) return html`<p class="loading quiet" role="status">${quoted(trouble) || say("Loading …")}</p>`;
  return html`
    <div class="site-home">
      <h2>${say("Sites")}</h2>
      ${trouble && html`<p class="site-trouble" role="alert">${quoted(trouble)}</p>`}
      ${draft && isChanged() && html`<section class="card"><p>${sayWith("{name} has changes that are not saved. Opening another one loses them.", { name: html`<b>${name || say("A new site")}</b>` })}</p>
        <p><a class="order" href=${editPath(name)}>${say("Go on with it")}</a></p></section>`}
      <section class="card" aria-labelledby="sites">
        <h3 id="sites">${list.folder ? say("In the folder {folder}", { folder: list.folder }) : say("Site files")}</h3>
        ${list.sites.length === 0 && html`<p class="quiet">${list.folder ? say("No site file lies under the station's folder yet. Begin with a new one.") : sayWith("The station was told no folder to keep sites in: {command}. You can draw one, and keep it by Export.", { command: html`<code>flightd ground --folder sites</code>` })}</p>`}
        <ul class="site-files">
          ${list.sites.map((one) => html`<li key=${one.name}><a href=${editPath(one.name)}>${one.name}</a>
            <span class="quiet">${dateAndTime(one.written_s * 1000)}</span></li>`)}
        </ul>
      </section>
      <section class="card begin-site" aria-labelledby="begin">
        <h3 id="begin">${say("Begin one")}</h3>
        <a class="order" href="/site/new">${say("New site")}</a>
        <${Import} />
        <p class="quiet">${sayWith("Import takes a CSV or XLSX of nodes ({columns}), a VDMA LIF file (.json) or a site file (.toml).", { columns: html`<code>node, x_m, y_m, joined_to, pad</code>` })}</p>
      </section>
    </div>
  `;
}

export const editPath = (name) => (name ? `/site/edit?name=${encodeURIComponent(name)}` : "/site/edit");

function Import() {
  const input = useRef(null);
  const onChange = async () => {
    const [file] = input.current.files;
    input.current.value = ""; // the same file again is a change too
    if (file && (await takeIn(file))) goTo("/site/edit");
  };
  return html`
    <button class="order" onClick=${() => input.current.click()}>${say("Import a file")}</button>
    <input ref=${input} hidden type="file" accept=".csv,.tsv,.txt,.xlsx,.json,.toml" onChange=${onChange} />
  `;
}
