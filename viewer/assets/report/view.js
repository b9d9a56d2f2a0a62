// Arm, pole, rope and target in WebGL: cylinders, balls and lines, nothing more.

const VERTEX = `
attribute vec3 place; attribute vec3 normal;
uniform mat4 model; uniform mat4 camera; varying vec3 out_normal;
void main() {
  out_normal = mat3(model) * normal;
  gl_Position = camera * model * vec4(place, 1.0);
}`;
const FRAGMENT = `
precision mediump float;
uniform vec3 colour; uniform float lit; varying vec3 out_normal;
void main() {
  float light = 1.0;
  if (lit > 0.5) {
    vec3 n = normalize(out_normal);
    light = 0.45 + 0.4 * max(dot(n, vec3(0.3, -0.6, 0.74)), 0.0)
          + 0.15 * max(dot(n, vec3(-0.7, 0.5, 0.5)), 0.0);
  }
  gl_FragColor = vec4(colour * light, 1.0);
}`;

/** Unit cylinder along z from 0 to 1, radius 1: place and normal of each corner. */
function cylinder(sides) {
  const out = [];
  for (let i = 0; i < sides; i++) {
    const [a, b] = [i, i + 1].map((k) => (2 * Math.PI * k) / sides);
    const corner = (t, z) => out.push(Math.cos(t), Math.sin(t), z, Math.cos(t), Math.sin(t), 0);
    corner(a, 0); corner(b, 0); corner(b, 1);
    corner(a, 0); corner(b, 1); corner(a, 1);
  }
  return out;
}

/** Unit ball. */
function ball(rings, sides) {
  const out = [];
  const corner = (i, k) => {
    const [t, u] = [(Math.PI * i) / rings, (2 * Math.PI * k) / sides];
    const p = [Math.sin(t) * Math.cos(u), Math.sin(t) * Math.sin(u), Math.cos(t)];
    out.push(...p, ...p);
  };
  for (let i = 0; i < rings; i++) {
    for (let k = 0; k < sides; k++) {
      corner(i, k); corner(i + 1, k); corner(i + 1, k + 1);
      corner(i, k); corner(i + 1, k + 1); corner(i, k + 1);
    }
  }
  return out;
}

class View {
  constructor(canvas, antialias = true) {
    this.canvas = canvas;
    this.turn = -1.15; this.tilt = 0.22; this.far = 2.4; this.at = [0.45, 0, 0.12];
    this.home = null;
    const gl = canvas.getContext("webgl", { antialias, preserveDrawingBuffer: true });
    this.gl = gl;
    if (!gl) return;
    const shader = (kind, text) => {
      const s = gl.createShader(kind);
      gl.shaderSource(s, text); gl.compileShader(s);
      return s;
    };
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(program); gl.useProgram(program);
    this.place = { model: gl.getUniformLocation(program, "model"), camera: gl.getUniformLocation(program, "camera"),
      colour: gl.getUniformLocation(program, "colour"), lit: gl.getUniformLocation(program, "lit") };
    this.corners = [gl.getAttribLocation(program, "place"), gl.getAttribLocation(program, "normal")];
    this.corners.forEach((c) => gl.enableVertexAttribArray(c));
    gl.enable(gl.DEPTH_TEST);
    this.cylinder = this.mesh(cylinder(20)); this.ball = this.mesh(ball(12, 20));
    // A rope's corners are small and many.
    this.thin = this.mesh(cylinder(8)); this.bead = this.mesh(ball(4, 8));
    this.line = this.mesh([]);
    handle(this);
  }

  mesh(numbers) {
    const buffer = this.gl.createBuffer();
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, new Float32Array(numbers), this.gl.STATIC_DRAW);
    return { buffer, count: numbers.length / 6 };
  }

  /** Comes nearer or goes farther away. */
  near(factor) {
    this.far = Math.min(8, Math.max(0.15, this.far * factor));
    this.draw();
  }

  /** Shifts what is looked at by pixels of the canvas. */
  pan(right, down) {
    const [, s, u] = axes(this.turn, this.tilt), c = this.canvas;
    const m = (2 * this.far * opening(c.clientWidth / c.clientHeight)[1]) / c.clientHeight;
    this.at = this.at.map((v, k) => v + m * (u[k] * down - s[k] * right));
    this.draw();
  }

  /** Turns around what is looked at. */
  orbit(turn, tilt) {
    this.turn += turn;
    this.tilt = Math.min(1.5, Math.max(-0.4, this.tilt + tilt));
    this.draw();
  }

  /** Looks from the side with all these places in view; a reset comes back to it. */
  frame(places) {
    this.home = places;
    [this.turn, this.tilt] = [-1.15, 0.22];
    this.look(places);
  }

  /** Has all these places in view, from where the eye is turned to. */
  look(places) {
    if (!places.length) return;
    const { at, far } = fitted(places, this.turn, this.tilt, this.canvas.clientWidth / this.canvas.clientHeight || 1);
    [this.at, this.far] = [at, Math.min(8, Math.max(0.15, far))];
    this.draw();
  }

  reset() { this.frame(this.home || []); }

  paint(mesh, model, colour, kind, lit) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffer);
    gl.vertexAttribPointer(this.corners[0], 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(this.corners[1], 3, gl.FLOAT, false, 24, 12);
    gl.uniformMatrix4fv(this.place.model, false, model);
    gl.uniform3fv(this.place.colour, colour);
    gl.uniform1f(this.place.lit, lit ? 1 : 0);
    gl.drawArrays(kind, 0, mesh.count);
  }

  sphere(p, radius, colour, mesh = this.ball) {
    this.paint(mesh, new Float32Array([radius, 0, 0, 0, 0, radius, 0, 0, 0, 0, radius, 0, ...p, 1]),
      colour, this.gl.TRIANGLES, true);
  }

  rod(a, b, radius, colour, mesh = this.cylinder) {
    const along = minus(b, a);
    if (Math.hypot(...along) < 1e-5) return;
    const z = unit(along), x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z)), y = cross(z, x);
    const s = (v) => v.map((n) => n * radius);
    this.paint(mesh, new Float32Array([...s(x), 0, ...s(y), 0, ...along, 0, ...a, 1]),
      colour, this.gl.TRIANGLES, true);
  }

  way(places, colour, kind) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.line.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(places.flatMap((p) => [...p, 0, 0, 1])), gl.DYNAMIC_DRAW);
    this.line.count = places.length;
    this.paint(this.line, new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), colour, kind, false);
  }

  /** Arm and pole; `part` of their thickness, in the colour of what is planned, where they are to come. */
  body(arm, poleRadius, part = 0) {
    const last = arm.length - 1, thin = part || 1;
    for (let i = 0; i < last; i++) {
      const pole = i === last - 1;
      const colour = part ? [0.85, 0.62, 0.2] : pole ? [0.2, 0.2, 0.22] : [0.86, 0.88, 0.9];
      this.rod(arm[i], arm[i + 1], thin * (pole ? poleRadius : 0.055 - 0.003 * i), colour);
      if (!pole) this.sphere(arm[i + 1], thin * (0.058 - 0.003 * i), part ? colour : [0.35, 0.37, 0.4]);
    }
  }

  /** Rope and lead. */
  string(rope, [radius, leadRadius], planned = false) {
    const colour = planned ? [0.85, 0.62, 0.2] : [0.72, 0.38, 0.2];
    for (let i = 0; i + 1 < rope.length; i++) {
      this.rod(rope[i], rope[i + 1], radius, colour, this.thin);
      if (i + 2 < rope.length) this.sphere(rope[i + 1], radius, colour, this.bead);
    }
    if (rope.length) this.sphere(rope[rope.length - 1], leadRadius, planned ? colour : [0.25, 0.7, 0.2]);
  }

  /** Shows a scene at a frame, or between two. */
  show(scene, frame) { this.scene = scene; this.now = frame; this.draw(); }

  draw() {
    const gl = this.gl, scene = this.scene;
    if (!gl || !scene) return;
    const scale = Math.min(devicePixelRatio || 1, 2), c = this.canvas;
    const [w, h] = [Math.max(1, c.clientWidth * scale), Math.max(1, c.clientHeight * scale)].map(Math.round);
    if (c.width !== w || c.height !== h) { c.width = w; c.height = h; }
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const forward = axes(this.turn, this.tilt)[0], eye = this.at.map((v, k) => v - this.far * forward[k]);
    gl.uniformMatrix4fv(this.place.camera, false, cameraMatrix(eye, this.at, w / h));
    const { floor_z_m: floor, column_half_width_m: half, pole: { radius_m: poleRadius } } = scene.cell;
    const grid = [];
    for (let i = -10; i <= 10; i++) {
      grid.push([i / 5, -2, floor], [i / 5, 2, floor], [-2, i / 5, floor], [2, i / 5, floor]);
    }
    this.way(grid, [0.55, 0.58, 0.62], gl.LINES);
    this.rod([0, 0, floor], [0, 0, 0], half, [0.5, 0.52, 0.55]);
    this.body(points(blend(scene.arm, this.now)), poleRadius);
    const rope = points(blend(scene.rope, this.now));
    this.string(rope, scene.radii_m);
    if (scene.ghost) {
      // Thinner, so that what is there stays in sight.
      this.body(points(scene.ghost.arm), poleRadius, 0.4);
      this.string(points(scene.ghost.rope), scene.ghost.radii_m, true);
    }
    const tips = (scene.tips || scene.rope.slice(0, Math.floor(this.now) + 1)).map((f) => points(f.slice(-3))[0]).filter(Boolean);
    if (!scene.tips && rope.length) tips.push(rope[rope.length - 1]);
    if (tips.length > 1) this.way(tips, [0.2, 0.62, 0.16], gl.LINE_STRIP);
    // Dashed, so that it stays in sight where the two cover each other.
    this.way(dashes(points(scene.planned_tip), 0.012), [0.85, 0.55, 0.05], gl.LINES);
    if (scene.target_m) {
      this.sphere(scene.target_m, 0.02, [0.86, 0.1, 0.3]);
      // Its cross is seen even where the rope's lead covers it.
      const arm = (k, by) => scene.target_m.map((v, i) => (i === k ? v + by : v));
      this.way([0, 1, 2].flatMap((k) => [arm(k, -0.06), arm(k, 0.06)]), [0.86, 0.1, 0.3], gl.LINES);
    }
  }
}
