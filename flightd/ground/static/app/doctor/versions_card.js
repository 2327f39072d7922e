// What drone and station run on, for who is asked why something does not work.
import { html } from "../html.js";
import { say } from "../language.js";

export function VersionsCard({ drone, versions, station }) {
  const differ = versions && station && versions.flightd !== station.flightd;
  return html`
    <section class="card versions" aria-labelledby="versions-title">
      <h2 id="versions-title">${say("Versions")}</h2>
      ${differ && html`<p class="obstacles">${say("Drone and station are not of the same version: update the older.")}</p>`}
      <table>
        <thead><tr><th scope="col">${say("Part")}</th><th scope="col">${drone}</th><th scope="col">${say("Station")}</th></tr></thead>
        <tbody>
          ${names(versions, station).map((name) => html`
            <tr key=${name}><th scope="row">${name}</th><td>${versions?.[name] ?? "–"}</td><td>${station?.[name] ?? "–"}</td></tr>
          `)}
        </tbody>
      </table>
    </section>
  `;
}

const names = (...tables) => [...new Set(tables.flatMap((table) => Object.keys(table ?? {})))];
