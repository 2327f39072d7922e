// Keeps the screen on while a drone flies that this page attends: a phone that locks its screen loses the ground.
import { mayOperate } from "./access/session.js";
import { state, update, watch } from "./store.js";

const AGAIN_MS = 10000;

let lock = null; // WakeLockSentinel
let asksNext = 0; // by performance.now(): a browser that refuses is not asked at every status

export const isAttending = ({ link }) => Boolean(state.socket.open && mayOperate() && link?.flies && link.attends);

export function keepScreenOn() {
  watch(look);
  document.addEventListener("visibilitychange", () => {
    asksNext = 0;
    look();
  });
}

async function look() {
  if (![...state.drones.values()].some(isAttending)) {
    lock?.release();
    lock = null;
    note("");
    return;
  }
  if (lock || document.hidden || performance.now() < asksNext) return;
  asksNext = performance.now() + AGAIN_MS;
  try {
    const held = await navigator.wakeLock.request("screen");
    held.addEventListener("release", () => {
      if (lock === held) lock = null; // the page was hidden, or the device saves its battery
    });
    lock = held;
  } catch {
    // it has none outside of a secure context, or refuses now: Live says so
  }
  note(lock ? "kept on" : "may lock");
}

function note(screen) {
  if (state.screen === screen) return;
  update((s) => {
    s.screen = screen;
  });
}
