"""Rigid groups: prescribed, loaded and free motions against closed forms, with contact, and what is refused."""
# not under ThreadSanitizer: about answers, not about threads
import math

import service
from service import check, expect

SHARED = True  # one service for all tests

E, NU = 1000.0, 0.3
FAR = {2: {"plane": {"point": [0, -500], "normal": [0, 1]}}, 3: {"plane": {"point": [0, -500, 0], "normal": [0, 1, 0]}}}


def scene(model, size, cells, element, supports, loads=None, contacts=None, poisson=NU, **problem):
    return {"problem": dict({"kind": "scene", "model": model, "mesh": {"box": {"size": size, "cells": cells, "element": element}},
                             "materials": [{"on": "all", "young": E, "poisson": poisson}], "supports": supports, "loads": loads or [],
                             "contacts": contacts or [{"on": "bottom", "obstacle": FAR[len(size)]}]}, **problem)}


def answer(s, body, fields="summary,displacements,nodes"):
    job = s.solved(body)
    found = s.get(f"/v1/jobs/{job['id']}/result?fields={fields}").json
    check(found["summary"]["outcome"] == "converged", found["summary"]["outcome"])
    check(found["summary"]["resultants"]["imbalance"] < 1e-9, found["summary"]["resultants"])
    return found


def refused(s, body, pointer, word):
    reply = s.post(body)
    found = reply.json if reply.status != 202 else s.wait_status(reply.json["id"], "failed", "successful")["error"]
    check(found["pointer"] == f"/problem{pointer}" and word in found["detail"], found)


def near(found, wanted, relative, scale=None):
    scale = scale or max(abs(w) for w in wanted)
    check(len(found) == len(wanted) and all(abs(f - w) <= relative * scale for f, w in zip(found, wanted)), found, wanted)


def beam(force, at, moment=0.0, rigid=None, **more):
    """A strip without contraction, held at its left end, where its end is a rigid plate. The theory of Timoshenko is exact
    for moments, and within the shear's own distribution for forces."""
    rigid = dict({"point": [10, 0.5]}, **(rigid or {}))
    return scene("plane_stress", [10, 1], [20, 2], "quad8", [{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "rigid": rigid}],
                 [{"on": "right", "force": force, "at": at, "moment": [moment]}], poisson=0, **more)


def test_a_moment_bends_a_strip_to_an_arc(s):
    moment = 0.2
    found = answer(s, beam([0, 0], [10, 0.5], moment))["summary"]["resultants"]["supports"][1]
    turned = moment * 10 / (E / 12)
    near(found["rigid"]["rotation"], [math.degrees(turned)], 1e-9)
    near(found["rigid"]["displacement"], [0, turned * 5], 1e-9)
    near(found["rigid"]["moment"] + found["force"], [0, 0, 0], 1e-9, moment)


def test_a_force_beside_the_plate_bends_and_turns_it(s):
    """At (13, 0.5): a force P and the moment 3 P about the plate's point, by superposition."""
    P, L, I = -0.01, 10.0, 1 / 12
    found = answer(s, beam([0, P], [13, 0.5]))["summary"]["resultants"]
    shear = 1.2 * P * L / (E / 2)
    near(found["supports"][1]["rigid"]["displacement"][1:], [P * L ** 3 / (3 * E * I) + 3 * P * L ** 2 / (2 * E * I) + shear], 1e-3)
    near(found["supports"][1]["rigid"]["rotation"], [math.degrees(P * L ** 2 / (2 * E * I) + 3 * P * L / (E * I))], 1e-4)
    near(found["supports"][0]["force"] + found["supports"][0]["moment"], [0, -P, -13 * P], 1e-9)


def test_prescribed_motions_need_the_force_that_makes_them(s):
    """What a force does when it is let go, it takes to hold: of one answer the motions, of the other the reactions."""
    loaded = answer(s, beam([0.02, -0.01], [10, 0.5], 0.05))
    motion = loaded["summary"]["resultants"]["supports"][1]["rigid"]
    rigid = {"ux": motion["displacement"][0], "uy": motion["displacement"][1], "rz": motion["rotation"][0]}
    held = answer(s, beam([0, 0], [10, 0.5], rigid=rigid))
    plate = held["summary"]["resultants"]["supports"][1]
    near(plate["force"] + plate["rigid"]["moment"], [0.02, -0.01, 0.05], 1e-8)
    for a, b in zip(loaded["displacements"], held["displacements"]):
        near(a, b, 1e-8, 1)
    half = answer(s, beam([0.02, 0], [10, 0.5], 0.05, rigid={"uy": motion["displacement"][1]}))
    near(half["summary"]["resultants"]["supports"][1]["force"], [0, -0.01], 1e-8)


def test_the_order_of_supports_says_nothing(s):
    """Also where the body is cached: the group has its motion from its own support, and the force stands there."""
    one = beam([0, 0], [10, 0.5], rigid={"uy": 0.01, "rz": 0.1})
    other = {"problem": {**one["problem"], "supports": one["problem"]["supports"][::-1]}}
    first, second = answer(s, one), answer(s, other)
    near([t for u in second["displacements"] for t in u], [t for u in first["displacements"] for t in u], 1e-9)
    near(second["summary"]["resultants"]["supports"][0]["force"], first["summary"]["resultants"]["supports"][1]["force"], 1e-9)
    near(second["summary"]["resultants"]["supports"][0]["rigid"]["displacement"],
         first["summary"]["resultants"]["supports"][1]["rigid"]["displacement"], 1e-9)


def test_nodes_of_the_group_keep_their_distances(s):
    found = answer(s, beam([0, -0.01], [12, 2]))
    plate = found["summary"]["resultants"]["supports"][1]["rigid"]
    turned = math.radians(plate["rotation"][0])
    for x, u in zip(found["nodes"], found["displacements"]):
        if abs(x[0] - 10) < 1e-9:
            near(u, [plate["displacement"][0] - turned * (x[1] - 0.5), plate["displacement"][1]], 1e-10)


def test_a_square_shaft_is_twisted_by_a_moment(s):
    """Its end free along the axis would warp; a plate that is rigid keeps it plane, which is stiffer than Saint-Venant's
    torsion by what a short end has of it: the longer the shaft, the less."""
    stiff = 0.140577 * E / (2 * (1 + NU))
    off = []
    for length, cells in ((4.0, 4), (8.0, 8)):
        body = scene("solid", [1, 1, length], [4, 4, cells], "hex20",
                     [{"on": "back", "ux": 0, "uy": 0, "uz": 0}, {"on": "front", "rigid": {"point": [0.5, 0.5, length], "uz": 0}}],
                     [{"on": "front", "force": [0, 0, 0], "at": [3, 1, 0], "moment": [0, 0, 0.5]}])
        plate = answer(s, body)["summary"]["resultants"]["supports"][1]["rigid"]
        near(plate["rotation"][:2] + plate["displacement"], [0] * 5, 1e-9, 1)
        off.append(1 - math.radians(plate["rotation"][2]) * stiff / (0.5 * length))
    check(0.01 < off[0] < 0.05 and abs(off[1] / off[0] - 0.5) < 0.05, off)


def test_prescribed_turns_are_those_of_a_rotation(s):
    """A group with all motions prescribed is a group that a support rotates."""
    for model, size, cells, element, rigid, turn in (
            ("plane_strain", [3, 1], [6, 2], "quad4", {"point": [3, 0], "ux": 0, "uy": 0, "rz": 1}, {"about": [3, 0], "angle": 1}),
            ("solid", [1, 1, 2], [2, 2, 3], "hex8", {"point": [0, 0, 2], "ux": 0, "uy": 0, "uz": 0, "rx": 0.6, "ry": 0, "rz": -0.8},
             {"about": [0, 0, 2], "axis": [3, 0, -4], "angle": 1})):
        side, other = ("left", "right") if len(size) == 2 else ("back", "front")
        held = {"on": side, "ux": 0, "uy": 0}
        held.update({"uz": 0} if len(size) == 3 else {})
        one = answer(s, scene(model, size, cells, element, [held, {"on": other, "rigid": rigid}]))
        two = answer(s, scene(model, size, cells, element, [held, {"on": other, "rotation": turn}]))
        for a, b in zip(one["displacements"], two["displacements"]):
            near(a, b, 1e-11, 1)
        near(*[r["summary"]["resultants"]["supports"][1]["moment"] for r in (one, two)], 1e-9)


def test_a_punch_finds_its_own_tilt(s):
    """A rigid top presses a block on the plane: by a force in its middle evenly, by one beside it with a tilt, such that
    the contact bears force and moment. Every operator finds the same."""
    def block(at, **solver):
        body = scene("plane_strain", [4, 2], [8, 4], "quad4", [{"on": "top", "rigid": {"point": [2, 2], "ux": 0}}],
                     [{"on": "top", "force": [0, -1.0], "at": [at, 2]}],
                     [{"on": "bottom", "obstacle": {"plane": {"point": [0, -0.01], "normal": [0, 1]}}}])
        body["solver"] = solver
        return answer(s, body)["summary"]
    even = block(2)["resultants"]
    near(even["contacts"][0]["force"] + even["contacts"][0]["moment"], [0, 1, 2], 1e-9)
    near(even["supports"][0]["rigid"]["rotation"], [0], 1e-9, 1)
    beside = block(3)
    near(beside["resultants"]["contacts"][0]["moment"], [3], 1e-7)
    tilt = beside["resultants"]["supports"][0]["rigid"]["rotation"]
    check(tilt[0] < -1e-3, tilt)
    for operator in ("factored", "condensed"):
        other = block(3, operator=operator)
        near(other["resultants"]["supports"][0]["rigid"]["rotation"], tilt, 1e-6)
    held = dict(beside["certificate"])
    check(held["relative_error"] < 1e-7, held)


def test_contact_on_the_rigid_group_itself(s):
    """The plate comes down on a sphere of the obstacle's: as the group is rigid, the block is lifted as a whole there."""
    body = scene("solid", [2, 2, 1], [4, 4, 2], "hex8",
                 [{"on": "front", "ux": 0, "uy": 0, "uz": -0.1}, {"on": "back", "rigid": {"point": [1, 1, 0], "ux": 0, "uy": 0, "rz": 0}}],
                 [], [{"on": "back", "obstacle": {"sphere": {"center": [1.5, 1, -2], "radius": 2}}}])
    found = answer(s, body)["summary"]
    plate, touch = found["resultants"]["supports"][1], found["resultants"]["contacts"][0]
    check(touch["force"][2] > 1 and plate["rigid"]["displacement"][2] < -0.01, touch, plate)
    near(plate["rigid"]["displacement"][2:], [plate["rigid"]["displacement"][2]], 1)
    check(found["contact"]["active"] >= 1 and plate["rigid"]["rotation"][1] != 0, plate)


def test_two_bodies_on_one_plate(s):
    """A rigid group with nodes of two parts joins them: two columns side by side share a force as their stiffness."""
    mesh = {"nodes": [[0, 0], [1, 0], [0, 2], [1, 2], [3, 0], [4, 0], [3, 2], [4, 2]], "elements": {"quad4": [[0, 1, 3, 2], [4, 5, 7, 6]]},
            "groups": {"foot": {"edges": [[0, 1], [4, 5]]}, "head": {"edges": [[2, 3], [6, 7]]}, "one": {"elements": [0]}, "two": {"elements": [1]}}}
    body = {"problem": {"kind": "scene", "model": "plane_stress", "mesh": mesh,
                        "materials": [{"on": "one", "young": E, "poisson": 0}, {"on": "two", "young": 3 * E, "poisson": 0}],
                        "supports": [{"on": "foot", "ux": 0, "uy": 0}, {"on": "head", "rigid": {"point": [2, 2], "ux": 0, "rz": 0}}],
                        "loads": [{"on": "head", "force": [0, -4], "at": [2, 2]}], "contacts": [{"on": "head", "obstacle": FAR[2]}]}}
    plate = answer(s, body)["summary"]["resultants"]["supports"][1]["rigid"]
    near(plate["displacement"], [0, -2 / E], 1e-10)
    near(plate["moment"], [-3.0], 1e-9)


def test_rings_move_along_their_axis(s):
    """A tube between a foot and a rigid head that cannot widen: the stiffness of a column that a bond holds at both ends."""
    body = scene("axisymmetric", [1, 4], [4, 16], "quad8", [{"on": "bottom", "ux": 0, "uy": 0}, {"on": "top", "rigid": {"point": [0, 4]}}],
                 [{"on": "top", "force": [0, -3]}], [{"on": "right", "obstacle": {"polyline": {"points": [[9, -9], [9, 9]]}}}], poisson=0)
    plate = answer(s, body)["summary"]["resultants"]["supports"][1]["rigid"]
    near(plate["displacement"], [0, -3 * 4 / (math.pi * E)], 1e-9)


def test_an_answer_is_verified_with_its_group(s):
    body = beam([0, -0.01], [12, 2])
    found = answer(s, body, "displacements,reactions,nodes,summary")

    def verified(u):
        return s.request("POST", "/v1/verify", {"problem": body["problem"], "answer": {"displacements": u, "reactions": found["reactions"]},
                                                "solver": {"accuracy": {"relative_error": 1e-6}}})
    right = expect(verified(found["displacements"]), 200).json["summary"]
    check(right["outcome"] == "verified", right)
    wrong = [list(u) for u in found["displacements"]]
    wrong[found["nodes"].index([10, 0.25])][1] *= 1.001  # in the middle of an edge of the plate's
    reply = expect(verified(wrong), 422)
    check("rigid group" in reply.json["detail"], reply.json)


def test_refined_meshes_and_hanging_nodes(s):
    """Nodes that refinement puts on the group are of it, on triangles and with hanging nodes."""
    for element in ("tri3", "quad4"):
        body = beam([0, -0.01], [12, 0.5])
        box = body["problem"]["mesh"]["box"]
        body["problem"]["mesh"] = {"box": dict(box, cells=[10, 2], element=element), "refine": "auto"}
        body["solver"] = {"accuracy": {"total": 0.1}}
        found = answer(s, body)
        plate = found["summary"]["resultants"]["supports"][1]["rigid"]
        turned = math.radians(plate["rotation"][0])
        on_plate = [(x, u) for x, u in zip(found["nodes"], found["displacements"]) if abs(x[0] - 10) < 1e-9]
        check(len(on_plate) > 3, len(on_plate))
        for x, u in on_plate:
            near(u, [plate["displacement"][0] - turned * (x[1] - 0.5), plate["displacement"][1]], 1e-10)
        fine = answer(s, beam([0, -0.01], [12, 0.5]))["summary"]["resultants"]["supports"][1]["rigid"]
        check(0 < 1 - plate["displacement"][1] / fine["displacement"][1] < 0.05, plate, fine)


def test_bodies_without_a_factor(s):
    """A tilted plate on a solid that stands on the obstacle: the multigrid finds what the factor does."""
    def tilt(operator):
        body = scene("solid", [2, 2, 1], [6, 6, 3], "hex8", [{"on": "front", "rigid": {"point": [1, 1, 1], "ux": 0, "uy": 0, "rz": 0}}],
                     [{"on": "front", "force": [0, 0, -1], "at": [1.4, 1.2, 1]}], [{"on": "back", "obstacle": {"plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}}}])
        body["problem"]["supports"] += [{"on": "left", "spring": [0, 0, 1e-3]}, {"on": "bottom", "spring": [0, 0, 1e-3]}]
        body["solver"] = {"operator": operator, "accuracy": {"relative_error": 1e-9}}
        found = answer(s, body)["summary"]
        check(found["operator"] == operator, found["operator"])
        return found["resultants"]["supports"][0]["rigid"]["rotation"]
    near(tilt("matrix_free"), tilt("condensed"), 1e-6)


def test_a_rigid_tool(s):
    """All of one part is rigid: a tool that a force presses on a block, its tilt held, found by the contact alone."""
    mesh = {"nodes": [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 1.01], [2, 1.01], [0, 2], [2, 2]],
            "elements": {"quad4": [[0, 1, 4, 3], [1, 2, 5, 4], [6, 7, 9, 8]]},
            "groups": {"foot": {"edges": [[0, 1], [1, 2]]}, "face": {"edges": [[3, 4], [4, 5]]}, "sole": {"edges": [[6, 7]]},
                       "block": {"elements": [0, 1]}, "tool": {"elements": [2]}}}
    body = {"problem": {"kind": "scene", "model": "plane_stress", "mesh": mesh, "materials": [{"on": "all", "young": E, "poisson": 0}],
                        "supports": [{"on": "foot", "ux": 0, "uy": 0}, {"on": "tool", "rigid": {"point": [1, 2], "ux": 0, "rz": 0}}],
                        "loads": [{"on": "sole", "force": [0, -4], "at": [1, 2]}], "contacts": [{"on": "face", "with": "sole"}]}}
    found = answer(s, body)["summary"]
    near(found["resultants"]["supports"][1]["rigid"]["displacement"], [0, -0.01 - 2 / E], 1e-7)
    check(found["certificate"]["relative_error"] < 1e-7, found["certificate"])


def test_the_force_of_a_plate_is_a_quantity(s):
    body = beam([0, 0], [10, 0.5], rigid={"uy": -0.1, "rz": 0})
    body["quantities"] = [{"quantity": "reaction", "on": "right", "direction": [0, 1]}]
    found = answer(s, body)["summary"]
    one, force = found["quantities"][0], found["resultants"]["supports"][1]["force"][1]
    check(abs(one["value"] - force) <= 1e-3 * abs(force) and one["low"] <= force * 0.9999 and one["high"] >= force * 1.0001, one, force)


def test_what_is_not_proved_says_so(s):
    found = answer(s, beam([0, -0.01], [12, 2]))["summary"]["error"]
    check(found["kind"] == "estimated" and found["total"] > 0, found)


def test_refusals(s):
    refused(s, beam([0, 1], [10, 0], rigid={"rx": 1}), "/supports/1/rigid/rx", "ux, uy and rz")
    refused(s, beam([0, 1], [10, 0], rigid={"rz": 60}), "/supports/1/rigid/rz", "not small")
    twice = beam([0, 1], [10, 0])
    twice["problem"]["supports"].append({"on": "top", "rigid": {"point": [0, 0]}})
    refused(s, twice, "/supports/2/on", "make one group")
    shared = beam([0, 1], [10, 0])
    shared["problem"]["supports"].append({"on": "top", "uy": 0})
    refused(s, shared, "/supports/2/on", "free to move")
    refused(s, scene("plane_stress", [10, 1], [10, 2], "quad4", [{"on": {"where": {"nearest": [0, 0]}}, "rigid": {"point": [0, 0]}}]),
            "/supports/0/on", "two nodes")
    free = beam([0, 1], [10, 0])
    free["problem"]["supports"] = free["problem"]["supports"][1:]
    refused(s, free, "/supports", "free")
    ring = scene("axisymmetric", [1, 4], [2, 4], "quad4", [{"on": "bottom", "uy": 0}], [{"on": "top", "force": [0, 1], "at": [0, 4]}],
                 [{"on": "right", "obstacle": {"polyline": {"points": [[9, -9], [9, 9]]}}}])
    refused(s, ring, "/loads/0", "whole ring")


if __name__ == "__main__":
    service.main(globals())
