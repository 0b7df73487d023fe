"""Boxes whose cells the service chooses. usage: test_ladder.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import os
import subprocess
import tempfile

import service
from service import SCENE, check, expect

SHARED = True  # one service for all tests



def chosen(accuracy=None, element=None, **solver):
    """The paper's body, its cells to be chosen."""
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = "auto"
    if element:
        request["problem"]["mesh"]["box"]["element"] = element
    request["solver"] = dict(solver)
    if accuracy:
        request["solver"]["accuracy"] = accuracy
    return request


def test_ladder_is_told(s):
    job = s.solved(chosen({"relative_error": 0.02}))
    summary = job["summary"]
    ladder = summary["mesh"]["ladder"]
    check(summary["outcome"] == "converged" and summary["requested_error"] == 0.02, summary)
    check(summary["total_error"] <= 0.02 and summary["started_from"] == "warm", summary)
    check(len(ladder) >= 2 and all(set(r) == {"cells", "elements", "d", "iterations", "discretization_error", "certified_error", "error", "seconds",
                                              "max_pressure", "contact_area"} for r in ladder), ladder)
    final = [r for r in ladder if r["cells"] == summary["mesh"]["cells"]]
    check(len(final) == 1 and final[0]["discretization_error"] == summary["discretization_error"], summary["mesh"])
    check(final[0]["d"] == summary["problem"]["d"], final)
    total = (summary["discretization_error"] ** 2 + summary["certificate"]["relative_error"] ** 2) ** 0.5
    check(abs(total - summary["total_error"]) < 1e-12, total)
    coarser = [r for r in ladder if r["d"] < final[0]["d"]]
    check(all(r["discretization_error"] > 0.0198 for r in coarser), ladder)


def test_levels(s):
    for level, asked in ((None, 5e-2), ("balanced", 5e-2), ("quick", 1e-2)):
        summary = s.solved(chosen(level))["summary"]
        check(summary["requested_error"] == asked and summary["outcome"] == "converged", level, summary)


def test_out_of_reach(s):
    summary = s.solved(chosen("precise"))["summary"]
    check(summary["outcome"] == "mesh_limit" and summary["total_error"] > 1e-8 and summary["message"], summary)


def test_fields_find_the_grid(s):
    """What is computed from the stored request knows the cells that were chosen."""
    for element in ("quad4", "tri6"):
        job = s.solved(chosen({"relative_error": 0.03}, element))
        cells = job["summary"]["mesh"]["cells"]
        order = 2 if element == "tri6" else 1
        nodes = (order * cells[0] + 1) * (order * cells[1] + 1)
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=von_mises,pressure,nodes,stress,displacements"),
                        200).json
        check(len(answer["von_mises"]) == len(answer["stress"]) == len(answer["displacements"]) == nodes, element)
        expect(s.get(f"/v1/jobs/{job['id']}/result.vtu"), 200)
        # the same grid by name gives the same answer
        given = chosen({"relative_error": 1e-10}, element)
        given["problem"]["mesh"]["box"]["cells"] = cells
        other = expect(s.get(f"/v1/jobs/{s.solved(given)['id']}/result?fields=von_mises"), 200).json
        worst = max(abs(a - b) for a, b in zip(answer["von_mises"], other["von_mises"]))
        check(worst < 0.05 * max(other["von_mises"]), element, worst)


def test_load_cases(s):
    request = chosen({"relative_error": 0.02})
    request["cases"] = [{"name": "a", "loads": SCENE["problem"]["loads"]}, {"name": "b", "loads": [{"on": "right", "traction": [0, -0.1]}]}]
    job = s.solved(request)
    check(job["summary"]["mesh"]["ladder"] and job["summary"]["cases"]["count"] == 2, job["summary"])
    check(job["summary"]["total_error"] <= 0.02 and job["summary"]["outcome"] == "converged", job["summary"])
    cells = job["summary"]["mesh"]["cells"]
    for name in ("a", "b"):
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?case={name}&fields=von_mises"), 200).json
        check(len(answer["von_mises"]) == (cells[0] + 1) * (cells[1] + 1), name)
        check(answer["summary"]["total_error"] <= 0.02, answer["summary"])


def refused(s, request, status, code, pointer):
    reply = expect(s.post(request), status).json
    check(reply["code"] == code and reply.get("pointer", "") == pointer, reply)


def test_what_needs_a_mesh_is_refused(s):
    box = "/problem/mesh/box/cells"
    refused(s, chosen(stopping="paper"), 422, "not_allowed", "/solver/stopping")
    refused(s, chosen(warm_start={"reactions": [0.0]}), 422, "not_allowed", "/solver/warm_start")
    job = s.solved(chosen({"relative_error": 0.03}))
    refused(s, chosen(warm_start={"job": job["id"]}), 422, "not_allowed", "/solver/warm_start")
    reply = expect(s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": "quick"}), 409).json
    check(reply["code"] == "mesh_is_chosen", reply)
    verify = {"problem": chosen()["problem"], "answer": {"displacements": [0.0], "reactions": [0.0]}}
    reply = expect(s.request("POST", "/v1/verify", verify), 422).json
    check(reply["code"] == "not_allowed" and reply["pointer"] == box, reply)
    wrong = chosen()
    wrong["problem"]["mesh"]["box"]["cells"] = "automatic"
    reply = expect(s.post(wrong), 422).json
    check(reply["pointer"] == box and "auto" in reply["detail"], reply)


def test_its_reactions_start_the_same_grid(s):
    """A job with the cells that were chosen may start from the one that chose them."""
    job = s.solved(chosen({"relative_error": 0.02}))
    given = chosen({"relative_error": 1e-8}, method="accelerated_restart", warm_start={"job": job["id"]})
    given["problem"]["mesh"]["box"]["cells"] = job["summary"]["mesh"]["cells"]
    summary = s.solved(given)["summary"]
    check(summary["outcome"] == "converged" and summary["started_from"] == "warm", summary)


@service.options("--memory", "10M")
def test_memory_limit(s):
    summary = s.solved(chosen({"relative_error": 1e-3}))["summary"]
    check(summary["outcome"] == "mesh_limit" and summary["total_error"] > 1e-3, summary)
    check("bytes" in summary["message"] and summary["cost"]["actual"]["bytes"] < 10e6, summary)


def test_client_prints_the_ladder(s):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "body.json")
        with open(path, "w") as to:
            json.dump(chosen({"relative_error": 0.02}), to)
        done = subprocess.run([s.build / "uzawa", "--server", s.url, "submit", path, "--wait"], capture_output=True,
                              text=True, timeout=120)
    check(done.returncode == 0, done)
    check("cells, chosen after" in done.stdout and "12 x 4" in done.stdout, done.stdout)
    check("total error about 0.0" in done.stdout and "asked for 0.02: met" in done.stdout, done.stdout)


if __name__ == "__main__":
    service.main(globals())
