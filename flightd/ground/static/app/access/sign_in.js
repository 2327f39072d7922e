// Before everything else where the station asks who somebody is; the address stays, and is gone to afterwards.
import { connect } from "../connection.js";
import { html, useEffect, useRef, useState } from "../html.js";
import { capital } from "../words.js";
import { signIn } from "./session.js";

export default function SignIn() {
  const [trouble, setTrouble] = useState("");
  const [waits, setWaits] = useState(false);
  const name = useRef(null);
  const password = useRef(null);
  useEffect(() => {
    const before = document.title;
    document.title = "Sign in · flightd";
    name.current.focus();
    return () => {
      document.title = before;
    };
  }, []);
  const send = async (event) => {
    event.preventDefault();
    if (waits) return;
    const empty = [name, password].find((field) => !field.current.value);
    if (empty) {
      setTrouble(`Type your ${empty === name ? "name" : "password"} first.`);
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
      setTrouble(`${capital(error.message)}.`);
      password.current.value = "";
      password.current.focus();
    }
  };
  return html`
    <form class="card sign-in" aria-labelledby="sign-in" onSubmit=${send}>
      <h2 id="sign-in">Sign in</h2>
      <p class="quiet">This ground station asks who you are. It shows nothing before.</p>
      <label class="field">Name
        <input ref=${name} name="username" maxlength="60" autocomplete="username" autocapitalize="none" spellcheck="false" />
      </label>
      <label class="field">Password
        <input ref=${password} name="password" type="password" maxlength="200" autocomplete="current-password" />
      </label>
      <button class="order" aria-disabled=${waits}>${waits ? "Signing in …" : "Sign in"}</button>
      <p class=${trouble ? "refusal" : "refusal none"} role="alert">${trouble}</p>
      <p class="quiet">No name yet, or a forgotten password? Whoever runs the station can help.</p>
    </form>
  `;
}
