// The page Site: the sites at /site, a new one at /site/new, one in the editor at /site/edit?name=FILE.
import { html, useEffect } from "../html.js";
import { quoted, say } from "../language.js";
import { useTitle } from "../router.js";
import { Editor } from "./editor.js";
import { NewSite } from "./new_site.js";
import { SiteList } from "./site_list.js";
import { loadList, openFile } from "./site_source.js";
import { site } from "./site_state.js";

export default function SitePage({ route }) {
  if (route.rest === "new") return html`<${NewSite} />`;
  if (route.rest === "edit") return html`<${Edited} name=${route.query.get("name") ?? ""} />`;
  return html`<${SiteList} />`;
}

function Edited({ name }) {
  const { draft, name: opened, list, trouble } = site();
  useEffect(() => {
    if (!list) loadList();
    if (name && name !== site().name) openFile(name);
  }, [name]);
  useTitle(name || say("New site"));
  const isHere = draft && (!name || opened === name);
  if (isHere) return html`<${Editor} />`;
  if (name && !trouble) return html`<p class="loading quiet" role="status">${say("Loading …")}</p>`;
  return html`<section class="card empty"><h2>${trouble ? say("It cannot be opened") : say("No site is open")}</h2><p>${quoted(trouble)} <a href="/site">${say("All sites")}</a></p></section>`;
}
