// The map of targets seen from above, x up and y to the left, and the place a click means.

/** Base frame of a place on a square map whose half side is `half` (m), and back. */
const fromMap = (right, down, side, half) => [half * (1 - (2 * down) / side), half * (1 - (2 * right) / side)];
const onMap = (x, y, side, half) => [(side * (1 - y / half)) / 2, (side * (1 - x / half)) / 2];

/** Draws where a target may lie, the base, the circle of each half metre, and the target. */
function drawMap(canvas, map, target) {
  const side = canvas.clientWidth * Math.min(devicePixelRatio || 1, 2) || 1, c = canvas.getContext("2d");
  if (canvas.width !== Math.round(side)) canvas.width = canvas.height = Math.round(side);
  const colour = (name) => getComputedStyle(canvas).getPropertyValue(name);
  c.fillStyle = colour("--sky");
  c.fillRect(0, 0, side, side);
  const cell = side / map.cells;
  c.fillStyle = colour("--bar");
  map.rows.forEach((row, i) => [...row].forEach((may, k) => {
    if (may === "1") c.fillRect(side - (k + 1) * cell, side - (i + 1) * cell, cell + 0.5, cell + 0.5);
  }));
  c.strokeStyle = colour("--line"); c.fillStyle = colour("--ink"); c.font = `${side / 34}px system-ui`;
  for (const r of [0.5, 1, 1.5]) {
    c.beginPath();
    c.arc(side / 2, side / 2, (side * r) / map.half_m / 2, 0, 2 * Math.PI);
    c.stroke();
    c.fillText(`${r} m`, side / 2 + 4, side / 2 - (side * r) / map.half_m / 2 - 4);
  }
  c.beginPath();
  c.arc(side / 2, side / 2, side / 60, 0, 2 * Math.PI);
  c.fill();
  if (!target.every(Number.isFinite)) return;
  const [u, v] = onMap(target[0], target[1], side, map.half_m), arm = side / 30;
  c.strokeStyle = colour("--bad"); c.lineWidth = side / 150;
  c.beginPath();
  c.moveTo(u - arm, v); c.lineTo(u + arm, v); c.moveTo(u, v - arm); c.lineTo(u, v + arm);
  c.stroke();
  c.lineWidth = 1;
}

/** Where the ray through a place of a view's canvas meets a height (m); null where it does not. */
function onHeight(view, right, down, z) {
  const c = view.canvas, [f, s, u] = axes(view.turn, view.tilt), [tx, ty] = opening(c.clientWidth / c.clientHeight);
  const [a, b] = [((2 * right) / c.clientWidth - 1) * tx, (1 - (2 * down) / c.clientHeight) * ty];
  const ray = f.map((v, k) => v + a * s[k] + b * u[k]), eye = view.at.map((v, k) => v - view.far * f[k]);
  const way = (z - eye[2]) / ray[2];
  return way > 0 && isFinite(way) ? [eye[0] + way * ray[0], eye[1] + way * ray[1]] : null;
}
