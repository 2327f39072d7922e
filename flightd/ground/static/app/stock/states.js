// The states of a place, in the order of the legend: word, mark in the cell, what it means.
import { english, say } from "../language.js";

export const STATES = {
  __proto__: null,
  read: { name: english("Read"), mark: "", means: english("one code, vouched for") },
  several: { name: english("Several codes"), mark: "2+", means: english("more than one code in one place") },
  empty: { name: english("Empty"), mark: "", means: english("seen to be empty") },
  unreadable: { name: english("Unreadable"), mark: "?", means: english("goods, but no label that can be read") },
  occluded: { name: english("Occluded"), mark: "×", means: english("something covers the place") },
  contradicted: { name: english("Contradicted"), mark: "!", means: english("seen, and withdrawn: the drone may have been elsewhere") },
  not_visited: { name: english("Never counted"), mark: "", means: english("no picture showed it") },
};

export const COUNTED = new Set(["read", "several", "empty"]);

// In the middle of a sentence.
const small = (text) => text.charAt(0).toLowerCase() + text.slice(1);

export const rackWords = (aisle, side) =>
  side ? say("Aisle {aisle}, {side}", { aisle, side: say(side) }) : say("Rack {rack}", { rack: aisle });

export function placeWords(code, place) {
  const parts = [code, small(say(STATES[place.state].name))];
  if (place.pending) parts.push(say("not booked yet"));
  return [...parts, ...place.texts].join(", ");
}
