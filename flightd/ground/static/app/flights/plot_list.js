// What is plotted: which curves stand in which plot, in which unit.
import { english } from "../language.js";

const DEGREES = 180 / Math.PI;

// `least`: the smallest range of values that is shown, so that noise does not fill a plot; `zero`: it holds 0.
export const PLOTS = [
  {
    key: "height", name: english("Height"), unit: "m", digits: 2, least: 1, zero: true,
    curves: [
      { key: "height_m", name: english("measured"), role: "own" },
      { key: "height_goal_m", name: english("goal"), role: "goal" },
      { key: "true_height_m", name: english("true"), role: "truth" },
    ],
  },
  { key: "speed", name: english("Speed"), unit: "m/s", digits: 2, least: 0.5, zero: true, curves: [{ key: "speed_mps", name: english("estimated"), role: "own" }] },
  {
    key: "cross", name: english("Beside the line"), unit: "cm", scale: 100, digits: 1, least: 12, zero: true,
    curves: [
      { key: "cross_track_m", name: english("estimated"), role: "own" },
      { key: "true_cross_track_m", name: english("true"), role: "truth" },
    ],
  },
  {
    key: "hover", name: english("Beside the node"), unit: "cm", scale: 100, digits: 1, least: 8, zero: true,
    curves: [
      { key: "hover_error_m", name: english("estimated"), role: "own" },
      { key: "true_hover_error_m", name: english("true"), role: "truth" },
    ],
  },
  {
    key: "tilt", name: english("Tilt"), unit: "°", scale: DEGREES, digits: 1, least: 6, zero: true,
    curves: [
      { key: "tilt_rad", name: english("measured"), role: "own" },
      { key: "tilt_goal_rad", name: english("setpoint"), role: "goal" },
    ],
  },
  { key: "latency", name: english("Picture to setpoint"), unit: "ms", scale: 1000, digits: 0, least: 40, zero: true, curves: [{ key: "latency_s", name: english("latency"), role: "own" }] },
  { key: "battery", name: english("Battery"), unit: "%", scale: 100, digits: 0, least: 10, curves: [{ key: "battery_frac", name: english("charge"), role: "own" }] },
];

// The lowest and highest value that a plot shows.
export function valueRange({ least, zero }, low, high) {
  if (low == null || high == null) return [0, least];
  let [from, to] = zero ? [Math.min(low, 0), Math.max(high, 0)] : [low, high];
  const missing = Math.max(least - (to - from), 0);
  if (zero && from === 0) to += missing;
  else [from, to] = [from - missing / 2, to + missing / 2];
  const margin = 0.05 * (to - from);
  return [zero && from === 0 ? 0 : from - margin, to + margin];
}

// The stretch of time that is shown around `at`: all of [low, high], or `span` seconds of it that move in steps.
export function shownSpan(at, span, low, high) {
  if (!span || span >= high - low) return [low, high];
  const step = span / 4;
  const begin = Math.floor((at - low) / step) * step + low - span / 2 + step / 2;
  const from = Math.min(Math.max(begin, low), high - span);
  return [from, from + span];
}
