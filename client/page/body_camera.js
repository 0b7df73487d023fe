// body_camera.js: from the body's coordinates to pixels and back: an orthographic view, turned about the vertical.

const TURN = { azimuth: Math.PI / 6, elevation: (25 / 180) * Math.PI }; // as in the service's own pictures
const STEEP = (35 / 180) * Math.PI; // what is above or below is seen from there, and still aslant
const MARGIN = 46;
const LEAST_PART = 0.25; // of the body, that is seen around its contact
export const VIEWS = [["Front", 0, 0], ["Side", Math.PI / 2, 0], ["Top", 0, Math.PI / 2]];

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** What one sees: target is the point in the middle, scale the pixels per unit of length. */
export class Camera {
  constructor(dim) {
    Object.assign(this, { dim, z_up: false, target: [0, 0, 0], scale: 1, home_scale: 1, width: 1, height: 1 });
    this.turn_home();
  }

  turn_home() {
    this.turn(TURN.azimuth, TURN.elevation);
  }

  turn(azimuth, elevation) {
    this.azimuth = this.dim === 3 ? azimuth : 0;
    this.elevation = this.dim === 3 ? elevation : 0;
    this.orient();
  }

  /** Towards where a side looks that has this direction out of the body. */
  turn_to(out) {
    const [x, y, z] = this.z_up ? [out[0], out[2], -out[1]] : out;
    const aslant = Math.abs(y) > 0.5 * Math.hypot(x, y, z);
    this.turn(Math.hypot(x, z) > 0.3 * Math.abs(y) ? Math.atan2(x, z) - TURN.azimuth : TURN.azimuth, aslant ? Math.sign(y) * STEEP : TURN.elevation);
  }

  /** y or z points upwards. */
  stand(z_up) {
    this.z_up = this.dim === 3 && z_up;
    this.orient();
  }

  /** axes: to the right, upwards, towards the eye; with z upwards of a frame that has x, z, -y. */
  orient() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    this.axes = [[ca, 0, -sa], [-sa * se, ce, -ca * se], [sa * ce, se, ca * ce]].map(([x, y, z]) => (this.z_up ? [x, -z, y] : [x, y, z]));
  }

  /** [x, y, depth]: pixels from the upper left corner; depth grows towards the eye. */
  project(x, y, z) {
    const p = [x - this.target[0], y - this.target[1], z - this.target[2]];
    return [this.width / 2 + this.scale * dot(this.axes[0], p), this.height / 2 - this.scale * dot(this.axes[1], p), dot(this.axes[2], p)];
  }

  /** Projects a direction: pixels per unit of it. */
  project_way(x, y, z) {
    return [this.scale * dot(this.axes[0], [x, y, z]), -this.scale * dot(this.axes[1], [x, y, z])];
  }

  rotate(right, up) {
    if (this.dim !== 3) return;
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, -Math.PI / 2), Math.PI / 2);
    this.orient();
  }

  /** Moves what is seen by pixels. */
  pan(right, down) {
    for (let c = 0; c < 3; c++) this.target[c] -= (right * this.axes[0][c] - down * this.axes[1][c]) / this.scale;
  }

  /** Makes all larger, so that the point under a pixel stays there. */
  zoom(times, x = this.width / 2, y = this.height / 2) {
    const scale = Math.min(Math.max(this.scale * times, this.home_scale / 50), this.home_scale * 1e5), real = scale / this.scale;
    const right = (x - this.width / 2) * (1 - real), down = (y - this.height / 2) * (1 - real);
    this.scale = scale;
    this.pan(right, down);
  }

  /** [low, high] of both axes of the picture, of some vertices or all, as they were and as they are drawn. */
  extent(surface, factor, vertices = null) {
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity], { position: x, displacement: u } = surface;
    for (let n = 0, most = vertices ? vertices.length : x.length / 3; n < most; n++) {
      const i = 3 * (vertices ? vertices[n] : n);
      for (const times of [0, factor])
        for (let k = 0; k < 2; k++) {
          const a = this.axes[k], at = a[0] * (x[i] + times * u[i]) + a[1] * (x[i + 1] + times * u[i + 1]) + a[2] * (x[i + 2] + times * u[i + 2]);
          if (at < low[k]) low[k] = at;
          if (at > high[k]) high[k] = at;
        }
    }
    return [low, high];
  }

  /** Puts what is between two corners of `extent` into the picture. */
  frame([low, high]) {
    const middle = [0, 1].map((k) => (low[k] + high[k]) / 2), size = [0, 1].map((k) => Math.max(high[k] - low[k], 1e-9));
    for (let c = 0; c < 3; c++) this.target[c] = middle[0] * this.axes[0][c] + middle[1] * this.axes[1][c];
    this.scale = Math.min(Math.max(this.width - 2 * MARGIN, 40) / size[0], Math.max(this.height - 2 * MARGIN, 40) / size[1]);
  }

  /** Puts all of the body, as it was and as it is drawn, into the picture; returns its extent. */
  fit(surface, factor) {
    const extent = this.extent(surface, factor);
    this.frame(extent);
    this.home_scale = this.scale;
    return extent;
  }

  /** Puts some vertices and half as much around them into the picture; all of the body where that is most of it. */
  fit_part(surface, factor, vertices) {
    const [first, last] = this.fit(surface, factor);
    if (!vertices.length) return;
    const target = [...this.target], [low, high] = this.extent(surface, factor, vertices);
    const most = Math.max(last[0] - first[0], last[1] - first[1]);
    for (let k = 0; k < 2; k++) {
      const around = Math.max(0.5 * Math.max(high[0] - low[0], high[1] - low[1]), (LEAST_PART * most - (high[k] - low[k])) / 2);
      low[k] -= around;
      high[k] += around;
    }
    this.frame([low, high]);
    if (this.scale > 1.2 * this.home_scale) return;
    this.scale = this.home_scale;
    this.target = target;
  }

  /** A new size of the picture: what is in the middle stays, and as much of it as before is seen. */
  resize(width, height) {
    const before = Math.min(this.width, this.height);
    if (before > 1) {
      this.scale *= Math.min(width / this.width, height / this.height);
      this.home_scale *= Math.min(width / this.width, height / this.height);
    }
    this.width = width;
    this.height = height;
  }

  /** The vertex nearest to a pixel, the foremost of those within `reach` of it; -1: there is none. */
  pick(surface, factor, x, y, reach) {
    const { position: p, displacement: u } = surface, [right, up, eye] = this.axes;
    let found = -1, best = Infinity;
    for (let i = 0; i < p.length; i += 3) {
      const q0 = p[i] + factor * u[i] - this.target[0], q1 = p[i + 1] + factor * u[i + 1] - this.target[1], q2 = p[i + 2] + factor * u[i + 2] - this.target[2];
      const dx = this.width / 2 + this.scale * (right[0] * q0 + right[1] * q1 + right[2] * q2) - x;
      if (dx > reach || dx < -reach) continue;
      const dy = this.height / 2 - this.scale * (up[0] * q0 + up[1] * q1 + up[2] * q2) - y;
      const away = dx * dx + dy * dy;
      if (away > reach * reach) continue;
      // In space what lies behind is hidden: depth counts, in pixels, before distance does.
      const score = away - (this.dim === 3 ? 4 * reach * this.scale * (eye[0] * q0 + eye[1] * q1 + eye[2] * q2) : 0);
      if (score < best) [best, found] = [score, i / 3];
    }
    return found;
  }
}
