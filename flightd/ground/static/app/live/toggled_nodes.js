// Nodes to choose several of, by mouse or keys: each a button, which stays pressed while it is chosen.
import { html } from "../html.js";
import { say } from "../language.js";
import { nextInDirection } from "./map_keys.js";
import { M } from "./map_marks.js";

// `entry` is the node to which Tab leads; `name` gives a node's words, where they are more than its id.
export function ToggledNodes({ floor, chosen, entry, onToggle, scale, name = (id) => say("Node {node}", { node: id }) }) {
  const onKey = (event, node) => {
    const next = nextInDirection(floor.nodes, node, event.key);
    if (next) document.getElementById(`choose-${next.id}`)?.focus();
    else if (event.key === "Enter" || event.key === " ") onToggle(node.id);
    else return;
    event.preventDefault();
  };
  return floor.nodes.map((node) => {
    const isChosen = chosen.includes(node.id);
    return html`
      <g
        key=${node.id}
        id=${`choose-${node.id}`}
        class=${isChosen ? "node picked" : "node"}
        transform=${`translate(${node.x_m * M} ${node.y_m * M}) scale(${scale})`}
        role="button"
        aria-pressed=${isChosen}
        aria-label=${name(node.id, isChosen)}
        tabindex=${node.id === entry ? 0 : -1}
        onClick=${() => onToggle(node.id)}
        onKeyDown=${(event) => onKey(event, node)}
      >
        <circle class="touch" r="32" /><circle class="mark" r=${isChosen ? 17 : 9} />
        <text x="14" y="36">${node.id}</text>
      </g>
    `;
  });
}
