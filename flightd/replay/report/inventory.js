(() => {
  "use strict";
  const source = document.getElementById("counted");
  if (!source) return;
  const { columns, places } = JSON.parse(source.textContent);
  const pictures = JSON.parse(document.getElementById("pictures").textContent);
  const make = (name, options, ...children) => {
    const made = Object.assign(document.createElement(name), options);
    made.append(...children);
    return made;
  };

  // one place, with its picture

  const dialog = document.querySelector(".look-box"), box = dialog.querySelector(".look");
  let opener = null;
  const open = (code) => {
    const look = places[code];
    if (!look) return;
    const data = look.picture && pictures[look.picture];
    const none = look.picture ? `The picture is not in this page: evidence/${look.picture}.jpg` : "No picture of this place.";
    box.replaceChildren(
      data ? make("img", { src: "data:image/jpeg;base64," + data, alt: "What the front camera saw at " + code })
           : make("p", { className: "none", textContent: none }),
      make("h3", { id: "look-title" }, make("i", { className: "cell " + look.state }), code, make("small", { textContent: look.name })),
      make("dl", {}, ...look.facts.flatMap(([label, value]) => [make("dt", { textContent: label }), make("dd", { textContent: value })])),
    );
    dialog.showModal();
  };
  dialog.addEventListener("close", () => {
    if (opener) opener.focus();
    opener = null;
  });
  document.addEventListener("click", (event) => {
    if (event.target === dialog || event.target.closest(".look-box .close")) { dialog.close(); return; }
    const place = event.target.closest("[data-code]");
    if (!place) return;
    opener = place.matches("button") ? place : place.querySelector("button");
    open(place.dataset.code);
  });

  // which places are shown

  const bar = document.querySelector(".filter");
  const [words, state, told] = ["words", "state", "told"].map((name) => bar.querySelector("." + name));
  const fits = (code) => {
    const look = places[code], wanted = words.value.trim().toLowerCase();
    const kind = state.value;
    const right = !kind || (kind === "differs" ? look.differs : kind === "exceptions" ? look.odd : look.state === kind);
    return right && (!wanted || [code, ...look.texts].some((text) => text.toLowerCase().includes(wanted)));
  };
  const chosen = () => Object.keys(places).filter(fits);
  const filter = () => {
    const shown = new Set(chosen()), all = Object.keys(places).length;
    for (const cell of document.querySelectorAll(".racks .cell[data-code]")) cell.classList.toggle("out", !shown.has(cell.dataset.code));
    for (const row of document.querySelectorAll(".inventory tr[data-code]")) row.hidden = !shown.has(row.dataset.code);
    told.textContent = `${shown.size.toLocaleString("en")} of ${all.toLocaleString("en")} locations`;
  };
  bar.addEventListener("input", filter);
  bar.addEventListener("submit", (event) => event.preventDefault());
  bar.hidden = false;
  filter();

  // out to other programs: the rows of `flightd inventory export`, of the places that are shown

  const FORMULA = /(?<=^|[;\t\r\n])(?=['"]*[=+\-@\t\r\n])/g; // as core.csv_text has it
  const inert = (cell) => (typeof cell === "string" ? cell.replace(FORMULA, "'") : String(cell));
  const quoted = (cell) => /[",\r\n]/.test(cell) ? '"' + cell.replaceAll('"', '""') + '"' : cell;
  const line = (cells) => cells.map((cell) => quoted(inert(cell))).join(",") + "\r\n";
  const rows = () => chosen().flatMap((code) => places[code].rows);
  const FORMATS = {
    csv: ["text/csv", () => [columns, ...rows()].map(line).join("")],
    json: ["application/json", () => JSON.stringify(rows().map((row) => Object.fromEntries(columns.map((name, i) => [name, row[i]]))), null, 1) + "\n"],
  };
  for (const button of bar.querySelectorAll("[data-format]")) {
    button.addEventListener("click", () => {
      const [type, text] = FORMATS[button.dataset.format];
      const url = URL.createObjectURL(new Blob([text()], { type }));
      make("a", { href: url, download: "inventory." + button.dataset.format }).click();
      setTimeout(() => URL.revokeObjectURL(url), 10_000);
    });
  }

  const asked = decodeURIComponent(location.hash.slice(1));
  if (places[asked]) open(asked);
})();
