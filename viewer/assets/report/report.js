// Puts the run's data into the page. Everything from the run goes in as text.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const hide = (id) => { byId(id).hidden = true; };

function head() {
  const s = data.summary || {};
  document.title = "wag report: " + data.run;
  byId("title").textContent = data.run;
  const head = [s.command, s.task, s.seed !== undefined && "seed " + s.seed,
    s.ok === true ? "succeeded" : s.ok === false ? "failed" : null, s.error].filter(Boolean);
  byId("subtitle").textContent = head.map(String).join(" · ");
  byId("footer").textContent = `Made by wag ${data.version} from the run folder alone.`;
  if (data.cause) { byId("stopped").hidden = false; byId("cause").textContent = data.cause; }
}

function errors() {
  const e = data.error, range = (i) => (i ? `${cm(i[0])} to ${cm(i[1])}` : "");
  const rows = [["predicted by the plan", e.planned_m, range(e.forecast_90_m)],
    ["achieved (the simulator's truth)", e.true_m, ""],
    ["measured by the camera", e.camera_m, range(e.camera_interval_m)]].filter((r) => r[1] !== null);
  if (!rows.length) return hide("outcome");
  fill(byId("errors"), [["closest approach of tip and target", "distance", "interval"],
    ...rows.map(([name, m, i]) => [name, cm(m), i])]);
}

function limits() {
  const found = data.explanation ? data.explanation.margins : [];
  if (!found.length && !data.plan_margins.length) return hide("limits");
  if (data.explanation) {
    byId("limitnote").textContent = `${data.explanation.cycles} cycles in ${data.explanation.duration_s.toFixed(1)} s; ` +
      (data.explanation.stopped ? "the arm was stopped." : "the arm was not stopped.") +
      data.explanation.flaws.map((f) => " The recording is incomplete: " + f + ".").join("");
    fill(byId("margins"), [["as commanded", "used", "value", "allowed", "unit", "joint"],
      ...found.map((m) => [m.what, (100 * m.part).toFixed(1) + " %", short(m.value), short(m.limit), m.unit, m.joint || "–"])]);
  }
  const tight = [...data.plan_margins].sort((a, b) => a.left - b.left).slice(0, 6);
  if (tight.length) {
    fill(byId("planmargins"), [["as planned (the six tightest)", "left", "value", "allowed", "at s"],
      ...tight.map((m) => [(m.joint ? "joint " + m.joint : "tool") + " " + m.kind.replaceAll("_", " "),
        (100 * m.left).toFixed(1) + " %", short(m.value), short(m.limit), m.time_s.toFixed(2)])]);
  }
}

function rope() {
  if (!data.rope.length) return hide("rope");
  fill(byId("parameters"), [["parameter", "identified", "90 % interval", "truth", "unit", ""],
    ...data.rope.map((r) => [r.label, short(r.value), r.interval_90 ? r.interval_90.map(short).join(" to ") : "–",
      r.truth === null ? "–" : short(r.truth), r.unit, span(r)])]);
}

function loop() {
  if (!data.latency.length) return hide("loop");
  byId("latency").replaceChildren(...data.latency.map((h) => make("figure", {}, bars(h),
    make("figcaption", {}, `${h.name}: ${h.cycles} cycles, median ${h.p50_us.toFixed(0)} µs, p99 ` +
      `${h.p99_us.toFixed(0)} µs, max ${h.max_us.toFixed(0)} µs`))));
}

function film() {
  if (!data.pictures.length) return hide("film");
  byId("pictures").replaceChildren(...data.pictures.map((p) => make("figure", {},
    make("img", { src: p.url, alt: p.title }), make("figcaption", {}, p.title))));
}

function rest() {
  const s = data.summary || {};
  byId("warnings").replaceChildren(...(Array.isArray(s.warnings) ? s.warnings : []).map((w) => make("li", {}, "warning: " + w)));
  byId("missing").replaceChildren(...data.missing.map((m) => make("li", {}, "not in this run: " + m)));
  byId("summary").textContent = JSON.stringify(s, null, 2);
}

/** Joints of a scene: wanted and measured, and the largest difference. */
function joints(scene) {
  const j = scene.joints, measured = j.measured[0].length > 0;
  byId("jointnote").textContent = `Dashed: ${j.wanted_is}. ` + (measured
    ? "Solid: measured. The difference is mostly the arm's lag." : "Nothing was measured.");
  byId("joints").replaceChildren(...j.wanted.map((wanted, i) => {
    const apart = Math.max(0, ...j.measured[i].map((v, k) => Math.abs(v - wanted[k])));
    return make("figure", {}, curves(j.t_s, [
      { values: j.measured[i], colour: "var(--measured)" },
      { values: wanted, colour: "var(--wanted)", dashed: true }]),
      make("figcaption", {}, `joint ${i + 1} (rad)` + (measured ? `, at most ${apart.toFixed(4)} apart` : "")));
  }));
}

/** The replay: which scene, which frame, and whether it runs. */
function replay() {
  if (!data.scenes.length) { hide("replay"); return hide("motion"); }
  const view = new View(byId("view")), slider = byId("time"), play = byId("play");
  let scene = null, running = null;
  const show = (frame) => {
    slider.value = frame;
    byId("clock").textContent = (scene.from_s + frame * scene.period_s).toFixed(2) + " s";
    view.show(scene, frame);
  };
  const stop = () => { running = null; play.textContent = "Play"; };
  const step = () => {
    if (!running) return;
    const frame = Math.floor(running.frame + (performance.now() - running.since) / 1000 / scene.period_s);
    show(Math.min(frame, scene.arm.length - 1));
    if (frame >= scene.arm.length - 1) stop(); else requestAnimationFrame(step);
  };
  play.addEventListener("click", () => {
    if (running) return stop();
    const at = Number(slider.value);
    running = { frame: at >= scene.arm.length - 1 ? 0 : at, since: performance.now() };
    play.textContent = "Pause";
    requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  const choose = (index) => {
    stop();
    scene = data.scenes[index];
    slider.max = scene.arm.length - 1;
    [...byId("scenes").children].forEach((b, i) => b.setAttribute("aria-pressed", String(i === index)));
    byId("viewnote").textContent = "Drag to rotate, scroll or pinch to zoom. " +
      (scene.rope.length ? "The rope is the identified one, simulated from rest under the joints of the run. Green: tip path. " : "") +
      (scene.planned_tip.length ? "Orange: planned tip path." : "") +
      (view.gl ? "" : " This browser has no WebGL, so nothing is drawn.");
    joints(scene);
    show(0);
  };
  byId("scenes").replaceChildren(...data.scenes.map((s, i) => {
    const button = make("button", { type: "button" }, s.name);
    button.addEventListener("click", () => choose(i));
    return button;
  }));
  choose(data.scenes.length - 1);
}

for (const part of [head, errors, limits, rope, loop, film, rest, replay]) part();
