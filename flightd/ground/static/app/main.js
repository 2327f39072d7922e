// Draws the page anew whenever the store changes, and starts the connection.
import { connect } from "./connection.js";
import { html, render } from "./html.js";
import { preferred, speak } from "./language.js";
import { listenForKeys } from "./keys.js";
import { Page } from "./page.js";
import { followLinks, retitle } from "./router.js";
import { keepScreenOn } from "./screen.js";
import { rememberSingleKeys } from "./single_keys.js";
import { watch } from "./store.js";
import { askBeforeLoss } from "./unsaved.js";

const root = document.getElementById("page");
const draw = () => render(html`<${Page} />`, root);

const SPOKEN_MS = 3000; // a station that gives no texts by then is read in English

rememberSingleKeys();
listenForKeys();
keepScreenOn();
followLinks();
askBeforeLoss();
connect();
await Promise.race([speak(preferred()), new Promise((resolve) => setTimeout(resolve, SPOKEN_MS))]).catch(() => {});
retitle();
watch(draw);
draw();
