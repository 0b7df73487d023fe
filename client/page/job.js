// job.js: one job, live while it waits and runs: progress, convergence, then the answer in words and pictures.

import { is_path, mountCases } from "./cases.js";
import { asked_of, Convergence } from "./convergence.js";
import { announce, h, pause, show } from "./dom.js";
import { download_buttons, files_of } from "./download.js";
import { draft } from "./examples.js";
import { elapsed, moment, number, number_towards, seconds, short_id } from "./format.js";
import { pretty } from "./json_locate.js";
import { status_chip, sure_button } from "./list.js";
import { menu_button } from "./menu.js";
import { show_precision } from "./precision.js";
import { refine_form } from "./refine.js";
import { timings_bar } from "./timings.js";
import { failure_card, numbers_card, verdict_card } from "./verdict.js";
import { show_whole_error } from "./whole_error.js";
import { grid_words, has_ended, state_words, title_of } from "./words.js";

const HISTORY_MS = 700, MOST_CASES = 10000, MOST_TIDIED = 200000;
const MOST_UNASKED = 100000; // unknowns of a body that is drawn before somebody asks for it

class JobView {
  constructor(main, api, id) {
    Object.assign(this, { main, api, id, job: null, case_name: "", cases: [], parts: [] });
    this.ends = new AbortController();
    this.head = h("div", { class: "title" });
    this.trouble = h("p", { class: "bad", role: "alert", hidden: true });
    this.progress = h("section", { class: "progress", "aria-label": "Progress", hidden: true });
    this.case_field = h("div", { class: "cases", hidden: true });
    this.verdict = h("div");
    this.timings = h("section", { "aria-label": "Timings", hidden: true });
    this.convergence_place = h("section", { "aria-label": "Convergence", id: "convergence", hidden: true });
    this.precision = h("section", { "aria-label": "Time against certified error", id: "precision", hidden: true });
    this.whole = h("section", { "aria-label": "Whole error and its price", id: "whole", hidden: true });
    this.body = h("section", { "aria-label": "Body", hidden: true });
    this.numbers = h("section", { "aria-label": "Numbers", hidden: true });
    this.downloads = h("section", { "aria-label": "Downloads", hidden: true });
    this.cases_place = h("section", { "aria-label": "Load cases", id: "cases", hidden: true });
    this.request_place = h("section", { "aria-label": "Request", id: "request" });
    show(main, this.head, this.trouble, this.case_field, h("div", { class: "job-page" }, this.progress, this.verdict, this.body, this.numbers, this.cases_place, this.whole, this.convergence_place,
      this.precision, this.timings, this.request_place, this.downloads));
    this.show_request();
  }

  complain(error) {
    if (error.name === "AbortError" || this.ends.signal.aborted) return;
    this.trouble.hidden = false;
    show(this.trouble, error.status === 404 ? "There is no such job, or it has been deleted." : error.message);
  }

  // ---- what changes while it runs

  show_head() {
    const { job } = this, ended = has_ended(job);
    const refines = job.links.find((link) => link.rel === "refines");
    const end = async () => {
      const now = ended ? null : await this.api.get(`/v1/jobs/${this.id}`);
      if (now && has_ended(now)) return this.take(now); // it ended meanwhile: nobody asked to delete it
      const left = await this.api.remove(`/v1/jobs/${this.id}`);
      if (left) this.take(left);
      else if (!this.ends.signal.aborted) location.hash = "#/";
      return undefined;
    };
    const stop = ended ? menu_button("More about this job", () => [{ label: "Delete", sure: "Delete for good", act: end }], (error) => this.complain(error))
      : sure_button("Cancel", () => end().catch((error) => this.complain(error)));
    stop.id = "stop";
    const again = job.summary?.outcome?.endsWith("verified") ? null
      : h("button", { type: "button", class: "small", id: "edit", onclick: () => this.edit() }, "Edit and resubmit");
    const actions = h("div", { class: "actions" }, again, job.status === "successful" ? refine_form(this.api, job) : null, stop);
    document.title = `${title_of(job)}: ${state_words(job.status, job.summary?.outcome)} · Contact solver`;
    show(this.head, h("h1", { title: this.id }, job.name ? job.name : ["Job ", h("code", null, short_id(this.id))]), status_chip(job.status, job.summary?.outcome),
      h("span", { class: "muted" }, moment(job.created)), job.tags.map((tag) => h("span", { class: "tag" }, tag)),
      refines ? h("a", { href: `#/jobs/${refines.href.split("/").pop()}` }, `refines ${short_id(refines.href.split("/").pop())}`) : null, actions);
  }

  /** What was asked, fetched when somebody looks. */
  show_request() {
    const place = h("pre", { class: "request-text", tabindex: "0", role: "region", "aria-label": "The request in JSON" });
    const details = h("details", { ontoggle: async () => {
      if (!details.open || place.textContent) return;
      try {
        const text = await this.api.text(`/v1/jobs/${this.id}/request`, { signal: this.ends.signal });
        place.textContent = text.length > MOST_TIDIED ? `${text.slice(0, MOST_TIDIED)}\n… (${text.length} characters: see Downloads)` : pretty(JSON.parse(text));
      } catch (error) {
        this.complain(error);
      }
    } }, h("summary", null, "Request: what was asked"), place);
    show(this.request_place, details);
  }

  /** The job's request goes into the editor. */
  async edit() {
    try {
      const text = await this.api.text(`/v1/jobs/${this.id}/request`, { signal: this.ends.signal });
      draft.set(text.trim().includes("\n") || text.length > MOST_TIDIED ? text : pretty(JSON.parse(text)));
      location.hash = "#/new";
    } catch (error) {
      this.complain(error);
    }
  }

  show_progress(row) {
    const { job } = this;
    this.progress.hidden = has_ended(job);
    if (this.progress.hidden) return;
    const words = [job.status === "running" ? `running for ${seconds(elapsed(job.started))}` : "waiting for its turn"];
    const grid = grid_words(row ? row.grid : job.grid);
    if (grid) words.push(grid);
    if (row?.iteration !== undefined && row.iteration !== null) words.push(`iteration ${number(row.iteration, 9)}`);
    if (Number.isFinite(row?.error_bound)) words.push(`certified bound ${number_towards(row.error_bound, 3, 1)}`);
    const outlook = !grid && this.convergence?.outlook();
    if (outlook && Number.isFinite(outlook.relative))
      words.push(`relative ${number(outlook.relative, 2)}${this.asked ? ` of the ${number(this.asked)} asked for` : ""}`, `time left ${Number.isFinite(outlook.left) ? `about ${seconds(outlook.left)}` : "unknown"}`);
    if (Number.isFinite(row?.residual_total)) words.push(`residual ${number(row.residual_total)}`);
    show(this.progress, h("progress", { value: job.progress, max: 100, "aria-label": "Progress" }), h("span", { id: "progress-text" }, words.join(", ")));
  }

  /** A status came. What has ended does not run again: an answer that says so was overtaken. */
  take(job) {
    if (this.job && has_ended(this.job) && !has_ended(job)) return;
    const first = !this.job, changed = first || this.job.status !== job.status;
    this.job = job;
    if (changed) {
      this.show_head();
      if (!first) announce(`Job ${job.status}`);
    }
    this.show_progress(null);
    if (has_ended(job) && changed) this.finish();
    else if (job.status === "running" && changed) this.start_convergence();
  }

  // ---- convergence

  start_convergence() {
    if (this.convergence) return;
    this.convergence_place.hidden = false;
    const place = h("div");
    show(this.convergence_place, h("h2", null, "Convergence"), place);
    this.convergence = new Convergence(place, this.api, this.id, this.case_name, async () =>
      (await this.api.get("/v1/jobs?status=successful&limit=20")).jobs.filter((job) => job.id !== this.id && !job.summary?.cases));
    if (this.job.status === "running") this.find_asked();
  }

  /** The line that the bound must reach. */
  async find_asked() {
    try {
      this.asked = asked_of(await this.api.get(`/v1/jobs/${this.id}/request`, { signal: this.ends.signal }));
      this.convergence?.set_asked(this.asked);
    } catch (error) {
      this.complain(error);
    }
  }

  async refresh_convergence() {
    try {
      await this.convergence?.refresh();
    } catch (error) {
      if (error.status !== 404 && error.problem?.code !== "case_needed") this.complain(error);
    }
  }

  // ---- when it has ended

  async finish() {
    const { job } = this;
    this.parts.splice(0).forEach((end) => end());
    this.progress.hidden = true;
    if (job.summary?.cases && !this.cases.length) await this.load_cases().catch((error) => this.complain(error));
    show(this.verdict, job.status === "failed" ? failure_card(job) : this.summary() ? verdict_card(this.summary())
      : h("p", { class: "muted" }, "It was stopped before there was an answer."));
    this.numbers.hidden = !this.summary();
    if (this.summary()) show(this.numbers, numbers_card(this.summary()));
    if (this.summary()?.timings_s) {
      this.timings.hidden = false;
      show(this.timings, h("h2", null, `Where ${seconds(this.summary().timings_s.total)} went`), timings_bar(this.summary().timings_s));
    }
    if (job.status === "successful" && job.summary?.outcome !== "verified" && job.summary?.outcome !== "not_verified") {
      this.start_convergence();
      this.refresh_convergence();
      this.show_precision();
    }
    const whole = this.summary() ? show_whole_error(this.whole, this.summary()) : null;
    this.whole.hidden = !whole;
    if (whole) this.parts.push(whole);
    if (job.status === "successful" && job.summary?.problem?.kind === "scene") this.show_body();
    this.downloads.hidden = false;
    show(this.downloads, h("h2", null, "Downloads"), download_buttons(this.api, await files_of(this.api, job, this.case_name), (error) => this.complain(error)));
  }

  summary() {
    return this.cases.find((one) => one.name === this.case_name)?.summary || this.job.summary;
  }

  async load_cases() {
    const got = await this.api.get(`/v1/jobs/${this.id}/result?fields=summary`, { signal: this.ends.signal });
    this.cases = (got.cases || []).slice(0, MOST_CASES);
    if (!this.cases.length) return;
    this.case_name = this.job.summary.cases.worst;
    const select = h("select", { id: "case", onchange: () => this.choose_case(select.value) },
      this.cases.map((one) => h("option", { value: one.name }, one.name)));
    select.value = this.case_name;
    this.case_field.hidden = false;
    show(this.case_field, h("label", { for: "case" }, `Load case, of ${this.cases.length}`), select,
      h("span", { class: "muted" }, `The worst is ${this.case_name}.`));
    this.cases_place.hidden = false;
    this.case_table = mountCases(this.cases_place, this.cases, this.case_name, (name) => {
      select.value = name;
      this.choose_case(name);
    });
    this.convergence?.destroy();
    this.convergence = null;
  }

  choose_case(name) {
    this.case_name = name;
    this.case_table?.mark(name);
    this.convergence?.destroy();
    this.convergence = null;
    this.finish();
  }

  async show_precision() {
    const name = this.case_name, place = h("div");
    this.precision.hidden = true;
    try {
      if (!(await this.api.offers("/v1/jobs/{id}/work-precision"))) return;
      const end = await show_precision(place, this.api, this.id, name, this.ends.signal);
      if (name !== this.case_name) return end?.(); // another load case was chosen meanwhile
      show(this.precision, place);
      this.precision.hidden = !end;
      if (end) this.parts.push(end);
    } catch (error) {
      if (error.status !== 404 && error.status !== 409) this.complain(error); // 409: none was recorded
    }
  }

  /** By code that is loaded then; a large one when it is asked for. */
  show_body() {
    const place = h("div", { class: "body", id: "body" });
    const open = h("button", { type: "button", id: "open-body", class: "primary", onclick: async () => {
      open.disabled = true;
      try {
        const { mountBody } = await import("./body.js");
        const body = await mountBody(place, this.api, this.id, { cases: this.cases.map((one) => one.name), case: this.case_name, path: is_path(this.cases),
          units: this.summary().problem.units });
        if (place.isConnected) this.parts.push(() => body.destroy());
        else body.destroy(); // another load case or view meanwhile
      } catch (error) {
        open.disabled = false;
        this.complain(error);
      }
    } }, "Show the deformed body");
    this.body.hidden = false;
    show(place, open);
    show(this.body, h("h2", null, "Body"), place);
    if (this.summary().problem.d <= MOST_UNASKED) open.click();
  }

  // ---- the loop

  async follow_stream() {
    let fetched = 0;
    await this.api.stream(`/v1/jobs/${this.id}/events`, { signal: this.ends.signal, on_event: ({ event, data }) => {
      const value = JSON.parse(data);
      if (event === "status") this.take(value);
      if (event !== "progress") return;
      this.job.progress = value.progress;
      this.show_progress(value);
      if (performance.now() - fetched > HISTORY_MS) {
        fetched = performance.now();
        this.refresh_convergence();
      }
    } });
  }

  async run() {
    const { signal } = this.ends;
    let streams = true, pauses = 1;
    while (!signal.aborted) {
      try {
        this.take(await this.api.get(`/v1/jobs/${this.id}`, { signal }));
        if (has_ended(this.job)) return;
        if (streams) await this.follow_stream();
        else this.refresh_convergence();
        this.trouble.hidden = true;
      } catch (error) {
        if (error.status === 503) streams = false;
        else this.complain(error);
        if (error.status && error.status < 500 && error.status !== 429) return;
      }
      if (this.job && has_ended(this.job)) return;
      await pause(Math.min(5000, 500 * pauses++), signal).catch(() => {});
    }
  }

  destroy() {
    this.ends.abort();
    this.convergence?.destroy();
    this.case_table?.destroy();
    this.parts.forEach((end) => end());
  }
}

export function show_job(main, { api }, id) {
  const view = new JobView(main, api, id);
  view.run();
  return () => view.destroy();
}
