// Makes a flight of places that are to be counted again, and goes to it on Missions.
import { isGivenUp } from "../fetching.js";
import { html, useState } from "../html.js";
import { quoted } from "../language.js";
import { recount } from "../missions/missions_source.js";
import { goTo } from "../router.js";
import { stock } from "./stock_state.js";

export function RecountButton({ places, children }) {
  const [trouble, setTrouble] = useState("");
  const plan = async () => {
    setTrouble("");
    try {
      await recount(stock().source.name, places);
      goTo("/missions");
    } catch (error) {
      if (!isGivenUp(error)) setTrouble(error.message);
    }
  };
  return html`
    <div class="recount">
      <button class="order" onClick=${plan}>${children}</button>
      ${trouble && html`<p class="refusal" role="alert">${quoted(trouble)}</p>`}
    </div>
  `;
}
