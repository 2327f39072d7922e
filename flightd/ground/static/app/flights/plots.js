// All plots of one flight, or of two over each other, on one axis of time.
import { html, useMemo } from "../html.js";
import { english, say } from "../language.js";
import uPlot from "../../vendor/uplot.module.js";
import { phaseSpans, valueAt } from "./at_time.js";
import { scaled, timesOf, useSeries } from "./curves.js";
import { flightsState } from "./flights_state.js";
import { Plot } from "./plot.js";
import { PLOTS, shownSpan } from "./plot_list.js";
import { seek } from "./playing.js";
import { toneLegend, toneOf } from "./tones.js";

// `flight` is what the station told of it, `span` {low, high}; `marks` what went wrong, with its times.
export function Plots({ id, flight, span, marks }) {
  const { at, span: zoom } = flightsState().playing;
  const [from, to] = shownSpan(at, zoom, span.low, span.high);
  const series = useSeries(id, from, to);
  const spans = useMemo(() => phaseSpans(flight), [flight]);
  const bands = useMemo(() => spans.map((one) => ({ ...one, tone: toneOf(one.phase) })), [spans]);
  const shown = useMemo(() => (series ? PLOTS.map((plot) => ownPlot(plot, series)).filter(Boolean) : []), [series]);
  const kept = useStableCurves(shown);
  if (!series) return html`<p class="loading quiet" role="status">${say("Loading the plots …")}</p>`;
  return html`
    <section class="plots" aria-label=${say("Over time")}>
      ${shown.map(
        ({ plot, data }, place) => html`
          <${Plot}
            key=${plot.key} plot=${plot} curves=${kept[place]} data=${data} shown=${[from, to]} bands=${bands} marks=${marks} at=${at}
            values=${kept[place].map((curve) => times(valueAt(series, curve.key, at), plot.scale))} onSeek=${(time) => seek(time, span)}
          />
        `,
      )}
      <${Tones} spans=${spans} />
    </section>
  `;
}

// The same quantities of two flights.  `flights` are two {id, flight, shift}: shift is added to a flight's times.
export function ComparedPlots({ flights, span }) {
  const { at, span: zoom } = flightsState().playing;
  const [from, to] = shownSpan(at, zoom, span.low, span.high);
  const series = flights.map(({ id, flight, shift }) =>
    useSeries(id, Math.max(from - shift, 0), Math.min(to - shift, flight.duration_s)),
  );
  const shifts = flights.map(({ shift }) => shift);
  const shown = useMemo(
    () => (series.every(Boolean) ? PLOTS.map((plot) => pairPlot(plot, series, shifts)).filter(Boolean) : []),
    [...series, ...shifts],
  );
  const kept = useStableCurves(shown);
  if (!series.every(Boolean)) return html`<p class="loading quiet" role="status">${say("Loading the plots …")}</p>`;
  return html`
    <section class="plots" aria-label=${say("Over time")}>
      ${shown.map(
        ({ plot, data }, place) => html`
          <${Plot}
            key=${plot.key} plot=${plot} curves=${kept[place]} data=${data} shown=${[from, to]} at=${at}
            values=${series.map((one, which) => times(valueAt(one, bestOf(plot, series), at - shifts[which]), plot.scale))}
            onSeek=${(time) => seek(time, span)}
          />
        `,
      )}
    </section>
  `;
}

function Tones({ spans }) {
  return html`
    <ul class="legend tones" aria-label=${say("Phases")}>
      ${toneLegend(spans).map(([tone, name]) => html`<li key=${tone}><i class=${`swatch tone-${tone}`} />${say(name)}</li>`)}
    </ul>
  `;
}

const times = (value, scale = 1) => (value == null ? null : value * scale);

function ownPlot(plot, series) {
  const curves = plot.curves.filter((curve) => series.curves[curve.key]);
  if (!curves.length) return null;
  return { plot, curves, data: [timesOf(series), ...curves.map((curve) => scaled(series, curve.key, plot.scale))] };
}

// The truth where both flights have it, else what both measured.
function bestOf(plot, series) {
  const both = plot.curves.filter((curve) => series.every((one) => one.curves[curve.key]));
  return (both.find((curve) => curve.role === "truth") ?? both.find((curve) => curve.role === "own"))?.key;
}

function pairPlot(plot, series, shifts) {
  const key = bestOf(plot, series);
  if (!key) return null;
  const tables = series.map((one, which) => [timesOf(one, shifts[which]), scaled(one, key, plot.scale)]);
  const curves = [english("first"), english("second")].map((role, which) => ({ key: `${key} ${which}`, name: role, role: `own-${role}` }));
  return { plot, curves, data: uPlot.join(tables) };
}

// A chart is made anew only where other curves are shown than before.
function useStableCurves(shown) {
  const names = shown.map(({ curves }) => curves.map((curve) => curve.key).join(" ")).join("|");
  return useMemo(() => shown.map(({ curves }) => curves), [names]);
}
