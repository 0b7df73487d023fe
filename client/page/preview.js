// preview.js: what a scene's text describes, drawn while it is typed: the body, and where its supports, loads and
// contacts are.

import { Camera } from "./body_camera.js";
import { BodyGL } from "./body_gl.js";
import { listen } from "./body_input.js";
import { Overlay } from "./body_overlay.js";
import { h, show } from "./dom.js";
import { shape_of } from "./scene_shape.js";
import { colour } from "./theme.js";

const COLOURS = { support: "--series-1", load: "--push", contact: "--series-3" };

export class Preview {
  constructor(element) {
    this.ends = new AbortController();
    this.canvas = h("canvas", { class: "body-canvas", tabindex: 0, role: "img", "aria-label": "The scene" });
    const over = h("canvas", { class: "body-overlay", "aria-hidden": "true" });
    this.said = h("p", { class: "muted preview-said" });
    this.frame = h("div", { class: "body-frame preview-frame" }, this.canvas, over);
    show(element, this.frame, h("div", { class: "legend" }, Object.keys(COLOURS).map((kind) => h("span", { class: "key" }, h("span", { class: `swatch mark-${kind}` }), `${kind}s`))), this.said);
    this.gl = new BodyGL(this.canvas);
    this.overlay = new Overlay(over);
    listen(this.canvas, () => this.view, { changed: () => this.draw(), home: () => this.home(), over: () => {} }, this.ends.signal);
    this.sizes = new ResizeObserver(() => (this.resize(), this.draw()));
    this.sizes.observe(this.frame);
    document.addEventListener("themechange", () => this.draw(), { signal: this.ends.signal });
  }

  /** The text, or null where it is none that could be drawn: then the last one stays. */
  take(request) {
    let shape = null;
    try {
      shape = request && shape_of(request);
    } catch {
      return; // being typed
    }
    this.frame.parentElement.hidden = !shape && !this.shape;
    if (!shape) return void show(this.said, this.shape ? "The mesh stands in a file, or is none yet: what is drawn is what was there before." : "");
    const fresh = !this.view || this.view.dim !== shape.surface.dim || String(this.shape.surface.origin) !== String(shape.surface.origin) || this.shape.surface.unit !== shape.surface.unit;
    this.shape = shape;
    this.gl.take(shape.surface, new Float32Array(shape.surface.position.length / 3).fill(-1));
    this.overlay.take(shape.surface);
    if (fresh) this.view = new Camera(shape.surface.dim);
    this.resize();
    if (fresh) this.home();
    const of = (kind) => shape.marks.filter((one) => one.kind === kind).length;
    const words = ["support", "load", "contact"].map((kind) => `${of(kind)} ${kind}${of(kind) === 1 ? "" : "s"}`).join(", ");
    this.canvas.setAttribute("aria-label", `The scene: a body with ${words}`);
    show(this.said, `${words}${shape.unknown.length ? `; not drawn, since it is not known here where it is: ${[...new Set(shape.unknown)].join(", ")}` : ""}.`);
    this.draw();
  }

  home() {
    this.view.turn_home();
    this.view.fit(this.shape.surface, 0);
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.frame, ratio = Math.min(window.devicePixelRatio || 1, 3);
    if (!(width > 0 && height > 0) || !this.view) return;
    this.view.resize(width, height);
    this.gl.resize(width, height, ratio);
    this.overlay.resize(width, height, ratio);
  }

  draw() {
    if (!this.view || this.ends.signal.aborted) return;
    const [ink, before, obstacle, paper] = ["--ink", "--before", "--obstacle", "--paper"].map(colour);
    this.gl.ink({ before, obstacle });
    this.gl.render(this.view, 0);
    this.overlay.draw(this.view, 0, { colours: { ink, obstacle, paper }, obstacles: true, forces: false, marked: -1 });
    for (const mark of this.shape.marks) this.overlay.draw_places(this.view, mark, colour(COLOURS[mark.kind]));
  }

  destroy() {
    this.ends.abort();
    this.sizes.disconnect();
    this.gl.dispose();
  }
}
