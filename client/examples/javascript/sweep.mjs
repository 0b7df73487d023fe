// The same body with ever more cells, on which the largest pressure and the estimate of the mesh's own error settle.
// usage: node sweep.mjs [LEVELS]
import { Uzawa } from "../../javascript/uzawa.mjs";

const levels = Number(process.argv[2] ?? 3);
const service = new Uzawa();
const request = (cells) => ({
  problem: {
    kind: "scene",
    model: "plane_strain",
    mesh: { box: { size: [40, 10], cells: [4 * cells, cells] } },
    materials: [{ on: "all", young: 210e3, poisson: 0.3 }],
    supports: [{ on: "top", ux: 0, uy: -0.05 }],
    contacts: [{ on: "bottom", obstacle: { circle: { center: [20, -200], radius: 200 } } }],
  },
  solver: { accuracy: "balanced" },
  tags: ["sweep"],
});
// All are posted at once; the service solves them one after the other or side by side.
const jobs = await Promise.all(
  Array.from({ length: levels }, (_, i) => 4 * 2 ** i).map(async (cells) => {
    const job = await service.wait((await service.submit(request(cells))).id);
    return { cells, summary: job.summary };
  }),
);
console.log("cells across, largest pressure, mesh error (estimate), certified error");
for (const { cells, summary } of jobs)
  console.log([cells, summary.contact.max_pressure, summary.discretization_error, summary.certificate.relative_error].join(", "));
process.exitCode = jobs.every(({ summary }) => summary.outcome === "converged") ? 0 : 1;
