// The daemon's newest log lines and events, newest first.
import { html } from "../html.js";
import { dateFormat, quoted, say } from "../language.js";

const LINE = /^(\S+)T(\S+)Z (\w+) (.*)$/s;
const CLOCK = dateFormat({ hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });

export function LogCard({ lines }) {
  return html`
    <section class="card log" aria-labelledby="log-title">
      <h2 id="log-title">${say("Log")}${lines?.length ? html` <small class="quiet">${say("newest {n} line|newest {n} lines", { n: lines.length })}</small>` : ""}</h2>
      ${!lines && html`<p class="quiet">${say("Shown once the drone has answered.")}</p>`}
      ${lines?.length === 0 && html`<p class="quiet">${say("Nothing was logged since flightd started.")}</p>`}
      ${lines?.length > 0 && html`
        <ol tabindex="0" aria-label=${say("Log lines, newest first")}>
          ${lines.toReversed().map((line, at) => html`<${Line} key=${lines.length - at} line=${line} />`)}
        </ol>`}
    </section>
  `;
}

function Line({ line }) {
  const [, day, hour, level, text] = LINE.exec(line) ?? [null, "", "", "info", line];
  const when = day && new Date(`${day}T${hour}Z`);
  return html`
    <li class=${level}>
      ${when && html`<time datetime=${when.toISOString()}>${CLOCK.format(when)}</time>`}
      ${level !== "info" && html`<b>${quoted(level)}</b>`} <span lang="en">${text}</span>
    </li>
  `;
}
