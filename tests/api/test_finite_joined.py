"""Contact between bodies of large deformation that are rigid in part, or tied; what is tied to rigid groups, meshes that are refined
beside them, and forces at points of them: by closed forms and by the same body said otherwise."""
# not under ThreadSanitizer: about answers, not about threads
# in the ordinary build too, a_rocker_tips: a sanitizer takes ten times its seconds
import math

import numpy

import service
from service import check, expect, some
from test_finite_supports import answer, refused, scene
from test_tied import stacked
from two_bodies import SOLID, body

SHARED = True  # one service for all tests

MATERIAL = {"on": "all", "young": 1.0, "poisson": 0.3, "law": "neo_hooke"}


def farthest(one, other):
    return max(math.dist(a, b) for a, b in zip(one["displacements"], other["displacements"]))


def by_place(found):
    return {tuple(round(c, 9) for c in x): u for x, u in zip(found["nodes"], found["displacements"])}


# ---- rigid groups that touch

def pressed(kind, supports, shift=0.0, rows=None, mirrored=False, **more):
    """A block under a die that is narrower and slightly round; rows: of its elements so many from below are the group "rigid"."""
    solid, sign = kind in SOLID, -1 if mirrored else 1
    if solid:
        cells, names = ((4, 2, 2), (2, 1, 2)), ("z0", "z1", "x0", "x1")
        places = [lambda x, y, z: (4 * x, 2 * y, z),
                  lambda x, y, z: (2 + shift + (0.6 + 0.3 * z) * (2 * x - 1), 0.1 + 1.8 * y, 1.01 + 0.1 * (2 * x - 1) ** 2 * (1 - z) + 0.5 * z)]
    else:
        cells, names = ((16, 4), (6, 4)), ("bottom", "top", "left", "right")
        places = [lambda x, y: (sign * (4 * x - 2) + 2, y),
                  lambda x, y: (2 + sign * (shift + (0.5 + 0.5 * y) * (2 * x - 1)), 1.02 + 0.1 * (2 * x - 1) ** 2 * (1 - y) + 0.5 * y)]
        if mirrored:
            places = [lambda x, y, place=place: place(1 - x, y) for place in places]
    request = body((kind, kind), cells, places, {"floor": [(0, names[0])], "top": [(0, names[1])], "back": [(1, names[1])],
                                                 "face": [(1, names[k]) for k in (0, 2, 3)]},
                   model="solid" if solid else "plane_strain", kinematics="finite", materials=[MATERIAL],
                   contacts=[{"on": "face", "with": "top", "smooth": False}],
                   supports=[{"on": "floor", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}] + supports, **more)
    mesh = request["problem"]["mesh"]
    pieces = len(mesh["elements"][kind]) // sum(math.prod(n) for n in cells)
    first, own = pieces * math.prod(cells[0]), pieces * math.prod(cells[1])
    layers = cells[1][-1]
    in_row = lambda e: e // pieces % layers if solid else e // (own // layers)
    mesh["groups"]["die"] = {"elements": list(range(first, first + own))}
    mesh["groups"]["rigid"] = {"elements": [first + e for e in range(own) if in_row(e) < (rows or layers)]}
    mesh["groups"]["soft"] = {"elements": sorted(set(range(first + own)) - set(mesh["groups"]["rigid"]["elements"]))}
    return request


def test_a_rigid_die_is_one_that_is_prescribed(s):
    """All of a die moved and turned, as a rigid group and by a support that turns its nodes: the same, to what is asked for."""
    for kind, angle in some((("quad4", 10), ("quad8", 10), ("tri6", -10), ("hex8", 0), ("hex20", 0), ("tet10", 0), ("wedge6", 0))):
        solid = kind in SOLID
        move = {"ux": 0.1, "uy": 0, "uz": -0.2} if solid else {"ux": 0.1, "uy": -0.25}
        point = [2, 1, 1.5] if solid else [2, 1.5]
        turn = {"rotation": {"about": point, "angle": angle}} if angle else {}
        rigid = {"point": point, **move, **({"rx": 0, "ry": 0} if solid else {}), "rz": angle}
        found = [answer(s, pressed(kind, [one])) for one in ({"on": "die", **move, **turn}, {"on": "die", "rigid": rigid})]
        forces = [one["summary"]["resultants"]["contacts"][0]["force"] for one in found]
        check(farthest(*found) < 1e-8 and math.dist(*forces) < 1e-8 and forces[0][-1] > 0.25, kind, farthest(*found), forces)
        check(abs(found[1]["summary"]["finite"]["qps"] - found[0]["summary"]["finite"]["qps"]) <= 3, kind, [one["summary"]["finite"] for one in found])


def test_a_rigid_foot_is_a_stiff_one(s):
    """A die that is rigid below, where it touches, and soft above: it turns freely, as one that is 1e5 times stiffer there, bears no force of
    its own, and mirrored answers are mirrored."""
    for kind in some(("quad4", "quad8", "hex8", "hex20"), 2):
        solid = kind in SOLID
        back = {"on": "back", "ux": 0, "uy": 0, "uz": -0.2} if solid else {"on": "back", "ux": 0, "uy": -0.25}
        foot = {"on": "rigid", "rigid": {"point": [2.3, 1, 1] if solid else [2.3, 1]}}
        rows = 1 if solid else 2
        rigid = answer(s, pressed(kind, [back, foot], shift=0.3, rows=rows))
        request = pressed(kind, [back], shift=0.3, rows=rows)
        request["problem"]["materials"] = [{**MATERIAL, "on": "soft"}, {**MATERIAL, "on": "rigid", "young": 1e5}]
        stiff = answer(s, request)
        group = rigid["summary"]["resultants"]["supports"][2]
        check(farthest(rigid, stiff) < 1e-4 and max(map(abs, group["rigid"]["rotation"])) > 1e-3, kind, farthest(rigid, stiff), group)
        check(math.hypot(*group["force"]) < 1e-7 and math.hypot(*group["rigid"]["moment"]) < 1e-7, kind, group)
        if not solid:
            foot["rigid"]["point"] = [1.7, 1]
            other = answer(s, pressed(kind, [back, foot], shift=0.3, rows=rows, mirrored=True))
            one, other = ([u[-1] for u in sorted(map(list, zip(((x[0] - 2) * sign for x in found["nodes"]), (x[1] for x in found["nodes"]),
                                                                   (u[1] for u in found["displacements"]))), key=lambda at: (round(at[0], 9), round(at[1], 9)))]
                          for found, sign in ((rigid, 1), (other, -1)))
            check(max(abs(a - b) for a, b in zip(one, other)) < 1e-8, kind)


def rocker(kind, force, rigid, cells):
    """A round foot of radius 1 about the origin on a block; its head, 1 above the middle, has a dead load down and springs aside."""
    solid, wide = kind in SOLID, 0.3
    low = lambda x: (math.sin(0.9 * (2 * x - 1)), -math.cos(0.9 * (2 * x - 1)))
    foot = lambda x, z: tuple((1 - z) * a + z * b for a, b in zip(low(x), (wide * (2 * x - 1), 1)))
    lie = lambda at, y: (at[0], 0.25 * y, at[1])
    places = [lambda x, y, z: lie((2 * x - 1, z - 2), y), lambda x, y, z: lie(foot(x, z), y)] if solid else [lambda x, y: (2 * x - 1, y - 2), foot]
    names = ("z0", "z1") if solid else ("bottom", "top")
    request = body((kind, kind), cells, places, {"floor": [(0, names[0])], "top": [(0, names[1])], "face": [(1, names[0])], "head": [(1, names[1])]},
                   model="solid" if solid else "plane_strain", kinematics="finite", contacts=[{"on": "face", "with": "top", "smooth": False}],
                   loads=[{"on": "head", "force": [0] * (2 if solid else 1) + [-force]}],
                   supports=[{"on": "floor", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}, {"on": "head", "spring": [0.05, *([0] if solid else []), 1e-3]}])
    problem, n = request["problem"], [math.prod(c) for c in cells]
    middle = [k for k, x in enumerate(problem["mesh"]["nodes"]) if abs(x[0]) < 1e-9 and abs(x[-1]) < 1e-9]
    problem["mesh"]["groups"].update({"soft": {"elements": list(range(n[0]))}, "die": {"elements": list(range(n[0], sum(n)))}, "middle": {"nodes": middle}})
    aside = {"uy": 0, "rx": 0, "rz": 0} if solid else {}
    problem["supports"] += ([{"on": "die", "rigid": {"point": [0, 0, 0][:3 if solid else 2], "ux": 0, **aside}}] if rigid else
                            [{"on": "middle", "ux": 0}] + ([{"on": "die", "uy": 0}] if solid else []))
    problem["materials"] = [{**MATERIAL, "on": "soft"}, {**MATERIAL, "on": "die", "young": 3e3}]
    return request


def test_a_rocker_tips(s):
    """What a rigid rocker bears upright is what a stiff one bears: its normals that turn, the ways of its nodes that bend under load and
    contact, and its springs each have a part in it that is several times what is allowed here. The
    foot's surface is the slave of the contact, or its master."""
    if service.INSTRUMENTED:
        raise service.Skip("three seconds of processor without a sanitizer")
    for kind, force, cells in (("quad8", 0.09, ((16, 3), (24, 2))), ("quad8", 0.09, ((24, 3), (12, 2)))):
        borne = []
        for rigid in (True, False):
            found = answer(s, rocker(kind, force, rigid, cells), "unstable", forces=False)["summary"]
            borne.append(found["finite"]["load"])
        check(abs(borne[0] / borne[1] - 1) < 0.01 and 0.4 < borne[0] < 0.9, kind, cells, borne)


# ---- ties at contact

def test_tied_parts_touch_as_one(s):
    """A block of two parts side by side, tied, that is pressed over the joint by another one: as the block in one part."""
    for kind in some(("quad4", "quad8", "hex8", "hex20"), 2):
        solid = kind in SOLID
        found = []
        for tied in (True, False):
            extra = (2,) if solid else ()
            third = lambda *r: r
            halves = [lambda x, *r: (2 * x, *r), lambda x, *r: (2 + 2 * x, *r)] if tied else [lambda x, *r: (4 * x, *r)]
            if solid:
                low, high, side = "z0", "z1", ("x1", "x0")
                die = lambda x, y, z: (1.3 + 1.4 * x, -0.1 + 1.2 * y, 1 + 0.1 * (2 * x - 1) ** 2 * (1 - z) + 0.5 * z)
                cells = ([(4, 2, 2)] * 2 if tied else [(8, 2, 2)]) + [(5, 4, 1)]
            else:
                low, high, side = "bottom", "top", ("right", "left")
                die = lambda x, y: (1.3 + 1.4 * x, 1 + 0.1 * (2 * x - 1) ** 2 * (1 - y) + 0.5 * y)
                cells = ([(8, 4)] * 2 if tied else [(16, 4)]) + [(10, 2)]
            n = len(halves)
            groups = {"floor": [(k, low) for k in range(n)], "top": [(k, high) for k in range(n)], "face": [(n, low)], "back": [(n, high)]}
            if tied:
                groups.update({"first": [(0, side[0])], "second": [(1, side[1])]})
            down = {"ux": 0.1, "uy": 0, "uz": -0.15} if solid else {"ux": 0.1, "uy": -0.2}
            request = body([kind] * (n + 1), cells, halves + [die], groups, model="solid" if solid else "plane_strain", kinematics="finite", materials=[MATERIAL],
                           contacts=[{"on": "face", "with": "top", "smooth": False}], **({"ties": [{"on": "first", "to": "second"}]} if tied else {}),
                           supports=[{"on": "floor", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}, {"on": "back", **down}])
            found.append(answer(s, request))
        tied, one = map(by_place, found)
        off = max(math.dist(one[at], tied[at]) for at in one)
        check(off < 1e-8 and set(one) == set(tied) and found[0]["summary"]["resultants"]["contacts"][0]["force"][-1] > 0.05, kind, off, found[0]["summary"]["resultants"])


def test_what_is_tied_to_a_rigid_group_goes_with_it(s):
    """A strip on a rigid block that it is tied to, and which turns by 50 degrees or freely, as a strip whose foot is rigid itself."""
    for kind, turn in some((("quad4", {"rz": 50, "ux": 0, "uy": 0}), ("quad8", {"rz": 50, "ux": 0, "uy": 0}), ("quad8", {}), ("hex8", {"rx": 0, "ry": 0, "rz": 50}),
                            ("hex20", {})), 2):
        solid, found = kind in SOLID, []
        for tied in (True, False):
            cells = [(2, 8, 1)[:3 if solid else 2], (2, 1, 1)[:3 if solid else 2]]
            places = [lambda x, y, *z: (x, 8 * y, *z), lambda x, y, *z: (x, y - 1, *z)]
            sides = ("y0", "y1") if solid else ("bottom", "top")
            groups = {"foot": [(0, sides[0])], "head": [(0, sides[1])], "base": [(1, sides[1])]}
            point = [0.5, -0.5, 0][:3 if solid else 2]
            held = {"ux": 0, "uy": 0, **({"uz": 0} if solid else {})}
            supports = [{"on": "block" if tied else "foot", "rigid": {"point": point, **turn}}]
            free = not turn
            supports.append({"on": "head", **held} if free or "ux" not in turn else {"on": "head", "ux": 0})
            load = [{"on": "base" if tied else "foot", "force": [0.01, 0.02, 0.0][:3 if solid else 2]}] if free else []
            request = body([kind] * (2 if tied else 1), cells[:2 if tied else 1], places[:2 if tied else 1],
                           {name: sides for name, sides in groups.items() if tied or name != "base"}, model="solid" if solid else "plane_strain",
                           kinematics="finite", materials=[MATERIAL], supports=supports, loads=load, **({"ties": [{"on": "foot", "to": "base"}]} if tied else {}))
            if tied:
                n = math.prod(cells[0])
                request["problem"]["mesh"]["groups"]["block"] = {"elements": list(range(n, n + 2))}
            found.append(answer(s, request))
        tied, one = map(by_place, found)
        off = max(math.dist(one[at], tied[at]) for at in one)
        moved = max(math.hypot(*u) for u in one.values())
        check(off < 1e-8 and moved > 0.3, kind, turn, off, moved)


def test_a_rigid_side_is_followed(s):
    """A rigid block tied to a soft one that is as fine, whichever has the lower nodes, and the wider side: the same answer."""
    for kind in some(("quad4", "quad8", "hex8"), 2):
        solid = kind in SOLID
        low, high = ("y0", "y1") if solid else ("bottom", "top")
        for kinematics, cells in (("fixed", 2), ("fixed", 4), ("finite", 2), ("finite", 4)):
            found = []
            for soft, block in ((0, 1), (1, 0)):
                places = [lambda x, y, *z: (8 * x, y - 1, *z), lambda x, y, *z: (2 + cells * x, y, *z)]
                sizes = [(8, 2, 1)[:3 if solid else 2], (cells, 1, 1)[:3 if solid else 2]]
                sizes, places = [sizes[soft], sizes[block]], [places[soft], places[block]]
                request = body([kind] * 2, sizes, places, {"floor": [(soft, low)], "top": [(soft, high)], "base": [(block, low)]},
                               model="solid" if solid else "plane_strain", kinematics=kinematics, materials=[MATERIAL if kinematics == "finite" else {**MATERIAL, "law": "linear"}],
                               supports=[{"on": "floor", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}, {"on": "block", "rigid": {"point": [3, 0.5, 0][:3 if solid else 2]}}],
                               loads=[{"on": "base", "force": [0.02, -0.02, 0][:3 if solid else 2]}], ties=[{"on": "base", "to": "top"}])
                first = block * math.prod(sizes[0])
                request["problem"]["mesh"]["groups"]["block"] = {"elements": list(range(first, first + math.prod(sizes[block])))}
                job = s.solved(request, "converged")
                found.append(by_place(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,nodes").json))
            one, other = found
            check(max(math.dist(one[at], other[at]) for at in one) < 1e-10 and max(math.hypot(*u) for u in one.values()) > 5e-3, kind, kinematics, cells)


def test_what_a_wall_holds_of_a_tied_node_may_lean(s):
    """A strip on a rigid block that turns, tied to it, whose tied end and one side slide along a wall: upright, by an axis, and leaning by
    30 and by 200 degrees, by a normal."""
    for kind, held in some((("quad4", True), ("quad8", False), ("hex8", True)), 2):
        solid = kind in SOLID
        cut = 3 if solid else 2
        found = []
        for lean in (0, 30, 200):
            a, b = math.cos(math.radians(lean)), math.sin(math.radians(lean))
            turned = lambda x, y, *z: [a * x - b * y, b * x + a * y, *z]
            back = lambda x, y, *z: [a * x + b * y, a * y - b * x, *z]
            places = [lambda x, y, *z: turned(x, 4 * y, *z), lambda x, y, *z: turned(x, y - 1, *z)]
            low, high, side = ("y0", "y1", "x0") if solid else ("bottom", "top", "left")
            way = turned(0, 0.3, 0)
            rigid = {"ux": way[0], "uy": way[1], "rz": 12, **({"uz": 0, "rx": 0, "ry": 0} if solid else {})} if held else {}
            wall = {"ux": 0} if lean == 0 else {"normal": turned(1, 0, 0)[:cut], "u": 0}
            request = body([kind] * 2, [(2, 4, 1)[:cut], (2, 1, 1)[:cut]], places, {"foot": [(0, low)], "head": [(0, high)], "wall": [(0, side)], "base": [(1, high)]},
                           model="solid" if solid else "plane_strain", kinematics="finite", materials=[MATERIAL],
                           supports=[{"on": "block", "rigid": {"point": turned(0.5, -0.5, 0)[:cut], **rigid}}, {"on": "head", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})},
                                     {"on": "wall", **wall}],
                           loads=[] if held else [{"on": "base", "force": turned(0.02, 0.05, 0)[:cut]}], ties=[{"on": "foot", "to": "base"}])
            request["problem"]["mesh"]["groups"]["block"] = {"elements": [8, 9]}
            found.append([back(*u) for u in answer(s, request, forces=False)["displacements"]])
        off = [max(map(math.dist, found[0], other)) for other in found[1:]]
        check(max(off) < 1e-11 and max(math.hypot(*u) for u in found[0]) > 0.15, kind, off)


# ---- meshes that are refined beside rigid groups

def test_meshes_are_refined_beside_rigid_groups(s):
    """A strip whose end turns by 40 degrees, as a rigid group and by a support that turns it: the same meshes and answers, also where nodes
    hang beside it."""
    for kind, solid in some((("quad4", False), ("quad8", False), ("tri6", False), ("hex8", True))):
        found = []
        for rigid in (False, True):
            point = [2, 0.5, 0.5][:3 if solid else 2]
            to = {"ux": 0.1, "uy": 0.2, **({"uz": 0.05} if solid else {})}  # no image of itself: marks would go by rounding
            motion = {"rigid": {"point": point, **to, **({"rx": 0, "ry": 0} if solid else {}), "rz": 40}} if rigid else {**to, "rotation": {"about": point, "angle": 40, **({"axis": [0, 0, 1]} if solid else {})}}
            request = scene(model="solid" if solid else "plane_strain", supports=[{"on": "left", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}, {"on": "right", **motion}],
                            mesh={"box": {"size": [2, 1, 1][:3 if solid else 2], "cells": [2, 1, 1][:3 if solid else 2], "element": kind}, "refine": "auto"})
            found.append(answer(s, {**request, "solver": {"accuracy": {"total": 0.3 if solid else 0.1}}}, forces=False))
        prescribed, rigid = map(by_place, found)
        check(set(prescribed) == set(rigid) and len(rigid) > 20, kind, len(prescribed), len(rigid))
        qps = [one["summary"]["finite"]["qps"] for one in found]
        off = max(math.dist(prescribed[at], rigid[at]) for at in rigid)
        check(off < 1e-6 and 0 <= qps[1] - qps[0] <= 1, kind, off, qps)  # the last step of a body without groups may be a chord


def test_auto_refines_for_the_model_that_it_takes(s):
    """A strip that bends much and little: the mesh, the answer and what small deformation errs by are those of the model that is taken,
    and of several loads one that needs large deformation decides for all."""
    def solved(kinematics, *loads, total=0.08):
        lawful = kinematics != "fixed"
        request = scene(kinematics=kinematics, supports=[{"on": "left", "ux": 0, "uy": 0}],
                        mesh={"box": {"size": [8, 1], "cells": [8, 1], "element": "quad8"}, "refine": "auto"})
        request["problem"]["materials"][0].update({} if lawful else {"law": "linear"})
        load = lambda force: [{"on": "right", "traction": [0, -force]}]
        request.update({"cases": [{"name": f"{force:g}", "loads": load(force)} for force in loads]} if len(loads) > 1 else {})
        request["problem"].update({} if len(loads) > 1 else {"loads": load(loads[0])})
        job = s.post({**request, "solver": {"accuracy": {"total": total}}}).json["id"]
        check(s.wait_status(job, "successful", "failed")["status"] == "successful", kinematics, loads)
        found = [s.get(f"/v1/jobs/{job}/result?fields=summary,displacements,nodes{name}").json
                 for name in ([f"&case={force:g}" for force in loads] if len(loads) > 1 else [""])]
        check(all(one["summary"]["outcome"] == "converged" and one["summary"]["error"]["total"] <= total for one in found), kinematics, [one["summary"] for one in found])
        return found
    much, little = 2e-3, 1e-5
    for force, model in ((much, "finite"), (little, "fixed")):
        (auto,), (own,) = solved("auto", force), solved(model, force)
        check(auto["nodes"] == own["nodes"] and farthest(auto, own) < 1e-6 * max(math.hypot(*u) for u in own["displacements"]), model)
        check(("finite" in auto["summary"]) == (model == "finite"), auto["summary"])
        small = auto["summary"].get("small_deformation", {"error": 0})
        check((small["error"] > 0.05) == (model == "finite"), small)
    both, own = solved("auto", little, much), solved("finite", little, much)
    for one, other in zip(both, own):
        check(one["nodes"] == other["nodes"] and farthest(one, other) < 1e-6 and "finite" in one["summary"], one["summary"])


def test_told_errors_do_not_depend_on_how_a_body_stands(s):
    """A strip that is bent by its end, as it is and with all of it turned by 90 degrees by its supports: the same meshes, and the same
    error, to which distances of answers have been added."""
    for kind in some(("quad8", "tri6")):
        found = []
        for stand in (0, 90):
            to = (9.2, 1.5) if stand == 0 else (-1.5, 9.2)
            request = scene(mesh={"box": {"size": [10, 1], "cells": [10, 1], "element": kind}, "refine": "auto"},
                            supports=[{"on": "left", "ux": 0, "uy": 0, "rotation": {"about": [0, 0.5], "angle": stand}},
                                      {"on": "right", "ux": to[0] - 10, "uy": to[1], "rotation": {"about": [10, 0.5], "angle": stand + 20}}])
            summary = answer(s, {**request, "solver": {"accuracy": {"total": 0.05}}}, forces=False)["summary"]
            found.append((summary["problem"]["d"], summary["error"]["total"]))
        check(found[0][0] == found[1][0] and abs(found[1][1] / found[0][1] - 1) < 1e-6, kind, found)


# ---- forces at points of rigid groups

def test_a_force_beside_a_rigid_side_is_one_on_a_rigid_block(s):
    """A dead force at a point beyond a strip's end, which is rigid, and on the end of a rigid block there: the same however far it turns,
    with the same head that buckles, in the plane and in space."""
    for solid, force, outcome in ((False, [0, 1e-4], "converged"), (False, [-1e-5, 1e-5], "converged"), (False, [-1e-3, 0], "unstable"), (True, [0, 0.01, 0.006], "converged")):
        found = []
        for block in (True, False):
            kind, n = ("hex20", 6) if solid else ("quad8", 20)
            thick = 0.5 if solid else 0.1
            rest = (1, 1) if solid else (1,)
            places = [lambda x, *r: (10 * x, *(thick * c for c in r)), lambda x, *r: (10 + 3 * x, *(thick * c for c in r))]
            names = ("x0", "x1") if solid else ("left", "right")
            groups = {"clamp": [(0, names[0])], "end": [(0, names[1])], **({"far": [(1, names[1])]} if block else {})}
            load = {"on": "far", "force": force} if block else {"on": "end", "force": force, "at": [13] + [thick / 2] * (2 if solid else 1)}
            request = body([kind] * (1 + block), [(n, *rest), (1, *rest)][:1 + block], places[:1 + block], groups, model="solid" if solid else "plane_strain",
                           kinematics="finite", materials=[MATERIAL], loads=[load],
                           supports=[{"on": "clamp", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})},
                                     {"on": "block" if block else "end", "rigid": {"point": [10, 0, 0][:3 if solid else 2]}}])
            if block:  # one group with the side of the strip
                mesh = request["problem"]["mesh"]
                ends = sorted(k for k, x in enumerate(mesh["nodes"]) if x[0] > 10 - 1e-9)
                mesh["groups"]["block"] = {"nodes": ends}
            found.append(answer(s, request, outcome, forces=False))
        for name in ("displacement", "rotation"):
            pair = [one["summary"]["resultants"]["supports"][1]["rigid"][name] for one in found]
            check(math.dist(*pair) < 1e-6 * (1 + math.hypot(*pair[0])), solid, force, name, pair)
        check(found[0]["summary"]["finite"]["load"] == found[1]["summary"]["finite"]["load"] and
              (found[0]["summary"]["finite"]["shifted"] > 0 or  # rounding has a say in the way through tangents that are not definite
               found[1]["summary"]["finite"]["qps"] <= 1.2 * found[0]["summary"]["finite"]["qps"]),
              [one["summary"]["finite"] for one in found])
        loads = [one["summary"]["resultants"]["loads"] for one in found]
        check(math.dist(loads[0]["force"], loads[1]["force"]) < 1e-9 and math.dist(loads[0]["moment"], loads[1]["moment"]) < 1e-6, loads)
        check(outcome == "unstable" or math.hypot(*found[1]["summary"]["resultants"]["supports"][1]["rigid"]["displacement"]) > 0.5, found[1]["summary"]["resultants"])


def test_a_moment_rolls_a_strip_up(s):
    """Whose end is rigid: by a moment as the rotation takes that it makes, and to a circle, in steps of which each follows the one before."""
    length, thick, angle = 10.0, 0.1, 150
    def strip(rigid, **more):
        return scene("st_venant_kirchhoff", 0, mesh={"box": {"size": [length, thick], "cells": [20, 1], "element": "quad8"}},
                     supports=[{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "rigid": {"point": [length, 0], **rigid}}], **more)
    turned = answer(s, strip({"rz": angle}))
    moment = turned["summary"]["resultants"]["supports"][1]["rigid"]["moment"][0]
    check(abs(moment / (thick ** 3 / 12 * math.radians(angle) / length) - 1) < 0.02, moment)
    load = [{"on": "right", "force": [0, 0], "at": [length, 0], "moment": [moment]}]
    rolled = answer(s, strip({}, loads=load))
    group = rolled["summary"]["resultants"]["supports"][1]
    check(farthest(turned, rolled) < 1e-5 and abs(group["rigid"]["rotation"][0] - angle) < 1e-5 and math.hypot(*group["force"]) < 1e-9, group, farthest(turned, rolled))
    job = s.post({**strip({}, loads=load), "cases": [{"name": "way", "steps": [0.5, 1, 0.6]}]}).json["id"]
    check(s.wait_status(job, "successful", "failed")["status"] == "successful", job)
    last = s.get(f"/v1/jobs/{job}/result?fields=summary&case=way").json["summary"]
    check(abs(last["resultants"]["supports"][1]["rigid"]["rotation"][0] - 0.6 * angle) < 0.01 * angle and last["outcome"] == "converged", last["resultants"])


# ---- forces at points of groups that deform

def turning(found, on, dim):
    """The place and the rotation of a side, by its nodes' mean and the rotation that fits best."""
    x, u = numpy.array(found["nodes"]), numpy.array(found["displacements"])
    rest = x[on(x)]
    now = rest + u[on(x)]
    left, _, right = numpy.linalg.svd((now - now.mean(0)).T @ (rest - rest.mean(0)))
    left[:, -1] *= numpy.sign(numpy.linalg.det(left @ right))
    return now.mean(0) - rest.mean(0), left @ right


def strip(loads, rigid=False, kinematics="finite", angle=None, **more):
    """Slender, of a law that makes it an elastica, by its end."""
    group = {"on": "right", "rigid": {"point": [10, 0.05], **({"rz": angle} if angle else {})}}
    return scene("st_venant_kirchhoff", 0, mesh={"box": {"size": [10, 0.1], "cells": [20, 1], "element": "quad8"}, **more}, kinematics=kinematics,
                 supports=[{"on": "left", "ux": 0, "uy": 0}, *([group] if rigid else [])], loads=[{"on": "right", **load} for load in loads])


def test_a_side_that_deforms_bears_forces_beside_it_and_moments(s):
    """As one that is rigid and hardly strained does, however far it turns: by a moment to an arc, by dead forces at arms. A moment, and two
    opposite forces at points that have it where the side has come to, are the same."""
    moment = 0.1 ** 3 / 12 * math.radians(150) / 10
    beside = {"arm": [{"force": [0, 1e-5], "at": [13, 0.05]}], "across": [{"force": [-1e-5, 1e-5], "at": [10, 2]}], "moment": [{"force": [0, 0], "at": [10, 0.05], "moment": [moment]}]}
    for name, loads in beside.items():
        soft, rigid = (answer(s, strip(loads, rigid)) for rigid in (False, True))
        check(farthest(soft, rigid) < 1e-5 and math.hypot(*soft["displacements"][-1]) > 7, name, farthest(soft, rigid))
        for found in (soft, rigid):
            check(found["summary"]["finite"]["failed"] == 0 and found["summary"]["finite"]["qps"] <= 15, name, found["summary"]["finite"])
        loads = [found["summary"]["resultants"]["loads"] for found in (soft, rigid)]
        check(math.dist(loads[0]["force"], loads[1]["force"]) < 1e-12 and abs(loads[0]["moment"][0] - loads[1]["moment"][0]) < 1e-10, name, loads)
        auto = answer(s, strip(beside[name], kinematics="auto"))
        check(farthest(soft, auto) < 1e-6 and auto["summary"]["small_deformation"]["error"] > 0.3, name, auto["summary"]["small_deformation"])
    _, turned = turning(soft, lambda x: x[:, 0] > 10 - 1e-9, 2)
    check(abs(math.degrees(math.atan2(turned[1, 0], turned[0, 0])) - 150) < 3, turned)
    soft = answer(s, strip([{"force": [0, 0], "at": [10, 0.05], "moment": [0.4 * moment]}]))
    _, turned = turning(soft, lambda x: x[:, 0] > 10 - 1e-9, 2)
    pair = numpy.array([0, 0.4 * moment / 2 / 3 / turned[0, 0]])  # at 3 to both sides of the middle
    pulled = answer(s, strip([{"force": list(-pair), "at": [7, 0.05]}, {"force": list(pair), "at": [13, 0.05]}]))
    check(farthest(pulled, soft) < 1e-5, farthest(pulled, soft))
    job = s.post({**strip(beside["moment"]), "cases": [{"name": "way", "steps": [0.5, 1, 0.6]}]}).json["id"]
    check(s.wait_status(job, "successful", "failed")["status"] == "successful", job)
    found = s.get(f"/v1/jobs/{job}/result?fields=summary,displacements,nodes&case=way").json
    back = answer(s, strip([{"force": [0, 0], "at": [10, 0.05], "moment": [0.6 * moment]}]))
    check(found["summary"]["outcome"] == "converged" and farthest(found, back) < 1e-5, found["summary"])


def test_soft_sides_go_with_their_points_as_the_whole_scene_turns(s):
    """A block that a force beside its side strains by a half: with another material's stiffness, refined, and with all of it turned by 30
    degrees; its column beside a free end tips under the load of a block that is as stiff there."""
    angle = math.radians(30)
    turn = lambda v: [math.cos(angle) * v[0] - math.sin(angle) * v[1], math.sin(angle) * v[0] + math.cos(angle) * v[1]]
    for kind, law in some((("quad4", "neo_hooke"), ("quad8", "neo_hooke_isochoric"), ("tri6", "st_venant_kirchhoff"))):
        found = []
        for way in (lambda v: v, turn):
            request = body((kind,), [(6, 3)], [lambda x, y: way([2 * x, y])], {"foot": [(0, "left")], "head": [(0, "right")]}, model="plane_strain", kinematics="finite",
                           materials=[{**MATERIAL, "law": law}], supports=[{"on": "foot", "ux": 0, "uy": 0}],
                           loads=[{"on": "head", "force": way([0.05, -0.05]), "at": way([2.5, 0.8]), "moment": [0.01]}])
            found.append(answer(s, request))
        off = max(math.dist(turn(u), v) for u, v in zip(*(one["displacements"] for one in found)))
        most = max(math.hypot(*u) for u in found[0]["displacements"])
        check(off < 1e-7 and most > 0.4, kind, off, most)
        check(found[0]["summary"]["finite"]["qps"] == found[1]["summary"]["finite"]["qps"] <= 8, [one["summary"]["finite"] for one in found])
    refined = []
    for kinematics in ("finite", "auto"):
        request = strip([{"force": [0, 1e-5], "at": [11, 0.05]}], kinematics=kinematics, refine="auto")
        refined.append(answer(s, {**request, "solver": {"accuracy": {"total": 0.02}}}, forces=False))
    check(refined[0]["summary"]["mesh"]["refined"] and refined[0]["nodes"] == refined[1]["nodes"] and farthest(*refined) < 1e-6, refined[0]["summary"]["mesh"])
    ends = [answer(s, strip([{"force": [-1e-5, 0], "at": [13, 0.05]}], rigid), "unstable", forces=False)["summary"]["finite"]["load"] for rigid in (False, True)]
    euler = 0.1 ** 3 / 12 * 0.12199 ** 2 / 1e-5  # k tan(10 k) = 1 / 3, of a clamped column with a rigid arm of 3
    check(abs(ends[0] / ends[1] - 1) < 2e-3 and abs(ends[0] / euler - 1) < 0.01, ends, euler)


def test_points_are_the_same_in_any_units(s):
    """Of lengths in nanometres the tangent of a point was no number, and half of its digits were lost in micrometres."""
    found = []
    for length in some((1.0, 1e5, 1e9, 1e-9)):
        request = body(("quad4",), [(6, 3)], [lambda x, y: [2 * length * x, length * y]], {"foot": [(0, "left")], "head": [(0, "right")]}, model="plane_strain",
                       kinematics="finite", materials=[{**MATERIAL, "law": "neo_hooke", "young": 1 / length**2}], supports=[{"on": "foot", "ux": 0, "uy": 0}],
                       thickness=length, loads=[{"on": "head", "force": [0.05, -0.05], "at": [2.5 * length, 0.8 * length], "moment": [0.01 * length]}])
        one = answer(s, request, forces=False)
        found.append(([[t / length for t in u] for u in one["displacements"]], one["summary"]["finite"]["qps"]))
    off = max(math.dist(u, v) for one, _ in found[1:] for u, v in zip(one, found[0][0]))
    check(off < 1e-7 and {qps for _, qps in found} == {found[0][1]}, off, [qps for _, qps in found])


def test_two_opposite_forces_twist_a_bar(s):
    """In space, by a rigid end and by one that deforms: two dead forces beside it have the moment that a prescribed rotation takes."""
    n, clamp = {"ux": 0, "uy": 0, "uz": 0}, 60
    def bar(loads, **rigid):
        return scene(model="solid", mesh={"box": {"size": [4, 1, 1], "cells": [4, 3, 3], "element": "hex20"}}, loads=loads,
                     supports=[{"on": "left", **n}, *([{"on": "right", "rigid": {"point": [4, 0.5, 0.5], **rigid["rigid"]}}] if rigid else [])])
    turned = answer(s, bar([], rigid={"rx": clamp, "ry": 0, "rz": 0}), forces=False)
    group = turned["summary"]["resultants"]["supports"][1]
    force = group["rigid"]["moment"][0] / 2 / 1.5 / math.cos(math.radians(clamp))  # at 1.5 to both sides
    pair = [{"on": "right", "force": [0, 0, sign * force], "at": [4, 0.5 + sign * 1.5, 0.5]} for sign in (1, -1)]
    rigid, soft = answer(s, bar(pair, rigid={}), forces=False), answer(s, bar(pair), forces=False)
    check(farthest(turned, rigid) < 1e-5, farthest(turned, rigid))
    _, R = turning(soft, lambda x: x[:, 0] > 4 - 1e-9, 3)
    about = math.degrees(math.atan2(R[2, 1], R[1, 1]))
    check(0 < about - clamp < 6 and soft["summary"]["finite"]["qps"] <= 10, about, soft["summary"]["finite"])  # its end may warp
    forces = numpy.array(soft["summary"]["resultants"]["loads"]["moment"])
    check(abs(forces[0] - 2 * 1.5 * force * math.cos(math.radians(about))) < 0.01 * forces[0], forces, about)


def test_points_go_with_tied_sides(s):
    """A force beside a tie, spread over either of its sides, of which one follows the other: the same."""
    for kind in ("quad4", "hex8"):
        solid = kind in SOLID
        found = [answer(s, stacked((kind, kind), supports=[{"on": "foot", "ux": 0, "uy": 0, **({"uz": 0} if solid else {})}], kinematics="finite",
                                   materials=[{"on": "all", "young": 1000, "poisson": 0.3, "law": "neo_hooke"}],
                                   loads=[{"on": on, "force": [30, -20, *[10] * solid], "at": [0.6, 0.4, 1.7] if solid else [0.5, 1.6]}])) for on in ("roof", "floor")]
        check(farthest(*found) < 1e-8 and found[0]["summary"]["finite"]["displacement"] > 0.5, kind, farthest(*found))
        check(all(one["summary"]["finite"]["qps"] <= 5 for one in found), kind, [one["summary"]["finite"] for one in found])


def test_points_that_go_with_nothing(s):
    held = {"on": "left", "ux": 0, "uy": 0}
    many = {"box": {"size": [2, 1], "cells": [2, 1600]}}
    for request, pointer, word in (({"model": "solid", "mesh": {"box": {"size": [2, 1, 1], "cells": [2, 1, 1]}}, "supports": [{**held, "uz": 0}],
                                     "loads": [{"on": "right", "force": [0, 1, 0], "at": [2, 1, 0], "moment": [1, 0, 0]}]}, "moment", "two opposite forces"),
                                   ({"mesh": many, "supports": [held], "loads": [{"on": "right", "force": [0, 1], "at": [2, 1]}]}, "at", "make it rigid"),
                                   ({"mesh": {"nodes": [[0, 0], [2, 0], [2, 1], [0, 1]], "elements": {"quad4": [[0, 1, 2, 3]]},
                                              "groups": {"left": {"edges": [[3, 0]]}, "tip": {"nodes": [2]}}},
                                     "supports": [held], "loads": [{"on": "tip", "force": [0, 1], "at": [2, 1]}]}, "on", "one point")):
        for kinematics in ("finite", "auto"):
            refused(s, scene(kinematics=kinematics, **request), f"/loads/0/{pointer}", word)
    beside = {"loads": [{"on": "right", "force": [0, -0.1], "at": [2, 1]}], "supports": [held]}  # of the linear law: there is nothing to compare with
    for cells, compared in (([2, 400], True), ([2, 1600], False)):
        request = scene("linear", kinematics="auto", mesh={"box": {"size": [2, 1], "cells": cells}}, **beside)
        predicted = expect(s.post(request, query="?validate=true"), 200).json["predicted"]
        summary = s.solved(request, "converged")["summary"]
        small, counted = summary.get("small_deformation"), summary["cost"]["actual"]["bytes"]
        check(("compared_bytes" in predicted) == bool(small) == compared, cells, predicted, small)
        check(not compared or counted / 1.35 < predicted["compared_bytes"] < 1.35 * counted, predicted, counted)  # with what points couple


if __name__ == "__main__":
    service.main(globals())
