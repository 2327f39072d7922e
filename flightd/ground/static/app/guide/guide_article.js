// One page of the guide.  Its HTML is the station's own: made of Markdown without any raw HTML.
import { askJson } from "../fetching.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { quoted, say } from "../language.js";
import { useTitle } from "../router.js";
import { capital } from "../words.js";

const HEADINGS_FROM = 3; // so many are worth a list of them

export function GuideArticle({ topic, hash }) {
  const [told, setTold] = useState(null);
  const [again, setAgain] = useState(0);
  const article = useRef(null);
  useEffect(() => {
    let wanted = true;
    askJson(`/api/guide/pages/${encodeURIComponent(topic)}`)
      .then((page) => wanted && setTold(page))
      .catch((error) => wanted && setTold({ topic, trouble: error.message }));
    return () => {
      wanted = false;
    };
  }, [topic, again]);
  const page = told?.topic === topic ? told : null;
  useTitle(page?.title);
  useEffect(() => {
    if (page?.html) arrive(article.current, hash);
  }, [page, hash]);
  if (!page) return html`<p class="loading quiet" role="status">${say("Loading …")}</p>`;
  if (page.trouble) {
    return html`
      <section class="card empty"><h2>${say("The page cannot be shown")}</h2>
        <p>${quoted(page.trouble, capital)}. <a href="/guide">${say("All pages")}</a></p>
        <button class="tab" onClick=${() => setAgain(again + 1)}>${say("Try again")}</button></section>
    `;
  }
  return html`
    <div class="guide-main">
      <article class="card prose" ref=${article} tabindex="-1" aria-label=${page.title} lang="en" dangerouslySetInnerHTML=${{ __html: page.html }} />
      <nav class="guide-next" aria-label=${say("Pages before and after")}>
        ${page.before && html`<a href=${address(page.before)}><small>${say("Before")}</small><span lang="en">${page.before.title}</span></a>`}
        ${page.after && html`<a class="after" href=${address(page.after)}><small>${say("After")}</small><span lang="en">${page.after.title}</span></a>`}
      </nav>
    </div>
    <${Headings} headings=${page.headings.filter(({ level }) => level === 2)} />
  `;
}

const address = ({ topic }) => (topic === "index" ? "/guide" : `/guide/${topic}`);

// To the heading that the address names, else to the page's beginning.
function arrive(article, hash) {
  const name = decoded(hash.slice(1));
  const heading = name && [...article.querySelectorAll("[id]")].find(({ id }) => id === name);
  if (!heading) {
    window.scrollTo(0, 0);
    return;
  }
  heading.setAttribute("tabindex", "-1");
  heading.focus({ preventScroll: true });
  heading.scrollIntoView();
}

function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

function Headings({ headings }) {
  if (headings.length < HEADINGS_FROM) return null;
  return html`
    <nav class="guide-headings" aria-label=${say("On this page")}>
      <p class="quiet">${say("On this page")}</p>
      <ul lang="en">${headings.map(({ id, text }) => html`<li key=${id}><a href=${`#${id}`}>${text}</a></li>`)}</ul>
    </nav>
  `;
}
