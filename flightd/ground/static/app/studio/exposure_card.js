// How a camera exposes: its newest picture, what was set and read back, what the doctor says, and the keys to change.
import { unlessBusy } from "../busy.js";
import { askDrone } from "../doctor/asking.js";
import { ChangesBar } from "../doctor/changes_bar.js";
import { CheckRow, worstFirst } from "../doctor/checks_card.js";
import { SettingField } from "../doctor/setting_field.js";
import { nameOf, withChange } from "../doctor/settings_keys.js";
import { forReader, useComplaint } from "../doctor/settings_view.js";
import { html, useEffect, useState } from "../html.js";
import { decimal, english, plain, quoted, say, sayWith } from "../language.js";
import { shown, state } from "../store.js";
import { ExposurePicture } from "./exposure_picture.js";

const CHECKS = { down: ["exposure", "brightness", "flicker", "blur"], front: ["front exposure"] };
const KEYS = ["exposure_s", "manual_exposure", "gain", "anti_flicker_hz"];
const NAMES = { down: english("Down camera"), front: english("Front camera") };

export function ExposureCard() {
  const drone = state.selected;
  return html`
    <section class="card exposure" aria-labelledby="exposure"><h3 id="exposure">${say("Camera exposure")}</h3>
      ${drone
        ? html`<${OfDrone} key=${drone} drone=${drone} />`
        : html`<p class="quiet">${sayWith("This station was started without a drone: give {option}.", { option: html`<code>--drone NAME=HOST</code>` })}</p>`}
    </section>
  `;
}

function OfDrone({ drone }) {
  const [known, setKnown] = useState({ report: null, settings: null, trouble: "", looking: true });
  const [camera, setCamera] = useState("down");
  const session = shown().welcome?.session ?? "";
  const look = async () => {
    setKnown((before) => ({ ...before, looking: true }));
    try {
      const [report, settings] = await Promise.all([askDrone(drone, "report"), askDrone(drone, "settings")]);
      setKnown({ report, settings, trouble: "", looking: false });
    } catch (error) {
      if (error.name !== "AbortError") setKnown((before) => ({ ...before, trouble: error.message, looking: false }));
    }
  };
  useEffect(() => {
    look();
  }, [session]);
  const { report, settings, trouble, looking } = known;
  const told = report?.exposures?.find((one) => one.camera === camera);
  const take = (now) => setKnown((before) => ({ ...before, settings: now }));
  return html`
    <div class="exposure-head">
      <p class="quiet">${say("By hand and short: 5 ms at most, so that lines and labels do not smear. {drone} is asked while it stands on the ground.", { drone })}</p>
      <div class="tools">
        ${report?.exposures?.length > 1 && report.exposures.map(({ camera: name }) => html`
          <button key=${name} class="tab" aria-pressed=${name === camera} onClick=${() => setCamera(name)}>${say(NAMES[name])}</button>`)}
        <button class="order" ...${unlessBusy(looking, look)}>${looking ? say("Looking …") : say("Look again")}</button>
      </div>
    </div>
    ${trouble && html`<p class="obstacles" role="alert">${quoted(trouble)}</p>`}
    <div class="exposure-grid">
      <${ExposurePicture} drone=${drone} camera=${camera} />
      <div class="exposure-side">
        ${told && html`<${ReadBack} told=${told} />`}
        ${report && html`<ul class="check-list" aria-label=${say("What the doctor says")}>
          ${worstFirst(report.checks.filter(({ name }) => CHECKS[camera].includes(name))).map((check) => html`<${CheckRow} key=${check.name} check=${check} />`)}
        </ul>`}
        ${!report && looking && html`<p class="quiet" role="status">${say("Asking the drone …")}</p>`}
      </div>
      ${told && settings && html`<${Change} key=${`${camera} ${session}`} drone=${drone} told=${told} settings=${settings} take=${take} />`}
    </div>
  `;
}

function ReadBack({ told }) {
  const [left, untold] = [say("left to the camera"), say("not told")];
  const rows = [
    [say("Exposure"), time(told.set_exposure_s, left), time(told.exposure_s, untold)],
    [say("Automatic"), told.set_exposure_s === null ? left : say("off"), told.manual === null ? untold : told.manual ? say("off") : say("on")],
    [say("Gain"), figure(told.set_gain, left), figure(told.gain, untold)],
    [say("Anti-flicker"), mains(told.set_anti_flicker_hz || null, left), mains(told.anti_flicker_hz, untold)],
  ];
  return html`
    <table>
      <thead><tr><td></td><th scope="col">${say("Set")}</th><th scope="col">${say("Read back")}</th></tr></thead>
      <tbody>${rows.map(([name, set, found]) => html`<tr key=${name}><th scope="row">${name}</th><td>${set}</td><td>${found}</td></tr>`)}</tbody>
    </table>
    ${told.camera === "down" && html`<p>${told.blur_px === null
      ? say("How far the floor smears in flight is not known: the camera does not tell its exposure.")
      : sayWith("In flight the floor smears by {blur} in a picture.", { blur: html`<b>${`${decimal(told.blur_px, 1)} px`}</b>` })}</p>`}
  `;
}

const time = (seconds, none) => (seconds === null ? none : `${plain(Number((seconds * 1000).toPrecision(3)))} ms`);

const figure = (value, none) => (value === null ? none : plain(value));

const mains = (hz, none) => (hz === null ? none : hz ? `${hz} Hz` : say("off"));

function Change({ drone, told, settings, take }) {
  const [changes, setChanges] = useState({});
  const known = forReader(settings);
  const complaint = useComplaint(drone, known, changes);
  if (told.refused) return html`<div class="exposure-change"><p class="quiet">${sayWith("Nothing to set here: {reason}.", { reason: quoted(told.refused) })}</p></div>`;
  const keys = known.keys.filter((key) => key.section === told.section && KEYS.includes(key.key));
  const change = (name, value) => setChanges((before) => withChange(before, name, value));
  const sent = (now) => {
    setChanges({});
    take(now);
  };
  return html`
    <div class="exposure-change">
      <div>
        ${known.locked && html`<p class="quiet">${sayWith("Only to look at: {why}.", { why: quoted(known.locked) })}</p>`}
        ${keys.map((key) => {
          const name = nameOf(key);
          return html`<${SettingField} key=${name} about=${key} table=${known.table} change=${changes[name]} onChange=${change}
            complaint=${complaint.startsWith(`${name}:`) ? complaint : ""} locked=${known.locked} />`;
        })}
      </div>
      <${ChangesBar} drone=${drone} told=${known} changes=${changes} complaint=${complaint} onTake=${sent}
        onDrop=${() => setChanges({})} onUndo=${(name) => change(name, undefined)} />
    </div>
  `;
}
