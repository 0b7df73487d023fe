// list.js: all jobs, searched and sorted, several of them chosen. Only the rows in sight are elements, so that ten thousand
// jobs scroll like ten.

import { JobsSource } from "./jobs_source.js";
import { announce, debounce, h, pause, show } from "./dom.js";
import { count, moment, seconds } from "./format.js";
import { menu_button } from "./menu.js";
import { arrange, is_plain } from "./view_order.js";
import { STATUSES, STATUS_WORDS, state_words } from "./words.js";

const MARGIN = 8; // rows beyond the edges
const MOST_SORTED = 20000; // jobs that are fetched to be searched and sorted
const MOST_COMPARED = 6;
const NARROW = matchMedia("(max-width: 700px)");
const row_height = () => (NARROW.matches ? 76 : 40);
// [key to sort by, heading]
const COLUMNS = [[null, "Chosen"], ["state", "Status"], ["title", "Job"], ["error", "Whole error"], ["problem", "Problem"], ["time", "Time"],
  ["created", "Created"], [null, "Tags"], [null, "More"]];
const ORDERS = [["created", false, "newest first"], ["created", true, "oldest first"], ["title", true, "by name"], ["state", true, "by status"],
  ["error", false, "largest error first"], ["time", false, "longest first"]];

let filter = { status: "", tags: [] }; // as it was left
let order = { words: "", by: "created", up: false };

export function status_chip(status, outcome) {
  const tone = status === "successful" && outcome && !["converged", "verified"].includes(outcome) ? "partly" : status;
  return h("span", { class: `chip ${tone}` }, state_words(status, outcome));
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

function row_of(row, index, { act, now, chosen, choose }) {
  const problem = row.kind ? `${row.kind}, ${count(row.d)} × ${count(row.m)}` : "";
  const progress = row.status === "running" ? h("progress", { value: row.progress, max: 100, "aria-label": "Progress" }) : null;
  const box = h("input", { type: "checkbox", "aria-label": `Choose ${row.title}`, onchange: () => choose(row, box.checked) });
  box.checked = chosen.has(row.id);
  const items = () => [{ label: "Open", act: () => (location.hash = `#/jobs/${row.id}`) },
    now(row).ended ? { label: "Delete", sure: "Delete for good", act: () => act(row) }
      : { label: "Cancel", sure: "Cancel it now", act: () => now(row).ended || act(row) }]; // not deleted where it ended meanwhile
  return h("div", { role: "row", class: "row", "aria-rowindex": index + 2, "data-id": row.id },
    h("span", { role: "cell", class: "choice" }, box),
    h("span", { role: "cell", class: "status" }, status_chip(row.status, row.outcome)),
    h("span", { role: "cell", class: "job" }, h("a", { href: `#/jobs/${row.id}`, title: row.name ? `${row.name} (${row.id})` : row.id, class: row.name ? "named" : "" }, row.title)),
    h("span", { role: "cell", class: "result" }, progress, row.result),
    h("span", { role: "cell", class: "problem" }, problem),
    h("span", { role: "cell", class: "time" }, row.total === null ? "" : seconds(row.total)),
    h("span", { role: "cell", class: "created" }, h("time", { datetime: row.created, title: row.created }, moment(row.created))),
    h("span", { role: "cell", class: "tags" }, row.tags.map((tag) => h("span", { class: "tag" }, tag))),
    h("span", { role: "cell", class: "action" }, menu_button(`More about ${row.title}`, items)));
}

/** A row becomes what it is now, cell by cell: what has the focus, or was pressed once, stays where it can. */
function renew(old, now, button_too) {
  const cells = [...now.children];
  [...old.children].forEach((cell, i) => {
    const kept = cell.classList.contains("job") || cell.classList.contains("choice") || (cell.classList.contains("action") && !button_too);
    if (kept || cell.isEqualNode(cells[i])) return;
    const focused = cell.contains(document.activeElement);
    cell.replaceWith(cells[i]);
    if (focused) cells[i].querySelector("button")?.focus({ preventScroll: true });
  });
}

/** The scrolled part: draws source.rows into an element of its own. */
class Rows {
  constructor(doing) {
    this.doing = doing; // {act, now(row): as it is by now, chosen, choose}
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
      const element = old ? old.element : row_of(row, i, this.doing);
      if (!old) this.sizer.append(element);
      else if (old.row !== row) renew(element, row_of(row, i, this.doing), old.row.ended !== row.ended);
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

function filters(on_filter, on_order) {
  const status = h("select", { id: "filter-status" }, h("option", { value: "" }, "all"),
    STATUSES.map((one) => h("option", { value: one }, STATUS_WORDS[one])));
  status.value = filter.status;
  const tag = h("input", { id: "filter-tag", type: "search", placeholder: "demo, paper", value: filter.tags.join(", "),
    autocomplete: "off", spellcheck: "false" });
  const words = h("input", { id: "search", type: "search", placeholder: "name, id, outcome, tag", value: order.words, autocomplete: "off", spellcheck: "false" });
  const sort = h("select", { id: "sort" }, ORDERS.map(([, , text], i) => h("option", { value: i }, text)));
  sort.value = String(Math.max(0, ORDERS.findIndex(([by, up]) => by === order.by && up === order.up)));
  const changed = () => on_filter({ status: status.value, tags: tag.value.split(",").map((one) => one.trim()).filter(Boolean).slice(0, 4) });
  status.addEventListener("change", changed);
  tag.addEventListener("input", debounce(changed, 300));
  words.addEventListener("input", debounce(() => on_order({ ...order, words: words.value.trim() }), 150));
  sort.addEventListener("change", () => on_order({ ...order, by: ORDERS[sort.value][0], up: ORDERS[sort.value][1] }));
  return h("form", { class: "filters", role: "search", onsubmit: (event) => event.preventDefault() },
    h("label", { for: "search" }, "Search"), words, h("label", { for: "filter-status" }, "Status"), status, h("label", { for: "filter-tag" }, "Tags"), tag,
    h("span", { class: "narrow" }, h("label", { for: "sort" }, "Order"), sort));
}

/** The headings, by which one sorts. */
function headings(on_order) {
  const cells = COLUMNS.map(([by, name]) => {
    if (!by) return h("span", { role: "columnheader", class: name === "Chosen" || name === "More" ? "mute" : "" }, name);
    const button = h("button", { type: "button", class: "heading", onclick: () =>
      on_order({ ...order, by, up: order.by === by ? !order.up : by === "title" || by === "state" }) }, name);
    return h("span", { role: "columnheader", "data-by": by }, button);
  });
  const mark = () => cells.forEach((cell) => {
    const here = cell.dataset.by === order.by;
    if (here) cell.setAttribute("aria-sort", order.up ? "ascending" : "descending");
    else cell.removeAttribute("aria-sort");
  });
  mark();
  return { row: h("div", { role: "row", class: "row", "aria-rowindex": 1 }, cells), mark };
}

/** What can be done with the jobs that are chosen. */
function chosen_bar(chosen, { compare, remove, clear }) {
  const said = h("span", { role: "status" }), bar = h("div", { class: "chosen-bar", hidden: true });
  const side = h("button", { type: "button", id: "compare-chosen", class: "primary", onclick: compare }, "Compare");
  const away = sure_button("Delete them", remove);
  away.id = "delete-chosen";
  show(bar, said, side, away, h("button", { type: "button", onclick: clear }, "Clear"));
  return { bar, draw: () => {
    const n = chosen.size, ended = [...chosen.values()].filter((row) => row.ended).length;
    bar.hidden = n === 0;
    show(said, n === 1 ? "1 job is chosen" : `${count(n)} jobs are chosen`);
    side.disabled = n < 2 || n > MOST_COMPARED;
    side.title = n < 2 ? "Choose a second job" : n > MOST_COMPARED ? `At most ${MOST_COMPARED} are compared` : "";
    away.disabled = ended === 0;
  } };
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
  const chosen = new Map();
  const choose = (row, on) => {
    if (on) chosen.set(row.id, row);
    else chosen.delete(row.id);
    below.draw();
  };
  const clear = () => {
    chosen.clear();
    rows.view.querySelectorAll(".choice input").forEach((box) => (box.checked = false));
    below.draw();
  };
  const remove = async () => {
    for (const row of [...chosen.values()].filter((one) => one.ended)) await act(row);
    clear();
  };
  const below = chosen_bar(chosen, { compare: () => (location.hash = `#/side/${[...chosen.keys()].join(".")}`), remove, clear });
  const rows = new Rows({ act, now: (row) => source.by_id.get(row.id) || row, chosen, choose });
  const heads = headings((wanted) => rearrange(wanted));
  const table = h("div", { role: "table", "aria-label": "Jobs", class: "jobs" }, h("div", { role: "rowgroup", class: "head" }, heads.row), rows.view);

  /** In another order, or those alone that hold the words: of all jobs, which are fetched for it. */
  function rearrange(wanted) {
    order = wanted;
    heads.mark();
    rows.view.scrollTop = 0;
    changed({ inserted: 0 });
    if (!is_plain(order)) source.all(MOST_SORTED).then(() => changed({ inserted: 0 }), () => {});
  }

  function say_trouble(error) {
    trouble.hidden = false;
    show(trouble, error.status === 401 ? "No jobs without a token. " : `${error.message} `,
      error.status === 401 ? h("button", { type: "button", onclick: restart }, "Give a token") : null);
  }

  function changed({ inserted }) {
    const plain = is_plain(order);
    rows.rows = arrange(source.rows, order);
    const n = rows.rows.length, more = source.next;
    for (const id of chosen.keys()) {
      if (source.by_id.has(id)) chosen.set(id, source.by_id.get(id));
      else chosen.delete(id);
    }
    below.draw();
    if (plain && inserted && rows.view.scrollTop > 0) rows.view.scrollTop += inserted * row_height();
    table.setAttribute("aria-rowcount", more ? -1 : n + 1);
    show(total, more ? `${count(n)} jobs and more` : n === 1 ? "1 job" : `${count(n)} jobs`);
    empty.hidden = n > 0 || source.next === undefined;
    show(empty, filter.status || filter.tags.length || order.words ? "No job is like that." : ["No jobs yet. ", h("a", { href: "#/new" }, "Make one"), "."]);
    rows.later();
  }

  function restart() {
    source?.stop();
    trouble.hidden = true;
    source = new JobsSource(api, filter, { on_change: changed, on_state: (name) => show(state, STATES[name]) });
    rows.rows = [];
    rows.view.scrollTop = 0;
    rows.later();
    source.run(say_trouble);
    if (!is_plain(order)) wait_for_all(source);
  }

  /** Once the first page is there. */
  async function wait_for_all(of) {
    while (of === source && of.next === undefined && !of.ends.signal.aborted) await pause(50, of.ends.signal).catch(() => {});
    await of.all(MOST_SORTED).catch(() => {});
    if (of === source) changed({ inserted: 0 });
  }

  rows.on_drawn = (last) => {
    if (source && source.next && last + 200 > source.rows.length) source.more()?.catch(() => {});
  };
  show(main,
    h("div", { class: "title" }, h("h1", null, "Jobs"), state, total, h("a", { class: "button primary", href: "#/new" }, "New job")),
    filters((wanted) => {
      filter = wanted;
      restart();
    }, rearrange),
    trouble, below.bar, empty, table);
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
