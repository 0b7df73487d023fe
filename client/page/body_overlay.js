// body_overlay.js: what stands around the body, in pixels, on a canvas above that of WebGL: obstacles of the plane,
// contact forces, a mark on the node under the pointer. The same signs as in the service's own pictures.

import { obstacle_lines } from "./body_obstacles.js";
import { push_of } from "./body_surface.js";

const TICK = 9, ARROW = 55, MOST_ARROWS = 80, EDGE = 40, TRIAD = 28;

/** The part of a..b, as [t0, t1] of 0..1, in the picture and a little around it (Liang and Barsky 1984); null: none. */
function clip(a, b, width, height) {
  let t0 = 0, t1 = 1;
  const d = [b[0] - a[0], b[1] - a[1]];
  for (const [p, q] of [[-d[0], a[0] + EDGE], [d[0], width + EDGE - a[0]], [-d[1], a[1] + EDGE], [d[1], height + EDGE - a[1]]]) {
    if (p === 0 && q < 0) return null;
    if (p < 0) t0 = Math.max(t0, q / p);
    if (p > 0) t1 = Math.min(t1, q / p);
  }
  return t0 < t1 ? [t0, t1] : null;
}

/** A border with ticks to the right of its way, where the obstacle is. */
function draw_border(pen, points, width, height) {
  let travelled = 0;
  for (let i = 1; i < points.length; i++) {
    const a = points[i - 1], b = points[i], d = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(...d), seen = clip(a, b, width, height);
    if (seen && length > 0) {
      const at = (t) => [a[0] + t * d[0], a[1] + t * d[1]], [tx, ty] = [(-d[1] - d[0]) / length, (d[0] - d[1]) / length];
      pen.lineWidth = 2;
      pen.beginPath();
      pen.moveTo(...at(seen[0]));
      pen.lineTo(...at(seen[1]));
      pen.stroke();
      pen.lineWidth = 1;
      pen.beginPath();
      for (let s = Math.ceil((travelled + seen[0] * length) / TICK) * TICK - travelled; s <= seen[1] * length; s += TICK) {
        const [x, y] = at(s / length);
        pen.moveTo(x, y);
        pen.lineTo(x + 0.7 * TICK * tx, y + 0.7 * TICK * ty);
      }
      pen.stroke();
    }
    travelled = (travelled + length) % TICK;
  }
}

/** A line into its point with a head; the way is of length 1, in pixels. */
function draw_arrow(pen, [x, y], [dx, dy], length) {
  const head = Math.min(6, 0.4 * length);
  pen.moveTo(x - length * dx, y - length * dy);
  pen.lineTo(x, y);
  pen.moveTo(x - head * (dx + 0.5 * dy), y - head * (dy - 0.5 * dx));
  pen.lineTo(x, y);
  pen.lineTo(x - head * (dx - 0.5 * dy), y - head * (dy + 0.5 * dx));
}

export class Overlay {
  constructor(canvas) {
    this.canvas = canvas;
  }

  take(surface) {
    this.surface = surface;
    this.push = push_of(surface);
    this.largest = this.push.reduce((most, x) => Math.max(most, x), 0);
    this.pressed = Array.from(this.push.keys()).filter((i) => this.push[i] > 0);
    const every = Math.ceil(this.pressed.length / MOST_ARROWS);
    this.arrows = this.pressed.filter((_, i) => i % every === 0);
  }

  resize(width, height, ratio) {
    Object.assign(this, { width, height, ratio });
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
  }

  /** Where a vertex is drawn: pixels. */
  place(view, factor, vertex) {
    const { position: p, displacement: u } = this.surface, i = 3 * vertex;
    return view.project(p[i] + factor * u[i], p[i + 1] + factor * u[i + 1], p[i + 2] + factor * u[i + 2]);
  }

  /** through: a solid is seen through; plane: beyond which the body is cut off, [normal, offset], or none; line: points of a
   * path, each with its displacement: six numbers. */
  draw(view, factor, { colours, obstacles, forces, through, plane, marked, line }) {
    const pen = this.canvas.getContext("2d"), { surface, width, height, ratio } = this;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (obstacles && surface.dim === 2) {
      pen.strokeStyle = colours.obstacle;
      for (const line of obstacle_lines(surface, view.target, (width + height) / view.scale))
        draw_border(pen, line.map(([x, y]) => view.project(x, y, 0)), width, height);
    }
    if (forces && this.largest > 0) this.draw_forces(pen, view, factor, plane, through, colours.push);
    if (line?.length) this.draw_line(pen, line.map(([x, y, z, ux, uy, uz]) => view.project(x + factor * ux, y + factor * uy, z + factor * uz)), colours);
    this.draw_triad(pen, view, colours);
    if (marked >= 0) this.draw_mark(pen, this.place(view, factor, marked), colours);
  }

  /** Those that a solid is before are not drawn, unless it is seen through: where it meets another body that is all of them,
   * but where a plane has cut it open. */
  draw_forces(pen, view, factor, plane, through, colour) {
    const { rows, position: p } = this.surface, beyond = (i) => plane && plane[0].reduce((sum, n, c) => sum + n * p[i + c], 0) > plane[1];
    pen.strokeStyle = colour;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (const i of this.arrows) {
      if (beyond(3 * rows.vertex[i])) continue;
      const normal = rows.normal.subarray(3 * i, 3 * i + 3), eye = view.axes[2];
      if (view.dim === 3 && !through && !plane && !this.surface.contacts[rows.contact[i]].obstacle) continue;
      if (view.dim === 3 && !through && normal[0] * eye[0] + normal[1] * eye[1] + normal[2] * eye[2] > 0) continue; // the body is before it
      const way = view.project_way(...normal).map((x) => x / view.scale), size = Math.hypot(...way);
      if (size > 0.02) draw_arrow(pen, this.place(view, factor, rows.vertex[i]), way.map((x) => x / size), (ARROW * size * this.push[i]) / this.largest);
    }
    pen.stroke();
  }

  /** The axes in a corner; the one that looks towards the eye comes last. */
  draw_triad(pen, view, { ink, paper }) {
    const { dim, axisymmetric } = this.surface, [x, y] = [TRIAD + 16, this.height - TRIAD - 16];
    const ways = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].slice(0, dim).map((axis, c) => ({ name: axisymmetric && c === 0 ? "r" : "xyz"[c],
      way: view.project_way(...axis).map((v) => v / view.scale), near: view.axes[2][c] }));
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    for (const { name, way: [dx, dy], near } of ways.sort((a, b) => a.near - b.near)) {
      const size = Math.hypot(dx, dy), [ux, uy] = size > 0.1 ? [dx / size, dy / size] : [0.7, -0.7], at = [x + TRIAD * dx + 9 * ux, y + TRIAD * dy + 9 * uy];
      pen.strokeStyle = ink;
      pen.lineWidth = 1.5;
      pen.beginPath();
      if (size > 0.1) draw_arrow(pen, [x + TRIAD * dx, y + TRIAD * dy], [dx / size, dy / size], TRIAD * size);
      pen.stroke();
      pen.lineWidth = 3;
      pen.strokeStyle = paper;
      pen.strokeText(name, ...at);
      pen.fillStyle = ink;
      pen.fillText(name, ...at);
    }
  }

  /** Where a support, a load or a contact of a scene is: dots, or arrows along its way. */
  draw_places(view, { vertices, way }, colour) {
    const pen = this.canvas.getContext("2d"), every = Math.ceil(vertices.length / MOST_ARROWS), along = way && view.project_way(...way), size = along && Math.hypot(...along);
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.5;
    for (const vertex of vertices.filter((_, i) => i % every === 0)) {
      const [x, y] = this.place(view, 0, vertex);
      pen.beginPath();
      const arrow = way && size > 1e-6 * Math.hypot(...way) * view.scale;
      if (arrow) draw_arrow(pen, [x, y], along.map((x) => x / size), 0.5 * ARROW);
      else pen.arc(x, y, 4, 0, 2 * Math.PI);
      if (arrow) pen.stroke();
      else pen.fill();
    }
  }

  draw_line(pen, points, { ink, paper }) {
    for (const [width, colour] of [[5, paper], [2, ink]]) {
      pen.lineWidth = width;
      pen.strokeStyle = colour;
      pen.beginPath();
      points.forEach((point, i) => (i ? pen.lineTo(...point) : pen.moveTo(...point)));
      pen.stroke();
    }
    for (const end of [points[0], points[points.length - 1]]) this.draw_mark(pen, end, { ink, paper });
  }

  draw_mark(pen, [x, y], { ink, paper }) {
    for (const [width, colour] of [[4, paper], [2, ink]]) {
      pen.lineWidth = width;
      pen.strokeStyle = colour;
      pen.beginPath();
      pen.arc(x, y, 6, 0, 2 * Math.PI);
      pen.stroke();
    }
  }
}
