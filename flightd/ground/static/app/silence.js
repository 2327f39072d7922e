// Says what is wrong where the drone, or the station, is not heard.
import { hears } from "./hearing.js";
import { html } from "./html.js";

export function Silence() {
  const { good, text } = hears();
  return html`<div role="alert" class=${good ? "silence none" : "silence"}>${good ? "" : text}</div>`;
}
