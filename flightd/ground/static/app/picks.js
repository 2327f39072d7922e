// What is chosen by pressing it, and the aisles of a floor: [aisle, ids of its nodes].
import { html } from "./html.js";

// `part`: some of what it stands for is chosen.
export function Chip({ on, part = false, onClick, children }) {
  const kind = part && !on ? "pick part" : "pick";
  return html`<button type="button" class=${kind} aria-pressed=${on} onClick=${onClick}>${children}</button>`;
}

export function aislesOf({ nodes }) {
  const found = new Map();
  for (const { id, aisle } of nodes) found.set(aisle, [...(found.get(aisle) ?? []), id]);
  found.delete("");
  return [...found];
}

// What is chosen once one of it is pressed.
export const toggled = (chosen, one) => (chosen.includes(one) ? chosen.filter((other) => other !== one) : [...chosen, one]);

// The same with some at once: all of them, or none where all are chosen already.
export function toggledAll(chosen, some) {
  const others = chosen.filter((one) => !some.includes(one));
  return some.every((one) => chosen.includes(one)) ? others : [...chosen, ...some.filter((one) => !chosen.includes(one))];
}
