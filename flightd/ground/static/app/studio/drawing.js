// Draws the picture in hand: what a profile sees of it, the lines that are found, what is marked, the cursor.
const MARKS = { true: "#ff2fc0", false: "#36d1ff" };

export function drawAll(canvas, { picture, mask, label, began, cursor, focused }) {
  const context = canvas.getContext("2d");
  const { width, height } = canvas;
  context.clearRect(0, 0, width, height);
  if (picture) context.drawImage(picture, 0, 0, width, height);
  if (mask?.picture) {
    context.imageSmoothingEnabled = false;
    context.drawImage(mask.picture, 0, 0, width, height);
    for (const line of mask.head.lines) {
      const points = line.points.map(([x, y]) => [x * width, y * height]);
      path(context, points);
      both(context, "#7dff6b", 2);
    }
  }
  for (const region of label?.regions ?? []) drawRegion(context, region);
  for (const line of label?.lines ?? []) drawLine(context, line);
  if (began) drawBegun(context, began, cursor);
  if (focused) drawCursor(context, cursor);
}

function drawRegion(context, region) {
  if (region.box) {
    context.beginPath();
    context.rect(...region.box);
  } else {
    path(context, region.stroke);
  }
  if (!region.box) {
    context.globalAlpha = 0.35;
    context.lineCap = "butt";
    context.lineWidth = region.width;
    context.strokeStyle = MARKS[region.paint];
    context.stroke();
    context.globalAlpha = 1;
  }
  both(context, MARKS[region.paint], 1.5);
}

function drawLine(context, { x1, y1, x2, y2 }) {
  path(context, [[x1, y1], [x2, y2]]);
  both(context, "#ffd23f", 2);
  for (const [x, y] of [[x1, y1], [x2, y2]]) {
    context.beginPath();
    context.arc(x, y, 4, 0, 7);
    context.fillStyle = "#ffd23f";
    context.fill();
  }
}

function drawBegun(context, began, cursor) {
  const { kind, points } = began;
  if (kind === "box") {
    const [x, y] = points[0];
    context.beginPath();
    context.rect(x, y, cursor[0] - x, cursor[1] - y);
  } else {
    path(context, kind === "line" ? [points[0], cursor] : [...points, cursor]);
  }
  both(context, "#ffffff", 2);
}

function drawCursor(context, [x, y]) {
  for (const ends of [[[x - 12, y], [x + 12, y]], [[x, y - 12], [x, y + 12]]]) {
    path(context, ends);
    both(context, "#ffffff", 2);
  }
}

function path(context, points) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(x, y);
}

function both(context, colour, width) {
  context.lineCap = "round";
  context.strokeStyle = "#000a";
  context.lineWidth = width + 2;
  context.stroke();
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.stroke();
}
