// Who flies the drone where a fleet's manager may: he, or whoever sits here.
import { askJson } from "../fetching.js";
import { html } from "../html.js";
import { quoted, say } from "../language.js";
import { shown, state, update } from "../store.js";

export function Manager() {
  const { manager } = shown();
  if (!manager) return null;
  const words = manager.flies
    ? say("The fleet’s manager flies this drone. Whatever you order takes it over.")
    : say("People fly this drone, the fleet’s manager waits.");
  return html`
    <p class="quiet" role="status">${words}</p>
    ${manager.refused && html`<p class="outcome refused" role="alert">${quoted(manager.refused)}</p>`}
    <div class="buttons">
      <button class="order" onClick=${() => handOver(state.selected, !manager.flies)}>
        ${manager.flies ? say("Take over") : say("Give it to the fleet’s manager")}
      </button>
    </div>
  `;
}

// What became of it the station tells by its topic `manager`.
export async function handOver(drone, flies) {
  try {
    await askJson(`/drones/${encodeURIComponent(drone)}/manager`, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ flies }),
      goesOn: true,
    });
  } catch (error) {
    update((s) => {
      const known = s.drones.get(drone);
      if (known) s.drones.set(drone, { ...known, manager: { ...known.manager, refused: error.message } });
    });
  }
}
