// body_cut.js: a plane across an axis that cuts a solid: what lies beyond it is not drawn, and where it cuts stands what
// the service says is there (GET /v1/jobs/{id}/section).

import { box_of } from "./body_obstacles.js";
import { parse_surface } from "./body_surface.js";
import { debounce, h } from "./dom.js";
import { number } from "./format.js";

const FETCH_MS = 120, STEPS = 200;

export class Cut {
  /** on_change(error): the plane or the section is another one; error: what the service says against it, null: nothing. */
  constructor(api, job, surface, case_name, on_change) {
    Object.assign(this, { api, job, surface, case_name, on_change, axis: -1, way: 1, section: null, stress: false, ends: new AbortController() });
    this.box = box_of(surface);
    this.field = h("select", { class: "body-cut", onchange: () => this.choose(this.field.value) }, h("option", { value: "" }, "nothing"),
      ["x", "y", "z"].flatMap((name, c) => [1, -1].map((way) => h("option", { value: `${c} ${way}` }, `${way > 0 ? "larger" : "smaller"} ${name}`))));
    this.slider = h("input", { type: "range", min: 1, max: STEPS - 1, value: STEPS / 2, class: "body-scale body-cut-at", "aria-label": "Where the plane cuts", hidden: true, oninput: () => this.move() });
    this.tools = h("span", { class: "body-times" }, h("label", null, "Cut off", this.field), this.slider);
    this.fetch_soon = debounce(() => this.fetch(), FETCH_MS);
  }

  choose(text) {
    [this.axis, this.way] = text ? text.split(" ").map(Number) : [-1, 1];
    this.slider.hidden = this.axis < 0;
    this.move();
  }

  /** In the body's own units. */
  get offset() {
    const [low, high] = this.box.map((corner) => corner[this.axis]);
    return low + ((high - low) * Number(this.slider.value)) / STEPS;
  }

  /** [normal, offset] in the body's own units, of which the part beyond is not drawn; null: all is. */
  get plane() {
    if (this.axis < 0) return null;
    return [[0, 1, 2].map((c) => (c === this.axis ? this.way : 0)), this.way * this.offset];
  }

  move() {
    this.section = null;
    const { surface } = this;
    if (this.axis >= 0) this.slider.setAttribute("aria-valuetext", `${"xyz"[this.axis]} = ${number(surface.origin[this.axis] + surface.unit * this.offset, 4)}`);
    this.on_change(null);
    this.fetch_soon();
  }

  /** Is the stress wanted too? */
  want(stress) {
    if (this.stress === stress) return;
    this.stress = stress;
    if (stress && this.section && !this.section.von_mises) this.fetch();
  }

  async fetch() {
    const { plane, surface, stress } = this;
    if (!plane) return;
    const point = [0, 1, 2].map((c) => (c === this.axis ? surface.origin[c] + surface.unit * this.offset : surface.origin[c]));
    const query = new URLSearchParams({ point: point.join(","), normal: plane[0].join(","), fields: stress ? "displacements,von_mises" : "displacements" });
    if (this.case_name) query.set("case", this.case_name);
    let error = null, section = null;
    try {
      section = parse_surface(await this.api.bytes(`/v1/jobs/${this.job}/section?${query}`, { signal: this.ends.signal }));
    } catch (refused) {
      error = refused;
    }
    if (this.ends.signal.aborted || String(this.plane) !== String(plane)) return; // moved meanwhile
    if (this.stress && !stress) return void this.fetch(); // wanted meanwhile
    this.section = section;
    this.on_change(error);
  }

  destroy() {
    this.ends.abort();
    this.fetch_soon.cancel();
  }
}
