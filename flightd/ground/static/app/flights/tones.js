// Which colour stands for a phase, as in the flight's report.
import { english } from "../language.js";

export const TONES = {
  __proto__: null,
  preflight: "ground", arming: "ground", swap: "ground", done: "ground",
  take_off: "climb", climb: "climb", land: "climb",
  acquire: "seek", follow: "follow", hover: "hover", scan: "hover", turn: "turn",
  recover: "hold", hold: "hold", relocate: "hold", pilot: "hold", aborted: "bad",
};
const NAMES = {
  ground: english("on the ground"), climb: english("up and down"), seek: english("finding lines"), follow: english("flying"), hover: english("over a node"),
  turn: english("turning"), hold: english("holding"), bad: english("ended early"),
};

export const toneOf = (phase) => TONES[phase] ?? "ground";

// The tones of these phases with what each stands for.
export function toneLegend(spans) {
  const tones = new Set(spans.map(({ phase }) => toneOf(phase)));
  return Object.entries(NAMES).filter(([tone]) => tones.has(tone));
}
