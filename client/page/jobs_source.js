// jobs_source.js: the jobs of the list: pages by cursor as far as they are looked at, and what changes meanwhile, from
// GET /v1/events or, where the service has no such stream, by asking again.

import { pause } from "./dom.js";
import { error_of, has_ended, result_words, state_words, title_of } from "./words.js";

const FIRST = 100, PAGE = 500, POLL_MS = 2000;

/** What the list keeps of a job: a summary is some kilobytes, and there may be many thousand jobs. */
function slim(job) {
  const summary = job.summary || {};
  return {
    id: job.id, name: job.name || "", title: title_of(job), status: job.status, progress: job.progress, created: job.created, tags: job.tags,
    ended: has_ended(job), state: state_words(job.status, summary.outcome), result: result_words(job), error: error_of(job.summary), total: summary.timings_s?.total ?? null, outcome: summary.outcome || null,
    d: summary.problem?.d ?? null, m: summary.problem?.m ?? null, kind: summary.problem?.kind ?? null,
  };
}

/**
 * filter: {status, tags: []}. on_change({inserted}) after jobs came, changed or went; inserted: how many at the top.
 * on_state("stream" | "poll" | "offline").
 */
export class JobsSource {
  constructor(api, filter, { on_change, on_state }) {
    Object.assign(this, { api, filter, on_change, on_state });
    this.rows = []; // newest first
    this.by_id = new Map();
    this.next = undefined; // cursor of the next page; null: none follow
    this.loading = null;
    this.pending = 0; // pages on their way
    this.late = []; // changes that came meanwhile
    this.ends = new AbortController();
  }

  query(more) {
    const query = new URLSearchParams({ limit: String(more.cursor ? PAGE : FIRST), ...more });
    if (this.filter.status) query.set("status", this.filter.status);
    for (const tag of this.filter.tags) query.append("tag", tag);
    return `/v1/jobs?${query}`;
  }

  matches(job) {
    return (!this.filter.status || job.status === this.filter.status) && this.filter.tags.every((tag) => job.tags.includes(tag));
  }

  /** Takes a job as it is now; returns whether it is a new one at the top. What has ended does not run again: an answer
   * that says so was overtaken. */
  put(job) {
    const known = this.by_id.get(job.id);
    if (known?.ended && !has_ended(job)) return false;
    if (!this.matches(job)) {
      this.drop(job.id);
      return false;
    }
    const row = slim(job);
    this.by_id.set(job.id, row);
    if (known) {
      this.rows[this.index_of(job.id)] = row;
      return false;
    }
    const at = this.index_of(job.id);
    this.rows.splice(at, 0, row);
    return at === 0;
  }

  drop(id) {
    if (!this.by_id.delete(id)) return;
    this.rows.splice(this.index_of(id), 1);
  }

  /** Where the id stands, or would. */
  index_of(id) {
    let low = 0, high = this.rows.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.rows[middle].id > id) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Loads the next page, if there is one and none is on its way. */
  more() {
    if (this.next === null || this.loading) return this.loading;
    this.loading = this.settled(() => this.load()).finally(() => (this.loading = null));
    return this.loading;
  }

  /** Loads so many jobs, or all there are: to search and to sort them. */
  async all(most) {
    while (this.next && this.rows.length < most && !this.ends.signal.aborted) await this.more();
  }

  /** Loads pages by f; a page may be older than a change that came while it was on its way: that is then made again. */
  async settled(f) {
    this.pending++;
    try {
      return await f();
    } finally {
      if (--this.pending === 0) for (const change of this.late.splice(0)) change();
    }
  }

  change(f) {
    f();
    if (this.pending) this.late.push(f);
  }

  async load() {
    const page = await this.api.get(this.query(this.next ? { cursor: this.next } : {}), { signal: this.ends.signal });
    for (const job of page.jobs) this.put(job);
    this.next = page.next;
    this.on_change({ inserted: 0 });
  }

  take(jobs) {
    const inserted = jobs.filter((job) => this.put(job)).length;
    this.on_change({ inserted });
  }

  /** Takes a change of a job, unless that is older than all that was loaded: its page is still to come. */
  take_change(job) {
    const last = this.rows[this.rows.length - 1];
    if (this.next === null || (last && job.id >= last.id)) this.take([job]);
  }

  /** Loads the first page again, and whatever of the others may have changed: also the first time. */
  refresh() {
    return this.settled(() => this.load_again());
  }

  async load_again() {
    const { signal } = this.ends;
    const page = await this.api.get(this.query({}), { signal });
    const seen = new Set(page.jobs.map((job) => job.id)), first = this.next === undefined;
    const oldest = page.next ? page.jobs[page.jobs.length - 1].id : "";
    for (const row of this.rows.filter((one) => one.id >= oldest && !seen.has(one.id))) this.drop(row.id);
    const gap = page.next && this.rows.length > 0 && this.rows[0].id < oldest; // more new ones than a page has
    if (gap) {
      this.rows.length = 0;
      this.by_id.clear();
    }
    if (first || gap) this.next = page.next;
    this.take([...page.jobs, ...(await this.unsettled(oldest))]);
  }

  /** Jobs below the first page as they are now, of which the list says that they have not ended. */
  async unsettled(oldest) {
    const { signal } = this.ends, jobs = [];
    for (const row of this.rows.filter((one) => one.id < oldest && !one.ended).slice(0, 50)) {
      try {
        jobs.push(await this.api.get(`/v1/jobs/${row.id}`, { signal }));
      } catch (error) {
        if (error.status !== 404) throw error;
        this.drop(row.id);
      }
    }
    return jobs;
  }

  /** Until the stream ends. It begins with a "reset", unless it goes on from an earlier one. */
  follow_stream() {
    return this.api.stream("/v1/events", {
      signal: this.ends.signal, last: this.last_event,
      on_open: () => this.on_state("stream"),
      on_event: (event) => this.on_event(event),
    });
  }

  on_event({ event, data, id }) {
    this.last_event = id || this.last_event;
    if (event === "job") {
      const job = JSON.parse(data);
      this.change(() => this.take_change(job));
    } else if (event === "deleted") {
      const { id: gone } = JSON.parse(data);
      this.change(() => {
        this.drop(gone);
        this.on_change({ inserted: 0 });
      });
    } else if (event === "reset") {
      this.refresh().catch((error) => this.ends.signal.aborted || this.on_error(error));
    }
  }

  async follow() {
    if (this.streams === undefined) this.streams = await this.api.offers("/v1/events");
    if (this.streams) return this.follow_stream();
    await this.refresh();
    this.on_state("poll");
    return null;
  }

  /** Runs until stop(): first page, then whatever changes. on_error: what the service refuses. */
  async run(on_error) {
    const { signal } = this.ends;
    this.on_error = on_error;
    while (!signal.aborted) {
      try {
        await this.follow();
      } catch (error) {
        if (signal.aborted) return;
        if (error.status === 503) this.streams = false; // too many streams
        else if (error.status) {
          on_error(error);
          if (error.status < 500 && error.status !== 429) return;
        } else this.on_state("offline");
      }
      await pause(POLL_MS, signal).catch(() => {});
    }
  }

  stop() {
    this.ends.abort();
  }
}
