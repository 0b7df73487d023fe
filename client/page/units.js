// units.js: what a scene calls its units (summary.problem.units), beside numbers.

/** " MPa" behind a number; "" where the scene does not say. of: "length", "force", "stress", "area", "energy", "moment", null. */
export function unit_of(summary, of) {
  const units = summary?.problem?.units;
  if (!units || !of) return "";
  return ` ${{ area: `${units.length}²`, energy: `${units.force}·${units.length}`, moment: `${units.force}·${units.length}` }[of] || units[of]}`;
}
