// The course of time of a playback: runs, stands, jumps, by button and by key.
import { useEffect } from "../html.js";
import { hasSingleKeys } from "../single_keys.js";
import { flightsState, updateFlights } from "./flights_state.js";

export const SPEEDS = [0.25, 0.5, 1, 2, 5, 10, 25];
const STEP_S = 1;
const LONG_STEP_S = 10;
const SINGLE = /^[^ ]$/; // a character that one could speak or type

export function setPlaying(change) {
  updateFlights(({ playing }) => ({ playing: { ...playing, ...change } }));
}

// Go to a time between `low` and `high`.
export const seek = (at, { low, high }) => setPlaying({ at: Math.min(Math.max(at, low), high) });

export function turnRunning({ low, high }) {
  const { at, running } = flightsState().playing;
  setPlaying({ running: !running, ...(!running && at >= high - 0.05 && { at: low }) });
}

export function changeSpeed(by) {
  const now = SPEEDS.indexOf(flightsState().playing.speed);
  setPlaying({ speed: SPEEDS[Math.min(Math.max(now + by, 0), SPEEDS.length - 1)] });
}

// While it is shown: time runs, and keys work wherever nobody types.  `pictures` are their times.
export function usePlayback(span, pictures) {
  const { low, high } = span;
  const { running } = flightsState().playing;
  useEffect(() => {
    setPlaying({ at: low, running: false, span: 0 });
    return () => setPlaying({ running: false });
  }, [low, high]);
  useEffect(() => {
    if (!running) return undefined;
    let last = performance.now();
    let frame = requestAnimationFrame(function run(now) {
      const { at, speed, running: goesOn } = flightsState().playing;
      if (!goesOn) return; // a pause counts at once, not from the next effects on
      const next = at + ((now - last) / 1000) * speed;
      last = now;
      if (next >= high) setPlaying({ at: high, running: false });
      else {
        setPlaying({ at: next });
        frame = requestAnimationFrame(run);
      }
    });
    return () => cancelAnimationFrame(frame);
  }, [running, high]);
  useEffect(() => {
    const onKey = (event) => {
      if (!isFor(event) || !act(event, span, pictures)) return;
      event.preventDefault();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, [low, high, pictures]);
}

// Not while somebody types, chooses or presses a button; the slider is ours.
function isFor(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const control = event.target.closest?.("input, textarea, select, button, a, summary");
  if (isOfThePage(event)) return false;
  if (!control || control.matches("input[type=range]")) return true;
  return event.key !== " " && event.key !== "Enter" && !control.matches("input, textarea, select");
}

// Home and End of whoever reads a list or a table there are the browser's.
const isOfThePage = ({ key, target }) =>
  (key === "Home" || key === "End") && !target.matches?.("body, #main, input[type=range]");

function act(event, span, pictures) {
  const { at } = flightsState().playing;
  const step = event.shiftKey ? LONG_STEP_S : STEP_S;
  const acts = {
    " ": () => turnRunning(span),
    ArrowRight: () => seek(at + step, span),
    ArrowLeft: () => seek(at - step, span),
    Home: () => seek(span.low, span),
    End: () => seek(span.high, span),
    ".": () => seek(pictures.find((time) => time > at + 0.001) ?? at, span),
    ",": () => seek(pictures.findLast((time) => time < at - 0.001) ?? at, span),
    "+": () => changeSpeed(1),
    "-": () => changeSpeed(-1),
  };
  if (!acts[event.key] || (SINGLE.test(event.key) && !hasSingleKeys())) return false;
  acts[event.key]();
  return true;
}
