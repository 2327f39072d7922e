// The one door to the vendored library.
export { Component, html, render, useEffect, useMemo, useRef, useState } from "../vendor/htm-preact.module.js";
