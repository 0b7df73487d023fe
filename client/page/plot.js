// plot.js: line charts and scatters as SVG, with linear and logarithmic axes (d3-scale, d3-shape). Colours are classes of
// page.css, so that a change of theme needs no new drawing.

import { scaleLinear, scaleLog } from "d3-scale";
import { line } from "d3-shape";
import { h, s, show } from "./dom.js";
import { number, superscript } from "./format.js";

const MARGIN = { left: 62, right: 14, top: 10, bottom: 42 }; // at the left more, where the numbers there are long
const DIGIT = 6.6; // wide at most

function power_of_ten(value) {
  const exponent = Math.round(Math.log10(value));
  if (exponent >= -2 && exponent <= 3) return String(Number(value.toPrecision(1)));
  return `10${superscript(exponent)}`;
}

/**
 * At most about `most` of the points, in the order of x, for a line that looks the same: of each of most/4 equal parts of
 * the list the first, the least, the largest and the last.
 */
export function thin(points, most) {
  if (points.length <= most) return points;
  const parts = Math.max(1, Math.floor(most / 4)), kept = [];
  for (let part = 0; part < parts; part++) {
    const from = Math.floor((part * points.length) / parts), to = Math.floor(((part + 1) * points.length) / parts);
    let low = from, high = from;
    for (let i = from; i < to; i++) {
      if (points[i][1] < points[low][1]) low = i;
      if (points[i][1] > points[high][1]) high = i;
    }
    for (const i of [...new Set([from, low, high, to - 1])].sort((a, b) => a - b)) kept.push(points[i]);
  }
  return kept;
}

/** Those that an axis can show: finite, and above 0 on a logarithmic one; with gaps, those that interrupt the line too. */
function visible(points, x_log, y_log, gaps) {
  return points.filter(([x, y]) => Number.isFinite(x) && (gaps || Number.isFinite(y)) && (!x_log || x > 0) && (!y_log || y > 0));
}

function extent(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : null;
}

function scale_of(axis, values, range) {
  let [low, high] = extent(values) || (axis.log ? [1e-3, 1] : [0, 1]);
  if (axis.log) {
    if (high / low < 1.0001) [low, high] = [low / 3, high * 3];
    const pad = (high / low) ** 0.03;
    return scaleLog().domain([low / pad, high * pad]).range(range);
  }
  if (axis.from_zero) low = Math.min(0, low);
  if (axis.whole) high = Math.max(high, low + 1);
  if (high - low < 1e-300) [low, high] = [low - 0.5, high + 0.5];
  return scaleLinear().domain([low, high]).range(range);
}

/** 1, 2 and 5 times powers of ten within an axis of few decades, or all digits where it is less than one. */
function fine_ticks(low, high) {
  const of = (digits) => {
    const found = [];
    for (let k = Math.floor(Math.log10(low)); k <= Math.log10(high); k++)
      for (const digit of digits) if (digit * 10 ** k >= low && digit * 10 ** k <= high) found.push(digit * 10 ** k);
    return found;
  };
  const found = [of([1, 2, 5]), of([1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9])].find((ticks) => ticks.length >= 2);
  return found || scaleLinear().domain([low, high]).ticks(4);
}

/** [{value, text}]: round numbers from low to high along a bar of so many pixels, by the rule of the service's pictures. */
export function round_ticks(low, high, pixels) {
  const ROOM = 56, MOST = 8, least = ((high - low) * ROOM) / pixels, power = 10 ** Math.floor(Math.log10(least)), found = [];
  const step = [1, 2, 5].map((digit) => digit * power).find((one) => least <= one * (1 + 1e-9)) ?? 10 * power;
  const first = Math.ceil(low / step - 1e-9); // where the values differ by rounding no number is the next one's neighbour
  for (let i = 0; least > 0 && i < MOST && (first + i) * step <= high + 1e-9 * step; i++) {
    const value = (first + i) * step, text = number(Number(value.toPrecision(12)), 6);
    if (text !== found.at(-1)?.text) found.push({ value, text });
  }
  return found;
}

/** [{value, text}]: powers of ten where there are some, at most so many. format: of a value, where not a plain number. */
function ticks_of(scale, { log, format, whole }, most) {
  const text_of = format || ((value) => number(value, 4));
  const shown = (values) => values.filter((value) => !whole || Number.isInteger(value)).map((value) => ({ value, text: text_of(value) }));
  if (!log) return shown(scale.ticks(most));
  const [low, high] = scale.domain();
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const step = Math.max(1, Math.ceil((last - first + 1) / most)), powers = [];
  for (let k = last; k >= first; k -= step) powers.push(10 ** k);
  if (powers.length >= 3) return powers.map((value) => ({ value, text: format ? format(value) : power_of_ten(value) }));
  return shown(fine_ticks(low, high));
}

function draw_axes(svg, { x, y }, scales, y_ticks, size) {
  const bottom = size.height - MARGIN.bottom, [left, right] = scales.x.range();
  for (const { value, text } of ticks_of(scales.x, x, Math.max(3, Math.floor(size.width / 90)))) {
    const at = scales.x(value);
    svg.append(s("line", { class: "grid", x1: at, x2: at, y1: MARGIN.top, y2: bottom }),
      s("text", { class: "tick", x: at, y: bottom + 16, "text-anchor": "middle" }, text));
  }
  for (const { value, text } of y_ticks) {
    const at = scales.y(value);
    svg.append(s("line", { class: "grid", x1: left, x2: right, y1: at, y2: at }),
      s("text", { class: "tick", x: left - 7, y: at + 4, "text-anchor": "end" }, text));
  }
  svg.append(s("path", { class: "axis", d: `M${left},${MARGIN.top}V${bottom}H${right}` }),
    s("text", { class: "label", x: (left + right) / 2, y: size.height - 6, "text-anchor": "middle" }, x.label),
    s("text", { class: "label", transform: `translate(13 ${(MARGIN.top + bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, y.label));
}

/** Names beside points, from the top down; one that would lie on another stands below its point instead of above. */
function draw_texts(svg, points, scales) {
  const taken = [], downwards = [...points].sort((a, b) => scales.y(a[1]) - scales.y(b[1]));
  for (const [px, py, text] of downwards) {
    const x = scales.x(px), at_right = x > scales.x.range()[1] - 90, width = 7 * text.length;
    const left = at_right ? x - 9 - width : x + 9;
    const free = (y) => taken.every((one) => Math.abs(one.y - y) > 12 || one.left > left + width || left > one.left + one.width);
    const above = scales.y(py) - 8, y = free(above) ? above : above + 20;
    taken.push({ left, width, y });
    svg.append(s("text", { class: "point-text", x: x + (at_right ? -9 : 9), y, "text-anchor": at_right ? "end" : "start" }, text));
  }
}

function draw_series(svg, one, points, scales) {
  const colour = `series-${one.colour}`;
  if (one.across) {
    const [from, to] = scales.x.range();
    for (const [, y] of points)
      svg.append(s("path", { class: `line ${colour}`, "stroke-dasharray": one.dash || null, d: `M${from},${scales.y(y)}H${to}`, "data-series": one.name }));
    return;
  }
  if (one.line !== false && points.length > 1) {
    const path = line().defined(([, y]) => Number.isFinite(y)).x(([x]) => scales.x(x)).y(([, y]) => scales.y(y));
    svg.append(s("path", { class: `line ${colour}`, "stroke-dasharray": one.dash || null, d: path(points), "data-series": one.name }));
  }
  if (one.line === false || points.length === 1 || one.dots)
    for (const point of points)
      svg.append(s("circle", { class: `dot ${colour}`, cx: scales.x(point[0]), cy: scales.y(point[1]), r: one.size || 5 },
        point[2] ? s("title", null, point[2]) : null));
  if (one.texts) draw_texts(svg, points.filter((p) => p[2]), scales);
}

/** The point of a list in the order of x that is nearest to x. */
function nearest(points, x) {
  let low = 0, high = points.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[middle][0] < x) low = middle;
    else high = middle;
  }
  return points.length ? (Math.abs(points[low][0] - x) <= Math.abs(points[high][0] - x) ? points[low] : points[high]) : null;
}

/**
 * A chart in an element, as wide as that is. update({x, y, series, label}) draws it; x, y: {label, log, from_zero, whole:
 * numbers only without fractions, format}; series: [{name, colour: 1 to 6, points: [[x, y, text]], dash, line: false for
 * dots alone, across: a level over the whole width, gaps: NaN interrupts it, dots, texts, size}], points in the order of x unless line is false;
 * label: what it shows, for screen readers.
 */
export class Chart {
  constructor(element, height = 300) {
    this.element = element;
    this.height = height;
    this.svg = s("svg", { class: "chart", role: "img", "aria-label": "nothing to show yet" });
    this.legend = h("div", { class: "legend" });
    this.readout = h("div", { class: "readout muted", "aria-hidden": "true" });
    this.what = null;
    show(element, this.svg, this.legend, this.readout);
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(element);
    this.svg.addEventListener("pointermove", (event) => this.point(event));
    this.svg.addEventListener("pointerleave", () => this.leave());
  }

  update(what) {
    this.what = what;
    this.draw();
  }

  draw() {
    const width = Math.round(this.element.clientWidth);
    if (!this.what || width < 60) return;
    const { x, y, series, label } = this.what, size = { width, height: this.height };
    this.shown = series.map((one) => ({ one, points: visible(one.points, x.log, y.log, one.gaps) }));
    const all = this.shown.flatMap(({ points }) => points);
    const y_scale = scale_of(y, all.map((p) => p[1]), [this.height - MARGIN.bottom, MARGIN.top]);
    const y_ticks = ticks_of(y_scale, y, Math.max(3, Math.floor(this.height / 34)));
    const left = y_ticks.reduce((most, { text }) => Math.max(most, 28 + DIGIT * text.length), MARGIN.left);
    this.scales = { x: scale_of(x, all.map((p) => p[0]), [left, width - MARGIN.right]), y: y_scale };
    this.svg.setAttribute("viewBox", `0 0 ${width} ${this.height}`);
    this.svg.setAttribute("height", this.height);
    this.svg.setAttribute("aria-label", label);
    show(this.svg);
    draw_axes(this.svg, { x, y }, this.scales, y_ticks, size);
    if (!all.some(([, value]) => Number.isFinite(value))) this.svg.append(s("text", { class: "label", x: width / 2, y: this.height / 2, "text-anchor": "middle" }, "nothing to show yet"));
    const texts_last = [...this.shown].sort((a, b) => Boolean(a.one.texts) - Boolean(b.one.texts));
    for (const { one, points } of texts_last) draw_series(this.svg, one, thin(points, 4 * width), this.scales);
    this.cursor = s("line", { class: "cursor", y1: MARGIN.top, y2: this.height - MARGIN.bottom, visibility: "hidden" });
    this.svg.append(this.cursor);
    show(this.legend, series.map((one) => h("span", { class: "key" },
      s("svg", { width: 26, height: 10, "aria-hidden": "true" }, one.line === false
        ? s("circle", { class: `dot series-${one.colour}`, cx: 13, cy: 5, r: 4 })
        : s("line", { class: `line series-${one.colour}`, x1: 0, x2: 26, y1: 5, y2: 5, "stroke-dasharray": one.dash || null })),
      one.name)));
  }

  point(event) {
    if (!this.shown || this.shown.every(({ one }) => one.line === false)) return;
    const box = this.svg.getBoundingClientRect();
    const [left, right] = this.scales.x.range(), at = Math.min(Math.max(event.clientX - box.left, left), right);
    const x = this.scales.x.invert(at), text_of = ({ format }, value, digits) => (format ? format(value) : number(value, digits));
    this.cursor.setAttribute("x1", at);
    this.cursor.setAttribute("x2", at);
    this.cursor.setAttribute("visibility", "visible");
    const found = this.shown.map(({ one, points }) => [one, nearest(points, x)]).filter(([, point]) => point);
    show(this.readout, found.length ? `${this.what.x.label} ${text_of(this.what.x, found[0][1][0], 4)}: ` +
      found.map(([one, point]) => `${one.name} ${text_of(this.what.y, point[1])}`).join(", ") : "");
  }

  leave() {
    this.cursor?.setAttribute("visibility", "hidden");
    show(this.readout);
  }

  destroy() {
    this.watch.disconnect();
  }
}
