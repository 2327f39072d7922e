// One input of an element's form: what is typed is taken when it is left or Enter is pressed.
import { html, useState } from "../html.js";
import { english, plain, say } from "../language.js";
import { nodesOf, rounded, rowsOf } from "./draft.js";
import { PaintInput } from "./paint_field.js";
import { site } from "./site_state.js";

// `onValue(changes)` gets the keys that change; undefined takes a key out.
export function Field({ field, values, index, onValue }) {
  const Input = INPUTS[field.kind];
  return html`<${Input} field=${field} values=${values} index=${index} onValue=${onValue} set=${(value) => onValue({ [field.key]: value })} />`;
}

export const fieldId = (key, at = null) => `site-${key}${at ?? ""}`;

function Typed({ field, shown, onText, at = null }) {
  const [text, setText] = useState(null);
  const [wrong, setWrong] = useState("");
  const id = fieldId(field.key, at);
  const leave = ({ target }) => {
    const problem = (target.value !== shown && onText(target.value.trim())) || "";
    target.setCustomValidity(say(problem)); // a form around it is not sent then
    setText(problem ? target.value : null);
    setWrong(problem);
  };
  return html`
    <label class="field" for=${id}><span>${say(field.words)}${field.unit && html` <small>${field.unit}</small>`}</span>
      <input
        id=${id} value=${text ?? shown} placeholder=${field.placeholder ? say(field.placeholder) : ""} inputmode=${field.kind === "text" ? "text" : "decimal"} autocomplete="off"
        aria-invalid=${wrong ? "true" : null} aria-describedby=${wrong ? `${id}-wrong` : null}
        onInput=${(event) => setText(event.target.value)} onChange=${leave} onBlur=${leave}
      />
      ${wrong && html`<span id=${`${id}-wrong`} class="refusal" role="alert">${say(wrong)}</span>`}
    </label>
  `;
}

const asNumber = (text) => (/^[-+]?(\d+([.,]\d*)?|[.,]\d+)$/.test(text) ? Number(text.replace(",", ".")) : NaN);
const NO_NUMBER = english("A number, as in 1.5");
const told = (value) => (typeof value === "number" ? plain(value) : String(value ?? ""));

function NumberInput({ field, values, set }) {
  const onText = (text) => {
    if (!text) return set(undefined);
    const value = asNumber(text);
    return Number.isNaN(value) ? NO_NUMBER : set(value);
  };
  return html`<${Typed} field=${field} shown=${told(values[field.key])} onText=${onText} />`;
}

function TextInput({ field, values, set }) {
  return html`<${Typed} field=${field} shown=${told(values[field.key])} onText=${(text) => set(text || undefined)} />`;
}

function NumbersInput({ field, values, set }) {
  const now = values[field.key];
  const onText = (text) => {
    const parts = text.split(/[;\s]+|,\s+|,(?=\d*\.)/).filter(Boolean).map((part) => asNumber(part.replace(/,$/, "")));
    return parts.some(Number.isNaN) || !parts.length ? english("Numbers with blanks between, as in 1.5 1.8") : set(parts);
  };
  return html`<${Typed} field=${{ ...field, kind: "text" }} shown=${Array.isArray(now) ? now.map(told).join(" ") : told(now)} onText=${onText} />`;
}

// One of two numbers in a list.
function PartInput({ field, values, set }) {
  const now = Array.isArray(values[field.key]) ? values[field.key] : [0, 0];
  const onText = (text) => {
    const value = asNumber(text || "0");
    if (Number.isNaN(value)) return NO_NUMBER;
    const both = now.map((one, i) => (i === field.at ? value : one));
    return set(both.some(Boolean) ? both : undefined);
  };
  return html`<${Typed} field=${field} at=${field.at} shown=${told(now[field.at])} onText=${onText} />`;
}

// How far an aisle lies from the one before it, by rising y.
function PitchInput({ field, values, index, onValue }) {
  const ys = rowsOf(site().draft, "aisle").filter((_, i) => i !== index).map((row) => Number(row.values.y_m) || 0);
  const before = ys.filter((y) => y <= values.y_m).sort((a, b) => a - b).at(-1);
  if (before === undefined) return null;
  const onText = (text) => {
    const value = asNumber(text);
    return Number.isNaN(value) ? NO_NUMBER : onValue({ y_m: rounded(before + value) });
  };
  return html`<${Typed} field=${field} shown=${told(rounded(values.y_m - before))} onText=${onText} />`;
}

function CheckInput({ field, values, set }) {
  const id = fieldId(field.key);
  const on = values[field.key] ?? field.normal;
  return html`<label class="check" for=${id}><input id=${id} type="checkbox" checked=${on} onChange=${(event) => set(event.target.checked)} /> ${say(field.words)}</label>`;
}

function Select({ field, at, value, options, onChoice }) {
  const id = fieldId(field.key, at);
  const known = options.some(([one]) => one === value);
  return html`
    <label class="field" for=${id}>${say(field.words)}
      <select id=${id} value=${value} onChange=${(event) => onChoice(event.target.value)}>
        ${!known && html`<option value=${value}>${value || say("choose")}</option>`}
        ${options.map(([one, words]) => html`<option key=${one} value=${one}>${say(words)}</option>`)}
      </select>
    </label>
  `;
}

function ChoiceInput({ field, values, set }) {
  return html`<${Select} field=${field} value=${told(values[field.key] ?? field.normal)} options=${field.options} onChoice=${(value) => set(value || undefined)} />`;
}

function Paint({ field, values, set }) {
  return html`<${PaintInput} id=${fieldId(field.key)} words=${say(field.words)} paint=${told(values[field.key] ?? field.normal)} set=${set} />`;
}

function NodeInput({ field, values, set }) {
  const options = nodesOf(site().draft).map(({ id }) => [id, id]);
  const { at } = field;
  if (at === null) return html`<${Select} field=${field} value=${told(values[field.key])} options=${options} onChoice=${set} />`;
  const ends = Array.isArray(values[field.key]) ? values[field.key] : ["", ""];
  return html`<${Select} field=${field} at=${at} value=${told(ends[at])} options=${options} onChoice=${(node) => set(ends.map((end, i) => (i === at ? node : end)))} />`;
}

function Boxes({ field, all, on, set }) {
  const turn = (one, isOn) => set(all.filter((other) => (other === one ? isOn : on.includes(other))));
  return html`
    <fieldset class="boxes" id=${fieldId(field.key)} tabindex="-1"><legend>${say(field.words)}</legend>
      ${all.map((one) => html`<label key=${one} class="check"><input type="checkbox" checked=${on.includes(one)} onChange=${(event) => turn(one, event.target.checked)} /> ${say(one)}</label>`)}
    </fieldset>
  `;
}

const SIDES = [english("left"), english("right")];
function SidesInput({ field, values, set }) {
  return html`<${Boxes} field=${field} all=${SIDES} on=${values[field.key] ?? SIDES} set=${set} />`;
}

// Left out: every aisle with shelves on these sides.
function AislesInput({ field, values, set }) {
  const all = rowsOf(site().draft, "aisle").map((row) => row.values.id);
  const isAll = values.aisles === undefined;
  return html`
    <label class="check"><input type="checkbox" checked=${isAll} onChange=${(event) => set(event.target.checked ? undefined : all)} /> ${say("All aisles with shelves on these sides")}</label>
    ${!isAll && html`<${Boxes} field=${field} all=${[...new Set([...all, ...values.aisles])]} on=${values.aisles} set=${set} />`}
  `;
}

const INPUTS = {
  number: NumberInput, text: TextInput, numbers: NumbersInput, part: PartInput, pitch: PitchInput, check: CheckInput,
  choice: ChoiceInput, paint: Paint, node: NodeInput, sides: SidesInput, aisles: AislesInput,
};
