// body.js: the deformed body of a job, and the contact pressure along its surface.

import { Camera, VIEWS } from "./body_camera.js";
import { Cut } from "./body_cut.js";
import { listen } from "./body_input.js";
import { to_body } from "./body_obstacles.js";
import { Overlay } from "./body_overlay.js";
import { add_stress, displacement_of, forget_surface, load_surface, node_of, place_of, quantities, rows_by_vertex, shades_of, values_of, viridis } from "./body_surface.js";
import { announce, h, s, show } from "./dom.js";
import { number } from "./format.js";
import { mountPath } from "./path.js";
import { round_ticks } from "./plot.js";
import { mountPressure } from "./pressure.js";
import { colour } from "./theme.js";

const MOST_LINED = { 2: 4000, 3: 16000 }; // elements: lines of more would hide the colours
const MOST_AT_ONCE = 20000; // elements of a body whose stress is fetched before somebody asks for it
const REACH = 14; // pixels around the pointer in which a node is looked for
let mounts = 0;

/** A coordinate or value for people, with enough digits to tell nodes apart. */
const exact = (value) => number(value, 5);

/**
 * Shows the body of a job in an element.
 * api: of api.js (fetch, get, bytes, blob: with the token). options: {cases: names of its load cases, case: the one
 * that is shown first, path: they are points of a path, pressure: false where the chart of the contact pressure is not wanted}. Colours are the variables
 * of page.css; the document's event "themechange" tells that they changed. Returns {destroy()}, which stops everything
 * and frees what was made. Throws what the service answers where there is no body.
 */
export async function mountBody(element, api, jobId, options = {}) {
  const view = new BodyView(element, api, jobId, options);
  try {
    await view.start();
  } catch (error) {
    view.destroy();
    throw error;
  }
  return view;
}

/** A labelled box to tick. */
function tick(text, checked, change) {
  const box = h("input", { type: "checkbox", onchange: () => change(box.checked) });
  box.checked = checked;
  return { box, label: h("label", null, box, text) };
}

function choice(label, entries, value, change) {
  const field = h("select", { onchange: () => change(field.value) }, entries.map(({ id, name }) => h("option", { value: id }, name)));
  field.value = value;
  return { field, label: h("label", null, label, field) };
}

class BodyView {
  constructor(element, api, job, options) {
    Object.assign(this, { element, api, job, options, case_name: options.case || options.cases?.[0] || "", ends: new AbortController() });
    Object.assign(this, { quantity: "", limits: null, factor: 0, marked: -1, held: -1, frame: 0, frames: 0, number: ++mounts });
    this.shown = { wire: true, before: true, obstacles: true, forces: true, through: true };
  }

  async start() {
    performance.mark("body:start");
    const loading = this.load();
    loading.catch(() => {}); // told below
    const gl = await import("./body_gl.js").catch((error) => ({ error }));
    if (this.ends.signal.aborted) return;
    this.build();
    try {
      if (gl.error) throw gl.error;
      this.gl = new gl.BodyGL(this.canvas); // while the service answers: a first context takes its time
    } catch {
      this.gl = null;
    }
    const surface = await loading;
    if (this.ends.signal.aborted) return;
    if (!this.gl) {
      await this.fall_back();
      return;
    }
    this.take(surface);
    this.watch();
    this.draw(); // now, not at the next frame: nothing else is waited for
  }

  async load() {
    try {
      return await load_surface(this.api, this.job, this.case_name);
    } catch (error) {
      if (error.problem?.code !== "case_needed") throw error;
      const { cases } = await this.api.get(`/v1/jobs/${this.job}/result?fields=summary`);
      this.options = { ...this.options, cases: cases.map((one) => one.name) };
      this.case_name = cases[0].name;
      return load_surface(this.api, this.job, this.case_name);
    }
  }

  // ---- elements

  build() {
    this.canvas = h("canvas", { class: "body-canvas", tabindex: 0, role: "application", "aria-roledescription": "picture of a body that can be turned and enlarged",
      "aria-describedby": `body-keys-${this.number}` });
    this.overlay_canvas = h("canvas", { class: "body-overlay", "aria-hidden": "true" });
    this.readout = h("div", { class: "body-readout", hidden: true });
    this.frame_box = h("div", { class: "body-frame" }, this.canvas, this.overlay_canvas, this.readout);
    this.tools = h("div", { class: "body-tools" });
    this.legend = h("div", { class: "body-legend" });
    this.keys = h("p", { class: "muted body-keys", id: `body-keys-${this.number}` });
    this.path_place = h("div", { class: "body-path" });
    this.pressure_place = h("div", { class: "body-pressure" });
    this.way = this.options.path ? this.build_way() : null;
    show(this.element, this.tools, this.way, this.frame_box, this.legend, this.keys, this.path_place, this.pressure_place);
    this.overlay = new Overlay(this.overlay_canvas);
  }

  /** Along the cases of a path. It stands by itself, as the other tools are made anew for each surface that comes. */
  build_way() {
    const { cases } = this.options, told = h("output", { class: "muted" });
    const range = h("input", { type: "range", min: 0, max: cases.length - 1, step: 1, "aria-label": "Point of the path", oninput: () => this.change_case(cases[range.value]) });
    this.show_way = () => {
      range.value = cases.indexOf(this.case_name);
      range.setAttribute("aria-valuetext", this.case_name);
      told.value = this.case_name;
    };
    this.show_way();
    return h("div", { class: "body-tools body-way" }, h("span", null, "Along the path"), range, told);
  }

  build_tools() {
    const { surface } = this, range = 2 * surface.factor;
    const colours = choice("Colour", quantities(surface), this.quantity, (id) => this.choose(id));
    colours.field.classList.add("body-colour");
    this.slider = h("input", { type: "range", min: 0, max: range, step: range / 200, class: "body-scale", "aria-label": "Displacements are drawn this many times as large",
      oninput: () => this.scale(Number(this.slider.value)) });
    this.factor_field = h("input", { type: "number", min: 0, step: "any", class: "body-factor", "aria-label": "Factor of the displacements",
      onchange: () => this.scale(Math.min(Math.max(Number(this.factor_field.value) || 0, 0), 1e12)) });
    const part = (name, text) => tick(text, this.shown[name], (on) => ((this.shown[name] = on), this.gl.show(this.shown), this.redraw())).label;
    const button = (text, label, act) => h("button", { type: "button", class: "small", title: label, onclick: act }, text);
    const parts = [part("wire", "Elements"), part("before", "Undeformed")];
    if (surface.contacts.some((one) => one.obstacle)) parts.push(part("obstacles", "Obstacle"));
    if (surface.rows.count) parts.push(part("forces", "Contact forces"));
    if (surface.dim === 3 && surface.contacts.some((one) => !one.obstacle)) parts.push(part("through", "See through"));
    if (surface.dim === 3) parts.push(tick("z upwards", this.view.z_up, (on) => (this.view.stand(on), this.home())).label);
    show(this.tools,
      this.options.cases?.length > 1 ? choice("Case", this.options.cases.map((id) => ({ id, name: id })), this.case_name, (name) => this.change_case(name)).label : null,
      colours.label,
      h("span", { class: "body-times" }, "Displacements ×", this.factor_field, this.slider, button("×1", "Draw displacements as they are", () => this.scale(1)),
        button("auto", "Draw displacements so that they show", () => this.scale(surface.factor))),
      this.cut?.tools,
      h("span", { class: "body-parts" }, parts),
      h("span", { class: "body-buttons" }, button("+", "Larger", () => (this.view.zoom(1.25), this.redraw())), button("−", "Smaller", () => (this.view.zoom(0.8), this.redraw())),
        button("Show all", "Show all of the body", () => this.home()), this.overlay.pressed.length ? button("Contact", "Show where it touches", () => this.look()) : null,
        surface.dim === 3 ? VIEWS.map(([name, ...turn]) => button(name, `See it from the ${name.toLowerCase()}`, () => this.turn(...turn))) : null, button("SVG", "Save as a picture for a report", () => this.save())));
  }

  /** ", MPa": what the scene calls the unit of a quantity. */
  unit(id) {
    const { units } = this.options;
    return units ? `, ${id === "von_mises" || id === "pressure" ? units.stress : units.length}` : "";
  }

  /** The colour bar with its numbers. */
  draw_legend() {
    const WIDTH = 300, [low, high] = this.range(), id = `body-scale-${this.number}`;
    const stops = Array.from({ length: 9 }, (_, i) => s("stop", { offset: i / 8, "stop-color": `rgb(${viridis(i / 8).join(" ")})` }));
    const name = quantities(this.surface).find((one) => one.id === this.quantity).name;
    const place = (value) => Math.min(WIDTH, Math.max(0, (WIDTH * (value - low)) / (high - low)));
    show(this.legend, h("div", { class: "body-quantity" }, name + this.unit(this.quantity)), s("svg", { viewBox: `-20 0 ${WIDTH + 40} 30`, width: WIDTH + 40, height: 30, role: "img", "aria-label": `${name}: colours from ${exact(low)} to ${exact(high)}` },
      s("defs", null, s("linearGradient", { id }, stops)), s("rect", { width: WIDTH, height: 12, fill: `url(#${id})` }),
      round_ticks(low, high, WIDTH).map(({ value, text }) => [s("path", { class: "tick", d: `M${place(value)} 12v4` }), s("text", { x: place(value), y: 28, "text-anchor": "middle" }, text)])),
      h("span", { class: "body-range" }, ["low", "high"].map((end, k) => h("input", { type: "number", step: "any", value: Number([low, high][k].toPrecision(5)), class: `body-${end}`,
        "aria-label": `Colours ${k ? "end" : "begin"} at`, onchange: (event) => this.limit(k, event.target.valueAsNumber) })),
        this.limits ? h("button", { type: "button", class: "small", title: "Colours from the least to the largest value", onclick: () => this.limit(0, NaN) }, "all values") : null),
      this.quantity === "pressure" ? h("span", { class: "muted" }, "grey: nothing to touch") : null);
  }

  /** Of the values, those within the body among them where it is cut, or what was chosen; what is zero but for rounding is
   * told as 0. */
  range() {
    if (this.limits) return this.limits;
    const all = this.inside?.quantity === this.quantity ? [this.values, this.inside] : [this.values];
    const low = Math.min(...all.map((one) => one.low)), high = Math.max(...all.map((one) => one.high));
    const least = 1e-9 * Math.max(Math.abs(low), Math.abs(high));
    return [low, high].map((value) => (Math.abs(value) < least ? 0 : value));
  }

  shades() {
    const [low, high] = this.range();
    return shades_of(this.surface, { ...this.values, low, high });
  }

  /** The cut is another one; error: what is said against it. */
  show_cut(error) {
    if (error) this.say(error.message);
    this.paint();
  }

  /** The plane that cuts, and what stands there in the colours of the body. The section that comes next has most likely the
   * range of the last: until then the colours stay. */
  take_section() {
    const { plane, section } = this.cut;
    this.cut.want(this.quantity === "von_mises");
    const values = section && this.quantity !== "pressure" && (this.quantity !== "von_mises" || section.von_mises) ? values_of(section, this.quantity) : null;
    if (values) this.inside = { quantity: this.quantity, ...values };
    else if (!plane) this.inside = null;
    const [low, high] = this.range(), at = values ? values.at : () => NaN;
    this.gl.cut(plane, section, section && shades_of(section, { at, low, high }));
  }

  /** All that is coloured, and the bar. */
  paint() {
    if (this.cut) this.take_section();
    this.gl.colour(this.shades());
    this.draw_legend();
    this.redraw();
  }

  /** One end of the colours; no number, or what leaves nothing between them: as the values are. */
  limit(end, value) {
    const limits = [...this.range()];
    limits[end] = value;
    this.limits = limits[0] < limits[1] ? limits : null;
    this.recolour();
  }

  recolour() {
    this.paint();
    announce(this.summary());
  }

  summary() {
    const { surface } = this, [low, high] = this.range(), name = quantities(surface).find((one) => one.id === this.quantity).name.toLowerCase();
    const touching = surface.rows.reaction?.values.filter((r) => r < 0).length ?? 0;
    return `Deformed body of ${surface.elements} elements, coloured by ${name} from ${exact(low)} to ${exact(high)}; ` +
      `largest displacement ${exact(surface.largest_displacement)}, drawn ${number(this.factor, 4)} times as large` +
      (surface.rows.count ? `; ${touching} of ${surface.rows.count} contact nodes touch.` : ".");
  }

  // ---- state

  /** A surface came: of the job, or of another of its cases. */
  take(surface) {
    const first = !this.surface, same = !first && this.surface.position.length === surface.position.length;
    this.surface = surface;
    if (first) this.shown.wire = surface.elements <= MOST_LINED[surface.dim];
    this.overlay.take(surface);
    const known = quantities(surface).map((one) => one.id), first_wanted = this.overlay.pressed.length && known.includes("pressure") ? "pressure" : "displacement";
    const wanted = known.includes(this.quantity) ? this.quantity : first_wanted;
    this.quantity = wanted === "von_mises" && !surface.von_mises ? "displacement" : wanted;
    this.limits = this.inside = null;
    this.values = values_of(surface, this.quantity);
    this.rows = rows_by_vertex(surface);
    this.marked = this.held = -1;
    if (first || !same) this.view = new Camera(surface.dim);
    if (first) this.factor = surface.factor;
    this.gl.take(surface, this.shades());
    this.cut?.destroy();
    this.cut = surface.dim === 3 ? new Cut(this.api, this.job, surface, this.case_name, (error) => this.show_cut(error)) : null;
    this.gl.show(this.shown);
    this.take_colours();
    this.build_tools();
    this.resize();
    if (first || !same) this.look();
    this.scale(this.factor);
    this.draw_legend();
    show(this.keys, surface.dim === 3 ? "Drag to turn, with Shift to move; with the picture in focus the wheel enlarges, arrows turn, Shift and arrows move, + and − enlarge, 0 shows all."
      : "Drag to move; with the picture in focus the wheel enlarges, arrows move, + and − enlarge, 0 shows all.");
    if (this.options.pressure !== false) this.show_pressure();
    this.show_path();
    if (wanted === "von_mises" && !surface.von_mises) {
      this.tools.querySelector(".body-colour").value = wanted;
      this.choose(wanted);
    }
  }

  show_path() {
    const { surface } = this, { dim, unit } = surface;
    this.path?.destroy();
    this.line = null;
    const shown = (points) => points && points.map(({ at, u }) => [...to_body(surface, at), ...(dim === 2 ? [0] : []), ...u.map((x) => x / unit), ...(dim === 2 ? [0] : [])]);
    this.path = mountPath(this.path_place, this.api, this.job, { case: this.case_name, units: this.options.units, surface,
      on_line: (points) => ((this.line = shown(points)), this.redraw()), pick: (act) => (this.picked = act) });
  }

  async show_pressure() {
    this.pressure?.destroy();
    this.pressure = null;
    const pressure = await mountPressure(this.pressure_place, this.api, this.job, { case: this.case_name, units: this.options.units, on_node: (vertex) => this.mark(vertex) });
    if (this.ends.signal.aborted) pressure.destroy();
    else this.pressure = pressure;
  }

  async choose(id) {
    const { surface } = this;
    this.quantity = id;
    if (id === "von_mises" && !surface.von_mises && !(await this.fetch_stress())) return;
    if (this.quantity !== id || this.surface !== surface || this.ends.signal.aborted) return;
    this.values = values_of(surface, id);
    this.limits = null;
    this.recolour();
  }

  /** False where it does not come, which is said. */
  async fetch_stress() {
    try {
      await add_stress(this.api, this.job, this.surface);
      return true;
    } catch (error) {
      if (!this.ends.signal.aborted) this.say(error.message);
      return false;
    }
  }

  scale(factor) {
    this.factor = factor;
    this.slider.value = factor;
    this.slider.setAttribute("aria-valuetext", `${number(factor, 4)} times`);
    this.factor_field.value = Number(factor.toPrecision(4));
    this.redraw();
  }

  async change_case(name) {
    this.case_name = name;
    this.show_way?.();
    try {
      const surface = await load_surface(this.api, this.job, name);
      if (name === this.case_name && !this.ends.signal.aborted) this.take(surface);
    } catch (error) {
      if (!this.ends.signal.aborted) this.say(error.message);
    }
  }

  home() {
    this.view.turn_home();
    this.view.fit(this.surface, this.factor);
    this.redraw();
  }

  turn(azimuth, elevation) {
    this.view.turn(azimuth, elevation);
    this.view.fit(this.surface, this.factor);
    this.redraw();
  }

  /** Where it touches, seen from outside of the body. */
  look() {
    const { rows } = this.surface, { pressed } = this.overlay, out = [0, 1, 2].map((c) => -pressed.reduce((sum, row) => sum + rows.normal[3 * row + c], 0));
    this.view.turn_home();
    if (Math.hypot(...out) > 0.3 * pressed.length) this.view.turn_to(out);
    this.view.fit_part(this.surface, this.factor, pressed.map((row) => rows.vertex[row]));
    this.redraw();
  }

  // ---- pointer

  over(x, y, is_tap) {
    if (x === null) this.mark(this.held);
    else {
      const vertex = this.view.pick(this.surface, this.factor, x, y, REACH);
      if (is_tap && vertex >= 0 && this.picked) this.picked(vertex);
      else if (is_tap) this.held = vertex;
      this.mark(vertex >= 0 ? vertex : this.held);
    }
  }

  mark(vertex) {
    if (vertex === this.marked) return;
    this.marked = vertex;
    this.readout.hidden = vertex < 0;
    if (vertex >= 0) show(this.readout, this.describe(vertex).map(([name, value]) => h("div", null, h("b", null, name), ` ${value}`)));
    this.redraw();
  }

  /** [[name, value]] of what is known at a vertex. */
  describe(vertex) {
    const { surface } = this, row = this.rows.get(vertex), { rows } = surface, u = displacement_of(surface, vertex);
    const list = [["node", String(node_of(surface, vertex))], ["at", place_of(surface, vertex).map(exact).join(", ")], ["displacement", `${u.map(exact).join(", ")} (${exact(Math.hypot(...u))})`]];
    if (surface.von_mises) list.push(["von Mises", exact(values_of(surface, "von_mises").at(vertex))]);
    if (row === undefined) return list;
    if (rows.pressure && rows.pressure.values[row] >= 0) list.push(["pressure", exact(rows.pressure.values[row])]);
    list.push(["reaction", exact(rows.reaction.values[row])]);
    if (rows.gap) list.push(["gap", exact(rows.gap.values[row])]);
    return list;
  }

  // ---- drawing

  take_colours() {
    const [ink, before, obstacle, push, paper] = ["--ink", "--before", "--obstacle", "--push", "--paper"].map(colour);
    this.colours = { ink, before, obstacle, push, paper };
    this.gl.ink(this.colours);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.frame_box, ratio = Math.min(window.devicePixelRatio || 1, 3);
    if (!(width > 0 && height > 0)) return;
    this.view.resize(width, height);
    this.gl.resize(width, height, ratio);
    this.overlay.resize(width, height, ratio);
  }

  redraw() {
    this.frame = this.frame || requestAnimationFrame(() => this.draw());
  }

  draw() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    if (!this.gl || this.ends.signal.aborted) return;
    const { surface, shown } = this; // where bodies touch each other in space they are before it
    const through = surface.dim === 3 && shown.through && this.quantity === "pressure" && surface.contacts.some((one) => !one.obstacle);
    this.gl.render(this.view, this.factor, through);
    this.overlay.draw(this.view, this.factor, { colours: this.colours, obstacles: shown.obstacles, forces: shown.forces, through,
      plane: this.cut?.plane, marked: this.marked, line: this.line });
    this.canvas.setAttribute("aria-label", this.summary());
    this.canvas.dataset.frames = ++this.frames;
    if (this.frames > 1) return;
    performance.mark("body:drawn");
    if (this.surface.elements <= MOST_AT_ONCE) this.fetch_stress(); // so that nodes can tell theirs
  }

  watch() {
    const { signal } = this.ends;
    listen(this.canvas, () => this.view,
      { changed: () => this.redraw(), home: () => this.home(), over: (...at) => this.over(...at) }, signal);
    this.sizes = new ResizeObserver(() => {
      this.resize();
      this.draw();
    });
    this.sizes.observe(this.frame_box);
    document.addEventListener("themechange", () => (this.take_colours(), this.redraw()), { signal });
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // else the browser does not bring it back
      this.say("The graphics card was lost; waiting for it.");
    }, { signal });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.readout.hidden = true;
      this.redraw();
    }, { signal });
  }

  say(text) {
    this.readout.hidden = false;
    show(this.readout, text);
  }

  // ---- pictures of the service

  picture_path() {
    const query = new URLSearchParams();
    if (this.case_name) query.set("case", this.case_name);
    if (this.surface) query.set("factor", String(this.factor));
    query.set("colour", ["von_mises", "pressure"].includes(this.quantity) ? this.quantity : "displacements");
    return `/v1/jobs/${this.job}/deformed.svg?${query}`;
  }

  async save() {
    const address = URL.createObjectURL(await this.api.blob(this.picture_path()));
    const link = h("a", { href: address, download: `deformed-${this.job.slice(-8)}.svg` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }

  /** Without WebGL: the service's own picture. */
  async fall_back() {
    this.gl = null;
    const blob = await this.api.blob(this.picture_path());
    if (this.ends.signal.aborted) return;
    this.address = URL.createObjectURL(blob);
    show(this.element, h("img", { src: this.address, alt: "The deformed body", class: "picture" }),
      h("p", { class: "muted" }, "This browser has no WebGL: the picture cannot be turned."), this.pressure_place);
    if (this.options.pressure !== false) await this.show_pressure();
  }

  destroy() {
    this.ends.abort();
    cancelAnimationFrame(this.frame);
    this.sizes?.disconnect();
    this.pressure?.destroy();
    this.path?.destroy();
    this.cut?.destroy();
    this.gl?.dispose();
    this.gl = null;
    if (this.address) URL.revokeObjectURL(this.address);
    forget_surface();
    this.element.replaceChildren();
  }
}
