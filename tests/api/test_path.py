"""Fields along a line through a body. usage: test_path.py BUILD_DIR [FILTER]
not under ThreadSanitizer: nothing here is about threads
"""
import copy
import csv
import io
import math

from service import MATRICES, SCENE, check, expect, main

PULL = 3.0  # of a bar whose side is free: the stress is uniform, the displacement linear, in every mesh
ELEMENTS = {2: ("tri3", "quad4", "tri6", "quad8"), 3: ("tet4", "hex8", "tet10", "hex20", "wedge6", "wedge15")}


def bar(dim, element):
    size, cells = [4, 2, 1][:dim], [4, 3, 2][:dim]
    return {"problem": {"kind": "scene", "model": "plane_stress" if dim == 2 else "solid",
                        "mesh": {"box": {"size": size, "cells": cells, "element": element, "grading": [1.5, 1, 1][:dim]}},
                        "materials": [{"on": "all", "young": 1000.0, "poisson": 0.25}],
                        "supports": [{"on": name, key: 0} for name, key in (("left", "ux"), ("bottom", "uy"), ("back", "uz"))[:dim]],
                        "loads": [{"on": "right", "traction": [PULL, 0, 0][:dim]}]},
            "solver": {"accuracy": "exact"}}


def path(s, job, **query):
    return s.get(f"/v1/jobs/{job['id']}/path?" + "&".join(f"{key}={value}" for key, value in query.items()))


def test_uniform_stress_in_every_element(s):
    for dim, elements in ELEMENTS.items():
        for element in elements:
            job = s.solve(bar(dim, element))
            got = expect(path(s, job, **{"from": "-1,0.7,0.3"[:None if dim == 3 else 6], "to": "4,1.9,0.6"[:None if dim == 3 else 5], "count": 26}), 200).json
            check(got["components"][:3] == ["xx", "yy", "zz"] and len(got["points"]) == 26, got)
            for x, u, stress, mises in zip(got["points"], got["displacements"], got["stress"], got["von_mises"]):
                if x[0] < 0:  # in front of the bar
                    check(u == [None] * dim and mises is None and set(stress) == {None}, element, x, u)
                    continue
                check(abs(u[0] - PULL / 1000 * x[0]) < 1e-11 and abs(u[1] + 0.25 * PULL / 1000 * x[1]) < 1e-11, element, x, u)
                check(abs(stress[0] - PULL) < 1e-8 and max(map(abs, stress[1:])) < 1e-8 and abs(mises - PULL) < 1e-8, element, x, stress)
            length = math.dist(got["points"][0], got["points"][-1])
            check(abs(got["distance"][-1] - length) < 1e-12 and got["distance"][0] == 0, got["distance"][-1])


def test_nodes_have_what_the_result_says(s):
    job = s.solve(SCENE)
    full = s.get(f"/v1/jobs/{job['id']}/result?fields=nodes,displacements,stress,von_mises").json
    along = {tuple(x): i for i, x in enumerate(full["nodes"]) if x[1] == 0}
    got = expect(path(s, job, **{"from": "0,0", "to": "60,0", "count": 31}), 200).json
    for x, u, stress, mises in zip(got["points"], got["displacements"], got["stress"], got["von_mises"]):
        i = along[min(along, key=lambda at: abs(at[0] - x[0]))]
        check(math.dist(u, full["displacements"][i]) < 1e-14 and math.dist(stress, full["stress"][i]) < 1e-9, x, u, full["displacements"][i])
        check(abs(mises - full["von_mises"][i]) < 1e-9, x, mises)


def test_csv_and_cases(s):
    cases = [{"name": "one", "loads": SCENE["problem"]["loads"]}, {"name": "none", "loads": []}]
    job = s.solve({**SCENE, "cases": cases})
    ends = {"from": "5,5", "to": "70,5", "count": 14}
    got = expect(path(s, job, **ends, case="one"), 200).json
    check(got["case"] == "one" and max(got["von_mises"][:11]) > 0 and got["von_mises"][-1] is None, got)
    query = "&".join(f"{key}={value}" for key, value in ends.items())
    reply = s.get(f"/v1/jobs/{job['id']}/path.csv?{query}&case=one")
    rows = list(csv.DictReader(io.StringIO(reply.body.decode())))
    check(list(rows[0]) == ["distance", "x", "y", "ux", "uy", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "von_mises"], list(rows[0]))
    check([float(row["ux"]) for row in rows[:11]] == [u[0] for u in got["displacements"][:11]], rows[:2])
    check(rows[-1]["von_mises"] == "nan", rows[-1])
    check(s.request("GET", f"/v1/jobs/{job['id']}/path?{query}&case=one", headers={"Accept": "text/csv"}).body == reply.body, "by Accept")
    check(path(s, job, **ends).json["code"] == "case_needed", "of which case?")
    check(max(abs(x) for x in path(s, job, **ends, case="none").json["von_mises"][:11]) < 1e-12, "without a load nothing is stressed")


def test_refuses_what_is_no_line(s):
    job = s.solve(SCENE)
    for query in ({}, {"from": "0,0"}, {"from": "0,0", "to": "1"}, {"from": "0,0", "to": "0,0"}, {"from": "0,nan", "to": "1,1"}, {"from": "0,0,", "to": "1,1"},
                  {"from": "0,0", "to": "1,1", "count": 1}, {"from": "0,0", "to": "1,1", "count": 10001}, {"from": "0,0", "to": "1,1e999"},
                  {"from": "0,0,0,0", "to": "1,1"}, {"from": "0,0", "to": "1,1", "colour": "red"}):
        reply = path(s, job, **query)
        check(reply.status == 400, query, reply.status, reply.body)
    for query in ({"from": "0,0,0", "to": "1,1,1"}, {"from": "0,0", "to": "1,1,1"}):
        reply = path(s, job, **query)
        check(reply.status == 422 and "2 numbers" in reply.json["detail"], query, reply.body)
    check(path(s, s.solve(MATRICES), **{"from": "0,0", "to": "1,1"}).status == 409, "matrices have no body")
    far = copy.deepcopy(path(s, job, **{"from": "100,0", "to": "1e300,5", "count": 3}).json)
    check(far["von_mises"] == [None] * 3, far)


main(globals())
