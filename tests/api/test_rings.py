"""Axisymmetric bodies: what is summed around the ring."""
# not under ThreadSanitizer: about answers, not about threads
import math

import service
from service import check
from two_bodies import plate

SHARED = True  # one service for all tests


def test_contact_force_is_axial(s):
    """A pipe swells against a rigid sleeve and rests on a floor: the sleeve's pushes cancel around the ring."""
    wall = {"plane": {"point": [2, 0], "normal": [-1, 0]}}
    floor = {"plane": {"point": [0, 0], "normal": [0, 1]}}
    scene = {"kind": "scene", "model": "axisymmetric",
             "mesh": {"box": {"origin": [1, 0], "size": [1, 2], "cells": [4, 8]}},
             "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
             "supports": [{"on": "left", "spring": [1, 1]}],
             "loads": [{"on": "left", "pressure": 10}, {"on": "top", "pressure": 2}],
             "contacts": [{"on": "right", "obstacle": wall}, {"on": "bottom", "obstacle": floor}]}
    job = s.solve({"problem": scene, "solver": {"accuracy": {"relative_error": 1e-9}}})
    summary = job["summary"]
    sleeve, ground = summary["resultants"]["contacts"]
    check(summary["outcome"] == "converged" and summary["contact"]["max_pressure"] > 1, summary)
    check(sleeve["force"] == [0, 0] and ground["force"][0] == 0 and ground["force"][1] > 1, sleeve, ground)
    check(summary["contact"]["force"][0] == 0, summary["contact"])
    check(sleeve["normal_force"] > 1 and sleeve["center"][0] == 2 and 0 < sleeve["center"][1] < 2, sleeve)
    check(abs(summary["contact"]["force"][1] - ground["force"][1]) < 1e-9 * ground["force"][1], summary)
    check(summary["resultants"]["imbalance"] < 1e-9, summary["resultants"])


def test_curved_rings_pass_the_patch_test(s):
    """A pressure of 1 from all sides: the stress is -1 everywhere, whatever the shape of the edges."""
    def bowed(x, y):
        return 4 + 10 * x + 1.2 * math.sin(math.pi * y) * (1 - x) * x, 5 * y + 0.3 * math.sin(math.pi * x) * y

    for kind in ("tri6", "quad8"):
        nodes, elements, sides = plate(kind, (5, 3), 0, bowed)
        mesh = {"nodes": nodes, "elements": {kind: elements},
                "groups": {side: {"edges": edges} for side, edges in sides.items()}}
        scene = {"kind": "scene", "model": "axisymmetric", "mesh": mesh,
                 "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                 "supports": [{"on": "bottom", "uy": 0}],
                 "loads": [{"on": side, "pressure": 1} for side in ("top", "left", "right")],
                 "contacts": [{"on": "top", "obstacle": {"plane": {"point": [0, 100], "normal": [0, -1]}}}]}
        job = s.solve({"problem": scene})
        answer = s.get(f"/v1/jobs/{job['id']}/result?fields=stress").json
        for stress in answer["stress"]:
            check(all(abs(stress[c] + 1) < 1e-10 for c in range(3)) and abs(stress[3]) < 1e-10, kind, stress)


if __name__ == "__main__":
    service.main(globals())
