// cases.js: the load cases of a job as a table to sort, and any of its numbers as a curve over the cases.

import { h, show } from "./dom.js";
import { count, number, percent_up, seconds } from "./format.js";
import { Chart } from "./plot.js";
import { unit_of } from "./units.js";
import { sorted_by } from "./view_order.js";
import { error_of, error_words, state_words } from "./words.js";

const MOST_ROWS = 500, MOST_DOTS = 200;
const at = (path) => (summary) => path.split(".").reduce((value, key) => value?.[key], summary) ?? null;
const force = (axis) => (summary) => summary.contact?.force?.[axis] ?? null;

// [key, heading, value of a summary, what its unit is of, how it is written]
const NUMBERS = [
  ["error", "Whole error", error_of, null, percent_up], ["max_pressure", "Largest pressure", at("contact.max_pressure"), "stress"],
  ["area", "Contact area", at("contact.area"), "area"], ["active", "In contact", at("contact.active"), null, count],
  ["force_x", "Force along x", force(0), "force"], ["force_y", "Force along y", force(1), "force"], ["force_z", "Force along z", force(2), "force"],
  ["reaction_sum", "Sum of reactions", at("contact.reaction_sum"), "force"], ["von_mises", "Largest von Mises", at("stress.von_mises"), "stress"],
  ["safety", "Safety factor", at("stress.safety"), null], ["penetration", "Largest penetration", at("contact.max_penetration"), "length"],
  ["energy", "Energy", at("energy.primal"), "energy"], ["iterations", "Iterations", at("iterations"), null, count],
  ["time", "Iterated for", at("timings_s.iterate"), null, seconds],
];
const IN_TABLE = ["error", "max_pressure", "area", "active", "reaction_sum", "von_mises", "safety"];

/** Numbers asked for by name, quantities of the request, are columns too. */
function columns_of(cases) {
  const named = (cases[0].summary.quantities || []).map(({ name }) => [`quantity ${name}`, name, (summary) => summary.quantities?.find((one) => one.name === name)?.value ?? null, null]);
  return [...NUMBERS, ...named].map(([key, name, value, of, words]) => ({ key, name, value, unit: unit_of(cases[0].summary, of), words: words || ((x) => number(x, 5)) }))
    .filter((column) => cases.some((one) => Number.isFinite(column.value(one.summary))));
}

/** Where a case stands on the axis: the number that its name is or ends with, if all have one; else its number. */
function places_of(cases) {
  const numbers = cases.map((one) => Number(/(-?\d+(?:\.\d*)?(?:e[-+]?\d+)?)$/i.exec(one.name)?.[1] ?? NaN));
  const good = numbers.every(Number.isFinite) && new Set(numbers).size === numbers.length;
  return { label: good ? "number in the name of the case" : "case", values: good ? numbers : cases.map((_, i) => i + 1), whole: !good };
}

/**
 * Fills an element. cases: [{name, summary}] of a result; chosen: name of the one that the page shows; on_choose(name).
 * Returns {mark(name), destroy()}.
 */
export function mountCases(element, cases, chosen, on_choose) {
  const columns = columns_of(cases), table_columns = columns.filter((one) => IN_TABLE.includes(one.key) || one.key.startsWith("quantity "));
  const places = places_of(cases);
  let order = { by: "", up: true }, here = chosen;
  const place = h("div"), table_place = h("div", { class: "scrolled", tabindex: "0", role: "region", "aria-label": "Load cases" });
  const field = h("select", { id: "case-curve", onchange: () => draw_curve() }, columns.map((one) => h("option", { value: one.key }, one.name)));
  field.value = columns.some((one) => one.key === "max_pressure") ? "max_pressure" : columns[0]?.key || "";
  show(element, h("h2", null, `${count(cases.length)} load cases`), h("div", { class: "body-tools" }, h("label", null, "Curve of", field)), place, table_place);
  const chart = new Chart(place, 240);

  function draw_curve() {
    const column = columns.find((one) => one.key === field.value);
    if (!column) return;
    const points = cases.map((one, i) => [places.values[i], column.value(one.summary), one.name]).sort((a, b) => a[0] - b[0]);
    const now = cases.findIndex((one) => one.name === here);
    const series = [{ name: column.name, colour: 1, points, dots: points.length <= MOST_DOTS, size: 3 }];
    if (now >= 0) series.push({ name: here, colour: 2, line: false, size: 6, points: [[places.values[now], column.value(cases[now].summary)]] });
    chart.update({ x: { label: places.label, whole: places.whole, from_zero: false }, y: { label: `${column.name}${column.unit && `,${column.unit}`}`, format: column.words }, series,
      label: `${column.name} of ${cases.length} load cases` });
  }

  function sorted() {
    const column = columns.find((one) => one.key === order.by);
    const key = order.by === "name" ? (one) => one.name : order.by === "outcome" ? (one) => one.summary.outcome : column ? (one) => column.value(one.summary) : null;
    return key ? sorted_by(cases, key, order.up) : cases;
  }

  function heading(key, name, right) {
    const sort = order.by === key ? (order.up ? "ascending" : "descending") : null;
    return h("th", { scope: "col", class: right ? "number" : null, "aria-sort": sort, "data-by": key }, h("button", { type: "button", class: "heading", onclick: () => {
      order = { by: key, up: order.by === key ? !order.up : !right };
      draw_table();
      table_place.querySelector(`[data-by="${CSS.escape(key)}"] button`)?.focus({ preventScroll: true });
    } }, name));
  }

  function draw_table() {
    const list = sorted(), shown = list.slice(0, MOST_ROWS);
    show(table_place, h("table", { id: "cases-table" }, h("caption", { class: list.length > shown.length ? "" : "unseen" }, list.length > shown.length ? `The first ${MOST_ROWS} in this order` : "Load cases"),
      h("thead", null, h("tr", null, heading("name", "Case"), heading("outcome", "Outcome"), table_columns.map((one) => heading(one.key, `${one.name}${one.unit && `,${one.unit}`}`, true)))),
      h("tbody", null, shown.map((one) => h("tr", { class: one.name === here ? "here" : null }, h("th", { scope: "row" },
        h("button", { type: "button", class: "link", "aria-pressed": String(one.name === here), onclick: () => on_choose(one.name) }, one.name)),
      h("td", null, state_words("successful", one.summary.outcome)),
      table_columns.map((column) => h("td", { class: "number" }, column.key === "error" ? error_words(one.summary) : Number.isFinite(column.value(one.summary)) ? column.words(column.value(one.summary)) : "–")))))));
  }

  draw_table();
  draw_curve();
  return {
    mark: (name) => {
      here = name;
      draw_table();
      draw_curve();
    },
    destroy: () => chart.destroy(),
  };
}
