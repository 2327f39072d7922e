// From place to place by keys: on a front as it is seen, and from front to front at its ends.

// The place that an arrow key leads to from `code`, or undefined.
export function neighbour(fronts, code, key) {
  const at = fronts.findIndex((front) => front.spots.some(([other]) => other === code));
  if (at < 0) return undefined;
  const rows = rowsOf(fronts[at]);
  const row = rows.findIndex((cells) => cells.some((cell) => cell?.code === code));
  const column = rows[row].findIndex((cell) => cell?.code === code);
  if (key === "Home") return rows[row].find(Boolean).code;
  if (key === "End") return rows[row].findLast(Boolean).code;
  if (key === "ArrowRight") return rows[row].slice(column + 1).find(Boolean)?.code ?? beside(fronts, at + 1, row, 0);
  if (key === "ArrowLeft") return rows[row].slice(0, column).findLast(Boolean)?.code ?? beside(fronts, at - 1, row, -1);
  const step = { ArrowUp: -1, ArrowDown: 1 }[key];
  if (!step) return undefined;
  for (let next = row + step; next >= 0 && next < rows.length; next += step) {
    if (rows[next][column]) return rows[next][column].code;
  }
  return undefined;
}

// The cells of a front, the highest level first: rows of {code, bay, level, position}, null where there is none.
export function rowsOf(front) {
  const cells = front.spots.map(([code, bay, level, position]) => ({ code, bay, level, position }));
  if (!front.placed) return [cells];
  const columns = columnsOf(front);
  const levels = [...new Set(cells.map(({ level }) => level))].sort((a, b) => b - a);
  return levels.map((level) =>
    columns.map(
      ([bay, position]) =>
        cells.find((cell) => cell.level === level && cell.bay === bay && cell.position === position) ?? null,
    ),
  );
}

// [bay, position] of each column, as they stand from left to right.
function columnsOf({ spots, mirrored }) {
  const way = mirrored ? -1 : 1;
  const columns = new Map(spots.map(([, bay, , position]) => [`${bay} ${position}`, [bay, position]]));
  return [...columns.values()].sort((a, b) => way * (a[0] - b[0] || a[1] - b[1]));
}

function beside(fronts, at, row, end) {
  const rows = at >= 0 && at < fronts.length ? rowsOf(fronts[at]) : [];
  return rows[Math.min(row, rows.length - 1)]?.filter(Boolean).at(end)?.code;
}
