// Puts the run's data into the page. Everything from the run goes in as text.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const hide = (id) => { byId(id).hidden = true; };

function head() {
  const s = data.summary || {};
  document.title = `${data.headline} – ${data.run}`;
  byId("title").textContent = data.headline;
  const head = ["run " + data.run, s.command, s.task, s.seed !== undefined && "seed " + s.seed,
    s.ok === true ? "succeeded" : s.ok === false ? "failed" : null, s.error].filter(Boolean);
  byId("subtitle").textContent = head.map(String).join(" · ");
  byId("footer").textContent = `Made by wag ${data.version} from the run folder alone.`;
  if (data.cause) { byId("stopped").hidden = false; byId("cause").textContent = data.cause; }
}

function errors() {
  const e = data.error, range = (i, of) => (i ? `${inWords(i[0])} to ${inWords(i[1])} (${of})` : "");
  // A drape's distance is that of the rope's middle, which no replay of a tip tells.
  const drapes = (data.summary || {}).task === "drape", of = (curve) => (curve && !drapes ? curve.closest : {});
  const throws = data.scenes.find((s) => s.tip) || {}, [planned, replayed] = [of(throws.planned), of(throws.tip)];
  const rows = [["planned", e.planned_m, planned, range(e.forecast_90_m, "90 % of the forecast")],
    ["replayed: the identified rope, simulated under the joints of the run", replayed.distance_m, replayed, ""],
    ["measured by the camera", e.camera_m, {}, range(e.camera_interval_m, "2 standard errors")],
    ["true (simulated rig)", e.true_m, {}, ""]].filter((r) => typeof r[1] === "number");
  if (!rows.length) return hide("outcome");
  const number = (v) => (typeof v === "number" ? v.toFixed(2) : "–");
  fill(byId("errors"), [[drapes ? "distance of the rope's middle from the edge" : "closest approach of tip and target", "distance", "interval", "at (s)", "tip speed (m/s)"],
    ...rows.map(([name, m, at, i]) => [name, inWords(m), i || "–", number(at.time_s), number(at.speed_m_s)])]);
}

/** How much of a limit was used: of a joint's range, the way to its nearer end. */
const used = (r) => (r.to_end_deg === null ? (100 * r.used).toFixed(1) + " % used"
  : r.to_end_deg.toFixed(1) + "° to the nearer end");

function limits() {
  const [found, planned] = [data.limits, data.planned_limits];
  if (!found.length && !planned.length) return hide("limits");
  const table = (id, name, rows) => rows.length && fill(byId(id), [[name, "motion", "joint", "extreme", "limit", "unit", "margin"],
    ...rows.map((r) => [r.what, r.motion || "–", r.joint || "–", short(r.value), short(r.limit), r.unit, used(r)])]);
  if (data.explanation) {
    byId("limitnote").textContent = `${data.explanation.cycles} cycles in ${data.explanation.duration_s.toFixed(1)} s; ` +
      (data.explanation.stopped ? "the arm was stopped." : "the arm was not stopped.") +
      data.explanation.flaws.map((f) => " The recording is incomplete: " + f + ".").join("");
    table("margins", "as commanded", found);
  }
  table("planmargins", "as planned (the tightest)", planned);
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
  const list = (of) => (of && Array.isArray(of.warnings) ? of.warnings : []);
  byId("warnings").replaceChildren(...[...list(s), ...list(s.scored_by)].map((w) => make("li", {}, "warning: " + w)));
  byId("missing").replaceChildren(...data.missing.map((m) => make("li", {}, "not in this run: " + m)));
  byId("summary").textContent = JSON.stringify(s, null, 2);
}

for (const part of [head, errors, replay, limits, rope, loop, film, rest]) part();
