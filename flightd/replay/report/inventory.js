(() => {
  "use strict";
  const source = document.getElementById("counted");
  if (!source) return;
  const looks = JSON.parse(source.textContent);
  const pictures = JSON.parse(document.getElementById("pictures").textContent);
  const dialog = document.querySelector(".look-box"), box = dialog.querySelector(".look");
  const make = (name, options, ...children) => {
    const made = Object.assign(document.createElement(name), options);
    made.append(...children);
    return made;
  };
  const open = (code) => {
    const look = looks[code];
    if (!look) return;
    const data = look.picture && pictures[look.picture];
    const none = look.picture ? `The picture is not in this page: evidence/${look.picture}.jpg` : "No picture of this place.";
    box.replaceChildren(
      data ? make("img", { src: "data:image/jpeg;base64," + data, alt: "What the front camera saw at " + code })
           : make("p", { className: "none", textContent: none }),
      make("h3", {}, make("i", { className: "cell " + look.state }), code, make("small", { textContent: look.name })),
      make("dl", {}, ...look.facts.flatMap(([label, value]) => [make("dt", { textContent: label }), make("dd", { textContent: value })])),
    );
    dialog.showModal();
  };
  document.addEventListener("click", (event) => {
    if (event.target === dialog) { dialog.close(); return; }
    const place = event.target.closest("[data-code]");
    if (place) open(place.dataset.code);
  });
  if (looks[decodeURIComponent(location.hash.slice(1))]) open(decodeURIComponent(location.hash.slice(1)));
})();
