// pressure.js: contact pressure, gap and reaction along the surface of a body: a chart over the length of its sides in
// the plane, a map in space, and the numbers as a table.

import { load_surface, node_of, place_of, push_of, viridis } from "./body_surface.js";
import { h, s, show } from "./dom.js";
import { number } from "./format.js";
import { Chart } from "./plot.js";
import { colour } from "./theme.js";

const MOST_ROWS = 1000, MAP_HEIGHT = 320, REACH = 20, MARGIN = 30;
const WHAT = [{ id: "pressure", name: "Contact pressure" }, { id: "gap", name: "Gap" }, { id: "reaction", name: "Reaction" }];
const exact = (value) => number(value, 5);

/**
 * Shows the contact of a job, or of one of its cases, in an element; nothing where nothing can touch.
 * options: {case, on_node: called with the vertex of the surface under the pointer, or -1}. Returns {destroy()}.
 */
export async function mountPressure(element, api, jobId, options = {}) {
  const surface = await load_surface(api, jobId, options.case || "");
  const view = new PressureView(element, surface, options);
  return view;
}

class PressureView {
  constructor(element, surface, { on_node = () => {}, units = null }) {
    Object.assign(this, { element, surface, on_node, units, what: surface.rows.pressure ? "pressure" : "reaction", along: "arc" });
    if (surface.rows.count === 0) return void show(element);
    this.order = this.sort_rows();
    this.place = h("div", { class: "pressure-place" });
    this.table_place = h("div", { class: "scrolled", tabindex: 0, role: "region", "aria-label": "Table of contact nodes" });
    const details = h("details", { class: "pressure-table", ontoggle: () => details.open && this.fill_table() }, h("summary", null, `Table of ${surface.rows.count} contact nodes`), this.table_place);
    show(element, h("h3", null, "Along the surface"), this.build_tools(), this.place, details);
    if (surface.dim === 2) this.start_chart();
    else this.map = new PressureMap(this.place, surface, on_node);
    this.draw();
  }

  build_tools() {
    const { rows, dim } = this.surface;
    const there = WHAT.filter(({ id }) => rows[id]), ways = [{ id: "arc", name: "length of the sides" }, { id: "0", name: "x" }, { id: "1", name: "y" }];
    const pick = (label, list, name) => {
      const field = h("select", { onchange: () => ((this[name] = field.value), this.draw()) }, list.map((one) => h("option", { value: one.id }, one.name)));
      field.value = this[name];
      return h("label", null, label, field);
    };
    return h("div", { class: "body-tools" }, pick("Show", there, "what"), dim === 2 ? pick("over the", ways, "along") : null);
  }

  /** Rows contact by contact; in the plane along their sides. */
  sort_rows() {
    const { contact, arc } = this.surface.rows, order = Array.from(contact.keys());
    return order.sort((a, b) => contact[a] - contact[b] || (arc ? arc.values[a] - arc.values[b] : a - b));
  }

  value(row) {
    const value = this.surface.rows[this.what].values[row];
    return this.what === "pressure" && value < 0 ? NaN : value;
  }

  // ---- the plane

  start_chart() {
    this.chart = new Chart(this.place, 260);
    this.chart.svg.addEventListener("pointermove", (event) => this.point(event));
    this.chart.svg.addEventListener("pointerleave", () => this.on_node(-1));
  }

  at(row) {
    const { surface } = this;
    return this.along === "arc" ? surface.rows.arc.values[row] : place_of(surface, surface.rows.vertex[row])[Number(this.along)];
  }

  draw() {
    if (!this.chart) return void this.map.draw(this.what, (row) => this.value(row));
    const { rows, contacts } = this.surface, pieces = new Map();
    for (const row of this.order) {
      const key = `${rows.contact[row]} ${rows.part[row]}`;
      if (!pieces.has(key)) pieces.set(key, []);
      pieces.get(key).push(row);
    }
    const many = pieces.size > 1;
    const series = Array.from(pieces.values(), (list, i) => {
      const contact = rows.contact[list[0]], points = list.map((row) => [this.at(row), this.value(row), `node ${node_of(this.surface, rows.vertex[row])}`]);
      if (this.along !== "arc") points.sort((a, b) => a[0] - b[0]);
      return { name: many ? `${contacts[contact].on}, piece ${rows.part[list[0]] + 1}` : contacts[contact].on, colour: 1 + (i % 6), points, dots: list.length <= 120, size: 2.5 };
    });
    const name = WHAT.find((one) => one.id === this.what).name, x = { arc: "length along the sides", 0: "x", 1: "y" }[this.along];
    this.chart.update({ x: { label: x + (this.units ? `, ${this.units.length}` : "") }, y: { label: name + (this.units ? `, ${this.units[{ pressure: "stress", gap: "length", reaction: "force" }[this.what]]}` : ""), from_zero: true }, series, label: this.describe(name) });
  }

  describe(name) {
    const { rows } = this.surface, { low, high } = rows[this.what], push = push_of(this.surface);
    let most = 0;
    for (let i = 1; i < push.length; i++) if (push[i] > push[most]) most = i;
    return `${name} along the surface, from ${exact(low)} to ${exact(high)}; the largest pressure is at node ${node_of(this.surface, rows.vertex[most])}`;
  }

  /** The node whose place along the axis is nearest to the pointer. */
  point(event) {
    if (!this.chart.scales) return;
    const x = this.chart.scales.x.invert(event.clientX - this.chart.svg.getBoundingClientRect().left);
    let found = -1, best = Infinity;
    for (const row of this.order) {
      const away = Math.abs(this.at(row) - x);
      if (away < best) [best, found] = [away, row];
    }
    this.on_node(found < 0 ? -1 : this.surface.rows.vertex[found]);
  }

  // ---- numbers

  fill_table() {
    if (this.table_place.childElementCount) return;
    const { surface } = this, { rows } = surface, push = push_of(surface);
    let list = this.order;
    if (list.length > MOST_ROWS) {
      const kept = new Set([...list].sort((a, b) => push[b] - push[a]).slice(0, MOST_ROWS));
      list = list.filter((row) => kept.has(row));
    }
    const there = WHAT.filter(({ id }) => rows[id]), heads = ["node", ...["x", "y", "z"].slice(0, surface.dim), ...there.map(({ name }) => name)];
    const cells = (row) => [node_of(surface, rows.vertex[row]), ...place_of(surface, rows.vertex[row]).map(exact),
      ...there.map(({ id }) => (id === "pressure" && rows[id].values[row] < 0 ? "–" : exact(rows[id].values[row])))];
    show(this.table_place, h("table", null, h("caption", null, list.length < rows.count ? `The ${list.length} contact nodes that are pressed hardest` : "Contact nodes"),
      h("thead", null, h("tr", null, heads.map((text) => h("th", { scope: "col", class: "number" }, text)))),
      h("tbody", null, list.map((row) => h("tr", null, cells(row).map((text, i) => (i ? h("td", { class: "number" }, String(text)) : h("th", { scope: "row", class: "number" }, String(text)))))))));
  }

  destroy() {
    this.chart?.destroy();
    this.map?.destroy();
    this.element.replaceChildren();
  }
}

// ---- space

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / (Math.hypot(...a) || 1));

/** Two directions across the mean normal of all rows: the first as near to x, or z, as can be. */
function map_axes({ rows }) {
  const sum = [0, 0, 0];
  for (let i = 0; i < rows.normal.length; i++) sum[i % 3] += rows.normal[i];
  const n = unit(Math.hypot(...sum) > 1e-6 * rows.count ? sum : [0, 1, 0]), start = Math.abs(n[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1];
  const right = unit(start.map((x, c) => x - dot(start, n) * n[c]));
  return [right, cross(n, right)];
}

/** Contact nodes as coloured dots, seen along the mean normal of the obstacle. */
class PressureMap {
  constructor(element, surface, on_node) {
    Object.assign(this, { element, surface, on_node, axes: map_axes(surface) });
    this.canvas = h("canvas", { class: "pressure-map", role: "img" });
    this.legend = h("div", { class: "body-legend" });
    this.readout = h("div", { class: "readout muted", "aria-hidden": "true" });
    show(element, this.canvas, this.legend, this.readout);
    this.spots = this.flatten();
    this.watch = new ResizeObserver(() => this.paint());
    this.watch.observe(element);
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerleave", () => (show(this.readout), on_node(-1)));
    this.again = () => this.paint();
    document.addEventListener("themechange", this.again);
  }

  /** [x, y] of each row in the body's units, and their box. */
  flatten() {
    const { rows, position } = this.surface, points = [], box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let i = 0; i < rows.count; i++) {
      const p = position.subarray(3 * rows.vertex[i], 3 * rows.vertex[i] + 3), at = this.axes.map((axis) => dot(axis, p));
      points.push(at);
      for (let c = 0; c < 2; c++) {
        box[c] = Math.min(box[c], at[c]);
        box[c + 2] = Math.max(box[c + 2], at[c]);
      }
    }
    return { points, box };
  }

  draw(what, value) {
    const values = Array.from(this.spots.points.keys(), value), known = values.filter((x) => !Number.isNaN(x));
    const low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    Object.assign(this, { values, low, high, name: WHAT.find((one) => one.id === what).name });
    const bar = s("svg", { viewBox: "0 0 240 12", width: 240, height: 12, "aria-hidden": "true" },
      Array.from({ length: 48 }, (_, i) => s("rect", { x: 5 * i, width: 5.5, height: 12, fill: `rgb(${viridis((i + 0.5) / 48).join(" ")})` })));
    show(this.legend, h("span", { class: "body-quantity" }, this.name), exact(low), bar, exact(high));
    this.canvas.setAttribute("aria-label", `${this.name} of ${values.length} contact nodes, from ${exact(low)} to ${exact(high)}`);
    this.paint();
  }

  paint() {
    const width = Math.round(this.element.clientWidth), ratio = Math.min(window.devicePixelRatio || 1, 3);
    if (!this.values || width < 60) return;
    const { points, box } = this.spots, size = [Math.max(box[2] - box[0], 1e-9), Math.max(box[3] - box[1], 1e-9)];
    this.scale = Math.min((width - 2 * MARGIN) / size[0], (MAP_HEIGHT - 2 * MARGIN) / size[1]);
    // Squares that meet where the nodes are a regular grid; the margin has room for half of one of a grid of 5 x 5.
    const dots = Math.max(1, Math.min(MARGIN, (0.5 * this.scale * Math.sqrt(size[0] * size[1])) / Math.max(1, Math.sqrt(points.length) - 1)));
    this.height = Math.max(40, Math.ceil(this.scale * size[1]) + 2 * MARGIN);
    this.width = width;
    Object.assign(this.canvas, { width: width * ratio, height: this.height * ratio });
    Object.assign(this.canvas.style, { width: `${width}px`, height: `${this.height}px` });
    const pen = this.canvas.getContext("2d"), range = this.high - this.low;
    pen.scale(ratio, ratio);
    points.forEach((at, i) => {
      const [x, y] = this.pixel(at);
      pen.fillStyle = Number.isNaN(this.values[i]) ? colour("--muted") : `rgb(${viridis(range > 0 ? (this.values[i] - this.low) / range : 0.5).join(" ")})`;
      pen.fillRect(Math.round(x - dots), Math.round(y - dots), Math.ceil(2 * dots), Math.ceil(2 * dots));
    });
  }

  pixel([x, y]) {
    const { box } = this.spots;
    return [this.width / 2 + this.scale * (x - (box[0] + box[2]) / 2), this.height / 2 - this.scale * (y - (box[1] + box[3]) / 2)];
  }

  point(event) {
    const frame = this.canvas.getBoundingClientRect(), to = [event.clientX - frame.left, event.clientY - frame.top];
    let found = -1, best = REACH;
    this.spots.points.forEach((at, i) => {
      const [x, y] = this.pixel(at), away = Math.hypot(x - to[0], y - to[1]);
      if (away < best) [best, found] = [away, i];
    });
    const vertex = found < 0 ? -1 : this.surface.rows.vertex[found];
    show(this.readout, found < 0 ? null : `node ${node_of(this.surface, vertex)} at ${place_of(this.surface, vertex).map(exact).join(", ")}: ${this.name.toLowerCase()} ${exact(this.values[found])}`);
    this.on_node(vertex);
  }

  destroy() {
    this.watch.disconnect();
    document.removeEventListener("themechange", this.again);
  }
}
