"""Groups that supports rotate: bending, torsion, rigid motions of small and of finite kinematics, and what is refused."""
# not under ThreadSanitizer: about answers, not about threads
import math

import service
from service import check, expect
from two_bodies import body

SHARED = True  # one service for all tests

E, NU = 1000.0, 0.3
FAR = {2: {"plane": {"point": [0, -500], "normal": [0, 1]}}, 3: {"plane": {"point": [0, -500, 0], "normal": [0, 1, 0]}}}


def scene(model, size, cells, element, supports, contacts=None, law="linear", **problem):
    return {"problem": dict({"kind": "scene", "model": model, "mesh": {"box": {"size": size, "cells": cells, "element": element}},
                             "materials": [{"on": "all", "young": E, "poisson": NU, "law": law}], "supports": supports,
                             "contacts": contacts or [{"on": "bottom", "obstacle": FAR[len(size)]}]}, **problem)}


def answer(s, body):
    job = s.solved(body)
    return s.get(f"/v1/jobs/{job['id']}/result?fields=summary,displacements,nodes,strain").json


def refused(s, body, pointer, word):
    reply = s.post(body)
    found = reply.json if reply.status != 202 else s.wait_status(reply.json["id"], "failed", "successful")["error"]
    check(found["pointer"] == f"/problem{pointer}" and word in found["detail"], found)


def test_a_strip_is_bent_by_the_moment_of_its_theory(s):
    """Its end turns about its middle, free to become higher: M = E I angle / length, exactly, with quadratic elements."""
    length, height, degrees = 8.0, 1.0, 1.5
    body = scene("plane_stress", [length, height], [4, 1], "quad8",
                 [{"on": "left", "ux": 0}, {"on": {"where": {"nearest": [0, 0]}}, "uy": 0},
                  {"on": "right", "ux": 0, "rotation": {"about": [length, height / 2], "angle": degrees}}],
                 [{"on": "bottom", "obstacle": {"plane": {"point": [0, -5], "normal": [0, 1]}}}])
    found = answer(s, body)
    angle = math.radians(degrees)
    moment = E * height ** 3 / 12 * angle / length
    right = found["summary"]["resultants"]["supports"][2]
    check(abs(right["moment"][0] - moment) < 1e-9 * moment, right, moment)
    check(math.hypot(*right["force"]) < 1e-9 * moment, right)
    for x, strain in zip(found["nodes"], found["strain"]):
        check(abs(strain[0] + angle / length * (x[1] - height / 2)) < 1e-10, x, strain)


def test_a_square_bar_is_twisted(s):
    """Held and turned across its axis, free along it: torque = 0.14058 G a^4 angle / length (Saint-Venant)."""
    length, degrees, side = 3.0, 2.0, 1.0
    twist = {"rotation": {"about": [side / 2, side / 2, length], "axis": [0, 0, 7], "angle": degrees}}
    body = scene("solid", [side, side, length], [6, 6, 2], "hex20",
                 [{"on": "back", "ux": 0, "uy": 0}, {"on": {"where": {"nearest": [0, 0, 0]}}, "uz": 0}, dict(twist, on="front", ux=0, uy=0)])
    front = answer(s, body)["summary"]["resultants"]["supports"][2]
    torque = 0.140577 * E / (2 * (1 + NU)) * math.radians(degrees) / length
    check(abs(front["moment"][2] - torque) < 2e-3 * torque, front, torque)


def rotated(x, about, angle, small):
    r = [a - b for a, b in zip(x, about)]
    c, t = (1, angle) if small else (math.cos(angle), math.sin(angle))
    return [c * r[0] - t * r[1] - r[0], t * r[0] + c * r[1] - r[1]]


def test_a_body_is_carried_round(s):
    """Both ends turn about one point and the right one moves out, too: the middle follows, and the strain is that of the
    pull alone: of small rotations linear in the angle, of finite ones exactly, whatever the angle."""
    about = [1.0, 3.0]
    for law, degrees, kinematics in (("linear", 2, "fixed"), ("st_venant_kirchhoff", 70, "finite"), ("neo_hooke", -150, "finite")):
        angle, small = math.radians(degrees), law == "linear"
        turn = {"rotation": {"about": about, "angle": degrees}}
        out = [0.01, 0] if small else [0.01 * math.cos(angle), 0.01 * math.sin(angle)]
        make = lambda left, right: scene("plane_strain", [2, 1], [4, 2], "quad8",  # noqa: E731
                                         [dict(left, on="left"), dict(right, on="right")], law=law, kinematics=kinematics)
        still = answer(s, make({"ux": 0, "uy": 0}, {"ux": 0.01, "uy": 0}))
        found = answer(s, make(turn, dict(turn, ux=out[0], uy=out[1])))
        check(found["summary"]["outcome"] == "converged", found["summary"])
        for x, u, v in zip(still["nodes"], still["displacements"], found["displacements"]):
            wanted = rotated(x, about, angle, small)
            wanted = [a + b for a, b in zip(wanted, u if small else [b + c for b, c in zip(rotated(u, [0, 0], angle, False), u)])]
            check(max(abs(a - b) for a, b in zip(v, wanted)) < 1e-7, law, x, v, wanted)
        pull = [math.hypot(*one["summary"]["resultants"]["supports"][1]["force"]) for one in (still, found)]
        check(abs(pull[0] - pull[1]) < 1e-6 * pull[0], pull)
        check(not small or not found["summary"]["warnings"], found["summary"]["warnings"])


def test_a_scene_that_is_turned_may_hold_what_it_held(s):
    """A cube between a wall and a press, held along normals after it was turned: a wall's 0 across what the press moves was refused as 4e-18."""
    energies = []
    for angle in (0, 17, 33, 71, 140):
        c, d = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        turn = lambda x, y, z: [c * x - d * y, 0.6 * (d * x + c * y) - 0.8 * z, 0.8 * (d * x + c * y) + 0.6 * z]  # noqa: E731
        request = body(["hex8"], [(2, 2, 2)], [turn], {"wall": [(0, "x0")], "back": [(0, "z0")], "foot": [(0, "y0")], "head": [(0, "y1")]}, model="solid", kinematics="fixed",
                       materials=[{"on": "all", "young": 1, "poisson": 0.3}],
                       supports=[{"on": on, "normal": turn(*n), "u": u} for on, n, u in (("wall", (1, 0, 0), 0), ("back", (0, 0, 1), 0), ("foot", (0, 1, 0), 0), ("head", (0, 1, 0), -0.129),
                                                                                         ("head", (0, 0, 1), 0))])
        energies.append(s.solved(request, "converged")["summary"]["energy"]["strain"])
    check(all(abs(one / energies[0] - 1) < 1e-9 for one in energies), energies)


def test_a_lever_is_pressed_on_a_plane(s):
    """What is rotated presses: the moment of the support is that of the contact. About another point, and moved by what
    lies between, it is the same."""
    make = lambda **support: scene("plane_strain", [4, 1], [16, 4], "quad4", [dict(support, on="left")],  # noqa: E731
                                   [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.02], "normal": [0, 1]}}}])
    angle = math.radians(-1)
    one = answer(s, make(rotation={"about": [0, 0.5], "angle": -1}))["summary"]
    other = answer(s, make(ux=angle * 2, uy=0, rotation={"about": [0, -1.5], "angle": -1}))["summary"]
    for found in (one, other):
        support, contact = found["resultants"]["supports"][0], found["resultants"]["contacts"][0]
        check(found["outcome"] == "converged" and found["contact"]["active"] > 0, found["contact"])
        check(abs(support["moment"][0] + contact["moment"][0]) < 1e-6 * abs(contact["moment"][0]), support, contact)
    check(abs(one["contact"]["force"][1] - other["contact"]["force"][1]) < 1e-9 * one["contact"]["force"][1], other["contact"])


def hexagon(sectors, of=6, radial=4, around=12):
    """`sectors` of the sixths of a ring of radii 1 and 2 in a hexagonal hole, pressed from inside."""
    whole = sectors == of
    columns = sectors * around + (0 if whole else 1)
    at = lambda i, j: (i % columns) * (radial + 1) + j
    nodes = [[(1 + j / radial) * math.cos(i * 2 * math.pi / of / around), (1 + j / radial) * math.sin(i * 2 * math.pi / of / around)] for i in range(columns) for j in range(radial + 1)]
    quads = [[at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)] for i in range(sectors * around) for j in range(radial)]
    groups = {"inner": {"edges": [[at(i, 0), at(i + 1, 0)] for i in range(sectors * around)]}}
    contacts, supports = [], []
    for k in range(sectors):
        groups[f"outer{k}"] = {"edges": [[at(i, radial), at(i + 1, radial)] for i in range(k * around, (k + 1) * around)]}
        middle = (k + 0.5) * 2 * math.pi / of
        contacts.append({"on": f"outer{k}", "obstacle": {"plane": {"point": [2.001 * math.cos(middle), 2.001 * math.sin(middle)], "normal": [-math.cos(middle), -math.sin(middle)]}}})
    if whole:
        groups["a"] = {"nodes": [at(0, 0), at(3 * around, 0)]}
        supports = [{"on": "a", "uy": 0}]
    else:
        groups["first"] = {"edges": [[at(0, j), at(0, j + 1)] for j in range(radial)]}
        groups["last"] = {"edges": [[at(around, j), at(around, j + 1)] for j in range(radial)]}
        turn = 2 * math.pi / of
        supports = [{"on": "first", "uy": 0}, {"on": "last", "normal": [-math.sin(turn), math.cos(turn)], "u": 0}]
    return {"problem": {"kind": "scene", "model": "plane_strain", "mesh": {"nodes": nodes, "elements": {"quad4": quads}, "groups": groups},
            "materials": [{"on": "all", "young": 1000, "poisson": 0.3}], "supports": supports, "loads": [{"on": "inner", "pressure": 10}], "contacts": contacts}}


def test_a_sector_between_planes_of_symmetry_is_a_sixth_of_the_ring(s):
    """Held along the normals of its cuts: the same pressure at the same place, a sixth of the energy."""
    part, whole = (expect(s.post(hexagon(sectors), {"Prefer": "wait=60"}), 200).json["summary"] for sectors in (1, 6))
    check(part["outcome"] == whole["outcome"] == "converged", part["outcome"], whole["outcome"])
    check(abs(6 * part["energy"]["potential"] / whole["energy"]["potential"] - 1) < 1e-9, part["energy"], whole["energy"])
    for one in whole["resultants"]["contacts"]:
        check(abs(one["normal_force"] / part["resultants"]["contacts"][0]["normal_force"] - 1) < 1e-9, one, part["resultants"])
    check(abs(part["contact"]["max_pressure"] / whole["contact"]["max_pressure"] - 1) < 1e-9, part["contact"], whole["contact"])


def test_what_is_too_much_or_has_no_meaning(s):
    turn = lambda degrees, **more: [{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "rotation": dict(about=[2, 0.5], angle=degrees, **more)}]  # noqa: E731
    make = lambda supports, model="plane_stress", **more: scene(model, [2, 1], [4, 2], "quad4", supports, **more)  # noqa: E731
    check(not any("rotates" in w["message"] for w in answer(s, make(turn(2.8)))["summary"]["warnings"]), "2.8 degrees are small")
    warned = [w for w in answer(s, make(turn(3)))["summary"]["warnings"] if "support 1 rotates" in w["message"]]
    check(len(warned) == 1 and warned[0]["code"] == "large_rotation" and abs(warned[0]["value"] - math.radians(3)) < 1e-9, warned)
    refused(s, make(turn(30)), "/supports/1/rotation/angle", "finite")
    refused(s, make(turn(1), model="axisymmetric"), "/supports/1/rotation", "solid")
    refused(s, make(turn(1, axis=[0, 0, 1])), "/supports/1/rotation/axis", "")
    both = turn(1) + [{"on": "top", "ux": 0}]
    refused(s, make(both), "/supports/2/ux", "leave one of them out or make them agree")
    refused(s, make([{"on": "left", "normal": [1, 1], "u": 0, "rotation": {"about": [0, 0], "angle": 1}}]), "/supports/0/rotation", "")
    solid = scene("solid", [1, 1, 1], [1, 1, 1], "hex8", [{"on": "left", "rotation": {"about": [0, 0, 0], "angle": 1}}])
    refused(s, solid, "/supports/0/rotation", "axis")
    solid["problem"]["supports"][0]["rotation"]["axis"] = [0, 0, 0]
    refused(s, solid, "/supports/0/rotation/axis", "direction of the axis")
    guaranteed = make(turn(1))
    guaranteed["solver"] = {"accuracy": {"total": 0.5, "guaranteed": True}}
    found = answer(s, guaranteed)["summary"]
    check(found["error"]["kind"] == "estimated" and "rotates" in str(found), found)


if __name__ == "__main__":
    service.main(globals())
