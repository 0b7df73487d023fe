// compare.js: one body solved at the four accuracies, side by side: time against certified error. The four jobs share a
// tag, by which they are found again; they run one after another, so that none takes time from another.

import { idempotency_key } from "./api.js";
import { h, pause, show } from "./dom.js";
import { draft, EXAMPLES, example_text } from "./examples.js";
import { count, percent, percent_up, seconds, short_id } from "./format.js";
import { locate } from "./json_locate.js";
import { status_chip } from "./list.js";
import { Chart } from "./plot.js";
import { has_ended } from "./words.js";

const LEVELS = ["quick", "balanced", "precise", "exact"];
const SET_UP = ["assemble", "order", "factor", "condense"];

let to_submit = null; // {tag, request} of the comparison that was asked for

/** The request of one level: the same body, stopped by the certificate. */
function request_of(request, level, tag) {
  const { stopping, epsilon, ...solver } = request.solver || {};
  const accuracy = level === "balanced" && request.problem?.kind === "matrices" ? { relative_error: 1e-4 } : level;
  return { ...request, solver: { ...solver, accuracy }, tags: [tag, `level-${level}`] };
}

function level_of(job) {
  return LEVELS.find((level) => job.tags.includes(`level-${level}`));
}

/** Seconds of what differs between the accuracies, and of what only the first job of a body pays for. */
function times_of(job) {
  const t = job.summary?.timings_s || {};
  return { solve: (t.iterate || 0) + (t.certify || 0), set_up: SET_UP.reduce((sum, key) => sum + (t[key] || 0), 0), total: t.total };
}

class Comparison {
  constructor(element, api, tag) {
    Object.assign(this, { api, tag, jobs: new Map(), ends: new AbortController(), curve: null });
    this.said = h("p", { class: "muted", role: "status" });
    this.trouble = h("p", { class: "bad", role: "alert", hidden: true });
    this.place = h("div", { id: "trade" });
    this.table = h("div", { class: "scrolled" });
    show(element, this.said, this.trouble, h("div", { class: "card" }, h("h2", null, "Time against certified error"), this.place,
      h("p", { class: "muted" }, "The time is that of iterations and certificate. What the body takes once, assembly and factorization, stands in the table: the first job pays for it, and the others find it in the cache.")),
    this.table);
    this.chart = new Chart(this.place, 340);
  }

  async load() {
    const { jobs } = await this.api.get(`/v1/jobs?tag=${encodeURIComponent(this.tag)}&limit=20`, { signal: this.ends.signal });
    for (const job of jobs.reverse()) if (level_of(job)) this.jobs.set(level_of(job), job);
  }

  async submit(request) {
    for (const level of LEVELS) {
      if (this.jobs.has(level)) continue;
      const text = JSON.stringify(request_of(request, level, this.tag));
      const job = await this.api.post("/v1/jobs", text, { signal: this.ends.signal, headers: { "Idempotency-Key": `${this.tag}-${level}` } });
      await this.await_job(level, job);
    }
  }

  async await_job(level, job) {
    for (let ms = 60; ; ms = Math.min(1000, 1.5 * ms)) {
      this.jobs.set(level, job);
      this.draw();
      if (has_ended(job)) return;
      await pause(ms, this.ends.signal);
      job = await this.api.get(`/v1/jobs/${job.id}`, { signal: this.ends.signal });
    }
  }

  async run(request) {
    try {
      await this.load();
      this.draw();
      if (request) await this.submit(request);
      for (const [level, job] of this.jobs) if (!has_ended(job)) await this.await_job(level, job);
      await this.load_curve();
      this.draw();
    } catch (error) {
      if (this.ends.signal.aborted) return;
      this.trouble.hidden = false;
      show(this.trouble, error.message);
    }
  }

  /** When each decade was certified, from the run of the tightest level, where the service says so. */
  async load_curve() {
    const job = this.jobs.get("exact") || this.jobs.get("precise");
    if (!job?.summary || job.summary.cases) return;
    try {
      if (!(await this.api.offers("/v1/jobs/{id}/work-precision"))) return;
      const got = await this.api.get(`/v1/jobs/${job.id}/work-precision`, { signal: this.ends.signal });
      this.curve = (got.decades || []).filter((one) => one.seconds > 0).map((one) => [one.seconds, one.relative_error]).sort((a, b) => a[0] - b[0]);
    } catch (error) {
      if (error.status !== 404 && error.status !== 409) throw error; // 409: none was recorded
    }
  }

  draw() {
    const known = LEVELS.filter((level) => this.jobs.has(level));
    const ended = known.filter((level) => has_ended(this.jobs.get(level)));
    const solved = ended.filter((level) => this.jobs.get(level).status === "successful");
    show(this.said, solved.length === LEVELS.length ? "All four are solved." : known.length ? `${solved.length} of ${LEVELS.length} are solved.` : "There are no jobs of this comparison.");
    const points = ended.map((level) => {
      const job = this.jobs.get(level);
      return [times_of(job).solve, job.summary?.certificate?.relative_error, level];
    });
    const mesh = ended.map((level) => this.jobs.get(level).summary?.discretization_error).find((value) => value > 0);
    const series = [{ name: "the four jobs", colour: 1, line: false, texts: true, size: 6, points }];
    if (this.curve?.length) series.push({ name: "within the run of the tightest", colour: 3, dots: true, size: 2.5, points: this.curve });
    if (mesh && points.length > 1) series.push({ name: "error of the mesh, estimated", colour: 2, dash: "6 3", across: true, points: [[points[0][0], mesh]] });
    this.chart.update({ x: { label: "time", log: true, format: seconds }, y: { label: "certified relative error", log: true }, series,
      label: `Time against certified error: ${points.map(([time, error, level]) => `${level} ${seconds(time)}, ${percent_up(error)}`).join("; ")}` });
    show(this.table, this.table_of(known));
  }

  table_of(known) {
    const cells = (level) => {
      const job = this.jobs.get(level), summary = job.summary, times = times_of(job);
      return h("tr", null, h("th", { scope: "row" }, level), h("td", null, h("a", { href: `#/jobs/${job.id}` }, short_id(job.id))),
        h("td", null, status_chip(job.status, summary?.outcome)),
        h("td", { class: "number" }, summary ? percent_up(summary.certificate?.relative_error) : ""),
        h("td", { class: "number" }, summary ? count(summary.iterations) : ""),
        h("td", { class: "number" }, summary ? seconds(times.solve) : ""),
        h("td", { class: "number" }, summary ? seconds(times.set_up) : ""),
        h("td", { class: "number" }, summary ? seconds(times.total) : ""));
    };
    const heads = [["Accuracy"], ["Job"], ["Status"], ["Error, at most", 1], ["Iterations", 1], ["Solve", 1], ["Set up", 1], ["Total", 1]];
    return known.length ? h("table", { id: "trade-table" }, h("caption", { class: "unseen" }, "The four jobs"),
      h("thead", null, h("tr", null, heads.map(([name, right]) => h("th", { scope: "col", class: right ? "number" : null }, name)))),
      h("tbody", null, known.map(cells))) : null;
  }

  destroy() {
    this.ends.abort();
    this.chart.destroy();
  }
}

/** The choice of a body. */
function chooser(on_start) {
  const options = [...EXAMPLES.map((one) => [one.name, one.text]), ...(draft.get() ? [["draft", "What stands in the editor"]] : [])];
  const select = h("select", { id: "compare-what" }, options.map(([value, text]) => h("option", { value }, text)));
  const trouble = h("p", { class: "bad", role: "alert", hidden: true });
  const complain = (text) => {
    trouble.hidden = false;
    show(trouble, text);
  };
  const start = async (event) => {
    event.preventDefault();
    button.disabled = true; // a second press would make four more jobs
    try {
      const text = select.value === "draft" ? draft.get() : await example_text(select.value);
      const { mistake } = locate(text);
      if (mistake) complain(`What stands in the editor is not JSON: ${mistake.message}.`);
      else if (form.isConnected) on_start(JSON.parse(text));
    } catch (error) {
      complain(error.message);
    }
    button.disabled = false;
  };
  const button = h("button", { type: "submit", class: "primary", id: "compare-start" }, "Solve at all four accuracies");
  const form = h("form", { class: "editor-tools", onsubmit: start }, h("label", { for: "compare-what" }, "Body"), select,
    button, trouble);
  return form;
}

export function show_compare(main, { api }, tag) {
  const place = h("div", { class: "job-page" });
  show(main, h("div", { class: "title" }, h("h1", null, "Compare accuracies")),
    h("p", null, "The same body at the four accuracies ", h("em", null, "quick, balanced, precise"), " and ", h("em", null, "exact"), ": what more certainty costs."),
    chooser((request) => {
      to_submit = { tag: `compare-${idempotency_key().slice(-8)}`, request };
      location.hash = `#/compare/${to_submit.tag}`;
    }), place);
  if (!tag) return () => {};
  const comparison = new Comparison(place, api, tag);
  const request = to_submit?.tag === tag ? to_submit.request : null;
  comparison.run(request);
  return () => comparison.destroy();
}
