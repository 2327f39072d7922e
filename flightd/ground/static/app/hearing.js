// How well the drone is heard from here: the page's own way to the station, and the station's to the drone.
import { quoted, say } from "./language.js";
import { shown, state } from "./store.js";
import { duration, isGrounded } from "./words.js";

const SILENT_S = 1.5;

export function hears() {
  const { socket } = state;
  const { link, status } = shown();
  if (!socket.open) {
    return { good: false, short: say("No station"), text: say("The ground station does not answer. Trying again.") };
  }
  if (!link) return { good: false, short: say("Connecting"), text: say("Waiting for the ground station.") };
  const silent = status ? silentFor(shown()) : null;
  if (silent === null || silent > SILENT_S) {
    const since = duration(silent);
    const why = link.trouble ? [" ", quoted(/[.?!]$/.test(link.trouble) ? link.trouble : `${link.trouble}.`)] : [];
    return {
      good: false,
      short: silent === null ? say("Not heard yet") : say("Silent for {since}", { since }),
      flies: silent !== null && !isGrounded(status),
      text: [
        silent === null ? say("The drone was not heard yet.") : say("The drone is silent for {since}: what you see is old.", { since }),
        ...why,
      ],
    };
  }
  const trip = link.round_trip_ms === null ? "" : `${Math.round(link.round_trip_ms)} ms`;
  return { good: true, short: trip ? say("Link {trip}", { trip }) : say("Heard"), text: "" };
}

// Whether a drone says nothing now: what is known of it is old.
export function isSilent({ link, status, linkAt, heardAt }) {
  return !state.socket.open || !link || !status || silentFor({ link, linkAt, heardAt }) > SILENT_S;
}

// The station tells twice a second how long ago it heard the drone; a status that came since is newer still.
function silentFor({ link, linkAt, heardAt }) {
  const now = performance.now();
  const byLink = (link.heard_s ?? Infinity) + (now - linkAt) / 1000;
  return heardAt > linkAt ? Math.min(byLink, (now - heardAt) / 1000) : byLink;
}
