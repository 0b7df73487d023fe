// whole_error.js: what the whole error cost where the mesh was chosen: grid by grid, over unknowns or seconds.

import { h, show } from "./dom.js";
import { count, percent_up, seconds } from "./format.js";
import { Chart } from "./plot.js";

/** [{d, seconds since the beginning, error}] */
function points_of(ladder) {
  let spent = 0;
  return ladder.map((one) => ({ d: one.d, at: (spent += one.seconds || 0), error: one.error }));
}

function choices(on_change) {
  return h("fieldset", { class: "choices" }, h("legend", null, "over"), [["d", "unknowns", true], ["at", "seconds", false]].map(([value, text, checked]) =>
    h("label", null, h("input", { type: "radio", name: "over", value, checked, onchange: on_change }), text)));
}

function table_of(ladder, what) {
  return h("details", null, h("summary", null, `All ${ladder.length} grids`), h("table", { class: "grids" },
    h("thead", null, h("tr", null, ["Elements", "Unknowns", what, "Seconds"].map((name) => h("th", { scope: "col" }, name)))),
    h("tbody", null, ladder.map((one) => h("tr", null, h("td", null, one.cells ? one.cells.join(" × ") : count(one.elements)),
      h("td", null, count(one.d)), h("td", null, percent_up(one.error)), h("td", null, seconds(one.seconds)))))));
}

/** Draws the grids of a summary in an element; returns what ends it, null where there are none. */
export function show_whole_error(element, summary) {
  const ladder = summary.mesh?.ladder?.filter((one) => Number.isFinite(one.error)) || [];
  if (!ladder.length) return null;
  const asked = summary.requested_error, points = points_of(ladder), last = points[points.length - 1];
  const of_quantity = summary.quantities?.length > 0 && !Number.isFinite(summary.total_error);
  const what = of_quantity ? `Error of ${summary.quantities[0].name}` : "Whole error";
  const kind = (of_quantity ? summary.quantities[0] : summary.error)?.kind || "estimated";
  const place = h("div"), form = h("form", { class: "choose", onsubmit: (event) => event.preventDefault() }, choices(() => draw()));
  show(element, h("h2", null, `${what} and its price`), place,
    h("p", { class: "muted" }, `${percent_up(last.error)}, ${kind}, on ${count(last.d)} unknowns after ${seconds(last.at)} of all grids together.`),
    form, table_of(ladder, what));
  const chart = new Chart(place, 260);
  function draw() {
    const key = new FormData(form).get("over"), x = key === "d" ? { label: "unknowns", log: true } : { label: "time", log: true, format: seconds };
    const line = points.map((one) => [one[key], one.error]).sort((a, b) => a[0] - b[0]);
    const series = [{ name: `${what.toLowerCase()}, ${kind}`, colour: 1, dots: true, size: 4, points: line }];
    if (asked > 0) series.push({ name: "asked for", colour: 2, dash: "6 3", across: true, points: [[line[0][0], asked]] });
    chart.update({ x, y: { label: "relative error", log: true, format: percent_up }, series,
      label: `${what} of ${ladder.length} grids over ${x.label}, from ${percent_up(points[0].error)} to ${percent_up(last.error)}` });
  }
  draw();
  return () => chart.destroy();
}
