"""A pressed block of every solid element through the daemon, with all that it answers. usage: test_elements.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import json
import os
import tempfile

import service
from service import check, expect

SHARED = True  # one service for all tests

try:
    import meshio
except ImportError:
    meshio = None

FIELDS = "displacements,reactions,gaps,pressure,contact_status,stress,principal,von_mises,strain,stress_gauss,nodes"
with open(service.ROOT / "schemas/request.json", encoding="utf-8") as file:
    ELEMENTS = json.load(file)["$defs"]["scene"]["then"]["properties"]["mesh"]["properties"]["box"]["properties"]["element"]["enum"]
VTK = {"tet4": "tetra", "hex8": "hexahedron", "tet10": "tetra10", "hex20": "hexahedron20", "wedge6": "wedge",
       "wedge15": "wedge15"}


def block(element, obstacle):
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"size": [3, 2, 2], "cells": [3, 2, 2], "element": element}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "left", "ux": 0}, {"on": "back", "uz": 0}],
                        "loads": [{"on": "top", "pressure": 6}],
                        "contacts": [{"on": "bottom", "obstacle": obstacle}]},
            "solver": {"accuracy": {"relative_error": 1e-9}}}


def test_a_flat_press_is_uniform(s):
    check(len(ELEMENTS) >= 6, ELEMENTS)
    for element in ELEMENTS:
        job = s.solved(block(element, {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}))
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields={FIELDS}"), 200).json
        check(all(abs(p - 6) < 1e-5 for p in answer["pressure"]), element, answer["pressure"])
        check(all(r <= 0 for r in answer["reactions"]) and abs(sum(answer["reactions"]) + 36) < 1e-5, element)
        check(all(abs(g) < 1e-6 for g in answer["gaps"]), element, answer["gaps"])
        for stress in answer["stress"]:
            check(abs(stress[1] + 6) < 1e-4 and all(abs(stress[c]) < 1e-4 for c in (0, 2, 3, 4, 5)), element, stress)
        check(answer["summary"]["warnings"] == [], answer["summary"]["warnings"])


def test_every_output_of_a_ball_pressed_in(s):
    for element in ELEMENTS:
        job = s.solved(block(element, {"sphere": {"center": [0, -20, 0], "radius": 20}}))
        answer = expect(s.get(f"/v1/jobs/{job['id']}/result?fields={FIELDS}"), 200).json
        check(abs(sum(answer["reactions"]) + 36) < 0.5 and max(answer["pressure"]) > 6, element, answer["summary"])
        check(all(r <= 0 for r in answer["reactions"]) and min(answer["pressure"]) >= 0, element)
        force = answer["summary"]["contact"]["force"]
        check(abs(force[1] - 36) < 1e-6, element, force)  # nothing else holds the block along y
        check(expect(s.get(f"/v1/jobs/{job['id']}/deformed.svg"), 200).body.startswith(b"<"), element)
        vtu = expect(s.get(f"/v1/jobs/{job['id']}/result.vtu?fields=displacements,stress"), 200).body
        if meshio and element != "wedge15":  # meshio knows its number, but not its dimension
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "x.vtu")
                with open(path, "wb") as out:
                    out.write(vtu)
                cells = meshio.read(path).cells
            check([block_.type for block_ in cells] == [VTK[element]], element, cells)


service.main(globals())
