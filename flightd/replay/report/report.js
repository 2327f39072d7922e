(() => {
  "use strict";
  const timeline = document.querySelector(".timeline");
  if (!timeline) return;
  const whole = Number(timeline.dataset.duration);
  let start = 0, end = whole;

  const points = (path) => {
    const t = [], v = [];
    for (const found of path.getAttribute("d").matchAll(/([ML])(-?[\d.]+),(-?[\d.]+)/g)) {
      t.push(Number(found[2])); v.push(Number(found[3]));
    }
    return { t, v };
  };
  const before = (times, at) => {
    let low = 0, high = times.length;
    while (low < high) { const middle = (low + high) >> 1; if (times[middle] <= at) low = middle + 1; else high = middle; }
    return low - 1;
  };
  const clock = (s, fine) => {
    const whole = fine ? Math.floor(s) : Math.round(s);
    return Math.floor(whole / 60) + ":" + String(whole % 60).padStart(2, "0") + (fine ? "." + Math.floor((s - whole) * 10) : "");
  };

  const strips = [...timeline.querySelectorAll(".strip")].map((strip) => {
    const low = Number(strip.dataset.low), high = Number(strip.dataset.high);
    const plot = strip.querySelector(".plot");
    const cursor = plot.appendChild(Object.assign(document.createElement("div"), { className: "cursor" }));
    const selection = plot.appendChild(Object.assign(document.createElement("div"), { className: "selection" }));
    const outputs = [...strip.querySelectorAll("output")];
    const curves = [...strip.querySelectorAll(".curve")].map(points);
    const value = (y) => high - (y / 100) * (high - low);
    return { plot, cursor, selection, outputs, curves, value, digits: Number(strip.dataset.digits),
             unit: strip.dataset.unit, drawing: strip.querySelector(".drawing") };
  });
  const track = timeline.querySelector(".ribbon .track");
  const blocks = [...track.querySelectorAll(".block")];
  const alarms = [...timeline.querySelectorAll(".alarm")];
  const times = timeline.querySelector(".axis .times");
  const drone = document.querySelector(".plan .drone");
  const flown = document.querySelector(".plan .flown.truth") || document.querySelector(".plan .flown.estimate");
  const places = flown ? (() => {
    const { t: x, v: y } = points(flown);
    return { t: flown.dataset.times.split(" ").map(Number), x, y };
  })() : null;

  const show = (at) => {
    const share = (at - start) / (end - start);
    for (const strip of strips) {
      strip.cursor.style.display = "block";
      strip.cursor.style.left = 100 * share + "%";
      strip.curves.forEach((curve, index) => {
        const nearest = before(curve.t, at);
        const near = nearest >= 0 && at - curve.t[nearest] < Math.max(1, whole / 200);
        strip.outputs[index].textContent = near ? strip.value(curve.v[nearest]).toFixed(strip.digits).replace("-", "−") + " " + strip.unit : "";
      });
    }
    if (places) {
      const index = before(places.t, at);
      drone.setAttribute("cx", index < 0 ? -99 : places.x[index]);
      drone.setAttribute("cy", index < 0 ? -99 : places.y[index]);
    }
  };
  const hide = () => {
    for (const strip of strips) {
      strip.cursor.style.display = "none";
      strip.outputs.forEach((output) => { output.textContent = ""; });
    }
    if (places) drone.setAttribute("cx", -99);
  };

  const zoom = (from, to) => {
    start = Math.max(0, from); end = Math.min(whole, to);
    const span = end - start;
    for (const strip of strips) strip.drawing.setAttribute("viewBox", `${start} 0 ${span} 100`);
    for (const block of blocks) {
      const left = Math.max(Number(block.dataset.start), start), right = Math.min(Number(block.dataset.end), end);
      block.style.display = right > left ? "" : "none";
      block.style.left = 100 * (left - start) / span + "%";
      block.style.width = 100 * (right - left) / span + "%";
    }
    for (const alarm of alarms) {
      const share = (Number(alarm.dataset.at) - start) / span;
      alarm.style.display = share >= 0 && share <= 1 ? "" : "none";
      alarm.style.left = 100 * share + "%";
    }
    const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 3600].find((s) => span / s <= 10) || 7200;
    times.textContent = "";
    for (let at = Math.ceil(start / step - 1e-9) * step; at <= end + 1e-9; at += step) {
      const label = times.appendChild(document.createElement("span"));
      label.textContent = clock(at + 1e-6, step < 1);
      label.style.left = 100 * (at - start) / span + "%";
    }
  };

  let held = null;
  const shareAt = (event) => {
    const box = strips[0].plot.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  };
  const timeAt = (event) => start + shareAt(event) * (end - start);
  const select = (from, to) => {
    for (const { selection } of strips) {
      selection.style.display = from === to ? "none" : "block";
      selection.style.left = 100 * Math.min(from, to) + "%";
      selection.style.width = 100 * Math.abs(to - from) + "%";
    }
  };
  timeline.addEventListener("pointermove", (event) => {
    show(timeAt(event));
    if (held !== null) select(held, shareAt(event));
  });
  timeline.addEventListener("pointerleave", () => { if (held === null) hide(); });
  timeline.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch" || event.button !== 0) return;
    held = shareAt(event);
    event.preventDefault();
  });
  window.addEventListener("pointerup", (event) => {
    if (held === null) return;
    const from = Math.min(held, shareAt(event)), to = Math.max(held, shareAt(event));
    held = null;
    select(0, 0);
    if (to - from > 0.01) zoom(start + from * (end - start), start + to * (end - start));
  });
  timeline.addEventListener("dblclick", () => zoom(0, whole));
  for (const row of document.querySelectorAll("tr[data-start]")) {
    row.addEventListener("pointerenter", () => show(Number(row.dataset.start) + 0.01));
    row.addEventListener("pointerleave", hide);
  }
})();
