// convergence.js: the convergence history of a job, while it runs and after, with other jobs laid over it.

import { debounce, h, show } from "./dom.js";
import { counted, number, seconds, short_id } from "./format.js";
import { Chart } from "./plot.js";

const QUANTITIES = [
  { key: "error_bound", name: "certified bound", dash: null },
  { key: "residual_total", name: "total residual", dash: "6 3" },
  { key: "dual_objective", name: "dual objective, distance to the last", dash: "2 3" },
];
const LEVELS = { quick: 1e-2, precise: 1e-8 }; // what these say as a relative error; the others depend on the problem
const MOST_OVERLAYS = 5;
const MANY = 30; // iterations: then their axis is logarithmic unless one chooses

/** The history of one job, as far as it has been fetched. */
class History {
  constructor(api, id, name, case_name) {
    Object.assign(this, { api, id, name, case_name, rows: [], at: {} });
  }

  /** Fetches what is new; whether there was something. */
  async more(signal) {
    const query = new URLSearchParams();
    if (this.rows.length) query.set("after", this.rows[this.rows.length - 1][0]);
    if (this.case_name) query.set("case", this.case_name);
    const got = await this.api.get(`/v1/jobs/${this.id}/history?${query}`, { signal });
    got.columns.forEach((name, i) => (this.at[name] = i));
    const last = this.rows[this.rows.length - 1]?.[0] ?? -1; // a second answer to the same question may have come meanwhile
    const fresh = got.rows.filter((row) => row[0] > last);
    this.rows.push(...fresh);
    return fresh.length > 0;
  }

  points(quantity, x) {
    const xs = this.at[x], ys = this.at[quantity];
    if (quantity !== "dual_objective") return this.rows.map((row) => [row[xs], row[ys]]);
    const last = this.rows[this.rows.length - 1]?.[ys] ?? 0;
    return this.rows.slice(0, -1).map((row) => [row[xs], Math.abs(last - row[ys])]);
  }

  /** ||u||_K as the energy of a row tells it: what a relative error is relative to. */
  scale(row) {
    return Math.sqrt(2 * Math.abs(row[this.at.dual_objective]));
  }

  /**
   * {relative: the bound of the last row, left: seconds until it is the error that was asked for, by the slope of its
   * logarithm over the last half of the rows; NaN: unknown}, null before there is a row.
   */
  outlook(asked) {
    const { at, rows } = this, last = rows[rows.length - 1];
    if (!last) return null;
    const relative = last[at.error_bound] / this.scale(last), first = rows[Math.floor(rows.length / 2)];
    const seconds = last[at.seconds] - first[at.seconds], fallen = Math.log(first[at.error_bound] / last[at.error_bound]);
    const known = asked > 0 && rows.length >= 8 && seconds > 0.2 && fallen > 0;
    return { relative, left: known ? Math.max(0, (Math.log(relative / asked) * seconds) / fallen) : NaN };
  }

  restarts(x) {
    return this.rows.filter((row) => row[this.at.restart]).map((row) => [row[this.at[x]], row[this.at.error_bound]]);
  }
}

/** The relative error that a request asks for, where it is a number beforehand; null: it is none. */
export function asked_of({ solver } = {}) {
  const { accuracy } = solver || {};
  if (solver?.stopping === "paper") return null;
  return accuracy === undefined ? LEVELS.precise : LEVELS[accuracy] ?? accuracy?.relative_error ?? null;
}

function choices(name, options, on_change) {
  return h("fieldset", { class: "choices" }, h("legend", null, name), options.map(([value, text, checked, type = "radio"]) =>
    h("label", null, h("input", { type, name, value, checked, onchange: on_change }), text)));
}

export class Convergence {
  /** others: async () => jobs that may be laid over it. */
  constructor(element, api, id, case_name, others) {
    this.api = api;
    this.histories = [new History(api, id, "this job", case_name)];
    this.others = others;
    this.ends = new AbortController();
    this.place = h("div");
    this.said = h("p", { class: "muted", role: "status" });
    this.trouble = h("p", { class: "bad", role: "alert", hidden: true });
    this.form = h("form", { class: "choose", onsubmit: (event) => event.preventDefault() },
      choices("across", [["iteration", "iterations", true], ["seconds", "seconds"]], () => this.draw()),
      choices("axis", [["log", "logarithmic", false, "checkbox"]], () => {
        this.axis_chosen = true;
        this.draw();
      }),
      choices("show", QUANTITIES.map((q) => [q.key, q.name.split(",")[0], true, "checkbox"]), () => this.draw()),
      this.overlay_field());
    show(element, this.place, this.said, this.form, this.trouble);
    this.chart = new Chart(this.place, 320);
    this.draw_soon = debounce(() => this.draw(), 30);
  }

  /** What was asked for, as a relative error: a line in the picture. */
  set_asked(asked) {
    this.asked = asked;
    this.draw();
  }

  outlook() {
    return this.histories[0].outlook(this.asked);
  }

  overlay_field() {
    const list = h("datalist", { id: "overlay-jobs" });
    const field = h("input", { id: "overlay", list: "overlay-jobs", placeholder: "id of another job", autocomplete: "off", spellcheck: "false", size: 34 });
    field.addEventListener("focus", async () => {
      const jobs = await this.others().catch(() => []);
      show(list, jobs.map((job) => h("option", { value: job.id }, `${job.summary?.method || ""} ${job.tags.join(" ")}`)));
    }, { once: true });
    const add = async () => {
      if (await this.overlay(field.value.trim())) field.value = "";
    };
    field.addEventListener("keydown", (event) => event.key === "Enter" && add());
    this.overlays = h("span", { class: "overlays" });
    return h("div", { class: "overlay" }, h("label", { for: "overlay" }, "Lay over it"), field, list,
      h("button", { type: "button", id: "overlay-add", class: "small", onclick: add }, "Add"), this.overlays);
  }

  async overlay(id) {
    this.trouble.hidden = true;
    if (!/^[0-9a-f]{32}$/.test(id) || this.histories.some((one) => one.id === id)) return this.complain("Give the id of another job: 32 digits and letters a to f.");
    if (this.histories.length > MOST_OVERLAYS) return this.complain(`At most ${MOST_OVERLAYS} jobs are laid over it.`);
    try {
      const job = await this.api.get(`/v1/jobs/${id}`, { signal: this.ends.signal });
      const method = job.summary ? job.summary.method.replace(/_/g, " ") : "";
      const history = new History(this.api, id, `${job.name || short_id(id)} ${method}`.trim());
      await history.more(this.ends.signal);
      this.histories.push(history);
    } catch (error) {
      return this.complain(error.message);
    }
    this.draw();
    return true;
  }

  complain(text) {
    this.trouble.hidden = false;
    show(this.trouble, text);
    return false;
  }

  remove(history) {
    this.histories = this.histories.filter((one) => one !== history);
    this.draw();
  }

  /** Fetches the rows that are new and draws. */
  async refresh() {
    if (await this.histories[0].more(this.ends.signal)) this.draw_soon();
    else if (!this.chart.what) this.draw();
  }

  draw() {
    const last = this.histories[0].rows[this.histories[0].rows.length - 1]?.[0] ?? 0;
    if (!this.axis_chosen) this.form.elements.axis.checked = last >= MANY;
    const data = new FormData(this.form), x = data.get("across"), log = data.has("axis");
    const shown = QUANTITIES.filter((q) => data.getAll("show").includes(q.key)), several = this.histories.length > 1;
    const series = [];
    this.histories.forEach((history, i) => shown.forEach((q) => series.push({
      name: several ? `${history.name}: ${q.name}` : q.name, dash: several ? q.dash : null,
      colour: several ? i + 1 : QUANTITIES.indexOf(q) + 1, points: history.points(q.key, x),
    })));
    const restarts = this.histories[0].restarts(x);
    if (restarts.length && !several && data.getAll("show").includes("error_bound"))
      series.push({ name: "restart of the momentum", colour: 6, line: false, size: 3, points: restarts });
    const rows = this.histories[0].rows;
    const level = this.asked * this.histories[0].scale(rows[rows.length - 1] || []);
    if (level > 0 && !several && data.getAll("show").includes("error_bound"))
      series.push({ name: `asked for: a relative error of ${number(this.asked)}`, colour: 5, dash: "6 3", across: true, points: [[rows[rows.length - 1][this.histories[0].at[x]], level]] });
    const label = x === "seconds" ? "time" : "iteration";
    this.chart.update({ x: { label, log, from_zero: true, whole: x !== "seconds", format: x === "seconds" ? seconds : null }, y: { label: "in the units of the problem", log: true }, series,
      label: `Convergence over ${label === "time" ? label : "iterations"}: ${shown.map((q) => q.name).join(", ")}` });
    show(this.said, rows.length ? `${counted(last, "iteration")}, ${counted(rows[rows.length - 1][this.histories[0].at.contacts], "contact")} active in the last.`
      : "There is no history: no iteration was needed, or none was made yet.");
    show(this.overlays, this.histories.slice(1).map((history) =>
      h("button", { type: "button", class: "small", "aria-label": `Remove ${history.name}`, onclick: () => this.remove(history) }, `${history.name} ✕`)));
  }

  destroy() {
    this.ends.abort();
    this.draw_soon.cancel();
    this.chart.destroy();
  }
}
