// One plot over time: uPlot for the curves; ours are the bands of the phases, the marks and the line at the time.
import { html, useEffect, useRef } from "../html.js";
import { language, plain, say } from "../language.js";
import { number } from "../words.js";
import uPlot from "../../vendor/uplot.module.js";
import { clock } from "./figures.js";
import { valueRange } from "./plot_list.js";

const HEIGHT = 132;
const AXIS = 46;

// `data` is uPlot's: [times, ...values], one row for each of `curves`; `shown` [from, to] in seconds.
// `values` are the numbers of the curves at the time `at`.
export function Plot({ plot, curves, data, shown, bands, marks, at, values, onSeek }) {
  const holder = useRef(null);
  const drawn = useRef(null);
  const now = useRef({});
  now.current = { shown, bands, marks, onSeek, at };
  useEffect(() => {
    const chart = made(holder.current, plot, curves, now);
    drawn.current = chart;
    const size = new ResizeObserver(() => chart.setSize({ width: holder.current.clientWidth, height: HEIGHT }));
    size.observe(holder.current);
    const theme = matchMedia("(prefers-color-scheme: dark)");
    const redraw = () => chart.redraw(false);
    theme.addEventListener("change", redraw);
    return () => {
      size.disconnect();
      theme.removeEventListener("change", redraw);
      chart.destroy();
      drawn.current = null;
    };
  }, [plot, curves]);
  useEffect(() => {
    drawn.current?.setData(backwards(data), false);
    drawn.current?.setScale("x", { min: shown[0], max: shown[1] });
    moveLine(drawn.current, now.current);
  }, [data, shown[0], shown[1], curves]);
  useEffect(() => {
    drawn.current?.redraw(false); // true would take back the scale that is being set
  }, [bands, marks, language()]);
  useEffect(() => moveLine(drawn.current, now.current), [at]);
  const name = `${say(plot.name)}, ${plot.unit}`;
  return html`
    <figure class="card plot">
      <figcaption>
        <strong>${say(plot.name)} <small class="quiet">${plot.unit}</small></strong>
        ${curves.map(
          (curve, place) => html`
            <span key=${curve.key} class="curve"><i class=${`line-${curve.role}`} />${say(curve.name)} <b>${number(values[place], plot.digits).replace("-", "−")}</b></span>
          `,
        )}
      </figcaption>
      <div class="chart" ref=${holder} role="img" aria-label=${say("{name}, over time", { name })} />
    </figure>
  `;
}

function made(holder, plot, curves, now) {
  const css = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = { stroke: css("--quiet"), grid: { stroke: css("--edge"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
  const options = {
    width: Math.max(holder.clientWidth, 1),
    height: HEIGHT,
    padding: [6, 14, 0, 0],
    legend: { show: false },
    cursor: { show: false },
    scales: {
      x: { time: false },
      y: { range: (_, low, high) => valueRange(plot, low, high) },
    },
    axes: [
      { ...axis, size: 22, values: (_, times) => times.map((time) => (time < 0 ? `−${clock(-time)}` : clock(time))), space: 60, incrs: [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600] },
      { ...axis, size: AXIS, space: 26, values: (_, marks) => marks.map((mark) => plain(+mark.toFixed(3)).replace("-", "−")) },
    ],
    series: [
      {},
      ...curves.toReversed().map((curve) => ({
        label: curve.name,
        stroke: css(`--line-${curve.role}`),
        width: curve.role.startsWith("own") ? 1.75 : 1.25,
        dash: curve.role.endsWith("goal") ? [5, 4] : undefined,
        points: { show: false },
      })),
    ],
    hooks: {
      drawClear: [(chart) => drawBands(chart, now.current.bands ?? [])],
      draw: [(chart) => drawMarks(chart, now.current.marks ?? [])],
      setSize: [(chart) => moveLine(chart, now.current)],
      ready: [(chart) => followPointer(chart, now)],
    },
  };
  return new uPlot(options, [[], ...curves.map(() => [])], holder);
}

// The curve that is named first is drawn last, over the others.
const backwards = ([times, ...values]) => [times, ...values.reverse()];

function drawBands(chart, bands) {
  const { ctx, bbox } = chart;
  const style = getComputedStyle(document.documentElement);
  const { min, max } = chart.scales.x;
  ctx.save();
  for (const band of bands) {
    if (band.to < min || band.from > max) continue;
    const [from, to] = [Math.max(band.from, min), Math.min(band.to, max)].map((time) => chart.valToPos(time, "x", true));
    ctx.globalAlpha = 0.5;
    ctx.fillStyle = style.getPropertyValue(`--tone-${band.tone}`).trim();
    ctx.fillRect(from, bbox.top, to - from, bbox.height);
  }
  ctx.restore();
}

function drawMarks(chart, marks) {
  const { ctx, bbox } = chart;
  const { min, max } = chart.scales.x;
  const style = getComputedStyle(document.documentElement);
  const dot = devicePixelRatio;
  ctx.save();
  for (const mark of marks) {
    if (mark.t_s < min || mark.t_s > max) continue;
    const x = chart.valToPos(mark.t_s, "x", true);
    ctx.fillStyle = style.getPropertyValue(mark.level === "error" ? "--bad" : "--warn").trim();
    ctx.beginPath();
    ctx.moveTo(x - 4 * dot, bbox.top);
    ctx.lineTo(x + 4 * dot, bbox.top);
    ctx.lineTo(x, bbox.top + 7 * dot);
    ctx.fill();
    ctx.globalAlpha = 0.5;
    ctx.fillRect(x - dot / 2, bbox.top, dot, bbox.height);
    ctx.globalAlpha = 1;
  }
  ctx.restore();
}

function moveLine(chart, { at }) {
  if (!chart) return;
  const { min, max } = chart.scales.x;
  const line = chart.over.querySelector(".at-time") ?? chart.over.appendChild(Object.assign(document.createElement("div"), { className: "at-time" }));
  line.hidden = !(at >= min && at <= max);
  line.style.transform = `translateX(${chart.valToPos(at, "x")}px)`;
}

// A click, or a drag, goes to the time under it.
function followPointer(chart, now) {
  const go = (event) => {
    const { left } = chart.over.getBoundingClientRect();
    now.current.onSeek(chart.posToVal(event.clientX - left, "x"));
  };
  chart.over.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    chart.over.setPointerCapture(event.pointerId);
    go(event);
  });
  chart.over.addEventListener("pointermove", (event) => event.buttons & 1 && go(event));
}
