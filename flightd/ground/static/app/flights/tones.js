// Which colour stands for a phase, as in the flight's report.
export const TONES = {
  __proto__: null,
  preflight: "ground", arming: "ground", swap: "ground", done: "ground",
  take_off: "climb", climb: "climb", land: "climb",
  acquire: "seek", follow: "follow", hover: "hover", scan: "hover", turn: "turn",
  recover: "hold", hold: "hold", relocate: "hold", pilot: "hold", aborted: "bad",
};
const NAMES = {
  ground: "on the ground", climb: "up and down", seek: "finding lines", follow: "flying", hover: "over a node",
  turn: "turning", hold: "holding", bad: "ended early",
};

export const toneOf = (phase) => TONES[phase] ?? "ground";

// The tones of these phases with what each stands for.
export function toneLegend(spans) {
  const tones = new Set(spans.map(({ phase }) => toneOf(phase)));
  return Object.entries(NAMES).filter(([tone]) => tones.has(tone));
}
