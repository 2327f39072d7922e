// Doctor: what the drone finds of itself at /doctor, its settings at /doctor/settings/SECTION.
import { html, useEffect, useState } from "../html.js";
import { english, say, sayWith } from "../language.js";
import { askJson } from "../fetching.js";
import { shown, state } from "../store.js";
import { useTitle } from "../router.js";
import { askDrone } from "./asking.js";
import { ChecksCard } from "./checks_card.js";
import { LogCard } from "./log_card.js";
import { SettingsView } from "./settings_view.js";
import { VersionsCard } from "./versions_card.js";

const VIEWS = { checks: { path: "/doctor", title: english("Checks") }, settings: { path: "/doctor/settings", title: english("Settings") } };

export default function DoctorPage({ route }) {
  const view = route.rest.split("/")[0] === "settings" ? "settings" : "checks";
  const drone = state.selected;
  const [station, setStation] = useState(null);
  useTitle(say(VIEWS[view].title));
  useEffect(() => {
    askJson("/api/doctor").then(setStation).catch(() => {});
  }, []);
  return html`
    <div class="doctor">
      <nav class="doctor-views" aria-label=${say("Doctor")}>
        ${Object.entries(VIEWS).map(([name, { path, title }]) => html`
          <a key=${name} href=${path} aria-current=${name === view ? "page" : null}>${say(title)}</a>
        `)}
      </nav>
      <${Lost} drone=${drone} ofStation=${station?.audit_lost ?? 0} ofDrone=${shown().status?.link.dropped ?? 0} />
      ${!drone
        ? html`<section class="card empty"><h2>${say("No drone")}</h2>
            <p>${sayWith("This station was started without one: give {option}.", { option: html`<code>--drone NAME=HOST</code>` })}</p></section>`
        : view === "settings"
          ? html`<${SettingsView} key=${drone} drone=${drone} section=${route.rest.split("/")[1] ?? ""} />`
          : html`<${ChecksView} key=${drone} drone=${drone} station=${station?.versions} />`}
    </div>
  `;
}

// What was to be written down or told, and is gone.
function Lost({ drone, ofStation, ofDrone }) {
  return html`
    ${ofStation > 0 && html`<p class="obstacles">${say("{n} line of this station’s audit is lost: its disk is full, or too slow.|{n} lines of this station’s audit are lost: its disk is full, or too slow.", { n: ofStation })}</p>`}
    ${ofDrone > 0 && html`<p class="quiet">${say("{drone} has lost {n} answer, event or line of its audit: a queue or its disk was full.|{drone} has lost {n} answers, events or lines of its audit: a queue or its disk was full.", { drone, n: ofDrone })}</p>`}
  `;
}

function ChecksView({ drone, station }) {
  const [known, setKnown] = useState({ report: null, trouble: "", looking: true });
  const session = shown().welcome?.session ?? "";
  const look = async () => {
    setKnown((before) => ({ ...before, looking: true }));
    try {
      const report = await askDrone(drone, "report");
      setKnown({ report, trouble: "", looking: false });
    } catch (error) {
      if (error.name !== "AbortError") setKnown((before) => ({ ...before, trouble: error.message, looking: false }));
    }
  };
  useEffect(() => {
    look();
  }, [drone, session]);
  return html`
    <div class="doctor-checks">
      <${ChecksCard} drone=${drone} known=${known} look=${look} take=${(report) => setKnown({ report, trouble: "", looking: false })} />
      <div class="doctor-side">
        <${VersionsCard} drone=${drone} versions=${known.report?.versions} station=${station} />
        <${LogCard} lines=${known.report?.log} />
      </div>
    </div>
  `;
}
