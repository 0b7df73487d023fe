// words.js: what a job's status, outcome and certificate mean, in sentences.

import { count, counted, number, number_towards, percent_up, seconds, short_id } from "./format.js";

export const STATUSES = ["accepted", "running", "successful", "failed", "dismissed"];
export const STATUS_WORDS = {
  accepted: "waiting", running: "running", successful: "successful", failed: "failed", dismissed: "dismissed",
};

/** What a job is, in a word or two: how good its answer is where it has one. */
export function state_words(status, outcome) {
  return (status === "successful" && outcome && (OUTCOMES[outcome]?.[1].toLowerCase() || outcome.replace(/_/g, " "))) || STATUS_WORDS[status];
}

/** What to call a job: its name, or else the end of its id. */
export function title_of(job) {
  return job.name || short_id(job.id);
}

export function has_ended(job) {
  return job.status !== "accepted" && job.status !== "running";
}

const OUTCOMES = {
  converged: ["good", "Converged", "The certificate meets what was asked for."],
  verified: ["good", "Verified", "The answer that was given meets what was asked for."],
  not_verified: ["bad", "Not verified", "The answer that was given is not proved to be as good as was asked for."],
  iteration_limit: ["warn", "Iteration limit", "It stopped after the iterations that were allowed. This is the best answer so far, with its own certificate."],
  time_limit: ["warn", "Time limit", "It stopped after the time that was allowed. This is the best answer so far, with its own certificate."],
  precision_limit: ["warn", "Precision limit", "More was asked for than double precision holds. The answer is as good as it can be, with its own certificate."],
  paper_rule: ["warn", "Stopped by the paper's rule", "The change of the reactions became small before the certificate met what was asked for."],
  infeasible: ["bad", "Infeasible", "No displacement satisfies all contact conditions: supports and obstacles contradict each other."],
  out_of_reach: ["bad", "Out of reach", "Contact conditions contradict each other but for rounding: a displacement that meets them all, if there is one, is far away."],
  loose: ["warn", "Loose", "No load presses the body on what would hold it: where the obstacles leave it room it may lie anywhere, and this is one such place."],
  unheld: ["bad", "Not held", "The load does not press the body on the obstacles that alone hold it: this case has no answer."],
  moving_geometry: ["warn", "Geometry not settled", "The surfaces move so far that gaps and normals, taken where the answer moves them to, did not settle. This is the last answer."],
  unstable: ["bad", "Unstable", "Beyond a part of the load no stable equilibrium was found: a limit load or a bifurcation. This is the answer under that part."],
  inverted: ["bad", "Inverted", "Beyond a part of the load elements turn inside out. This is the answer under that part."],
  dismissed: ["warn", "Dismissed", "It was stopped. This is the best answer so far, with its own certificate."],
  mesh_limit: ["warn", "Mesh limit", "A grid fine enough would be larger than allowed. The answer is on the finest one that is."],
};

/** {tone: "good" | "warn" | "bad", title, text} of a summary's outcome. */
export function outcome_words(summary) {
  const [tone, title, text] = OUTCOMES[summary.outcome] || ["warn", summary.outcome, "This outcome is not known to the page."];
  return { tone, title, text };
}

function has_no_answer(summary) {
  return ["infeasible", "out_of_reach", "unheld"].includes(summary.outcome);
}

function bound_of(summary) {
  const value = summary.certificate?.relative_error;
  return Number.isFinite(value) ? value : null;
}

/** The certificate in a sentence. */
export function certificate_words(summary) {
  const bound = bound_of(summary);
  if (has_no_answer(summary)) {
    const radius = summary.infeasible_radius;
    return radius === null || radius === undefined
      ? "It is proved that no displacement at all satisfies the contact conditions."
      : `It is proved that no displacement whose components are all smaller than ${number(radius)} satisfies the contact conditions.`;
  }
  if (summary.finite) return `${summary.finite.definite ? "A" : "No"} stable equilibrium under ${number(summary.finite.load)} of the load: a further Newton step would change it by ${percent_up(summary.finite.residual)}, in the energy norm. Nothing bounds its error: compare meshes.`;
  if (bound === null) return "No bound on the error could be proved: this answer must not be relied on.";
  return `The exact answer of ${has_mesh(summary) ? "its equations" : "this problem"} differs by at most ${percent_up(bound)}, in the energy norm.`;
}

/** What large deformation makes of it; null where that was not looked at. */
export function kinematics_words(summary) {
  const small = summary.small_deformation;
  if (!small) return null;
  if (!Number.isFinite(small.error)) return `Large deformation has no stable equilibrium beyond ${number(small.load)} of the load.`;
  return `Small deformation ${summary.finite ? "would have erred" : "errs"} by ${percent_up(small.error)}${small.in ? ` in ${small.in}` : ""}.`;
}

/** Is the error of the answer more than that of its equations? Of bodies; matrices have no mesh. */
function has_mesh(summary) {
  return summary.error?.kind === "estimated" || is_bounded(summary);
}
function is_bounded(summary) {
  return Number.isFinite(summary.error?.dual_unknowns);
}

/** The whole error, of which the mesh has its part; null where the certificate says it all. */
export function whole_words(summary) {
  const { mesh, total, bound } = summary.error || {};
  if (!has_mesh(summary) || has_no_answer(summary)) return null;
  if (is_bounded(summary)) return `The answer is off by at most ${Number.isFinite(total) ? percent_up(total) : number(bound)} in the energy norm, mesh and equations together (guaranteed).`;
  if (!Number.isFinite(total)) return `How far the answer is off in all is not known: ${Number.isFinite(mesh) ? "nothing could be certified" : "what the mesh loses could not be estimated"}.`;
  return `The answer is off by about ${percent_up(total)} in the energy norm, ${mesh > 0.99 * total ? "nearly all of it" : percent_up(mesh)} by its mesh (estimated).`;
}

/** The grid that a job which looks for a mesh solves on; "" of others. */
export function grid_words(grid) {
  if (!grid) return "";
  const words = [`grid ${grid.number}, ${counted(grid.unknowns, "unknown")}`];
  if (Number.isFinite(grid.error)) words.push(`${percent_up(grid.error)} on the one before, ${percent_up(grid.asked)} asked for`);
  if (Number.isFinite(grid.seconds_left)) words.push(`about ${seconds(Math.max(1, Math.round(grid.seconds_left)))} left`);
  return words.join(", ");
}

/** Of the largest pressure or the area: where it is without a mesh, by estimate. */
export function trend_words(one) {
  if (!one) return null;
  if (!Number.isFinite(one.high)) return Number.isFinite(one.low) ? `no limit: ${one.why}` : `none: ${one.why}`;
  const half = Math.max(one.high - one.value, one.value - one.low);
  return `${number(one.value, 4)} ± ${number_towards(half, 2, 1)}, ${Number.isFinite(one.order) ? `order ${number(one.order, 2)} observed on ${counted(one.grids, "grid")}` : one.why}`;
}

/** One line about what was solved. */
export function problem_words(summary) {
  const p = summary.problem;
  return p ? `${p.kind}, ${counted(p.d, "unknown")}, ${counted(p.m, "contact row")}` : "";
}

/** How it was solved. */
export function method_words(summary) {
  const t = summary.timings_s || {};
  const cached = summary.factor?.cached ? ", on a body that was in the cache" : "";
  return `${summary.method}, ${summary.operator} operator, ${counted(summary.iterations, "iteration")}` +
    `${summary.restarts ? `, ${counted(summary.restarts, "restart")}` : ""}, ${seconds(t.total)}${cached}`;
}

/** The whole error of an answer, or its bound where that is all of it; null: there is none. */
export function error_of(summary) {
  if (!summary || has_no_answer(summary) || bound_of(summary) === null) return null;
  const total = has_mesh(summary) ? summary.error.total : null;
  return Number.isFinite(total) ? total : bound_of(summary);
}

/** The same in words: "≈ 2.2 %" by estimate, "≤ 2.2 %" of a bound. */
export function error_words(summary) {
  const error = error_of(summary);
  if (error === null) return has_no_answer(summary) ? "no answer" : "no bound";
  const estimated = has_mesh(summary) && !is_bounded(summary) && Number.isFinite(summary.error.total);
  return `${estimated ? "≈" : "≤"} ${percent_up(error)}`;
}

/** How good an ended job is, for a line of a list that says its outcome beside. */
export function result_words(job) {
  if (job.status === "failed") return job.error?.title || "failed";
  if (!job.summary) return "";
  return error_words(job.summary) + (job.summary.assertions_passed === false ? ", an assertion fails" : "");
}
