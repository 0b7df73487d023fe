// numbers.js: the numbers of a summary that jobs and load cases are compared by.

import { count, number, percent_up, seconds } from "./format.js";
import { unit_of } from "./units.js";
import { error_of } from "./words.js";

const at = (path) => (summary) => path.split(".").reduce((value, key) => value?.[key], summary) ?? null;
const MOST_SUPPORTS = 8;
const force = (axis) => [`force_${axis}`, `Force along ${axis}`, at(`contact.force.${"xyz".indexOf(axis)}`), "force"];

/** The parts of the force on each support that are not nothing everywhere: what a path is drawn with. */
function of_supports(summaries) {
  const path = (i, k) => at(`resultants.supports.${i}.force.${k}`), supports = (summaries[0]?.resultants?.supports || []).slice(0, MOST_SUPPORTS);
  const all = supports.flatMap(({ force: found }, i) => (found || []).map((_, k) => [`support_${i}_${"xyz"[k]}`, `Force of support ${i + 1} along ${"xyz"[k]}`, path(i, k), "force"]));
  return all.filter(([, , value]) => summaries.some((summary) => summary?.finite && Math.abs(value(summary)) > 0));
}

// [key, heading, value of a summary, what its unit is of (units.js), how it is written]
const NUMBERS = [
  ["error", "Whole error", error_of, null, percent_up], ["max_pressure", "Largest pressure", at("contact.max_pressure"), "stress"],
  ["area", "Contact area", at("contact.area"), "area"], ["active", "In contact", at("contact.active"), null, count],
  force("x"), force("y"), force("z"), ["reaction_sum", "Sum of reactions", at("contact.reaction_sum"), "force"],
  ["von_mises", "Largest von Mises", at("stress.von_mises"), "stress"], ["safety", "Safety factor", at("stress.safety"), null],
  ["penetration", "Largest penetration", at("contact.max_penetration"), "length"], ["energy", "Energy", at("energy.primal"), "energy"],
  ["part", "Part of the load", at("finite.part"), null], ["displacement", "Largest displacement", at("finite.displacement"), "length"],
  ["iterations", "Iterations", at("iterations"), null, count], ["time", "Iterated for", at("timings_s.iterate"), null, seconds],
];

/** {key, name, value(summary), of, unit: as the first summary says, words(value)} of each number that a summary has; quantities, asked for by name, are numbers too. */
export function numbers_of(summaries) {
  const named = (summaries[0]?.quantities || []).map(({ name }) => [`quantity ${name}`, name, (summary) => summary?.quantities?.find((one) => one.name === name)?.value ?? null, null]);
  return [...NUMBERS, ...of_supports(summaries), ...named].map(([key, name, value, of, words]) => ({ key, name, value, of, unit: unit_of(summaries[0], of), words: words || ((x) => number(x, 5)) }))
    .filter((one) => summaries.some((summary) => Number.isFinite(one.value(summary))));
}
