// The slider over the whole flight, with its phases and what went wrong; play, pause, speed.
import { html } from "../html.js";
import { capital, phaseWords } from "../words.js";
import { fineClock } from "./figures.js";
import { flightsState } from "./flights_state.js";
import { seek, setPlaying, SPEEDS, turnRunning } from "./playing.js";
import { toneOf } from "./tones.js";

const SPANS = [[0, "whole flight"], [120, "2 min"], [30, "30 s"], [10, "10 s"]];

// `lanes` are [{name, spans, marks}]: one for each flight; `span` is {low, high}; `says` what is at the time.
export function Playhead({ span, lanes, says }) {
  const { at, running, speed, span: zoom } = flightsState().playing;
  return html`
    <section class="card playhead" aria-label="Playback">
      <div class="lanes">
        ${lanes.map((lane) => html`<${Lane} key=${lane.name} lane=${lane} span=${span} />`)}
        <input
          type="range" class="time" min=${span.low} max=${span.high} step="0.01" value=${at}
          aria-label="Time" aria-valuetext=${`${fineClock(at)}, ${says}`}
          onInput=${(event) => seek(Number(event.target.value), span)}
        />
      </div>
      <div class="controls">
        <button class="order play" onClick=${() => turnRunning(span)}>${running ? "Pause" : "Play"} <kbd>Space</kbd></button>
        <span class="now">${fineClock(at)} <span class="quiet">of ${fineClock(span.high)}</span></span>
        <label><span class="word">Speed</span>
          <select value=${speed} onChange=${(event) => setPlaying({ speed: Number(event.target.value) })}>
            ${SPEEDS.map((one) => html`<option key=${one} value=${one}>${one} ×</option>`)}
          </select>
        </label>
        <label class="zoom">Plots show
          <select value=${zoom} onChange=${(event) => setPlaying({ span: Number(event.target.value) })}>
            ${SPANS.map(([length, name]) => html`<option key=${length} value=${length}>${name}</option>`)}
          </select>
        </label>
        <details class="keys">
          <summary>Keys</summary>
          <dl>
            <div><dt><kbd>Space</kbd></dt><dd>play, pause</dd></div>
            <div><dt><kbd>←</kbd> <kbd>→</kbd></dt><dd>a second, with <kbd>Shift</kbd> ten</dd></div>
            <div><dt><kbd>,</kbd> <kbd>.</kbd></dt><dd>picture before, after</dd></div>
            <div><dt><kbd>+</kbd> <kbd>-</kbd></dt><dd>faster, slower</dd></div>
            <div><dt><kbd>Home</kbd> <kbd>End</kbd></dt><dd>start, end</dd></div>
          </dl>
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
          <i key=${`${mark.t_s} ${mark.text}`} class=${`alarm-mark ${mark.level}`} title=${capital(mark.text)} style=${{ left: share(mark.t_s) }} />
        `,
      )}
    </div>
  `;
}
