// What is known of the studio: the sets and profiles there are, the set that is open, the picture in hand.
// It lies in the store as `studio`.
import { askJson, askStation, isGivenUp } from "../fetching.js";
import { state, update } from "../store.js";

const API = "/api/studio";
const TRAINING_AGAIN_MS = 800;
const MASK_MS = 60000;

const EMPTY = {
  overview: null, // {folder, sets, profiles, paints, shipped, missing}
  set: null, // {name, paint, folder, pictures, training, outcome, profile}
  chosen: "", // file of the picture in hand
  by: "strokes", // what the mask is made by
  mask: null, // {file, by, picture, head} | {file, by, trouble}
  looking: false, // whether a mask is on its way
  trouble: "",
  saved: true, // whether the station has all marks
};

export const studio = () => state.studio ?? EMPTY;

export function change(changes) {
  update((s) => {
    s.studio = { ...(s.studio ?? EMPTY), ...changes };
  });
}

// The station's answer; its refusal is an Error with words for a person.
export const asked = (path, method = "GET", said = undefined, ms = method === "GET" ? undefined : MASK_MS) =>
  askJson(`${API}${path}`, {
    method,
    goesOn: method !== "GET",
    ...(said !== undefined && { headers: { "Content-Type": "application/json" }, body: JSON.stringify(said) }),
    ...(ms && { ms }),
  });

export const setPath = (rest = "", name = studio().set?.name) => `/sets/${encodeURIComponent(name)}${rest}`;
export const pictureHref = (file) => `${API}${setPath(`/pictures/${file}`)}`;

export async function loadOverview() {
  await told(async () => change({ overview: await asked("") }));
}

let opening = 0;

export async function openSet(name) {
  const mine = ++opening;
  change({ set: null, chosen: "", mask: null, trouble: "", saved: true });
  await told(async () => {
    const [overview, set] = [await asked(""), await asked(setPath("", name))];
    if (mine !== opening) return;
    change({ overview, set, chosen: set.pictures[0]?.file ?? "" });
    if (studio().chosen) askMask();
    if (set.training?.running) watchTraining();
  });
}

// The set as the station has it now; marks that are on their way stay as they are shown.
export async function reloadSet() {
  const { name } = studio().set;
  const set = await asked(setPath("", name));
  if (studio().set?.name === name) change({ set: studio().saved ? set : { ...set, pictures: studio().set.pictures } });
  return set;
}

export async function watchTraining() {
  const { name } = studio().set;
  await told(async () => {
    for (;;) {
      if (studio().set?.name !== name) return;
      const set = await reloadSet();
      if (!set.training?.running) break;
      await new Promise((resolve) => setTimeout(resolve, TRAINING_AGAIN_MS));
    }
    await loadOverview();
  });
}

export function choosePicture(file) {
  change({ chosen: file, mask: null });
  if (file) askMask();
}

export function chooseMask(by) {
  change({ by, mask: null });
  askMask();
}

export const pictureInHand = () => studio().set?.pictures.find((one) => one.file === studio().chosen);

const unsent = new Set(); // files whose marks the station has not all
let sending = false;

// Marks of the picture in hand, kept by the station; the mask follows.
export async function mark(changes) {
  const file = studio().chosen;
  const pictures = studio().set.pictures.map((one) => (one.file === file ? { ...one, ...changes } : one));
  change({ set: { ...studio().set, pictures }, saved: false });
  unsent.add(file);
  if (sending) return;
  sending = true;
  const went = await told(async () => {
    while (unsent.size) {
      const [next] = unsent;
      unsent.delete(next);
      const { regions, lines, complete, negative } = studio().set.pictures.find((one) => one.file === next) ?? {};
      if (regions) await asked(setPath(`/pictures/${next}`), "PUT", { regions, lines, complete, negative });
    }
  });
  sending = false;
  if (!went) unsent.add(file); // sent again with the next mark
  else change({ saved: true });
  askMask();
}

let masking = false;
let maskAgain = false;

// One on its way at a time; what is asked for meanwhile comes next.
async function askMask() {
  if (masking) {
    maskAgain = true;
    return;
  }
  masking = true;
  do {
    maskAgain = false;
    const { chosen: file, by, set } = studio();
    if (!file || !set || by === "none" || (by === "strokes" && !teaches(set))) {
      change({ mask: null, looking: false });
      continue;
    }
    change({ looking: true });
    const mask = await fetchedMask(file, by);
    if (mask && studio().chosen === file && studio().by === by) change({ mask, looking: false });
  } while (maskAgain);
  masking = false;
  change({ looking: false });
}

// Paint and floor: beside lines is floor where all of them are labelled.
function teaches(set) {
  const has = (paint) => set.pictures.some((one) => one.regions.some((region) => region.paint === paint));
  const lines = set.pictures.filter((one) => one.lines.length && !one.regions.length);
  return (has(true) || lines.length) && (has(false) || lines.some((one) => one.complete) || set.pictures.some((one) => one.negative));
}

async function fetchedMask(file, by) {
  try {
    const answer = await askStation(`${pictureHref(file)}/mask?by=${by}`, { ms: MASK_MS });
    if (!answer.ok) throw new Error((await answer.json()).refused);
    const data = await answer.arrayBuffer();
    const length = new DataView(data).getUint32(0);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const picture = await createImageBitmap(new Blob([new Uint8Array(data, 4 + length)], { type: "image/png" }));
    return { file, by, head, picture };
  } catch (error) {
    return isGivenUp(error) ? null : { file, by, trouble: error.message };
  }
}

// Does it, and tells what goes wrong; whether it went well.
export async function told(work) {
  try {
    await work();
    if (studio().trouble) change({ trouble: "" });
    return true;
  } catch (error) {
    if (!isGivenUp(error)) change({ trouble: error.message });
    return false;
  }
}
