"""How deep deformed surfaces stand in each other, and that no contact is wrong in silence.
usage: test_overlap.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import math
import pathlib

import service
from service import check
from two_bodies import body

SHARED = True  # one service for all tests

SCENES = pathlib.Path(__file__).resolve().parent.parent / "data" / "scenes"


def scene(name, **contact):
    """A request of tests/data/scenes, with other keys of its contacts."""
    request = json.loads((SCENES / f"{name}.json").read_text(encoding="utf-8"))
    for one in request["problem"]["contacts"]:
        one.update(contact)
    return request


def gallery(name, **contact):
    """A request of the gallery, alike."""
    request = json.loads((service.ROOT / "client" / "examples" / "gallery" / f"{name}.json").read_text(encoding="utf-8"))
    for one in request["problem"]["contacts"]:
        one.update(contact)
    return request


def stacked(**contact):
    """A block on another whose mesh does not match, under a pressure of 1."""
    return body(["quad4", "quad4"], [(5, 3), (7, 4)], [lambda x, y: (10 * x, 5 * y), lambda x, y: (10 * x, 5 + 5 * y)],
                {"low": [(0, "top")], "high": [(1, "bottom")], "left": [(0, "left"), (1, "left")],
                 "bottom": [(0, "bottom")], "top": [(1, "top")]},
                model="plane_strain", materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                supports=[{"on": "left", "ux": 0}, {"on": "bottom", "uy": 0}], loads=[{"on": "top", "pressure": 1}],
                contacts=[{"on": "low", "with": "high", **contact}])


def ellipse_in_hole(kind, **contact):
    """A quarter of a shaft of elliptic section, too thick by 0.01, in a hole of that section: no shape that is known."""
    def ring(inner, outer):
        def place(x, y, z):
            r, angle = inner + (outer - inner) * x, math.pi / 2 * y
            return 1.3 * r * math.cos(angle), r * math.sin(angle), 2 * z
        return place
    return body([kind, kind], [(2, 7, 1), (2, 5, 1)], [ring(10, 20.01), ring(20, 30)],
                {"shaft": [(0, "x1")], "hub": [(1, "x0")], "flat": [(0, "y0"), (1, "y0")],
                 "side": [(0, "y1"), (1, "y1")], "ends": [(0, "z0"), (1, "z0"), (0, "z1"), (1, "z1")]},
                model="solid", materials=[{"on": "all", "young": 210000, "poisson": 0.3}],
                supports=[{"on": "flat", "uy": 0}, {"on": "side", "ux": 0}, {"on": "ends", "uz": 0}],
                contacts=[{"on": "shaft", "with": "hub", **contact}])


def summary_of(s, request):
    job = s.solved(request)
    return job["summary"]


def warned(summary):
    return {one["code"]: one["value"] for one in summary["warnings"]}


def test_no_wrong_contact_is_silent(s):
    """The problems that answered `converged` wrongly, with the remedy switched off; each warning has its number."""
    nodes = {"discretization": "nodes"}
    for request, code, least in ((stacked(**nodes), "nodes_against_faces", 0.2),
                                 (scene("faceted_press_fit", **nodes), "facets", 0.5),
                                 (scene("faceted_press_fit", smooth=False), "facets", 1),
                                 (scene("faceted_press_fit", feature_angle=5), "feature_angle", 0.1),
                                 (gallery("press_fit", **nodes), "nodes_against_faces", 0.4),
                                 (gallery("press_fit", smooth=False), "facets", 0.07),
                                 (gallery("press_fit", feature_angle=1), "feature_angle", 0.02),
                                 (scene("coarse_side_on", **nodes), "overlap", 0.3),
                                 (ellipse_in_hole("tet4", smooth=False), "facets", 0.5)):
        found = warned(summary_of(s, request))
        check(found.get(code, 0) > least, code, found)
    request = scene("slide_over_bump")
    request["problem"]["kinematics"] = "fixed"
    found = warned(summary_of(s, request))
    check(found.get("sliding", 0) > 0.1, found)
    found = warned(summary_of(s, scene("obstacle_between_nodes", **nodes)))
    check(found.get("coarse_contact", 0) >= 1, found)


def test_what_is_right_is_not_warned_of(s):
    for request in (stacked(), stacked(smooth=False), scene("faceted_press_fit"), scene("coarse_side_on"),
                    gallery("press_fit")):
        summary = summary_of(s, request)
        contact = summary["contact"]
        check(contact["geometric_penetration"] < 0.01 * contact["approach"], contact)
        check(not {"facets", "nodes_against_faces", "overlap"} & set(warned(summary)), summary["warnings"])


def test_facets_are_told_apart_from_overlap(s):
    """The hub's 11 facets on a quarter of R = 20 have a sagitta of R (1 - cos(pi / 44)), whether smoothed or not; only
    where they are not do they stand in each other by a good part of it."""
    sagitta = 20 * (1 - math.cos(math.pi / 44))
    for smooth in (True, False):
        contact = summary_of(s, scene("faceted_press_fit", smooth=smooth))["contact"]
        one, = contact["penetrations"]
        check(abs(one["sagitta"] / sagitta - 1) < 2e-3, one, sagitta)
        check(contact["geometric_penetration"] == one["geometric_penetration"], contact)
        check(abs(math.hypot(*one["at"]) - 20) < 0.1, one)
        if smooth:
            check(abs(contact["approach"] / 0.005 - 1) < 0.01, contact)
            check(one["geometric_penetration"] < 0.01 * 0.005, one)
        else:
            check(one["geometric_penetration"] > 0.2 * sagitta, one)


def test_both_sides_are_looked_at(s):
    """A roller pushed 0.1 into a block whose few nodes are not near it: it is the roller's points that tell the depth."""
    request = scene("coarse_side_on", discretization="nodes")
    contact = summary_of(s, request)["contact"]
    check(abs(contact["geometric_penetration"] - 0.1) < 1e-3, contact)
    check(contact["approach"] == 0 and contact["active"] == 0, contact)


def test_what_touches_nowhere_is_not_converged(s):
    """A ball of six sides beside a face of hex20, or of twenty: middles with a share of their ends' gaps are pressed by it. A finer
    mesh tells that nothing is, and where the face is moved into the ball it touches: then the outcome is none of this."""
    def beside(radius, gap, push, refine, turned=()):
        mesh = {"box": {"size": [4, 4, 1], "cells": [4, 4, 1], "element": "hex20"}, **({"refine": "auto"} if refine else {})}
        request = {"problem": {"kind": "scene", "model": "solid", "mesh": mesh, "materials": [{"on": "all", "young": 1, "poisson": 0.3}],
                               "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": push}, *turned],
                               "contacts": [{"on": "front", "obstacle": {"sphere": {"center": [2, 2.5, 1 + gap + radius], "radius": radius}}}]}}
        return summary_of(s, {**request, **({"solver": {"accuracy": {"relative_error": 0.2}}} if refine else {})})

    for radius, gap, push in ((6, 0.004, 0), (6, 0.05, 0.046), (20, 0.001, 0)):
        summary = beside(radius, gap, push, False)
        check(summary["outcome"] == "mesh_limit" and 0 < warned(summary)["pressed_apart"] < 0.05, summary["outcome"], summary["warnings"])
        if radius == 6:
            finer = beside(radius, gap, push, True)
            check(finer["outcome"] == "converged" and finer["contact"]["force"] == [0, 0, 0] and len(finer["mesh"]["ladder"]) > 1, finer)
    # nor where there is no room for another warning
    turned = [{"on": {"where": {"nearest": place}}, "rotation": {"about": place, "axis": [0, 0, 1], "angle": 20}} for place in ([4, y, 0] for y in range(5))]
    summary = beside(6, 0.004, 0, False, turned)
    check(summary["outcome"] == "mesh_limit" and len(summary["warnings"]) == 8, summary["outcome"], summary["warnings"])
    touching = beside(6, 0.05, 0.1, False)
    check(touching["outcome"] == "converged" and "pressed_apart" not in warned(touching) and touching["contact"]["active"] > 1, touching)


def test_two_contacts_are_measured_each(s):
    request = copy.deepcopy(scene("slide_over_bump"))
    request["problem"]["contacts"] += [{"on": "left", "obstacle": {"plane": {"point": [-100, 0], "normal": [1, 0]}}}]
    contact = summary_of(s, request)["contact"]
    check(len(contact["penetrations"]) == 2, contact)
    check(contact["penetrations"][1]["geometric_penetration"] == 0, contact)
    check("at" not in contact["penetrations"][1], contact)


def test_a_ridge_in_a_face_is_measured_from_every_side(s):
    """Five nodes in contact have the gap 0: what stands in the face away from the first of them counts as much."""
    x, y, z = [0.93, 1.44], [0.06, 0.34, 1.27], [[-0.062, 0.002], [-0.027, -0.06], [0.029, -0.026]]
    depths = []
    for table in ([x, y, z], [[2 - v for v in x[::-1]], y, [row[::-1] for row in z]], [y, x, [list(row) for row in zip(*z)]]):
        problem = {"kind": "scene", "model": "solid",
                   "mesh": {"box": {"size": [2, 2, 1], "cells": [1, 1, 1], "element": "hex20"}},
                   "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                   "supports": [{"on": "front", "ux": 0, "uy": 0, "uz": -0.025}],
                   "contacts": [{"on": "back", "obstacle": {"height": dict(zip("xyz", table))}}]}
        depths.append(summary_of(s, {"problem": problem})["contact"]["geometric_penetration"])
    check(min(depths) > 0.01 and max(depths) < 1.05 * min(depths), depths)


service.main(globals())
