// A button that acts only when it is held, by mouse, finger or key: what moves a drone needs more than a touch.
import { html, useEffect, useRef, useState } from "../html.js";
import { say } from "../language.js";

const HOLD_MS = 1000;

export function HoldButton({ disabled, onHeld, children }) {
  const [held, setHeld] = useState(false);
  const [hint, setHint] = useState(false);
  const timer = useRef(0);

  const begin = () => {
    if (disabled || timer.current) return;
    setHeld(true);
    setHint(false);
    timer.current = setTimeout(() => {
      timer.current = 0;
      setHeld(false);
      onHeld();
    }, HOLD_MS);
  };
  const end = () => {
    if (!timer.current) return;
    clearTimeout(timer.current);
    timer.current = 0;
    setHeld(false);
    setHint(true);
  };
  useEffect(() => () => clearTimeout(timer.current), []);

  const isPress = (event) => event.key === " " || event.key === "Enter";
  return html`
    <button
      class=${held ? "hold held" : "hold"}
      aria-disabled=${disabled}
      onPointerDown=${(event) => event.button === 0 && begin()}
      onPointerUp=${end}
      onPointerLeave=${end}
      onPointerCancel=${end}
      onBlur=${end}
      onKeyDown=${(event) => isPress(event) && (event.preventDefault(), begin())}
      onKeyUp=${(event) => isPress(event) && end()}
      onContextMenu=${(event) => event.preventDefault()}
    >
      <span class="fill" aria-hidden="true" /><span class="label">${children}</span>
      <small>${hint ? say("keep holding") : say("hold")}</small>
    </button>
  `;
}
