// How bright a picture is: its levels counted, its middle, what is lost at both ends; as the drone's doctor counts.
const BLACK = 4; // a sample whose brightest channel is no more has lost what it showed
const BURNT = 252; // and one that is no less
export const BINS = 64;

// `data` as a canvas tells it: red, green, blue and alpha of each pixel.
export function brightnessOf(data) {
  const levels = new Uint32Array(256);
  let black = 0;
  let burnt = 0;
  for (let at = 0; at < data.length; at += 4) {
    const [red, green, blue] = [data[at], data[at + 1], data[at + 2]];
    const brightest = Math.max(red, green, blue);
    if (brightest <= BLACK) black += 1;
    if (brightest >= BURNT) burnt += 1;
    levels[Math.round((red + green + blue) / 3)] += 1;
  }
  const all = data.length / 4;
  return { median: middleOf(levels, all), black: black / all, burnt: burnt / all, bins: binned(levels, all) };
}

function middleOf(levels, all) {
  let seen = 0;
  for (let level = 0; level < 256; level += 1) {
    seen += levels[level];
    if (2 * seen >= all) return level;
  }
  return 255;
}

// Shares of the picture, from dark to bright.
function binned(levels, all) {
  const bins = new Array(BINS).fill(0);
  levels.forEach((many, level) => {
    bins[Math.floor((level * BINS) / 256)] += many / all;
  });
  return bins;
}
