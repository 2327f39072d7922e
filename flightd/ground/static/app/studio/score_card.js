// Learn from the set, see the new profile beside those that fly, install it; one that is worse asks twice.
import { mayChange, mayOperate, signedInName } from "../access/session.js";
import { flightsState, watchList } from "../flights/flights_state.js";
import { html, useEffect, useState } from "../html.js";
import { setWho, who } from "../stock/decisions.js";
import { capital, count } from "../words.js";
import { asked, change, choosePicture, reloadSet, setPath, studio, told, watchTraining } from "./studio_state.js";

const LEAST_SHOWING = 7;
const MOST_LOGS = 8;

export function ScoreCard({ shows }) {
  const { set, overview } = studio();
  const running = set.training?.running;
  const { rows, looked, unread } = flightsState().list;
  useEffect(watchList, []);
  const flights = rows.filter((row) => !row.running && !row.trouble).slice(0, MOST_LOGS).map((row) => row.id);
  const train = () =>
    told(async () => {
      await asked(setPath("/train"), "POST", { flights });
      change({ set: { ...studio().set, training: { running: true, refused: "" } } });
      watchTraining();
    });
  return html`
    <section class="card score" aria-labelledby="score"><h3 id="score">Learn and compare</h3>
      ${overview.missing
        ? html`<p class="obstacles"><strong>Nothing can be learnt yet.</strong> ${capital(overview.missing)}</p>`
        : html`<p class="quiet">${shows < LEAST_SHOWING ? `Mark paint and floor in ${count(LEAST_SHOWING - shows, "more picture")}.` : "Every fourth picture is held back from learning, and scored on."} ${logWords(looked && !unread, flights.length)}</p>`}
      ${mayOperate() && html`<button class="order main-order" disabled=${running || !looked || shows < LEAST_SHOWING || overview.missing} onClick=${train}>${running ? "Learning …" : "Learn from the marks"}</button>`}
      ${running && html`<p class="quiet" role="status">Learning and scoring: up to some minutes. You may leave the page.</p>`}
      ${set.training?.refused && html`<p class="refusal" role="alert">${capital(set.training.refused)}</p>`}
      ${set.outcome && !running && html`<${Outcome} key=${set.outcome.training_hash} outcome=${set.outcome} />`}
    </section>
  `;
}

const logWords = (known, many) =>
  many || known ? `Also scored on ${many ? `the ${many === 1 ? "newest flight log" : `${many} newest flight logs`}` : "no flight log: none lies in the folder"}.` : "Looking for flight logs …";

const WORDS = {
  better: ["good", "Better than what flies now"],
  same: ["open", "No different from what flies now"],
  worse: ["bad", "Worse than what flies now"],
  alone: ["open", "There is none to compare with"],
};

function Outcome({ outcome }) {
  const [tone, words] = WORDS[outcome.verdict.judged];
  return html`
    <p class=${`judged ${tone}`} role="status">${words}</p>
    ${outcome.verdict.reasons.length > 0 && html`<ul class="reasons">${outcome.verdict.reasons.map((reason) => html`<li key=${reason}>${capital(reason)}</li>`)}</ul>`}
    <${Scores} scores=${outcome.scores} />
    ${outcome.doubtful.length > 0 && html`<${Doubtful} files=${outcome.doubtful} />`}
    <p class="quiet">Learnt from ${outcome.trained_on} pictures, scored on ${outcome.held_back.length} others.</p>
    ${mayChange() ? html`<${Install} outcome=${outcome} />` : html`<p class="quiet">An admin installs it.</p>`}
  `;
}

// Most often a stroke of floor that runs over paint: one such picture spoils what all of them teach.
function Doubtful({ files }) {
  const { pictures } = studio().set;
  const shown = files.map((file) => [file, pictures.findIndex((picture) => picture.file === file) + 1]).filter(([, number]) => number);
  return html`
    <div class="obstacles"><p>Marks that the other pictures contradict: does floor run over paint, or paint beside it?</p>
      <div class="tools">${shown.map(([file, number]) => html`<button key=${file} class="order" onClick=${() => choosePicture(file)}>Picture ${number}</button>`)}</div></div>
  `;
}

const FIGURES = [
  ["Marked paint seen", ({ pictures: p }) => share(p.paint_kept, p.paint)],
  ["Marked floor left out", ({ pictures: p }) => share(p.floor_refused, p.floor)],
  ["Labelled lines found", ({ pictures: p }) => of(p.lines_found, p.lines)],
  ["Found lines that are labelled", ({ pictures: p }) => of(p.lines_right, p.lines_judged)],
  ["Lines of the logs found again", ({ logs }) => of(logs.again, logs.lines)],
  ["Other lines in the logs", ({ logs }) => (logs.pictures ? String(logs.new) : "–")],
];
const share = (part, all) => (all ? `${((100 * part) / all).toFixed(1)} %` : "–");
const of = (part, all) => (all ? `${part} of ${all}` : "–");

function Scores({ scores }) {
  return html`
    <div class="table-scroll" tabindex="0" role="group" aria-label="Scores">
      <table>
        <thead><tr><td></td>${scores.map(({ name }) => html`<th key=${name} scope="col">${name}</th>`)}</tr></thead>
        <tbody>${FIGURES.map(([name, told_]) => html`<tr key=${name}><th scope="row">${name}</th>${scores.map((one) => html`<td key=${one.name}>${told_(one)}</td>`)}</tr>`)}</tbody>
      </table>
    </div>
  `;
}

function Install({ outcome }) {
  const [name, setName] = useState(who());
  const [asks, setAsks] = useState(false);
  const [said, setSaid] = useState("");
  const isWorse = outcome.verdict.judged === "worse";
  const install = async (again) => {
    const by = signedInName() || name.trim();
    if (!by) return setSaid("Say who you are first.");
    if (!signedInName()) setWho(by);
    if (isWorse && !again) return setAsks(true);
    const order = { training_hash: outcome.training_hash, who: by, again };
    const went = await told(async () => {
      const profile = await asked(setPath("/install"), "POST", order);
      setSaid(`Installed as version ${profile.current}.`);
      await reloadSet();
    });
    setAsks(false);
    if (!went) setSaid("Not installed.");
  };
  return html`
    <div class="install">
      ${!signedInName() && html`<label class="field">Who <input value=${name} maxlength="60" autocomplete="name" onInput=${(event) => setName(event.target.value)} /></label>`}
      ${!asks && html`<button class="order" onClick=${() => install(false)}>Install</button>`}
    </div>
    ${asks &&
    html`
      <div class="obstacles" role="alert"><p>It is worse than what flies now. Install it all the same?</p>
        <div class="tools"><button class="order" onClick=${() => install(true)}>Yes, install the worse one</button><button class="order" onClick=${() => setAsks(false)}>No</button></div></div>
    `}
    <p class="quiet" role="status">${said}</p>
  `;
}
