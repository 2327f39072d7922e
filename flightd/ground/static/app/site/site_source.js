// What the page asks of the station: files, checks, saving, other programs' files.
import { english } from "../language.js";
import { askJson, askStation, isGivenUp } from "../fetching.js";
import { begin, change, edit, site } from "./site_state.js";

const CHECK_AFTER_MS = 200;
const sent = (body, method = "POST") => ({
  method, headers: { "Content-Type": "application/json" }, body: JSON.stringify(body), goesOn: method === "PUT",
});
const named = (name) => encodeURIComponent(name);

// Do something that may be refused: what is said then is shown.
async function tried(work) {
  change({ trouble: "", said: "", busy: true });
  try {
    return await work();
  } catch (error) {
    if (!isGivenUp(error)) change({ trouble: error.message });
    return undefined;
  } finally {
    change({ busy: false });
  }
}

export const loadList = () =>
  tried(async () => {
    const list = await askJson("/api/site");
    change({ list, camera: site().camera ?? list.camera });
  });

export const openFile = (name) =>
  tried(async () => {
    const told = await askJson(`/api/site/file?name=${named(name)}`);
    begin(told, { name, stamp: told.stamp });
    return true;
  });

export const makeNew = (measures) =>
  tried(async () => {
    begin(await askJson("/api/site/new", sent(measures)));
    return true;
  });

export const takeIn = (file) =>
  tried(async () => {
    const kind = /\.json$/i.test(file.name) ? "lif" : /\.toml$/i.test(file.name) ? "toml" : "csv";
    const headers = { "Content-Type": "application/octet-stream" };
    begin(await askJson(`/api/site/import?kind=${kind}`, { method: "POST", headers, body: file }));
    return true;
  });

// An old version takes the place of what is shown: it can be undone, and is saved like any edit.
export const showVersion = (version) =>
  tried(async () => {
    const told = await askJson(`/api/site/version?name=${named(site().name)}&version=${named(version)}`);
    edit(told.draft, { chosen: { table: "site", index: 0, node: null } });
    change({ said: english("The version of {day} is shown. Save puts it back.", { day: version.slice(0, 10) }) });
  });

// Save under the file's own name, or as a new file.
export async function save(newName = "") {
  const { draft, stamp, name } = site();
  await tried(async () => {
    const isNew = Boolean(newName) || !stamp;
    const to = newName || name;
    const told = await askJson(`/api/site/file?name=${named(to)}`, sent({ draft, stamp: isNew ? "" : stamp }, "PUT"));
    const common = { name: to, stamp: told.stamp, versions: told.versions, losesComments: told.loses_comments, kept: told.draft };
    const isStill = site().draft === draft; // else it was edited on meanwhile, over the text of before
    change({ ...common, ...(isStill && { draft: told.draft, checkedDraft: told.draft }), said: english("Saved as {file}.", { file: to }) });
    loadListQuietly();
  });
}

// Have a file flown in the simulator, and end that: how it goes is told on the topic "simulation".
export const fly = (name) => tried(() => askJson(`/api/site/simulation?name=${named(name)}`, { method: "POST", goesOn: true }));
export const endFlight = () => tried(() => askJson("/api/site/simulation", { method: "DELETE", goesOn: true }));

const loadListQuietly = () => askJson("/api/site").then((list) => change({ list })).catch(() => {});

export const download = (kind) =>
  tried(async () => {
    const answer = await askStation(`/api/site/export?kind=${kind}`, sent(site().draft));
    if (!answer.ok) throw new Error((await answer.json()).refused);
    const base = (site().name || "site").replace(/^.*\//, "").replace(/\.toml$/, "");
    const file = /filename="site([^"]*)"/.exec(answer.headers.get("content-disposition"))[1];
    const url = URL.createObjectURL(await answer.blob());
    Object.assign(document.createElement("a"), { href: url, download: `${base}${file}` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  });

let timer = 0;
let asking = false;

// Have what is shown checked, soon after the last change; one check at a time.
export function checkSoon() {
  clearTimeout(timer);
  timer = setTimeout(check, CHECK_AFTER_MS);
}

async function check() {
  const { draft, camera, withCamera } = site();
  if (!draft || asking) return;
  asking = true;
  try {
    const checked = await askJson("/api/site/check", sent({ draft: { ...draft, text: "" }, camera: withCamera ? camera : null }));
    const sound = checked.sound ? { sound: checked } : {};
    change({ checked, checkedDraft: draft, ...sound, ...(site().trouble === site().checkTrouble && { trouble: "" }) });
  } catch (error) {
    if (!isGivenUp(error)) change({ trouble: error.message, checkTrouble: error.message });
  } finally {
    asking = false;
    const now = site();
    if (now.draft !== draft || now.camera !== camera || now.withCamera !== withCamera) checkSoon();
  }
}
