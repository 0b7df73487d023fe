"""Rigid obstacles that are smaller than the sides they meet. usage: test_between.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import itertools
import math

import service
from service import check, expect
from two_bodies import PLANE, body

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=120"}
CIRCLE = {"circle": {"center": [52.5, -0.6], "radius": 1}}  # 0.4 deep in the block


def block(n, obstacle, element="quad4", top=0, **contact):
    """A block of 100 x 20 held at its top, n cells along the bottom, over an obstacle."""
    return {"kind": "scene", "model": "plane_strain",
            "mesh": {"box": {"size": [100, 20], "cells": [n, max(4, n // 5)], "element": element}},
            "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
            "supports": [{"on": "top", "ux": 0, "uy": top}],
            "contacts": [{"on": "bottom", "obstacle": obstacle, **contact}]}


def solve(s, problem, fields="displacements,reactions,gaps,pressure,nodes", **more):
    job = s.solved({"problem": problem, **more})
    result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields={fields}"), 200).json
    check(result["summary"]["outcome"] == "converged", result["summary"])
    return result


def warned(result):
    return {w["code"]: w["value"] for w in result["summary"]["warnings"]}


def overlap(result, distance, quadratic=False):
    """How deep the deformed bottom stands in an obstacle, at points of its sides: distance(x, y) < 0 inside."""
    at = [[x + u for x, u in zip(*pair)] for pair in zip(result["nodes"], result["displacements"])
          if pair[0][1] == 0]
    at.sort()
    step, worst = 2 if quadratic else 1, 0.0
    for k in range(0, len(at) - step, step):
        for t in (i / 50 for i in range(51)):
            shape = [(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)] if quadratic else [1 - t, t]
            worst = max(worst, -distance(*(sum(w * p[c] for w, p in zip(shape, at[k:])) for c in range(2))))
    return worst


def from_circle(x, y):
    return math.hypot(x - 52.5, y + 0.6) - 1


def test_a_circle_between_two_nodes_is_resisted_on_every_mesh(s):
    """Rows at nodes alone give 0 on the first mesh; what is converged is 155."""
    for n, force, how in ((20, 372, "auto"), (40, 192, "auto"), (80, 176, "auto"), (200, 169, "auto"), (400, 157, "auto"),
                          (20, 372, "fixed"), (80, 176, "fixed"), (200, 169, "fixed")):
        if n > 80 and service.INSTRUMENTED:
            continue
        result = solve(s, {**block(n, CIRCLE), "kinematics": how})
        contact = result["summary"]["contact"]
        check(abs(contact["force"][1] - force) <= 0.05 * force, (n, how, contact))
        check(overlap(result, from_circle) <= 0.01 * 100 / n, (n, how, overlap(result, from_circle)))
        check(("coarse_contact" in warned(result)) == (n < 400), (n, result["summary"]["warnings"]))
        check(contact["candidates"] - (n + 1) <= 10, contact)


def test_between_nodes_of_quadratic_sides(s):
    for n, element in ((20, "quad8"), (21, "quad8"), (40, "tri6"), (80, "quad8")):
        result = solve(s, block(n, CIRCLE, element))
        check(130 < result["summary"]["contact"]["force"][1] < 300, (n, element, result["summary"]["contact"]))
        check(overlap(result, from_circle, True) <= 0.03 * 50 / n, (n, overlap(result, from_circle, True)))
        check("coarse_contact" in warned(result), (n, result["summary"]["warnings"]))


def test_what_the_row_inside_a_side_is_told_by(s):
    """The node nearest to it, twice; resultants know the true place, and pressure the force on the nodes of the side."""
    result = solve(s, {**block(20, {"circle": {"center": [52, -0.6], "radius": 1}}), "kinematics": "fixed"})
    summary, nodes = result["summary"], result["contact_nodes"]
    force = summary["contact"]["force"][1]
    check(nodes[:-1] == list(range(21)) and nodes[-1] == 10 and len(result["reactions"]) == 22, nodes)
    check([i for i, r in enumerate(result["reactions"]) if r < 0] == [21], result["reactions"])
    check(abs(result["reactions"][-1] + force) <= 1e-9 * force, result["reactions"])
    moment = summary["resultants"]["contacts"][0]["moment"][-1]
    check(abs(moment - 52 * force) <= 1e-5 * 52 * force, summary["resultants"])
    check(summary["resultants"]["imbalance"] <= 1e-8, summary["resultants"])
    # 0.4 of the way along the side of length 5: as nodal forces over 5 each
    check(abs(result["pressure"][10] - 0.6 * force / 5) <= 1e-6 * force, result["pressure"])
    check(abs(result["pressure"][11] - 0.4 * force / 5) <= 1e-6 * force, result["pressure"])
    check(abs(summary["contact"]["max_pressure"] - result["pressure"][10]) <= 1e-12 * force, summary)


def test_rows_at_nodes_alone_warn_of_what_they_let_in(s):
    result = solve(s, block(20, CIRCLE, discretization="nodes"))
    check(result["summary"]["contact"]["force"] == [0, 0] and result["summary"]["contact"]["candidates"] == 21, result["summary"])
    check(warned(result).get("coarse_contact") == 1, result["summary"]["warnings"])
    check("0.4 deep" in next(w["message"] for w in result["summary"]["warnings"] if w["code"] == "coarse_contact"), result)


def test_corners_between_nodes(s):
    """A ridge of a polyline, and one of a table, that reach 0.4 into one side 5 long."""
    x, y = [-50, 51, 52, 53, 150], [-3, -3, 0.4, -3, -3]

    def distance(px, py):
        """Of a point near the ridge: from its two flanks."""
        slope = 3.4
        return min(py - 0.4 + slope * abs(px - 52), 1e9) / math.hypot(1, slope)

    for obstacle in ({"polyline": {"points": [list(p) for p in zip(x, y)]}}, {"height": {"x": x, "z": y}}):
        for element in ("quad4", "quad8"):
            result = solve(s, block(20, obstacle, element))
            check(result["summary"]["contact"]["force"][1] > 100, (obstacle, element, result["summary"]["contact"]))
            check(overlap(result, distance, element == "quad8") <= 0.05, overlap(result, distance, element == "quad8"))
            check("coarse_contact" in warned(result), result["summary"]["warnings"])


def test_a_node_on_a_ridge(s):
    """Exactly amid its flanks it is on either by rounding: the answer is symmetric, and the mirror image's, as on finer meshes."""
    for element, slope, form in itertools.product(("quad4", "quad8", "tri6"), (0.3, 1, 3), ("polyline", "height")):
        if service.INSTRUMENTED and (form == "height") != (slope == 1):
            continue
        forces = []
        for turn, n in ((1, 8), (-1, 8), (1, 32)):
            x, y = [2 - 3 * turn, 2, 2 + 3.3 * turn], [0.1 - 3 * slope, 0.1, 0.1 - 3.3 * slope]
            x, y = (x, y) if turn > 0 else (x[::-1], y[::-1])
            line = {"polyline": {"points": [list(p) for p in zip(x, y)]}} if form == "polyline" else {"height": {"x": x, "z": y}}
            problem = {**block(n, line, element), "kinematics": "fixed"}
            problem["mesh"]["box"] = {"size": [4, 2], "cells": [n, n // 2], "element": element}
            forces.append(solve(s, problem)["summary"]["contact"]["force"])
        for force in forces[:2] if element != "tri6" else []:  # whose mesh is not symmetric
            check(abs(force[0]) < 1e-6 * force[1], (element, slope, form, forces))
        check(element == "tri6" or abs(forces[0][1] - forces[1][1]) < 1e-6 * forces[0][1], (element, slope, form, forces))
        check(forces[2][1] < forces[0][1] < 1.6 * forces[2][1], (element, slope, form, forces))


def test_a_tooth_between_flat_grounds_is_narrow(s):
    """Normals are up at all nodes; still the force on its one row, at a node or inside a side, is the mesh's."""
    forces = {}
    for at, n in itertools.product((50, 52.5), (20, 40)):
        x, y = [-50, at - 0.3, at, at + 0.3, 150], [-0.9, -0.9, 0, -0.9, -0.9]
        for name, obstacle in (("line", {"polyline": {"points": [list(p) for p in zip(x, y)]}}), ("table", {"height": {"x": x, "z": y}})):
            result = solve(s, block(n, obstacle, top=-0.4))
            contact = result["summary"]["contact"]
            check(contact["active"] == 1 and warned(result).get("coarse_contact", 0) >= 1, (at, n, name, result["summary"]["warnings"]))
            forces[at, n, name] = contact["force"][1]
    check(all(forces[at, 20, name] > 1.1 * forces[at, 40, name] for at, n, name in forces), forces)


def test_two_teeth_in_one_side(s):
    """As deep as each other in a side: whichever of them had the row, the other would stand in the side."""
    x = [-50, 50.8, 51, 51.2, 53.8, 54, 54.2, 150]
    result = solve(s, block(20, {"polyline": {"points": [[a, 0.4 if a in (51, 54) else -3] for a in x]}}))
    told = [-r for r, n in zip(result["reactions"], result["contact_nodes"]) if r < 0]
    check(len(told) == 2 and abs(told[0] - told[1]) < 1e-3 * told[0], told)
    depth = max(0.4 - y for n, d in zip(result["nodes"], result["displacements"]) for y in [n[1] + d[1]] if n[1] == 0 and 50 <= n[0] <= 55)
    check(depth < 1e-6, depth)


def test_a_node_amid_a_groove(s):
    """The tip of a wedge: of one flank alone, whichever rounding has, the body would be pushed aside. Both carry it."""
    other = None
    for element, form, n, turn in itertools.product(("quad4", "quad8"), ("polyline", "height"), (8, 16), (1, -1)):
        x, y = [-3 * turn, 0, 3.3 * turn], [0.32, 0.02, 0.35]
        x, y = (x, y) if turn > 0 else (x[::-1], y[::-1])
        line = {"polyline": {"points": [list(p) for p in zip(x, y)]}} if form == "polyline" else {"height": {"x": x, "z": y}}
        request = body([element], [[n, n // 2]], [lambda a, b: [4 * a - 2, 0.4 * abs(4 * a - 2) * (1 - b) + 2 * b]],
                       {"on": [(0, "bottom")], "head": [(0, "top")]}, model="plane_strain", kinematics="fixed",
                       materials=[{"on": "all", "young": 1000, "poisson": 0.3}], supports=[{"on": "head", "ux": 0.003, "uy": 0}],
                       contacts=[{"on": "on", "obstacle": line}])
        result = solve(s, request["problem"])
        force = result["summary"]["contact"]["force"]
        tip = result["nodes"].index([0, 0])
        at = sorted(r for r, k in zip(result["reactions"], result["contact_nodes"]) if k == tip)
        check(len(at) == 2 and at[1] < 0, (element, form, n, turn, at))
        u = result["displacements"][tip]  # of the head 0.003 to the right
        check(math.dist(u, [0, 0.02]) < 1e-12, (element, form, n, turn, u))
        other = force if turn > 0 else other
        check(force[0] < 0 and force[1] > 5 and math.dist(force, other) < 1e-9 * force[1], (element, form, n, force, other))


def test_a_block_whose_flanks_are_at_nodes(s):
    """The nearest way out of it leads sideways there: rows at these nodes let it in, however far."""
    for element, n, deep in itertools.product(("quad4", "quad8", "tri3"), (20, 40), (0.01, 0.1)):
        line = [[-50, -9], [50, -9], [50, deep], [55, deep], [55, -9], [150, -9]]
        result = solve(s, block(n, {"polyline": {"points": line}}, element, top=-0.5))
        force = result["summary"]["contact"]["force"]
        check(force[1] > 50, (element, n, deep, force, result["summary"]["warnings"]))


def test_a_curved_body_on_a_plane_is_narrow(s):
    """One or two nodes of an arc give 1.1 to 1.6 times the force of fine meshes. Flat sides, corners and edges are no curves."""
    def pressed(kind, n, place, deep=0.02):
        bottom, top = ("bottom", "top") if kind in PLANE else ("z0", "z1")
        model, down = ("plane_strain", {"ux": 0, "uy": -deep}) if kind in PLANE else ("solid", {"ux": 0, "uy": 0, "uz": -deep})
        zeros = [0] * (1 if kind in PLANE else 2)
        cells = [n, *[1] * (len(zeros) - 1), max(2, n // 4)]
        request = body([kind], [cells], [lambda x, *y: [place(x, y[-1])[0], *(2 * t for t in y[:-1]), place(x, y[-1])[1]]],
                       {"on": [(0, bottom)], "head": [(0, top)]}, model=model,
                       materials=[{"on": "all", "young": 1000, "poisson": 0.3}], supports=[{"on": "head", **down}],
                       contacts=[{"on": "on", "obstacle": {"plane": {"point": [*zeros, 0], "normal": [*zeros, 1]}}}])
        return solve(s, request["problem"])

    def arc(x, y):
        r, angle = 10 * (1 - 0.6 * y), 1.4 * x - 0.7
        return r * math.sin(angle), 10 - r * math.cos(angle)
    for kind, sizes in (("quad4", (4, 16, 128)), ("quad8", (4, 16, 128)), ("tri6", (4, 16, 128)), ("hex8", (4, 16)), ("tet10", (4, 16))):
        for n in sizes[:1] if service.INSTRUMENTED else sizes:
            check(("coarse_contact" in warned(pressed(kind, n, arc))) == (n < 128), kind, n)
    for kind, n in (("quad4", 4), ("quad8", 16), ("hex8", 4)):
        for place in (lambda x, y: (10 * x, 6 * y), lambda x, y: (10 * x - 0.6 * y, x + 6 * y), lambda x, y: (10 * x, 8 * abs(x - 0.5) + 6 * y)):
            result = pressed(kind, n, place)
            check(result["summary"]["contact"]["active"] and "coarse_contact" not in warned(result), kind, n, warned(result))


def test_a_ball_in_a_body_of_one_side_is_narrow(s):
    """At the edge of a body one side is all that there is around a node: that it touches says nothing of its size."""
    forces = []
    for element, n in (("hex20", 1), ("hex8", 1), ("hex8", 2), ("hex8", 4)):
        result = solve(s, {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [2, 2, 1], "cells": [n, n, n], "element": element}},
                           "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                           "supports": [{"on": "front", "ux": 0, "uy": 0, "uz": -0.05}],
                           "contacts": [{"on": "back", "obstacle": {"sphere": {"center": [1, 1, -0.2], "radius": 0.2}}}]})
        check(result["summary"]["contact"]["active"] == 1 and "coarse_contact" in warned(result), (element, n, result["summary"]["warnings"]))
        forces.append(result["summary"]["contact"]["force"][2])
    check(forces[1] > 1.5 * forces[3], forces)


def test_a_body_that_comes_upon_it(s):
    """Moved down by its support, the block meets what it did not touch: as if the obstacle had come up."""
    still = solve(s, block(20, CIRCLE))["summary"]["contact"]["force"][1]
    down = solve(s, block(20, {"circle": {"center": [52.5, -1.1], "radius": 1}}, top=-0.5))
    check(abs(down["summary"]["contact"]["force"][1] - still) <= 1e-6 * still, (still, down["summary"]["contact"]))
    pressed = block(20, {"circle": {"center": [52.5, -1.1], "radius": 1}})
    pressed["supports"] = [{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "ux": 0, "uy": 0}]
    pressed["loads"] = [{"on": "top", "pressure": 3}]
    free = solve(s, {**pressed, "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, -90], "normal": [0, 1]}}}]})
    check(min(u[1] for u in free["displacements"]) < -0.5, "the load does not bring it there")
    result = solve(s, pressed)
    check(result["summary"]["contact"]["active"] == 1 and result["summary"]["contact"]["force"][1] > 1, result["summary"])
    check(overlap(result, lambda px, py: math.hypot(px - 52.5, py + 1.1) - 1) <= 0.05, result["summary"])


def test_what_the_mesh_can_follow_gets_no_row(s):
    """Planes, radii of more than 12 sides, straight ground in pieces; a pin in a hole made of straight sides."""
    ground = [[-50, -0.1], [20, -0.1], [33, -0.1], [150, -0.1]]
    for obstacle in ({"plane": {"point": [0, -0.1], "normal": [0, 1]}}, {"circle": {"center": [51, -64], "radius": 64}},
                     {"polyline": {"points": ground}}, {"circle": {"center": [50, 200], "radius": 210, "inside": True}}):
        result = solve(s, block(20, obstacle))
        check(result["summary"]["contact"]["candidates"] == 21, (obstacle, result["summary"]["contact"]))
        check("coarse_contact" not in warned(result), result["summary"]["warnings"])
    facets, nodes = 9, []
    for ring in range(4):
        nodes += [[(5 + ring) * math.cos(0.5 * math.pi * k / facets), (5 + ring) * math.sin(0.5 * math.pi * k / facets)]
                  for k in range(facets + 1)]
    n = facets + 1
    quads = [[r * n + k, (r + 1) * n + k, (r + 1) * n + k + 1, r * n + k + 1] for r in range(3) for k in range(facets)]
    hole = {"kind": "scene", "model": "plane_stress",
            "mesh": {"nodes": nodes, "elements": {"quad4": quads},
                     "groups": {"hole": {"edges": [[k, k + 1] for k in range(facets)]},
                                "x": {"nodes": [r * n for r in range(4)]}, "y": {"nodes": [r * n + facets for r in range(4)]},
                                "out": {"edges": [[3 * n + k, 3 * n + k + 1] for k in range(facets)]}}},
            "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
            "supports": [{"on": "x", "uy": 0}, {"on": "y", "ux": 0}], "loads": [{"on": "out", "pressure": 10}],
            "contacts": [{"on": "hole", "obstacle": {"circle": {"center": [0, 0], "radius": 4.99}}}]}
    result = solve(s, hole)
    check(result["summary"]["contact"]["candidates"] == facets + 1, result["summary"]["contact"])
    hole["contacts"][0]["obstacle"]["circle"] = {"center": [4.7 * math.cos(0.6), 4.7 * math.sin(0.6)], "radius": 0.35}
    check(solve(s, hole)["summary"]["contact"]["candidates"] > facets + 1, "a small pin is seen")


def test_a_ball_between_nodes_in_space(s):
    """0.15 deep in the middle of a face of hexahedra, tetrahedra (on the edge of two) and quadratic ones; moved, of wedges."""
    for element, cells in (("hex8", [5, 4, 5]), ("tet4", [5, 4, 5]), ("tet10", [3, 2, 3]), ("hex8", [10, 4, 10])):
        middle = 5 if cells[0] % 2 else 4.5
        scene = {"kind": "scene", "model": "solid",
                 "mesh": {"box": {"size": [10, 6, 10], "cells": cells, "element": element}},
                 "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                 "supports": [{"on": "top", "ux": 0, "uy": 0, "uz": 0}],
                 "contacts": [{"on": "bottom", "obstacle": {"sphere": {"center": [middle, -0.35, middle], "radius": 0.5}}}]}
        result = solve(s, scene)
        contact = result["summary"]["contact"]
        check(contact["force"][1] > 50 and contact["active"] > 0, (element, contact))
        check(contact["force"][1] < 900 and abs(contact["force"][0]) < 0.1 * contact["force"][1], (element, contact))
        check("coarse_contact" in warned(result), (element, result["summary"]["warnings"]))
        if cells == [5, 4, 5] and element == "hex8":
            check(contact["active"] == 1 and abs(contact["force"][0]) <= 1e-6 * contact["force"][1], contact)


def test_the_rest_of_the_service_knows_such_rows(s):
    """Load cases, refinement, verification, pictures and files."""
    problem = {**block(20, CIRCLE), "kinematics": "fixed"}
    s.solved({"problem": problem, "cases": [{"name": "none", "loads": []},
                                            {"name": "right", "loads": [{"on": "right", "traction": [3, 0]}]}]})
    job = s.solved({"problem": problem, "solver": {"accuracy": {"relative_error": 1e-3}, "method": "accelerated_restart"}})
    body = {"accuracy": {"relative_error": 1e-9}}
    finer = expect(s.request("POST", f"/v1/jobs/{job['id']}/refine", body, WAIT), 200).json
    check(finer["status"] == "successful", finer)
    result = expect(s.get(f"/v1/jobs/{finer['id']}/result?fields=displacements,reactions"), 200).json
    body = {"problem": problem, "answer": {name: result[name] for name in ("displacements", "reactions")},
            "solver": {"accuracy": {"relative_error": 1e-8}}}
    verified = expect(s.request("POST", "/v1/verify", body), 200).json["summary"]
    check(verified["outcome"] == "verified", verified)
    for name in ("result.vtu", "deformed.svg", "convergence.svg"):
        expect(s.get(f"/v1/jobs/{finer['id']}/{name}"), 200)


if __name__ == "__main__":
    service.main(globals())
