// Shows the newest state and the newest picture; never keeps a queue of either.

const byId = (id) => document.getElementById(id);
// Twenty-five times a second also without a graphics card: smooth edges cost half of that.
const view = new View(byId("view"), false);
const TIPS_MAX = 150;
const WORDS = { stop: "Stop", disarm: "Disarm" };
const STAGES = ["start", "bring-up", "wiggle", "track", "identify", "plan", "settle", "throw", "score"];
const words = (name) => String(name).replaceAll("_", " ");
/** What a test may read. */
const watched = { states: 0, drawn: 0, pictures: 0, last: null };
let tips = [], shownAsks = "", shownController = "", shownStage = "";
/** Longer without a new picture, the one in view is no longer live (ms). */
const OLD_MS = 1500;
let caption = "", pictured = null, framed = false;
/** The scene in view, and what a page that loads this draws beside it. */
let scene = { cell: null, arm: [[]], rope: [[]], tips: [], planned_tip: [], radii_m: [0, 0] };
const beside = {};
const paint = () => { if (scene.cell) view.show({ ...scene, ...beside }, 0); };
byId("eyebuttons").replaceChildren(...eyeButtons(view));

function controller(c) {
  // Rows that stay the same are not laid out again.
  const now = JSON.stringify({ ...c, cycle: 0 });
  if (now === shownController) {
    if (c) byId("controller").rows[6].cells[1].textContent = c.cycle;
    return;
  }
  shownController = now;
  if (!c) return fill(byId("controller"), [["controller", "none"]]);
  const stop = c.stop ? `${words(c.stop.code)} in cycle ${c.stop.cycle}${c.stop.latched ? ", latched" : ", acknowledged"}: ${c.stop.words}` : "none since this page was opened";
  fill(byId("controller"), [["controller", c.alive ? "running" : "silent"], ["mode", words(c.mode)], ["armed for", c.operating_mode ? words(c.operating_mode) : "nothing"],
    ["operator", c.operator ? "present" : "none"], ["last stop", stop],
    ["real-time priority and locked memory", c.real_time ? "yes" : "no"], ["cycle", String(c.cycle)]]);
}

async function ask(name, button) {
  button.disabled = true;
  byId("answer").textContent = `${WORDS[name]}: requested`;
  try {
    const answer = await fetch("ask/" + name, { method: "POST", priority: "high" });
    byId("answer").textContent = `${WORDS[name]}: ${await answer.text()}`;
  } catch {
    byId("answer").textContent = `${WORDS[name]}: connection to the server lost; use the emergency stop`;
  }
  button.disabled = false;
}

/** The stop button is always there; any other only while it may be used. */
function asks(list) {
  const able = list.filter(([name, objection]) => name === "stop" || !objection);
  const now = JSON.stringify(list);
  if (now === shownAsks) return;
  shownAsks = now;
  byId("asks").replaceChildren(...able.map(([name, objection]) => {
    const button = make("button", { type: "button", id: name }, WORDS[name]);
    button.disabled = Boolean(objection);
    // A stop does not wait until the pointer is released; keys click without one (detail 0).
    if (name === "stop") button.addEventListener("pointerdown", () => ask(name, button));
    button.addEventListener("click", (e) => { if (name !== "stop" || e.detail === 0) ask(name, button); });
    return button;
  }));
  byId("asknote").textContent = list.filter(([, objection]) => objection)
    .map(([name, objection]) => `${WORDS[name]}: ${objection}`).join(" · ");
}

function jitter(histograms, missed) {
  byId("loopnote").textContent = `The last ten seconds. Missed since this page was opened: ${missed}.`;
  byId("jitter").replaceChildren(...histograms.map((h) => make("figure", {}, bars(h),
    make("figcaption", {}, `${h.name}: median ${h.p50_us.toFixed(0)} µs, p99 ` +
      `${h.p99_us.toFixed(0)} µs, max ${h.max_us.toFixed(0)} µs`))));
}

/** The stages of a run, those before the present one as done. */
function stages(stage) {
  byId("stages").hidden = !stage;
  if (!stage || stage === shownStage) return;
  shownStage = stage;
  const at = STAGES.indexOf(stage);
  byId("stages").replaceChildren(...STAGES.map((name, i) =>
    make("li", i === at ? { "aria-current": "step" } : i < at ? { class: "done" } : {}, name)));
}

/** What is below the picture: its caption, or how old it is. */
function pictureNote(age_ms) {
  const old = age_ms > OLD_MS;
  return [old, old ? `not live: this picture came ${(age_ms / 1000).toFixed(0)} s ago` : caption];
}

function showAge() {
  if (pictured === null) return;
  const note = byId("picturenote"), [old, text] = pictureNote(performance.now() - pictured);
  if (note.textContent !== text) note.textContent = text;
  note.classList.toggle("old", old);
}
setInterval(showAge, 500);

/** The arm and all that belongs to it in view, once; later only by the reset button. */
function frameOnce(s) {
  if (!s.arm.length) return;
  const target_m = s.target_m || beside.target_m;
  view.home = [...points(s.arm), ...points(s.rope), ...(target_m ? [target_m] : [])];
  if (!framed) view.reset();
  framed = true;
}

function draw(s) {
  byId("title").textContent = s.title;
  byId("note").textContent = s.note;
  scene = { cell: s.cell, arm: [s.arm], rope: [s.rope], tips, planned_tip: [], radii_m: s.radii_m, target_m: s.target_m };
  paint();
  byId("viewnote").textContent = `${HANDLING} Rope: ${s.rope_is || "none"}.` +
    (view.gl ? "" : " This browser has no WebGL, so nothing is drawn.");
  frameOnce(s);
  stages(s.stage);
  controller(s.controller);
  asks(s.asks);
  byId("eye").hidden = !s.camera && !watched.pictures;
  watched.drawn++;
}

/** Least time between two drawings (ms), where a page that loads this has something more urgent;
 * Infinity for none. */
let pace_ms = () => 0;
/** Draws once for each frame of the screen, the newest state only; how long a frame takes (ms). */
let newest = null, drawn_ms = 0, frame_ms = 0;
function show(s) {
  if (s.jitter) jitter(s.jitter, s.missed);
  const tip = s.rope.slice(-3);
  tips = tip.length ? [...tips, tip].slice(-TIPS_MAX) : [];
  if (!newest && performance.now() - drawn_ms >= pace_ms()) {
    const wanted_ms = performance.now();
    requestAnimationFrame(() => {
      const s = newest;
      newest = null;
      drawn_ms = performance.now();
      draw(s);
      frame_ms += 0.2 * (performance.now() - wanted_ms - frame_ms);
    });
    newest = s;
  } else if (newest) newest = s;
  watched.states++;
  watched.last = s;
}

/** Draws the contents of a picture's header over it. */
function over(c, o) {
  const at = ([u, v]) => [(u + 0.5) / o.scale, (v + 0.5) / o.scale];
  c.fillStyle = "#ffd400";
  for (const p of o.rope) c.fillRect(at(p)[0] - 1.5, at(p)[1] - 1.5, 3, 3);
  if (!o.keypoints.length) return;
  c.strokeStyle = o.lost ? "#ff0000" : "#00ffff"; c.fillStyle = "#ff00ff"; c.lineWidth = 1.5;
  c.beginPath();
  for (const p of o.keypoints) c.lineTo(...at(p));
  c.stroke();
  for (const p of o.keypoints) c.fillRect(at(p)[0] - 2, at(p)[1] - 2, 4, 4);
}

/** Fetches one picture after the other, the next only when this one is drawn. */
async function pictures() {
  const canvas = byId("picture");
  let seen = 0;
  for (;;) {
    const wait = (ms) => new Promise((done) => setTimeout(done, ms));
    if (document.hidden || pace_ms() === Infinity || !(watched.last && watched.last.camera)) { await wait(300); continue; }
    try {
      const answer = await fetch("picture?after=" + seen);
      if (answer.status !== 200) { await wait(answer.status === 204 ? 0 : 1000); continue; }
      seen = Number(answer.headers.get("X-Number"));
      const o = JSON.parse(answer.headers.get("X-Over"));
      const image = await createImageBitmap(await answer.blob());
      if (canvas.width !== image.width) canvas.width = image.width;
      if (canvas.height !== image.height) canvas.height = image.height;
      const c = canvas.getContext("2d");
      c.drawImage(image, 0, 0);
      image.close();
      over(c, o);
      caption = o.caption;
      pictured = performance.now();
      showAge();
      watched.pictures++;
      if (pace_ms() < Infinity) await wait(pace_ms());
    } catch { await wait(1000); }
  }
}

const events = new EventSource("state");
events.onmessage = (e) => show(JSON.parse(e.data));
events.onerror = () => { byId("note").textContent = "connection to the server lost; what is shown is outdated, and the buttons do nothing"; };
pictures();
