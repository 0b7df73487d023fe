// list.js: all jobs. Only the rows in sight are elements, so that ten thousand jobs scroll like ten.

import { JobsSource } from "./jobs_source.js";
import { announce, debounce, h, show } from "./dom.js";
import { count, moment, seconds, short_id } from "./format.js";
import { STATUSES, STATUS_WORDS } from "./words.js";

const MARGIN = 8; // rows beyond the edges
const NARROW = matchMedia("(max-width: 700px)");
const row_height = () => (NARROW.matches ? 76 : 40);
const COLUMNS = ["Status", "Job", "Result", "Problem", "Time", "Created", "Tags", "Action"];

let filter = { status: "", tags: [] }; // as it was left

export function status_chip(status, outcome) {
  const tone = status === "successful" && outcome && !["converged", "verified"].includes(outcome) ? "partly" : status;
  return h("span", { class: `chip ${tone}` }, STATUS_WORDS[status]);
}

/** A button that must be pressed twice: "Delete", then "Delete?". */
export function sure_button(label, act) {
  let armed = 0;
  const button = h("button", { type: "button", class: "small" }, label);
  const disarm = () => {
    armed = 0;
    show(button, label);
  };
  button.addEventListener("click", async () => {
    if (!armed) {
      armed = setTimeout(disarm, 4000);
      show(button, `${label}?`);
      announce(`Press again: ${label}`);
      return;
    }
    clearTimeout(armed);
    button.disabled = true;
    await act();
    button.disabled = false;
    disarm();
  });
  return button;
}

function row_of(row, index, act) {
  const problem = row.kind ? `${row.kind}, ${count(row.d)} × ${count(row.m)}` : "";
  const progress = row.status === "running" ? h("progress", { value: row.progress, max: 100, "aria-label": "Progress" }) : null;
  return h("div", { role: "row", class: "row", "aria-rowindex": index + 2, "data-id": row.id },
    h("span", { role: "cell", class: "status" }, status_chip(row.status, row.outcome)),
    h("span", { role: "cell", class: "job" }, h("a", { href: `#/jobs/${row.id}`, title: row.id }, short_id(row.id))),
    h("span", { role: "cell", class: "result" }, progress, row.result),
    h("span", { role: "cell", class: "problem" }, problem),
    h("span", { role: "cell", class: "time" }, row.total === null ? "" : seconds(row.total)),
    h("span", { role: "cell", class: "created" }, h("time", { datetime: row.created }, moment(row.created))),
    h("span", { role: "cell", class: "tags" }, row.tags.map((tag) => h("span", { class: "tag" }, tag))),
    h("span", { role: "cell", class: "action" }, sure_button(row.ended ? "Delete" : "Cancel", () => act(row))));
}

/** A row becomes what it is now, cell by cell: what has the focus, or was pressed once, stays where it can. */
function renew(old, now, button_too) {
  const cells = [...now.children];
  [...old.children].forEach((cell, i) => {
    const kept = cell.classList.contains("job") || (cell.classList.contains("action") && !button_too);
    if (kept || cell.isEqualNode(cells[i])) return;
    const focused = cell.contains(document.activeElement);
    cell.replaceWith(cells[i]);
    if (focused) cells[i].querySelector("button")?.focus({ preventScroll: true });
  });
}

/** The scrolled part: draws source.rows into an element of its own. */
class Rows {
  constructor(act) {
    this.act = act;
    this.rows = [];
    this.drawn = new Map(); // id -> {row, element, index}
    this.sizer = h("div", { class: "sizer", role: "presentation" });
    this.view = h("div", { role: "rowgroup", class: "rows", tabindex: "0", "aria-label": "Jobs, scrolled" }, this.sizer);
    this.pending = 0;
    this.view.addEventListener("scroll", () => this.later(), { passive: true });
  }

  later() {
    this.pending = this.pending || requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  }

  range() {
    const height = row_height(), top = this.view.scrollTop;
    const first = Math.max(0, Math.floor(top / height) - MARGIN);
    const last = Math.min(this.rows.length, Math.ceil((top + this.view.clientHeight) / height) + MARGIN);
    return [first, last];
  }

  draw() {
    const height = row_height(), [first, last] = this.range();
    const kept = new Map();
    this.sizer.style.height = `${this.rows.length * height}px`;
    for (let i = first; i < last; i++) {
      const row = this.rows[i], old = this.drawn.get(row.id);
      const element = old ? old.element : row_of(row, i, this.act);
      if (!old) this.sizer.append(element);
      else if (old.row !== row) renew(element, row_of(row, i, this.act), old.row.ended !== row.ended);
      if (old && old.index !== i) element.setAttribute("aria-rowindex", i + 2);
      element.style.transform = `translateY(${i * height}px)`;
      kept.set(row.id, { row, element, index: i });
    }
    for (const [id, one] of this.drawn) if (!kept.has(id)) one.element.remove();
    this.drawn = kept;
    this.on_drawn?.(last);
  }

  move(by) {
    const id = document.activeElement?.closest?.(".row")?.dataset.id;
    const now = id ? this.rows.findIndex((row) => row.id === id) : -1;
    const to = Math.min(this.rows.length - 1, Math.max(0, now + by));
    if (to < 0) return;
    const height = row_height(), top = this.view.scrollTop;
    if (to * height < top) this.view.scrollTop = to * height;
    else if ((to + 1) * height > top + this.view.clientHeight) this.view.scrollTop = (to + 1) * height - this.view.clientHeight;
    this.draw();
    this.drawn.get(this.rows[to].id)?.element.querySelector("a").focus({ preventScroll: true });
  }
}

function filters(on_filter) {
  const status = h("select", { id: "filter-status" }, h("option", { value: "" }, "all"),
    STATUSES.map((one) => h("option", { value: one }, STATUS_WORDS[one])));
  status.value = filter.status;
  const tag = h("input", { id: "filter-tag", type: "search", placeholder: "demo, paper", value: filter.tags.join(", "),
    autocomplete: "off", spellcheck: "false" });
  const changed = () => on_filter({ status: status.value, tags: tag.value.split(",").map((one) => one.trim()).filter(Boolean).slice(0, 4) });
  status.addEventListener("change", changed);
  tag.addEventListener("input", debounce(changed, 300));
  return h("form", { class: "filters", role: "search", onsubmit: (event) => event.preventDefault() },
    h("label", { for: "filter-status" }, "Status"), status, h("label", { for: "filter-tag" }, "Tags"), tag);
}

const STATES = { stream: "live", poll: "live (every 2 s)", offline: "connection lost: trying again" };

export function show_list(main, { api }) {
  const state = h("span", { id: "list-state", class: "muted" }, "…");
  const total = h("span", { id: "list-total", class: "muted", role: "status" });
  const empty = h("p", { class: "empty", hidden: true });
  const trouble = h("p", { class: "bad", role: "alert", hidden: true });
  let source = null;

  const act = async (row) => {
    try {
      const job = await api.remove(`/v1/jobs/${row.id}`);
      if (job) source.take([job]);
      else source.drop(row.id);
      announce(job ? "Cancelled" : "Deleted");
    } catch (error) {
      if (error.status === 404) source.drop(row.id);
      else say_trouble(error);
    }
    changed({ inserted: 0 });
  };
  const rows = new Rows(act);
  const table = h("div", { role: "table", "aria-label": "Jobs", class: "jobs" },
    h("div", { role: "rowgroup", class: "head" },
      h("div", { role: "row", class: "row", "aria-rowindex": 1 }, COLUMNS.map((name) => h("span", { role: "columnheader" }, name)))),
    rows.view);

  function say_trouble(error) {
    trouble.hidden = false;
    show(trouble, error.status === 401 ? "No jobs without a token. " : `${error.message} `,
      error.status === 401 ? h("button", { type: "button", onclick: restart }, "Give a token") : null);
  }

  function changed({ inserted }) {
    const n = source.rows.length, more = source.next;
    rows.rows = source.rows;
    if (inserted && rows.view.scrollTop > 0) rows.view.scrollTop += inserted * row_height();
    table.setAttribute("aria-rowcount", more ? -1 : n + 1);
    show(total, more ? `${count(n)} jobs and more` : n === 1 ? "1 job" : `${count(n)} jobs`);
    empty.hidden = n > 0 || source.next === undefined;
    show(empty, filter.status || filter.tags.length ? "No job is like that." : ["No jobs yet. ", h("a", { href: "#/new" }, "Make one"), "."]);
    rows.later();
  }

  function restart() {
    source?.stop();
    trouble.hidden = true;
    source = new JobsSource(api, filter, { on_change: changed, on_state: (name) => show(state, STATES[name]) });
    rows.rows = source.rows;
    rows.view.scrollTop = 0;
    rows.later();
    source.run(say_trouble);
  }

  rows.on_drawn = (last) => {
    if (source && source.next && last + 200 > source.rows.length) source.more()?.catch(() => {});
  };
  show(main,
    h("div", { class: "title" }, h("h1", null, "Jobs"), state, total, h("a", { class: "button primary", href: "#/new" }, "New job")),
    filters((wanted) => {
      filter = wanted;
      restart();
    }),
    trouble, empty, table);
  const on_move = (event) => rows.move(event.detail);
  const on_size = () => rows.later();
  document.addEventListener("listmove", on_move);
  NARROW.addEventListener("change", on_size);
  addEventListener("resize", on_size);
  restart();
  return () => {
    source.stop();
    document.removeEventListener("listmove", on_move);
    NARROW.removeEventListener("change", on_size);
    removeEventListener("resize", on_size);
  };
}
