// The head: pages, which site and drone, how well it is heard, and STOP, always in reach.
import { PersonMenu } from "./access/person.js";
import { isOver } from "./access/session.js";
import { act } from "./acts.js";
import { html } from "./html.js";
import { LANGUAGES, keep, language, say, speak } from "./language.js";
import { hears } from "./hearing.js";
import { PAGES } from "./pages.js";
import { retitle } from "./router.js";
import { selectDrone, shown, state, update } from "./store.js";

export function Head() {
  return html`
    <header class="head">
      <${Brand} />
      <${Pages} />
      <${Drones} />
      <${Hearing} />
      <${PersonMenu} />
      <${Language} />
      <${Stop} />
    </header>
  `;
}

// While somebody has to sign in; over a drone that flew as the session ended with STOP.
export function SignInHead() {
  return html`
    <header class="head">
      <${Brand} />
      ${isOver() && html`<${Drones} /><${Hearing} />`}
      <${Language} />
      ${isOver() && html`<${Stop} />`}
    </header>
  `;
}

const Brand = () => html`
  <h1 class="brand"><img src="/static/icon.svg" alt="" width="28" height="28" /><span>flightd</span></h1>
`;

// To the other language.
function Language() {
  const other = Object.keys(LANGUAGES).find((one) => one !== language());
  const turn = () =>
    speak(other).then(
      () => {
        keep(other);
        retitle();
        update(() => {});
      },
      () => {}, // the station does not answer, as the head says; the next press tries again
    );
  return html`
    <button class="tab language" lang=${other} aria-label=${`${other.toUpperCase()}, ${LANGUAGES[other]}`} title=${LANGUAGES[other]} onClick=${turn}>${other.toUpperCase()}</button>
  `;
}

function Pages() {
  return html`
    <nav class="pages" aria-label=${say("Pages")}>
      ${PAGES.map(
        (page) => html`
          <a key=${page.path} href=${page.path} aria-current=${page === state.route.page ? "page" : null}>${say(page.title)}</a>
        `,
      )}
    </nav>
  `;
}

function Drones() {
  const names = state.station?.drones ?? [];
  const site = shown().welcome?.floor.name;
  if (names.length < 2) return site ? html`<p class="site">${site}</p>` : null;
  return html`
    <nav class="drones" aria-label=${say("Drones")}>
      ${names.map(
        (name) => html`
          <button
            key=${name}
            class="tab"
            aria-pressed=${name === state.selected}
            onClick=${() => selectDrone(name)}
          >
            ${name}
          </button>
        `,
      )}
    </nav>
  `;
}

function Hearing() {
  const { good, short } = hears();
  return html`<p class=${`chip ${good ? "good" : "bad"}`}><span class="dot" />${short}</p>`;
}

function Stop() {
  const newest = state.acts.get(state.selected);
  const stopping = newest?.command === "stop" && newest.stage === "sent";
  const several = (state.station?.drones.length ?? 0) > 1;
  return html`
    <button class="stop" onClick=${() => act("stop")} title=${say("Level at once and down at once, without steering")}>
      <strong>${stopping ? say("STOPPING") : say("STOP")}${several ? ` ${state.selected}` : ""}</strong>
      <kbd>Esc</kbd>
    </button>
  `;
}
