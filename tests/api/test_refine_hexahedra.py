"""Hexahedra and quadrilaterals refined as what they are, with hanging nodes.
usage: test_refine_hexahedra.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import math
import statistics

import service
from service import INSTRUMENTED, check, expect, some

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
STEEL = [{"on": "all", "young": 200e3, "poisson": 0.3}]
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def l_shape(element, traction):
    """Three unit squares or cubes, held at the bottom, loaded on top, beside a wall."""
    dim = len(traction)
    nodes, number = [], {}

    def at(*place):
        if place not in number:
            number[place] = len(nodes)
            nodes.append(list(place))
        return number[place]

    elements, sides = [], {"top": [], "bottom": [], "right": []}
    for a, b in ((-1, -1), (0, -1), (-1, 0)):
        corner = [(a + x, b + y) + ((z,) if dim == 3 else ()) for z in range(dim - 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
        middle = [tuple((p + q) / 2 for p, q in zip(corner[i], corner[j])) for i, j in EDGES[:4 if dim == 2 else 12]]
        elements.append([at(*x) for x in corner + (middle if element in ("quad8", "hex20") else [])])
        for face in EDGES[:4] if dim == 2 else FACES:
            places = [corner[i] for i in face]
            for name, axis, value in (("top", 1, 1), ("bottom", 1, -1), ("right", 0, 1)):
                if all(x[axis] == value for x in places) and (name != "bottom" or max(x[0] for x in places) == 0):
                    sides[name].append([at(*x) for x in places])
    groups = {name: {"edges" if dim == 2 else "faces": faces} for name, faces in sides.items()}
    return {"kind": "scene", "model": "plane_strain" if dim == 2 else "solid", "materials": STEEL,
            "mesh": {"nodes": nodes, "elements": {element: elements}, "groups": groups, "refine": "auto"},
            "supports": [{"on": "bottom", "ux": 0, "uy": 0, **({"uz": 0} if dim == 3 else {})}],
            "loads": [{"on": "top", "traction": traction}],
            "contacts": [{"on": "right", "obstacle": {"plane": {"point": [1 + 1e-9, 0, 0][:dim], "normal": [-1, 0, 0][:dim]}}}]}


def block(element, obstacle):
    """A quarter of a block, its middle pressed by a quarter of a millimetre against something round."""
    return {"kind": "scene", "model": "solid", "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
            "mesh": {"box": {"size": [10, 10, 10], "cells": [2, 2, 2], "element": element}, "refine": "auto"},
            "supports": [{"on": "bottom", "uy": 0}, {"on": "left", "ux": 0}, {"on": "back", "uz": 0}],
            "contacts": [{"on": "top", "obstacle": obstacle}]}


SPHERE = {"sphere": {"center": [0, 39.75, 0], "radius": 30}}
CYLINDER = {"cylinder": {"point": [0, 39.75, 0], "axis": [0, 0, 1], "radius": 30}}


def solved(s, problem, error, **solver):
    request = {"problem": problem, "solver": {"accuracy": {"relative_error": error}, **solver}}
    job = s.solved(request, "converged")
    check(job["summary"]["error"]["total"] <= error, job["summary"]["error"])
    return job


def compared(s, element, tractions, errors, finest):
    """Estimated over true errors: what the potential energy lacks of that of a fine mesh, as all supports are at rest."""
    found = []
    for traction in tractions:
        quadratic = {"quad4": "quad8", "hex8": "hex20"}.get(element, element)
        energy = solved(s, l_shape(quadratic, traction), finest)["summary"]["energy"]
        for error in errors:
            summary = solved(s, l_shape(element, traction), error)["summary"]
            true = math.sqrt((summary["energy"]["primal"] - energy["primal"]) / energy["strain"])
            found.append(summary["error"]["total"] / true)
    print("#", element, "estimated over true", [round(x, 2) for x in found])
    check(0.7 < statistics.median(found) < 1.5 and all(0.5 < x < 2 for x in found), element, found)


def test_estimates_in_the_plane(s):
    for element in some(("quad4", "quad8")):
        compared(s, element, ([0, -1], [1, 0]), (0.1, 0.05, 0.03)[:2 if INSTRUMENTED else 3], 0.005 if INSTRUMENTED else 0.001)


def test_estimates_in_space(s):
    for element in some(("hex8", "hex20")):
        compared(s, element, ([0, -1, 0],), (0.2, 0.14, 0.1, 0.07)[:2 if INSTRUMENTED else 4], 0.05 if INSTRUMENTED else 0.02)


def test_reactions_are_those_of_other_elements(s):
    """The wall's force on the L, known within its intervals; and from tetrahedra of a cube's six."""
    force = {element: solved(s, l_shape(element, [0, -1, 0]), error)["summary"]["contact"]["force"][0]
             for element, error in some((("hex8", 0.05), ("hex20", 0.03)))}
    check(abs(force["hex8"] / force.get("hex20", -0.0484) - 1) < 0.05, force)
    check(abs(force.get("hex20", -0.0484) / -0.0484 - 1) < 0.03, force)


def test_supports_and_loads_sum_up(s):
    """To rounding, with hanging nodes on sides that are held, loaded, in contact, and on springs."""
    for element in some(("quad8", "quad4", "hex20", "hex8")):
        dim = 2 if element[0] == "q" else 3
        for spring in (False, True):
            problem = l_shape(element, [0.3, -1, 0.2][:dim])
            if spring:
                problem["supports"] = [{"on": "bottom", "spring": [1e5, 2e5, 1e5][:dim]}]
            job = solved(s, problem, 0.2 if INSTRUMENTED else 0.1, operator="factored")
            resultants = job["summary"]["resultants"]
            parts = [resultants["loads"]] + resultants["supports"] + resultants["contacts"]
            size = sum(abs(x) for part in parts for x in part["force"])
            check(len(job["summary"]["mesh"]["ladder"]) > 1, element)
            for what in ("force", "moment"):
                for axis in range(len(parts[0][what])):
                    total = sum(part[what][axis] for part in parts)
                    check(abs(total) < 1e-12 * size, element, spring, what, axis, total, size)


def test_pressure_has_no_zigzag(s):
    """Before a sphere and a cylinder: the square of Hertz's pressure falls with that of the distance. Rows at corners
    of all sizes lie on that line, and hanging nodes of the field between them."""
    for element, error in some((("hex8", 0.07), ("hex20", 0.05))):
        for name, obstacle, along in some((("sphere", SPHERE, (0, 2)), ("cylinder", CYLINDER, (0,)))):
            job = solved(s, block(element, obstacle), error)
            answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=pressure,nodes,reactions"), 200).json
            pairs = [(sum(answer["nodes"][i][c] ** 2 for c in along), p ** 2)
                     for i, p in zip(answer["contact_nodes"], answer["pressure"]) if p > 0.3 * max(answer["pressure"])
                     and (name == "sphere" or answer["nodes"][i][2] < 6)]
            x, y = [statistics.fmean(v) for v in zip(*pairs)]
            slope = sum((a - x) * (b - y) for a, b in pairs) / sum((a - x) ** 2 for a, b in pairs)
            off = max(abs(b - y - slope * (a - x)) for a, b in pairs) / max(b for _, b in pairs)
            print("#", element, name, len(pairs), "rows, off by", round(off, 3))
            check(len(pairs) > 5 and slope < 0 and off < 0.25, element, name, off)


def test_operators_agree(s):
    energy = [solved(s, l_shape("hex8", [0, -1, 0]), 0.1, operator=operator)["summary"]["energy"]["primal"]
              for operator in ("condensed", "factored", "matrix_free")]
    check(max(energy) - min(energy) < 2e-3 * abs(energy[0]), energy)


def test_corners_beside_hanging_nodes(s):
    """The middle of a quadratic edge is a corner of the elements beside it that are divided."""
    for element, traction, error in some((("quad8", [0, -1], 0.002), ("hex20", [0, -1, 0], 0.03))):
        energy = [solved(s, l_shape(element, traction), error, operator=operator)["summary"]["energy"]["primal"]
                  for operator in ("factored", "matrix_free")]
        check(abs(energy[0] - energy[1]) < 2 * error ** 2 * abs(energy[0]), energy)


def test_fields_find_the_mesh(s):
    for element in some(("quad4", "quad8", "hex8", "hex20")):
        job = solved(s, l_shape(element, [0, -1, 0][:2 if element[0] == "q" else 3]), 0.1)
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=von_mises,pressure,nodes,stress,displacements"),
                        200).json
        nodes = len(answer["nodes"])
        check(len(answer["von_mises"]) == len(answer["stress"]) == len(answer["displacements"]) == nodes, element)
        check(len(job["summary"]["mesh"]["ladder"]) > 1 and min(answer["von_mises"]) >= 0, element)
        for what in ("result.vtu", "deformed.svg"):
            expect(s.get(f"/v1/jobs/{job['id']}/{what}"), 200)


def test_guaranteed_errors_take_triangles(s):
    request = {"problem": l_shape("quad4", [0, -1]), "solver": {"accuracy": {"total": 0.2, "guaranteed": True}}}
    job = expect(s.post(request, WAIT), 200).json
    summary = job["summary"]
    check(summary["outcome"] == "converged" and summary["error"]["kind"] == "guaranteed", summary)
    check(len(summary["mesh"]["ladder"]) > 1, summary["mesh"])


if __name__ == "__main__":
    service.main(globals())
