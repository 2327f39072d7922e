// The arrow keys on the map: from node to node, the nearest that lies in the arrow's direction.

const DIRECTIONS = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] };
const ASIDE = 3; // what lies aside counts as so much farther

export function nextInDirection(nodes, from, key) {
  const direction = DIRECTIONS[key];
  if (!direction) return null;
  let best = null;
  for (const node of nodes) {
    const [dx, dy] = [node.x_m - from.x_m, node.y_m - from.y_m];
    const ahead = dx * direction[0] + dy * direction[1];
    const aside = Math.abs(dx * direction[1]) + Math.abs(dy * direction[0]);
    if (ahead <= 0.01 || aside > 2 * ahead) continue;
    const cost = ahead + ASIDE * aside;
    if (!best || cost < best.cost) best = { node, cost };
  }
  return best?.node ?? null;
}
