// The live map: the site to scale, and on it the drone, how sure it is of its place, the lines that it sees, where it
// was and flies next.
import { html, useMemo } from "../html.js";
import { english, say } from "../language.js";
import { shown, state, update } from "../store.js";
import { around, Drone, Legend, M, markScale, Seen, Track, Way } from "./map_marks.js";
import { NodeButtons } from "./node_buttons.js";
import { Floor, bounds } from "./site_plan.js";

const MARKS = [
  ["leg", english("next leg")],
  ["way", english("way after it")],
  ["track", english("track")],
  ["seen", english("lines seen")],
  ["visited", english("visited")],
  ["keep", english("keep out")],
];
const SEEN_M = 1; // of a line that is seen, to both sides of the drone
const SEEN_S = 1; // and no longer ago

export function FloorMap({ floor }) {
  const box = useMemo(() => bounds(floor), [floor]);
  const plan = useMemo(() => html`<${Floor} floor=${floor} box=${box} />`, [floor]);
  const nodes = useMemo(() => new Map(floor.nodes.map((node) => [node.id, node])), [floor]);
  const { status, track, visited } = shown();
  const position = status?.position;
  const view = state.followed ? around(position ?? nodes.get(floor.home)) : box;
  const scale = markScale(view);
  const way = (status?.way ?? []).map((id) => nodes.get(id)).filter(Boolean);
  const choose = (id) =>
    update((s) => {
      s.chosenNode = id;
    });
  return html`
    <section class="card map" aria-labelledby="map">
      <h2 id="map" class="unseen">${say("Map")}</h2>
      <svg
        viewBox=${view.map((value) => value * M).join(" ")}
        role="group"
        aria-label=${say("Map of {site}", { site: floor.name })}
        style=${{ "--scale": scale }}
      >
        ${plan}
        <${Seen} lines=${seenLines(status)} />
        <${Way} from=${position} way=${way} />
        <${Track} points=${track} />
        <${NodeButtons}
          floor=${floor} visited=${visited} goal=${status?.goal} chosen=${[state.chosenNode]} entry=${state.chosenNode || floor.home}
          onPress=${choose} onMove=${choose} scale=${scale}
          name=${(node) => say(visited.has(node) ? english("Node {node}, visited") : english("Node {node}"), { node })}
        />
        ${position && html`<${Drone} position=${position} scale=${scale} />`}
      </svg>
      <div class="map-foot">
        <${Legend} marks=${MARKS} />
        <${Follow} />
      </div>
    </section>
  `;
}

// Where on the map the lines lie that the drone sees now: it tells how far each is from itself.
function seenLines(status) {
  if (!status?.position || status.lines_age_s === null || status.lines_age_s > SEEN_S) return [];
  const { x_m: x, y_m: y } = status.position;
  return status.lines.map(({ runs, offset_m: offset }) =>
    runs === "along" ? [x - SEEN_M, y + offset, x + SEEN_M, y + offset] : [x + offset, y - SEEN_M, x + offset, y + SEEN_M],
  );
}

function Follow() {
  const turn = () =>
    update((s) => {
      s.followed = !s.followed;
    });
  return html`<button class="order follow" aria-pressed=${state.followed} onClick=${turn}>${say("Follow the drone")}</button>`;
}
