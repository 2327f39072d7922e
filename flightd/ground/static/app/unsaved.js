// What is lost with the page, on whichever page it was made: the browser asks before it is closed or loaded anew.
const unsaved = []; // functions that say whether there is something

export const losesWork = (is) => unsaved.push(is);

export function askBeforeLoss() {
  window.addEventListener("beforeunload", (event) => {
    if (unsaved.some((is) => is())) event.preventDefault();
  });
}
