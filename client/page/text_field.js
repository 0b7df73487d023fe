// text_field.js: a field for JSON text with line numbers and marked places.

import { h, show } from "./dom.js";
import { place_of } from "./json_locate.js";

const TAB = 4;

/** Columns that the characters of a line up to `column` take. */
function width_of(line, column) {
  let width = 0;
  for (const char of line.slice(0, column)) width += char === "\t" ? TAB - (width % TAB) : 1;
  return width;
}

/** on_input(text) after each change. */
export class TextField {
  constructor({ label, id, described_by, on_input }) {
    this.area = h("textarea", { id, class: "code", spellcheck: "false", autocomplete: "off", autocapitalize: "off", wrap: "off",
      "aria-label": label, "aria-describedby": described_by });
    this.gutter = h("div", { class: "gutter", "aria-hidden": "true" });
    this.layer = h("div", { class: "marks", "aria-hidden": "true" });
    this.element = h("div", { class: "text-field" }, this.gutter, h("div", { class: "paper" }, this.layer, this.area));
    this.lines = 0;
    this.area.addEventListener("input", () => {
      this.number();
      on_input(this.text);
    });
    this.area.addEventListener("scroll", () => this.follow(), { passive: true });
  }

  get text() {
    return this.area.value;
  }

  set text(value) {
    this.area.value = value;
    this.area.scrollTop = this.area.scrollLeft = 0;
    this.number();
    this.unmark();
    this.follow();
  }

  number() {
    const lines = this.text.split("\n").length;
    if (lines === this.lines) return;
    this.lines = lines;
    show(this.gutter, h("pre", null, Array.from({ length: lines }, (_, i) => i + 1).join("\n")));
    this.follow();
  }

  follow() {
    const { scrollTop, scrollLeft } = this.area;
    this.layer.style.transform = `translate(${-scrollLeft}px, ${-scrollTop}px)`;
    if (this.gutter.firstChild) for (const child of this.gutter.children) child.style.transform = `translateY(${-scrollTop}px)`;
  }

  /** Marks [from, to) beside what is marked, and says where that is: {line, column} from 1. reveal: also scrolls there. */
  mark([from, to], reveal) {
    const start = place_of(this.text, from), line = this.text.split("\n")[start.line];
    const left = width_of(line, start.column), end = width_of(line, Math.min(line.length, start.column + Math.max(1, to - from)));
    const marker = h("div", { class: "marker" }), bad_line = h("div", { class: "bad-line" });
    marker.style.top = `calc(${start.line} * var(--line-height))`;
    marker.style.left = `${left}ch`;
    marker.style.width = `${Math.max(1, end - left)}ch`;
    bad_line.style.top = `calc(${start.line} * var(--line-height) + .5rem)`;
    this.layer.append(marker);
    this.gutter.append(bad_line);
    this.follow();
    this.area.setAttribute("aria-invalid", "true");
    if (reveal) this.reveal(start.line);
    return { line: start.line + 1, column: start.column + 1 };
  }

  reveal(line) {
    const height = parseFloat(getComputedStyle(this.area).lineHeight);
    const top = line * height;
    if (top < this.area.scrollTop || top > this.area.scrollTop + this.area.clientHeight - 2 * height)
      this.area.scrollTop = Math.max(0, top - this.area.clientHeight / 3);
  }

  unmark() {
    this.layer.replaceChildren();
    for (const one of this.gutter.querySelectorAll(".bad-line")) one.remove();
    this.area.removeAttribute("aria-invalid");
  }

  /** Puts the caret at an offset. */
  put_caret(at) {
    this.area.focus();
    this.area.setSelectionRange(at, at);
  }
}
