"""Groups by where they are: in place of names anywhere, in every kind of mesh, never another body's."""
# not under ThreadSanitizer: about answers, not about threads
import copy

import service
from service import SCENE, check, expect

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
ROOF, FOOT, END = {"where": {"y": 20}}, {"where": {"normal": {"direction": [0, -1]}}}, {"where": {"x": 0}}


def solved(s, request):
    job = s.solved(request, "converged")
    return job["summary"], expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements"), 200).json["displacements"]


def refused(s, request, code, pointer, says):
    problem = expect(s.post(request), 422, code).json
    check(problem["pointer"] == pointer and says in problem["detail"], problem)


def by_place(**groups):
    """The paper's body, with places where it has names."""
    request = copy.deepcopy(SCENE)
    problem = request["problem"]
    problem["supports"][0]["on"] = END
    problem["loads"][0]["on"] = ROOF
    problem["loads"][1]["on"] = {"where": {"x": {"min": 59.9}, "normal": {"direction": [1, 0]}}}
    problem["contacts"][0]["on"] = FOOT
    return request


def test_places_are_the_sides_that_they_name(s):
    named, u = solved(s, SCENE)
    summary, v = solved(s, by_place())
    check(u == v, "the same groups give the same numbers")
    check(summary["resultants"]["contacts"][0]["on"] == "normal 0,-1 within 30", summary["resultants"])
    listed = copy.deepcopy(SCENE)
    listed["problem"]["groups"] = [{"name": "roof", "where": ROOF["where"]}]
    listed["problem"]["loads"][0]["on"] = "roof"
    listed["problem"]["supports"][0]["on"] = "-x"
    summary, v = solved(s, listed)
    check(u == v and summary["resultants"]["supports"][0]["on"] == "left", summary["resultants"])


def test_boundary_of_a_box_is_all_its_sides(s):
    """Whatever touches is found, and it is what the sides by name find; a group of one's own may be called so."""
    request = copy.deepcopy(SCENE)
    wall = {"plane": {"point": [60.00005, 0], "normal": [-1, 0]}}
    request["problem"]["contacts"] = [{"on": name, "obstacle": obstacle} for name, obstacle in (("bottom", {"plane": {"point": [0, 0], "normal": [0, 1]}}), ("right", wall))]
    named, u = solved(s, request)
    bottom = named["contact"]["candidates"] - 11  # the other side has so many more
    for contact in request["problem"]["contacts"]:
        contact["on"] = "boundary"
    whole, v = solved(s, request)
    check(named["contact"]["candidates"] < whole["contact"]["candidates"] and named["contact"]["active"] == whole["contact"]["active"] > 20, named["contact"], whole["contact"])
    check(whole["resultants"]["contacts"][1]["force"][0] < -1, whole["resultants"])
    check(max(abs(a - b) for p, q in zip(u, v) for a, b in zip(p, q)) < 1e-6 * max(map(abs, sum(u, []))))
    solid = {"problem": {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [2, 2, 1], "cells": [4, 4, 2]}}, "materials": [{"on": "all", "young": 1e3, "poisson": 0.3}],
                         "supports": [{"on": "front", "ux": 0, "uy": 0, "uz": -0.01}], "contacts": [{"on": "back", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}]}}
    of_back = solved(s, solid)[0]["contact"]
    solid["problem"]["contacts"][0]["on"] = "boundary"
    of_all = solved(s, solid)[0]["contact"]
    check(abs(of_back["reaction_sum"] / of_all["reaction_sum"] - 1) < 1e-7, of_back, of_all)
    request["problem"]["groups"] = [{"name": "boundary", "where": {"y": 0}}]
    check(solved(s, request)[0]["contact"]["candidates"] == 2 * bottom)
    request["problem"].pop("groups")
    request["problem"]["materials"][0]["on"] = "boundary"
    refused(s, request, "not_allowed", "/problem/materials/0/on", "of the box's surface")


def test_the_same_name_elsewhere_is_another_body(s):
    """A factor that is kept for a body must not answer for one whose group of that name is another."""
    def held(where):
        request = copy.deepcopy(SCENE)
        request["problem"]["groups"] = [{"name": "held", "where": where}]
        request["problem"]["supports"] = [{"on": "held", "ux": 0, "uy": 0}]
        return solved(s, request)[1]
    left, right, again = held({"x": 0}), held({"x": 60}), held({"x": 0})
    check(left == again and left != right)
    check(max(map(abs, right[30])) == 0 and max(map(abs, left[30])) > 0, right[30], left[30])


def test_cases_quantities_and_refined_meshes(s):
    request = by_place()
    problem = request["problem"]
    problem["mesh"] = {"box": {"size": [60, 20], "cells": [6, 2], "element": "tri3"}, "refine": "auto"}
    request["solver"] = {"accuracy": {"total": 0.08}}
    request["cases"] = [{"name": "a", "loads": problem["loads"]},
                        {"name": "b", "loads": [{"on": {"where": {"x": {"min": 30}, "y": 20}}, "force": [0, -4]}]}]
    tip = {"quantity": "displacement", "on": {"where": {"nearest": [60, 20]}}, "direction": [0, 1], "name": "tip"}
    request["quantities"] = [tip, {"quantity": "contact.force", "on": FOOT, "name": "foot"}]
    job = s.solved(request)
    names = copy.deepcopy(request)
    for key, name in (("supports", "left"), ("contacts", "bottom")):
        names["problem"][key][0]["on"] = name
    names["quantities"][1]["on"] = "bottom"
    other = expect(s.post(names, WAIT), 200).json
    one, two = job["summary"], other["summary"]
    check(one["contact"] == two["contact"] and one["cases"] == two["cases"], one["contact"], two["contact"])
    check([q["value"] for q in one["quantities"]] == [q["value"] for q in two["quantities"]], one["quantities"])


def test_a_box_of_two_materials(s):
    """By where the elements are; the same in numbers, and with both materials alike as of one."""
    def bar(stiff, mesh=None, soft=None, hard=None):
        request = copy.deepcopy(SCENE)
        problem = request["problem"]
        problem["mesh"] = mesh or {"box": {"size": [60, 20], "cells": [12, 4]}}
        problem["materials"] = [{"on": soft or {"where": {"x": {"max": 30}, "of": "elements"}}, "young": 200e3, "poisson": 0.3},
                                {"on": hard or {"where": {"x": {"min": 30}, "of": "elements"}}, "young": stiff, "poisson": 0.3}]
        return solved(s, request)
    nodes = [[5 * i, 5 * j] for j in range(5) for i in range(13)]
    elements = [[13 * j + i, 13 * j + i + 1, 13 * j + i + 14, 13 * j + i + 13] for j in range(4) for i in range(12)]
    sides = {"left": [[13 * j, 13 * j + 13] for j in range(4)], "right": [[13 * j + 12, 13 * j + 25] for j in range(4)],
             "bottom": [[i, i + 1] for i in range(12)], "top": [[52 + i, 53 + i] for i in range(12)]}
    mesh = {"nodes": nodes, "elements": {"quad4": elements},
            "groups": {**{name: {"edges": edges} for name, edges in sides.items()},
                       "soft": {"elements": [e for e in range(48) if e % 12 < 6]},
                       "hard": {"elements": [e for e in range(48) if e % 12 >= 6]}}}
    (_, u), (_, v) = bar(20e3), bar(20e3, mesh, "soft", "hard")
    (_, same), (_, one) = bar(200e3), solved(s, {**SCENE, "problem": {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": [12, 4]}}}})
    scale = max(abs(c) for p in u for c in p)
    apart = max(abs(a - b) for p, q in zip(u, v) for a, b in zip(p, q))
    check(apart < 1e-9 * scale, apart, scale)
    check(max(abs(a - b) for p, q in zip(same, one) for a, b in zip(p, q)) < 1e-9 * scale)
    check(max(abs(a - b) for p, q in zip(u, same) for a, b in zip(p, q)) > 0.1 * scale, "the soft end gives way")


def test_what_is_nowhere_is_said_with_its_distance(s):
    def on(place, key="supports"):
        request = copy.deepcopy(SCENE)
        request["problem"][key][0]["on"] = place
        return request
    refused(s, on({"where": {"x": -1}}), "bad_scene", "/problem/supports/0/on/where",
           "no node lies there: the nearest node, 0 at (0, 0), is 1 away (the tolerance is 6.32e-05); the body reaches from "
           "(0, 0) to (60, 20)")
    refused(s, on({"where": {"x": 60, "y": 20}}, "contacts"), "bad_scene", "/problem/contacts/0/on", '"x=60 y=20" is made of nodes')
    request = copy.deepcopy(SCENE)
    request["cases"] = [{"name": "a", "loads": [{"on": {"where": {"y": 21}}, "pressure": 1}]}]
    refused(s, request, "bad_scene", "/cases/0/loads/0/on/where", "is 1 away")
    refused(s, on({"where": {}}), "missing_key", "/problem/supports/0/on/where", "")
    refused(s, on({"where": {"w": 1}}), "unknown_key", "/problem/supports/0/on/where/w", "")
    refused(s, on({"at": [0, 0]}), "unknown_key", "/problem/supports/0/on/at", "")
    refused(s, on({"where": {"z": 1}}), "not_allowed", "/problem/supports/0/on/where/z", "for solids")
    refused(s, on("topp", "loads"), "not_allowed", "/problem/loads/0/on", 'Did you mean "top"?')
    request = copy.deepcopy(SCENE)
    request["problem"]["groups"] = [{"name": "left", "where": {"x": 60}}]
    refused(s, request, "bad_scene", "/problem/groups/0/where", 'has a group "left" already')


service.main(globals())
