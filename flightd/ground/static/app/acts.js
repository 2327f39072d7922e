// Acts of the person: sent to the drone by POST, the same one again until it is answered, done once.
import { shown, state, update } from "./store.js";

const AGAIN_MS = 500;
const PATIENCE_MS = 6000;
const STOP_PATIENCE_MS = 60000;
const ANSWER_MS = 3000;

export async function act(command, node = "") {
  const drone = state.selected;
  if (!drone) return undefined;
  // What was seen as it was pressed: the drone refuses what was ordered by an old picture, or for another flight.
  const { welcome, status } = shown();
  const seen = { session: welcome?.session ?? "", seen_ns: status?.stamp_ns ?? 0 };
  const body = JSON.stringify({ id: newId(), command, ...(node && { node }), ...seen });
  const began = performance.now();
  const patience = command === "stop" ? STOP_PATIENCE_MS : PATIENCE_MS;
  note(drone, command, node, "sent", "");
  for (;;) {
    const answer = await sent(drone, body, command === "stop" || command === "land");
    if (answer.accepted) return note(drone, command, node, "accepted", "");
    const final = !answer.again || performance.now() - began > patience;
    note(drone, command, node, final ? "refused" : "sent", answer.refused);
    if (final) return undefined;
    await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
  }
}

async function sent(drone, body, urgent) {
  try {
    const answer = await fetch(`/drones/${encodeURIComponent(drone)}/acts`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body,
      keepalive: urgent, // even while the page closes
      signal: AbortSignal.timeout(ANSWER_MS),
    });
    return { again: answer.status === 503, ...(await answer.json()) };
  } catch {
    return { again: true, refused: "the ground station does not answer" };
  }
}

function note(drone, command, node, stage, text) {
  update((s) => {
    s.acts.set(drone, { command, node, stage, text, at: performance.now() });
  });
}

function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
