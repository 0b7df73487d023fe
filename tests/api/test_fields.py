"""What an answer means: fields that are computed when asked for, and the VTK file. usage: test_fields.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import math
import os
import tempfile
import threading

import service
from service import MATRICES, SCENE, check, expect

SHARED = True  # one service for all tests

try:
    import meshio
except ImportError:
    meshio = None

COMPUTED = ["contact_status", "stress", "principal", "von_mises", "strain", "stress_gauss"]
VTU = "displacements,stress,principal,von_mises,strain,pressure,contact_status,reactions,gaps,materials"


def solved(s, request):
    job = s.solved(request)
    return job["id"]


def result(s, job, query=""):
    return expect(s.get(f"/v1/jobs/{job}/result{query}"), 200).json


def close(x, y, tolerance=1e-12):
    return abs(x - y) <= tolerance * max(abs(x), abs(y), 1e-300)


def pulled(cells=(4, 3)):
    """A strip pulled to a uniform stress of 10, free to contract: xx alone."""
    scene = copy.deepcopy(SCENE)
    scene["problem"]["mesh"]["box"]["cells"] = list(cells)
    scene["problem"]["supports"] = [{"on": "left", "ux": 0}]
    scene["problem"]["loads"] = [{"on": "right", "traction": [10, 0]}, {"on": "top", "traction": [0, -1]}]
    scene["solver"] = {"accuracy": "exact"}
    return scene


# ---------------------------------------------------------------- summary

def add(*vectors):
    return [sum(numbers) for numbers in zip(*vectors)]


def test_what_acts_on_the_body(s):
    job = solved(s, SCENE)
    summary = result(s, job)["summary"]
    acts = summary["resultants"]
    check([one["on"] for one in acts["contacts"]] == ["bottom"] and [one["on"] for one in acts["supports"]] == ["left"],
          acts)
    check(all(close(a, b, 1e-9) for a, b in zip(acts["loads"]["force"], [50, -15])), acts["loads"])
    check(acts["contacts"][0]["force"] == summary["contact"]["force"], acts["contacts"])
    bottom = acts["contacts"][0]
    check(close(bottom["normal_force"], bottom["force"][1], 1e-12) and bottom["area"] == summary["contact"]["area"], bottom)
    check(close(bottom["mean_pressure"] * bottom["area"], bottom["normal_force"], 1e-12), bottom)
    check(close(bottom["center"][0] * bottom["force"][1], bottom["moment"][0], 1e-9) and bottom["center"][1] == 0, bottom)
    check("area" not in acts["loads"] and "area" not in acts["supports"][0], acts)
    everything = [acts["loads"], acts["contacts"][0], acts["supports"][0]]
    check(max(map(abs, add(*(one["force"] for one in everything)))) < 1e-4, acts)  # certified to 1e-6
    check(abs(add(*(one["moment"] for one in everything))[0]) < 1e-2 and len(acts["loads"]["moment"]) == 1, acts)
    check(0 <= acts["imbalance"] < 1e-6 and summary["warnings"] == [], summary["warnings"])
    at = summary["contact"]["max_pressure_at"]
    answer = result(s, job, "?fields=pressure,nodes")
    check(answer["pressure"][answer["contact_nodes"].index(at["node"])] == summary["contact"]["max_pressure"], at)
    check(answer["nodes"][at["node"]] == at["x"], at)
    check(0 < summary["contact"]["area"] < 300 and close(summary["energy"]["strain"], -summary["energy"]["dual"], 1e-6),
          summary["energy"])


def test_each_case_has_its_own_resultants(s):
    request = copy.deepcopy(SCENE)
    request["cases"] = [{"name": "pressed", "loads": [{"on": "top", "traction": [0, -1]}]}, {"name": "free", "loads": []}]
    cases = result(s, solved(s, request))["cases"]
    check([round(case["summary"]["resultants"]["loads"]["force"][1], 9) for case in cases] == [-300, 0], cases)
    check(cases[1]["summary"]["contact"]["max_pressure_at"] is None, cases[1]["summary"]["contact"])
    free = cases[1]["summary"]["resultants"]["contacts"][0]
    check(free["mean_pressure"] is None and free["center"] == [None, None] and free["normal_force"] == 0, free)


def test_matrices_have_no_resultants(s):
    summary = result(s, solved(s, MATRICES))["summary"]
    check(not {"resultants", "warnings"} & set(summary) and "strain" not in summary["energy"], summary)


def test_large_deformation_is_doubted(s):
    scene = copy.deepcopy(SCENE)
    scene["problem"]["loads"] = [{"on": "top", "traction": [0, 1000]}]
    warnings = result(s, solved(s, scene))["summary"]["warnings"]
    check(["large_rotation"] == [w["code"] for w in warnings if w["value"] > 0.1][:1], warnings)
    check(all(w["message"] for w in warnings), warnings)


# ------------------------------------------------------------------- JSON

def test_uniform_stress(s):
    answer = result(s, solved(s, pulled()), "?fields=" + ",".join(COMPUTED))
    nodes = len(answer["nodes"])
    check(nodes == 20 and answer["components"] == ["xx", "yy", "zz", "xy"], answer["components"])
    for sigma in answer["stress"]:
        check(all(abs(a - b) <= 1e-9 for a, b in zip(sigma, [10, -1, 0, 0])), sigma)
    check(all(close(v, math.sqrt(111), 1e-9) for v in answer["von_mises"]), answer["von_mises"])
    check(all(abs(a - b) <= 1e-9 for p in answer["principal"] for a, b in zip(p, [10, 0, -1])), answer["principal"])
    check(all(close(e[0], 10.3 / 200e3, 1e-9) and close(e[2], -0.3 * 9 / 200e3, 1e-9) for e in answer["strain"]),
          answer["strain"][0])
    check(answer["contact_status"] == [1] * 5, answer["contact_status"])
    gauss = answer["stress_gauss"]
    check(gauss["elements"] == [e for e in range(12) for _ in range(4)], gauss["elements"])
    check(len(gauss["points"]) == len(gauss["stress"]) == 48 and len(gauss["points"][0]) == 2, gauss["points"][0])
    check(all(close(sigma[0], 10, 1e-9) for sigma in gauss["stress"]), gauss["stress"][0])


def test_only_what_was_asked_for(s):
    job = solved(s, pulled())
    for field in COMPUTED:
        answer = result(s, job, f"?fields={field}")
        extra = {"components"} if "stress" in field or field == "strain" else set()
        extra |= {"contact_nodes"} if field == "contact_status" else set()
        extra |= {"nodes"} if field not in ("contact_status", "stress_gauss") else set()
        check(set(answer) == {"job", "summary", field} | extra, field, sorted(answer))
    check(set(result(s, job, "?fields=nodes")) == {"job", "summary", "nodes"})
    check(set(result(s, job)) == {"job", "summary", "reactions", "gaps", "contact_nodes"})


def test_pressure_of_a_uniform_load(s):
    answer = result(s, solved(s, pulled((7, 2))), "?fields=pressure,reactions")
    check(all(close(p, 1, 1e-9) for p in answer["pressure"]), answer["pressure"])
    check(close(answer["summary"]["contact"]["max_pressure"], 1, 1e-9), answer["summary"]["contact"])


def test_cases(s):
    request = pulled()
    loads = request["problem"]["loads"]
    request["cases"] = [{"name": "once"}, {"name": "twice", "loads": [
        {"on": load["on"], "traction": [2 * t for t in load["traction"]]} for load in loads]}]
    request["cases"][0]["loads"] = loads
    job = solved(s, request)
    everything = result(s, job, "?fields=stress,von_mises,contact_status")
    for factor, case in zip((1, 2), everything["cases"]):
        check(all(close(sigma[0], 10 * factor, 1e-9) for sigma in case["stress"]), case["name"])
        one = result(s, job, f"?fields=stress,von_mises,contact_status&case={case['name']}")
        check(all(one[field] == case[field] for field in ("stress", "von_mises", "contact_status")), case["name"])
    expect(s.get(f"/v1/jobs/{job}/result.vtu"), 400, "case_needed")
    expect(s.get(f"/v1/jobs/{job}/result.vtu?case=thrice"), 404, "case_not_found")
    expect(s.get(f"/v1/jobs/{job}/result.vtu?case=twice"), 200)


def test_too_many_numbers_for_one_reply(s):
    request = pulled((60, 60))
    request["cases"] = [{"name": f"c{i}", "loads": request["problem"]["loads"]} for i in range(40)]
    job = solved(s, request)
    expect(s.get(f"/v1/jobs/{job}/result?fields=stress_gauss"), 413, "result_too_large")
    expect(s.get(f"/v1/jobs/{job}/result?fields=von_mises"), 200)
    expect(s.get(f"/v1/jobs/{job}/result?fields=stress_gauss&case=c7"), 200)


def test_refusals(s):
    job = solved(s, pulled())
    for path in ("result?fields=stress,strss", "result?fields=materials", "result?fields=", "result.vtu?fields=foo",
                 "result.vtu?fields=stress_gauss"):
        problem = expect(s.get(f"/v1/jobs/{job}/{path}"), 400, "bad_parameter").json
        check("von_mises" in problem["detail"], problem)
    matrices = solved(s, MATRICES)
    for path in ("result?fields=stress", "result?fields=contact_status", "result.vtu"):
        expect(s.get(f"/v1/jobs/{matrices}/{path}"), 409, "not_a_scene")
    expect(s.get("/v1/jobs/" + "0" * 32 + "/result.vtu"), 404)
    check("Allow" not in s.get(f"/v1/jobs/{job}/result.vtu").headers)
    expect(s.request("POST", f"/v1/jobs/{job}/result.vtu"), 405)


def test_an_infeasible_scene_has_no_stress(s):
    scene = copy.deepcopy(SCENE)
    scene["problem"]["contacts"] = [{"on": "bottom", "obstacle": {"plane": {"point": [0, 1], "normal": [0, 1]}}},
                                    {"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, -1]}}}]
    scene["problem"]["supports"] = [{"on": "left", "ux": 0}]
    job = solved(s, scene)
    answer = result(s, job, "?fields=stress,von_mises,pressure")
    check(answer["summary"]["outcome"] == "infeasible", answer["summary"])
    check(all(sigma == [None, None, 0, None] for sigma in answer["stress"]), answer["stress"][0])  # plane: zz is 0
    check(set(answer["von_mises"]) == set(answer["pressure"]) == {None}, answer["pressure"])
    expect(s.get(f"/v1/jobs/{job}/result.vtu"), 200)


def test_replies_at_a_time(s):
    """Many at once: each is answered, and the same."""
    job = solved(s, pulled((40, 30)))
    replies = []
    threads = [threading.Thread(target=lambda: replies.append(s.get(f"/v1/jobs/{job}/result?fields=stress,principal")))
               for _ in range(12)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    check(len(replies) == 12 and all(reply.status == 200 for reply in replies), [reply.status for reply in replies])
    check(all(reply.json["stress"] == replies[0].json["stress"] for reply in replies))


# -------------------------------------------------------------------- vtu

def read_vtu(s, job, query=""):
    reply = expect(s.get(f"/v1/jobs/{job}/result.vtu{query}"), 200)
    check(reply.headers["content-type"] == "application/xml", reply.headers)
    if not meshio:
        raise service.Skip("python3-meshio is not installed")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "result.vtu")
        with open(path, "wb") as file:
            file.write(reply.body)
        return meshio.read(path)


def same(array, rows, width):
    """A VTK array and JSON rows; missing components are 0."""
    return len(array) == len(rows) and all(
        list(a) == [r[i] if i < len(r) else 0 for i in range(width)] for a, r in zip(array.tolist(), rows))


def check_vtu(s, request, cells):
    job = solved(s, request)
    answer = result(s, job, "?fields=displacements,pressure,reactions,gaps,stress,principal,von_mises,strain,contact_status")
    mesh = read_vtu(s, job, f"?fields={VTU}")
    dim = len(answer["nodes"][0])
    check(same(mesh.points, answer["nodes"], 3), mesh.points[:3])
    check({block.type: len(block.data) for block in mesh.cells} == cells, mesh.cells)
    check(same(mesh.point_data["displacements"], answer["displacements"], 3))
    for field in ("stress", "strain"):
        check(same(mesh.point_data[field], answer[field], 6), field)
    check(same(mesh.point_data["principal"], answer["principal"], 3))
    check(mesh.point_data["von_mises"].tolist() == answer["von_mises"], mesh.point_data["von_mises"][:3], answer["von_mises"][:3])
    check(sum(len(m) for m in mesh.cell_data["materials"]) == sum(cells.values()))
    rows = {node: i for i, node in enumerate(answer["contact_nodes"])}
    for field, elsewhere in (("pressure", 0), ("reactions", 0), ("contact_status", -1), ("gaps", None)):
        values = mesh.point_data[field].tolist()
        for node, value in enumerate(values):
            want = answer[field][rows[node]] if node in rows else elsewhere
            check(math.isnan(value) if want is None else value == want, field, node, value, want)
    return dim


def test_vtu_of_a_plane(s):
    check(check_vtu(s, SCENE, {"quad": 300}) == 2)


SOLID = {"problem": {"kind": "scene", "model": "solid",
                     "mesh": {"box": {"size": [2, 1, 1], "cells": [3, 2, 2], "element": "tet10"}},
                     "materials": [{"on": "all", "young": 200e3, "poisson": 0.3}],
                     "supports": [{"on": "left", "ux": 0, "uz": 0}],
                     "loads": [{"on": "top", "pressure": 5}],
                     "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}}]}}
# Two materials in two kinds of elements, side by side.
MIXED = {"problem": {"kind": "scene", "model": "plane_strain", "thickness": 1,
                     "mesh": {"nodes": [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]],
                              "elements": {"tri3": [[0, 1, 4], [0, 4, 3]], "quad4": [[1, 2, 5, 4]]},
                              "groups": {"soft": {"elements": [0, 1]}, "hard": {"elements": [2]},
                                         "below": {"edges": [[0, 1], [1, 2]]}, "above": {"edges": [[4, 3], [5, 4]]},
                                         "side": {"nodes": [0, 3]}}},
                     "materials": [{"on": "soft", "young": 10, "poisson": 0.3}, {"on": "hard", "young": 1000, "poisson": 0.2}],
                     "supports": [{"on": "side", "ux": 0}],
                     "loads": [{"on": "above", "pressure": 0.1}],
                     "contacts": [{"on": "below", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]}}


def test_vtu_of_a_solid(s):
    check(check_vtu(s, SOLID, {"tetra10": 72}) == 3)


def test_vtu_of_mixed_elements_and_materials(s):
    check(check_vtu(s, MIXED, {"triangle": 2, "quad": 1}) == 2)
    mesh = read_vtu(s, solved(s, MIXED))
    check([m.tolist() for m in mesh.cell_data["materials"]] == [[0, 0], [1]], mesh.cell_data)


def test_vtu_of_several_blocks(s):
    """Arrays of more than one compressed block of 1 MiB."""
    scene = copy.deepcopy(SCENE)
    scene["problem"]["mesh"]["box"]["cells"] = [220, 110]
    scene["solver"] = {}
    check_vtu(s, scene, {"quad": 24200})


def test_default_fields_of_vtu(s):
    mesh = read_vtu(s, solved(s, SCENE))
    check(set(mesh.point_data) == {"displacements", "stress", "von_mises", "pressure", "gaps", "contact_status"},
          set(mesh.point_data))
    check(set(mesh.cell_data) == {"materials"}, set(mesh.cell_data))


if __name__ == "__main__":
    service.main(globals())
