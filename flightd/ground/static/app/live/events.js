// What happened, newest first, in the reader's own time.
import { html } from "../html.js";
import { quoted, say } from "../language.js";
import { shown } from "../store.js";
import { time } from "../words.js";

const SHOWN = 60;

export function Events() {
  const { events, status, heardAt } = shown();
  const newest = events.slice(-SHOWN).reverse();
  return html`
    <section class="card events" aria-labelledby="events">
      <h2 id="events">${say("Events")}</h2>
      <ol tabindex="0" aria-labelledby="events">
        ${newest.map(
          (event) => html`
            <li key=${event.seq} class=${event.level}>
              <time>${when(event, status, heardAt)}</time>
              <span><span class="what">${quoted(event.name.replaceAll("_", " "))}</span> ${quoted(event.text)}</span>
            </li>
          `,
        )}
        ${newest.length === 0 && html`<li class="quiet">${say("Nothing happened yet.")}</li>`}
      </ol>
    </section>
  `;
}

// The drone's clock counts from its start: its newest status says how long ago an event was.
function when(event, status, heardAt) {
  if (!status) return "";
  const agoMs = (status.stamp_ns - event.stamp_ns) / 1e6 + (performance.now() - heardAt);
  return time(new Date(Date.now() - agoMs));
}
