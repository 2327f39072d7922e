// The frame of every page: head with STOP, what is wrong with the connection, and the page that is gone to.
import { Boundary } from "./boundary.js";
import { Head, SignInHead } from "./head.js";
import { html } from "./html.js";
import { say, sayWith } from "./language.js";
import { forget, loaded } from "./page_loader.js";
import { Silence } from "./silence.js";
import { mustSignIn } from "./access/session.js";
import { EndsSoon, FliesOn } from "./access/session_end.js";
import { SIGN_IN } from "./pages.js";
import { state, update } from "./store.js";

export function Page() {
  if (mustSignIn()) {
    return html`<${SignInHead} /><main id="main"><${FliesOn} /><${Loaded} page=${SIGN_IN} /></main>`;
  }
  return html`
    <a class="skip" href="#main">${say("To the page")}</a>
    <${Head} />
    <main id="main" tabindex="-1">
      <${Silence} />
      <${EndsSoon} />
      <${Boundary} route=${state.route}><${Shown} route=${state.route} /><//>
    </main>
  `;
}

function Shown({ route }) {
  const { page } = route;
  if (!page) {
    return html`<section class="card empty"><h2>${say("There is no such page")}</h2>
      <p>${sayWith("Nothing is at {path}.", { path: html`<code>${route.path}</code>` })} <a href="/">${say("To the flight")}</a></p></section>`;
  }
  return html`<${Loaded} page=${page} route=${route} />`;
}

function Loaded({ page, route }) {
  const { component: Component, failed } = loaded(page, redraw);
  if (Component) return html`<${Component} key=${page.path} route=${route} />`;
  if (!failed) return html`<p class="loading quiet" role="status">${say("Loading …")}</p>`;
  // a browser may keep a module that failed as long as the document lives: anew, if there is who sends it
  const again = async () => {
    const isThere = await fetch("/", { cache: "no-store" }).then((answer) => answer.ok, () => false);
    if (isThere) return location.reload();
    forget(page);
    return redraw();
  };
  return html`
    <section class="card empty"><h2>${say("The page cannot be loaded")}</h2>
      <p>${say("The ground station does not send it.")} <button class="tab" onClick=${again}>${say("Try again")}</button></p></section>
  `;
}

const redraw = () => update(() => {});
