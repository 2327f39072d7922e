// All that the page knows, in one place: what the station told, and what the person chose.
// `update` changes it and has it drawn once per frame; nothing else keeps state of its own beyond a gesture.

const EMPTY_DRONE = {
  welcome: null, // role, site, cameras
  status: null, // the link's StatusReport
  heardAt: 0, // when the status came, by performance.now()
  clockMs: null, // the drone's clock behind performance.now(), with the quickest status so far
  link: null, // how the station hears the drone
  linkAt: 0, // when it told so
  events: [],
  track: [], // [x_m, y_m], oldest first
  visited: new Set(),
  manager: null, // {flies} where a fleet's manager may fly it; null: none may
  plan: null, // what is flown, or would be with the next start: the link's PlanAnswer
  trouble: {}, // why a camera shows nothing, by its name
};
const TRACK_STEP_M = 0.05;
const TRACK_KEPT = 4000;

export const state = {
  session: null, // who is signed in: {login, name, role, over, endsAt}; see access/session.js
  route: null, // page, path below it and query: see router.js
  simulation: null, // the simulated flight that the station flies or flew last, see site/simulation_bar.js
  stock: null, // see stock/stock_state.js
  typedSettings: {}, // of each drone what was typed and not sent: {key: value}, see doctor/settings_view.js
  missions: null, // see missions/missions_state.js
  fleet: null, // see fleet/fleet_state.js
  station: null, // version, drones, browsers
  drones: new Map(),
  selected: "", // drone that is shown and commanded
  socket: { open: false, heardAt: 0, roundTripMs: null, dropped: 0, picturesDropped: 0 },
  chosenNode: "", // where "go to" leads
  screen: "", // "kept on" or "may lock" while a drone flies: see screen.js
  singleKeys: true, // see single_keys.js
  followed: false, // the map shows the drone's surroundings, not the whole site
  acts: new Map(), // newest act of each drone: {command, state, text, at}
};

const watchers = new Set();
let due = false;

export function update(change) {
  change(state);
  if (due) return;
  due = true;
  const draw = () => {
    due = false;
    for (const watcher of watchers) watcher();
  };
  if (document.hidden) setTimeout(draw, 250);
  else requestAnimationFrame(draw);
}

export function watch(watcher) {
  watchers.add(watcher);
  return () => watchers.delete(watcher);
}

export const shown = () => state.drones.get(state.selected) ?? EMPTY_DRONE;

// What the station says, topic by topic.
export function take({ drone, topic, value }) {
  update((s) => {
    s.socket.heardAt = performance.now();
    if (drone === "") {
      if (topic === "session") s.session = sessionOf(value);
      if (topic === "station") takeStation(s, value);
      if (topic === "simulation") s.simulation = value;
      if (topic === "echo") takeEcho(s, value);
      return;
    }
    const known = s.drones.get(drone) ?? { ...EMPTY_DRONE };
    s.drones.set(drone, { ...known, ...changed(known, topic, value) });
  });
}

// `ends_in_s` as a time by performance.now(), for it is told only now and then.
export const sessionOf = (told) => ({ ...told, endsAt: performance.now() + (told.ends_in_s ?? Infinity) * 1000 });

// Show and command another drone.
export const selectDrone = (name) =>
  update((s) => {
    if (s.selected !== name) s.chosenNode = "";
    s.selected = name;
  });

function takeStation(s, value) {
  s.station = value;
  for (const name of s.drones.keys()) if (!value.drones.includes(name)) s.drones.delete(name); // it has left
  if (value.drones.includes(s.selected)) return;
  s.selected = value.drones[0] ?? "";
  s.chosenNode = "";
}

function takeEcho(s, value) {
  s.socket = {
    ...s.socket,
    roundTripMs: performance.now() - value.number,
    dropped: value.dropped,
    picturesDropped: value.pictures_dropped,
  };
}

function changed(known, topic, value) {
  if (topic === "status") {
    const heardAt = performance.now();
    const clockMs = Math.min(known.clockMs ?? Infinity, heardAt - value.stamp_ns / 1e6);
    return { status: value, heardAt, clockMs, track: longer(known.track, value.position) };
  }
  if (topic === "link") return { link: value, linkAt: performance.now() };
  if (topic === "visited") return { visited: new Set(value) };
  if (topic.endsWith(" trouble")) return { trouble: { ...known.trouble, [topic.split(" ")[0]]: value } };
  if (topic === "welcome" && known.welcome?.session !== value.session) return { welcome: value, track: [], clockMs: null };
  return { [topic]: value };
}

function longer(track, position) {
  if (!position) return track;
  const last = track[track.length - 1];
  const { x_m: x, y_m: y } = position;
  if (last && Math.hypot(last[0] - x, last[1] - y) < TRACK_STEP_M) return track;
  return [...track.slice(-TRACK_KEPT + 1), [x, y]];
}
