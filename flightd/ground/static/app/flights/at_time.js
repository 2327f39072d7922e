// What was where at a time of the flight.  Pure; times are seconds of the flight and rise.

const JOINED_S = 1.5; // poses farther apart are not joined: nothing is known between them

// The place of the last of `items` that began by `t`; -1 before the first.
export function lastBefore(items, t, begin = (item) => item.t_s) {
  let [low, high] = [0, items.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (begin(items[middle]) <= t) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const itself = (time) => time;

export const momentAt = (flight, t) => flight.moments[Math.max(lastBefore(flight.moments, t), 0)];

// The pose of a track, between two of its poses; null where none is near.
export function poseAt(track, t) {
  const times = track?.t_s ?? [];
  const before = lastBefore(times, t, itself);
  if (before < 0) return null;
  const after = Math.min(before + 1, times.length - 1);
  const gap = times[after] - times[before];
  if (gap > JOINED_S && t - times[before] > JOINED_S / 2) return null;
  if (after === before && t - times[before] > JOINED_S) return null;
  const part = gap > 0 && gap <= JOINED_S ? (t - times[before]) / gap : 0;
  const between = (name) => {
    const [a, b] = [track[name]?.[before], track[name]?.[after]];
    return a == null || b == null ? (a ?? null) : a + part * (b - a);
  };
  const [from, to] = [track.yaw_rad?.[before] ?? 0, track.yaw_rad?.[after] ?? 0];
  const turn = Math.atan2(Math.sin(to - from), Math.cos(to - from));
  return {
    x_m: between("x_m"), y_m: between("y_m"), yaw_rad: from + part * turn,
    sigma_x_m: between("sigma_x_m"), sigma_y_m: between("sigma_y_m"), sigma_yaw_rad: between("sigma_yaw_rad"),
  };
}

// [x, y] of a track up to `t`, or all of it.
export function pointsUntil(track, t = Infinity) {
  const times = track?.t_s ?? [];
  const count = t === Infinity ? times.length : lastBefore(times, t, itself) + 1;
  const points = new Array(count);
  for (let i = 0; i < count; i += 1) points[i] = [track.x_m[i], track.y_m[i]];
  return points;
}

// The names of the nodes that were still to be flown over, nearest first.
export function wayAt(flight, t, most = 32) {
  const { legs } = flight;
  const now = lastBefore(legs, t, (leg) => leg.t_s ?? Infinity);
  if (now < 0) return [];
  const { node } = momentAt(flight, t);
  const passed = Math.max(legs[now].via.indexOf(node), 0);
  const names = legs[now].via.slice(passed);
  for (const leg of legs.slice(now + 1)) {
    if (names.length >= most) break;
    names.push(...leg.via);
  }
  return names.slice(0, most);
}

export function visitedAt(flight, t) {
  return new Set(flight.events.filter((event) => event.name === "visited" && event.t_s <= t).map((event) => event.text));
}

// The lines that were seen then; none where the last sighting is old.
export function seenAt(flight, t) {
  const seen = flight.seen[lastBefore(flight.seen, t)];
  return seen && t - seen.t_s < 1 ? seen.lines : [];
}

// Stretches of one phase each: {phase, goal, from, to}.
export function phaseSpans(flight) {
  const spans = [];
  for (const { phase, goal, t_s: at } of flight.moments) {
    const last = spans[spans.length - 1];
    if (last?.phase === phase) continue;
    if (last) last.to = at;
    spans.push({ phase, goal, from: at, to: flight.duration_s });
  }
  return spans;
}

export const isMark = (event) => event.level !== "info" && event.name !== "phase" && event.name !== "start";

// When it took off; 0 where it never did.
export const takeOff = (flight) => flight.moments.find(({ phase }) => phase === "take_off")?.t_s ?? 0;

// The value of a curve of a series at a time; null where it is unknown.
export function valueAt(series, name, t) {
  const curve = series?.curves[name];
  if (!curve) return null;
  const at = Math.round((t - series.from_s) / series.step_s);
  return curve[Math.min(Math.max(at, 0), curve.length - 1)] ?? null;
}
