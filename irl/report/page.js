// Draws figures when they come into sight, moves tabs, sliders and the episode's cursor, hands out numbers.
"use strict";
const read = (figure) => JSON.parse(figure.querySelector(":scope > script").textContent);
const each = (root, selector, act) => root.querySelectorAll(selector).forEach(act);
const config = { responsive: true, displayModeBar: false };

function draw(figure) {
  const place = figure.querySelector(".drawing");
  if (figure.dataset.drawn || place.offsetParent === null) return;
  figure.dataset.drawn = "yes";
  const { data, layout } = read(figure);
  Plotly.newPlot(place, data, layout, config);
  if (layout.meta && layout.meta.across) fitHexagons(place, layout.meta);
  if (layout.meta && layout.meta.cursor) joinCursor(figure, place);
}

// a hexagon is as wide as a cell of the honeycomb, whatever the width of the page
function fitHexagons(place, meta) {
  const fit = () => {
    const axis = place._fullLayout.xaxis, share = (meta.x[1] - meta.x[0]) / (axis.range[1] - axis.range[0]);
    const size = Math.max(3, (axis._length * share / meta.across) * 1.1);
    if (Math.abs(size - place.data[0].marker.size) > 0.3) Plotly.restyle(place, { "marker.size": size }, [0]);
  };
  fit();
  addEventListener("resize", () => setTimeout(fit, 300));
}

const seen = new IntersectionObserver(
  (entries) => entries.forEach((entry) => entry.isIntersecting && draw(entry.target)), { rootMargin: "300px" });
function uncover(view) { each(view, "figure.plot", draw); }

function tabs(list) {
  const all = [...list.querySelectorAll('[role="tab"]')];
  const choose = (tab) => {
    all.forEach((other) => {
      other.setAttribute("aria-selected", other === tab);
      other.tabIndex = other === tab ? 0 : -1;
      document.getElementById(other.getAttribute("aria-controls")).hidden = other !== tab;
    });
    each(document.getElementById(tab.getAttribute("aria-controls")), "figure.plot", (f) => { if (!f.closest("[hidden]")) draw(f); });
  };
  all.forEach((tab, i) => {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = all[(i + step + all.length) % all.length];
      next.focus();
      choose(next);
    });
  });
}

function slider(box) {
  const input = box.querySelector("input"), output = box.querySelector("output");
  const labels = JSON.parse(input.dataset.labels);
  const views = [...box.parentElement.children].filter((child) => child.classList.contains("view"));
  input.addEventListener("input", () => {
    const at = Number(input.value);
    output.textContent = labels[at];
    input.setAttribute("aria-valuetext", labels[at]);
    views.forEach((view, i) => { view.hidden = i !== at; });
    uncover(views[at]);
  });
}

const quoted = (cell) => /[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : String(cell ?? "");
const asCsv = (rows) => rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
function figureRows({ data }) {
  const rows = [["series", "x", "y", "value", "low", "high"]];
  for (const trace of data) {
    const name = trace.name || "", x = trace.x || [], y = trace.y || [];
    if (trace.z) trace.z.forEach((line, j) => line.forEach((v, i) => rows.push([name, x[i], y[j], v, "", ""])));
    else x.forEach((v, i) => {
      const gap = trace.error_y, below = gap && gap.arrayminus[i], above = gap && gap.array[i];
      const known = gap && below != null && above != null;
      rows.push([name, v, y[i], trace.customdata ? trace.customdata[i] : "", known ? y[i] - below : "", known ? y[i] + above : ""]);
    });
  }
  return rows;
}
function tableRows(table) {
  return [...table.rows].map((row) => [...row.cells].map((cell) => cell.dataset.value ?? cell.textContent));
}
function take(button) {
  const box = button.closest("[data-file]"), table = box.querySelector("table"), kind = button.dataset.take;
  const figure = table ? null : read(box), rows = table ? tableRows(table) : figureRows(figure);
  const objects = () => rows.slice(1).map((row) => Object.fromEntries(rows[0].map((key, i) => [key || "name", row[i]])));
  const text = kind === "csv" ? asCsv(rows) : JSON.stringify(table ? objects() : figure.data, null, 1);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: kind === "csv" ? "text/csv" : "application/json" }));
  link.download = `${box.dataset.file}.${kind}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function joinCursor(figure, place) {
  const box = figure.closest(".episode");
  place.on("plotly_click", (event) => box.moveTo(event.points[0].x));
  box.moveTo(Number(box.querySelector("input").value));
}
const short = (value) => value == null ? "not known" : Number(value).toPrecision(4).replace(/e.*$/, (tail) => tail);
function episode(box) {
  const { film, series, sums } = JSON.parse(box.querySelector(".episode-data").textContent);
  const input = box.querySelector("input"), output = box.querySelector("output"), canvas = box.querySelector("canvas");
  const body = box.querySelector(".readout tbody"), sheet = film ? new Image() : null, names = Object.keys(series);
  for (const name of names) {
    const row = body.insertRow();
    row.insertCell().textContent = name;
    row.insertCell();
    row.insertCell();
  }
  const paint = (t) => {
    const i = Math.min(film.frames - 1, Math.floor(t / film.every)), w = film.width, h = film.height;
    canvas.getContext("2d").drawImage(sheet, (i % film.across) * w, Math.floor(i / film.across) * h, w, h, 0, 0, w, h);
  };
  box.moveTo = (t) => {
    input.value = t;
    output.textContent = t;
    names.forEach((name, i) => {
      body.rows[i].cells[1].textContent = short(series[name][t]);
      body.rows[i].cells[2].textContent = short(sums[name][t]);
    });
    if (sheet && sheet.complete) paint(t);
    const line = { type: "line", x0: t, x1: t, yref: "paper", y0: 0, y1: 1, line: { color: "#d9730d", width: 1.5 } };
    each(box, ".js-plotly-plot", (place) => Plotly.relayout(place, { shapes: [line] }));
  };
  input.addEventListener("input", () => box.moveTo(Number(input.value)));
  if (sheet) { sheet.onload = () => paint(Number(input.value)); sheet.src = film.src; }
  const button = box.querySelector(".play"), stride = film ? film.every : 10;
  let clock = null;
  button.addEventListener("click", () => {
    if (clock) { clearInterval(clock); clock = null; button.textContent = "Play"; return; }
    if (Number(input.value) >= Number(input.max)) box.moveTo(0);
    button.textContent = "Stop";
    clock = setInterval(() => {
      const next = Number(input.value) + stride;
      if (next > Number(input.max)) { box.moveTo(Number(input.max)); button.click(); } else box.moveTo(next);
    }, 120);
  });
  box.moveTo(0);
}

addEventListener("DOMContentLoaded", () => {
  each(document, ".episode", episode);
  each(document, '[role="tablist"]', tabs);
  each(document, ".slider", slider);
  each(document, "[data-take]", (button) => button.addEventListener("click", () => take(button)));
  each(document, "figure.plot", (figure) => seen.observe(figure));
  document.body.dataset.ready = "yes";
});
addEventListener("beforeprint", () => each(document, "figure.plot", draw));
