"""Bodies of large deformation that pass through themselves, or through each other, where no contact says that they must not:
generated ones, held against the winding numbers of their deformed boundaries.
usage: test_interpenetration.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import collections
import math
import random

import numpy

import service
from service import check, some
from two_bodies import FACES, SOLID, body

SHARED = True  # one service for all tests

LAWS = ("neo_hooke", "neo_hooke_isochoric", "st_venant_kirchhoff")
PLANE = ("quad4", "quad8", "tri3", "tri6")
DEEP = 3e-3  # of a side: thrice what may go untold


def arc(kind, inner, outer, begin, end, wide=0.5):
    """A map of the unit square, or cube, to a sector of a ring: the inner side is the upper one."""
    def place(x, *t):
        a, r = begin + (end - begin) * x, outer + (inner - outer) * t[-1]
        p = (r * math.cos(a), r * math.sin(a))
        return (p[0], wide * t[0], p[1]) if kind in SOLID else p
    return place


def moved(kind, on, x, y):
    return {"on": on, "ux": x, "uz" if kind in SOLID else "uy": y}


def scene(kind, parts, cells, places, groups, law, supports, **more):
    solid = kind in SOLID
    ends = {"left": "x0", "right": "x1", "bottom": "z0", "top": "z1"}
    return body([kind] * parts, [(n, 1, m) if solid else (n, m) for n, m in cells], places,
                {name: [(k, ends[side] if solid else side)] for name, (k, side) in groups.items()},
                model="solid" if solid else "plane_strain", kinematics="finite",
                materials=[{"on": "all", "young": 1, "poisson": 0.3, "law": law}],
                supports=supports + ([{"on": "all", "uy": 0}] if solid else []), **{"contacts": [], **more})


def clip(kind, law, rng):
    """A ring with a slot, whose ends are moved past each other."""
    slot, close = rng.uniform(0.2, 0.5), rng.uniform(0.05, 0.9)
    return scene(kind, 1, [(rng.randint(12, 30), rng.randint(1, 3))], [arc(kind, 0.8, 1, slot, 2 * math.pi - slot)],
                 {"a": (0, "left"), "b": (0, "right")}, law,
                 [moved(kind, "a", 0, -close), moved(kind, "b", rng.uniform(-0.1, 0.1), close)])


def squeezed(kind, law, rng, cells=None, inner=None, down=None, half=False):
    """A ring whose crown and foot are pressed together, so that its inner side may come to itself; or the upper half of it."""
    inner, down, end = inner or rng.uniform(0.75, 0.9), down or rng.uniform(0.3, 1.15), math.pi if half else 2 * math.pi
    request = scene(kind, 1, [cells or (4 * rng.randint(4, 8), rng.randint(1, 2))], [arc(kind, inner, 1, 0, end)],
                    {"inner": (0, "top"), "first": (0, "left"), "last": (0, "right")}, law, [])
    mesh = request["problem"]["mesh"]
    place = lambda node: tuple(round(c, 9) + 0.0 for c in node)
    first = {}
    for n, node in enumerate(mesh["nodes"]):
        first.setdefault(place(node), n)
    kept = sorted(first.values())  # both ends of the unit square are one
    number = {place(mesh["nodes"][n]): i for i, n in enumerate(kept)}
    joined = [number[place(node)] for node in mesh["nodes"]]
    mesh["elements"] = {kind: [[joined[n] for n in element] for element in mesh["elements"][kind]]}
    mesh["groups"] = {name: {key: [[joined[n] for n in side] for side in sides] for key, sides in group.items()}
                      for name, group in mesh["groups"].items() if half or name == "inner"}
    mesh["nodes"] = [mesh["nodes"][n] for n in kept]
    at = lambda x, y: [i for i, node in enumerate(mesh["nodes"]) if abs(node[0] - x) < 1e-9 and abs(node[-1] - y) < 1e-9]
    mesh["groups"]["crown"] = {"nodes": at(0, 1)}
    supports = [moved(kind, "crown", 0, -down)] + ([{"on": "all", "uy": 0}] if kind in SOLID else [])
    if half:
        supports += [{"on": name, "uz" if kind in SOLID else "uy": 0} for name in ("first", "last")]
    else:
        mesh["groups"]["foot"] = {"nodes": at(0, -1)}
        supports.append(moved(kind, "foot", 0, down))
    request["problem"]["supports"] = supports
    return request


def folded(kind, law, rng, turn=175):
    """A strip, half of which lies still; its right end is turned by so many degrees and put above that, or into it."""
    long, high, n = rng.uniform(4, 5), rng.uniform(-0.3, 1), rng.randint(14, 20)
    place = lambda x, *t: (long * x, 0.5 * t[0], 0.3 * t[1]) if kind in SOLID else (long * x, 0.3 * t[0])
    request = scene(kind, 1, [(n, 1)], [place], {"up": (0, "top"), "down": (0, "bottom"), "right": (0, "right")}, law, [])
    key = "faces" if kind in SOLID else "edges"
    groups = request["problem"]["mesh"]["groups"]
    nodes = request["problem"]["mesh"]["nodes"]
    groups["still"] = {key: [side for side in groups.pop("down")[key] if max(nodes[k][0] for k in side) < 0.5 * long]}
    point, turned = ([long, 0, 0.15], {"uy": 0, "rx": 0, "ry": -turn, "rz": 0}) if kind in SOLID else ([long, 0.15], {"rz": turn})
    across = "uz" if kind in SOLID else "uy"
    request["problem"]["supports"] = [moved(kind, "still", 0, 0), {"on": "right", "rigid": {"point": point, "ux": -long * rng.uniform(0.7, 0.85), across: high, **turned}}]
    request["cases"] = [{"name": "bend", "steps": [0.5, 1]}]
    return request


def crossing(kind, law, rng):
    """Two blocks, or needles, one of which is moved across or into the other."""
    wide, down = rng.choice((0.06, 0.5, 1)), rng.uniform(0.1, 3)
    low = lambda x, *t: (2 * x, 0.5 * t[0], 0.4 * t[1]) if kind in SOLID else (2 * x, 0.4 * t[0])
    at = rng.uniform(0.2, 1.4)
    high = lambda x, *t: (at + wide * x, 0.1 + 0.3 * t[0], 0.7 + 1.5 * t[1]) if kind in SOLID else (at + wide * x, 0.7 + 1.5 * t[0])
    return scene(kind, 2, [(rng.randint(2, 8), rng.randint(1, 2)), (rng.randint(1, 2), rng.randint(1, 4))], [low, high],
                 {"foot": (0, "bottom"), "head": (1, "top")}, law, [moved(kind, "foot", 0, 0), moved(kind, "head", 0, -down)])


# ---- the check

def boundary(mesh):
    """Outer sides as the nodes of straight pieces, lines or triangles, oriented so that the body is within."""
    sides = {}
    for kind, elements in mesh["elements"].items():
        shape = kind.rstrip("0123456789")
        for e in elements:
            corners = {"tri": 3, "quad": 4}.get(shape)
            for face in FACES[shape] if corners is None else [(k, (k + 1) % corners) for k in range(corners)]:
                nodes = [e[k] for k in face]
                middle = [e[corners + face[0]]] if corners and len(e) > corners else []
                sides.setdefault(tuple(sorted(nodes)), []).append(nodes + middle)
    return [one[0] for one in sides.values() if len(one) == 1]


def pieces(side, x):
    """Straight pieces of one side, and points on it with the outward normal there."""
    p = x[side]
    if x.shape[1] == 2:
        t = numpy.linspace(-1, 1, 9)[:, None]
        line = 0.5 * (1 - t) * p[0] + 0.5 * (1 + t) * p[1] if len(side) == 2 else 0.5 * t * (t - 1) * p[0] + 0.5 * t * (t + 1) * p[1] + (1 - t * t) * p[2]
        way = numpy.diff(line, axis=0)
        parts = [(p[0], p[1])] if len(side) == 2 else list(zip(line, line[1:]))
        return parts, list(zip(0.5 * (line[1:] + line[:-1]), numpy.stack([way[:, 1], -way[:, 0]], 1)))
    parts = [(p[0], p[k], p[k + 1]) for k in range(1, len(side) - 1)]
    points = []
    for a, b, c in parts:
        points += [(a + s * (b - a) + t * (c - a), numpy.cross(b - a, c - a)) for s in (0.02, 0.3, 0.6, 0.9) for t in (0.02, 0.3, 0.6, 0.9) if s + t < 1]
    return parts, points


def windings(points, parts):
    """How often the boundary goes around each point: how many layers of the body are there."""
    if points.shape[1] == 2:
        a, b = (parts[None, :, k] - points[:, None] for k in (0, 1))
        return numpy.arctan2(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], (a * b).sum(2)).sum(1) / (2 * math.pi)
    a, b, c = (parts[None, :, k] - points[:, None] for k in (0, 1, 2))
    la, lb, lc = (numpy.linalg.norm(v, axis=2) for v in (a, b, c))
    det = (a * numpy.cross(b, c)).sum(2)
    return 2 * numpy.arctan2(det, la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb).sum(1) / (4 * math.pi)


def passes_through(mesh, displacements, part=DEEP):
    """Is the boundary inside of the body? By this part of its longest side; at all. Points in front of a side and behind it."""
    x = numpy.array(mesh["nodes"]) + numpy.array(displacements)
    sides = boundary(mesh)
    parts, points, normals = [], [], []
    for side in sides:
        some_parts, on = pieces(side, x)
        parts += some_parts
        points += [p for p, _ in on]
        normals += [n / numpy.linalg.norm(n) for _, n in on]
    parts, points, normals = map(numpy.array, (parts, points, normals))
    longest = max(numpy.linalg.norm(x[a] - x[b]) for side in sides for a in side for b in side)
    layers = lambda part: numpy.concatenate([windings(points[k:k + 200] + part * normals[k:k + 200], parts) for k in range(0, len(points), 200)])
    ahead = numpy.round(layers(part * longest))
    behind, near = numpy.round(layers(-part * longest)), numpy.round(layers(1e-6 * longest))
    return bool(((ahead >= 1) & (behind >= 2)).any()), bool((near >= 1).any())


def told(answer):
    return [w for w in answer["summary"]["warnings"] if w["code"] == "interpenetration"]


def answers(s, request):
    """Of every case."""
    job = s.solved(request)
    found = s.get(f"/v1/jobs/{job['id']}/result?fields=summary,displacements").json
    return found.get("cases", [found])


def test_edges_that_meet_sides_between_elements(s):
    """A symmetric ring of one layer, pressed past itself by a little: all its edges there lie on sides between elements or on outer ones."""
    request = squeezed("hex8", "st_venant_kirchhoff", random.Random(0), cells=(28, 2), inner=0.8449, down=0.8610)
    (answer,) = answers(s, request)
    deep, _ = passes_through(request["problem"]["mesh"], answer["displacements"])
    check(answer["summary"]["outcome"] == "converged" and deep and told(answer), deep, answer["summary"]["warnings"])


def test_nothing_passes_through_unsaid(s):
    """72 bodies that are led into themselves or each other, or nearly so, in all elements and laws."""
    said, count = [], collections.Counter()
    for k in some(range(72)):
        rng = random.Random(f"passing {k}")
        kind = (PLANE + ("hex8", "tet4"))[k % 6]
        make = (clip, squeezed, folded, crossing)[k // 6 % 4]
        request = make(kind, rng.choice(LAWS), rng)
        for answer in answers(s, request):
            deep, touches = passes_through(request["problem"]["mesh"], answer["displacements"])
            found = [w for w in told(answer) if not w["message"].startswith("under ")]
            count[make.__name__, deep, bool(found)] += 1
            if deep and not found or found and not touches:
                said.append((k, make.__name__, kind, deep, touches, answer["summary"]["outcome"], found))
    check(not said, len(said), said[:5], count)
    for make in (clip, squeezed, folded, crossing):
        check(min(count[make.__name__, True, True], count[make.__name__, False, False]) > 0, make.__name__, count)


if __name__ == "__main__":
    service.main(globals())
