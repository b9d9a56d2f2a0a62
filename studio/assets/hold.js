// The hold-to-run control: while it is held, and only then, the arm is let move.

/** Time between two heartbeats (ms); the arm stops when none comes for 300 ms. */
const BEAT_MS = 50;

/**
 * A button that is held with a pointer, or with the space bar or Enter while it has the focus.
 * It lets go when it is released, when its page is hidden or loses the focus, and when a heartbeat
 * cannot be sent. One is sent only after the one before has arrived, so none is kept for later.
 */
class Hold {
  constructor(button, give) {
    Object.assign(this, { button, give, held: false, presses: 0, beats: 0, longest_ms: 0 });
    const press = (e) => { e.preventDefault(); this.press(); };
    button.addEventListener("pointerdown", (e) => { if (e.button === 0) { button.setPointerCapture(e.pointerId); press(e); } });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(end, () => this.release());
    button.addEventListener("keydown", (e) => { if (e.key !== " " && e.key !== "Enter") return;
      e.preventDefault();
      // A key that was pressed for something else holds nothing.
      if (!e.repeat) this.press();
    });
    button.addEventListener("keyup", () => this.release());
    button.addEventListener("contextmenu", (e) => e.preventDefault());
    addEventListener("blur", () => this.release());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.release(); });
  }

  press() {
    if (this.held) return;
    this.held = true;
    this.presses++;
    this.button.setAttribute("aria-pressed", "true");
    this.go();
  }

  release() {
    this.held = false;
    this.button.setAttribute("aria-pressed", "false");
  }

  async go() {
    const press = this.presses;
    for (let last = performance.now(); this.held && press === this.presses; last = performance.now()) {
      const next = new Promise((done) => setTimeout(done, BEAT_MS));
      if (!(await this.give())) return this.release();
      this.beats++;
      await next;
      this.longest_ms = Math.max(this.longest_ms, performance.now() - last);
    }
  }
}
