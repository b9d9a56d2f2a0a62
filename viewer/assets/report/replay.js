// A motion in space and as curves: which one, which moment, how fast.

/** Instants of a curve's samples (s). */
const instants = (c) => c.distance_m.map((_, i) => c.from_s + i * c.period_s);

/** Distance (m) and speed (m/s) of the tip at a time (s), along straight ways between samples. */
function tipAt(curve, t) {
  const n = curve.distance_m.length - 1, place = Math.min(n, Math.max(0, (t - curve.from_s) / curve.period_s));
  const i = Math.min(n - 1, Math.floor(place)), x = place - i;
  const [[a, b], [u, v]] = [curve.distance_m, curve.speed_m_s].map((s) => [s[i], s[i + 1]]);
  const speed = u + x * (v - u), way = curve.period_s * (u + v) / 2;
  // The square of the distance to a point is a parabola along a straight way.
  const square = (1 - x) * a * a + x * b * b - x * (1 - x) * way * way;
  return { distance_m: Math.sqrt(Math.max(0, square)), speed_m_s: speed };
}

/** The time of the strike (s); null of a motion that is no throw. */
const strike = (scene) => (scene.tip || scene.planned || { closest: { time_s: null } }).closest.time_s;

/** Whether a joint moved, or was to: by more than 0.1 degrees, or measured more than the encoders' noise. */
function moved(wanted, measured) {
  const span = (v) => (v.length ? Math.max(...v) - Math.min(...v) : 0);
  return span(wanted) > 0.00175 || span(measured) > 0.005;
}

/** Names of colours under a picture. */
function legend(...entries) {
  return make("p", { class: "legend" }, ...entries.map(([kind, text]) =>
    make("span", {}, make("i", { class: "swatch " + kind }), text)));
}

/** Places that have to be in view: rope and target through the throw, or the arm as well. */
function inView(scene, frame, whole) {
  const last = (rows) => points(rows[rows.length - 1] || []), at = (rows, f) => points(blend(rows, f));
  const rope = [0, frame].flatMap((f) => at(scene.rope, f)), target = scene.target_m ? [scene.target_m] : [];
  if (!whole && rope.length && target.length && strike(scene) !== null) return [...rope, ...target];
  return [...at(scene.arm, 0), ...at(scene.arm, frame), ...last(scene.arm), ...rope, ...target];
}

/** Distance of tip and target, and speed of the tip, with what was measured at the strike. */
function tipCurves(scene) {
  const curves = [[scene.planned, "var(--planned)", true], [scene.tip, "var(--tip)", false]].filter(([c]) => c);
  byId("tip").hidden = !curves.length;
  if (!curves.length) return;
  // A drape's distances are not those of the tip.
  const t = strike(scene), e = (data.summary || {}).task === "drape" ? {} : data.error, size = [450, 190];
  const marks = [{ t, text: `closest approach, ${t.toFixed(2)} s` }];
  const of = (key, factor) => curves.map(([c, colour, dashed]) =>
    ({ t: instants(c), values: c[key].map((v) => v * factor), colour, dashed }));
  const dot = (m, i, colour) => (typeof m === "number" ? [{ t, value: 100 * m, low: 100 * (i || [m])[0], high: 100 * (i || [m, m])[1], colour }] : []);
  const dots = [...dot(e.camera_m, e.camera_interval_m, "var(--measured)"), ...dot(e.true_m, null, "var(--bad)")];
  const known = [[typeof e.camera_m === "number", "measured", "measured by the camera, with its interval"], [typeof e.true_m === "number", "true", "true (simulated rig)"]];
  byId("tipcurves").replaceChildren(
    make("figure", {}, chart({ unit: "cm", series: of("distance_m", 100), marks, dots, zero: true, size }), make("figcaption", {}, "tip–target distance")),
    make("figure", {}, chart({ unit: "m/s", series: of("speed_m_s", 1), marks, zero: true, size }), make("figcaption", {}, "tip speed")),
    legend(...curves.map(([, , dashed]) => (dashed ? ["planned", "planned"] : ["tip", "replayed"])), ...known.filter(([is]) => is).map((k) => k.slice(1))));
  byId("tipnote").textContent = "Replayed: the identified rope, simulated under the joints of the run. " +
    (dots.length ? "Dots: the smallest distance, drawn at the replay's closest approach." : "");
}

/** Each joint that moved: where it was, and its tracking error. */
function joints(scene) {
  const j = scene.joints, measured = j.measured[0].length > 0, lag_s = (data.summary || {}).arm_lag_s;
  const marks = strike(scene) === null ? [] : [{ t: strike(scene), text: "strike" }];
  const most = (i) => Math.max(0, ...j.error[i].map(Math.abs)) * 1e3;
  const degrees = (v) => v.map((x) => (x * 180) / Math.PI);
  const one = (i) => make("figure", {},
    chart({ unit: "deg", marks, least: 1, series: [{ t: j.t_s, values: degrees(j.measured[i]), colour: "var(--measured)" },
      { t: j.t_s, values: degrees(j.wanted[i]), colour: "var(--wanted)", dashed: true }] }),
    ...(measured ? [chart({ unit: "mrad", marks, least: 1, series: [{ t: j.t_s, values: j.error[i].map((v) => v * 1e3), colour: "var(--ink)" }] })] : []),
    make("figcaption", {}, `joint ${i + 1}` + (measured ? `; below: tracking error, at most ${most(i).toFixed(1)} mrad` : "")));
  const all = j.wanted.map((_, i) => i), moving = all.filter((i) => moved(j.wanted[i], j.measured[i]));
  const still = all.filter((i) => !moving.includes(i)), named = still.map((i) => i + 1).join(", ");
  byId("jointnote").textContent = `Dashed: ${j.wanted_is}. ` + (measured
    ? "Solid: measured. Tracking error: setpoint minus measured" + (lag_s ? `; most of it is the arm's lag of ${(1e3 * lag_s).toFixed(0)} ms.` : ".")
    : "Nothing was measured.");
  byId("joints").replaceChildren(...moving.map(one));
  byId("still").hidden = !still.length;
  byId("stillnames").textContent = `${still.length > 1 ? "Joints" : "Joint"} ${named} did not move` +
    (measured && still.length ? ` (tracking error at most ${Math.max(...still.map(most)).toFixed(1)} mrad)` : "");
  byId("stilljoints").replaceChildren(...still.map(one));
}

/** The replay: which scene, which frame, and whether it runs. */
function replay() {
  if (!data.scenes.length) return ["replay", "tip", "motion"].forEach(hide);
  const view = new View(byId("view")), slider = byId("time"), play = byId("play");
  let scene = null, running = null, speed = 1;
  const end = () => scene.arm.length - 1, time = (frame) => scene.from_s + frame * scene.period_s;
  const frameAt = (t) => Math.min(end(), Math.max(0, (t - scene.from_s) / scene.period_s));
  const pressed = (buttons, index) => [...buttons].forEach((b, i) => b.setAttribute("aria-pressed", String(i === index)));
  const show = (frame) => {
    slider.value = frame;
    byId("clock").textContent = time(frame).toFixed(2) + " s";
    const tip = scene.tip ? tipAt(scene.tip, time(frame)) : null;
    byId("apart").textContent = tip ? `tip–target ${inWords(tip.distance_m)}, tip speed ${tip.speed_m_s.toFixed(2)} m/s` : "";
    view.show(scene, frame);
  };
  const stop = () => { running = null; play.textContent = "Play"; };
  const begin = (frame) => { running = { frame, since: performance.now() }; };
  const now = () => running.frame + ((performance.now() - running.since) / 1000 / scene.period_s) * speed;
  const step = () => {
    if (!running) return;
    const frame = Math.min(now(), end());
    show(frame);
    if (frame >= end()) stop(); else requestAnimationFrame(step);
  };
  play.addEventListener("click", () => {
    if (running) return stop();
    begin(Number(slider.value) >= end() ? 0 : Number(slider.value));
    play.textContent = "Pause";
    requestAnimationFrame(step);
  });
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  const speeds = [[1, "1×"], [1 / 4, "1/4"], [1 / 10, "1/10"]].map(([factor, text], i) => button(text, `Playback speed ${text}`, () => {
    if (running) begin(now());
    speed = factor;
    pressed(byId("speeds").children, i);
  }));
  byId("speeds").replaceChildren(...speeds);
  pressed(speeds, 0);
  const jump = button("Jump to strike", "Jump to the closest approach", () => { stop(); show(frameAt(strike(scene))); });
  const whole = button("Whole arm", "Show the whole arm", () => view.look(inView(scene, frameAt(strike(scene) || 0), true)));
  byId("eye").replaceChildren(jump, whole, ...eyeButtons(view));
  const choose = (index) => {
    stop();
    scene = data.scenes[index];
    slider.max = end();
    pressed(byId("scenes").children, index);
    jump.hidden = strike(scene) === null;
    byId("legend").replaceChildren(legend(...(scene.rope.length ? [["tip", "tip path, replayed"]] : []),
      ...(scene.planned_tip.length ? [["planned", "tip path, planned"]] : []), ...(scene.target_m ? [["true", "target"]] : [])));
    byId("viewnote").textContent = HANDLING +
      (scene.rope.length ? " The rope is the identified one, simulated from rest under the joints of the run." : "") +
      (view.gl ? "" : " This browser has no WebGL, so nothing is drawn.");
    joints(scene);
    tipCurves(scene);
    const frame = strike(scene) === null ? 0 : frameAt(strike(scene));
    view.frame(inView(scene, frame, false));
    show(frame);
  };
  byId("scenes").replaceChildren(...data.scenes.map((s, i) => button(s.name, `Show ${s.name}`, () => choose(i))));
  const thrown = data.scenes.findLastIndex((s) => strike(s) !== null);
  choose(thrown < 0 ? data.scenes.length - 1 : thrown);
}
