// Escape stops, on every page and wherever the focus is; P and R are of the page Live, where nobody types, and can be
// switched off.
import { act } from "./acts.js";
import { isOver, mayOperate, mustSignIn } from "./access/session.js";
import { hasSingleKeys } from "./single_keys.js";
import { shown, state } from "./store.js";

export function listenForKeys() {
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || (mustSignIn() && !isOver())) return;
      if (event.key === "Escape") {
        event.preventDefault();
        act("stop");
        return;
      }
      if (!hasSingleKeys() || mustSignIn() || state.route.page?.path !== "/" || event.target.closest?.("input:not([type=checkbox]), textarea, select")) return;
      const command = { p: "pause", r: "resume" }[event.key.toLowerCase()];
      if (command === "resume" && !mayOperate()) return;
      if (command && shown().status?.possible.includes(command)) act(command);
    },
    { capture: true },
  );
}
