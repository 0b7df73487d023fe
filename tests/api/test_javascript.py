"""The JavaScript client against the daemon, and clients that generators make of the OpenAPI file.
usage: test_javascript.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about the client
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import service
from service import ROOT, Skip, check

SHARED = True  # one service for all tests

CLIENT = ROOT / "client/javascript"
USE = """import { Uzawa, type Job } from "CLIENT/uzawa.mjs";
import type { components, paths } from "./service.js";

type Request = components["schemas"]["request"];
type Answer = paths["/v1/jobs/{id}"]["get"]["responses"]["200"]["content"]["application/json"];
const problem: Request["problem"] = { kind: "matrices", K: "", p: [1] };
const job: Job = await new Uzawa("http://127.0.0.1:8080", { token: "t" }).solve({ problem });
const answer = job as unknown as Answer;
const id: string = answer.id;
const status: "accepted" | "running" | "successful" | "failed" | "dismissed" = answer.status;
console.log(id, status);
"""


def needed(name):
    found = shutil.which(name)
    if not found:
        raise Skip(f"no {name}")
    return found


def run(*words, **how):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=240, **how)
    check(done.returncode == 0, words, done.stdout, done.stderr)
    return done.stdout


def test_calls_of_the_client(s):
    said = run(needed("node"), "--test", cwd=CLIENT, env={**os.environ, "UZAWA_SERVER": s.url})
    passed = re.search(r"^[#ℹ] pass (\d+)$", said, re.M)
    check(passed and int(passed[1]) >= 6 and re.search(r"^[#ℹ] fail 0$", said, re.M), said)


def generators():
    """Where npm has put what tests/javascript/package-lock.json names: BUILD_DIR/javascript."""
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve() / "javascript"
    npm = needed("npm")
    if not (folder / "node_modules/.package-lock.json").exists():
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(ROOT / "tests/javascript" / name, folder)
        got = subprocess.run([npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=folder, capture_output=True, text=True,
                             timeout=240, check=False)
        if got.returncode != 0:
            check("EINTEGRITY" not in got.stderr, got.stderr)
            raise Skip(f"generators could not be had from npm's registry: {got.stderr.strip().splitlines()[-1:]}")
    return folder / "node_modules/.bin"


def test_types_from_each_form_of_the_file(s):
    tools, written = generators(), []
    with tempfile.TemporaryDirectory(dir=tools.parent.parent) as folder:
        for source in (s.url + "/openapi.json", s.url + "/schemas/openapi.json", ROOT / "schemas/openapi.json"):
            run(tools / "openapi-typescript", source, "-o", "service.ts", cwd=folder)
            written.append((pathlib.Path(folder) / "service.ts").read_text())
        check(written[0] == written[1] and "\"job.time\": string" in written[0], written[0][:500])
        check("getResultNpz" in written[2] and len(written[2]) > 100_000, written[2][:500])
        (pathlib.Path(folder) / "service.ts").write_text(written[0])
        strict = ("--noEmit", "--strict", "--module", "nodenext", "--target", "es2022", "--skipLibCheck", "false")
        right = USE.replace("CLIENT", os.path.relpath(CLIENT, folder))
        for name, text in (("right.mts", right), ("wrong.mts", right.replace("answer.status;", "answer.stat;"))):
            (pathlib.Path(folder) / name).write_text(text)
        told = subprocess.run([str(tools / "tsc"), *strict, "right.mts", "wrong.mts"], capture_output=True, text=True, cwd=folder, timeout=240)
        said = [line for line in told.stdout.splitlines() if "error" in line]
        check(told.returncode != 0 and said and all(line.startswith("wrong.mts") and "stat" in line for line in said), told.stdout, told.stderr)


def test_a_client_from_the_service(s):
    """A whole one, and what it sends is understood."""
    tools = generators()
    with tempfile.TemporaryDirectory(dir=tools.parent.parent) as folder:
        run(tools / "openapi-ts", "-i", s.url + "/openapi.json", "-o", "made", cwd=folder)
        strict = ("--outDir", "out", "--module", "nodenext", "--target", "es2022", "--skipLibCheck")
        (pathlib.Path(folder) / "package.json").write_text('{"type": "commonjs"}')
        (pathlib.Path(folder) / "use.ts").write_text(
            'import { listLimits, submitJob } from "./made/sdk.gen";\nimport { client } from "./made/client.gen";\n'
            f'client.setConfig({{ baseUrl: "{s.url}" }});\n'
            '(async () => {\n  const limits = await listLimits();\n'
            '  const job = await submitJob({ body: { problem: { kind: "matrices", K: "%%MatrixMarket matrix coordinate real symmetric\\n'
            '1 1 1\\n1 1 2\\n", p: [4] } }, headers: { Prefer: "wait=10" } as any });\n'
            '  console.log(typeof (limits.data as any).limits.max_body.value, (job.data as any).summary.outcome);\n})();\n')
        run(tools / "tsc", *strict, "use.ts", cwd=folder)
        check(run(needed("node"), "out/use.js", cwd=folder) == "number converged\n")


service.main(globals())
