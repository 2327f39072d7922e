// A small picture of a flight, fetched once its row is in sight.
import { askStation } from "../fetching.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { say } from "../language.js";

const KEPT = 300;
const kept = new Map(); // "id stamp" -> address of the picture, "" where the log holds none

export function Thumbnail({ row }) {
  const frame = useRef(null);
  const [, setSeen] = useState("");
  const key = `${row.id} ${row.stamp}`;
  useEffect(() => {
    if (kept.has(key)) return undefined;
    const sight = new IntersectionObserver((entries) => {
      if (!entries.some(({ isIntersecting }) => isIntersecting)) return;
      sight.disconnect();
      fetched(row.id).then(
        (address) => {
          keep(key, address);
          setSeen(key);
        },
        () => {}, // the page was left, or the log cannot be read, as its row says
      );
    });
    sight.observe(frame.current);
    return () => sight.disconnect();
  }, [key]);
  const address = kept.get(key);
  return html`
    <span class=${address === "" ? "thumbnail none" : "thumbnail"} ref=${frame}>
      ${address && html`<img src=${address} alt=${say("The floor in the middle of the flight")} />`}
    </span>
  `;
}

async function fetched(id) {
  const answer = await askStation(`/api/flights/${encodeURIComponent(id)}/thumbnail`);
  if (!answer.ok) return "";
  const picture = await answer.blob();
  return picture.size ? URL.createObjectURL(picture) : "";
}

function keep(key, address) {
  kept.set(key, address);
  if (kept.size <= KEPT) return;
  const [oldest, gone] = kept.entries().next().value;
  if (gone) URL.revokeObjectURL(gone);
  kept.delete(oldest);
}
