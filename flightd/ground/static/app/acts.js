// Acts of the person: sent to the drone, the same one again until it is answered, done once.
import { english } from "./language.js";
import { isOver } from "./access/session.js";
import { sendAct } from "./connection.js";
import { state, update } from "./store.js";

const AGAIN_MS = 500;
const PATIENCE_MS = 6000;
const STOP_PATIENCE_MS = 60000;
const ANSWER_MS = 3000;
const SOCKET_MS = 1000; // an act that was not answered over the socket by then goes by POST too

// `plan`: the one that a start is for; the drone does not start where another one stands.
export async function act(command, node = "", plan = "", drone = state.selected) {
  if (!drone) return undefined;
  // What was seen as it was pressed: the drone refuses what was ordered by an old picture, or for another flight.
  const { welcome, status } = state.drones.get(drone) ?? {};
  const seen = { session: welcome?.session ?? "", seen_ns: status?.stamp_ns ?? 0 };
  const given = { id: newId(), command, ...(node && { node }), ...(plan && { plan }), ...seen };
  const began = performance.now();
  const patience = command === "stop" ? STOP_PATIENCE_MS : PATIENCE_MS;
  note(drone, command, node, "sent", "");
  for (;;) {
    const answer = await sent(drone, given, command === "stop" || command === "land");
    if (answer.accepted) return note(drone, command, node, "accepted", "");
    const final = !answer.again || performance.now() - began > patience;
    note(drone, command, node, final ? "refused" : "sent", answer.refused);
    if (final) return undefined;
    await passed(AGAIN_MS);
  }
}

// A browser opens six connections to the station, for all its pages together: a POST waits while slow requests
// hold them.  The socket is open already; POST is for when it is not, or says nothing.  Both together do it once.
async function sent(drone, given, urgent) {
  const bySocket = sendAct(drone, given);
  const soon = await Promise.race([bySocket, passed(SOCKET_MS)]);
  const { status, ...answer } = soon ?? (await first(bySocket, posted(drone, given, urgent)));
  return { again: !status || status === 503 || (status === 401 && isOver()), ...answer }; // only the socket knows the person then
}

async function posted(drone, given, urgent) {
  try {
    const answer = await fetch(`/drones/${encodeURIComponent(drone)}/acts`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(given),
      keepalive: urgent, // even while the page closes
      signal: AbortSignal.timeout(ANSWER_MS),
    });
    return { status: answer.status, ...(await answer.json()) };
  } catch {
    return { refused: english("the ground station does not answer") };
  }
}

// What the socket answers after all, or POST; a socket that closes without an answer says nothing.
const first = (bySocket, byPost) => Promise.race([bySocket.then((answer) => answer ?? byPost), byPost]);

const passed = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function note(drone, command, node, stage, text) {
  update((s) => {
    s.acts.set(drone, { command, node, stage, text, at: performance.now() });
  });
}

export function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
