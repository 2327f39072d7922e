// One camera's newest picture, with what the drone found in it drawn over it.
import { showPictures } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { shown, state } from "../store.js";
import { age } from "../words.js";

const NAMES = { down: english("Down camera"), front: english("Front camera") };
export const WIDTH = 640;

export function Camera({ camera }) {
  const canvas = useRef(null);
  const [seen, setSeen] = useState(null);
  const drone = state.selected;
  useEffect(
    () =>
      showPictures(drone, camera, (picture, head) => {
        if (canvas.current) drawPicture(canvas.current, picture, head);
        setSeen({ head, at: performance.now() });
      }),
    [drone, camera],
  );
  const trouble = shown().trouble[camera];
  const found = seen ? foundWords(seen.head) : "";
  return html`
    <figure class="card camera">
      <canvas ref=${canvas} width=${WIDTH} height=${WIDTH * 0.75} role="img" aria-label=${`${say(NAMES[camera])}: ${found || say("no picture yet")}`} />
      <figcaption>
        <strong>${say(NAMES[camera])}</strong>
        <span class=${trouble ? "trouble" : "quiet"}>${trouble ? quoted(trouble) : caption(seen, found)}</span>
      </figcaption>
    </figure>
  `;
}

function caption(seen, found) {
  if (!seen) return say("no picture yet");
  return say("{found}, {age} old", { found, age: age(pictureAgeMs(seen, shown().clockMs, performance.now()) / 1000) });
}

// Since the exposure, the way to this page with it.  The quickest status tells the drone's clock, `clockMs`; before
// there is one, the age is what the station knew, and the time since the picture came.
export function pictureAgeMs({ head, at }, clockMs, now) {
  const byStation = now - at + (head.age_ms ?? 0);
  return clockMs === null ? byStation : Math.max(byStation, now - head.stamp_ns / 1e6 - clockMs);
}

export function foundWords({ lines, areas }) {
  const codes = areas.filter((area) => area.kind === "code").length;
  const parts = [lines.length && say("{n} line|{n} lines", { n: lines.length }), codes && say("{n} code|{n} codes", { n: codes })].filter(Boolean);
  return parts.join(", ") || say("nothing found");
}

// `picture` is an ImageBitmap, `head` says what was found in it: `lines` and `areas`.
export function drawPicture(canvas, picture, head) {
  const height = Math.round((WIDTH * picture.height) / picture.width);
  if (canvas.height !== height) canvas.height = height;
  const context = canvas.getContext("2d");
  context.drawImage(picture, 0, 0, WIDTH, height);
  const path = (points, closed) => {
    context.beginPath();
    for (const [x, y] of points) context.lineTo(x * WIDTH, y * height);
    if (closed) context.closePath();
  };
  context.lineCap = "round";
  for (const line of head.lines) {
    path(line.points, false);
    stroke(context, "#000a", 6);
    stroke(context, "#2fe0ff", 3);
  }
  for (const area of head.areas) {
    path(area.corners, true);
    stroke(context, "#000a", 4);
    stroke(context, area.kind === "code" ? "#7dff6b" : "#ffffffb0", 2);
    if (area.kind === "code") label(context, area, WIDTH, height);
  }
}

function stroke(context, colour, width) {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}

function label(context, area, width, height) {
  const x = Math.min(...area.corners.map((corner) => corner[0])) * width;
  const y = Math.min(...area.corners.map((corner) => corner[1])) * height - 5;
  context.font = "600 13px system-ui, sans-serif";
  context.lineWidth = 4;
  context.strokeStyle = "#000c";
  context.strokeText(area.text, x, Math.max(y, 14));
  context.fillStyle = "#7dff6b";
  context.fillText(area.text, x, Math.max(y, 14));
}
