"""Orthotropic materials through the service: closed forms, an isotropic one among them, a scene turned with its material,
CalculiX, and what is refused or not claimed."""
# not under ThreadSanitizer: about answers, not about threads
import copy
import math
import pathlib
import re
import shutil
import subprocess
import tempfile

import service
from service import check, expect

SHARED = True  # one service for all tests

FIBRES = {"young": [140e3, 9e3, 11e3], "poisson": [0.3, 0.4, 0.27], "shear": [5e3, 3.2e3, 4.1e3]}
FAR = {2: {"on": "bottom", "obstacle": {"plane": {"point": [0, -50], "normal": [0, 1]}}},
       3: {"on": "bottom", "obstacle": {"plane": {"point": [0, -50, 0], "normal": [0, 1, 0]}}}}


def like(young, poisson, **more):
    return dict(young=[young] * 3, poisson=[poisson] * 3, shear=[young / (2 * (1 + poisson))] * 3, **more)


def scene(model, cells, material, supports, loads, contacts=None, size=None, element=None, **problem):
    dim = len(cells)
    box = {"size": size or [2, 1, 1.5][:dim], "cells": cells}
    if element:
        box["element"] = element
    return {"problem": dict({"kind": "scene", "model": model, "mesh": {"box": box},
                             "materials": [dict(on="all", **material)], "supports": supports, "loads": loads,
                             "contacts": contacts or [FAR[dim]]}, **problem)}


def answer(s, body, fields="summary,displacements,stress,strain"):
    job = s.solved(body)
    return s.get(f"/v1/jobs/{job['id']}/result?fields={fields}").json


def close(found, wanted, relative, what=None):
    if isinstance(wanted, (list, tuple)):
        flat = lambda x: [z for y in x for z in flat(y)] if isinstance(x, (list, tuple)) else [x]  # noqa: E731
        found, wanted = flat(found), flat(wanted)
        size = max(abs(x) for x in wanted)
        off = max(abs(a - b) for a, b in zip(found, wanted))
        check(len(found) == len(wanted) and off <= relative * size, off, size, what)
    else:
        check(abs(found - wanted) <= relative * abs(wanted), found, wanted, what)


def test_a_sheet_pulled_off_its_axes(s):
    """Strain along, across and of shear; the sheet becomes a parallelogram, which is held at points alone."""
    E, nu, G = FIBRES["young"], FIBRES["poisson"], FIBRES["shear"]
    for degrees in (0, 30, -70):
        c, t = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        body = scene("plane_stress", [4, 3], {"orthotropic": dict(FIBRES, angle=degrees)},
                     [{"on": {"where": {"nearest": [0, 0]}}, "ux": 0, "uy": 0}, {"on": {"where": {"nearest": [2, 0]}}, "uy": 0}],
                     [{"on": "left", "traction": [-100, 0]}, {"on": "right", "traction": [100, 0]}])
        found = answer(s, body)
        along = c ** 4 / E[0] + t ** 4 / E[1] + (1 / G[0] - 2 * nu[0] / E[0]) * c * c * t * t
        shear = (2 / E[0] + 2 * nu[0] / E[0] - 1 / G[0]) * c ** 3 * t - (2 / E[1] + 2 * nu[0] / E[0] - 1 / G[0]) * c * t ** 3
        across = -nu[2] / E[0] * c * c - nu[1] / E[1] * t * t
        for strain, stress in zip(found["strain"], found["stress"]):
            close(strain[0], 100 * along, 1e-9)
            close(strain[2], 100 * across, 1e-9)
            check(abs(strain[3] - 50 * shear) <= 1e-9 * along * 100, strain)
            close(stress, [100, 0, 0, 0], 1e-9)
        check(found["summary"]["error"]["mesh"] < 1e-6, found["summary"]["error"])


def test_the_same_in_all_directions_it_is_isotropic(s):
    """Energy, fields and the estimate of the mesh's error, with a temperature, of each model and formulation."""
    for model, element, formulation in (("plane_stress", "quad4", "auto"), ("plane_strain", "quad4", "bbar"), ("plane_strain", "tri6", "auto"),
                                        ("plane_stress", "quad4", "incompatible_modes"), ("axisymmetric", "quad8", "auto"),
                                        ("axisymmetric", "quad4", "bbar"), ("solid", "hex8", "incompatible_modes"), ("solid", "hex8", "bbar"),
                                        ("solid", "tet10", "auto")):
        solid = model == "solid"
        directions = {"axes": {"x": [1, 2, 3], "y": [3, 0, -1]}} if solid else {"angle": 35}
        supports = [{"on": "top", "ux": 0, "uy": -0.02, **({"uz": 0} if solid else {})}]
        loads = [{"on": "all", "temperature": 40}, {"on": "right", "pressure": 50}]
        contacts = [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, 0][:2 + solid], "normal": [0, 1, 0][:2 + solid]}}}]
        make = lambda material: scene(model, [4, 3, 2][:2 + solid], material, supports, loads, contacts,  # noqa: E731
                                      element=element, formulation=formulation)
        wanted = answer(s, make({"young": 7e3, "poisson": 0.35, "expansion": 1e-4}))
        found = answer(s, make({"orthotropic": like(7e3, 0.35, expansion=[1e-4] * 3, **directions)}))
        what = (model, element, formulation)
        for key in ("displacements", "stress", "strain"):
            close(found[key], wanted[key], 1e-8, what)
        a, b = found["summary"], wanted["summary"]
        for path in (("energy", "primal"), ("energy", "dual"), ("discretization_error",), ("contact", "force")):
            one, other = a, b
            for key in path:
                one, other = one[key], other[key]
            close(one, other, 1e-7, what, )
        check(a["outcome"] == b["outcome"] == "converged" and a["contact"]["active"] == b["contact"]["active"] > 0, a["contact"])


def turned(v, R):
    return [sum(R[i][j] * v[j] for j in range(len(v))) for i in range(len(v))]


def grid(kind, n):
    """Nodes and elements of a distorted block of n cells in each direction, of size 1."""
    dim = 3 if kind == "hex8" else 2
    count = [n + 1] * dim
    at = lambda i: i[0] + count[0] * (i[1] + (count[1] * i[2] if dim == 3 else 0))  # noqa: E731
    index = [[a, b, c] for c in range(n + 1 if dim == 3 else 1) for b in range(n + 1) for a in range(n + 1)]
    nodes = [[x / n + (0.02 * math.sin(5 * a + 3 * b + c) if 0 < x < n else 0) for x in (a, b, c)[:dim]] for a, b, c in index]
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)][:8 if dim == 3 else 4]
    cells = [[at([a + p, b + q, c + r]) for p, q, r in corners] for a, b, c in index if max((a, b, c)[:dim]) < n]
    side = lambda axis, end: [k for k, i in enumerate(index) if i[axis] == end]  # noqa: E731
    faces = {4: [(0, 1)], 8: [(0, 1, 5, 4)]}[len(corners)]
    low = [[cell[k] for k in face] for cell in cells for face in faces if all(index[cell[k]][1] == 0 for k in face)]
    return nodes, cells, low, side(1, n)


def generated(kind, degrees, axis=(0, 0, 1), n=4):
    """A block pushed on a plane from above, turned with its material, its support and its obstacle."""
    angle, dim = math.radians(degrees), 3 if kind == "hex8" else 2
    c, t = math.cos(angle), math.sin(angle)
    length = math.sqrt(sum(x * x for x in axis))
    e = [x / length for x in axis]
    cross = [[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]]
    R = [[c * (i == j) + (1 - c) * e[i] * e[j] + t * cross[i][j] for j in range(dim)] for i in range(dim)]
    nodes, cells, low, top = grid(kind, n)
    own = [math.cos(0.5), math.sin(0.5), 0][:dim], [-math.sin(0.5), math.cos(0.5), 0][:dim]
    if dim == 3:
        own = [1, 1, 1], [1, -2, 1]
        material = dict(FIBRES, axes={"x": turned(own[0], R), "y": turned(own[1], R)})
    else:
        material = dict(FIBRES, angle=math.degrees(0.5 + angle))
    material["expansion"] = [-1e-6, 3e-5, 2e-5]
    hold = [{"on": "top", "normal": turned([float(k == j) for j in range(dim)], R), "u": u} for k, u in enumerate([0.001, -0.02, 0][:dim])]
    return R, {"problem": {"kind": "scene", "model": "solid" if dim == 3 else "plane_strain",
                           "mesh": {"nodes": [turned(x, R) for x in nodes], "elements": {kind: cells},
                                    "groups": {"low": {"faces" if dim == 3 else "edges": low}, "top": {"nodes": top}}},
                           "materials": [{"on": "all", "orthotropic": material}], "supports": hold,
                           "loads": [{"on": "all", "temperature": 25}, {"on": "all", "body_force": turned([300, 0, 200][:dim], R)}],
                           "contacts": [{"on": "low", "obstacle": {"plane": {"point": turned([0, -0.001, 0][:dim], R), "normal": turned([0, 1, 0][:dim], R)}}}]}}


def test_a_scene_turned_with_its_material(s):
    for kind, axis in (("quad4", (0, 0, 1)), ("hex8", (0, 0, 1)), ("hex8", (1, -2, 2))):
        still = answer(s, generated(kind, 0)[1])
        for degrees in (37, -111):
            R, body = generated(kind, degrees, axis)
            found = answer(s, body)
            close(found["displacements"], [turned(u, R) for u in still["displacements"]], 1e-7, kind, )
            a, b = found["summary"], still["summary"]
            close(a["energy"]["primal"], b["energy"]["primal"], 1e-8)
            close(a["discretization_error"], b["discretization_error"], 1e-6)
            close(a["contact"]["force"], turned(b["contact"]["force"], R), 1e-7)
            check(a["contact"]["active"] == b["contact"]["active"] > 2, a["contact"])


def test_what_it_says_about_itself(s):
    """No bound is claimed, and a large rotation in the plane has a warning, as no law of finite strain is compared."""
    body = scene("plane_strain", [8, 2], {"orthotropic": FIBRES}, [{"on": "left", "ux": 0, "uy": 0}], [{"on": "top", "traction": [0, -20]}],
                 [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.001], "normal": [0, 1]}}}])
    body["solver"] = {"accuracy": {"total": 0.5, "guaranteed": True}}
    found = answer(s, body)["summary"]
    check(found["error"]["kind"] == "estimated" and "orthotropic" in str(found), found)
    bent = scene("plane_strain", [40, 2], {"orthotropic": FIBRES}, [{"on": "left", "ux": 0, "uy": 0}], [{"on": "right", "traction": [0, 12]}],
                 size=[20, 1], element="quad8")
    warnings = answer(s, bent)["summary"]["warnings"]
    check(any(w["code"] == "large_deformation" and "orthotropic" in w["message"] for w in warnings), warnings)


def test_refusals(s):
    good = scene("plane_strain", [2, 2], {"orthotropic": FIBRES}, [{"on": "left", "ux": 0, "uy": 0}], [])
    expect(s.post(good, query="?validate=true"), 200)

    def refused(pointer, word, change, base=good):
        """When it comes, and when it is only looked at."""
        body = copy.deepcopy(base)
        change(body["problem"], body["problem"]["materials"][0]["orthotropic"])
        found = expect(s.post(body), 422).json
        check(expect(s.post(body, query="?validate=true"), 422).json["pointer"] == found["pointer"], found)
        check(found["pointer"].startswith(f"/problem/materials/0{pointer}") and word in found["detail"], pointer, found)

    refused("/orthotropic/poisson/0", "the other way round", lambda p, m: m["poisson"].__setitem__(0, 4))
    refused("/orthotropic/poisson", "make them smaller", lambda p, m: m["poisson"].__setitem__(0, 3.9))
    refused("/orthotropic/young/1", "greater than 0", lambda p, m: m["young"].__setitem__(1, 0))
    refused("/orthotropic", "shear", lambda p, m: m.pop("shear"))
    refused("/young", "", lambda p, m: p["materials"][0].update(young=1))
    refused("/yield", "", lambda p, m: p["materials"][0].update({"yield": 1}))
    refused("/law", "", lambda p, m: p["materials"][0].update(law="neo_hooke"))
    refused("/orthotropic/axes", "", lambda p, m: m.update(axes={"x": [1, 0, 0], "y": [0, 1, 0]}))
    refused("/orthotropic", "moving", lambda p, m: p.update(kinematics="finite"))
    solid = scene("solid", [1, 1, 1], {"orthotropic": dict(FIBRES, axes={"x": [1, 0, 0], "y": [0, 1, 0]})}, [{"on": "left", "ux": 0, "uy": 0, "uz": 0}], [])
    expect(s.post(solid, query="?validate=true"), 200)
    refused("/orthotropic/axes/y", "not across", lambda p, m: m["axes"].update(y=[0.1, 1, 0]), solid)
    refused("/orthotropic/axes/x", "direction", lambda p, m: m["axes"].update(x=[0, 0, 0]), solid)
    refused("/orthotropic/angle", "", lambda p, m: m.update(angle=3), solid)


def deck(body, kind):
    """The same as an input file of CalculiX, without contact."""
    problem = body["problem"]
    nodes, material = problem["mesh"]["nodes"], problem["materials"][0]["orthotropic"]
    E, nu, G = material["young"], material["poisson"], material["shear"]
    if "axes" in material:
        a, b = material["axes"]["x"], material["axes"]["y"]
    else:
        turn = math.radians(material["angle"])
        a, b = [math.cos(turn), math.sin(turn), 0], [-math.sin(turn), math.cos(turn), 0]
    lines = ["*NODE"] + [", ".join([str(i + 1)] + [repr(v) for v in x] + ["0."] * (3 - len(x))) for i, x in enumerate(nodes)]
    lines += [f"*ELEMENT, TYPE={kind}, ELSET=ALL"]
    for e, cell in enumerate(*problem["mesh"]["elements"].values()): # no line has more than 16 numbers
        row = [str(k) for k in [e + 1] + [n + 1 for n in cell]]
        lines += [", ".join(row[:12]) + ("," if len(row) > 12 else "")] + [", ".join(row[12:])] * (len(row) > 12)
    lines += ["*MATERIAL, NAME=M", "*ELASTIC, TYPE=ENGINEERING CONSTANTS", f"{E[0]}, {E[1]}, {E[2]}, {nu[0]}, {nu[2]}, {nu[1]}, {G[0]}, {G[2]}", f"{G[1]}, 0."]
    lines += ["*ORIENTATION, NAME=O, SYSTEM=RECTANGULAR", ", ".join(map(repr, a + b)), "*SOLID SECTION, ELSET=ALL, MATERIAL=M, ORIENTATION=O", "1."]
    lines += ["*STEP", "*STATIC", "*BOUNDARY"]
    for support in problem["supports"]:
        for node in problem["mesh"]["groups"][support["on"]]["nodes"]:
            lines += [f"{node + 1}, {k + 1}, {k + 1}, {support[key]!r}" for k, key in enumerate(("ux", "uy", "uz")) if key in support]
    lines += ["*CLOAD"]
    for load in problem["loads"]:
        lines += [f"{load['node'] + 1}, {k + 1}, {f!r}" for k, f in enumerate(load["force"])]
    return "\n".join(lines + ["*NODE PRINT, NSET=NALL", "U", "*END STEP", ""]).replace("*ELEMENT,", "*NSET, NSET=NALL, GENERATE\n" + f"1, {len(nodes)}, 1\n*ELEMENT,", 1)


def quadratic(kind, n):
    """A block of n cells in each direction, of elements with middles of edges."""
    dim = 3 if kind == "hex20" else 2
    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)][:8 if dim == 3 else 4]
    edges = [(0, 1), (1, 2), (2, 3), (3, 0)] + ([(4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)] if dim == 3 else [])
    places = corners + [tuple((a + b) // 2 for a, b in zip(corners[i], corners[j])) for i, j in edges]
    number, cells = {}, []
    for c in range(n if dim == 3 else 1):
        for b in range(n):
            for a in range(n):
                cells.append([number.setdefault((2 * a + p, 2 * b + q, 2 * c + r), len(number)) for p, q, r in places])
    return [[x / (2 * n) for x in at[:dim]] for at in number], cells, [k for at, k in number.items() if at[1] == 0], number[(2 * n,) * dim + (0,) * (3 - dim)]


def test_answers_are_those_of_calculix(s):
    """A solid and a body in plane strain, clamped and pulled at a corner."""
    if not shutil.which("ccx"):
        print("# CalculiX is not installed")
        return
    for kind, type_of, axes in (("hex20", "C3D20", {"axes": {"x": [1.0, 1.0, 1.0], "y": [1.0, -2.0, 1.0]}}), ("quad8", "CPE8", {"angle": 28.0})):
        nodes, cells, low, corner = quadratic(kind, 2)
        dim = len(nodes[0])
        body = {"problem": {"kind": "scene", "model": "solid" if dim == 3 else "plane_strain",
                            "mesh": {"nodes": nodes, "elements": {kind: cells}, "groups": {"low": {"nodes": low}}},
                            "materials": [{"on": "all", "orthotropic": dict(FIBRES, **axes)}],
                            "supports": [dict({"on": "low"}, **{key: 0.0 for key in ("ux", "uy", "uz")[:dim]})],
                            "loads": [{"node": corner, "force": [30.0, 50.0, -20.0][:dim]}],
                            "contacts": [{"on": {"where": {"x": 0}}, "obstacle": FAR[dim]["obstacle"]}]}}
        found = answer(s, body)["displacements"]
        with tempfile.TemporaryDirectory() as place:
            path = pathlib.Path(place)
            (path / "job.inp").write_text(deck(body, type_of))
            run = subprocess.run(["ccx", "job"], cwd=place, capture_output=True, text=True, timeout=120)
            rows = re.findall(r"^\s*(\d+)((?:\s+-?\d\.\d+E[+-]\d+){3})\s*$", (path / "job.dat").read_text(), re.M)
        check(len(rows) == len(nodes), len(rows), len(nodes), run.stdout[-500:])
        theirs = [None] * len(nodes)
        for number, values in rows:
            theirs[int(number) - 1] = [float(v) for v in values.split()][:dim]
        close(found, theirs, 2e-6, kind)


if __name__ == "__main__":
    service.main(globals())
