// side.js: jobs side by side: how good each answer is, its numbers, and what was asked differently.

import { Convergence } from "./convergence.js";
import { h, show } from "./dom.js";
import { count, moment, percent, seconds, short_id } from "./format.js";
import { status_chip } from "./list.js";
import { numbers_of } from "./numbers.js";
import { error_words, method_words, problem_words, title_of } from "./words.js";
import { unit_of } from "./units.js";

const MOST_LEAVES = 20000, MOST_SHOWN = 60;

const COMPARED = ["max_pressure", "area", "von_mises", "safety", "active", "reaction_sum", "penetration", "energy"];

/** Paths and values of all that a request says, but long lists, which count as one. */
function leaves_of(value, path, into) {
  if (into.size > MOST_LEAVES) return into;
  const long = Array.isArray(value) && (value.length > 50 || value.every((one) => typeof one === "number"));
  if (value && typeof value === "object" && !long) for (const [key, one] of Object.entries(value)) leaves_of(one, path ? `${path}.${key}` : key, into);
  else into.set(path, JSON.stringify(value));
  return into;
}

const shortened = (text) => (text === undefined ? "–" : text.length > 80 ? `${text.slice(0, 77)}…` : text);

/** [path, texts]: what the requests do not all say alike. */
export function differences(requests) {
  const all = requests.map((one) => leaves_of(one, "", new Map())), paths = [...new Set(all.flatMap((one) => [...one.keys()]))];
  return paths.map((path) => [path, all.map((one) => one.get(path))]).filter(([, texts]) => texts.some((text) => text !== texts[0]));
}

function table_of(id, caption, jobs, rows) {
  return h("div", { class: "scrolled", tabindex: "0", role: "region", "aria-label": caption }, h("table", { id, class: "side" }, h("caption", null, caption),
    h("thead", null, h("tr", null, h("th", { scope: "col" }, h("span", { class: "unseen" }, "What")), jobs.map((job) =>
      h("th", { scope: "col" }, h("a", { href: `#/jobs/${job.id}` }, title_of(job)))))),
    h("tbody", null, rows.map(([name, cells]) => h("tr", null, h("th", { scope: "row" }, name), cells.map((cell) => h("td", null, cell)))))));
}

/** A number, and by how much it is off the first job's. */
function cells_of(jobs, { value: value_of, of, words }) {
  const values = jobs.map((job) => value_of(job.summary)), first = values[0];
  return values.map((value, i) => {
    if (!Number.isFinite(value)) return "–";
    const off = i > 0 && Number.isFinite(first) && first !== 0 && value !== first ? ` (${value > first ? "+" : ""}${percent((value - first) / Math.abs(first))})` : "";
    return [`${words(value)}${unit_of(jobs[i].summary, of)}`, h("span", { class: "muted" }, off)];
  });
}

function answers_of(jobs) {
  const summaries = (words) => jobs.map((job) => (job.summary ? words(job.summary) : "–"));
  const rows = [["Outcome", jobs.map((job) => status_chip(job.status, job.summary?.outcome))], ["Whole error", summaries(error_words)], ["Problem", summaries(problem_words)],
    ["Method", summaries(method_words)], ["Time", summaries((summary) => seconds(summary.timings_s?.total))], ["Created", jobs.map((job) => moment(job.created))],
    ["Load cases", summaries((summary) => (summary.cases ? count(summary.cases.count) : "–"))]];
  for (const one of numbers_of(jobs.map((job) => job.summary))) if (COMPARED.includes(one.key) || one.key.startsWith("quantity ")) rows.push([one.name, cells_of(jobs, one)]);
  return rows;
}

async function show_all(main, api, ids, signal, parts) {
  const got = await Promise.allSettled(ids.map((id) => api.get(`/v1/jobs/${id}`, { signal })));
  const jobs = got.filter((one) => one.status === "fulfilled").map((one) => one.value);
  const gone = ids.filter((_, i) => got[i].status === "rejected");
  const place = h("div"), said = h("div"), head = h("div", { class: "title" }, h("h1", null, "Jobs side by side"));
  show(main, head, gone.length ? h("p", { class: "bad", role: "alert" }, `Not there, or deleted: ${gone.map(short_id).join(", ")}.`) : null,
    h("div", { class: "job-page" }, jobs.length ? table_of("side-answers", "Answers, with what the numbers differ from the first by", jobs, answers_of(jobs)) : null, said, place));
  const requests = await Promise.all(jobs.map((job) => api.get(`/v1/jobs/${job.id}/request`, { signal })));
  const found = differences(requests);
  show(said, found.length ? table_of("side-requests", `What was asked differently${found.length > MOST_SHOWN ? `: the first ${MOST_SHOWN} of ${count(found.length)}` : ""}`, jobs,
    found.slice(0, MOST_SHOWN).map(([path, texts]) => [h("code", null, path), texts.map((text) => h("code", null, shortened(text)))]))
    : h("p", null, "The requests say the same."));
  const drawn = jobs.filter((job) => job.summary && !job.summary.cases);
  if (drawn.length < 2) return;
  const curves = new Convergence(place, api, drawn[0].id, "", async () => []);
  parts.push(curves);
  curves.histories[0].name = title_of(drawn[0]);
  await curves.refresh();
  for (const job of drawn.slice(1)) await curves.overlay(job.id);
}

export function show_side(main, { api }, ids) {
  const ends = new AbortController(), parts = [];
  show_all(main, api, ids.split("."), ends.signal, parts).catch((error) => {
    if (!ends.signal.aborted) main.append(h("p", { class: "bad", role: "alert" }, error.message));
  });
  return () => {
    ends.abort();
    parts.forEach((part) => part.destroy());
  };
}
