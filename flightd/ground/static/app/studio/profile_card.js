// An installed profile: its versions, the way back to an earlier one, and how it comes to the drone.
import { mayChange } from "../access/session.js";
import { html } from "../html.js";
import { quoted, say, sayWith } from "../language.js";
import { dateAndTime } from "../words.js";
import { asked, change, loadOverview, studio, told } from "./studio_state.js";
import { ToDrone } from "./to_drone.js";


export function Profile({ profile }) {
  const { name, versions, current, trouble } = profile;
  if (!versions.length && !trouble) return null;
  const back = (version) =>
    told(async () => {
      const now = await asked(`/profiles/${encodeURIComponent(name)}/back`, "POST", { version });
      if (studio().set?.name === name) change({ set: { ...studio().set, profile: now } });
      await loadOverview();
    });
  return html`
    <section class="card profile" aria-label=${say("Profile {name}", { name })}><h3>${say("Profile {name}", { name })}</h3>
      ${trouble && html`<p class="refusal" role="alert">${quoted(trouble)}</p>`}
      ${current === null && !trouble && html`<p class="refusal">${say("Its file is none of these versions.")}</p>`}
      <ol>
        ${versions.toReversed().map(
          (one) => html`
            <li key=${one.number} aria-current=${one.number === current ? "true" : null}>
              <span><b>${say("Version {number}", { number: one.number })}</b> ${say(one.paint)}, ${one.who}${one.verdict === "worse" && html` <span class="refusal">${say("worse")}</span>`}
                <small>${dateAndTime(one.utc_s * 1000)}</small></span>
              ${one.number === current ? html`<span class="ready">${say("installed")}</span>` : mayChange() && html`<button class="order" onClick=${() => back(one.number)}>${say("Take back to {number}", { number: one.number })}</button>`}
            </li>
          `,
        )}
      </ol>
      ${!trouble && html`<p class="quiet">${say("Installed at the station: a drone flies by it once it was sent there, and flightd started anew.")}</p>`}
      <${ToDrone} profile=${profile} />
      <details><summary>${say("Without the ground link")}</summary>
        <p>${sayWith("Copy {file} beside the drone's configuration, and name it there:", { file: html`<code>${profile.file}</code>` })}</p>
        <pre tabindex="0">[vision]
profile = "${name}.npz"</pre>
        <p>${say("It flies by it from its next start. In simulation:")} <code>flightd sim --set vision.profile=${profile.file}</code></p>
        <p><a href=${`/api/studio/profiles/${encodeURIComponent(name)}/file`} download>${say("Download {file}", { file: `${name}.npz` })}</a></p>
      </details>
    </section>
  `;
}
