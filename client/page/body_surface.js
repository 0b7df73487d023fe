// body_surface.js: the surface of a deformed body as the service sends it (GET /v1/jobs/{id}/surface): a binary glTF 2.0
// file whose `extras` name the arrays; openapi.json describes them.

const MAGIC = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BINARY_CHUNK = 0x004e4942;
const FLOAT = 5126;

const AXES = ["x", "y", "z"];

// Nine of the colours of viridis (S. van der Walt and N. Smith, 2015, CC0), as in the service's own pictures.
export const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129],
  [92, 200, 99], [170, 220, 50], [253, 231, 37]];

/** The colour of a number in 0..1 as [red, green, blue], each 0..255. */
export function viridis(t) {
  const at = Math.min(Math.max(t, 0), 1) * (VIRIDIS.length - 1), i = Math.min(Math.floor(at), VIRIDIS.length - 2);
  return VIRIDIS[i].map((low, c) => Math.round(low + (at - i) * (VIRIDIS[i + 1][c] - low)));
}

/** Both chunks of a GLB file: {json, binary: [offset, length]}. */
function read_chunks(buffer) {
  const head = new DataView(buffer), chunks = {};
  if (buffer.byteLength < 20 || head.getUint32(0, true) !== MAGIC || head.getUint32(4, true) !== 2) throw new Error("This is no glTF file.");
  for (let at = 12; at + 8 <= buffer.byteLength; ) {
    const length = head.getUint32(at, true);
    chunks[head.getUint32(at + 4, true)] = [at + 8, length];
    at += 8 + length;
  }
  const text = new Uint8Array(buffer, ...chunks[JSON_CHUNK]);
  return { json: JSON.parse(new TextDecoder().decode(text)), binary: chunks[BINARY_CHUNK] };
}

/**
 * The surface in a file's bytes. Coordinates are in units of `unit` from `origin`; Float32Arrays and Uint32Arrays are
 * views of the bytes. rows: of contact, each array in the user's units but `normal`.
 */
export function parse_surface(buffer) {
  const { json, binary } = read_chunks(buffer), extras = json.extras, place = binary[0];
  const array = (number) => {
    if (number === undefined) return null;
    const accessor = json.accessors[number], view = json.bufferViews[accessor.bufferView];
    const Type = accessor.componentType === FLOAT ? Float32Array : Uint32Array;
    return new Type(buffer, place + (view.byteOffset || 0), view.byteLength / 4);
  };
  const scaled = (drawn) => drawn && { ...drawn, values: Float64Array.from(array(drawn.accessor) || [], (x) => x * drawn.unit) };
  const indices = (mesh, mode) => array(json.meshes[mesh]?.primitives.find((one) => one.mode === mode)?.indices) || new Uint32Array(0);
  const contact = extras.contact;
  const triangles = json.meshes[0].primitives.find((one) => one.mode === 4);
  return {
    ...extras,
    bytes: buffer.byteLength,
    position: array(extras.position),
    displacement: array(extras.displacement),
    node: array(triangles.attributes._NODE),
    pressure: extras.pressure && { ...extras.pressure, x: array(extras.pressure.accessor) },
    von_mises: extras.von_mises && { ...extras.von_mises, x: array(extras.von_mises.accessor) },
    triangle: indices(0, 4),
    line: indices(0, 1),
    outline: indices(1, 1),
    rows: {
      count: contact.rows,
      vertex: array(contact.vertex) || new Uint32Array(0),
      contact: array(contact.contact) || new Uint32Array(0),
      normal: array(contact.normal) || new Float32Array(0),
      part: array(contact.part),
      reaction: scaled(contact.reaction),
      gap: scaled(contact.gap),
      pressure: scaled(contact.pressure),
      arc: scaled(contact.arc),
    },
  };
}

let latest = { key: "", promise: null };

function surface_path(job, case_name, fields) {
  return `/v1/jobs/${job}/surface?fields=${fields}${case_name ? `&case=${encodeURIComponent(case_name)}` : ""}`;
}

/**
 * The surface of a job, or of one of its cases, without the stress, which takes the service longest: add_stress. The
 * last one that was asked for is kept.
 */
export function load_surface(api, job, case_name) {
  const path = surface_path(job, case_name, "displacements,pressure");
  if (latest.key === path) return latest.promise;
  const promise = api.bytes(path).then((buffer) => {
    performance.mark("surface:fetched");
    const surface = parse_surface(buffer);
    performance.mark("surface:parsed");
    return surface;
  });
  latest = { key: path, promise };
  promise.catch(() => { if (latest.promise === promise) latest = { key: "", promise: null }; });
  return promise;
}

export function forget_surface() {
  latest = { key: "", promise: null };
}

/** Fetches the stress of a surface, once: surface.von_mises. */
export async function add_stress(api, job, surface) {
  surface.stress_comes ??= api.bytes(surface_path(job, surface.case, "von_mises")).then((buffer) => {
    surface.von_mises = parse_surface(buffer).von_mises;
  }, (error) => {
    surface.stress_comes = undefined;
    throw error;
  });
  await surface.stress_comes;
}

/** The number of a vertex's node. */
export function node_of(surface, vertex) {
  return surface.node ? surface.node[vertex] : vertex;
}

/** Where a vertex was before, as the user gave it: dim numbers. */
export function place_of(surface, vertex) {
  return surface.origin.slice(0, surface.dim).map((o, c) => o + surface.unit * surface.position[3 * vertex + c]);
}

export function displacement_of(surface, vertex) {
  return AXES.slice(0, surface.dim).map((_, c) => surface.unit * surface.displacement[3 * vertex + c]);
}

/** Contact rows by vertex: of several at one node the one that presses most. */
export function rows_by_vertex(surface) {
  const { rows } = surface, push = push_of(surface), found = new Map();
  for (let i = 0; i < rows.count; i++) {
    const other = found.get(rows.vertex[i]);
    if (other === undefined || push[i] > push[other]) found.set(rows.vertex[i], i);
  }
  return found;
}

/** How hard each row presses: its pressure, or its force where the pressure is not there. */
export function push_of(surface) {
  const { rows } = surface;
  return rows.pressure?.values ?? rows.reaction?.values.map((r) => -r) ?? new Float64Array(0);
}

/** What the body may be coloured by: [{id, name}]. */
export function quantities(surface) {
  const list = [{ id: "displacement", name: "Displacement" }];
  for (const axis of AXES.slice(0, surface.dim)) list.push({ id: axis, name: `Displacement along ${surface.axisymmetric && axis === "x" ? "the radius" : axis}` });
  list.push({ id: "von_mises", name: "von Mises stress" });
  if (surface.rows.pressure && surface.rows.count) list.push({ id: "pressure", name: "Contact pressure" });
  return list;
}

/** {at: (vertex) => value, NaN where there is none; low, high}: of a quantity, in the user's units. */
export function values_of(surface, id) {
  const u = surface.displacement, count = surface.position.length / 3;
  if (id === "pressure") {
    const rows = rows_by_vertex(surface), { values, low, high } = surface.rows.pressure, both = surface.pressure;
    const of_row = (row) => (row === undefined ? -1 : values[row]), at = both ? (v) => both.x[v] * both.unit : (v) => of_row(rows.get(v));
    return { at: (v) => (at(v) < 0 ? NaN : at(v)), low, high };
  }
  if (id === "von_mises") {
    const { x, unit, low, high } = surface.von_mises;
    return { at: (v) => x[v] * unit, low, high };
  }
  const c = AXES.indexOf(id);
  const at = c >= 0 ? (v) => surface.unit * u[3 * v + c] : (v) => surface.unit * Math.hypot(u[3 * v], u[3 * v + 1], u[3 * v + 2]);
  let low = Infinity, high = -Infinity;
  for (let v = 0; v < count; v++) {
    const x = at(v);
    if (x < low) low = x;
    if (x > high) high = x;
  }
  return { at, low, high };
}

/** By vertex: 0..1 between low and high and beyond them, -1 where there is no value. */
export function shades_of(surface, { at, low, high }) {
  const shades = new Float32Array(surface.position.length / 3), range = high - low;
  for (let v = 0; v < shades.length; v++) {
    const x = at(v);
    shades[v] = Number.isNaN(x) ? -1 : range > 0 ? Math.min(Math.max((x - low) / range, 0), 1) : 0.5;
  }
  return shades;
}
