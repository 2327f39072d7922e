// Said where none are there yet: how flights, and the stock that they count, get to the station.
import { html } from "./html.js";
import { say, sayWith } from "./language.js";

export const HowFlightsCome = () => html`<p class="quiet">${sayWith("Flights are those under {folder}; {flights} adds the folder that a daemon on this computer fills, or a copy from a drone.", { folder: html`<code>--folder</code>`, flights: html`<code>--flights</code>` })} <a href="/guide/service#as-a-ground-station">${say("How they get here")}</a></p>`;
