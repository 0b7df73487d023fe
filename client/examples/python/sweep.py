"""How contact grows with the load: one job with a load case for each force, solved on one factorization, as CSV.

usage: sweep.py [CASES]                         a plate on a plane, pressed down harder and harder
"""
import csv
import sys

from uzawa import Uzawa


def request(count):
    cases = [{"name": f"{i}", "loads": [{"on": "right", "traction": [0.5, 0]},
                                        {"on": "top", "traction": [0, -0.01 * i]}]} for i in range(1, count + 1)]
    return {"problem": {"kind": "scene", "model": "plane_stress", "thickness": 5,
                        "mesh": {"box": {"size": [60, 20], "cells": [60, 20]}},
                        "materials": [{"on": "all", "young": 200e3, "poisson": 0.3}],
                        "supports": [{"on": "left", "ux": 0, "uy": 0}],
                        "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]},
            "cases": cases}


def main(count):
    service = Uzawa()
    job = service.wait(service.submit(request(count))["id"])
    table = csv.writer(sys.stdout)
    table.writerow(["traction", "contacts", "force", "max_pressure", "certified_error"])
    for case in service.result(job["id"], "summary")["cases"]:
        summary = case["summary"]
        contact = summary["contact"]
        table.writerow([0.01 * int(case["name"]), contact["active"], contact["force"][1], contact["max_pressure"],
                        summary["certificate"]["relative_error"]])
    return 0 if job["summary"]["outcome"] == "converged" else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10))
