// The places of the guide that hold the words, best first, each with the words around it.
import { askJson } from "../fetching.js";
import { html, useEffect, useState } from "../html.js";
import { quoted, say } from "../language.js";

const WAIT_MS = 120;

export function SearchHits({ words }) {
  const [told, setTold] = useState(null);
  useEffect(() => {
    let wanted = true;
    const timer = setTimeout(() => {
      askJson(`/api/guide/search?q=${encodeURIComponent(words)}`)
        .then((found) => wanted && setTold(found))
        .catch((error) => wanted && setTold({ trouble: error.message, hits: [] }));
    }, WAIT_MS);
    return () => {
      wanted = false;
      clearTimeout(timer);
    };
  }, [words]);
  return html`
    <section class="guide-main" aria-labelledby="hits">
      <h2 id="hits"><span role="status">${said(words, told)}</span></h2>
      <ol class="hits">
        ${(told?.hits ?? []).map(
          (hit) => html`
            <li key=${`${hit.topic} ${hit.id}`} class="card" lang="en">
              <a href=${address(hit)}>${hit.title}${hit.heading !== hit.title && html`<span class="below"> › ${hit.heading}</span>`}</a>
              <p>${hit.parts.map(([text, isHit]) => (isHit ? html`<mark>${text}</mark>` : text))}</p>
            </li>
          `,
        )}
      </ol>
    </section>
  `;
}

function said(words, told) {
  if (!words.trim()) return say("Search the guide");
  if (!told) return say("Searching …");
  if (told.trouble) return quoted(told.trouble);
  return told.hits.length ? say("{n} place|{n} places", { n: told.hits.length }) : say("Nothing in the guide holds “{words}”", { words });
}

const address = ({ topic, id }) => `/guide${topic === "index" ? "" : `/${topic}`}${id ? `#${id}` : ""}`;
