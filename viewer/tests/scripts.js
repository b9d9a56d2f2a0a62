// Tests of what the pages' scripts calculate; a failed one ends with an error.

const assert = require("assert"), fs = require("fs"), path = require("path"), vm = require("vm");

const read = (name) => fs.readFileSync(path.join(__dirname, "../assets", name), "utf8");
/** The values of expressions where these files of the pages are loaded. */
function loaded(files, names) {
  const page = { addEventListener() {}, setInterval() {} };
  return vm.runInNewContext([...files.map(read), `({ ${names} })`].join("\n"), page);
}
const near = (a, b, by = 1e-9) => assert.ok(Math.abs(a - b) <= by, `${a} is not ${b}`);
const plain = (v) => JSON.parse(JSON.stringify(v));

const space = loaded(["report/space.js"], "fitted, axes, opening, cameraMatrix, blend, dashes, dot, minus");
const plots = loaded(["report/plots.js"], "ticks, inWords");
const replay = loaded(["report/replay.js"], "tipAt, moved, strike");

// All places are within the picture, and one of them is near its edge.
for (const aspect of [0.5, 1, 2.5]) {
  const places = [[0, 0, 0], [0.9, 0.3, 0.1], [0.4, -0.2, 0.8]], [turn, tilt] = [-1.15, 0.22];
  const { at, far } = space.fitted(places, turn, tilt, aspect), f = space.axes(turn, tilt)[0];
  const m = space.cameraMatrix(at.map((v, k) => v - far * f[k]), at, aspect);
  const clip = (p) => [0, 1, 3].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
  const outermost = Math.max(...places.map(clip).flatMap(([x, y, w]) => [Math.abs(x / w), Math.abs(y / w)]));
  assert.ok(outermost < 1 && outermost > 0.7, `outermost at ${outermost} for ${aspect}`);
}

// Between two frames; at the last one, and where a row has no partner.
assert.deepStrictEqual(plain(space.blend([[0, 10], [10, 30]], 0.25)), [2.5, 15]);
assert.deepStrictEqual(plain(space.blend([[0, 10], [10, 30]], 1)), [10, 30]);
assert.deepStrictEqual(plain(space.blend([[0, 10], []], 0.5)), [0, 10]);
assert.deepStrictEqual(plain(space.blend([], 0)), []);

// Dashes and gaps of one length, also across corners.
const dashed = space.dashes([[0, 0, 0], [0.5, 0, 0], [1, 0, 0]], 0.2);
const begins = dashed.filter((_, i) => i % 2 === 0).map((p) => p[0]);
[0, 0.4, 0.5, 0.8].forEach((x, i) => near(begins[i], x));
assert.strictEqual(begins.length, 4);
assert.deepStrictEqual(plain(space.dashes([[1, 1, 1], [1, 1, 1]], 0.2)), []);

// Round numbers within the range.
assert.deepStrictEqual(plain(plots.ticks(-0.2, 1.95, 4)), ["0.0", "0.5", "1.0", "1.5"]);
assert.deepStrictEqual(plain(plots.ticks(0, 45, 4)), ["0", "10", "20", "30", "40"]);
assert.deepStrictEqual(plain(plots.ticks(-0.0012, 0.0012, 4)), ["-0.0010", "-0.0005", "0.0000", "0.0005", "0.0010"]);
assert.deepStrictEqual([4e-7, 0.00123, 0.042, null].map(plots.inWords), ["under 0.1 mm", "1.2 mm", "4.2 cm", "not known"]);

// A tip that passes a target at 2 m/s, 1 cm beside it, between two samples.
const passed = [-0.015, -0.005, 0.005, 0.015].map((t) => Math.hypot(2 * t, 0.01));
const curve = { from_s: 1, period_s: 0.01, distance_m: passed, speed_m_s: [2, 2, 2, 2] };
near(replay.tipAt(curve, 1.015).distance_m, 0.01);
near(replay.tipAt(curve, 1.01).distance_m, passed[1]);
near(replay.tipAt(curve, 9).distance_m, passed[3]);
near(replay.tipAt(curve, 1.015).speed_m_s, 2);

// A joint that was to stand still and did not has moved.
assert.strictEqual(replay.moved([1, 1], [1, 1.001]), false);
assert.strictEqual(replay.moved([1, 1.01], []), true);
assert.strictEqual(replay.moved([1, 1], [1, 1.01]), true);
assert.strictEqual(replay.strike({ tip: null, planned: null }), null);
assert.strictEqual(replay.strike({ tip: { closest: { time_s: 1.04 } } }), 1.04);

// The caption of a picture is not shown when it is old.
const watch = read("watch/watch.js"), from = watch.indexOf("function pictureNote"), to = watch.indexOf("function showAge");
const note = vm.runInNewContext(`const OLD_MS = 1500, caption = "camera, live"; ${watch.slice(from, to)}; pictureNote`);
assert.deepStrictEqual(plain(note(200)), [false, "camera, live"]);
assert.deepStrictEqual(plain(note(7400)), [true, "not live: this picture came 7 s ago"]);
