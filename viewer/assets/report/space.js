"use strict";
// Vectors, the eye and the paths it sees; lengths in metres, angles in radians.

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => { const l = Math.hypot(...a) || 1; return a.map((v) => v / l); };

/** Column-major product of two 4x4 matrices. */
function times(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    for (let r = 0; r < 4; r++) {
      for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
    }
  }
  return out;
}

/** Tangents of half the angles of view, across and up. */
function opening(aspect) {
  // A narrow window still shows the whole width.
  const t = Math.tan(0.35);
  return aspect < 1 ? [t, t / aspect] : [t * aspect, t];
}

/** Unit vectors of an eye that looks at a point from a turn and a tilt: forward, right, up. */
function axes(turn, tilt) {
  const f = [-Math.cos(tilt) * Math.cos(turn), -Math.cos(tilt) * Math.sin(turn), -Math.sin(tilt)];
  const s = unit(cross(f, [0, 0, 1]));
  return [f, s, cross(s, f)];
}

/** Where to look, and from how far away, to have all places in view. */
function fitted(places, turn, tilt, aspect) {
  const [f, s, u] = axes(turn, tilt), [tx, ty] = opening(aspect);
  const along = (axis) => places.map((p) => dot(p, axis));
  const [ahead, right, up] = [f, s, u].map(along);
  const middle = (v) => (Math.min(...v) + Math.max(...v)) / 2;
  const [ca, cr, cu] = [ahead, right, up].map(middle);
  const room = 1.15;
  const far = Math.max(...places.map((_, i) =>
    room * Math.max(Math.abs(right[i] - cr) / tx, Math.abs(up[i] - cu) / ty) - (ahead[i] - ca)));
  return { at: [0, 1, 2].map((k) => f[k] * ca + s[k] * cr + u[k] * cu), far };
}

/** World to clip space for an eye that looks at a point, z up. */
function cameraMatrix(eye, at, aspect) {
  const f = unit(minus(at, eye)), s = unit(cross(f, [0, 0, 1])), u = cross(s, f);
  const look = [s[0], u[0], -f[0], 0, s[1], u[1], -f[1], 0, s[2], u[2], -f[2], 0,
    -dot(s, eye), -dot(u, eye), dot(f, eye), 1];
  // Nearer than the eye ever comes to what it looks at, so that nothing is cut open.
  const near = 0.02, far = 30, [tx, ty] = opening(aspect);
  const project = [1 / tx, 0, 0, 0, 0, 1 / ty, 0, 0, 0, 0, (far + near) / (near - far), -1,
    0, 0, (2 * far * near) / (near - far), 0];
  return times(project, look);
}

/** Places of a flat row of tenths of a millimetre, in metres. */
function points(flat) {
  const out = [];
  for (let i = 0; i + 2 < flat.length; i += 3) out.push([flat[i] / 1e4, flat[i + 1] / 1e4, flat[i + 2] / 1e4]);
  return out;
}

/** A row between two frames; of a row that another frame lacks, the row itself. */
function blend(rows, frame) {
  const from = Math.floor(frame), x = frame - from, a = rows[from] || [], b = rows[from + 1];
  return x > 0 && b && b.length === a.length ? a.map((v, i) => v + x * (b[i] - v)) : a;
}

/** Ends of dashes along a path, each as long as the gap after it (m). */
function dashes(path, length) {
  const out = [];
  let way = 0, drawn = true;
  for (let i = 0; i + 1 < path.length; i++) {
    const step = minus(path[i + 1], path[i]), whole = Math.hypot(...step);
    for (let done = 0; done < whole;) {
      const go = Math.min(length - way, whole - done);
      const at = (d) => path[i].map((v, k) => v + (step[k] * d) / whole);
      if (drawn) out.push(at(done), at(done + go));
      done += go; way += go;
      if (way > length - 1e-9) { way = 0; drawn = !drawn; }
    }
  }
  return out;
}
