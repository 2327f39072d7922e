// Who is signed in, in the head, and the way out.
import { html, useState } from "../html.js";
import { state } from "../store.js";
import { signOut } from "./session.js";

export function PersonMenu() {
  const { session } = state;
  const [trouble, setTrouble] = useState("");
  if (!session?.login || !session.name) return null;
  const leave = () => signOut().catch((error) => setTrouble(error.message));
  return html`
    <details class="person">
      <summary title=${`Signed in as ${session.name}`}>
        <span class="person-name">${session.name}</span> <small>${session.role}</small>
      </summary>
      <div class="person-menu">
        <p>Signed in as <strong>${session.name}</strong>, ${session.role}</p>
        <button class="order" onClick=${leave}>Sign out</button>
        ${trouble && html`<p class="refusal" role="alert">${trouble}</p>`}
      </div>
    </details>
  `;
}
