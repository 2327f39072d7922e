// What is marked in a picture, as `labels.json` has it: places are pixels, (0, 0) in the middle of the first.

// From a box's or stroke's corner to corner, or a line's end to end.
export const box = (paint, [x0, y0], [x1, y1]) => ({
  paint, box: [Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0)], stroke: [], width: 1,
});

export const stroke = (paint, points, width) => ({ paint, box: null, stroke: thinned(points), width });

export const line = ([x1, y1], [x2, y2], thickness) => ({
  x1, y1, x2, y2, thickness, grade: "main", uncert_px: 0, uncert_deg: 0,
});

const APART_PX = 3;

// Points that are hardly apart say nothing more; a dot is a stroke, too.
function thinned(points) {
  const kept = [points[0]];
  for (const point of points) {
    const last = kept[kept.length - 1];
    if (Math.hypot(point[0] - last[0], point[1] - last[1]) >= APART_PX) kept.push(point);
  }
  if (kept.length < 2) kept.push([points[0][0] + 1, points[0][1]]);
  return kept.map(([x, y]) => [round(x), round(y)]);
}

export const round = (value) => Math.round(value * 10) / 10;

// A picture as it was before its last mark of that kind.
export function withoutLast(picture, kind) {
  if (kind === "line") return { lines: picture.lines.slice(0, -1) };
  return { regions: picture.regions.slice(0, -1) };
}

export function within([x, y], { width, height }) {
  return [Math.min(Math.max(x, 0), width - 1), Math.min(Math.max(y, 0), height - 1)];
}
