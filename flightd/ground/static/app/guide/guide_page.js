// The guide: its pages at /guide and /guide/TOPIC, a search over all of them at /guide/search?q=WORDS.
import { askJson } from "../fetching.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { say } from "../language.js";
import { goTo } from "../router.js";
import { hasSingleKeys } from "../single_keys.js";
import { GuideArticle } from "./guide_article.js";
import { SearchHits } from "./search_hits.js";

export default function GuidePage({ route }) {
  const words = route.rest === "search" ? (route.query.get("q") ?? "") : "";
  return html`
    <div class="guide">
      <div class="guide-side">
        <${SearchField} words=${words} />
        <${PageList} topic=${route.rest} />
      </div>
      ${route.rest === "search"
        ? html`<${SearchHits} words=${words} />`
        : html`<${GuideArticle} topic=${route.rest || "index"} hash=${route.hash} />`}
    </div>
  `;
}

function SearchField({ words }) {
  const field = useRef(null);
  useEffect(() => {
    const onKey = (event) => {
      if (event.key !== "/" || !hasSingleKeys() || event.target.closest?.("input, textarea, select")) return;
      event.preventDefault();
      field.current.focus();
      field.current.select();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
  const search = (text) => {
    const isSearching = location.pathname === "/guide/search"; // each letter is no step to go back to
    goTo(text ? `/guide/search?q=${encodeURIComponent(text)}` : "/guide", { replace: isSearching, keepFocus: true });
  };
  return html`
    <div role="search">
      <label class="unseen" for="guide-words">${say("Search the guide")}</label>
      <input
        id="guide-words" type="search" ref=${field} placeholder=${hasSingleKeys() ? say("Search the guide  ( / )") : say("Search the guide")} value=${words}
        onInput=${(event) => search(event.target.value)}
      />
    </div>
  `;
}

function PageList({ topic }) {
  const [pages, setPages] = useState([]);
  useEffect(() => {
    askJson("/api/guide").then((told) => setPages(told.pages)).catch(() => {});
  }, []);
  const shown = topic || "index";
  const current = pages.find((page) => page.topic === shown);
  const byKeys = useRef(false); // an arrow key changes the choice at every press: Enter, or leaving it, goes there
  const [picked, pick] = useState(null);
  const choose = ({ target: { value } }) => {
    pick(null);
    if (value && value !== shown) goTo(value === "index" ? "/guide" : `/guide/${value}`);
  };
  const onChange = (event) => (byKeys.current ? pick(event.target.value) : choose(event));
  const onKeyDown = (event) => {
    byKeys.current = event.key !== "Enter";
    if (event.key === "Enter") choose(event);
  };
  return html`
    <nav class="guide-pages" aria-label=${say("Guide")}>
      <ul>
        ${pages.map(
          ({ topic: one, title }) => html`
            <li key=${one}><a href=${one === "index" ? "/guide" : `/guide/${one}`} aria-current=${one === shown ? "page" : null} lang=${one === "index" ? null : "en"}>${one === "index" ? say("All pages") : title}</a></li>
          `,
        )}
      </ul>
      <label class="guide-choice">${say("Page")}
        <select value=${picked ?? (current ? shown : "")} onPointerDown=${() => (byKeys.current = false)} onKeyDown=${onKeyDown}
          onChange=${onChange} onBlur=${choose}>
          ${!current && html`<option value="">${say("choose a page")}</option>`}
          ${pages.map(({ topic: one, title }) => html`<option key=${one} value=${one} lang=${one === "index" ? null : "en"}>${one === "index" ? say("All pages") : title}</option>`)}
        </select>
      </label>
    </nav>
  `;
}
