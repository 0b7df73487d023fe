// body_obstacles.js: obstacles near the body: surfaces for WebGL in space, lines for a canvas in the plane. All in the
// body's own units: lengths of `unit` from `origin`.

const CELLS = 40, AROUND = 0.75; // how far a patch reaches beyond the middle of the body, in sizes of the body

const add = (a, b, times = 1) => a.map((x, c) => x + times * b[c]);
const dot = (a, b) => a.reduce((sum, x, c) => sum + x * b[c], 0);
const length = (a) => Math.hypot(...a);
const unit = (a, otherwise) => (length(a) > 0 ? a.map((x) => x / length(a)) : otherwise);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Two directions across a third, all of length 1. */
function across(n) {
  const a = unit(cross(Math.abs(n[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0], n), [1, 0, 0]);
  return [a, cross(n, a)];
}

/** A point of the user's in the body's units. */
export function to_body(surface, x) {
  return x.map((value, c) => (value - surface.origin[c]) / surface.unit);
}

/** The corners of the body's box, in its own units. */
export function box_of(surface) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], { position } = surface;
  for (let i = 0; i < position.length; i++) {
    if (position[i] < low[i % 3]) low[i % 3] = position[i];
    if (position[i] > high[i % 3]) high[i % 3] = position[i];
  }
  return [low, high];
}

/** Diagonal of that box. */
export function extent_of(surface) {
  const [low, high] = box_of(surface);
  return length(add(high, low, -1)) || 1;
}

/** (CELLS + 1)^2 points of at(s, t), s and t in -1..1, as triangles. */
function grid(at, n = CELLS, m = CELLS) {
  const points = new Float32Array(3 * (n + 1) * (m + 1)), index = new Uint32Array(6 * n * m);
  for (let j = 0, k = 0; j <= m; j++) for (let i = 0; i <= n; i++, k += 3) points.set(at((2 * i) / n - 1, (2 * j) / m - 1), k);
  for (let j = 0, k = 0; j < m; j++)
    for (let i = 0; i < n; i++, k += 6) {
      const a = j * (n + 1) + i;
      index.set([a, a + 1, a + n + 2, a, a + n + 2, a + n + 1], k);
    }
  return { points, index };
}

function plane_patch(surface, { point, normal }, size) {
  const n = unit(normal, [0, 1, 0]), p = to_body(surface, point), [a, b] = across(n);
  const middle = add([0, 0, 0], n, dot(p, n)); // the point of it that is nearest to the middle of the body
  return grid((s, t) => add(add(middle, a, s * AROUND * size), b, t * AROUND * size), 1, 1);
}

/** The cap of a sphere on the side of the body; all of it where it is no larger than the body. */
function sphere_patch(surface, { center, radius }, size) {
  const c = to_body(surface, center), r = radius / surface.unit;
  const n = unit(c.map((x) => -x), [0, -1, 0]), [a, b] = across(n), most = Math.min(Math.PI, (1.5 * AROUND * size) / r);
  return grid((s, t) => {
    const polar = most * 0.5 * (s + 1), turn = Math.PI * (t + 1);
    return add(add(add(c, n, r * Math.cos(polar)), a, r * Math.sin(polar) * Math.cos(turn)), b, r * Math.sin(polar) * Math.sin(turn));
  });
}

function cylinder_patch(surface, { point, axis, radius }, size) {
  const w = unit(axis, [0, 0, 1]), p = to_body(surface, point), r = radius / surface.unit;
  const foot = add(p, w, -dot(p, w)), n = unit(foot.map((x) => -x), across(w)[0]), b = cross(w, n);
  const most = Math.min(Math.PI, (1.5 * AROUND * size) / r);
  return grid((s, t) => add(add(add(foot, n, r * Math.cos(most * s)), b, r * Math.sin(most * s)), w, t * AROUND * size));
}

/** The table where the body is, flat beyond its ends; z is the height over x and y. */
function height_patch(surface, { x, y, z }, size) {
  const near = (list, c) => {
    const low = surface.origin[c] - AROUND * size * surface.unit, high = surface.origin[c] + AROUND * size * surface.unit;
    const inner = list.filter((value) => value > low && value < high);
    const every = Math.ceil(inner.length / 200);
    return [low, ...inner.filter((_, i) => i % every === 0), high];
  };
  const xs = near(x, 0), ys = near(y, 1);
  const at = (list, value) => {
    const i = Math.min(Math.max(list.findIndex((one) => one > value) - 1, 0), list.length - 2), last = value >= list[list.length - 1];
    return last ? [list.length - 2, 1] : [i, Math.min(Math.max((value - list[i]) / (list[i + 1] - list[i]), 0), 1)];
  };
  return grid((s, t) => {
    const px = xs[Math.round(((s + 1) / 2) * (xs.length - 1))], py = ys[Math.round(((t + 1) / 2) * (ys.length - 1))];
    const [i, a] = at(x, px), [j, b] = at(y, py);
    const height = (1 - b) * ((1 - a) * z[j][i] + a * z[j][i + 1]) + b * ((1 - a) * z[j + 1][i] + a * z[j + 1][i + 1]);
    return to_body(surface, [px, py, height]);
  }, xs.length - 1, ys.length - 1);
}

/** Triangles by their corners, one after another. */
function surface_patch(surface, { corners }) {
  const points = new Float32Array(corners.flatMap((x) => to_body(surface, x)));
  return { points, index: Uint32Array.from({ length: corners.length }, (_, i) => i) };
}

/** Obstacles in space as {points, index}. */
export function obstacle_patches(surface) {
  const size = extent_of(surface);
  return surface.contacts.filter((one) => one.obstacle).map(({ obstacle }) => {
    if (obstacle.plane) return plane_patch(surface, obstacle.plane, size);
    if (obstacle.sphere) return sphere_patch(surface, obstacle.sphere, size);
    if (obstacle.cylinder) return cylinder_patch(surface, obstacle.cylinder, size);
    if (obstacle.surface) return surface_patch(surface, obstacle.surface);
    return obstacle.height ? height_patch(surface, obstacle.height, size) : null;
  }).filter(Boolean);
}

/** Points of a circle where it is near the picture, with the obstacle on the right of the way. */
function circle_line(surface, { center, radius, inside }, target, reach) {
  const c = to_body(surface, center), r = radius / surface.unit, way = inside ? 1 : -1, steps = 360;
  const middle = Math.atan2(target[1] - c[1], target[0] - c[0]), most = Math.min(Math.PI, (2 * reach) / r);
  return Array.from({ length: steps + 1 }, (_, i) => {
    const angle = middle + way * most * ((2 * i) / steps - 1);
    return [c[0] + r * Math.cos(angle), c[1] + r * Math.sin(angle)];
  });
}

/** A line of points goes on beyond its ends: straight, or flat (a table of heights). */
function extended(points, flat, far) {
  const end = (p, q) => {
    const way = unit([p[0] - q[0], flat ? 0 : p[1] - q[1]], [1, 0]);
    return add(p, way, far);
  };
  return [end(points[0], points[1]), ...points, end(points[points.length - 1], points[points.length - 2])];
}

/**
 * Obstacles in the plane as lists of points, the obstacle on the right of the way. target: the middle of the picture,
 * reach: its size, both in the body's units.
 */
export function obstacle_lines(surface, target, reach) {
  return surface.contacts.filter((one) => one.obstacle).map(({ obstacle }) => {
    if (obstacle.plane) {
      const p = to_body(surface, obstacle.plane.point), [nx, ny] = unit(obstacle.plane.normal, [0, 1]), way = [ny, -nx];
      const foot = add(p, way, dot(add(target.slice(0, 2), p, -1), way));
      return [add(foot, way, -2 * reach), add(foot, way, 2 * reach)];
    }
    if (obstacle.circle) return circle_line(surface, obstacle.circle, target, reach);
    if (obstacle.polyline) return extended(obstacle.polyline.points.map((p) => to_body(surface, p)), false, 4 * reach + 10);
    if (obstacle.height) return extended(obstacle.height.x.map((x, i) => to_body(surface, [x, obstacle.height.z[i]])), true, 4 * reach + 10);
    return null;
  }).filter(Boolean);
}
