// The map at a time of the playback: of one flight, or of two over each other.
import { html, useMemo } from "../html.js";
import { english, quoted, say, sayWith } from "../language.js";
import { around, Drone, Legend, M, markScale, Nodes, Seen, Track, Way } from "../live/map_marks.js";
import { bounds, Floor } from "../live/site_plan.js";
import { state, update } from "../store.js";
import { lastBefore, momentAt, pointsUntil, poseAt, seenAt, visitedAt, wayAt } from "./at_time.js";

const ONE = [["leg", english("next leg")], ["way", english("way after it")], ["track", english("track")], ["seen", english("lines seen")], ["visited", english("visited")]];
const TRUTH = [["truth", english("true track")]];
const TWO = [["first", english("first flight")], ["second", english("second flight")]];

// `shown` are one or two {flight, t, kind, name}; the first one's map is drawn.
export function ReplayMap({ shown }) {
  const [{ flight, t }] = shown;
  const { floor } = flight;
  const box = useMemo(() => (floor ? bounds(floor) : tracksBox(shown)), [floor]);
  const plan = useMemo(() => floor && html`<${Floor} floor=${floor} box=${box} />`, [floor]);
  const nodes = useMemo(() => new Map((floor?.nodes ?? []).map((node) => [node.id, node])), [floor]);
  const pose = poseAt(flight.track, t);
  const view = state.followed && pose ? around(pose) : box;
  const scale = markScale(view);
  const alone = shown.length === 1;
  const way = alone ? wayAt(flight, t).map((id) => nodes.get(id)).filter(Boolean) : [];
  return html`
    <section class="card map" aria-labelledby="replay-map">
      <h2 id="replay-map" class="unseen">${say("Map")}</h2>
      <svg
        viewBox=${view.map((value) => value * M).join(" ")} role="group" style=${{ "--scale": scale }}
        aria-label=${floor ? say("Map of {site}", { site: floor.name }) : say("Map")}
      >
        ${plan}
        <${WholeTracks} shown=${shown} />
        ${alone && html`<${Seen} lines=${seenAt(flight, t)} />`}
        <${Way} from=${pose} way=${way} />
        ${shown.map((one) => html`<${Track} key=${one.kind} points=${pointsUntil(one.flight.track, one.t)} kind=${one.kind} />`)}
        ${floor && html`<${StillNodes} flight=${flight} t=${t} scale=${scale} />`}
        ${shown.map((one) => html`<${Flown} key=${one.kind} one=${one} scale=${scale} />`)}
      </svg>
      <div class="map-foot">
        <${Legend} marks=${alone ? [...ONE, ...(flight.truth ? TRUTH : [])] : TWO} />
        <button class="order follow" aria-pressed=${state.followed} onClick=${turnFollowed}>${say("Follow the drone")}</button>
      </div>
      ${flight.map_error && html`<p class="quiet">${sayWith("No map is drawn: {why}.", { why: quoted(flight.map_error) })}</p>`}
    </section>
  `;
}

const turnFollowed = () =>
  update((s) => {
    s.followed = !s.followed;
  });

// Drawn once: the tracks as a whole, faint, and the true one.
function WholeTracks({ shown }) {
  return useMemo(
    () => html`
      ${shown.map((one) => html`<${Track} key=${one.kind} points=${pointsUntil(one.flight.track)} kind=${`ahead ${one.kind}`} />`)}
      ${shown.length === 1 && shown[0].flight.truth && html`<${Track} points=${pointsUntil(shown[0].flight.truth)} kind="truth" />`}
    `,
    shown.map((one) => one.flight),
  );
}

// Drawn again only where a node was visited, or another one is the goal.
function StillNodes({ flight, t, scale }) {
  const { floor, events } = flight;
  const visits = useMemo(() => events.filter(({ name }) => name === "visited"), [events]);
  const goal = momentAt(flight, t)?.goal;
  const visited = lastBefore(visits, t);
  return useMemo(
    () => html`<${Nodes} floor=${floor} visited=${visitedAt(flight, t)} goal=${goal} scale=${scale} />`,
    [flight, visited, goal, scale],
  );
}

function Flown({ one, scale }) {
  const pose = poseAt(one.flight.track, one.t);
  return pose && html`<${Drone} position=${pose} scale=${scale} name=${one.name} kind=${one.kind} />`;
}

// [x, y, width, height] around all tracks, for a log without a map.
function tracksBox(shown) {
  const points = shown.flatMap((one) => pointsUntil(one.flight.track));
  if (!points.length) return [-1, -1, 2, 2];
  const reach = (place) => [Math.min(...points.map((point) => point[place])) - 1, Math.max(...points.map((point) => point[place])) + 1];
  const [[x0, x1], [y0, y1]] = [reach(0), reach(1)];
  return [x0, y0, x1 - x0, y1 - y0];
}
