// Against the service at $UZAWA_SERVER: tests/api/test_javascript.py starts one.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import test from "node:test";
import { Refused, Uzawa } from "./uzawa.mjs";

const service = new Uzawa();
const matrices = {
  problem: {
    kind: "matrices",
    K: "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 1\n",
    N: "%%MatrixMarket matrix coordinate real general\n1 2 1\n1 1 1\n",
    h: [0.5],
    p: [2, 2],
  },
};
const body = JSON.parse(await readFile(new URL("../../tests/data/paper_body.json", import.meta.url), "utf8"));
const endless = { ...body, solver: { method: "uzawa", alpha: 1e-9, max_iterations: 1000000000 } };

test("a scene is solved, with its fields, its history and its picture", async () => {
  const job = await service.solve(body);
  assert.equal(job.summary.outcome, "converged");
  const { displacements, nodes, reactions } = await service.result(job.id, ["displacements", "nodes", "reactions"]);
  assert.equal(displacements.length, nodes.length);
  assert.equal(reactions.filter((r) => r < 0).length, job.summary.contact.active);
  const history = await service.history(job.id);
  assert.ok(history.iteration.every((at, i) => i === 0 || at > history.iteration[i - 1]));
  assert.ok(history.iteration.at(-1) >= job.summary.iterations - 1);
  assert.match(await service.picture(job.id, "deformed", { width: "400" }), /<svg/);
  assert.equal((await service.jobs({ limit: "1" }))[0].id, job.id);
});

test("load cases have an answer each", async () => {
  const { loads } = body.problem;
  const job = await service.solve({ ...body, cases: [{ name: "a & b", loads }, { name: "none", loads: [] }] });
  const pressed = await service.result(job.id, ["reactions"], "a & b");
  const free = await service.result(job.id, ["reactions"], "none");
  assert.ok(Math.min(...pressed.reactions) < 0 && Math.min(...free.reactions) === 0);
  assert.ok((await service.history(job.id, "none")).iteration.length >= 1);
});

test("matrices are uploaded once", async () => {
  const K = await service.upload(matrices.problem.K);
  const job = await service.solve({ problem: { ...matrices.problem, K } });
  const { displacements } = await service.result(job.id, ["displacements"]);
  assert.ok(Math.abs(displacements[0] - 0.5) < 1e-12 && Math.abs(displacements[1] - 2) < 1e-12);
  const bytes = await service.upload(new TextEncoder().encode(matrices.problem.K));
  assert.deepEqual(bytes, K);
});

test("a request is checked, an answer certified", async () => {
  assert.equal((await service.validate(matrices)).valid, true);
  const answer = { displacements: [0.5, 2], reactions: [-1] };
  assert.equal((await service.verify({ ...matrices, answer })).summary.outcome, "verified");
});

test("refusals say where", async () => {
  await assert.rejects(service.submit({ problem: { kind: "nothing" } }), (error) => {
    assert.ok(error instanceof Refused);
    assert.equal(error.problem.pointer, "/problem/kind");
    assert.equal(error.name, "Refused");
    return error.message.startsWith("/problem/kind ") && error.message.split("/problem/kind ").length === 2;
  });
  const singular = { problem: { kind: "matrices", K: "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 -1\n", p: [1] } };
  await assert.rejects(service.solve(singular), (error) => error.problem.code === "not_positive_definite");
});

test("progress is told, and a job dismissed", async () => {
  const seen = [];
  const { id } = await service.submit(endless);
  const job = await service.wait(id, (data) => {
    seen.push(data);
    if (seen.length === 2) service.dismiss(id);
  });
  assert.ok(seen.length >= 2 && seen[1].iteration > 0);
  assert.equal(job.summary.outcome, "dismissed");
  await service.dismiss(id); // has ended, and stays
  assert.equal((await service.job(id)).id, id);
});
