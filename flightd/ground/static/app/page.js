// The frame of every page: head with STOP, what is wrong with the connection, the live page.
import { Head } from "./head.js";
import { html } from "./html.js";
import { LivePage } from "./live/live_page.js";
import { Silence } from "./silence.js";

export function Page() {
  return html`
    <a class="skip" href="#main">To the flight</a>
    <${Head} />
    <main id="main" tabindex="-1">
      <${Silence} />
      <${LivePage} />
    </main>
  `;
}
