// The picture in hand: paint and floor are shown with strokes or boxes, lines by two clicks; by mouse, finger or keys.
import { mayOperate } from "../access/session.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, quoted, say, sayWith } from "../language.js";
import { percent } from "../words.js";
import { drawAll } from "./drawing.js";
import { box, line, round, stroke, within, withoutLast } from "./marks.js";
import { asked, change, chooseMask, choosePicture, mark, pictureHref, pictureInHand, setPath, studio, told } from "./studio_state.js";

const TOOLS = [["paint", english("Paint"), "1"], ["floor", english("Floor"), "2"], ["line", english("Line"), "3"]];
const SHAPES = [["stroke", english("Stroke")], ["box", english("Box")]];
const STEP_PX = 4;
const FAR_PX = 24;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export function PictureCard() {
  const label = pictureInHand();
  const [tool, setTool] = useState("paint");
  const [shape, setShape] = useState("stroke");
  const [width, setWidth] = useState(12);
  const [made, setMade] = useState({ file: "", kinds: [] }); // of marks in the picture in hand, newest last
  if (!label) return null;
  const kinds = made.file === label.file ? made.kinds : [];
  const setKinds = (now) => setMade({ file: label.file, kinds: now });
  const add = (kind, points) => {
    setKinds([...kinds, kind]);
    if (kind === "line") return mark({ lines: [...label.lines, line(points[0], points[1], width)], negative: false });
    const region = kind === "box" ? box(tool === "paint", points[0], points[1]) : stroke(tool === "paint", points, width);
    return mark({ regions: [...label.regions, region] });
  };
  const undo = () => {
    const kind = kinds[kinds.length - 1] ?? (label.lines.length ? "line" : "region");
    setKinds(kinds.slice(0, -1));
    mark(withoutLast(label, kind));
  };
  return html`
    <section class="card picture-card" aria-label=${say("Picture")}>
      ${mayOperate() &&
      html`<div class="tools">
        <${Choice} name=${say("Mark")} options=${TOOLS} chosen=${tool} choose=${setTool} />
        ${tool !== "line" && html`<${Choice} name=${say("With")} options=${SHAPES} chosen=${shape} choose=${setShape} />`}
        <label class="field">${say(tool === "line" ? english("Width of the paint {width} px") : english("Width {width} px"), { width })}
          <input type="range" min="2" max="80" value=${width} onInput=${(event) => setWidth(Number(event.target.value))} />
        </label>
        <button class="order" disabled=${!label.regions.length && !label.lines.length} onClick=${undo}>${say("Undo")}</button>
      </div>`}
      <${Canvas} key=${label.file} label=${label} kind=${tool === "line" ? "line" : shape} onMark=${add} onUndo=${undo} setTool=${setTool} />
      <${MaskRow} />
      ${mayOperate() && html`<${PictureRow} label=${label} />`}
    </section>
  `;
}

function Choice({ name, options, chosen, choose }) {
  return html`
    <fieldset class="choice"><legend>${name}</legend>
      ${options.map(
        ([key, words, hint]) => html`
          <button key=${key} type="button" class="tab" aria-pressed=${key === chosen} onClick=${() => choose(key)}>${say(words)}${hint && html` <kbd>${hint}</kbd>`}</button>
        `,
      )}
    </fieldset>
  `;
}

function Canvas({ label, kind, onMark, onUndo, setTool }) {
  const canvas = useRef(null);
  const [picture, setPicture] = useState(null);
  const [cursor, setCursor] = useState([label.width / 2, label.height / 2]);
  const [began, setBegan] = useState(null); // {kind, points, byMouse}
  const [focused, setFocused] = useState(false);
  const { mask } = studio();
  useEffect(() => {
    const image = new Image();
    image.src = pictureHref(label.file);
    image.decode().then(() => setPicture(image), () => change({ trouble: english("the picture cannot be shown") }));
  }, [label.file]);
  useEffect(() => drawAll(canvas.current, { picture, mask, label, began, cursor, focused }));
  const at = (event) => {
    const seen = canvas.current.getBoundingClientRect();
    const x = ((event.clientX - seen.left) * label.width) / seen.width - 0.5;
    const y = ((event.clientY - seen.top) * label.height) / seen.height - 0.5;
    return within([round(x), round(y)], label);
  };
  const begin = (point, byMouse) => setBegan({ kind, points: [point], byMouse });
  const end = (point) => {
    setBegan(null);
    const points = [...began.points, point];
    if (began.kind !== "stroke" && Math.hypot(point[0] - points[0][0], point[1] - points[0][1]) < 2) return;
    onMark(began.kind, began.kind === "stroke" ? points : [points[0], point]);
  };
  const down = (event) => {
    if (event.button !== 0) return;
    const point = at(event);
    setCursor(point);
    if (kind === "line" && began) return end(point);
    if (kind !== "line") canvas.current.setPointerCapture(event.pointerId);
    begin(point, kind !== "line");
  };
  const move = (event) => {
    if (!began) return;
    const point = at(event);
    setCursor(point);
    if (began.byMouse && began.kind === "stroke") setBegan({ ...began, points: [...began.points, point] });
  };
  const up = (event) => began?.byMouse && end(at(event));
  const key = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = ARROWS[event.key];
    if (way) {
      const far = event.shiftKey ? FAR_PX : STEP_PX;
      setCursor(within([cursor[0] + way[0] * far, cursor[1] + way[1] * far], label));
      if (began?.kind === "stroke") setBegan({ ...began, points: [...began.points, cursor] });
    } else if (event.key === " " || event.key === "Enter") {
      if (began) end(cursor);
      else begin(cursor, false);
    } else if (event.key === "Backspace" || event.key === "Delete") {
      if (began) setBegan(null);
      else onUndo();
    } else {
      const tool = TOOLS.find(([, , digit]) => digit === event.key);
      if (!tool) return;
      setTool(tool[0]);
    }
    event.preventDefault();
  };
  if (!mayOperate()) return html`<canvas ref=${canvas} class="seen-only" width=${label.width} height=${label.height} role="img" aria-label=${say("Picture")} />`;
  return html`
    <canvas
      ref=${canvas} class="hand" width=${label.width} height=${label.height} tabindex="0" role="application"
      aria-label=${say("Picture to mark in")} aria-describedby="mark-help"
      onPointerDown=${down} onPointerMove=${move} onPointerUp=${up} onPointerCancel=${() => setBegan(null)} onKeyDown=${key}
      onFocus=${() => setFocused(true)} onBlur=${() => setFocused(false)}
    />
    <p id="mark-help" class="quiet">${kind === "line" ? say("Click where the line enters the picture, and where it leaves it.") : say("Draw over what you mean.")}
      ${" "}${sayWith("By keys: arrows move the cursor (with {shift} farther), {space} begins and ends a mark, {delete} takes the last one away.", {
        shift: html`<kbd>${say("Shift")}</kbd>`, space: html`<kbd>${say("Space")}</kbd>`, delete: html`<kbd>⌫</kbd>`,
      })}
      <span class="unseen" role="status">${focused ? say(began ? english("Cursor at {place}, marking") : english("Cursor at {place}"), { place: cursor.map(Math.round).join(", ") }) : ""}</span></p>
  `;
}

function MaskRow() {
  const { mask, by, overview, set } = studio();
  const ways = [
    ["strokes", say("what your marks teach")],
    ...(set.outcome ? [["trained", say("the trained profile")]] : []),
    ...(set.profile.versions.length ? [["installed", say("the installed profile")]] : []),
    ...overview.shipped.map((name) => [name, say("shipped: {name}", { name })]),
    ["none", say("nothing: the bare picture")],
  ];
  return html`
    <div class="mask-row">
      <label class="field">${say("Seen by")}
        <select value=${by} onChange=${(event) => chooseMask(event.target.value)}>
          ${ways.map(([key, words]) => html`<option key=${key} value=${key}>${words}</option>`)}
        </select>
      </label>
      <div>
        <p role="status" class=${mask?.trouble ? "refusal" : "quiet"}>${maskWords(studio())}</p>
        ${mask?.picture && html`<p class="quiet legend"><i class="paint" />${say("taken for paint")} <i class="dropped" />${say("doubtful, left out")} <i class="found" />${say("line found")}</p>`}
      </div>
    </div>
  `;
}

function maskWords({ mask, by, saved, looking, trouble }) {
  if (!saved) return trouble ? say("Not saved yet.") : say("Saving …");
  if (by === "none") return "";
  if (looking && !mask) return say("Looking …");
  if (!mask) return say("Mark some paint and some floor to see what they teach.");
  if (mask.trouble) return quoted(mask.trouble);
  const lines = mask.head.lines.length;
  return lines
    ? say("{share} of the picture is taken for paint, {n} line found in it.|{share} of the picture is taken for paint, {n} lines found in it.", { share: percent(mask.head.share), n: lines })
    : say("{share} of the picture is taken for paint, no lines found in it.", { share: percent(mask.head.share) });
}

function PictureRow({ label }) {
  const takeOut = () =>
    told(async () => {
      const { pictures } = studio().set;
      await asked(setPath(`/pictures/${label.file}`), "DELETE");
      const left = pictures.filter((one) => one.file !== label.file);
      change({ set: { ...studio().set, pictures: left } });
      choosePicture(left[0]?.file ?? "");
    });
  return html`
    <div class="picture-row">
      <label class="check"><input type="checkbox" checked=${label.complete} onChange=${(event) => mark({ complete: event.target.checked })} /> ${say("Every line in it is labelled")}</label>
      <label class="check"><input type="checkbox" checked=${label.negative} disabled=${label.lines.length > 0} onChange=${(event) => mark({ negative: event.target.checked })} /> ${say("It shows no line")}</label>
      <button class="order" onClick=${takeOut}>${say("Take the picture out")}</button>
    </div>
  `;
}
