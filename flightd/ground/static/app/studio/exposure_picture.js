// The newest picture of a camera, and how its brightness is spread.
import { showPictures } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { decimal, english, quoted, say } from "../language.js";
import { shown } from "../store.js";
import { BINS, brightnessOf } from "./brightness.js";

const NEWEST = { down: english("Newest picture of the down camera"), front: english("Newest picture of the front camera") };
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
      <canvas ref=${canvas} class="preview" width=${WIDTH} height=${WIDTH * 0.5625} role="img" aria-label=${say(NEWEST[camera])} />
      <${Histogram} seen=${seen} />
      <figcaption class=${trouble ? "refusal" : "quiet"}>${trouble ? quoted(trouble) : seen ? words(seen) : say("No picture yet.")}</figcaption>
    </figure>
  `;
}

function Histogram({ seen }) {
  const most = seen ? Math.max(...seen.bins) : 1;
  return html`
    <svg class="histogram" viewBox=${`0 0 ${BINS} ${TALL}`} preserveAspectRatio="none" role="img" aria-label=${seen ? say("Brightness from dark to bright: {figures}", { figures: words(seen) }) : say("Brightness: no picture yet")}>
      ${seen?.bins.map((share, at) => {
        const tall = (TALL * share) / most;
        return html`<rect key=${at} class=${at === 0 || at === BINS - 1 ? "lost" : ""} x=${at} y=${TALL - tall} width="1" height=${tall} />`;
      })}
    </svg>
  `;
}

const words = ({ median, black, burnt }) =>
  say("Median {median} of 255, {burnt} burnt out, {black} black", { median, burnt: share(burnt), black: share(black) });

const share = (part) => `${decimal(100 * part, part < 0.1 ? 1 : 0)} %`;
