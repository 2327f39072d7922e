// Before everything else where the station asks who somebody is; the address stays, and is gone to afterwards.
import { connect } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { english, language, quoted, say } from "../language.js";
import { capital } from "../words.js";
import { signIn } from "./session.js";

export default function SignIn() {
  const [trouble, setTrouble] = useState("");
  const [waits, setWaits] = useState(false);
  const name = useRef(null);
  const password = useRef(null);
  useEffect(() => {
    const before = document.title;
    document.title = `${say("Sign in")} · flightd`;
    return () => {
      document.title = before;
    };
  }, [language()]);
  useEffect(() => name.current.focus(), []);
  const send = async (event) => {
    event.preventDefault();
    if (waits) return;
    const empty = [name, password].find((field) => !field.current.value);
    if (empty) {
      setTrouble(empty === name ? english("Type your name first.") : english("Type your password first."));
      empty.current.focus();
      return;
    }
    setWaits(true);
    setTrouble("");
    try {
      await signIn(name.current.value.trim(), password.current.value);
      connect();
    } catch (error) {
      setWaits(false);
      setTrouble(`${error.message}.`);
      password.current.value = "";
      password.current.focus();
    }
  };
  return html`
    <form class="card sign-in" aria-labelledby="sign-in" onSubmit=${send}>
      <h2 id="sign-in">${say("Sign in")}</h2>
      <p class="quiet">${say("This ground station asks who you are. It shows nothing before.")}</p>
      <label class="field">${say("Name")}
        <input ref=${name} name="username" maxlength="60" autocomplete="username" autocapitalize="none" spellcheck="false" />
      </label>
      <label class="field">${say("Password")}
        <input ref=${password} name="password" type="password" maxlength="200" autocomplete="current-password" />
      </label>
      <button class="order" aria-disabled=${waits}>${waits ? say("Signing in …") : say("Sign in")}</button>
      <p class=${trouble ? "refusal" : "refusal none"} role="alert">${quoted(trouble, capital)}</p>
      <p class="quiet">${say("No name yet, or a forgotten password? Whoever runs the station can help.")}</p>
    </form>
  `;
}
