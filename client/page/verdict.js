// verdict.js: how good the answer of a job is, in words, and its main numbers.

import { h } from "./dom.js";
import { draft } from "./examples.js";
import { count, counted, number, number_towards, percent_up, seconds } from "./format.js";
import { unit_of } from "./units.js";
import { certificate_words, kinematics_words, method_words, outcome_words, problem_words, trend_words, whole_words } from "./words.js";

function vector(values) {
  return values ? `(${values.map((value) => number(value)).join(", ")})` : null;
}

/** [name, value] pairs that are known. */
function facts_of(summary) {
  const { contact, energy, certificate, stress } = summary;
  const at = contact?.max_pressure_at?.x, unit = (of) => unit_of(summary, of);
  const trend = (one, of) => (one && `${trend_words(one)}${Number.isFinite(one.high) && unit(of) ? ` (in${unit(of)})` : ""}`);
  return [
    ["Problem", problem_words(summary)],
    ["Method", method_words(summary)],
    ["Asked for", summary.requested_error === 0 ? "rounding level" : `≤ ${percent_up(summary.requested_error)}`],
    ["Residual, relative", certificate ? number(certificate.relative_residual.total) : null],
    ["In contact", contact ? `${count(contact.active)} of ${counted(contact.candidates, "candidate")}` : null],
    ["Contact force", contact ? `${vector(contact.force) || number(contact.reaction_sum, 6)}${unit("force")}` : null],
    ["Largest pressure on this mesh", Number.isFinite(contact?.max_pressure) ? `${number(contact.max_pressure, 4)}${unit("stress")}${at ? ` at ${vector(at)}` : ""}` : null],
    ["Contact area on this mesh", Number.isFinite(contact?.area) ? `${number(contact.area, 4)}${unit("area")}` : null],
    ["Largest pressure, estimated", trend(contact?.estimates?.max_pressure, "stress")],
    ["Contact area, estimated", trend(contact?.estimates?.area, "area")],
    ["Largest von Mises stress on this mesh", stress ? `${number(stress.von_mises, 4)}${unit("stress")} at ${vector(stress.at.x)}` : null],
    ["Largest von Mises stress, estimated", trend(stress?.estimates.von_mises, "stress")],
    ["Safety factor on this mesh", Number.isFinite(stress?.safety) ? `${number(stress.safety, 4)} at ${vector(stress.weakest_at.x)}` : null],
    ["Safety factor, estimated", trend_words(stress?.estimates.safety)],
    ["Largest penetration", contact ? `${number(contact.max_penetration)}${unit("length")}` : null],
    ["Energy", energy ? `${number(energy.primal, 6)} (at least ${number_towards(energy.dual, 6, -1)})${unit("energy")}` : null],
    ["Potential energy of the body", Number.isFinite(energy?.potential) ? `${number(energy.potential, 6)}${unit("energy")}` : null],
    ["Imbalance of all forces", summary.resultants ? number(summary.resultants.imbalance) : null],
    ["Expected", summary.cost?.predicted ? `${seconds(summary.cost.predicted.seconds)} after the assembly; it took ${seconds(summary.cost.actual?.seconds)}` : null],
  ].filter(([, value]) => value);
}

/** The commonest mistake in a scene is converged, certified and without a warning: the obstacle on the other side. */
function hint_of({ problem, contact }) {
  return problem?.kind === "scene" && contact?.candidates > 0 && contact.active === 0
    ? h("p", { class: "warn" }, "Nothing touches. If it should: an obstacle's normal points to the body, a polyline has it on its left.") : null;
}

function warnings_of(summary) {
  if (!summary.warnings?.length) return null;
  return h("ul", { class: "warnings", "aria-label": "Warnings" }, summary.warnings.map((one) =>
    h("li", null, h("strong", { class: "warn" }, one.code.replace(/_/g, " ")), ` ${one.message}`)));
}

function limits_of(one) {
  const words = [];
  if (one.min !== undefined) words.push(`at least ${number(one.min, 6)}`);
  if (one.max !== undefined) words.push(`at most ${number(one.max, 6)}`);
  if (one.near !== undefined) words.push(`near ${number(one.near, 6)}`);
  return words.join(", ");
}

const TONES = { pass: "good", fail: "bad" };

function assertions_of(summary) {
  if (!summary.assertions?.length) return null;
  return h("table", { class: "assertions" }, h("caption", null, "Assertions"),
    h("thead", null, h("tr", null, ["Result", "Quantity", "Value", "Wanted"].map((name) => h("th", { scope: "col" }, name)))),
    h("tbody", null, summary.assertions.map((one) => h("tr", null,
      h("td", { class: TONES[one.result] || "warn" }, one.result), h("td", null, one.name || one.quantity, one.case ? h("span", { class: "muted" }, ` in ${one.case}`) : null),
      h("td", null, number(one.value, 6), one.error > 0 ? ` ± ${number(one.error, 2)}` : ""),
      h("td", null, limits_of(one), one.reason ? h("div", { class: "muted" }, one.reason) : null)))));
}

function quantities_of(summary) {
  if (!summary.quantities?.length) return null;
  return h("table", { class: "assertions", id: "quantities" }, h("caption", null, "Quantities"),
    h("thead", null, h("tr", null, ["Name", "Value", "On this mesh"].map((name) => h("th", { scope: "col" }, name)))),
    h("tbody", null, summary.quantities.map((one) => h("tr", null, h("td", null, one.name),
      h("td", null, number(one.value, 6), Number.isFinite(one.low) ? ` ± ${number((one.high - one.low) / 2, 2)}, ${one.kind === "guaranteed" ? "guaranteed" : "by estimate"}` : null,
        one.why ? h("div", { class: "muted" }, one.why) : null),
      h("td", null, number(one.on_this_mesh, 6))))));
}

/** How each contact presses, where there are several. */
function contacts_of(summary) {
  const pressed = (summary.resultants?.contacts || []).filter((one) => Number.isFinite(one.mean_pressure));
  if ((summary.resultants?.contacts || []).length < 2 || !pressed.length) return null;
  return h("table", { class: "assertions", id: "contacts" }, h("caption", null, "Contacts on this mesh"),
    h("thead", null, h("tr", null, [["On"], ["Force", "force"], ["Mean pressure", "stress"], ["Largest", "stress"], ["Area", "area"], ["Center of pressure", "length"]].map(([name, of]) =>
      h("th", { scope: "col" }, name, unit_of(summary, of) && `,${unit_of(summary, of)}`)))),
    h("tbody", null, pressed.map((one) => h("tr", null, h("td", null, one.on), h("td", null, vector(one.force)),
      ...[one.mean_pressure, one.max_pressure, one.area].map((value) => h("td", null, number(value, 4))), h("td", null, vector(one.center))))));
}

/** How rigid groups moved, and what holds them at their points. */
function rigid_of(summary) {
  const rigid = (summary.resultants?.supports || []).filter((one) => one.rigid);
  if (!rigid.length) return null;
  return h("table", { class: "assertions", id: "rigid" }, h("caption", null, "Rigid groups"),
    h("thead", null, h("tr", null, [["On"], ["Point", "length"], ["Displacement", "length"], ["Rotation, degrees"], ["Force", "force"], ["Moment at the point", "moment"]].map(([name, of]) =>
      h("th", { scope: "col" }, name, unit_of(summary, of) && `,${unit_of(summary, of)}`)))),
    h("tbody", null, rigid.map((one) => h("tr", null, h("td", null, one.on),
      ...[one.rigid.point, one.rigid.displacement, one.rigid.rotation, one.force, one.rigid.moment].map((value) => h("td", null, vector(value)))))));
}

/** The card of a summary. */
export function verdict_card(summary) {
  const outcome = outcome_words(summary), whole = whole_words(summary), kinematics = kinematics_words(summary);
  return h("div", { class: `verdict tone-${outcome.tone}` },
    h("h2", null, h("span", { class: outcome.tone }, outcome.title)),
    whole ? h("p", { class: "certificate", id: "whole-error" }, whole) : null,
    h("p", { class: whole ? "" : "certificate", id: "certificate" }, certificate_words(summary)),
    kinematics ? h("p", { id: "kinematics" }, kinematics) : null,
    h("p", { class: "muted" }, outcome.text, summary.message ? ` ${summary.message}` : ""),
    quantities_of(summary), hint_of(summary), warnings_of(summary), assertions_of(summary));
}

/** What else is known of it: less than the body itself tells. */
export function numbers_card(summary) {
  return [h("h2", null, "Numbers"), contacts_of(summary), rigid_of(summary),
    h("dl", { class: "facts" }, facts_of(summary).map(([name, value]) => h("div", null, h("dt", null, name), h("dd", null, value))))];
}

/** The card of a job that has no answer. */
export function failure_card(job) {
  const error = job.error || {};
  return h("div", { class: "verdict tone-bad" }, h("h2", { class: "bad" }, error.title || "Failed"),
    h("p", null, error.detail || ""), error.pointer ? h("p", { class: "muted" }, "At ", h("code", null, error.pointer), error.line ? `, line ${error.line}` : "") : null,
    h("p", { class: "muted" }, "Code ", h("code", null, error.code || "unknown")),
    draft.get() ? h("a", { class: "button small", href: "#/new" }, "Back to the editor") : null);
}
