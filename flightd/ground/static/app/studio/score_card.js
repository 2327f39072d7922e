// Learn from the set, see the new profile beside those that fly, install it; one that is worse asks twice.
import { mayChange, mayOperate, signedInName } from "../access/session.js";
import { flightsState, watchList } from "../flights/flights_state.js";
import { html, useEffect, useState } from "../html.js";
import { decimal, english, quoted, say } from "../language.js";
import { setWho, who } from "../stock/decisions.js";
import { capital } from "../words.js";
import { flightWords, sitesOf, siteWords, wholeFlights } from "./flight_choice.js";
import { asked, change, choosePicture, reloadSet, setPath, studio, told, watchTraining } from "./studio_state.js";

const LEAST_SHOWING = 7;
const MOST_LOGS = 8;

export function ScoreCard({ shows }) {
  const { set, overview } = studio();
  const running = set.training?.running;
  const { rows, looked, unread } = flightsState().list;
  useEffect(watchList, []);
  const [site, setSite] = useState(null); // null: of the flight that the set's newest picture is from
  const [dropped, setDropped] = useState({}); // by flight: true, not scored on; false, scored on
  const whole = wholeFlights(rows);
  const at = site ?? (whole.find(({ id }) => id === flightOf(set)) ?? whole[0])?.site;
  const here = whole.filter((row) => row.site === at);
  const flights = scoredOn(here, dropped);
  const train = () =>
    told(async () => {
      await asked(setPath("/train"), "POST", { flights });
      change({ set: { ...studio().set, training: { running: true, refused: "" } } });
      watchTraining();
    });
  return html`
    <section class="card score" aria-labelledby="score"><h3 id="score">${say("Learn and compare")}</h3>
      ${overview.missing
        ? html`<p class="obstacles"><strong>${say("Nothing can be learnt yet.")}</strong> ${quoted(overview.missing, capital)}</p>`
        : html`<p class="quiet">${shows < LEAST_SHOWING ? say("Mark paint and floor in {n} more picture.|Mark paint and floor in {n} more pictures.", { n: LEAST_SHOWING - shows }) : say("Every fourth picture is held back from learning, and scored on.")} ${logWords(looked && !unread, flights.length, here.length)}</p>`}
      ${!overview.missing && here.length > 0 && html`
        <details class="flights-to-score"><summary>${say("Flights to score on")}</summary>
          <label class="field">${say("Site")}
            <select value=${at} onChange=${(event) => setSite(event.target.value)}>
              ${sitesOf(whole).map((one) => html`<option key=${one} value=${one}>${siteWords(one)}</option>`)}
            </select>
          </label>
          <ul>${here.map((row) => html`
            <li key=${row.id}><label><input type="checkbox" checked=${flights.includes(row.id)} disabled=${!flights.includes(row.id) && flights.length >= MOST_LOGS}
              onChange=${(event) => setDropped({ ...dropped, [row.id]: !event.target.checked })} /> ${flightWords(row)}</label></li>`)}</ul>
        </details>`}
      ${mayOperate() && html`<button class="order main-order" disabled=${running || !looked || shows < LEAST_SHOWING || overview.missing} onClick=${train}>${running ? say("Learning …") : say("Learn from the marks")}</button>`}
      ${running && html`<p class="quiet" role="status">${say("Learning and scoring: up to some minutes. You may leave the page.")}</p>`}
      ${set.training?.refused && html`<p class="refusal" role="alert">${quoted(set.training.refused, capital)}</p>`}
      ${set.outcome && !running && html`<${Outcome} key=${set.outcome.training_hash} outcome=${set.outcome} />`}
    </section>
  `;
}

// The newest that nobody has taken out, and those that somebody has put in.
function scoredOn(here, dropped) {
  const put = here.filter(({ id }) => dropped[id] === false);
  const newest = here.slice(0, MOST_LOGS).filter(({ id }) => dropped[id] === undefined);
  return [...put, ...newest].slice(0, MOST_LOGS).map(({ id }) => id);
}

// A picture says from where it was taken: of a flight, by its id and the place in it.
const flightOf = ({ pictures }) => pictures.map(({ tags }) => (tags?.[0] ?? "").split(" ")[0]).findLast(Boolean);

function logWords(known, many, all) {
  if (many) return say("Also scored on {n} flight log of one site.|Also scored on {n} flight logs of one site.", { n: many });
  if (all) return say("Scored on no flight log: none is chosen.");
  return known ? say("Also scored on no flight log: none lies in the folder.") : say("Looking for flight logs …");
}

const WORDS = {
  better: ["good", english("Better than what flies now")],
  same: ["open", english("No different from what flies now")],
  worse: ["bad", english("Worse than what flies now")],
  alone: ["open", english("There is none to compare with")],
};

function Outcome({ outcome }) {
  const [tone, words] = WORDS[outcome.verdict.judged];
  return html`
    <p class=${`judged ${tone}`} role="status">${say(words)}</p>
    ${outcome.verdict.reasons.length > 0 && html`<ul class="reasons">${outcome.verdict.reasons.map((reason) => html`<li key=${reason}>${quoted(reason, capital)}</li>`)}</ul>`}
    <${Scores} scores=${outcome.scores} />
    ${outcome.doubtful.length > 0 && html`<${Doubtful} files=${outcome.doubtful} />`}
    <p class="quiet">${say("Learnt from {n} pictures, scored on {others} others.", { n: outcome.trained_on, others: outcome.held_back.length })}</p>
    ${mayChange() ? html`<${Install} outcome=${outcome} />` : html`<p class="quiet">${say("An admin installs it.")}</p>`}
  `;
}

// Most often a stroke of floor that runs over paint: one such picture spoils what all of them teach.
function Doubtful({ files }) {
  const { pictures } = studio().set;
  const shown = files.map((file) => [file, pictures.findIndex((picture) => picture.file === file) + 1]).filter(([, number]) => number);
  return html`
    <div class="obstacles"><p>${say("Marks that the other pictures contradict: does floor run over paint, or paint beside it?")}</p>
      <div class="tools">${shown.map(([file, number]) => html`<button key=${file} class="order" onClick=${() => choosePicture(file)}>${say("Picture {number}", { number })}</button>`)}</div></div>
  `;
}

const FIGURES = [
  [english("Marked paint seen"), ({ pictures: p }) => share(p.paint_kept, p.paint)],
  [english("Marked floor left out"), ({ pictures: p }) => share(p.floor_refused, p.floor)],
  [english("Labelled lines found"), ({ pictures: p }) => of(p.lines_found, p.lines)],
  [english("Found lines that are labelled"), ({ pictures: p }) => of(p.lines_right, p.lines_judged)],
  [english("Lines of the logs found again"), ({ logs }) => of(logs.again, logs.lines)],
  [english("Other lines in the logs"), ({ logs }) => (logs.pictures ? String(logs.new) : "–")],
];
const share = (part, all) => (all ? `${decimal((100 * part) / all, 1)} %` : "–");
const of = (part, all) => (all ? say("{value} of {all}", { value: part, all }) : "–");

function Scores({ scores }) {
  return html`
    <div class="table-scroll" tabindex="0" role="group" aria-label=${say("Scores")}>
      <table>
        <thead><tr><td></td>${scores.map(({ name }) => html`<th key=${name} scope="col">${say(name)}</th>`)}</tr></thead>
        <tbody>${FIGURES.map(([name, told_]) => html`<tr key=${name}><th scope="row">${say(name)}</th>${scores.map((one) => html`<td key=${one.name}>${told_(one)}</td>`)}</tr>`)}</tbody>
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
    if (!by) return setSaid(english("Say who you are first."));
    if (!signedInName()) setWho(by);
    if (isWorse && !again) return setAsks(true);
    const order = { training_hash: outcome.training_hash, who: by, again };
    const went = await told(async () => {
      const profile = await asked(setPath("/install"), "POST", order);
      setSaid(english("Installed as version {number}.", { number: profile.current }));
      await reloadSet();
    });
    setAsks(false);
    if (!went) setSaid(english("Not installed."));
  };
  return html`
    <div class="install">
      ${!signedInName() && html`<label class="field">${say("Who")} <input value=${name} maxlength="60" autocomplete="name" onInput=${(event) => setName(event.target.value)} /></label>`}
      ${!asks && html`<button class="order" onClick=${() => install(false)}>${say("Install")}</button>`}
    </div>
    ${asks &&
    html`
      <div class="obstacles" role="alert"><p>${say("It is worse than what flies now. Install it all the same?")}</p>
        <div class="tools"><button class="order" onClick=${() => install(true)}>${say("Yes, install the worse one")}</button><button class="order" onClick=${() => setAsks(false)}>${say("No")}</button></div></div>
    `}
    <p class="quiet" role="status">${quoted(said)}</p>
  `;
}
