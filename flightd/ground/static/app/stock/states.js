// The states of a place, in the order of the legend: word, mark in the cell, what it means.
export const STATES = {
  __proto__: null,
  read: { name: "Read", mark: "", means: "one code, vouched for" },
  several: { name: "Several codes", mark: "2+", means: "more than one code in one place" },
  empty: { name: "Empty", mark: "", means: "seen to be empty" },
  unreadable: { name: "Unreadable", mark: "?", means: "goods, but no label that can be read" },
  occluded: { name: "Occluded", mark: "×", means: "something covers the place" },
  contradicted: { name: "Contradicted", mark: "!", means: "seen, and withdrawn: the drone may have been elsewhere" },
  not_visited: { name: "Never counted", mark: "", means: "no picture showed it" },
};

export const COUNTED = new Set(["read", "several", "empty"]);

export function placeWords(code, place) {
  const parts = [code, STATES[place.state].name.toLowerCase()];
  if (place.pending) parts.push("not booked yet");
  return [...parts, ...place.texts].join(", ");
}
