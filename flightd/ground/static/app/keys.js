// Keys that work wherever the focus is: Escape stops; P and R where nobody types.
import { act } from "./acts.js";
import { mayOperate, mustSignIn } from "./access/session.js";
import { shown } from "./store.js";

export function listenForKeys() {
  window.addEventListener(
    "keydown",
    (event) => {
      if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || mustSignIn()) return;
      if (event.key === "Escape") {
        event.preventDefault();
        act("stop");
        return;
      }
      if (event.target.closest?.("input, textarea, select")) return;
      const command = { p: "pause", r: "resume" }[event.key.toLowerCase()];
      if (command === "resume" && !mayOperate()) return;
      if (command && shown().status?.possible.includes(command)) act(command);
    },
    { capture: true },
  );
}
