// Places that a person selects one by one to have them counted again.
import { change, stock } from "./stock_state.js";

export const isSelected = (code) => stock().selected.has(code);

export function toggleSelected(code) {
  const selected = new Set(stock().selected);
  if (!selected.delete(code)) selected.add(code);
  change({ selected });
}

export const clearSelection = () => change({ selected: new Set() });
