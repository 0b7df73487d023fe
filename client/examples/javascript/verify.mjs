// Solves a row of springs against stops by a method of its own, and has the answer certified.
// usage: node verify.mjs [STEPS]     exit status 0: certified to 1e-6
//
// The method is the projected gradient on the displacements, which the stops bound from above; too few steps give an
// answer that the certificate does not take.
import { Uzawa } from "../../javascript/uzawa.mjs";

const steps = Number(process.argv[2] ?? 5000);
const n = 12, stiffness = 1000, force = 0.4, gap = 0.02;
const residual = (u, i) => stiffness * (2 * u[i] - (u[i - 1] ?? 0) - (i < n - 1 ? u[i + 1] : u[i])) - force;

let u = new Array(n).fill(0);
for (let k = 0; k < steps; k++) u = u.map((x, i) => Math.min(x - residual(u, i) / (4 * stiffness), gap));
const reactions = u.map((x, i) => (x >= gap ? Math.min(residual(u, i), 0) : 0));

const entries = u.map((_, i) => [i, i, i < n - 1 ? 2 * stiffness : stiffness]);
for (let i = 0; i + 1 < n; i++) entries.push([i + 1, i, -stiffness]);
const matrix = (kind, list) =>
  `%%MatrixMarket matrix coordinate real ${kind}\n${n} ${n} ${list.length}\n` +
  list.map(([i, j, value]) => `${i + 1} ${j + 1} ${value}\n`).join("");
const { summary } = await new Uzawa().verify({
  problem: {
    kind: "matrices",
    K: matrix("symmetric", entries),
    N: matrix("general", u.map((_, i) => [i, i, 1])),
    h: new Array(n).fill(gap),
    p: new Array(n).fill(force),
  },
  answer: { displacements: u, reactions },
  solver: { accuracy: { relative_error: 1e-6 } },
});
console.log(`${summary.outcome}: ${summary.contact.active} of ${n} joints touch, relative error at most ${summary.certificate.relative_error}`);
process.exitCode = summary.outcome === "verified" ? 0 : 1;
