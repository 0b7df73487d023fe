// scene_shape.js: the shape of a scene from its text, as far as it stands there: a box or a mesh of numbers, and where
// supports, loads and contacts are. What only the service can read (files, uploads) is left out.

const SIDES = { left: [0, -1], right: [0, 1], bottom: [1, -1], top: [1, 1], back: [2, -1], front: [2, 1] };
for (const [c, axis] of ["x", "y", "z"].entries()) Object.assign(SIDES, { [`-${axis}`]: [c, -1], [`+${axis}`]: [c, 1] });
const MOST_CELLS = 40; // of a box that are drawn along a side
const MOST_NODES = 100000;
const FACES = { // by the number of corners
  4: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 6: [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
  8: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
};
const CORNERS = { tri3: 3, tri6: 3, quad4: 4, quad8: 4, tet4: 4, tet10: 4, hex8: 8, hex20: 8, wedge6: 6, wedge15: 6 };

/** Where the cells of a box end along an axis; the last is `grading` times as long as the first. */
function ends_of(origin, size, cells, grading = 1) {
  const n = Number.isInteger(cells) && cells > 0 ? Math.min(cells, MOST_CELLS) : 8, q = n > 1 ? grading ** (1 / (n - 1)) : 1;
  const widths = Array.from({ length: n }, (_, i) => q ** i), total = widths.reduce((a, b) => a + b);
  let at = 0;
  return [origin, ...widths.map((one) => origin + (size * (at += one)) / total)];
}

/** {points, cells: polygons} of a box: in space its sides. */
function box_shape({ size, cells, origin, grading }, dim) {
  const lines = size.slice(0, dim).map((length, c) => ends_of(origin?.[c] ?? 0, length, cells?.[c], grading?.[c])), points = [], polygons = [];
  const sheet = (a, b, rest) => {
    const first = points.length, [n, m] = [lines[a].length, lines[b].length];
    for (let j = 0; j < m; j++) for (let i = 0; i < n; i++) {
      const point = [0, 0, 0];
      point[a] = lines[a][i];
      point[b] = lines[b][j];
      if (rest) point[rest[0]] = rest[1];
      points.push(point);
    }
    for (let j = 0; j + 1 < m; j++) for (let i = 0; i + 1 < n; i++) polygons.push([0, 1, n + 1, n].map((k) => first + j * n + i + k));
  };
  if (dim === 2) sheet(0, 1, null);
  else for (const [a, b, c] of [[0, 1, 2], [1, 2, 0], [2, 0, 1]]) for (const end of [lines[c][0], lines[c][lines[c].length - 1]]) sheet(a, b, [c, end]);
  return { points, polygons };
}

/** The same of a mesh of numbers: elements, in space the faces that one element alone has. */
function given_shape({ nodes, elements }, dim) {
  const points = nodes.map((x) => [x[0], x[1], dim === 3 ? x[2] : 0]), seen = new Map(), polygons = [];
  for (const [name, list] of Object.entries(elements)) for (const element of list) {
    const corners = element.slice(0, CORNERS[name]);
    if (dim === 2) polygons.push(corners);
    else for (const face of FACES[corners.length]) {
      const nodes_of = face.map((k) => corners[k]), key = [...nodes_of].sort((a, b) => a - b).join();
      if (seen.has(key)) seen.delete(key);
      else seen.set(key, nodes_of);
    }
  }
  return { points, polygons: dim === 2 ? polygons : [...seen.values()] };
}

/** Points of a group: of a side, of a mesh's own groups, where coordinates say; null: not known here. */
function points_in(on, mesh, points, box, dim) {
  const all = points.map((_, i) => i), near = 1e-6 * Math.max(...box[1].map((x, c) => x - box[0][c]));
  if (on === "all") return all;
  if (mesh.box && SIDES[on] && SIDES[on][0] < dim) {
    const [c, way] = SIDES[on], end = box[way > 0 ? 1 : 0][c];
    return all.filter((i) => Math.abs(points[i][c] - end) < near);
  }
  const group = typeof on === "string" ? mesh.groups?.[on] : on, where = group?.where;
  if (where && Object.keys(where).every((key) => "xyz".includes(key)))
    return all.filter((i) => Object.entries(where).every(([key, want]) => {
      const x = points[i]["xyz".indexOf(key)];
      return typeof want === "number" ? Math.abs(x - want) < near : x >= (want.min ?? -Infinity) - near && x <= (want.max ?? Infinity) + near;
    }));
  const listed = group?.nodes || group?.edges?.flat() || group?.faces?.flat();
  return listed ? [...new Set(listed)].filter((i) => i >= 0 && i < points.length) : null;
}

/** Which way a load pushes; null: it has no direction of its own. */
function way_of(load, mesh, dim) {
  const v = load.traction || load.force || load.body_force, side = mesh.box && SIDES[load.on];
  if (Array.isArray(v)) return [v[0] || 0, v[1] || 0, dim === 3 ? v[2] || 0 : 0];
  if (!Number.isFinite(load.pressure) || !side) return null;
  return [0, 1, 2].map((c) => (c === side[0] ? -side[1] * Math.sign(load.pressure) : 0));
}

/**
 * {surface: as body_surface.js gives one, marks: [{kind: "support", "load" or "contact", vertices, way}], unknown: names
 * of groups that are not known here}; null where there is nothing to draw. Throws at text that is no scene.
 */
export function shape_of(request) {
  const scene = request.problem, { mesh, model } = scene, dim = model === "solid" ? 3 : 2;
  if (scene.kind !== "scene" || !(mesh.box || (mesh.nodes && mesh.elements)) || mesh.nodes?.length > MOST_NODES) return null;
  const { points, polygons } = mesh.box ? box_shape(mesh.box, dim) : given_shape(mesh, dim);
  if (!polygons.length || !points.flat().every(Number.isFinite)) return null;
  const box = [Math.min, Math.max].map((end) => [0, 1, 2].map((c) => points.reduce((far, p) => end(far, p[c]), points[0][c])));
  const origin = box[0].map((x, c) => (x + box[1][c]) / 2), unit = Math.max(...box[1].map((x, c) => x - box[0][c])) || 1;
  const triangle = polygons.flatMap((p) => p.slice(2).flatMap((_, k) => [p[0], p[k + 1], p[k + 2]])), edges = new Map();
  for (const p of polygons) p.forEach((a, k) => {
    const b = p[(k + 1) % p.length], key = a < b ? `${a} ${b}` : `${b} ${a}`;
    edges.set(key, [a, b, (edges.get(key)?.[2] || 0) + 1]);
  });
  const unknown = [], in_group = (on) => points_in(on, { ...mesh, groups: { ...mesh.groups, ...scene.groups } }, points, box, dim) || (unknown.push(typeof on === "string" ? on : "…"), []);
  const list = (kind, items, more) => (items || []).map((one) => ({ kind, vertices: Number.isInteger(one.node) ? (mesh.box ? [] : [one.node]) : in_group(one.on), ...more?.(one) }));
  const marks = [...list("support", scene.supports), ...list("load", (scene.loads || []).filter((one) => !("temperature" in one)), (one) => ({ way: way_of(one, mesh, dim) })), ...list("contact", scene.contacts)];
  const none = new Float64Array(0);
  return { marks, unknown, surface: { dim, origin, unit, axisymmetric: model === "axisymmetric", largest_displacement: 0, contacts: (scene.contacts || []).filter((one) => one.obstacle),
    position: Float32Array.from(points.flatMap((p) => p.map((x, c) => (x - origin[c]) / unit))), displacement: new Float32Array(3 * points.length),
    triangle: Uint32Array.from(triangle), line: Uint32Array.from([...edges.values()].flatMap(([a, b]) => [a, b])),
    outline: Uint32Array.from(dim === 2 ? [...edges.values()].filter((one) => one[2] === 1).flatMap(([a, b]) => [a, b]) : []),
    rows: { count: 0, vertex: [], normal: none, reaction: null, pressure: null } } };
}
