// The down camera's picture before the time of the playback, with the lines that were found in it.
import { askStation } from "../fetching.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { drawPicture, foundWords, WIDTH } from "../live/camera.js";
import { lastBefore } from "./at_time.js";
import { fineClock } from "./figures.js";

const KEPT = 40;

export function ReplayPicture({ id, flight, t }) {
  const canvas = useRef(null);
  const fetching = useRef(null);
  const [seen, setSeen] = useState(null);
  const place = Math.max(lastBefore(flight.pictures, t), 0);
  const wanted = flight.pictures[place];
  useEffect(() => {
    const pictures = pictureFetcher(id);
    fetching.current = pictures;
    return pictures.end;
  }, [id]);
  useEffect(() => {
    if (!wanted) return;
    fetching.current.show(place, (told) => {
      if (told.picture && canvas.current) drawPicture(canvas.current, told.picture, told.head);
      setSeen({ place, head: told.head, trouble: told.trouble });
    });
  }, [id, place, wanted]);
  if (!wanted) return html`<section class="card camera none"><p class="quiet">${say("The log holds no pictures.")}</p></section>`;
  const found = seen?.head ? foundWords(seen.head) : "";
  return html`
    <figure class="card camera">
      <canvas ref=${canvas} width=${WIDTH} height=${WIDTH * 0.5625} role="img" aria-label=${`${say("Down camera")}: ${found || say("no picture yet")}`} />
      <figcaption>
        <strong>${say("Down camera")}</strong>
        ${seen?.trouble
          ? html`<span class="trouble">${quoted(seen.trouble)}</span>`
          : html`<span class="quiet">${found && `${found}, `}${say("at {time}, {number} of {all}", { time: fineClock(flight.pictures[seen?.place ?? place].t_s), number: place + 1, all: flight.pictures.length })}</span>`}
      </figcaption>
    </figure>
  `;
}

// One picture on its way at a time: of those that are asked for meanwhile the newest comes next.
function pictureFetcher(id) {
  const kept = new Map(); // place -> {picture, head} | {trouble}
  let next = null;
  let busy = false;
  let ended = false;
  const run = async () => {
    busy = true;
    while (next && !ended) {
      const { place, show } = next;
      next = null;
      const told = kept.get(place) ?? (await fetched(id, place));
      if (ended) break;
      kept.set(place, told);
      if (kept.size > KEPT) forget(kept, place);
      show(told);
    }
    busy = false;
  };
  return {
    show(place, show) {
      next = { place, show };
      if (!busy) run();
    },
    end() {
      ended = true;
      for (const { picture } of kept.values()) picture?.close();
    },
  };
}

function forget(kept, spared) {
  const oldest = [...kept.keys()].find((place) => place !== spared);
  kept.get(oldest).picture?.close();
  kept.delete(oldest);
}

async function fetched(id, place) {
  try {
    const answer = await askStation(`/api/flights/${id}/pictures/${place}`);
    if (!answer.ok) throw new Error((await answer.json()).refused);
    const data = await answer.arrayBuffer();
    const length = new DataView(data).getUint32(0);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    return { head, picture: await createImageBitmap(new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" })) };
  } catch (error) {
    return { trouble: error.message || english("the picture cannot be shown") };
  }
}
