// curve.js: a curve of one of several numbers, chosen by its name.

import { h } from "./dom.js";
import { Chart } from "./plot.js";

const HEIGHT = 240;

export class Curve {
  /**
   * `choice`, a label with the field, and `place`, which the chart fills, go where they are wanted.
   * id: of the field. draw(column): {x, series, label} of Chart.update for the chosen one of `columns`.
   */
  constructor(id, draw) {
    this.field = h("select", { id, onchange: () => this.draw() });
    this.choice = h("label", null, "Curve of", this.field);
    this.place = h("div");
    this.chart = new Chart(this.place, HEIGHT);
    Object.assign(this, { of: draw, columns: [] });
  }

  /** columns: [{key, name, unit, words}]; the choice stays, or begins with `first`. */
  take(columns, first) {
    const wanted = [this.field.value, first].find((key) => columns.some((one) => one.key === key)) || columns[0]?.key || "";
    this.columns = columns;
    this.field.replaceChildren(...columns.map((one) => h("option", { value: one.key }, one.name)));
    this.field.value = wanted;
    this.draw();
  }

  draw() {
    const column = this.columns.find((one) => one.key === this.field.value);
    if (column) this.chart.update({ ...this.of(column), y: { label: `${column.name}${column.unit && `,${column.unit}`}`, format: column.words } });
  }

  destroy() {
    this.chart.destroy();
  }
}
