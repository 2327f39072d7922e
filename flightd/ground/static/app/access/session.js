// Who is signed in, and what that person may: the server refuses the rest whatever is shown here.
import { english } from "../language.js";
import { sessionOf, state, update } from "../store.js";

const ANSWER_MS = 20000;

// The station asks everybody who he is, and nobody is signed in here, or not any more.
export const mustSignIn = () => Boolean(state.session?.login && (!state.session.name || isOver()));

// The session ended while a drone flew: until it has landed STOP and Pause are left, and the page attends.
export const isOver = () => Boolean(state.session?.over);

// A viewer looks on and stops; until the station has said who somebody is, nothing is held back.
export const mayOperate = () => state.session?.role !== "viewer";

// What changes the hall's map or a drone's settings is an admin's.
export const mayChange = () => !["viewer", "operator"].includes(state.session?.role);

// The name of whoever is signed in; empty where the station asks nobody.
export const signedInName = () => (state.session?.login ? state.session.name : "");

export async function signIn(name, password) {
  const session = await asked("POST", { name, password });
  update((s) => {
    s.session = sessionOf(session);
  });
}

// Ends the session on every page that has it; the station closes their sockets, this page's too.
export async function signOut() {
  const session = await asked("DELETE");
  update((s) => {
    s.session = sessionOf(session);
  });
}

async function asked(method, body) {
  let answer;
  try {
    answer = await fetch("/api/session", {
      method,
      headers: { "Content-Type": "application/json" },
      body: body && JSON.stringify(body),
      signal: AbortSignal.timeout(ANSWER_MS),
    });
  } catch (error) {
    throw new Error(english("the ground station does not answer"), { cause: error });
  }
  const told = await answer.json().catch(() => ({}));
  if (!answer.ok) throw new Error(told.refused ?? english("the ground station answers {status}", { status: answer.status }));
  return told;
}
