// Tests of what the page's scripts calculate; a failed one ends with an error.

const assert = require("assert"), fs = require("fs"), path = require("path"), vm = require("vm");

const read = (name) => fs.readFileSync(path.join(__dirname, name), "utf8");
const near = (a, b, by = 1e-9) => assert.ok(Math.abs(a - b) <= by, `${a} is not ${b}`);
const plain = (v) => JSON.parse(JSON.stringify(v));

const space = "../../viewer/assets/report/space.js";
const page = { addEventListener() {}, setInterval() {}, setTimeout, performance, document: { addEventListener() {} } };
const { fromMap, onMap, onHeight, cameraMatrix, axes, Hold } = vm.runInNewContext(
  [space, "../assets/reach.js", "../assets/hold.js"].map(read).join("\n") +
  "\n({ fromMap, onMap, onHeight, cameraMatrix, axes, Hold })", page);

// x is up and y to the left, the base in the middle.
assert.deepStrictEqual(plain(fromMap(200, 200, 400, 1.8)), [0, 0]);
assert.deepStrictEqual(plain(fromMap(400, 0, 400, 1.8)), [1.8, -1.8]);
for (const [x, y] of [[0.95, 0.1], [-0.4, 1.2]]) {
  const [u, v] = onMap(x, y, 400, 1.8), back = fromMap(u, v, 400, 1.8);
  near(back[0], x); near(back[1], y);
}

// The ray through where a place is drawn meets its height in that place.
const view = { canvas: { clientWidth: 700, clientHeight: 400 }, turn: -1.15, tilt: 0.22, far: 2.4, at: [0.45, 0, 0.12] };
const forward = axes(view.turn, view.tilt)[0];
const m = cameraMatrix(view.at.map((v, k) => v - view.far * forward[k]), view.at, 700 / 400);
for (const place of [[0.95, 0.1, 0.3], [0.4, -0.3, -0.2]]) {
  const [cx, cy, w] = [0, 1, 3].map((r) => m[r] * place[0] + m[4 + r] * place[1] + m[8 + r] * place[2] + m[12 + r]);
  const found = onHeight(view, (700 * (1 + cx / w)) / 2, (400 * (1 - cy / w)) / 2, place[2]);
  near(found[0], place[0], 1e-5); near(found[1], place[1], 1e-5);
}
// Above the eye there is no such place.
assert.strictEqual(onHeight(view, 350, 399, 5), null);

// A control sends heartbeats while it is held, one after the other, and lets go when one fails.
(async () => {
  const heard = {}, button = { addEventListener(kind, act) { heard[kind] = act; }, setAttribute() {}, setPointerCapture() {} };
  let open = 0, most = 0, works = true;
  const hold = new Hold(button, async () => {
    most = Math.max(most, ++open);
    await new Promise((done) => setTimeout(done, 20));
    open--;
    return works;
  });
  heard.pointerdown({ pointerId: 1, button: 0, preventDefault() {} });
  await new Promise((done) => setTimeout(done, 400));
  assert.ok(hold.held && hold.beats >= 4 && most === 1, `${hold.beats} heartbeats, ${most} at once`);
  heard.pointerup();
  const given = hold.beats;
  await new Promise((done) => setTimeout(done, 200));
  assert.ok(!hold.held && hold.beats <= given + 1, "it goes on after it was let go of");
  // A key that repeats was pressed for something else.
  heard.keydown({ key: "Enter", repeat: true, preventDefault() {} });
  assert.ok(!hold.held);
  works = false;
  heard.keydown({ key: " ", preventDefault() {} });
  await new Promise((done) => setTimeout(done, 100));
  assert.ok(!hold.held, "it is held although no heartbeat arrives");
})().catch((error) => { console.error(error); process.exitCode = 1; });
