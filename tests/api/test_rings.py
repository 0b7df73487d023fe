"""Axisymmetric bodies: what is summed around the ring."""
import service
from service import check


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
    check(abs(summary["contact"]["force"][1] - ground["force"][1]) < 1e-9 * ground["force"][1], summary)
    check(summary["resultants"]["imbalance"] < 1e-9, summary["resultants"])


if __name__ == "__main__":
    service.main(globals())
