// timings.js: where the time of a job went, as one bar.

import { h } from "./dom.js";
import { seconds } from "./format.js";

const PHASES = [
  ["queue", "waiting"], ["parse", "reading"], ["assemble", "assembly"], ["order", "ordering"], ["factor", "factorization"],
  ["condense", "condensation"], ["iterate", "iterations"], ["certify", "certificate"],
];

/** The bar and its key; a phase that took nothing is left out. */
export function timings_bar(timings) {
  const parts = PHASES.map(([key, name], i) => ({ name, time: timings[key] || 0, tone: i + 1 })).filter((part) => part.time > 0);
  const known = parts.reduce((sum, part) => sum + part.time, 0);
  const rest = (timings.total || 0) - known;
  if (rest > 0.005 * timings.total) parts.push({ name: "storing and other", time: rest, tone: 9 });
  const whole = Math.max(known + Math.max(rest, 0), 1e-12);
  const bar = h("div", { class: "timings", "aria-hidden": "true" });
  for (const part of parts) {
    const piece = h("span", { class: `piece tone-${part.tone}`, title: `${part.name}: ${seconds(part.time)}` });
    piece.style.flexGrow = part.time / whole;
    bar.append(piece);
  }
  return h("div", null, bar, h("ul", { class: "timing-keys", "aria-label": `Timings, ${seconds(timings.total)} in all` }, parts.map((part) =>
    h("li", null, h("span", { class: `swatch tone-${part.tone}`, "aria-hidden": "true" }), `${part.name} `,
      h("strong", null, seconds(part.time)), h("span", { class: "muted" }, ` ${Math.round((100 * part.time) / whole)} %`)))));
}
