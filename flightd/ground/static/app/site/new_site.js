// A site from nothing: the few measures that are needed; the station draws equal aisles of them.
import { html, useRef, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { goTo } from "../router.js";
import { makeNew } from "./site_source.js";
import { Field } from "./field.js";
import { site } from "./site_state.js";

const number = (key, words, unit = "m", placeholder = "") => ({ key, words, kind: "number", unit, placeholder });
const SHELVES = [["both", english("on both sides")], ["left", english("on the left")], ["right", english("on the right")], ["none", english("none")]];
const FLOOR = [
  { key: "name", words: english("Name"), kind: "text" },
  number("aisles", english("Aisles"), ""),
  number("nodes", english("Nodes of each aisle"), ""),
  { key: "spacing_m", words: english("From node to node (a list repeats)"), kind: "numbers", unit: "m" },
  number("pitch_m", english("From aisle to aisle")),
  { key: "line_colour", words: english("Colour of the paint"), kind: "paint", normal: "yellow" },
  { key: "shelves", words: english("Shelves, seen along +x"), kind: "choice", options: SHELVES },
  number("shelf_distance_m", english("Line to shelf front")),
  number("shelf_height_m", english("Height of the shelves")),
  number("ceiling_m", english("Lowest thing under the roof"), "m", english("not measured")),
];
const RACKS = [
  { key: "levels_m", words: english("Heights of the labels"), kind: "numbers", unit: "m" },
  number("bay_width_m", english("Width of a bay")),
  number("positions", english("Places in a bay on each level"), ""),
];

export function NewSite() {
  const [, redraw] = useState(0);
  const measures = useRef({ floor: {
    name: say("my hall"), aisles: 2, nodes: 6, spacing_m: [1.5], pitch_m: 3, line_colour: "yellow", shelves: "both", shelf_distance_m: 1.2, shelf_height_m: 3,
  }, racks: { levels_m: [0.3, 1.5], bay_width_m: 1.35, positions: 1 }, withRacks: true });
  const { withRacks } = measures.current;
  const set = (changes) => {
    Object.assign(measures.current, changes); // Enter sends the form before the next drawing
    redraw((times) => times + 1);
  };
  const draw = async (event) => {
    event.preventDefault();
    if (site().busy) return; // the button keeps the focus meanwhile
    const { floor, racks, withRacks } = measures.current;
    const isPlaced = withRacks && floor.shelves !== "none";
    if (await makeNew({ ...floor, ...(isPlaced && { racks }) })) goTo("/site/edit");
  };
  const fields = (known, part) =>
    known.map((field) => html`<${Field} key=${field.key} field=${field} values=${measures.current[part]} onValue=${(changes) => set({ [part]: { ...measures.current[part], ...changes } })} />`);
  return html`
    <form class="site-home" onSubmit=${draw}>
      <h2>${say("New site")}</h2>
      <p class="quiet">${say("Equal aisles, joined at both ends, with the pad at A1. Everything can be changed on the drawing afterwards.")}</p>
      ${site().trouble && html`<p class="site-trouble" role="alert">${quoted(site().trouble)}</p>`}
      <section class="card" aria-labelledby="new-floor"><h3 id="new-floor">${say("Floor")}</h3><div class="element-fields wide">${fields(FLOOR, "floor")}</div></section>
      <section class="card" aria-labelledby="new-racks"><h3 id="new-racks">${say("Racks")}</h3>
        <label class="check"><input type="checkbox" checked=${withRacks} onChange=${(event) => set({ withRacks: event.target.checked })} /> ${say("Racks along every aisle with shelves")}</label>
        ${withRacks && html`<div class="element-fields wide">${fields(RACKS, "racks")}</div>`}
      </section>
      <div class="site-orders"><button class="order main-order" type="submit" aria-disabled=${site().busy}>${site().busy ? say("Drawing …") : say("Draw it")}</button><a class="order" href="/site">${say("Cancel")}</a></div>
    </form>
  `;
}
