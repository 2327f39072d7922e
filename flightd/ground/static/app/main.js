// Draws the page anew whenever the store changes, and starts the connection.
import { connect } from "./connection.js";
import { html, render } from "./html.js";
import { listenForKeys } from "./keys.js";
import { Page } from "./page.js";
import { followLinks } from "./router.js";
import { watch } from "./store.js";

const root = document.getElementById("page");
const draw = () => render(html`<${Page} />`, root);

listenForKeys();
followLinks();
watch(draw);
draw();
connect();
