// The newest picture of a camera, and how its brightness is spread.
import { showPictures } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { shown } from "../store.js";
import { BINS, brightnessOf } from "./brightness.js";

const WIDTH = 320;
const TALL = 40;

export function ExposurePicture({ drone, camera }) {
  const canvas = useRef(null);
  const [seen, setSeen] = useState(null);
  useEffect(() => {
    setSeen(null);
    return showPictures(drone, camera, (picture) => {
      if (!canvas.current) return;
      const height = Math.round((WIDTH * picture.height) / picture.width);
      canvas.current.height = height;
      const context = canvas.current.getContext("2d", { willReadFrequently: true });
      context.drawImage(picture, 0, 0, WIDTH, height);
      setSeen(brightnessOf(context.getImageData(0, 0, WIDTH, height).data));
    });
  }, [drone, camera]);
  const trouble = shown().trouble[camera];
  return html`
    <figure class="exposure-picture">
      <canvas ref=${canvas} class="preview" width=${WIDTH} height=${WIDTH * 0.5625} role="img" aria-label=${`Newest picture of the ${camera} camera`} />
      <${Histogram} seen=${seen} />
      <figcaption class=${trouble ? "refusal" : "quiet"}>${trouble || (seen ? words(seen) : "No picture yet.")}</figcaption>
    </figure>
  `;
}

function Histogram({ seen }) {
  const most = seen ? Math.max(...seen.bins) : 1;
  return html`
    <svg class="histogram" viewBox=${`0 0 ${BINS} ${TALL}`} preserveAspectRatio="none" role="img" aria-label=${seen ? `Brightness from dark to bright: ${words(seen)}` : "Brightness: no picture yet"}>
      ${seen?.bins.map((share, at) => {
        const tall = (TALL * share) / most;
        return html`<rect key=${at} class=${at === 0 || at === BINS - 1 ? "lost" : ""} x=${at} y=${TALL - tall} width="1" height=${tall} />`;
      })}
    </svg>
  `;
}

const words = ({ median, black, burnt }) => `Median ${median} of 255, ${share(burnt)} burnt out, ${share(black)} black`;

const share = (part) => `${(100 * part).toFixed(part < 0.1 ? 1 : 0)} %`;
