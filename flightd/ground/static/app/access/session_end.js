// The end of a session: said half an hour before, with the way to sign in again in place; and what is left of one
// that ended while a drone flew.
import { act } from "../acts.js";
import { connect } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, quoted, say } from "../language.js";
import { shown, state } from "../store.js";
import { capital } from "../words.js";
import { isOver, mayOperate, signIn } from "./session.js";

const SOON_MS = 30 * 60000;

export function EndsSoon() {
  const [asks, setAsks] = useState(false);
  const { session } = state;
  const left = (session?.endsAt ?? Infinity) - performance.now();
  if (left > SOON_MS) return null;
  return html`
    <section class="card ends" aria-label=${say("End of the session")}>
      <p role="status">${say("Your session ends in {n} minute.|Your session ends in {n} minutes.", { n: Math.max(1, Math.ceil(left / 60000)) })}</p>
      ${asks ? html`<${Again} name=${session.name} done=${() => setAsks(false)} />` : html`<button class="order" onClick=${() => setAsks(true)}>${say("Sign in again")}</button>`}
    </section>
  `;
}

// The same person's password, with all that the page shows left as it is.
function Again({ name, done }) {
  const [trouble, setTrouble] = useState("");
  const [waits, setWaits] = useState(false);
  const field = useRef(null);
  useEffect(() => field.current.focus(), []);
  const send = async (event) => {
    event.preventDefault();
    if (waits) return;
    if (!field.current.value) {
      setTrouble(english("Type your password first."));
      field.current.focus();
      return;
    }
    setWaits(true);
    setTrouble("");
    try {
      await signIn(name, field.current.value);
      connect(); // the session of the socket may have ended meanwhile
      done();
    } catch (error) {
      setWaits(false);
      setTrouble(`${error.message}.`);
      field.current?.focus();
    }
  };
  return html`
    <form class="again" aria-label=${say("Sign in again")} onSubmit=${send}>
      <label>${say("Password of {name}", { name })}
        <input ref=${field} name="password" type="password" maxlength="200" autocomplete="current-password" />
      </label>
      <button class="order" aria-disabled=${waits}>${waits ? say("Signing in …") : say("Sign in")}</button>
      <p class="refusal" role="alert">${quoted(trouble, capital)}</p>
    </form>
  `;
}

export function FliesOn() {
  if (!isOver()) return null;
  const may = shown().status?.possible.includes("pause");
  return html`
    <section class="card ends" aria-label=${say("End of the session")}>
      <p role="status">
        ${mayOperate() ? say("Your session has ended, and a drone flies. STOP and Pause stay yours, and this page attends, until it has landed.") : say("Your session has ended, and a drone flies. STOP and Pause stay yours until it has landed.")}
      </p>
      <button class="order" disabled=${!may} onClick=${() => act("pause")}>${say("Pause")}</button>
    </section>
  `;
}
