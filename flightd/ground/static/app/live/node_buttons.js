// The nodes of a map to press, by mouse or keys: each stays pressed while it is chosen.
import { html } from "../html.js";
import { say } from "../language.js";
import { nextInDirection } from "./map_keys.js";
import { nodeClass, NodeMark, nodeTransform } from "./map_marks.js";

const PICKED = 17; // as large as a number within it

// `chosen` are ids; Tab leads to `entry`, the arrow keys on from there (`onMove`); `picks`: several may be chosen.
export function NodeButtons({ floor, chosen, entry, onPress, onMove, scale, picks = false, visited = new Set(), goal = "", name = nodeName }) {
  const onKey = (event, node) => {
    const next = nextInDirection(floor.nodes, node, event.key);
    if (next) {
      onMove?.(next.id);
      document.getElementById(`node-${next.id}`)?.focus();
    } else if (event.key === "Enter" || event.key === " ") onPress(node.id);
    else return;
    event.preventDefault();
  };
  return floor.nodes.map((node) => {
    const isChosen = chosen.includes(node.id);
    return html`
      <g
        key=${node.id}
        id=${`node-${node.id}`}
        class=${picks ? (isChosen ? "node picked" : "node") : nodeClass(node.id, isChosen, visited, goal)}
        transform=${nodeTransform(node, scale)}
        role="button"
        aria-pressed=${isChosen}
        aria-label=${name(node.id, isChosen)}
        tabindex=${node.id === entry ? 0 : -1}
        onClick=${() => onPress(node.id)}
        onKeyDown=${(event) => onKey(event, node)}
      >
        <circle class="touch" r="32" /><${NodeMark} id=${node.id} r=${picks && isChosen ? PICKED : 9} />
      </g>
    `;
  });
}

const nodeName = (node) => say("Node {node}", { node });
