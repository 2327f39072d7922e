// What is known of the flights: the list, those that were opened, and where their playback is.
// It lies in the store as `flights`; everything is fetched when it is first shown.
import { askJson, isGivenUp } from "../fetching.js";
import { state, update } from "../store.js";

const LIST_AGAIN_MS = 6000;
const READING_AGAIN_MS = 700;
const TROUBLE_AGAIN_MS = 3000;
const KEPT_FLIGHTS = 6;
const SAME_START_S = 5; // a log that does not say when it began is dated by when it was written

const EMPTY = {
  list: { version: -1, rows: [], looked: false, unread: 0, cut: false, folder: true, trouble: "" },
  chosen: [], // ids of the flights to compare, two at most
  open: new Map(), // id -> {flight, row} | {trouble} | {} while it is fetched
  playing: { at: 0, running: false, speed: 1, span: 0 }, // seconds; span 0: the whole flight
};

export const flightsState = () => state.flights ?? EMPTY;

export function updateFlights(change) {
  update((s) => {
    s.flights = { ...(s.flights ?? EMPTY), ...change(s.flights ?? EMPTY) };
  });
}

// Keep the list up to date until the function that is returned is called.
export function watchList() {
  let timer = 0;
  let ended = false;
  const ask = async () => {
    const wait = document.hidden ? LIST_AGAIN_MS : await askList();
    if (!ended) timer = setTimeout(ask, wait);
  };
  ask();
  return () => {
    ended = true;
    clearTimeout(timer);
  };
}

async function askList() {
  try {
    const { version } = flightsState().list;
    const told = await askJson(`/api/flights${version >= 0 ? `?known=${version}` : ""}`);
    if (told.folder === false) {
      updateFlights((known) => ({ list: { ...known.list, looked: true, folder: false } }));
      return LIST_AGAIN_MS;
    }
    if (told.rows) updateFlights(() => ({ list: { ...told, folder: true } }));
    return told.unread || !flightsState().list.looked ? READING_AGAIN_MS : LIST_AGAIN_MS;
  } catch {
    return TROUBLE_AGAIN_MS; // the head says that the station does not answer
  }
}

// What is there of a flight; it is fetched where nothing is, or another flight is written in its place.
export function opened(id) {
  const { open, list } = flightsState();
  const known = open.get(id);
  const row = list.rows.find((one) => one.id === id);
  if (known && !(row && isAnother(row, known))) return known;
  const asked = { listed: row?.stamp };
  keep(id, asked);
  askJson(`/api/flights/${encodeURIComponent(id)}`)
    .then((told) => keep(id, { ...told, listed: row?.stamp }))
    .catch((error) => {
      if (isGivenUp(error)) forgetFlight(id);
      else keep(id, { trouble: error.message, listed: row?.stamp });
    });
  return asked;
}

// The log in the list is not the one that was fetched; one that grows stays the same flight while it is recorded.
export function isAnother(row, { listed, stamp, row: fetched }) {
  if (row.stamp === listed || row.stamp === stamp) return false;
  return row.running && fetched ? Math.abs(row.started_s - fetched.started_s) > SAME_START_S : !row.running;
}

// Fetch a flight again that could not be had.
export function forgetFlight(id) {
  updateFlights((known) => {
    const open = new Map(known.open);
    open.delete(id);
    return { open };
  });
}

function keep(id, told) {
  // not in the middle of drawing: what asks for a flight is being drawn
  queueMicrotask(() =>
    updateFlights((known) => {
      const open = new Map(known.open);
      open.delete(id);
      open.set(id, told);
      while (open.size > KEPT_FLIGHTS) open.delete(open.keys().next().value);
      return { open };
    }),
  );
}

export function turnChosen(id) {
  updateFlights(({ chosen }) => ({
    chosen: chosen.includes(id) ? chosen.filter((other) => other !== id) : [...chosen.slice(-1), id],
  }));
}
