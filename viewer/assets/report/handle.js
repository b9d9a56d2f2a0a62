// Pointers, wheel and buttons that move the eye of a view.

const HANDLING = "Drag to turn, shift+drag to move, ctrl+wheel to zoom; with two fingers: move and zoom.";

/** One pointer turns, with shift or another button it moves; two move and zoom. */
function handle(view) {
  const c = view.canvas, held = new Map();
  const middle = (a, b) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  c.addEventListener("pointerdown", (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); c.setPointerCapture(e.pointerId); });
  c.addEventListener("pointermove", (e) => {
    const before = held.get(e.pointerId), now = [e.clientX, e.clientY];
    if (!before) return;
    held.set(e.pointerId, now);
    const by = [now[0] - before[0], now[1] - before[1]];
    if (held.size === 1 && (e.shiftKey || e.buttons > 1)) view.pan(...by);
    else if (held.size === 1) view.orbit(-by[0] * 0.008, by[1] * 0.006);
    else if (held.size === 2) {
      const other = [...held].find(([id]) => id !== e.pointerId)[1];
      const apart = (p) => Math.max(10, Math.hypot(p[0] - other[0], p[1] - other[1]));
      const [from, to] = [middle(before, other), middle(now, other)];
      view.pan(to[0] - from[0], to[1] - from[1]);
      view.near(apart(before) / apart(now));
    }
  });
  for (const end of ["pointerup", "pointercancel"]) c.addEventListener(end, (e) => held.delete(e.pointerId));
  // One finger scrolls the page, two are the view's.
  for (const kind of ["touchstart", "touchmove"]) {
    c.addEventListener(kind, (e) => { if (e.touches.length > 1) e.preventDefault(); }, { passive: false });
  }
  // The wheel alone scrolls the page.
  c.addEventListener("wheel", (e) => {
    if (!e.ctrlKey) return;
    e.preventDefault();
    view.near(Math.exp(Math.max(-60, Math.min(60, e.deltaY)) * 0.004));
  }, { passive: false });
  c.addEventListener("contextmenu", (e) => e.preventDefault());
  addEventListener("resize", () => view.draw());
}

/** A button that does one thing. */
function button(text, label, act) {
  const b = make("button", { type: "button", "aria-label": label }, text);
  b.addEventListener("click", act);
  return b;
}

/** Buttons for those who have no wheel or no pointer. */
function eyeButtons(view) {
  return [button("−", "Zoom out", () => view.near(1.25)), button("+", "Zoom in", () => view.near(0.8)),
    button("Reset view", "Reset view", () => view.reset())];
}
