"""What holds bodies of large deformation beside plain supports: springs, ties, rigid groups, by closed forms and by the same body made
otherwise."""
# not under ThreadSanitizer: about answers, not about threads
import math

import numpy

import service
from service import check, expect
from two_bodies import PLANE, SOLID, body

SHARED = True  # one service for all tests

YOUNG, POISSON = 1.0, 0.3
LAMBDA, MU = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
LAWS = ("neo_hooke", "neo_hooke_isochoric", "st_venant_kirchhoff")


def answer(s, request, outcome="converged", fields="summary,displacements,nodes,stress", forces=True):
    job = s.solved(request)
    found = s.get(f"/v1/jobs/{job['id']}/result?fields={fields}").json
    summary = found["summary"]
    check(summary["outcome"] == outcome, summary["outcome"], summary.get("message"))
    check((summary["resultants"]["imbalance"] < 1e-7 or not forces) and "finite" in summary, summary["resultants"])
    return found


def refused(s, request, pointer, word):
    reply = s.post(request)
    found = reply.json if reply.status != 202 else s.wait_status(reply.json["id"], "failed", "successful")["error"]
    check(found["pointer"] == f"/problem{pointer}" and word in found["detail"], found)


def scene(law="neo_hooke", poisson=POISSON, **more):
    return {"problem": {"kind": "scene", "model": "plane_strain", "kinematics": "finite",
                        "materials": [{"on": "all", "young": YOUNG, "poisson": poisson, "law": law}], **more}}


def nominal(law, a, b):
    """The first Piola-Kirchhoff stress along both axes of a slice that is stretched by a and b."""
    j, trace = a * b, a * a + b * b + 1
    if law == "neo_hooke":
        return [MU * (c - 1 / c) + LAMBDA * math.log(j) / c for c in (a, b)]
    if law == "neo_hooke_isochoric":
        return [MU * j ** (-2 / 3) * (c - trace / 3 / c) + (LAMBDA + 2 / 3 * MU) * (j - 1) * j / c for c in (a, b)]
    strain = [(c * c - 1) / 2 for c in (a, b)]
    return [c * (LAMBDA * sum(strain) + 2 * MU * e) for c, e in zip((a, b), strain)]


def pull(law, a):
    """The force of a slice of unit height that is stretched by a and free aside."""
    low, high = 0.3, 1.5
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (low, middle) if nominal(law, a, middle)[1] > 0 else (middle, high)
    return nominal(law, a, low)[0]


# ---- springs

def test_a_bar_on_a_spring_is_stretched_by_half(s):
    """One end moves, the other one is held by a spring: the closed form of each law, as it is, mirrored and upright."""
    for law in LAWS:
        force, stiff = pull(law, 1.5), 0.7
        way = 2 * 0.5 + force / stiff  # of the bar, two long, and of the spring
        for sign, upright in ((1, False), (-1, False), (1, True)):
            box = {"size": [1, 2] if upright else [2, 1], "cells": [2, 3] if upright else [3, 2], "element": "quad8"}
            axis, ends = ("y", ("bottom", "top")) if upright else ("x", ("left", "right") if sign > 0 else ("right", "left"))
            aside = {"on": "left", "ux": 0} if upright else {"on": "bottom", "uy": 0}
            spring = [0, stiff] if upright else [stiff, 0]
            found = answer(s, scene(law, mesh={"box": box}, supports=[{"on": ends[0], f"u{axis}": -sign * way}, {"on": ends[1], "spring": spring}, aside]))
            c, summary = "xy".index(axis), found["summary"]
            at = [u[c] for x, u in zip(found["nodes"], found["displacements"]) if abs(x[c] - (2 if sign > 0 else 0)) < 1e-9]
            check(all(abs(u + sign * force / stiff) < 1e-7 for u in at), law, at, force / stiff)
            held, springs = (one["force"][c] for one in summary["resultants"]["supports"][:2])
            check(abs(springs - sign * force) < 1e-7 and abs(held + sign * force) < 1e-7, law, held, springs, force)
            check(summary["finite"]["qps"] <= 8 and summary["error"]["mesh"] < 1e-6, summary["finite"])
            check(abs(summary["energy"]["potential"] - summary["energy"]["strain"]) < 1e-12, summary["energy"])  # no loads
            moved = answer(s, scene(law, mesh={"box": box}, supports=[{"on": ends[0], f"u{axis}": -sign * (way - force / stiff)}, {"on": ends[1], f"u{axis}": 0}, aside]))
            stored = summary["energy"]["strain"] - moved["summary"]["energy"]["strain"]
            check(abs(stored - force ** 2 / 2 / stiff) < 1e-8, law, stored)  # the spring's own


def test_a_beam_on_elastic_ground_turns(s):
    """Its force on the ground is linear in displacements, whatever turns: a cantilever that bends by more than half its length against ground
    that is held against finer meshes, and balances."""
    def bent(cells, kinds="quad8", mirrored=False):
        sign = -1 if mirrored else 1
        return answer(s, scene("st_venant_kirchhoff", 0, mesh={"box": {"size": [10, 0.5], "cells": cells, "element": kinds}},
                               loads=[{"on": "right", "traction": [0, -4e-3 * sign]}],
                               supports=[{"on": "left", "ux": 0, "uy": 0}, {"on": "top" if mirrored else "bottom", "spring": [0, 1e-3]}]))
    coarse, fine, mirror = bent([20, 1]), bent([40, 2]), bent([20, 1], mirrored=True)
    tip = [min(u[1] for u in one["displacements"]) for one in (coarse, fine)]
    check(tip[0] < -2 and abs(tip[0] / tip[1] - 1) < 2e-3, tip)
    check(abs(max(u[1] for u in mirror["displacements"]) + tip[0]) < 1e-7, tip)
    ground = [one["summary"]["resultants"]["supports"][1]["force"][1] for one in (coarse, mirror)]
    check(ground[0] > 0 and abs(ground[0] + ground[1]) < 1e-9, ground)


def test_auto_takes_large_deformation_on_springs(s):
    request = scene("neo_hooke", kinematics="auto", mesh={"box": {"size": [2, 1], "cells": [3, 2], "element": "quad8"}},
                    supports=[{"on": "left", "ux": -1 - pull("neo_hooke", 1.5) / 0.7}, {"on": "right", "spring": [0.7, 0]}, {"on": "bottom", "uy": 0}])
    found = answer(s, request)
    check(found["summary"]["small_deformation"]["error"] > 0.05, found["summary"]["small_deformation"])
    check(abs(found["summary"]["resultants"]["supports"][1]["force"][0] - pull("neo_hooke", 1.5)) < 1e-7, found["summary"]["resultants"])


def test_a_support_that_is_said_twice_holds_in_one_place(s):
    """A body is held against itself by what holds it in two: a clamp said twice, or along two normals, was taken for that, and compared."""
    clamp = {"on": "left", "ux": 0, "uy": 0}
    for supports in ([clamp], [clamp, clamp], [{"on": "left", "normal": n, "u": 0} for n in ([1, 1], [1, -1])]):
        request = scene(kinematics="auto", mesh={"box": {"size": [4, 1], "cells": [16, 4], "element": "quad8"}}, supports=supports,
                        loads=[{"on": "right", "traction": [0, 1e-5]}])
        summary = s.solve(request)["summary"]
        check(summary["outcome"] == "converged" and "small_deformation" not in summary, supports, summary)


def test_solids_and_rings_have_springs(s):
    """A cube and a disc that are pulled along an axis on springs: nothing is held but for symmetry."""
    stiff, load = 0.5, 0.4
    cube = answer(s, scene(model="solid", mesh={"box": {"size": [1, 1, 1], "cells": [2, 2, 2]}}, loads=[{"on": "top", "traction": [0, load, 0]}],
                           supports=[{"on": "left", "ux": 0}, {"on": "back", "uz": 0}, {"on": "bottom", "spring": [0, stiff, 0]}]))
    disc = answer(s, scene(model="axisymmetric", mesh={"box": {"size": [1, 1], "cells": [2, 2]}}, loads=[{"on": "top", "traction": [0, load]}],
                           supports=[{"on": "bottom", "spring": [0, math.pi * stiff]}]))
    for one in (cube, disc):
        bottom = [u[1] for x, u in zip(one["nodes"], one["displacements"]) if x[1] == 0]
        check(all(abs(u - load / stiff) < 1e-7 for u in bottom), bottom)
    check(all(abs(a[1] - b[1]) < 1e-7 for a, b in zip(cube["stress"], disc["stress"])), cube["stress"][0], disc["stress"][0])


# ---- ties

def stacked(kinds, cells=None, lean=0.0, size=1.0, **more):
    """A unit body on another one, neither mesh a part of the other; the surface between them may lean."""
    solid = kinds[0] in SOLID
    sides = {"foot": [(0, "z0" if solid else "bottom")], "roof": [(0, "z1" if solid else "top")],
             "floor": [(1, "z0" if solid else "bottom")], "head": [(1, "z1" if solid else "top")],
             "left": [(k, "x0" if solid else "left") for k in (0, 1)], "right": [(k, "x1" if solid else "right") for k in (0, 1)]}
    if solid:
        sides["side"] = [(0, "y0"), (1, "y0")]
        places = [lambda x, y, z: (x, y, z * (1 + lean * x)), lambda x, y, z: (x, y, 1 + lean * x + z * (1 - lean * x))]
        cells = cells or [(2, 2, 2), (3, 3, 2)]
    else:
        places = [lambda x, y: (size * x, y * (1 + lean * x)), lambda x, y: (size * x, 1 + lean * x + y * (1 - lean * x))]
        cells = cells or [(2, 2), (3, 2)]
    request = scene(model="solid" if solid else "plane_strain", ties=[{"on": "roof", "to": "floor"}], **more)["problem"]
    del request["kind"]
    return body(kinds, cells, places, sides, **request)


def test_tied_bodies_are_stretched_as_one(s):
    """A uniform state is exact on any two meshes."""
    for kinds in [[a, b] for a in PLANE for b in PLANE] + [["hex8", "hex8"], ["hex20", "hex8"], ["tet10", "hex20"]]:
        solid = kinds[0] in SOLID
        up = "uz" if solid else "uy"
        supports = [{"on": "foot", up: 0}, {"on": "head", up: 1.0}, {"on": "left", "ux": 0}] + ([{"on": "side", "uy": 0}] if solid else [])
        found = answer(s, stacked(kinds, lean=0.2, supports=supports))
        stress = numpy.array(found["stress"])
        check(numpy.abs(stress - stress[0]).max() < 1e-7 and stress[0].max() > 0.3, kinds, stress[0])
        if not solid:
            check(abs(found["summary"]["resultants"]["supports"][1]["force"][1] - pull("neo_hooke", 1.5)) < 1e-7, kinds)


def test_tied_bodies_turn_as_one(s):
    """Bent by a dead load, and turned as a whole by a support: as the same mesh without a tie."""
    places = {name: [] for name in ("tied", "one")}
    for kind in ("quad4", "quad8"):
        for name, build in places.items():
            cells = [(4, 2), (4, 2)]
            request = stacked([kind, kind], cells, supports=[{"on": "foot", "ux": 0, "uy": 0}], loads=[{"on": "head", "traction": [0.03, 0.01]}])
            if name == "one":
                request = scene(mesh={"box": {"size": [1, 2], "cells": [4, 4], "element": kind}}, supports=[{"on": "bottom", "ux": 0, "uy": 0}],
                                loads=[{"on": "top", "traction": [0.03, 0.01]}])
            found = answer(s, request)
            build[:] = sorted((round(x[0], 9), round(x[1], 9), *u) for x, u in zip(found["nodes"], found["displacements"]))
        tied, one = ({place[:2]: place[2:] for place in places[name]} for name in ("tied", "one"))
        off = max(abs(a - b) for at in one for a, b in zip(one[at], tied[at]))
        check(off < 1e-10 and max(abs(u[0]) for u in one.values()) > 0.3, kind, off)
    spin = {"rotation": {"angle": 60, "about": [0, 0]}}
    found = answer(s, stacked(["quad4", "tri6"], lean=0.3, supports=[{"on": "foot", "ux": 0, "uy": 0, **spin}]), forces=False)
    check(numpy.abs(found["stress"]).max() < 1e-8, numpy.abs(found["stress"]).max())


def test_ties_on_curves_are_refused(s):
    """Where surfaces do not lie on each other, a turn would strain them."""
    def tube(cells, kind):
        at = lambda r, a: (r * math.cos(a), r * math.sin(a))
        places = [lambda x, y: at(2 - y, x * math.pi / 2), lambda x, y: at(3 - y, x * math.pi / 2)]
        sides = {"bore": [(0, "top")], "roof": [(0, "bottom")], "floor": [(1, "top")], "head": [(1, "bottom")]}
        problem = scene(ties=[{"on": "roof", "to": "floor"}], supports=[{"on": "bore", "ux": 0, "uy": 0}], loads=[{"on": "head", "pressure": 0.1}])["problem"]
        del problem["kind"]
        return body([kind, kind], cells, places, sides, **problem)
    refused(s, tube([(4, 1), (7, 1)], "quad4"), "/ties/0", "quad8")
    answer(s, tube([(8, 1), (13, 1)], "quad8"))


# ---- rigid groups

def beam(length, rigid, thick, cells, poisson=0.0, mirrored=False, **more):
    """Along x, clamped on the left; what is beyond `length` is a rigid group."""
    sign = -1 if mirrored else 1
    xs = [length * i / cells for i in range(cells + 1)] + ([length + rigid] if rigid else [])
    n = len(xs) - 1
    at, nodes = {}, []
    for i in range(2 * n + 1):
        for j in range(3):
            if i % 2 == 0 or j != 1:
                x = xs[i // 2] if i % 2 == 0 else (xs[i // 2] + xs[i // 2 + 1]) / 2
                at[i, j] = len(nodes)
                nodes.append([x, sign * thick * (j / 2 - 0.5)])
    corner = lambda i: [(i, 0), (i + 2, 0), (i + 2, 2), (i, 2)]
    between = lambda a, b: at[(a[0] + b[0]) // 2, (a[1] + b[1]) // 2]
    elements = []
    for i in range(0, 2 * n, 2):
        ring = corner(i)[::sign]
        elements.append([at[c] for c in ring] + [between(a, b) for a, b in zip(ring, ring[1:] + ring[:1])])
    end = 2 * cells
    groups = {"clamp": {"nodes": [at[0, j] for j in range(3)]}, "tip": {"nodes": [k for (i, _), k in at.items() if i >= end]},
              "far": {"nodes": [at[2 * n, 1]]}}
    return scene("st_venant_kirchhoff", poisson, mesh={"nodes": nodes, "elements": {"quad8": elements}, "groups": groups}, **more), at, nodes


def test_a_rigid_plate_turns_by_sixty_degrees(s):
    """Turned with its point free to move, it bends the beam into an arc of a circle, that of an inextensible one but for its thickness."""
    length, angle = 10.0, math.radians(60)
    for mirrored in (False, True):
        sign = -1 if mirrored else 1
        request, at, nodes = beam(length, 1.0, 0.1, 20, mirrored=mirrored, supports=[{"on": "clamp", "ux": 0, "uy": 0},
                                                                                   {"on": "tip", "rigid": {"point": [length, 0], "rz": sign * 60}}])
        found = answer(s, request)
        u = found["displacements"][at[40, 1]]
        there = [length * math.sin(angle) / angle, length * (1 - math.cos(angle)) / angle]
        check(math.hypot(u[0] + length - there[0], sign * u[1] - there[1]) < 2e-3 * length, u, there)
        group = found["summary"]["resultants"]["supports"][1]
        check(abs(group["rigid"]["rotation"][0] - sign * 60) < 1e-7, group)
        check(abs(group["rigid"]["moment"][-1] / (sign * YOUNG * 0.1 ** 3 / 12 * angle / length) - 1) < 0.01 and math.hypot(*group["force"]) < 1e-9, group)
        # the plate has kept its shape: every distance in it
        tip = [k for (i, _), k in at.items() if i >= 40]
        moved = [numpy.array(nodes[k]) + found["displacements"][k] for k in tip]
        off = max(abs(numpy.linalg.norm(moved[a] - moved[b]) - numpy.linalg.norm(numpy.array(nodes[tip[a]]) - nodes[tip[b]]))
                  for a in range(len(tip)) for b in range(a))
        check(off < 1e-12 * length, off)


def elastica(length, rigid, load):
    """Of EI = 1 under a dead load across its rigid tip: theta'' = -load cos theta, theta'(length) = load rigid cos theta; the tip's place."""
    def shoot(bend):
        theta, kappa, x, y, n = 0.0, bend, 0.0, 0.0, 4000
        for _ in range(n):
            h, state = length / n, (theta, kappa, x, y)
            slope = lambda z: (z[1], -load * math.cos(z[0]), math.cos(z[0]), math.sin(z[0]))
            k1 = slope(state)
            k2 = slope([a + h / 2 * b for a, b in zip(state, k1)])
            theta, kappa, x, y = (a + h * b for a, b in zip(state, k2))
        return kappa - load * rigid * math.cos(theta), x + rigid * math.cos(theta), y + rigid * math.sin(theta)
    low, high = 0.0, load * (length + rigid)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if shoot(middle)[0] < 0 else (low, middle)
    return shoot(low)[1:]


def test_an_elastica_with_a_rigid_tip(s):
    """A dead load on the far end of a free rigid group: its arm shortens as it turns."""
    length, rigid, thick = 10.0, 3.0, 0.1
    stiff = YOUNG * thick ** 3 / 12
    load = 2.0 * stiff / length ** 2
    request, at, nodes = beam(length, rigid, thick, 20, supports=[{"on": "clamp", "ux": 0, "uy": 0}, {"on": "tip", "rigid": {"point": [length, 0]}}],
                              loads=[{"on": "far", "force": [0, load]}])
    found = answer(s, request)
    far = at[42, 1]
    x, y = (a + b for a, b in zip(nodes[far], found["displacements"][far]))
    there = elastica(length, rigid, load / stiff)
    check(there[1] > 0.5 * length and math.hypot(x - there[0], y - there[1]) < 2e-3 * length, (x, y), there)
    check(found["summary"]["finite"]["qps"] <= 40, found["summary"]["finite"])


def test_a_column_with_a_rigid_head_buckles(s):
    """Euler's load of a clamped column under a dead load on its rigid head, k b tan(k L) = 1: stable below it, and not above."""
    length, rigid, thick = 10.0, 4.0, 0.2
    low, high = 1e-6, math.pi / 2 / length
    for _ in range(100):
        k = (low + high) / 2
        low, high = (k, high) if k * rigid * math.tan(k * length) < 1 else (low, k)
    limit = low ** 2 * YOUNG * thick ** 3 / 12
    for part in (0.97, 1.03):
        request, _, _ = beam(length, rigid, thick, 20, supports=[{"on": "clamp", "ux": 0, "uy": 0}, {"on": "tip", "rigid": {"point": [length, 0]}}],
                             loads=[{"on": "far", "force": [-part * limit, 0]}])
        found = answer(s, request, "converged" if part < 1 else "unstable")
        check(found["summary"]["finite"]["definite"], found["summary"]["finite"])
        check(part < 1 or abs(found["summary"]["finite"]["load"] * part - 1) < 0.01, found["summary"]["finite"])


def test_a_rigid_side_is_one_that_is_turned(s):
    """A block whose side is turned by all of a rotation, as a rigid group and by a support that turns it: the same, in the plane and in space."""
    for solid, turn in ((False, [0, 0, 0.8]), (True, [0.5, -0.4, 0.9])):
        dim, angle = 3 if solid else 2, math.hypot(*turn)
        box = {"size": [2, 1, 1][:dim], "cells": [4, 2, 2][:dim], "element": "hex8" if solid else "quad8"}
        point = [2, 0.5, 0.5][:dim]
        held = {"on": "left", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}
        axis = {"axis": [t / angle for t in turn]} if solid else {}
        plain = {"on": "right", "ux": 0.1, "uy": 0, **({"uz": 0} if solid else {}), "rotation": {"angle": math.degrees(angle), "about": point, **axis}}
        motion = {key: math.degrees(by) for key, by in zip(("rx", "ry", "rz"), turn) if solid or key == "rz"}
        rigid = {"on": "right", "rigid": {"point": point, "ux": 0.1, "uy": 0, **({"uz": 0} if solid else {}), **motion}}
        by = [answer(s, scene(model="solid" if solid else "plane_strain", mesh={"box": box}, supports=[held, one])) for one in (plain, rigid)]
        off = numpy.abs(numpy.array(by[0]["displacements"]) - by[1]["displacements"]).max()
        check(off < 1e-8, solid, off)
        forces = [one["summary"]["resultants"]["supports"][1]["force"] for one in by]
        check(all(abs(a - b) < 1e-8 for a, b in zip(*forces)), forces)


def test_rigid_groups_turn_freely_in_space(s):
    """The same load turned with the whole scene: the answer is turned; without anything else to hold it."""
    def solved(turned):
        c, d = (0.0, 1.0) if turned else (1.0, 0.0)
        place = lambda x, y, z: (c * x - d * y, d * x + c * y, z)
        mesh = body(["hex8"], [(4, 1, 2)], [lambda x, y, z: place(4 * x, 0.5 * y, z)], {"clamp": [(0, "x0")], "tip": [(0, "x1")]})["problem"]["mesh"]
        force = place(0, 0.004, 0)
        far = {"nodes": [next(k for k, x in enumerate(mesh["nodes"]) if math.dist(x, place(4, 0, 1)) < 1e-9)]}
        mesh["groups"]["corner"] = far
        return answer(s, scene(model="solid", mesh=mesh, supports=[{"on": "clamp", "ux": 0, "uy": 0, "uz": 0}, {"on": "tip", "rigid": {"point": place(4, 0.25, 0.5)}}],
                               loads=[{"on": "corner", "force": [*force]}]))
    one, other = solved(False), solved(True)
    u, v = (numpy.array(found["displacements"]) for found in (one, other))
    check(numpy.abs(u).max() > 0.5, numpy.abs(u).max())
    check(numpy.abs(numpy.column_stack((-u[:, 1], u[:, 0], u[:, 2])) - v).max() < 1e-7, numpy.abs(u).max())


def test_rigid_groups_may_be_far_from_the_origin_and_from_their_points(s):
    """Rounding of places had the supports move for ever: a body at y = 20 was called unstable under none of its load."""
    def turned(shift, point, angle):
        place = lambda x, y: (shift[0] + 2 * x, shift[1] + y)
        request = body(["quad4"], [(4, 2)], [place], {"foot": [(0, "bottom")], "head": [(0, "top")]})
        rigid = {"point": [a + b for a, b in zip(shift, point)], "ux": 0, "uy": 0, "rz": angle}
        return answer(s, scene(mesh=request["problem"]["mesh"], supports=[{"on": "foot", "rigid": rigid}, {"on": "head", "ux": 0, "uy": -0.1}]), forces=False)["summary"]
    for point, angle in (([0.3, 0], 3), ([1e4, 0], 1e-4)):
        energies = []
        for shift in ([0, 0], [0, 20], [1e3, -3e3]):
            summary = turned(shift, point, angle)
            check(summary["finite"]["steps"] == 1 and summary["finite"]["qps"] <= 6, shift, point, summary["finite"])
            energies.append(summary["energy"]["strain"])
        check(all(abs(one / energies[0] - 1) < 1e-9 for one in energies), energies)


def test_a_rigid_side_rolls_on_an_obstacle(s):
    """A flat side that is free to turn, pressed on a circle: beside its middle it tilts, and moments about its point vanish; mirrored it
    tilts the other way."""
    turned = []
    for at in (0.8, 1.0, 1.2):
        found = answer(s, scene(mesh={"box": {"size": [2, 1], "cells": [8, 4], "element": "quad8"}},
                                supports=[{"on": "top", "ux": 0, "uy": -0.2}, {"on": "bottom", "rigid": {"point": [1, 0]}}],
                                contacts=[{"on": "bottom", "obstacle": {"circle": {"center": [at, -2], "radius": 2}}}]))
        summary = found["summary"]
        group = summary["resultants"]["supports"][1]
        check(summary["finite"]["steps"] == 1 and summary["finite"]["qps"] <= 6 and summary["contact"]["force"][1] > 0.5, summary["finite"])
        check(math.hypot(*group["force"]) < 1e-8 and abs(group["rigid"]["moment"][0]) < 1e-8, group)
        turned.append(group["rigid"]["rotation"][0])
    check(turned[0] < -2 and abs(turned[1]) < 1e-8 and abs(turned[0] + turned[2]) < 1e-7, turned)


def test_rigid_groups_along_paths_and_in_quantities(s):
    """A path by three points ends where the whole comes to at once, and so does auto; the force that a group takes has an interval, which
    that of a finer mesh lies in."""
    def turned(cells=(8, 2), **motion):
        return scene(mesh={"box": {"size": [4, 1], "cells": cells, "element": "quad8"}},
                     supports=[{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "rigid": {"point": [4, 0.5], "rz": 60, **motion}}])
    whole = answer(s, turned())["displacements"]
    path = s.post({**turned(), "cases": [{"name": "way", "steps": [0.3, 0.6, 1]}]}).json["id"]
    check(s.wait_status(path, "successful", "failed")["status"] == "successful", path)
    there = s.get(f"/v1/jobs/{path}/result?fields=displacements&case=way").json["displacements"]
    auto = turned()
    auto["problem"]["kinematics"] = "auto"
    for other in (there, answer(s, auto)["displacements"]):
        check(numpy.abs(numpy.array(whole) - other).max() < 1e-8, numpy.abs(numpy.array(whole) - other).max())
    asked = {"quantities": [{"quantity": "reaction", "on": "right", "direction": [0, 1]}, {"quantity": "strain_energy"}]}
    coarse, fine = (answer(s, {**turned(cells, ux=-0.5, uy=1.5), **asked})["summary"]["quantities"] for cells in ((8, 2), (24, 6)))
    for one, other in zip(coarse, fine):
        check(one["low"] < other["value"] < one["high"] and one["high"] - one["low"] < 0.2 * abs(one["value"]), one, other)


def test_planes_stop_rigid_groups(s):
    """A strip whose right side is rigid, pushed against a plane, which says what a polyline of one line says: nothing goes through, in
    the plane and in space."""
    def pushed(obstacle, dim=2, **more):
        up = [0, 2e-4, 0][:dim]
        mesh = {"size": [8, 0.5, 0.5][:dim], "cells": [16, 2, 1][:dim]}
        held = {key: 0 for key in ("ux", "uy", "uz")[:dim]}
        return scene(mesh={"box": {**mesh, "element": "quad8" if dim == 2 else "hex8"}}, contacts=[{"on": "top", "obstacle": obstacle}],
                     supports=[{"on": "left", **held}, {"on": "right", "rigid": {"point": [8, 0.25, 0.25][:dim]}}], loads=[{"on": "bottom", "traction": up}], **more)
    found = [answer(s, pushed(shape)) for shape in ({"plane": {"point": [0, 0.6], "normal": [0, -1]}}, {"polyline": {"points": [[20, 0.6], [-20, 0.6]]}})]
    for one in found:
        highest = max(x[1] + u[1] for x, u in zip(one["nodes"], one["displacements"]))
        check(abs(highest - 0.6) < 1e-9 and one["summary"]["contact"]["force"][1] < -1e-5, highest, one["summary"]["contact"])
    energy = [one["summary"]["energy"]["strain"] for one in found]
    check(abs(energy[0] / energy[1] - 1) < 1e-7, energy)
    solid = answer(s, pushed({"plane": {"point": [0, 0.6, 0], "normal": [0, -1, 0]}}, 3, model="solid"))
    check(abs(max(x[1] + u[1] for x, u in zip(solid["nodes"], solid["displacements"])) - 0.6) < 1e-9, "within the plane")


def test_pressure_on_a_rigid_group_turns_with_it(s):
    """It bends a beam far beyond the load at which dead pressure's tangent finds nothing stable any more, as it does a tip that is a hundred
    times stiffer."""
    thick = 0.5
    request, at, _ = beam(10.0, 3.0, thick, 20, 0.3, supports=[{"on": "clamp", "ux": 0, "uy": 0}, {"on": "tip", "rigid": {"point": [10, 0]}}],
                          loads=[{"on": "low", "pressure": 1.5 * thick ** 3 / 12 / 100}])
    problem = request["problem"]
    problem["mesh"]["groups"].update({"low": {"edges": [[at[40, 0], at[42, 0]]]}, "block": {"elements": [20]}, "soft": {"elements": list(range(20))}})
    rigid = answer(s, request)["displacements"][at[42, 1]]
    problem["materials"] = [{**problem["materials"][0], "on": "soft"}, {**problem["materials"][0], "on": "block", "young": 100}]
    del problem["supports"][1]
    stiff = answer(s, request)["displacements"][at[42, 1]]
    check(math.dist(rigid, stiff) < 2e-3 and rigid[0] < -12, rigid, stiff)


def test_paths_turn_groups_past_half_a_turn(s):
    """In steps of less than half a turn; more between two points is refused."""
    def turned(*steps, dim=2):
        still = {"rx": 0, "ry": 0} if dim == 3 else {}
        box = {"size": [10, 0.2, 0.2][:dim], "cells": [20, 1, 1][:dim], "element": "quad8" if dim == 2 else "hex20"}
        request = scene(mesh={"box": box}, supports=[{"on": "left", **{key: 0 for key in ("ux", "uy", "uz")[:dim]}},
                                                    {"on": "right", "rigid": {"point": [10, 0.1, 0.1][:dim], **still, "rz": 170}}], **({"model": "solid"} if dim == 3 else {}))
        return {**request, "cases": [{"name": "way", "steps": list(steps)}]}
    job = s.post(turned(0.5, 1, 1.5)).json["id"]
    check(s.wait_status(job, "successful", "failed")["status"] == "successful", job)
    last = s.get(f"/v1/jobs/{job}/result?fields=summary&case=way").json["summary"]
    bent = YOUNG / (1 - POISSON ** 2) * 0.2 ** 3 / 12 * math.radians(255) ** 2 / 2 / 10
    check(last["outcome"] == "converged" and abs(last["energy"]["strain"] / bent - 1) < 0.02, last["outcome"], last["energy"], bent)
    for dim in (2, 3):
        reply = s.post(turned(1, -1, dim=dim))
        expect(reply, 202)
        error = s.wait_status(reply.json["id"], "failed", "successful").get("error", {})
        check("put points between" in error.get("detail", ""), error)


def test_what_rigid_groups_cannot_be(s):
    cube = {"box": {"size": [1, 1, 1], "cells": [1, 1, 1]}}
    held = {"on": "left", "ux": 0, "uy": 0, "uz": 0}
    for motion, pointer, word in (({"rx": 30}, "/supports/1/rigid", "or two at 0"), ({"rx": 30, "ry": 0}, "/supports/1/rigid", "or two at 0"),
                                  ({"rx": 120, "ry": 120, "rz": 120}, "/supports/1/rigid/rz", "half a turn")):
        refused(s, scene(model="solid", mesh=cube, supports=[held, {"on": "right", "rigid": {"point": [1, 0, 0], **motion}}]), pointer, word)

    # what else holds a node that the group turns: that it agrees at first order was enough, and it converged at another place
    tip = {"name": "tip", "where": {"nearest": [1, 0]}}
    for motion, there, word in (({"rz": 30}, {"uy": math.radians(30)}, "large rotation"), ({}, {"ux": 0}, "large rotation"),
                                ({"rz": 0}, {"uy": 0.1}, "moves it otherwise")):
        request = scene(mesh={"box": {"size": [2, 1], "cells": [2, 1]}}, groups=[tip],
                        supports=[{"on": "bottom", "rigid": {"point": [0, 0], "ux": 0, "uy": 0, **motion}}, {"on": "top", "ux": 0}, {"on": "tip", **there}])
        refused(s, request, "/supports/2/on", word)
    for motion, there in (({"rz": 0}, {"ux": 0, "uy": 0}), ({"rz": 10}, None)):  # but where it stays, or nothing else holds
        answer(s, scene(mesh={"box": {"size": [2, 1], "cells": [2, 1]}}, groups=[tip],
                        supports=[{"on": "bottom", "rigid": {"point": [0, 0], "ux": 0, "uy": 0, **motion}}, {"on": "top", "uy": 0.01},
                                  *([{"on": "tip", **there}] if there else [])]))
    # nor does it take anything along its axis: a sheet that turns in its plane, which is one of symmetry
    for turn in ({"rx": 0, "ry": 0, "rz": 20}, {"rx": 0, "ry": 0}, {"rx": 5, "ry": 0, "rz": 20}):
        sheet = scene(model="solid", mesh={"box": {"size": [2, 1, 0.5], "cells": [2, 1, 1]}},
                      supports=[{"on": "left", "ux": 0, "uy": 0, "uz": 0}, {"on": "back", "uz": 0},
                                {"on": "right", "rigid": {"point": [2, 0.5, 0], "ux": 0, "uy": 0, "uz": 0, **turn}}])
        if turn["rx"]:
            refused(s, sheet, "/supports/1/on", "large rotation")
        else:
            answer(s, sheet, forces="rz" in turn)


if __name__ == "__main__":
    service.main(globals())
