// The paints that have a name, each with its tone in good light; any other paint is told by its tone, #rrggbb.
export const PAINTS = {
  yellow: "#ecbe26",
  white: "#e8e8e2",
  red: "#b02826",
  blue: "#2254a8",
  green: "#2c8a48",
  black: "#1e1d1c",
  orange: "#de621a",
};

export const isTone = (paint) => /^#[0-9a-f]{6}$/i.test(paint);

export const toneOf = (paint) => PAINTS[paint] ?? (isTone(paint) ? paint : "none");
