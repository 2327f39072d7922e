// Pictures into the set: from a recorded flight, live from the drone, from files.
import { unlessBusy } from "../busy.js";
import { showPictures } from "../connection.js";
import { askJson, askStation } from "../fetching.js";
import { flightsState, watchList } from "../flights/flights_state.js";
import { HowFlightsCome } from "../how_flights_come.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, say } from "../language.js";
import { drawPicture, WIDTH } from "../live/camera.js";
import { state } from "../store.js";
import { asked, change, choosePicture, reloadSet, setPath, told } from "./studio_state.js";

const SOURCES = [["flight", english("From a flight")], ["live", english("Live")], ["files", english("Files")]];
const AT_ONCE = 8;
const READING_MS = 120000; // of a long log, when it is read first
const JPEG = 0.95;

export function AddPictures() {
  const [source, setSource] = useState("");
  return html`
    <div class="add" role="group" aria-label=${say("Add pictures")}>
      <div class="tools">
        ${SOURCES.map(([key, words]) => html`<button key=${key} class="order" aria-expanded=${key === source} onClick=${() => setSource(key === source ? "" : key)}>${say(words)}</button>`)}
      </div>
      ${source === "flight" && html`<${FromFlight} />`}${source === "live" && html`<${Live} />`}${source === "files" && html`<${Files} />`}
    </div>
  `;
}

const taken = (work) =>
  told(async () => {
    const { file } = await work();
    await reloadSet();
    choosePicture(file);
  });

function FromFlight() {
  const { rows, looked } = flightsState().list;
  const [flight, setFlight] = useState("");
  const [pictures, setPictures] = useState(null); // how many there are
  const [place, setPlace] = useState(0);
  const [busy, setBusy] = useState(false);
  const choose = (id) => {
    setFlight(id);
    setPictures(null);
    told(async () => {
      const known = await askJson(`/api/flights/${id}`, { ms: READING_MS });
      setPictures(known.flight.pictures.length);
      setPlace(0);
    });
  };
  useEffect(watchList, []);
  const first = rows[0]?.id;
  useEffect(() => {
    if (first && !flight) choose(first);
  }, [first]);
  const take = async (at) => asked(setPath("/pictures"), "POST", { flight, place: at });
  const several = async () => {
    setBusy(true);
    const step = Math.max(Math.floor(pictures / AT_ONCE), 1);
    await taken(async () => {
      const all = [];
      for (let at = 0; at < pictures && at / step < AT_ONCE; at += step) all.push(await take(at));
      return all[0];
    });
    setBusy(false);
  };
  if (!rows.length && !looked) return html`<p class="quiet" role="status">${say("Looking for flights …")}</p>`;
  if (!rows.length) return html`<p class="quiet">${say("No flight log lies below the station's folder yet.")}</p><${HowFlightsCome} />`;
  return html`
    <div class="from-flight">
      <label class="field">${say("Flight")}
        <select value=${flight} onChange=${(event) => choose(event.target.value)}>
          ${rows.map((row) => html`<option key=${row.id} value=${row.id}>${row.site || row.path} · ${row.path}</option>`)}
        </select>
      </label>
      ${pictures === null && html`<p class="quiet" role="status">${say("Reading the flight …")}</p>`}
      ${pictures === 0 && html`<p class="quiet">${say("This log holds no pictures.")}</p>`}
      ${pictures > 0 &&
      html`
        <${FlightPicture} flight=${flight} place=${place} />
        <label class="field">${say("Picture {number} of {all}", { number: place + 1, all: pictures })}
          <input type="range" min="0" max=${pictures - 1} value=${place} onInput=${(event) => setPlace(Number(event.target.value))} />
        </label>
        <div class="tools">
          <button class="order main-order" onClick=${() => taken(() => take(place))}>${say("Take this picture")}</button>
          <button class="order" ...${unlessBusy(busy, several)}>${busy ? say("Taking …") : say("Take {n} from all of the flight", { n: Math.min(AT_ONCE, pictures) })}</button>
        </div>
      `}
    </div>
  `;
}

function FlightPicture({ flight, place }) {
  const canvas = useRef(null);
  useEffect(() => {
    const ends = new AbortController();
    const timer = setTimeout(
      () =>
        told(async () => {
          const answer = await askStation(`/api/flights/${flight}/pictures/${place}`, { signal: ends.signal });
          if (!answer.ok) throw new Error((await answer.json()).refused);
          const data = await answer.arrayBuffer();
          const length = new DataView(data).getUint32(0);
          const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
          const picture = await createImageBitmap(new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" }));
          if (canvas.current) drawPicture(canvas.current, picture, head);
          picture.close();
        }),
      120,
    );
    return () => {
      clearTimeout(timer);
      ends.abort();
    };
  }, [flight, place]);
  return html`<canvas ref=${canvas} class="preview" width=${WIDTH} height=${WIDTH * 0.5625} role="img" aria-label=${say("Picture {number} of the flight", { number: place + 1 })} />`;
}

function Live() {
  const canvas = useRef(null);
  const newest = useRef(null);
  const [seen, setSeen] = useState(false);
  const drone = state.selected;
  useEffect(
    () =>
      showPictures(drone, "down", (picture, head) => {
        newest.current = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
        newest.current.getContext("2d").drawImage(picture, 0, 0);
        if (canvas.current) drawPicture(canvas.current, picture, head);
        setSeen(true);
      }),
    [drone],
  );
  const take = async () => {
    const jpeg = await new Promise((resolve) => newest.current.toBlob(resolve, "image/jpeg", JPEG));
    return uploaded(jpeg);
  };
  return html`
    <div class="from-flight">
      <canvas ref=${canvas} class="preview" width=${WIDTH} height=${WIDTH * 0.5625} role="img" aria-label=${say("Down camera, live")} />
      ${!seen && html`<p class="quiet" role="status">${say("No picture of {drone} yet.", { drone: drone || say("a drone") })}</p>`}
      <div class="tools"><button class="order main-order" disabled=${!seen} onClick=${() => taken(take)}>${say("Take this picture")}</button></div>
    </div>
  `;
}

function Files() {
  const input = useRef(null);
  const add = () =>
    taken(async () => {
      let last = null;
      for (const file of input.current.files) last = await uploaded(file);
      input.current.value = "";
      return last;
    });
  return html`
    <label class="field">${say("JPEG or PNG, seen from above as the drone sees the floor")}
      <input ref=${input} type="file" accept="image/jpeg,image/png" multiple onChange=${add} />
    </label>
  `;
}

async function uploaded(blob) {
  const answer = await askJson(`/api/studio${setPath("/uploads")}`, {
    method: "POST", goesOn: true, headers: { "Content-Type": "application/octet-stream" }, body: blob,
  });
  change({ trouble: "" });
  return answer;
}
