// What one works with: it asks for runs, answers what they ask, and shows what they found.

const POLL_MS = 250;
const number = (id) => Number.parseFloat(byId(id).value);
const target = () => ["x", "y", "z"].map(number);
/** What a test may read. */
const studio = { polls: 0, work: null, found: null, objection: null };
let told = null, map = null, ended = "", asked = 0, foundOf = "", foundRun = "", ghost = null, pastRuns = [];

async function get(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(await answer.text());
  return answer.json();
}

/** Asks for something; what came of it, in words, and whether it was done. */
async function post(path) {
  try {
    const answer = await fetch(path, { method: "POST" });
    return [answer.ok, await answer.text()];
  } catch {
    return [false, "connection to the server lost; use the emergency stop"];
  }
}

const query = (values) => Object.entries(values).filter(([, v]) => v !== "" && v !== null)
  .map(([key, v]) => `${key}=${v}`).join("&");
const isBusy = () => Boolean(told && told.work && !told.work.is_over);
/** A measured value, or nothing where none is written. */
const measured = (id) => (Number.isFinite(number(id)) ? number(id) : "");

// The target: numbers, the map, the view.

let reachWanted = false, reachAsked = 0;
async function reach() {
  if (reachWanted) return;
  reachWanted = true;
  await new Promise((done) => setTimeout(done, 60));
  reachWanted = false;
  const [x, y, z] = target();
  if (!Number.isFinite(z)) return;
  try {
    const values = Number.isFinite(x) && Number.isFinite(y) ? { x, y, z } : { z };
    const mine = ++reachAsked;
    const found = await get("reach?" + query({ ...values, length_m: measured("length") }));
    // An answer that was overtaken is about another target.
    if (mine !== reachAsked) return;
    map = found.map;
    studio.objection = found.objection;
    const open = `Blue: where a rope ${measured("length") ? "of this length" : "of the longest kind"} may reach at this height.`;
    byId("reachnote").textContent = found.objection || open;
    byId("reachnote").classList.toggle("bad", Boolean(found.objection));
  } catch (error) {
    byId("reachnote").textContent = error.message;
  }
  aim();
  buttons();
}

/** Shows the target on the map and in the view. */
function aim() {
  if (map) drawMap(byId("map"), map, target());
  beside.target_m = target().every(Number.isFinite) && !isBusy() ? target() : undefined;
  if (beside.target_m === undefined) delete beside.target_m;
  paint();
}

function setTarget(x, y) {
  if (isBusy()) return;
  [["x", x], ["y", y]].forEach(([id, v]) => { byId(id).value = v.toFixed(2); });
  aim();
  reach();
}

byId("map").addEventListener("click", (e) => {
  if (!map) return;
  const box = byId("map").getBoundingClientRect();
  setTarget(...fromMap(e.clientX - box.left, e.clientY - box.top, box.width, map.half_m));
});
// A press that does not drag sets the target at its height.
let pressed = null;
byId("view").addEventListener("pointerdown", (e) => { pressed = e.isPrimary && !e.shiftKey ? [e.clientX, e.clientY] : null; });
byId("view").addEventListener("pointerup", (e) => {
  if (!pressed || Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) > 4) return;
  const box = byId("view").getBoundingClientRect();
  const at = onHeight(view, e.clientX - box.left, e.clientY - box.top, number("z"));
  if (at && Math.hypot(...at) < 2) setTarget(...at);
});
for (const id of ["x", "y", "z", "length"]) byId(id).addEventListener("input", reach);
addEventListener("resize", aim);

// The run: begin, answer, hold, end.

async function begin(from, run) {
  const [x, y, z] = target(), task = byId("task").value;
  if (told.rig && told.rig[1] !== task && from !== "again") {
    // Its camera must see what the task is about.
    byId("answer").textContent = "the simulated camera moves";
    const [moved, words] = await post("rig?" + query({ seed: told.rig[0], task }));
    if (!moved) return say(words);
  }
  const ticked = (id) => (byId(id).checked ? "yes" : ""), clear = ticked("clear");
  const [, words] = await post("begin?" + query({ from, run: run || "", clear, acknowledge: ticked("acknowledge"), task, x, y, z,
    length_m: measured("length"), lead_mass_kg: measured("mass") }));
  for (const id of ["clear", "acknowledge"]) byId(id).checked = false;
  say(words);
  poll(true);
}
const say = (words) => { byId("answer").textContent = words; };

byId("run").addEventListener("click", () => begin("wiggle"));
byId("wiggle").addEventListener("click", () => begin("wiggle-alone"));
byId("plan").addEventListener("click", () => begin("plan", byId("earlier").value));
byId("again").addEventListener("click", () => begin("again", byId("again").dataset.run));
byId("hang").addEventListener("click", async () => {
  say("the rope is changed");
  const [changed, words] = await post("rig?" + query({ seed: byId("seed").value, task: byId("task").value }));
  // A correction is for the rope that missed.
  if (changed) byId("again").hidden = true;
  say(words);
});
byId("confirm").addEventListener("click", async () => {
  const { word, number } = byId("confirm").dataset;
  byId("confirm").disabled = true;
  const [done, words] = await post("confirm?" + query({ number }));
  say(done ? `${word} confirmed` : words);
  poll(true);
  byId("hold").focus({ preventScroll: true });
});
byId("end").addEventListener("click", async () => say((await post("end"))[1] === "done" ? "the run is ending" : "nothing runs"));
byId("clear").addEventListener("change", () => buttons());
const hold = new Hold(byId("hold"), async () => {
  const [done, words] = await post("hold");
  if (!done) say(words);
  return done;
});

/** Longer than this for a frame or between two heartbeats (ms), and the heartbeats could come too late. */
const SLOW_MS = 80;
// While it is held its heartbeats go first: where drawing is slow, nothing is drawn.
pace_ms = () => (!hold.held ? 0 : Math.max(frame_ms, hold.longest_ms) > SLOW_MS ? Infinity : 100);

/** Buttons that begin something are there when it may begin. */
function buttons() {
  const clear = byId("clear").checked, why = isBusy() ? "A run is under way."
    : !clear ? "Tick the box once the area is clear." : studio.objection ? "The target cannot be reached." : "";
  for (const id of ["run", "plan"]) byId(id).disabled = Boolean(why);
  for (const id of ["wiggle", "again"]) byId(id).disabled = isBusy() || !clear;
  byId("plan").disabled ||= !byId("earlier").value;
  byId("hang").disabled = isBusy();
  byId("beginnote").textContent = why;
}

// What is told.

let shownWork = "";
function showWork(work) {
  const all = JSON.stringify(work);
  if (all === shownWork) return;
  shownWork = all;
  byId("work").hidden = !work;
  const appears = byId("hold").hidden && isBusy();
  byId("end").hidden = byId("hold").hidden = !isBusy();
  if (appears) byId("hold").focus({ preventScroll: true });
  const question = work && work.question;
  byId("question").hidden = byId("confirming").hidden = !question;
  const now = question ? question.number : 0;
  if (now !== asked && question) {
    byId("confirm").disabled = false;
    byId("confirm").dataset.number = question.number;
    byId("question").textContent = question.text;
    byId("confirm").textContent = `Area clear: ${question.word}`;
    byId("confirm").dataset.word = question.word;
  }
  asked = now;
  byId("hold").textContent = work && work.holds ? "Hold to move: the arm waits for it" : "Hold to move";
  if (!work) return;
  byId("workname").textContent = `Run ${work.run}`;
  byId("steps").replaceChildren(...work.stages.map((s) => make("li", s.is_done ? { class: "done" } : {}, make("b", {}, s.stage), ` ${s.text}`)));
  byId("lines").textContent = work.lines.join("\n");
}

/** The run is over: its report, and what can be done next. */
async function showResult(work) {
  byId("result").hidden = false;
  byId("headline").textContent = work.is_ok ? work.headline || `Done: ${work.run}` : `Not done: ${work.error || "no reason is known"}`;
  byId("headline").classList.toggle("bad", !work.is_ok || /^Missed|^\w+ failed/.test(work.headline || ""));
  await history();
  const past = pastRuns.find((run) => run.name === work.run);
  byId("again").hidden = !(past && past.has_throw);
  byId("again").dataset.run = work.run;
  byId("open").hidden = byId("report").hidden = !past;
  if (past) byId("open").href = byId("report").src = `report/${work.run}`;
  hold.release();
  buttons();
}

/** What the run found so far, in words. */
async function showFound(run) {
  if (foundRun !== run) {
    foundRun = run;
    studio.found = null;
    hide3d();
  }
  // A plan does not change.
  if (studio.found && studio.found.plan) return;
  let found;
  try { found = await get("found?" + query({ run })); } catch { return; }
  if (foundRun !== run) return;
  studio.found = found;
  byId("found").hidden = !found.rope.length && !found.plan;
  const text = (words, kind) => make("p", kind ? { class: kind } : {}, words);
  const plan = found.plan, out = found.unconfirmed.map((why) => text(`The track is unconfirmed: ${why}`, "warning"));
  if (plan) {
    const cm = (m) => (100 * m).toFixed(1), expected = plan.forecast && plan.forecast.interval_90_m;
    out.push(text(`${plan.task} at (${plan.target_m.map((v) => v.toFixed(2)).join(", ")}) m: planned ${inWords(plan.predicted_error_m)}` +
      (expected ? `, to expect ${cm(expected[0])} to ${cm(expected[1])} cm in nine of ten.` : ".")), ...plan.warnings.map((w) => text(w, "warning")));
    fill(byId("margins"), [["tightest limits of the plan", "joint", "value", "limit", "used"], ...plan.motion.limits.map((m) =>
      [m.what, m.joint ? String(m.joint) : "", `${short(m.value)} ${m.unit}`, `${short(m.limit)} ${m.unit}`, `${(100 * m.used).toFixed(0)} %`])]);
    show3d(plan.motion);
  }
  byId("words").replaceChildren(...out);
  if (found.rope.length) {
    fill(byId("rope"), [["rope", "identified", "90 % within", "unit"], ...found.rope.map((r) =>
      [r.label, short(r.value), r.interval_90 ? `${short(r.interval_90[0])} to ${short(r.interval_90[1])}` : "", r.unit])]);
  }
}

// A motion that is to come, beside the arm as it is.

const SLOW = 4;
function show3d(motion) {
  ghost = { motion, began: performance.now() };
  byId("hide").hidden = false;
}
function hide3d() {
  ghost = null;
  for (const key of ["ghost", "planned_tip"]) delete beside[key];
  byId("hide").hidden = true;
  paint();
}
setInterval(() => {
  if (!ghost || document.hidden || hold.held) return;
  const { motion, began } = ghost, count = motion.arm.length;
  const frame = Math.floor((performance.now() - began) / 1000 / SLOW / motion.period_s) % count;
  beside.ghost = { arm: motion.arm[frame], rope: motion.rope[frame] || [], radii_m: motion.radii_m };
  beside.planned_tip = motion.rope.flatMap((nodes) => nodes.slice(-3));
  paint();
}, 100);
byId("planbuttons").append(
  button("Show the wiggle", "Show the wiggle", async () => show3d(await get("wiggle"))),
  button("Show the plan", "Show the plan", () => { if (studio.found && studio.found.plan) show3d(studio.found.plan.motion); }),
  make("button", { type: "button", id: "hide", hidden: "" }, "Hide"));
byId("hide").addEventListener("click", hide3d);

// Runs before.

async function history() {
  try { pastRuns = await get("runs"); } catch { return; }
  const cm = (m) => (typeof m === "number" ? `${(100 * m).toFixed(1)} cm` : "");
  fill(byId("runs"), [["run", "task", "target (m)", "result", "planned", "by camera", "truth", ""], ...pastRuns.map(({ name, entry }) =>
    [name, entry.task || "", entry.target_m ? entry.target_m.map((v) => v.toFixed(2)).join(", ") : "",
      entry.result === "ok" ? "done" : entry.problems[0] || entry.result, cm(entry.predicted_m), cm(entry.camera_m), cm(entry.true_m),
      make("a", { href: `report/${name}`, target: "_blank", rel: "noopener" }, "report")])]);
  const kept = byId("earlier").value, ropes = pastRuns.filter((run) => run.has_rope);
  byId("earlier").replaceChildren(...ropes.map((run) => make("option", { value: run.name }, run.name + (run.is_simulated ? " (simulated)" : ""))));
  if (ropes.some((run) => run.name === kept)) byId("earlier").value = kept;
  buttons();
}

// Everything, four times a second.

let first = true;
async function look() {
  told = await get("work");
  const work = told.work;
  studio.work = work;
  document.body.classList.toggle("looking", !told.is_local);
  byId("rig").hidden = !told.rig;
  byId("acknowledgement").hidden = !told.is_service;
  if (first && told.rig) [byId("seed").value, byId("task").value] = told.rig;
  if (first) { first = false; history(); reach(); }
  showWork(work);
  const done = work ? work.run + work.stages.filter((s) => s.is_done).length + work.is_over : "";
  if (done !== foundOf) {
    foundOf = done;
    aim();
    if (work) showFound(work.run);
    buttons();
  }
  if (work && !work.is_over) byId("result").hidden = true;
  if (work && work.is_over && ended !== work.run) { ended = work.run; await showResult(work); }
  studio.polls++;
}

let looking = false;
async function poll(now) {
  if (!looking) {
    looking = true;
    try { await look(); } catch { byId("beginnote").textContent = "connection to the server lost"; }
    looking = false;
  }
  if (!now) setTimeout(poll, POLL_MS);
}
buttons();
poll();
