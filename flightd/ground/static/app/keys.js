// Escape stops, on every page and wherever the focus is; P and R are of the page Live, where nobody types.
import { act } from "./acts.js";
import { isOver, mayOperate, mustSignIn } from "./access/session.js";
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
      if (mustSignIn() || state.route.page?.path !== "/" || event.target.closest?.("input, textarea, select")) return;
      const command = { p: "pause", r: "resume" }[event.key.toLowerCase()];
      if (command === "resume" && !mayOperate()) return;
      if (command && shown().status?.possible.includes(command)) act(command);
    },
    { capture: true },
  );
}
