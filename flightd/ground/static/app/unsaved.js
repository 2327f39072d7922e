// What is lost with the page, on whichever page it was made: the browser asks before it is closed or loaded anew.
import { state } from "./store.js";

const isSiteChanged = () => state.site?.draft !== state.site?.kept;
const areSettingsTyped = () => Object.values(state.typedSettings).some((changes) => Object.keys(changes).length > 0);

export function askBeforeLoss() {
  window.addEventListener("beforeunload", (event) => {
    if (isSiteChanged() || areSettingsTyped()) event.preventDefault();
  });
}
