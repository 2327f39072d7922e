// An installed profile: its versions, the way back to an earlier one, and how it comes to the drone.
import { mayChange } from "../access/session.js";
import { html } from "../html.js";
import { time } from "../words.js";
import { asked, change, loadOverview, studio, told } from "./studio_state.js";

const DAY = new Intl.DateTimeFormat([], { year: "numeric", month: "short", day: "numeric" });

export function Profile({ profile }) {
  const { name, versions, current } = profile;
  if (!versions.length) return null;
  const back = (version) =>
    told(async () => {
      const now = await asked(`/profiles/${encodeURIComponent(name)}/back`, "POST", { version });
      if (studio().set?.name === name) change({ set: { ...studio().set, profile: now } });
      await loadOverview();
    });
  return html`
    <section class="card profile" aria-label=${`Profile ${name}`}><h3>Profile ${name}</h3>
      ${current === null && html`<p class="refusal">Its file is none of these versions.</p>`}
      <ol>
        ${versions.toReversed().map(
          (one) => html`
            <li key=${one.number} aria-current=${one.number === current ? "true" : null}>
              <span><b>Version ${one.number}</b> ${one.paint}, ${one.who}${one.verdict === "worse" && html` <span class="refusal">worse</span>`}
                <small>${DAY.format(one.utc_s * 1000)} ${time(one.utc_s * 1000)}</small></span>
              ${one.number === current ? html`<span class="ready">installed</span>` : mayChange() && html`<button class="order" onClick=${() => back(one.number)}>Take back to ${one.number}</button>`}
            </li>
          `,
        )}
      </ol>
      <details><summary>How it comes to the drone</summary>
        <p>Copy <code>${profile.file}</code> beside the drone's configuration, and name it there:</p>
        <pre tabindex="0">[vision]
profile = "${name}.npz"</pre>
        <p>It flies by it from its next start. In simulation: <code>flightd sim --set vision.profile=${profile.file}</code></p>
        <p><a href=${`/api/studio/profiles/${encodeURIComponent(name)}/file`} download>Download ${name}.npz</a></p>
      </details>
    </section>
  `;
}
