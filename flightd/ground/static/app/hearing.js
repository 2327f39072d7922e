// How well the drone is heard from here: the page's own way to the station, and the station's to the drone.
import { shown, state } from "./store.js";
import { duration, isGrounded } from "./words.js";

const SILENT_S = 1.5;

export function hears() {
  const { socket } = state;
  const { link, status } = shown();
  if (!socket.open) {
    return { good: false, short: "No station", text: "The ground station does not answer. Trying again." };
  }
  if (!link) return { good: false, short: "Connecting", text: "Waiting for the ground station." };
  const silent = status ? silentFor(shown()) : null;
  if (silent === null || silent > SILENT_S) {
    const since = silent === null ? "" : ` for ${duration(silent)}`;
    const why = link.trouble ? ` ${/[.?!]$/.test(link.trouble) ? link.trouble : `${link.trouble}.`}` : "";
    return {
      good: false,
      short: silent === null ? "Not heard yet" : `Silent${since}`,
      flies: silent !== null && !isGrounded(status),
      text:
        silent === null
          ? `The drone was not heard yet.${why}`
          : `The drone is silent${since}: what you see is old.${why}`,
    };
  }
  const trip = link.round_trip_ms === null ? "" : `${Math.round(link.round_trip_ms)} ms`;
  return { good: true, short: trip ? `Link ${trip}` : "Heard", text: "" };
}

// The station tells twice a second how long ago it heard the drone; a status that came since is newer still.
function silentFor({ link, linkAt, heardAt }) {
  const now = performance.now();
  const byLink = (link.heard_s ?? Infinity) + (now - linkAt) / 1000;
  return heardAt > linkAt ? Math.min(byLink, (now - heardAt) / 1000) : byLink;
}
