"""A cube of solid elements in contact with a plane, as requests, and what a daemon takes for it."""
import pathlib
import sys

import numpy

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: E402  the path is set above

SIDE, YOUNG, POISSON, LONGEST_S = 40.0, 1000.0, 0.3, 1800
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]  # of hex8
TETS = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
GMSH = {"hex8": (5, 3), "tet4": (4, 2)}  # Gmsh's numbers of the element and of its side
SIDES = {"left": (0, 0), "right": (0, 1), "bottom": (1, 0), "top": (1, 1)}  # axis, end


def mesh(kind, n):
    """Nodes, elements, and faces of the four sides."""
    line = numpy.arange(n + 1) * SIDE / n
    z, y, x = numpy.meshgrid(line, line, line, indexing="ij")
    nodes = numpy.stack([x, y, z], axis=-1).reshape(-1, 3)
    if kind != "box":
        moved = 0.15 * SIDE / n * numpy.random.default_rng(1).uniform(-1, 1, nodes.shape)
        nodes = nodes + numpy.where((nodes > 0) & (nodes < SIDE * (1 - 1e-9)), moved, 0)
    k, j, i = (t.ravel() for t in numpy.meshgrid(*3 * [numpy.arange(n)], indexing="ij"))
    cells = numpy.stack([((k + c[2]) * (n + 1) + j + c[1]) * (n + 1) + i + c[0] for c in CORNERS], axis=1)
    faces = {}
    for side, (axis, end) in SIDES.items():
        at = [c for c in range(8) if CORNERS[c][axis] == end]
        at = [at[0], at[1], at[3], at[2]] if sum(a != b for a, b in zip(CORNERS[at[1]], CORNERS[at[2]])) == 2 else at
        quads = cells[((i, j, k)[axis] == end * (n - 1))][:, at]
        faces[side] = quads if kind != "tet4" else halves(quads, at)
    return nodes, (cells[:, TETS].reshape(-1, 4) if kind == "tet4" else cells), faces


def halves(quads, corners):
    """Triangles along the diagonal that the tetrahedra have: it goes from the face's least corner to its greatest."""
    order = sorted(range(4), key=lambda q: sum(CORNERS[corners[q]]))
    first, last = order[0], order[3]
    return numpy.concatenate([quads[:, [first, q, last]] for q in order[1:3]])


def request(kind, n, nodes, elements, faces):
    """The mesh of a box is its numbers of cells, that of another kind is written out."""
    if kind == "box":
        mesh = {"box": {"size": 3 * [SIDE], "cells": 3 * [n], "element": "hex8"}}
    else:
        mesh = {"nodes": nodes.tolist(), "elements": {kind: elements.tolist()}, "groups": {side: {"faces": f.tolist()} for side, f in faces.items()}}
    return {"problem": {"kind": "scene", "model": "solid", "mesh": mesh,
                        "materials": [{"on": "all", "young": YOUNG, "poisson": POISSON}],
                        "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}],
                        "loads": [{"on": "top", "traction": [0, -0.05, 0]}, {"on": "right", "traction": [0.5, 0, 0]}],
                        "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}}]},
            "solver": {"accuracy": {"relative_error": 1e-6}}}


def gmsh(kind, nodes, elements, faces):
    """The mesh as a file of Gmsh's, binary, version 2.2: a tenth of the bytes of JSON, and read much faster."""
    body, side = GMSH[kind]
    names = "".join(f'2 {k + 1} "{name}"\n' for k, name in enumerate(faces))
    rows = numpy.empty(len(nodes), [("number", "<i4"), ("x", "<f8", 3)])
    rows["number"], rows["x"] = numpy.arange(1, len(nodes) + 1), nodes
    parts = [(side, k + 1, own) for k, own in enumerate(faces.values())] + [(body, len(faces) + 1, elements)]
    out = [b"$MeshFormat\n2.2 1 8\n", numpy.int32(1).tobytes(), b"\n$EndMeshFormat\n",
           f'$PhysicalNames\n{len(parts)}\n{names}3 {len(parts)} "solid"\n$EndPhysicalNames\n'.encode(),
           f"$Nodes\n{len(nodes)}\n".encode(), rows.tobytes(), b"\n$EndNodes\n",
           f"$Elements\n{sum(len(own) for _, _, own in parts)}\n".encode()]
    first = 1
    for number, group, own in parts:
        rows = numpy.empty(len(own), [("number", "<i4"), ("tags", "<i4", 2), ("node", "<i4", own.shape[1])])
        rows["number"], rows["tags"], rows["node"] = numpy.arange(first, first + len(own)), group, own + 1
        out += [numpy.array([number, len(own), 2], "<i4").tobytes(), rows.tobytes()]
        first += len(own)
    return b"".join([*out, b"\n$EndElements\n"])


def answer(s, asked):
    """Of a job that may take minutes, where it converged. The daemon says when it has ended: who asks every few
    milliseconds takes 8 % of what two threads have on two cores."""
    job = s.post(asked, {"Prefer": "wait=60"}).json
    if "id" not in job:
        raise RuntimeError(job.get("detail"))
    if job["status"] != "successful" or job["summary"]["outcome"] != "converged":
        raise RuntimeError(job["error"] or job["summary"]["outcome"])
    return job


def by_daemon(build, asked, file=None):
    """Seconds of a body that is new, and of another load on it; what was answered. file: the mesh, which is uploaded
    first, as part of what the new body takes."""
    s = service.Service(build, "--workers", "1", "--threads", "1")
    seconds = []
    try:
        s.start()
        before = s.settle()
        problem = asked["problem"]
        if file:
            problem = {**problem, "mesh": {"gmsh": {"upload": s.request("POST", "/v1/uploads", file, timeout=LONGEST_S).json["id"]}}}
        for factor in (1.0, 1.03):
            loads = [{**load, "traction": [factor * t for t in load["traction"]]} for load in problem["loads"]]
            job = answer(s, {**asked, "problem": {**problem, "loads": loads}})
            seconds.append(s.settle() - before)
            before += seconds[-1]
        return seconds, job["summary"]
    finally:
        s.stop()
