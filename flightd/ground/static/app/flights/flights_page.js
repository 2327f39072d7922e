// The flights: their list at /flights, one played back at /flights/ID, two at /flights/compare?a=ID&b=ID.
import { html } from "../html.js";
import { Comparison } from "./comparison.js";
import { FlightList } from "./flight_list.js";
import { Replay } from "./replay.js";

export default function FlightsPage({ route }) {
  if (!route.rest) return html`<${FlightList} route=${route} />`;
  if (route.rest === "compare") {
    const [a, b] = [route.query.get("a") ?? "", route.query.get("b") ?? ""];
    return html`<${Comparison} key=${`${a} ${b}`} ids=${[a, b]} />`;
  }
  return html`<${Replay} key=${route.rest} id=${route.rest} />`;
}
