// Who is signed in, in the head, and the way out.
import { html, useState } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { state } from "../store.js";
import { signOut } from "./session.js";

export function PersonMenu() {
  const { session } = state;
  const [trouble, setTrouble] = useState("");
  if (!session?.login || !session.name) return null;
  const leave = () => signOut().catch((error) => setTrouble(error.message));
  return html`
    <details class="person">
      <summary title=${say("Signed in as {name}", { name: session.name })}>
        <span class="person-name">${session.name}</span> <small>${say(session.role)}</small>
      </summary>
      <div class="person-menu">
        <p>${sayWith("Signed in as {name}", { name: html`<strong>${session.name}</strong>` })}, ${say(session.role)}</p>
        <button class="order" onClick=${leave}>${say("Sign out")}</button>
        ${trouble && html`<p class="refusal" role="alert">${quoted(trouble)}</p>`}
      </div>
    </details>
  `;
}
