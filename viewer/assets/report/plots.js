// Curves and histograms as SVG.

const SVG = "http://www.w3.org/2000/svg";

/** An element with attributes and children; text goes in as text. */
function make(name, attributes, ...children) {
  const e = SVG_NAMES.has(name) ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) e.setAttribute(key, value);
  e.append(...children);
  return e;
}
const SVG_NAMES = new Set(["svg", "path", "rect", "line", "circle", "text", "g"]);

/** A number short enough to read. */
function short(v) {
  if (typeof v !== "number" || !isFinite(v)) return "–";
  const a = Math.abs(v);
  if (a !== 0 && (a < 1e-3 || a >= 1e6)) return v.toExponential(2);
  return a >= 100 ? v.toFixed(1) : a >= 1 ? v.toFixed(3) : v.toFixed(4);
}
const cm = (m) => (typeof m === "number" ? (100 * m).toFixed(m < 0.001 ? 2 : 1) + " cm" : "not known");

/** Fills a table; the first row is its head. */
function fill(table, rows) {
  table.replaceChildren(...rows.map((row, i) =>
    make("tr", {}, ...row.map((cell) => make(i ? "td" : "th", {}, cell)))));
}

/** Curves over time: [{values, colour, dashed}]. */
function curves(times, series) {
  const all = series.flatMap((s) => s.values);
  const [w, h, left] = [300, 130, 40];
  let [low, high] = [Math.min(...all), Math.max(...all)];
  // A joint that stands still is a line, not noise filling the frame.
  const slack = Math.max(0.01 - (high - low), 0) / 2 + 0.04 * (high - low);
  low -= slack; high += slack;
  const x = (t) => left + ((w - left - 4) * (t - times[0])) / (times[times.length - 1] - times[0] || 1);
  const y = (v) => 4 + ((h - 20) * (high - v)) / (high - low);
  const label = (text, px, py, anchor) => make("text", { x: px, y: py, "text-anchor": anchor }, text);
  const paths = series.filter((s) => s.values.length).map((s) => make("path", {
    d: s.values.map((v, i) => (i ? "L" : "M") + x(times[i]).toFixed(1) + " " + y(v).toFixed(1)).join(""),
    fill: "none", stroke: s.colour, "stroke-width": 1.6, "stroke-dasharray": s.dashed ? "5 3" : "none",
  }));
  return make("svg", { viewBox: `0 0 ${w} ${h}` },
    make("rect", { x: left, y: 4, width: w - left - 4, height: h - 20, fill: "none", stroke: "var(--line)" }),
    ...paths, label(high.toFixed(2), left - 3, 12, "end"), label(low.toFixed(2), left - 3, h - 16, "end"),
    label(times[0].toFixed(1), left, h - 3, "start"),
    label(times[times.length - 1].toFixed(1) + " s", w - 4, h - 3, "end"));
}

/** A histogram over bins that double every second one. */
function bars(h) {
  const used = h.counts.findLastIndex((n) => n > 0) + 2;
  const counts = h.counts.slice(0, used), most = Math.max(...counts, 1);
  const [w, height] = [300, 130], step = (w - 8) / counts.length;
  const tall = (n) => ((height - 24) * Math.log1p(n)) / Math.log1p(most);
  const label = (i) => (h.upto_us[i] >= 1000 ? (h.upto_us[i] / 1000).toFixed(0) + " ms" : h.upto_us[i].toFixed(0) + " µs");
  return make("svg", { viewBox: `0 0 ${w} ${height}` },
    ...counts.map((n, i) => make("rect", { x: 4 + i * step + 0.5, width: Math.max(step - 1, 1),
      y: height - 18 - tall(n), height: tall(n), fill: "var(--bar)" })),
    ...counts.map((n, i) => i).filter((i) => i % 4 === 3 && i < h.upto_us.length)
      .map((i) => make("text", { x: 4 + (i + 1) * step, y: height - 4, "text-anchor": "middle" }, label(i))));
}

/** Interval, value and truth within a range. */
function span(row) {
  const ends = row.interval_90 || [row.value, row.value];
  const known = [row.range[0], row.range[1], row.value, ...ends, ...(row.truth === null ? [] : [row.truth])];
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const x = (v) => 4 + (152 * (v - low)) / (high - low || 1);
  const parts = [make("line", { x1: 4, x2: 156, y1: 8, y2: 8, stroke: "var(--line)" }),
    make("rect", { x: x(ends[0]), width: Math.max(x(ends[1]) - x(ends[0]), 1), y: 4, height: 8, fill: "var(--bar)" }),
    make("circle", { cx: x(row.value), cy: 8, r: 3.2, fill: "var(--measured)" })];
  if (row.truth !== null) parts.push(make("line", { x1: x(row.truth), x2: x(row.truth), y1: 1, y2: 15, stroke: "var(--bad)", "stroke-width": 2 }));
  return make("svg", { viewBox: "0 0 160 16", style: "min-width:8rem" }, ...parts);
}
