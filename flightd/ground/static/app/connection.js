// The WebSocket to the station: what it says goes into the store, pictures to whoever shows them, acts on it.
import { state, take, update } from "./store.js";

const AGAIN_MS = 700;
const ECHO_MS = 1000;
const LOST_MS = 3000;
const SIGN_IN_FIRST = 4401;

const showing = new Map(); // "drone camera" -> function that draws a picture
const unanswered = new Map(); // number of an act that was sent -> function that takes its answer
let acts = 0;
let socket = null;
let turnedAway = false; // until somebody signs in, here or in another tab

export function connect() {
  turnedAway = false;
  leave(socket);
  const url = new URL("/live", location.href);
  url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  socket = new WebSocket(url);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => {
    update((s) => {
      s.socket = { ...s.socket, open: true, heardAt: performance.now() };
    });
    sayWanted();
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : draw(data));
  socket.onclose = ({ code }) => {
    for (const number of unanswered.keys()) answered({ number });
    update((s) => {
      s.socket = { ...s.socket, open: false, roundTripMs: null };
    });
    if (code === SIGN_IN_FIRST) turnedAway = true;
    else setTimeout(connect, AGAIN_MS);
  };
}

// Another socket takes its place.
function leave(old) {
  if (!old || old.readyState >= WebSocket.CLOSING) return;
  old.onclose = null;
  old.onmessage = null;
  old.close();
  for (const number of unanswered.keys()) answered({ number });
}

function hear(said) {
  if (said.drone === "" && said.topic === "answer") answered(said.value);
  take(said);
}

// Send an act, which waits behind no request of any page: {status, accepted or refused}; null where the socket
// is not open, or closed before the answer came.
export function sendAct(drone, act) {
  if (socket?.readyState !== WebSocket.OPEN) return Promise.resolve(null);
  acts += 1;
  const number = acts;
  return new Promise((resolve) => {
    unanswered.set(number, resolve);
    say({ say: "act", number, drone, act });
  });
}

function answered({ number, ...answer }) {
  const resolve = unanswered.get(number);
  unanswered.delete(number);
  resolve?.(answer.status ? answer : null);
}

// A picture of this camera is wanted while the function that is returned was not called.
export function showPictures(drone, camera, drawPicture) {
  const key = `${drone} ${camera}`;
  showing.set(key, drawPicture);
  sayWanted();
  return () => {
    if (showing.get(key) === drawPicture) showing.delete(key);
    sayWanted();
  };
}

function say(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function sayWanted() {
  const keys = document.hidden ? [] : [...showing.keys()];
  const pictures = keys.map((key) => ({ drone: key.split(" ")[0], camera: key.split(" ")[1] }));
  say({ say: "want", pictures });
}

async function draw(data) {
  try {
    const length = new DataView(data).getUint32(0);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const jpeg = new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" });
    const picture = await createImageBitmap(jpeg);
    showing.get(`${head.drone} ${head.camera}`)?.(picture, head);
    picture.close();
  } catch {
    // a picture that cannot be drawn is left out; the next one may come
  } finally {
    say({ say: "drawn" });
  }
}

document.addEventListener("visibilitychange", () => {
  if (turnedAway && !document.hidden) connect();
  sayWanted();
});
setInterval(() => {
  say({ say: "echo", number: performance.now() });
  if (state.socket.open && performance.now() - state.socket.heardAt > LOST_MS) socket.close();
  update(() => {}); // ages are drawn anew
}, ECHO_MS);
