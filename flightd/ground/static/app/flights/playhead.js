// The slider over the whole flight, with its phases and what went wrong; play, pause, speed.
import { html } from "../html.js";
import { english, plain, quotedText, say, sayWith } from "../language.js";
import { capital, phaseWords } from "../words.js";
import { fineClock } from "./figures.js";
import { flightsState } from "./flights_state.js";
import { seek, setPlaying, SPEEDS, turnRunning } from "./playing.js";
import { SingleKeys } from "../single_keys.js";
import { toneOf } from "./tones.js";

const SPANS = [[0, english("whole flight")], [120, "2 min"], [30, "30 s"], [10, "10 s"]];

// `lanes` are [{name, spans, marks}]: one for each flight; `span` is {low, high}; `says` what is at the time.
export function Playhead({ span, lanes, says }) {
  const { at, running, speed, span: zoom } = flightsState().playing;
  return html`
    <section class="card playhead" aria-label=${say("Playback")}>
      <div class="lanes">
        ${lanes.map((lane) => html`<${Lane} key=${lane.name} lane=${lane} span=${span} />`)}
        <input
          type="range" class="time" min=${span.low} max=${span.high} step="0.01" value=${at}
          aria-label=${say("Time")} aria-valuetext=${`${fineClock(at)}, ${says}`}
          onInput=${(event) => seek(Number(event.target.value), span)}
        />
      </div>
      <div class="controls">
        <button class="order play" onClick=${() => turnRunning(span)}>${running ? say("Pause") : say("Play")} <kbd>${say("Space")}</kbd></button>
        <span class="now">${fineClock(at)} <span class="quiet">${say("of {end}", { end: fineClock(span.high) })}</span></span>
        <label><span class="word">${say("Speed")}</span>
          <select value=${speed} onChange=${(event) => setPlaying({ speed: Number(event.target.value) })}>
            ${SPEEDS.map((one) => html`<option key=${one} value=${one}>${plain(one)} ×</option>`)}
          </select>
        </label>
        <label class="zoom">${say("Plots show")}
          <select value=${zoom} onChange=${(event) => setPlaying({ span: Number(event.target.value) })}>
            ${SPANS.map(([length, name]) => html`<option key=${length} value=${length}>${say(name)}</option>`)}
          </select>
        </label>
        <details class="keys">
          <summary>${say("Keys")}</summary>
          <dl>
            <div><dt><kbd>${say("Space")}</kbd></dt><dd>${say("play, pause")}</dd></div>
            <div><dt><kbd>←</kbd> <kbd>→</kbd></dt><dd>${sayWith("a second, with {shift} ten", { shift: html`<kbd>${say("Shift")}</kbd>` })}</dd></div>
            <div><dt><kbd>,</kbd> <kbd>.</kbd></dt><dd>${say("picture before, after")}</dd></div>
            <div><dt><kbd>+</kbd> <kbd>-</kbd></dt><dd>${say("faster, slower")}</dd></div>
            <div><dt><kbd>${say("Home")}</kbd> <kbd>${say("End")}</kbd></dt><dd>${say("start, end")}</dd></div>
          </dl>
          <${SingleKeys} />
        </details>
      </div>
    </section>
  `;
}

function Lane({ lane, span }) {
  const length = span.high - span.low;
  const share = (time) => `${(100 * (Math.min(Math.max(time, span.low), span.high) - span.low)) / length}%`;
  const width = (from, to) => `${(100 * Math.max(Math.min(to, span.high) - Math.max(from, span.low), 0)) / length}%`;
  return html`
    <div class="lane" aria-hidden="true">
      ${lane.spans.map(
        (one) => html`
          <span
            key=${one.from} class=${`band tone-${toneOf(one.phase)}`} title=${phaseWords(one)}
            style=${{ left: share(one.from), width: width(one.from, one.to) }}
          />
        `,
      )}
      ${lane.marks.map(
        (mark) => html`
          <i key=${`${mark.t_s} ${mark.text}`} class=${`alarm-mark ${mark.level}`} title=${capital(quotedText(mark.text))} style=${{ left: share(mark.t_s) }} />
        `,
      )}
    </div>
  `;
}
