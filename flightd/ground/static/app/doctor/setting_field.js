// One key of the configuration: its value, unit, range, default and meaning, as its own documentation has them.
import { html, useState } from "../html.js";
import { quoted, quotedWhole, say } from "../language.js";
import { capital } from "../words.js";
import { isSame, nameOf, readAs, typed, valueIn } from "./settings_keys.js";

export function SettingField({ about, table, change, complaint, locked, onChange }) {
  const name = nameOf(about);
  const id = `setting-${name}`;
  const stands = valueIn(table, name);
  const isChanged = change !== undefined;
  const value = isChanged ? change : stands;
  const [said, setSaid] = useState(null); // as it was typed: "0." on the way to "0.5" is a number already
  const text = said !== null && isSame(readAs(about.type, said), value) ? said : typed(value);
  const onInput = (event) => {
    setSaid(event.target.value);
    const now = readAs(about.type, event.target.value);
    onChange(name, isSame(now, stands) ? undefined : now);
  };
  const given = {
    id, value: text, onInput, "aria-describedby": `${id}-text`, "aria-invalid": complaint ? "true" : null, disabled: Boolean(locked),
  };
  return html`
    <div class=${`setting ${isChanged ? "changed" : ""} ${complaint ? "wrong" : ""}`}>
      <label for=${id}>${about.key}${about.unit && html` <span class="quiet">${quoted(about.unit)}</span>`}</label>
      ${about.fixed ? html`<output id=${id}>${text || bare(about.default) || say("not given")}</output>` : html`<${Field} about=${about} given=${given} />`}
      <p id=${`${id}-text`} class="quiet">
        ${quotedWhole(about.text, capital)}. ${about.range && !isChoice(about) && [quotedWhole(about.range, capital), ". "]}${about.fixed
          ? html`<em>${quoted(about.fixed, capital)}.</em>`
          : `${isChanged && stands !== undefined ? `${say("In the file: {value}.", { value: typed(stands) })} ` : ""}${say("Default: {value}.", { value: defaultOf(about) })}`}
      </p>
      ${complaint && html`<p class="complaint" role="alert">${quoted(complaint)}</p>`}
    </div>
  `;
}

function Field({ about, given }) {
  if (isChoice(about) || about.type === "true or false") {
    const options = isChoice(about) ? about.range.split(", ") : ["true", "false"];
    const { onInput, ...rest } = given;
    return html`
      <select ...${rest} onChange=${onInput}>
        <option value="">${about.default ? say("default ({value})", { value: bare(about.default) }) : say("default")}</option>
        ${options.map((option) => html`<option key=${option} value=${option}>${option}</option>`)}
      </select>`;
  }
  const isNumber = about.type.includes("number") && !about.type.startsWith("list");
  return html`<input ...${given} type="text" inputmode=${isNumber ? "decimal" : "text"} autocomplete="off" spellcheck="false" placeholder=${bare(about.default)} />`;
}

const isChoice = ({ type }) => type === "choice";

const defaultOf = (about) => (about.default === "required" ? say("none, it has to be given") : bare(about.default) || say("not given"));

const bare = (text) => (text === "required" ? "" : text === "[]" ? say("none") : text.replace(/^"(.*)"$/, "$1"));
