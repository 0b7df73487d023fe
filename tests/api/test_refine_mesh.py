"""Meshes that the service refines where the error is. usage: test_refine_mesh.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import math
import os
import random
import subprocess
import tempfile

import service
from service import SCENE, check, expect

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}


def refined(accuracy=None, element="tri3", cells=(6, 2), **solver):
    """The paper's body in few triangles, to be refined."""
    request = copy.deepcopy(SCENE)
    mesh = request["problem"]["mesh"]
    mesh["refine"] = "auto"
    mesh["box"]["cells"] = cells if isinstance(cells, str) else list(cells)
    mesh["box"]["element"] = element
    request["solver"] = dict(solver)
    if accuracy:
        request["solver"]["accuracy"] = accuracy
    return request


def in_numbers(request):
    """The same body as nodes and elements, its sides as groups."""
    nodes = [[10.0 * i, 10.0 * j] for j in range(3) for i in range(7)]
    at = lambda i, j: j * 7 + i
    elements = []
    for j in range(2):
        for i in range(6):
            elements += [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    sides = {"left": [[at(0, j + 1), at(0, j)] for j in range(2)], "right": [[at(6, j), at(6, j + 1)] for j in range(2)],
             "bottom": [[at(i, 0), at(i + 1, 0)] for i in range(6)], "top": [[at(i + 1, 2), at(i, 2)] for i in range(6)]}
    request["problem"]["mesh"] = {"nodes": nodes, "elements": {"tri3": elements}, "refine": "auto",
                                  "groups": {name: {"edges": edges} for name, edges in sides.items()}}
    return request


def gmsh_of(mesh):
    """A mesh in numbers as a Gmsh file."""
    names = {name: k + 1 for k, name in enumerate(mesh["groups"])}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    lines += [f'1 {k} "{name}"' for name, k in names.items()] + ["$EndPhysicalNames", "$Nodes", str(len(mesh["nodes"]))]
    lines += [f"{i + 1} {x} {y} 0" for i, (x, y) in enumerate(mesh["nodes"])] + ["$EndNodes", "$Elements"]
    items = [f"1 2 {names[name]} {names[name]} {a + 1} {b + 1}" for name in names for a, b in mesh["groups"][name]["edges"]]
    items += [f"2 2 9 9 {a + 1} {b + 1} {c + 1}" for a, b, c in mesh["elements"]["tri3"]]
    return "\n".join(lines + [str(len(items))] + [f"{i + 1} {item}" for i, item in enumerate(items)] + ["$EndElements", ""])


def test_grids_are_told(s):
    summary = s.solved(refined({"relative_error": 0.03}))["summary"]
    mesh = summary["mesh"]
    check(summary["outcome"] == "converged" and summary["error"]["total"] <= 0.03, summary)
    check(mesh["refined"] is True and "cells" not in mesh and len(mesh["ladder"]) > 3, mesh)
    check(mesh["ladder"][0]["elements"] == 24 and mesh["elements"] == mesh["ladder"][-1]["elements"], mesh)
    check(all(b["d"] > a["d"] for a, b in zip(mesh["ladder"], mesh["ladder"][1:])), mesh)
    check(mesh["ladder"][-1]["d"] == summary["problem"]["d"], mesh)
    check(summary["started_from"] == "warm" and summary["total_error"] == summary["error"]["total"], summary)


def test_a_mesh_of_any_origin(s):
    """A box, numbers and a file of the same triangles end on the same mesh."""
    numbers = in_numbers(refined({"relative_error": 0.04}))
    file = copy.deepcopy(numbers)
    file["problem"]["mesh"] = {"gmsh": gmsh_of(numbers["problem"]["mesh"]), "refine": "auto"}
    found = []
    for request in (refined({"relative_error": 0.04}), numbers, file):
        summary = s.solved(request)["summary"]
        check(summary["outcome"] == "converged", summary)
        found.append((summary["mesh"]["ladder"][0]["elements"], summary["mesh"]["elements"]))
    check(found[0][0] == found[1][0] == 24 and found[1] == found[2], found)
    check(found[0][1] == found[1][1], found)


def test_fields_find_the_mesh(s):
    for element, cells in (("tri3", (6, 2)), ("tri6", (6, 2)), ("tri3", "auto")):
        job = s.solved(refined({"relative_error": 0.03}, element, cells))
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=von_mises,pressure,nodes,stress,displacements"),
                        200).json
        nodes = len(answer["nodes"])
        check(len(answer["von_mises"]) == len(answer["stress"]) == len(answer["displacements"]) == nodes, element)
        check(nodes > 40 and max(answer["von_mises"]) > 0, nodes)
        expect(s.get(f"/v1/jobs/{job['id']}/result.vtu"), 200)
        expect(s.get(f"/v1/jobs/{job['id']}/deformed.svg"), 200)


def test_levels_and_limits(s):
    summary = s.solved(refined())["summary"]
    check(summary["requested_error"] == 5e-2 and summary["outcome"] == "converged", summary)
    summary = s.solved(refined("precise"))["summary"]
    check(summary["outcome"] == "mesh_limit" and summary["message"], summary)
    summary = s.solved(refined({"relative_error": 2e-3}, time_limit_s=0.2))["summary"]
    check(summary["outcome"] == "time_limit" and summary["error"]["total"] > 2e-3, summary)


def test_a_guaranteed_error_is_met(s):
    """The whole error is the proved one: the energies enclose the body's, and further grids follow until it suffices."""
    summary = s.solved(refined({"total": 0.02, "guaranteed": True}))["summary"]
    error = summary["error"]
    check(summary["outcome"] == "converged" and error["kind"] == "guaranteed" and error["total"] <= 0.02, summary)
    check(summary["mesh"]["refined"] and summary["problem"]["d"] < 1000, summary["mesh"])
    check(summary["mesh"]["ladder"][-1]["discretization_error"] < error["total"], summary["mesh"])


def refused(s, request, code, pointer):
    reply = expect(s.post(request), 422).json
    check(reply["code"] == code and reply.get("pointer", "") == pointer, reply)
    return reply


def test_what_can_not_be_refined_is_refused(s):
    solid = {"problem": {"kind": "scene", "model": "solid", "materials": SCENE["problem"]["materials"],
                         "mesh": {"box": {"size": [1, 1, 1], "cells": [1, 1, 1], "element": "wedge6"}, "refine": "auto"},
                         "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}]}}
    error = expect(s.post(solid, WAIT), 200).json["error"]
    check(error["pointer"] == "/problem/mesh/refine" and "tet4" in error["detail"], error)
    refused(s, refined(stopping="paper"), "not_allowed", "/solver/stopping")
    refused(s, refined(warm_start={"reactions": [0.0]}), "not_allowed", "/solver/warm_start")
    verify = {"problem": refined()["problem"], "answer": {"displacements": [0.0], "reactions": [0.0]}}
    reply = expect(s.request("POST", "/v1/verify", verify), 422).json
    check(reply["code"] == "not_allowed" and reply["pointer"] == "/problem/mesh/refine", reply)
    wrong = refined()
    wrong["problem"]["mesh"]["refine"] = "everywhere"
    check(expect(s.post(wrong), 422).json["pointer"] == "/problem/mesh/refine", "another word")
    del wrong["problem"]["mesh"]["box"]
    wrong["problem"]["mesh"]["refine"] = "auto"
    check(expect(s.post(wrong), 422).json["pointer"] == "/problem/mesh", "no mesh to refine")
    job = s.solved(refined())
    reply = expect(s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": "quick"}), 409).json
    check(reply["code"] == "mesh_is_chosen", reply)


def test_load_cases(s):
    request = refined({"relative_error": 0.04})
    request["cases"] = [{"name": "a", "loads": SCENE["problem"]["loads"]},
                        {"name": "b", "loads": [{"on": "right", "traction": [0, -0.1]}]}]
    job = s.solved(request)
    check(job["summary"]["outcome"] == "converged" and job["summary"]["mesh"]["refined"], job["summary"])
    sizes = {len(expect(s.get(f"/v1/jobs/{job['id']}/result?case={name}&fields=von_mises"), 200).json["von_mises"])
             for name in ("a", "b")}
    check(len(sizes) == 1, sizes)


def test_groups_of_nodes_mean_the_same(s):
    """A force on nodes acts where it did, however many nodes come between; nodes of two sides hold these sides only."""
    request = in_numbers(refined({"relative_error": 0.2}))
    groups = request["problem"]["mesh"]["groups"]
    groups["nodes"] = {"nodes": sorted({i for edge in groups["top"]["edges"] for i in edge})}
    request["problem"]["loads"] = [{"on": "nodes", "force": [0, -1]}]
    del request["problem"]["contacts"]
    summary = s.solved(request)["summary"]
    loads = summary["resultants"]["loads"]
    check(len(summary["mesh"]["ladder"]) > 2 and abs(loads["force"][1] + 1) < 1e-9 and abs(loads["moment"][0] + 30) < 1e-6, loads)
    request["problem"]["loads"] = [{"on": "all", "body_force": [1, -1]}]
    groups["held"] = {"edges": groups["left"]["edges"] + groups["top"]["edges"]}
    groups["held_nodes"] = {"nodes": sorted({i for edge in groups["held"]["edges"] for i in edge})}
    found = []
    for name in ("held", "held_nodes"):
        request["problem"]["supports"] = [{"on": name, "ux": 0, "uy": 0}]
        found.append(s.solved(request)["summary"])
    check(len(found[0]["mesh"]["ladder"]) > 1 and abs(found[1]["energy"]["strain"] / found[0]["energy"]["strain"] - 1) < 1e-9,
          found[0]["energy"], found[1]["energy"])


def test_a_formulation_of_elements_that_are_all_bisected(s):
    request = refined({"relative_error": 0.015}, "quad4", (2, 1))
    request["problem"]["formulation"] = "incompatible_modes"
    summary = s.solved(request)["summary"]
    check(summary["outcome"] == "converged" and summary["mesh"]["elements"] > 16, summary["message"], summary["mesh"])


def block(rng):
    """A block pressed onto a plane, with loads of all kinds; a mesh of a few elements, a fine one, and what to ask for."""
    size, young = [rng.uniform(1, 2.5), rng.uniform(1, 2)], 10**rng.uniform(1, 4)
    supports, loads = [{"on": "top", "ux": 0, "uy": -0.01 * rng.random()}], []
    if rng.random() < 0.3:
        supports.append({"on": "right", "spring": [0.1 * young] * 2})
    if rng.random() < 0.7:
        loads.append({"on": "right", "traction": [0.003 * young * rng.uniform(-1, 1) for _ in range(2)]})
    if rng.random() < 0.3:
        loads.append({"on": "all", "temperature": rng.uniform(-20, 20)})
    if rng.random() < 0.4:
        loads.append({"on": "all", "body_force": [0, -0.003 * young]})
    problem = {"kind": "scene", "model": rng.choice(("plane_strain", "plane_stress", "axisymmetric")), "supports": supports,
               "materials": [{"on": "all", "young": young, "poisson": rng.choice((0, 0.3, 0.4)), "expansion": 1e-4}],
               "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, rng.uniform(-0.005, 0.003)], "normal": [0, 1]}}}],
               "loads": loads, "kinematics": "fixed"}
    few = {"box": {"size": size, "cells": [rng.randint(1, 4), rng.randint(1, 3)],
                   "element": rng.choice(("tri3", "quad4", "tri6", "quad8"))}, "refine": "auto"}
    fine = {"box": {"size": size, "cells": [int(40 * x / max(size)) for x in size], "element": "quad8"}}
    return problem, few, fine, rng.choice((0.1, 0.2))


def check_told(s, problem, few, fine, asked):
    """The error told at the end is at least half of the true one, by the energy of a much finer mesh."""
    mine = s.solved({"problem": {**problem, "mesh": few}, "solver": {"accuracy": {"relative_error": asked}}})["summary"]
    best = s.solved({"problem": {**problem, "mesh": fine}, "solver": {"accuracy": {"relative_error": 1e-6}}})["summary"]
    check(mine["outcome"] == "converged" and mine["error"]["total"] <= asked, mine["message"])
    lost = mine["energy"]["potential"] - best["energy"]["potential"]
    true = math.sqrt(max(0, lost) / best["energy"]["strain"])
    check(mine["error"]["total"] >= 0.5 * true - 1e-4, mine["error"], true, mine["mesh"], problem, few)


def test_a_few_elements_are_not_taken_at_their_word(s):
    """Six triangles that told 0.18 and were 0.76 off."""
    problem = {"kind": "scene", "model": "plane_strain", "materials": [{"on": "all", "young": 339.65, "poisson": 0.3}],
               "supports": [{"on": "top", "ux": 0, "uy": -1.865e-4}, {"on": "right", "spring": [33.97, 33.97]}],
               "loads": [{"on": "all", "body_force": [0, -1.01896]}], "kinematics": "fixed",
               "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.0023656], "normal": [0, 1]}}}]}
    size = [1.6917, 1.8449]
    check_told(s, problem, {"box": {"size": size, "cells": [3, 1], "element": "tri3"}, "refine": "auto"},
               {"box": {"size": size, "cells": [36, 40], "element": "quad8"}}, 0.2)


def test_quadratic_elements_that_would_do_are_looked_at(s):
    """18 to 30 elements were accepted as they are: a flat ring told 0.089 and 0.122 off, a strip that lifts off its plane 0.069 and 0.173."""
    for scene, size, cells, fine in (
            ({"model": "axisymmetric", "supports": [{"on": "bottom", "ux": 0, "uy": 0}], "loads": [{"on": "top", "traction": [-2.2, 0.76]}]}, [2, 0.37], [4, 3], [130, 24]),
            ({"model": "plane_strain", "supports": [{"on": "left", "ux": 0, "uy": 0}], "loads": [{"on": "right", "traction": [0, 2.2]}, {"on": "top", "traction": [0, -3.4]}],
              "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]}, [4, 1], [12, 1], [96, 24])):
        problem = {"kind": "scene", "kinematics": "fixed", "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], **scene}
        mine, best = (s.solved({"problem": {**problem, "mesh": mesh}, **accuracy})["summary"] for mesh, accuracy in (
            ({"box": {"size": size, "cells": cells, "element": "tri6"}, "refine": "auto"}, {"solver": {"accuracy": {"total": 0.1}}}),
            ({"box": {"size": size, "cells": fine, "element": "quad8"}}, {})))
        lost = mine["energy"]["potential"] - best["energy"]["potential"]
        true = math.sqrt(max(0, lost) / (mine["energy"]["strain"] + lost))
        check(mine["outcome"] == "converged" and true < 0.11, mine["error"], true, size)


def test_errors_told_of_blocks_that_begin_with_a_few_elements(s):
    for seed in range(40):
        check_told(s, *block(random.Random(seed)))


def test_client_prints_the_grids(s):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "body.json")
        with open(path, "w") as to:
            json.dump(refined({"relative_error": 0.04}), to)
        done = subprocess.run([s.build / "uzawa", "--server", s.url, "submit", path, "--wait"], capture_output=True,
                              text=True, timeout=120)
    check(done.returncode == 0, done)
    check("elements, refined after" in done.stdout and "24 elements" in done.stdout, done.stdout)


if __name__ == "__main__":
    service.main(globals())
