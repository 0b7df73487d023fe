"""The guaranteed bound on the whole error, through the service. usage: test_guaranteed.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import itertools
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import service
from service import SCENE, check, expect, some
from two_bodies import body

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "extremes"))
import bounds  # noqa: after its place is known

SHARED = True  # one service for all tests

LOWEST, HIGHEST = -3.96275665e-3, -3.96275643e-3  # the continuum's minimum for the paper's body lies between


def asked(accuracy, **changes):
    request = copy.deepcopy(SCENE)
    request["problem"].update(changes)
    request["solver"] = {"accuracy": accuracy}
    return request


def summary_of(s, request):
    job = s.solve(request)
    check(job["status"] == "successful", job)
    return job["summary"]


def test_paper_body(s):
    summary = summary_of(s, asked({"total": 0.03, "guaranteed": True}))
    error = summary["error"]
    check(summary["outcome"] == "converged" and error["kind"] == "guaranteed" and "why" not in error, summary)
    check(abs(error["total"] - 0.0254) < 6e-5 and error["mesh"] >= error["total"], error)
    check(error["energy_low"] <= LOWEST and error["energy_high"] >= HIGHEST, error)
    check(0.019 < error["estimated_mesh"] < error["total"] and error["dual_unknowns"] == 2560 - 40, error)


def test_paper_body_on_finer_meshes(s):
    """The energy from below is below the body's on each, whatever the mesh; two of them to five digits."""
    for cells, total, low in ((45, None, None), (60, 0.0154, -3.9629288e-3), (75, None, None), (120, 0.0093, -3.9628169e-3), (240, None, None)):
        if cells > 60 and service.INSTRUMENTED:
            continue
        request = asked({"guaranteed": True})
        request["problem"]["mesh"]["box"]["cells"] = [cells, cells // 3]
        error = summary_of(s, request)["error"]
        check(error["kind"] == "guaranteed" and error["energy_low"] <= LOWEST and error["energy_high"] >= HIGHEST, cells, error)
        if total:
            check(abs(error["total"] - total) < 6e-5 and abs(error["energy_low"] - low) < 6e-11, cells, error)


def test_a_bracket_on_a_bolt_and_a_wall(s):
    """The gallery's, without any support: what is proved on one mesh of its polygon and another has the same body's energy within, and refinement
    goes where the bolt presses."""
    problem, mesh = bounds.trade.bracket()
    mesh.arcs = []
    found = []
    for of, quadratic in some(((mesh, False), (mesh.halved(), False), (mesh, True)), 2):
        request = {"problem": {**problem, "mesh": of.json(quadratic), "kinematics": "fixed"}, "solver": {"accuracy": {"guaranteed": True}}}
        summary = summary_of(s, request)
        check(summary["error"]["kind"] == "guaranteed", summary["error"])
        found.append(summary["error"])
    check(max(e["energy_low"] for e in found) <= min(e["energy_high"] for e in found), found)
    check(found[-1]["total"] < 0.2 and found[1]["total"] < 0.5 * found[0]["total"], found)
    refined = summary_of(s, {"problem": {**problem, "mesh": {**mesh.json(True), "refine": "auto"}}, "solver": {"accuracy": {"total": 0.15 if service.INSTRUMENTED else 0.1, "guaranteed": True}}})
    check(refined["outcome"] == "converged" and refined["problem"]["d"] < 1.25 * 3110, refined["problem"], refined["error"])


def test_middle_nodes_of_a_file_with_few_digits(s):
    """Places with six decimals: what is proved is that of straight sides, and says so; sides that are bent are refused."""
    at = [0, 1 / 3, 0.57, 1]
    mesh = bounds.trade.plate([1, 1], [3, 3])
    mesh.nodes = [[at[round(3 * x)], at[round(3 * y)] + 0.1 * at[round(3 * x)] * at[round(3 * y)]] for x, y in mesh.nodes]
    found = []
    for digits, bend in ((None, 0), (6, 0), (6, 1e-3)):
        of = mesh.json(True)
        if digits:
            of["nodes"] = [[round(x, digits), round(y, digits)] for x, y in of["nodes"]]
        of["nodes"][of["elements"]["quad8"][4][5]][0] += bend
        problem = {**BLOCK, "mesh": of, "kinematics": "fixed", "contacts": [{"on": "bottom", "obstacle": {"circle": {"center": [0.4, -2], "radius": 2}}}]}
        found.append(summary_of(s, {"problem": problem, "quantities": ASKED, "solver": {"accuracy": {"guaranteed": True}}}))
    exact, rounded, bent = (one["error"] for one in found)
    check(exact["kind"] == rounded["kind"] == "guaranteed" and "straightened" not in exact and 1e-7 < rounded["straightened"] < 1e-5, exact, rounded)
    check(abs(rounded["bound"] / exact["bound"] - 1) < 0.01, rounded, exact)
    check(bent["kind"] == "estimated" and "curved sides" in bent["why"] and "straightened" not in bent, bent)
    for one, other in zip(found[0]["quantities"], found[1]["quantities"]):
        check(one["kind"] == other["kind"] and (one["kind"] == "estimated" or max(one["low"], other["low"]) < min(one["high"], other["high"])), one, other)


def test_a_mesh_that_is_too_coarse(s):
    summary = summary_of(s, asked({"total": 0.02, "guaranteed": True}))
    check(summary["outcome"] == "mesh_limit" and summary["error"]["kind"] == "guaranteed", summary)
    check("at most 0.0254" in summary["message"] and summary["requested_error"] == 0.02, summary["message"])
    summary = summary_of(s, asked({"total": 0.03}))
    check(summary["outcome"] == "converged" and summary["error"]["kind"] == "estimated", summary)


def test_what_is_not_proved(s):
    """A ridge in which the body stands, at a place where the closest point of it is no way out."""
    contacts = [{"on": "bottom", "obstacle": {"polyline": {"points": [[0, -20], [30, 0.01], [60, -20]]}}}]
    summary = summary_of(s, asked({"guaranteed": True}, contacts=contacts))
    error = summary["error"]
    check(error["kind"] == "estimated" and "no way out" in error["why"], error)
    check(summary["outcome"] == "converged" and error["total"] > 0 and "bound" not in error, summary)
    for cells in ([30, 10], "auto"):  # an estimate is not what was asked for
        request = asked({"total": 0.3, "guaranteed": True}, contacts=contacts)
        request["problem"]["mesh"]["box"]["cells"] = cells
        summary = summary_of(s, request)
        check(summary["outcome"] == "mesh_limit" and "not guaranteed" in summary["message"], summary)


def test_lines_and_tables(s):
    """A block on a ridge, in a groove, on teeth, on a polygon: bounds and intervals of all meshes have something in common, and get
    smaller with the cells."""
    points = [[-1, -0.03], [0.17, -0.0005], [0.41, 0], [0.83, -0.004], [2, -0.05]]
    shapes = {"ridge": {"polyline": {"points": [[-1, -0.05], [0.4, 0], [2, -0.06]]}},
              "groove": {"polyline": {"points": [[-1, 0.014], [0.4, 0], [2, 0.016]]}},
              "table": {"height": {"x": [x for x, _ in points], "z": [z for _, z in points]}},
              "polygon": {"polyline": {"points": [[-0.3, -0.5], [-0.3, -0.02], [0.6, 0], [1.4, -0.01], [1.4, -0.5], [-0.3, -0.5]]}}}
    for name, shape in some(shapes.items()):
        contacts = [{"on": "bottom", "obstacle": shape}]
        bounds, low, high = [], {}, {}
        for cells in (6, 12, 24)[:2 if service.INSTRUMENTED else 3]:
            problem = {**BLOCK, "kinematics": "fixed", "contacts": contacts, "mesh": {"box": {"size": [1, 1], "cells": [cells, cells], "element": "quad8"}}}
            summary = summary_of(s, {"problem": problem, "quantities": ASKED, "solver": {"accuracy": {"guaranteed": True}}})
            error = summary["error"]
            check(error["kind"] == "guaranteed" and "why" not in error, name, error)
            bounds.append(error["bound"])
            for one in [*summary["quantities"], {"name": "energy", "kind": "guaranteed", "low": error["energy_low"], "high": error["energy_high"]}]:
                check(one["kind"] == "estimated" or "why" not in one, one)
                if one["kind"] == "guaranteed":
                    low[one["name"]] = max(low.get(one["name"], one["low"]), one["low"])
                    high[one["name"]] = min(high.get(one["name"], one["high"]), one["high"])
        check(len(low) == 6 and all(low[key] <= high[key] for key in low), name, low, high)
        check(len(bounds) < 3 or bounds[2] < 0.6 * bounds[0], name, bounds)


def test_nothing_to_be_relative_to(s):
    for cells in ([30, 10], "auto"):  # nothing happens, and nothing is off
        request = asked({"total": 0.01, "guaranteed": True}, loads=[])
        request["problem"]["mesh"]["box"]["cells"] = cells
        summary = summary_of(s, request)
        check(summary["outcome"] == "converged" and summary["error"]["total"] == summary["error"]["bound"] == 0, summary)
    held = [{"on": "left", "ux": 1, "uy": 1}]
    summary = summary_of(s, asked({"total": 0.01, "guaranteed": True}, loads=[], supports=held, contacts=[]))
    error = summary["error"]  # carried along by its supports: relative to its way
    check(summary["outcome"] == "converged" and 0 < error["bound"] < 1e-6 and 0 < error["total"] < 1e-9, error)


def test_cases_and_chosen_cells(s):
    request = asked({"guaranteed": True})
    loads = request["problem"]["loads"]
    request["cases"] = [{"name": "as it is", "loads": loads}, {"name": "pulled", "loads": [loads[-1]]}]
    summary = summary_of(s, request)
    check(summary["error"]["kind"] == "guaranteed" and summary["error"]["total"] >= 0.0254 - 6e-5, summary["error"])
    request = asked({"total": 0.03, "guaranteed": True})
    request["problem"]["mesh"]["box"]["cells"] = "auto"
    summary = summary_of(s, request)
    check(summary["outcome"] == "converged" and summary["error"]["total"] <= 0.03, summary)
    check(summary["error"]["kind"] == "guaranteed" and summary["requested_error"] == 0.03, summary["error"])


BLOCK = {"kind": "scene", "model": "plane_strain", "mesh": {"box": {"size": [1, 1], "cells": [24, 24], "element": "quad8"}},
         "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "loads": [],
         "supports": [{"on": "top", "uy": -0.01}, {"on": "left", "ux": 0}],
         "contacts": [{"on": "bottom", "obstacle": {"circle": {"center": [0, -2], "radius": 2}}}]}
ASKED = [{"quantity": "contact.force", "on": "bottom", "name": "force"}, {"quantity": "strain_energy"},
         {"quantity": "reaction", "on": "top", "direction": [0, 1], "name": "reaction"},
         {"quantity": "displacement", "on": "right", "direction": [1, 0], "name": "right"},
         {"quantity": "displacement", "on": "all", "direction": [0, 1], "name": "down"}]


def test_quantities(s):
    """On a circle: 2.8434, -2.8422, 1.1127e-3 by a mesh of 64 x 64 quad8 cells, a little more by theirs."""
    summary = summary_of(s, {"problem": BLOCK, "quantities": ASKED, "solver": {"accuracy": {"guaranteed": True}}})
    found = {one["name"]: one for one in summary["quantities"]}
    check(all(one["kind"] == "guaranteed" and "why" not in one for one in found.values()), found)
    for name, true in (("force", 2.8445), ("reaction", -2.8433), ("right", 1.1131e-3), ("strain_energy", 0.013046)):
        one = found[name]
        check(one["low"] < true < one["high"] and one["high"] - one["low"] < 0.08 * abs(true), one)
        check(abs(one["value"] - true) < 3e-3 * abs(true), one)
    check(found["down"]["low"] < found["down"]["on_this_mesh"] < found["down"]["high"] < 0, found["down"])


def test_without_a_factor(s):
    """The same intervals, and as much is proved: adjoints were left at two digits, by which energies were only estimated."""
    scene = {"model": "plane_strain", "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "kinematics": "fixed",
             "supports": [{"on": "left", "ux": 0, "uy": 0}, {"on": "floor", "ux": 0, "uy": 0}],
             "loads": [{"on": "top", "traction": [1.5, -5]}], "contacts": [{"on": "bottom", "with": "bed"}]}
    groups = {"left": [(0, "left")], "top": [(0, "top")], "bottom": [(0, "bottom")], "bed": [(1, "top")], "floor": [(1, "bottom")]}
    pair = body(("quad8", "quad8"), ((6, 2), (7, 3)), (lambda x, y: (4 * x, 1.2 * y), lambda x, y: (4.8 * x - 0.4, 1.5 * y - 1.5)), groups, **scene)
    pair["quantities"] = [{"quantity": "contact.force"}, {"quantity": "strain_energy"}, {"quantity": "displacement", "on": "top", "direction": [3, 4]}]
    found = []
    for operator in "condensed", "matrix_free":
        pair["solver"] = {"operator": operator, "accuracy": {"relative_error": 1e-8, "guaranteed": True}}
        found.append(summary_of(s, pair)["quantities"])
    for factor, free in zip(*found):
        width, other = factor["high"] - factor["low"], free["high"] - free["low"]
        check(factor["kind"] == free["kind"] and abs(other - width) < 1e-2 * width, factor, free)
    check(found[0][1]["kind"] == "guaranteed", found[0])


TUBE = {"kind": "scene", "model": "axisymmetric", "mesh": {"box": {"origin": [1, 0], "size": [1, 1], "cells": [16, 4], "element": "quad4"}},
        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "supports": [{"on": "bottom", "uy": 0}, {"on": "top", "uy": 0}],
        "loads": [{"on": "left", "pressure": 10}], "contacts": []}


def test_a_thick_tube(s):
    """Lame's, between smooth plates: what its radii move by, the force on the plates, and half the work of the pressure."""
    ratio, inner = 10 * 1 / (4 - 1), 1.3 / 1000 * 10 / 3 * (0.4 + 4)
    outer, plate = 1.3 / 1000 * ratio * (0.4 * 2 + 4 / 2), -0.3 * 2 * ratio * math.pi * 3
    asked = [{"quantity": "displacement", "on": "left", "direction": [1, 0], "name": "inner"}, {"quantity": "strain_energy"},
             {"quantity": "displacement", "on": "right", "direction": [1, 0], "name": "outer"},
             {"quantity": "reaction", "on": "bottom", "direction": [0, 1], "name": "plate"}]
    energy = 0.5 * 10 * inner * 2 * math.pi
    for element, within in (("tri3", 0.1), ("quad4", 0.1), ("tri6", 0.01), ("quad8", 0.01)):
        problem = copy.deepcopy(TUBE)
        problem["mesh"]["box"]["element"] = element
        summary = summary_of(s, {"problem": problem, "quantities": asked, "solver": {"accuracy": {"guaranteed": True}}})
        error = summary["error"]
        check(error["kind"] == "guaranteed" and error["energy_low"] <= -energy <= error["energy_high"], error)
        check(error["total"] < within, error)
        for one in summary["quantities"]:
            true = {"inner": inner, "outer": outer, "plate": plate, "strain_energy": energy}[one["name"]]
            check(one["kind"] == "guaranteed" and one["low"] <= true <= one["high"], element, one, true)
            check(one["high"] - one["low"] < within ** 2 * abs(true) * 4, element, one, true)


def test_a_disc_on_a_plane(s):
    """To the axis, pressed by a plate it sticks to. A finer mesh is proved to be near what the coarse one is told to be."""
    found = []
    for cells in ([8, 8], [32, 32]):
        problem = copy.deepcopy(TUBE)
        problem["mesh"]["box"].update({"origin": [0, 0], "cells": cells, "element": "quad8"})
        problem["supports"] = [{"on": "left", "ux": 0}, {"on": "top", "ux": 0, "uy": -0.01}]
        problem["loads"] = [{"on": "right", "traction": [5, 3]}]
        problem["contacts"] = [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0.01, 1]}}}]
        request = {"problem": problem, "solver": {"accuracy": {"guaranteed": True}},
                   "quantities": [{"quantity": "contact.force", "on": "bottom"}, {"quantity": "strain_energy"}]}
        found.append(summary_of(s, request))
    errors = [one["error"] for one in found]
    check(all(error["kind"] == "guaranteed" and "why" not in error for error in errors), errors)
    low, high = errors[1]["energy_low"], errors[1]["energy_high"]
    check(errors[0]["energy_low"] <= low <= high <= errors[0]["energy_high"], errors)
    check(errors[1]["total"] < 0.4 * errors[0]["total"] < 0.05, errors)
    for coarse, fine in zip(*[one["quantities"] for one in found]):
        check(coarse["kind"] == fine["kind"] == "guaranteed", coarse, fine)
        check(max(coarse["low"], fine["low"]) <= min(coarse["high"], fine["high"]), coarse, fine)
        check(fine["high"] - fine["low"] < 0.3 * (coarse["high"] - coarse["low"]), coarse, fine)


def test_rings_before_what_turns(s):
    """A ball, a ring of round section, and a cone with a blunt tip below a disc: bounds and intervals of all meshes have something in
    common, and get smaller with the cells. Where the disc is around its axis, and where it has a hole; with weight as well."""
    shapes = {"ball": {"circle": {"center": [0, -2], "radius": 2}}, "ring": {"circle": {"center": [0.6, -1], "radius": 1}},
              "cone": {"polyline": {"points": [[-1, -0.02], [0.3, 0], [0.55, 0], [2, -0.03]]}}}
    for (name, shape), (inner, weight) in some(itertools.product(shapes.items(), ((0, 0), (0.2, -3))), 5):
        low, high, bounds = {}, {}, []
        for element, cells in (("quad4", 8), ("quad8", 8), ("quad8", 24))[:2 if service.INSTRUMENTED else 3]:
            problem = copy.deepcopy(TUBE)
            problem.update(kinematics="fixed", contacts=[{"on": "bottom", "obstacle": shape}])
            problem["mesh"]["box"].update({"origin": [inner, 0], "cells": [cells, cells], "element": element})
            problem["loads"] = [{"on": "right", "traction": [2, 1]}, {"on": "all", "body_force": [0, weight]}]
            problem["supports"] = [{"on": "top", "uy": -0.04}]
            asked = [{"quantity": "contact.force", "on": "bottom", "name": "force"}, {"quantity": "strain_energy"},
                     {"quantity": "displacement", "on": "right", "direction": [1, 0], "name": "right"}]
            summary = summary_of(s, {"problem": problem, "quantities": asked, "solver": {"accuracy": {"guaranteed": True}}})
            error = summary["error"]
            check(error["kind"] == "guaranteed" and "why" not in error, name, error)
            if name == "ring":  # at the axis, where the others have most of their pressure, nothing presses on the coarsest elements
                check(error["total"] < 3.5 * error["estimated_mesh"], name, element, cells, error)
            bounds.append(error["bound"])
            for one in [*summary["quantities"], {"name": "energy", "kind": "guaranteed", "low": error["energy_low"], "high": error["energy_high"]}]:
                check(one["kind"] == "guaranteed", name, one)
                low[one["name"]] = max(low.get(one["name"], one["low"]), one["low"])
                high[one["name"]] = min(high.get(one["name"], one["high"]), one["high"])
        check(len(low) == 4 and all(low[key] <= high[key] for key in low), name, low, high)
        check(low["force"] > 0 and (len(bounds) < 3 or bounds[2] < 0.65 * bounds[1]), name, low, bounds)


def test_rings_that_are_not_proved(s):
    """An axis that is to hold the body."""
    problem = copy.deepcopy(TUBE)
    problem["mesh"]["box"]["origin"] = [0, 0]
    problem["loads"] = []
    problem["supports"] = [{"on": "top", "uy": -0.01}, {"on": "left", "uy": -0.01}]
    error = summary_of(s, {"problem": problem, "solver": {"accuracy": {"guaranteed": True}}})["error"]
    check(error["kind"] == "estimated" and "axis of revolution" in error["why"], error)


def test_quantities_that_are_not_proved(s):
    """The paper's body touches its obstacle at a support: no displacement is 1 on the one and 0 at the other."""
    request = asked({"guaranteed": True})
    request["quantities"] = [{"quantity": "contact.force"}, {"quantity": "displacement", "on": "right", "direction": [0, 1]},
                             {"quantity": "mean_pressure", "window": {"min": [20, -1], "max": [40, 1]}}]
    force, displacement, pressure = summary_of(s, request)["quantities"]
    check(force["kind"] == "estimated" and "meets supports" in force["why"] and force["low"] < force["high"], force)
    check(displacement["kind"] == "guaranteed" and displacement["low"] < displacement["high"] < 0, displacement)
    check(pressure["kind"] == "estimated" and "window" in pressure["why"], pressure)
    del request["quantities"]  # as the accuracy
    request["solver"]["accuracy"] = {"quantity": "contact.force", "relative": 1, "guaranteed": True}
    summary = summary_of(s, request)
    check(summary["outcome"] == "mesh_limit" and "is not guaranteed" in summary["message"], summary)
    request["solver"]["accuracy"] = {"quantity": "displacement", "on": "right", "direction": [0, 1], "relative": 0.1, "guaranteed": True}
    summary = summary_of(s, request)
    check(summary["outcome"] == "converged" and summary["quantities"][0]["kind"] == "guaranteed", summary)
    refused = s.post({**request, "quantities": [{"quantity": "contact.force", "guaranteed": True}]})
    expect(refused, 422, "not_allowed")


def test_a_force_within_two_percent(s):
    """Proved, on a mesh that is refined for it, in the words of the client, too."""
    problem = copy.deepcopy(BLOCK)
    problem["mesh"] = {"box": {"size": [1, 1], "cells": [8, 8], "element": "tri6"}, "refine": "auto"}
    request = {"problem": problem, "solver": {"accuracy": {"quantity": "contact.force", "on": "bottom", "relative": 0.02, "guaranteed": True}},
               "assert": [{"quantity": "quantities.contact_force_bottom", "min": 2.7, "max": 3}]}
    summary = summary_of(s, request)
    force = summary["quantities"][0]
    check(summary["outcome"] == "converged" and force["kind"] == "guaranteed", summary["message"], force)
    check(force["low"] < 2.8445 < force["high"] and force["high"] - force["low"] < 0.0401 * force["value"], force)
    with tempfile.TemporaryDirectory() as folder:
        path, report = f"{folder}/force.json", f"{folder}/report.xml"
        with open(path, "w", encoding="utf-8") as to:
            json.dump(request, to)
        done = subprocess.run([str(s.build / "uzawa"), "--server", f"http://{s.host}:{s.port}", "submit", path, "--wait", "--junit", report],
                              capture_output=True, text=True, check=False)
        check(done.returncode == 0 and ", guaranteed; " in done.stdout and "by estimate" not in done.stdout, done.stdout, done.stderr)
        with open(report, encoding="utf-8") as written:
            check("guaranteed within" in written.read(), path)


def test_a_round_obstacle(s):
    """Half a block under a disc, refined where quantities ask for it until they are proved, with few unknowns: all that
    there is of room along sides is used, and the answer of least energy that is out of the disc. The force is 53.695."""
    problem = copy.deepcopy(BLOCK)
    problem["mesh"] = {"box": {"size": [20, 40], "cells": [4, 8], "element": "tri6"}, "refine": "auto"}
    problem["materials"] = [{"on": "all", "young": 1000, "poisson": 0.3}]
    problem["supports"] = [{"on": "bottom", "uy": 0}, {"on": "left", "ux": 0}]
    problem["loads"] = []
    problem["contacts"] = [{"on": "top", "obstacle": {"circle": {"center": [0, 69.75], "radius": 30}}}]
    problem.update(model="plane_strain", thickness=1)
    for quantity, within, unknowns in (({"quantity": "contact.force", "on": "top"}, 0.02, 450),
                                       ({"quantity": "contact.force", "on": "top"}, 0.003, 800),
                                       ({"quantity": "displacement", "on": "right", "direction": [1, 0]}, 0.002, 1100)):
        summary = summary_of(s, {"problem": problem, "solver": {"accuracy": {**quantity, "relative": within, "guaranteed": True}}})
        found = summary["quantities"][0]
        check(summary["outcome"] == "converged" and found["kind"] == "guaranteed", summary["message"], found)
        check(summary["problem"]["d"] < unknowns and found["high"] - found["low"] <= 2.001 * within * found["value"], summary["problem"], found)
        check(found["low"] < (0.020968 if "direction" in quantity else 53.695) < found["high"], found)


def blocks(element, cells, wide=30, gap=0, exchanged=False, **accuracy):
    """A block of that width on the middle of one of 60 x 20, pushed down by 0.1."""
    left = (60 - wide) / 2
    scene = body([element] * 2, cells, [lambda x, y: (60 * x, 20 * y), lambda x, y: (left + wide * x, 20 + gap + 18 * y)],
                 {"base": [(0, "bottom")], "top": [(0, "top")], "foot": [(1, "bottom")], "lid": [(1, "top")], "sides": [(0, "left"), (1, "left")]},
                 model="plane_strain", kinematics="fixed", materials=[{"on": "all", "young": 1000, "poisson": 0.3}], loads=[],
                 supports=[{"on": "base", "ux": 0, "uy": 0}, {"on": "lid", "ux": 0, "uy": -0.1 - gap}],
                 contacts=[{"on": "top", "with": "foot"} if exchanged else {"on": "foot", "with": "top"}])
    return {**scene, "solver": {"accuracy": {"guaranteed": True, **accuracy}}}


def test_bodies_on_each_other(s):
    """Meshes that meet in nodes and such that do not, of all elements: what is proved from below never is above what is proved from
    above, whichever surface is named first. The energy is 5.123."""
    for gap in some((0, 0.01, -0.01), 2):
        low, high = [], []
        for element, cells in some((("quad4", ((12, 4), (6, 4))), ("quad8", ((12, 4), (6, 4))), ("tri6", ((24, 8), (12, 8))), ("tri3", ((24, 8), (16, 8))),
                                    ("quad4", ((28, 8), (8, 8))), ("quad8", ((24, 8), (16, 8))), ("tri6", ((12, 4), (8, 4)))), 2):
            errors = [summary_of(s, blocks(element, cells, gap=gap, exchanged=exchanged))["error"] for exchanged in (False, True)]
            check(all(e["kind"] == "guaranteed" for e in errors), errors)
            check(abs(errors[0]["total"] - errors[1]["total"]) < 1e-6 * errors[0]["total"], errors)
            check(errors[0]["total"] < (2.4 if (cells[0][0] / 2) % cells[1][0] == 0 else 5) * errors[0]["estimated_mesh"], element, cells, errors)
            low.append(errors[0]["energy_low"])
            high.append(errors[0]["energy_high"])
        check(max(low) <= 5.1233 <= min(high) and min(high) - max(low) < 0.012, gap, low, high)
    for element, within in (("quad4", 0.18), ("tri6", 0.09), ("quad8", 0.075)):  # edges of one lie on edges of the other as a whole: one polynomial
        error = summary_of(s, blocks(element, ((12, 4), (12, 4))))["error"]
        check(error["kind"] == "guaranteed" and error["total"] < within, element, error)
    refined = blocks("tri6", ((12, 4), (6, 4)), total=0.02)
    refined["problem"]["mesh"]["refine"] = "auto"
    summary = summary_of(s, refined)
    check(summary["outcome"] == "converged" and summary["error"]["kind"] == "guaranteed" and summary["problem"]["d"] < 4000, summary["error"])


def test_quantities_of_bodies_on_each_other(s):
    """The intervals of all meshes have something in common; a force is known far better than the displacement as a whole."""
    asked = [{"quantity": "contact.force", "name": "force"}, {"quantity": "strain_energy"}, {"quantity": "displacement", "on": "sides", "direction": [1, 0]},
             {"quantity": "reaction", "on": "lid", "direction": [0, 1], "name": "reaction"}]
    low, high = {}, {}
    for element, cells, within in some((("quad4", ((12, 4), (6, 4)), 0.012), ("tri6", ((24, 8), (12, 8)), 0.0012), ("quad8", ((24, 8), (16, 8)), 0.004),
                                   ("tri3", ((28, 8), (8, 8)), 0.034), ("quad8", ((48, 16), (24, 16)), 0.0004))):
        found = {one["name"]: one for one in summary_of(s, {**blocks(element, cells), "quantities": asked})["quantities"]}
        check(len(found) == 4 and all(one["kind"] == "guaranteed" for one in found.values()), found)
        check(found["force"]["high"] - found["force"]["low"] < 2 * within * found["force"]["value"], element, cells, found["force"])
        for name, one in found.items():
            low[name], high[name] = max(low.get(name, -1e9), one["low"]), min(high.get(name, 1e9), one["high"])
    check(all(low[name] <= high[name] for name in low), low, high)
    check(low["force"] < 102.45 < high["force"] and abs(low["force"] + high["reaction"]) < 0.01 and abs(high["force"] + low["reaction"]) < 0.01, low, high)


def test_what_a_finer_mesh_alone_proves(s):
    """Linear and quadratic triangles in each other, on a ridge: the dual problem of the answer's own mesh has no solution. Quantities
    are from that mesh, and stay estimates that say so."""
    groups = {"left": [(0, "left")], "bottom": [(0, "bottom")], "roof": [(0, "top")], "floor": [(1, "bottom")], "held": [(1, "left")]}
    request = body(["tri6", "tri3"], [(8, 2), (12, 4)], [lambda x, y: (8 * x, y), lambda x, y: (6.4 * x, 0.999 + y)], groups,
                   model="plane_strain", materials=[{"on": "all", "young": 50, "poisson": 0.3}],
                   supports=[{"on": "left", "spring": [135, 135]}, {"on": "held", "ux": 0, "uy": 0}],
                   contacts=[{"on": "bottom", "obstacle": {"height": {"x": [-1, 3.2, 16], "z": [-0.029, -0.009, -0.039]}}},
                             {"on": "floor", "with": "roof"}])
    summary = summary_of(s, {**request, "quantities": [{"quantity": "strain_energy"}], "solver": {"accuracy": {"guaranteed": True}}})
    check(summary["error"]["kind"] == "guaranteed", summary["error"])
    check(summary["quantities"][0]["kind"] == "estimated" and "finer mesh" in summary["quantities"][0]["why"], summary["quantities"])


def test_uniform_pressure_between_bodies(s):
    """Blocks of one width on each other, free to spread: no mesh has an error."""
    for element, cells in (("quad4", ((6, 4), (6, 3))), ("quad4", ((7, 4), (4, 3))), ("tri6", ((5, 2), (3, 2)))):
        request = blocks(element, cells, wide=60)
        request["problem"]["supports"] = [{"on": "base", "uy": 0}, {"on": "lid", "uy": -0.1}, {"on": "left", "ux": 0}]
        request["problem"]["mesh"]["groups"]["left"] = {"edges": request["problem"]["mesh"]["groups"].pop("sides")["edges"]}
        error = summary_of(s, request)["error"]
        check(error["kind"] == "guaranteed" and error["total"] < 1e-6, element, cells, error)


def test_bounds_over_true_errors(s):
    """Of scenes of theory, in every element; `make extremes FILTER=bounds` has more."""
    scenes = bounds.theory()
    for name in ("thick tube", "bent beam"):
        for row in bounds.look(s, name, *scenes[name]):
            check("why" not in row and row["bound"] >= row["low"] > 0 and 1 <= row["ratio"] < 1.2, row)


def test_bodies_that_nothing_is_proved_for(s):
    """Surfaces that are not straight, and a block that only the other one holds."""
    bent = blocks("quad4", ((12, 4), (6, 4)))
    foot = bent["problem"]["mesh"]["groups"]["foot"]["edges"]
    bent["problem"]["mesh"]["nodes"][foot[2][0]][1] += 0.01
    loose = blocks("quad4", ((12, 4), (6, 4)))
    loose["problem"]["supports"].pop()
    loose["problem"]["supports"].append({"on": "lid", "ux": 0})
    loose["problem"]["loads"] = [{"on": "lid", "traction": [0, -1]}]
    for request, words in ((bent, "not straight and parallel"), (loose, "only obstacles hold the body")):
        error = summary_of(s, request)["error"]
        check(error["kind"] == "estimated" and words in error["why"], error)


if __name__ == "__main__":
    service.main(globals())
