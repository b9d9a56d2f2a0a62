// Tables, curves and histograms as SVG.

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
/** A length (m) in words. */
function inWords(m) {
  if (typeof m !== "number") return "not known";
  return m < 5e-5 ? "under 0.1 mm" : m < 0.01 ? (1e3 * m).toFixed(1) + " mm" : (1e2 * m).toFixed(1) + " cm";
}

/** Fills a table; the first row is its head. */
function fill(table, rows) {
  table.replaceChildren(...rows.map((row, i) =>
    make("tr", {}, ...row.map((cell) => make(i ? "td" : "th", {}, cell)))));
}

/** Round numbers in a range, some `count` of them, and how many digits they need. */
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((s) => s * power >= raw * 0.8);
  const from = Math.ceil(low / step - 1e-9), to = Math.floor(high / step + 1e-9);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return Array.from({ length: to - from + 1 }, (_, i) => ((from + i) * step).toFixed(digits));
}

const label = (text, x, y, anchor) => make("text", { x, y, "text-anchor": anchor }, text);

/**
 * Curves over time (s) with an axis in `unit`: series of {t, values, colour, dashed}, marks
 * {t, text} as upright lines, dots {t, value, low, high, colour}. The axis spans at least
 * `least`, so that what stands still is a line, not noise filling the frame.
 */
function chart({ unit, series, marks = [], dots = [], least = 0, zero = false, size = [300, 140] }) {
  const drawn = series.filter((s) => s.values.length), [w, h] = size, [left, top, bottom] = [42, 18, 18];
  const all = [...drawn.flatMap((s) => s.values), ...dots.flatMap((d) => [d.value, d.high])];
  if (zero) all.push(0);
  const ends = (v) => v.reduce(([a, b], x) => [Math.min(a, x), Math.max(b, x)], [Infinity, -Infinity]);
  let [low, high] = ends(all);
  const slack = Math.max(least - (high - low), 0) / 2 + 0.04 * (high - low);
  low -= zero && low === 0 ? 0 : slack; high += slack;
  const [from, to] = ends(drawn.flatMap((s) => [s.t[0], s.t[s.t.length - 1]]));
  const x = (t) => left + ((w - left - 4) * (t - from)) / (to - from || 1);
  const y = (v) => top + ((h - top - bottom) * (high - v)) / (high - low || 1);
  const rule = (x1, y1, x2, y2, colour, dash = "none") =>
    make("line", { x1, y1, x2, y2, stroke: colour, "stroke-dasharray": dash });
  const across = ticks(low, high, 4).flatMap((v) =>
    [rule(left, y(Number(v)), w - 4, y(Number(v)), "var(--line)"), label(v, left - 3, y(Number(v)) + 4, "end")]);
  const along = ticks(from, to, w / 75).map((t) => label(t, x(Number(t)), h - 4, "middle"));
  const lines = drawn.map((s) => make("path", {
    d: s.values.map((v, i) => (i ? "L" : "M") + x(s.t[i]).toFixed(1) + " " + y(v).toFixed(1)).join(""),
    fill: "none", stroke: s.colour, "stroke-width": 1.6, "stroke-dasharray": s.dashed ? "5 3" : "none" }));
  const upright = marks.flatMap((m) => [rule(x(m.t), top, x(m.t), h - bottom, "var(--bad)", "2 2"),
    label(m.text || "", x(m.t) + (x(m.t) > w * 0.6 ? -3 : 3), top - 5, x(m.t) > w * 0.6 ? "end" : "start")]);
  const points = dots.flatMap((d) => [make("line", { x1: x(d.t), x2: x(d.t), y1: y(d.low), y2: y(d.high), stroke: d.colour, "stroke-width": 6, opacity: 0.4 }),
    make("circle", { cx: x(d.t), cy: y(d.value), r: 3, fill: d.colour })]);
  return make("svg", { viewBox: `0 0 ${w} ${h}` },
    make("rect", { x: left, y: top, width: w - left - 4, height: h - top - bottom, fill: "none", stroke: "var(--line)" }),
    ...across, ...along, ...lines, ...upright, ...points, label(unit, 2, top - 6, "start"), label("s", w - 4, h - 4, "end"));
}

/** A histogram over bins that double every second one, its counts on a logarithmic axis. */
function bars(h) {
  const used = h.counts.findLastIndex((n) => n > 0) + 2, counts = h.counts.slice(0, used);
  const [w, height, left, top] = [300, 150, 42, 18], step = (w - left - 4) / counts.length, foot = height - 18;
  // Half a cycle is the foot of the axis, so that one cycle can be seen.
  const decades = Math.log10(2 * Math.max(...counts, 1)), tall = (n) => (n ? ((foot - top) * Math.log10(2 * n)) / decades : 0);
  const time = (i) => (h.upto_us[i] >= 1000 ? (h.upto_us[i] / 1000).toFixed(0) + " ms" : h.upto_us[i].toFixed(0) + " µs");
  const powers = Array.from({ length: Math.floor(decades) + 1 }, (_, i) => 10 ** i).filter((n) => tall(n) <= foot - top);
  return make("svg", { viewBox: `0 0 ${w} ${height}` }, label("cycles (log scale)", 2, 12, "start"),
    ...powers.flatMap((n) => [make("line", { x1: left, x2: w - 4, y1: foot - tall(n), y2: foot - tall(n), stroke: "var(--line)" }),
      label(String(n), left - 3, foot - tall(n) + 4, "end")]),
    ...counts.map((n, i) => make("rect", { x: left + i * step + 0.5, width: Math.max(step - 1, 1),
      y: foot - tall(n), height: tall(n), fill: "var(--bar)" })),
    ...counts.map((n, i) => i).filter((i) => i % 4 === 3 && i < h.upto_us.length)
      .map((i) => label(time(i), left + (i + 1) * step, height - 4, "middle")));
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
