// What people decided about places that need a look, and which of them are still open.
import { english } from "../language.js";
import { signedInName } from "../access/session.js";
import { newId } from "../acts.js";
import { isGivenUp } from "../fetching.js";
import { asked } from "./stock_source.js";
import { byKey, change, differs, inOrder, sourceQuery, stock, tellTrouble } from "./stock_state.js";

export const DECISIONS = {
  __proto__: null,
  looking: { order: english("I look"), name: english("is looked at") },
  put_right: { order: english("Put right"), name: english("put right") },
  count_again: { order: english("Count again"), name: english("to be counted again") },
  fine: { order: english("Fine as it is"), name: english("fine as it is") },
  open: { order: english("Open again"), name: english("open again") },
};
const NEEDS_A_LOOK = new Set(["several", "unreadable", "occluded", "contradicted"]);
const CLOSING = new Set(["put_right", "fine"]);
const WHO = "flightd.who";

export async function loadDecisions() {
  const { source } = stock();
  if (source?.kind !== "store") return;
  try {
    const { decisions } = await (await asked(`/decisions?${sourceQuery(source)}`)).json();
    if (stock().source !== source) return;
    const byPlace = byKey({});
    for (const decision of decisions) (byPlace[decision.place] ??= []).push(decision);
    if (JSON.stringify(byPlace) !== JSON.stringify(stock().decisions)) change({ decisions: byPlace });
    tellTrouble("decisions", "");
  } catch (error) {
    if (!isGivenUp(error)) tellTrouble("decisions", error.message);
  }
}

// The newest decision that holds for what is shown of a place: one about an older look does not.
export function standing(code, { decisions, places }) {
  const newest = decisions[code]?.at(-1);
  return newest && (newest.seen_s ?? 0) >= (places[code]?.seen_s ?? 0) ? newest : undefined;
}

export const needsALook = (code, { places, expected }) =>
  NEEDS_A_LOOK.has(places[code]?.state) || differs(code, expected);

// The places that need a look or were ordered to be counted again: {code, decision, open}, as one
// walks along them.
export function exceptions(known) {
  return inOrder(known.fronts)
    .filter((code) => needsALook(code, known) || standing(code, known)?.what === "count_again")
    .map((code) => {
      const decision = standing(code, known);
      return { code, decision, open: !CLOSING.has(decision?.what) };
    });
}

let name = remembered();

export const who = () => name;

export function setWho(said) {
  name = said;
  try {
    localStorage.setItem(WHO, said);
  } catch {
    // a browser that keeps nothing asks again after the page was loaded anew
  }
}

function remembered() {
  try {
    return localStorage.getItem(WHO) ?? "";
  } catch {
    return "";
  }
}

// Note a decision about the look that is shown; throws an Error with words for a person.
export async function decide(place, what, note) {
  const { source, places } = stock();
  const seen = places[place]?.seen_s ?? null;
  await asked(`/decisions?${sourceQuery(source)}`, {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify({ id: newId(), place, what, who: signedInName() || who(), note, seen_s: seen }),
  });
  await loadDecisions();
}
