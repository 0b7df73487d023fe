// cases.js: the load cases of a job as a table to sort, and any of its numbers as a curve over the cases.

import { Curve } from "./curve.js";
import { h, show } from "./dom.js";
import { count } from "./format.js";
import { numbers_of } from "./numbers.js";
import { sorted_by } from "./view_order.js";
import { error_words, state_words } from "./words.js";

const MOST_ROWS = 500, MOST_DOTS = 200;
const IN_TABLE = ["part", "displacement", "error", "max_pressure", "area", "active", "reaction_sum", "von_mises", "safety"];

/** Where a case stands on the axis: the number that its name is or ends with, if all have one; else its number. */
function places_of(cases) {
  const numbers = cases.map((one) => Number(/(-?\d+(?:\.\d*)?(?:e[-+]?\d+)?)$/i.exec(one.name)?.[1] ?? NaN));
  const good = numbers.every(Number.isFinite) && new Set(numbers).size === numbers.length;
  return { label: good ? "number in the name of the case" : "case", values: good ? numbers : cases.map((_, i) => i + 1), whole: !good };
}

/** Are the cases points of a path of loads? */
export function is_path(cases) {
  return cases.length > 1 && cases.every((one) => Number.isFinite(one.summary?.finite?.part));
}

/** Of a path the force that changes most along it, by key; else "max_pressure". */
function first_curve(cases, columns) {
  const spread = ({ value }) => {
    const all = cases.map((one) => value(one.summary)).filter(Number.isFinite);
    return Math.max(...all) - Math.min(...all);
  };
  const forces = is_path(cases) ? columns.filter((one) => /^(force|support)_/.test(one.key)) : [];
  return forces.sort((a, b) => spread(b) - spread(a))[0]?.key || (is_path(cases) ? "part" : "max_pressure");
}

/**
 * Fills an element. cases: [{name, summary}] of a result; chosen: name of the one that the page shows; on_choose(name).
 * Returns {mark(name), destroy()}.
 */
export function mountCases(element, cases, chosen, on_choose) {
  const columns = numbers_of(cases.map((one) => one.summary)), table_columns = columns.filter((one) => IN_TABLE.includes(one.key) || one.key.startsWith("quantity "));
  const places = places_of(cases);
  let order = { by: "", up: true }, here = chosen;
  const table_place = h("div", { class: "scrolled", tabindex: "0", role: "region", "aria-label": "Load cases" });
  const over = h("select", { id: "case-over", onchange: () => curve.draw() }, h("option", { value: "" }, places.label), columns.map((one) => h("option", { value: one.key }, one.name)));
  over.value = is_path(cases) ? "displacement" : "";
  const curve = new Curve("case-curve", (column) => {
    const across = columns.find((one) => one.key === over.value), x_of = (i) => (across ? across.value(cases[i].summary) : places.values[i]);
    const points = cases.map((one, i) => [x_of(i), column.value(one.summary), one.name]);
    if (!across) points.sort((a, b) => a[0] - b[0]); // a path may come back
    const now = cases.findIndex((one) => one.name === here);
    const series = [{ name: column.name, colour: 1, points, dots: points.length <= MOST_DOTS, size: 3 }];
    if (now >= 0) series.push({ name: here, colour: 2, line: false, size: 6, points: [[x_of(now), column.value(cases[now].summary)]] });
    const x = across ? { label: `${across.name}${across.unit && `,${across.unit}`}`, format: across.words } : { label: places.label, whole: places.whole };
    return { x: { ...x, from_zero: false }, series, label: `${column.name} of ${cases.length} load cases` };
  });
  show(element, h("h2", null, `${count(cases.length)} load cases`), h("div", { class: "body-tools" }, curve.choice, h("label", null, "over", over)), curve.place, table_place);

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
  curve.take(columns, first_curve(cases, columns));
  return {
    mark: (name) => {
      here = name;
      draw_table();
      curve.draw();
    },
    destroy: () => curve.destroy(),
  };
}
