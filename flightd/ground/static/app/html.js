// The one door to the vendored library.
export { html, render, useEffect, useMemo, useRef, useState } from "../vendor/htm-preact.module.js";
