// An installed profile on its way to the drone that is chosen: what that one flies by, sending, starting anew.
import { mayChange, signedInName } from "../access/session.js";
import { unlessBusy } from "../busy.js";
import { askDrone, sendDrone } from "../doctor/asking.js";
import { forReader } from "../doctor/settings_view.js";
import { html, useEffect, useState } from "../html.js";
import { english, quoted, say, sayWith } from "../language.js";
import { setWho, who } from "../stock/decisions.js";
import { shown, state } from "../store.js";

export function ToDrone({ profile }) {
  const [open, setOpen] = useState(false);
  const drone = state.selected;
  if (!drone || profile.current === null) return null;
  return html`
    <div class="to-drone">
      <button class="order" aria-expanded=${open} onClick=${() => setOpen(!open)}>${say("To the drone {drone}", { drone })}</button>
      ${open && html`<${Sending} key=${drone} drone=${drone} profile=${profile} />`}
    </div>
  `;
}

function Sending({ drone, profile }) {
  const [settings, setSettings] = useState(null);
  const [person, setPerson] = useState(who());
  const [outcome, setOutcome] = useState({ text: "", good: true });
  const [busy, setBusy] = useState(true);
  const session = shown().welcome?.session ?? "";
  const tried = async (work, { meanwhile = "", done = "" }) => {
    setBusy(true);
    setOutcome({ text: meanwhile, good: true });
    try {
      await work();
      setOutcome({ text: done, good: true });
    } catch (error) {
      if (error.name !== "AbortError") setOutcome({ text: error.message, good: false });
    } finally {
      setBusy(false);
    }
  };
  useEffect(() => {
    tried(async () => setSettings(await askDrone(drone, "settings")), { meanwhile: english("Asking the drone …") });
  }, [session]);
  const asPerson = (what, body, words) => {
    const acts = signedInName() || person.trim();
    if (!acts) return setOutcome({ text: english("Say who you are first."), good: false });
    if (!signedInName()) setWho(acts);
    return tried(async () => {
      const answer = await sendDrone(drone, what, { ...body, person: acts });
      if (answer.table) setSettings(answer);
    }, words);
  };
  const known = settings && forReader(settings);
  const version = profile.versions.find((one) => one.number === profile.current);
  const flown = known?.table.vision?.profile;
  const isThere = versionOf(profile, flown) === version;
  const send = () =>
    asPerson("profile", { base: known.tag, profile: profile.name, file_hash: version.file_hash }, {
      meanwhile: english("The drone checks it with its settings …"),
      done: english("The drone has it, and flies by it from flightd's next start."),
    });
  const restart = () => asPerson("restart", {}, { meanwhile: english("Asking …"), done: english("flightd starts anew: a few seconds.") });
  return html`
    ${known && html`<p>${flightWords(drone, profile, flown)}</p>`}
    ${known?.locked && html`<p class="quiet">${sayWith("Only to look at: {why}.", { why: quoted(known.locked) })}</p>`}
    ${known && !known.locked && html`
      ${!signedInName() && (!isThere || known.pending) && html`
        <label class="field">${say("Who")} <input value=${person} maxlength="60" autocomplete="name" onInput=${(event) => setPerson(event.target.value)} /></label>`}
      <div class="tools">
        ${!isThere && html`<button class="order main-order" ...${unlessBusy(busy, send)}>${say("Send version {number} to {drone}", { number: version.number, drone })}</button>`}
        ${known.pending && known.restarts && html`<button class="order" ...${unlessBusy(busy, restart)}>${say("Start flightd anew")}</button>`}
      </div>
      ${known.pending && html`<p>${say("flightd still runs by older settings: it takes these at its next start.")}</p>`}
      <p class="quiet">${sayWith("Taken back as all settings are: on the page {page}.", { page: html`<a href="/doctor/settings">${say("Doctor")}</a>` })}</p>
    `}
    <p class=${outcome.good ? "quiet" : "refusal"} role="status">${quoted(outcome.text)}</p>
  `;
}

// The version that a drone has under this name: the newest of those that are alike.
const versionOf = ({ versions, sent_as: sentAs }, file) => (file ? versions[sentAs.lastIndexOf(file)] : undefined);

function flightWords(drone, profile, flown) {
  if (!flown) return say("{drone} is set to the shipped profile of its floor's paint.", { drone });
  const version = versionOf(profile, flown);
  if (version) return say("{drone} is set to version {number}.", { drone, number: version.number });
  return sayWith("{drone} is set to {file}.", { drone, file: html`<code>${flown}</code>` });
}
