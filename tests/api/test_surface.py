"""What a viewer draws of a deformed body: GET /v1/jobs/{id}/surface. usage: test_surface.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import array
import copy
import gzip
import json
import math
import struct

import service
from service import MATRICES, SCENE, check, expect
from two_bodies import body

SHARED = True  # one service for all tests

TRIANGLES, LINES, POINTS = 4, 1, 0


class Surface:
    """A GLB file, read with nothing but its specification."""

    def __init__(self, data):
        magic, version, total, self.json_len, kind = struct.unpack_from("<5I", data)
        check((magic, version, total, kind) == (0x46546C67, 2, len(data), 0x4E4F534A), magic, version, total, kind)
        self.gltf = json.loads(data[20:20 + self.json_len])
        at = 20 + self.json_len
        length, kind = struct.unpack_from("<2I", data, at)
        check(kind == 0x004E4942 and at + 8 + length == len(data) and at % 4 == 0 and length % 4 == 0, length, kind)
        check(self.gltf["buffers"] == [{"byteLength": length}], self.gltf["buffers"])
        self.binary = data[at + 8:]
        self.extras = self.gltf["extras"]
        self.contact = self.extras["contact"]

    def array(self, number):
        """The tuples, or numbers, of an accessor."""
        accessor = self.gltf["accessors"][number]
        view = self.gltf["bufferViews"][accessor["bufferView"]]
        size = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        check(view["byteLength"] == 4 * size * accessor["count"] and accessor["count"] > 0, accessor, view)
        numbers = array.array({5126: "f", 5125: "I"}[accessor["componentType"]])
        numbers.frombytes(self.binary[view["byteOffset"]:view["byteOffset"] + view["byteLength"]])
        if size == 1:
            return list(numbers)
        tuples = list(zip(*[iter(numbers)] * size))
        if "min" in accessor:
            for c in range(size):
                least, most = min(t[c] for t in tuples), max(t[c] for t in tuples)
                check(accessor["min"][c] == least and accessor["max"][c] == most, accessor, least, most)
        return tuples

    def primitive(self, mesh, mode):
        return next(p for p in self.gltf["meshes"][mesh]["primitives"] if p["mode"] == mode)

    def indices(self, mesh, mode):
        size = {TRIANGLES: 3, LINES: 2, POINTS: 1}[mode]
        return list(zip(*[iter(self.array(self.primitive(mesh, mode)["indices"]))] * size))

    def places(self):
        node = self.gltf["nodes"][0]
        return [tuple(o + s * x for o, s, x in zip(node["translation"], node["scale"], p))
                for p in self.array(self.extras["position"])]

    def values(self, drawn):
        return [drawn["unit"] * x for x in self.array(drawn["accessor"])]

    def nodes(self):
        number = self.primitive(0, TRIANGLES)["attributes"].get("_NODE")
        return [int(x) for x in self.array(number)] if number is not None else list(range(len(self.places())))


def solved(s, request):
    job = s.solve(request)
    check(job["status"] == "successful", job)
    return job["id"]


def surface(s, job, query=""):
    reply = expect(s.get(f"/v1/jobs/{job}/surface{query}"), 200)
    check(reply.headers["content-type"] == "model/gltf-binary", reply.headers)
    return Surface(reply.body)


def result(s, job, fields):
    return expect(s.get(f"/v1/jobs/{job}/result?fields={fields}"), 200).json


def solid(element="hex8", cells=(3, 2, 4), obstacle=None):
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"size": [3, 2, 4], "cells": list(cells), "element": element}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "top", "ux": 0, "uz": 0}], "loads": [{"on": "top", "pressure": 1}],
                        "contacts": [{"on": "bottom",
                                      "obstacle": obstacle or {"plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}}}]},
            "solver": {"accuracy": {"relative_error": 1e-6}}}


def near(a, b, size, tolerance=1e-6):
    return abs(a - b) <= tolerance * size


def cross(a, b, c):
    """Twice the area vector of a triangle."""
    p, q = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
    return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]


def test_the_paper_s_body_is_what_the_result_says(s):
    job = solved(s, SCENE)
    glb, answer = surface(s, job), result(s, job, "nodes,displacements,reactions,gaps,pressure,von_mises")
    places, moved = glb.places(), glb.array(glb.extras["displacement"])
    check(len(places) == 341 and glb.nodes() == list(range(341)) and glb.extras["nodes"] == 341, len(places))
    check(glb.extras["dim"] == 2 and glb.extras["elements"] == 300 and glb.extras["job"] == job, glb.extras)
    largest = max(math.hypot(*u) for u in answer["displacements"])
    check(near(glb.extras["largest_displacement"], largest, largest, 1e-12), glb.extras, largest)
    for place, x in zip(places, answer["nodes"]):
        check(all(near(a, b, 60) for a, b in zip(place, x + [0])), place, x)
    for v, u in zip(moved, answer["displacements"]):
        check(all(near(glb.extras["unit"] * a, b, largest) for a, b in zip(v, u + [0])), v, u)
    stress = glb.extras["von_mises"]
    check(all(near(a, b, stress["high"]) for a, b in zip(glb.values(stress), answer["von_mises"])), stress)
    check(stress["low"] == min(answer["von_mises"]) and stress["high"] == max(answer["von_mises"]), stress)
    contact = glb.contact
    check(glb.array(contact["vertex"]) == answer["contact_nodes"] and contact["rows"] == 30, contact)
    for name, field in (("reaction", "reactions"), ("gap", "gaps"), ("pressure", "pressure")):
        size = max(map(abs, answer[field]))
        check(all(near(a, b, size) for a, b in zip(glb.values(contact[name]), answer[field])), name)
    check(glb.array(contact["normal"]) == [(0, 1, 0)] * 30 and glb.array(contact["part"]) == [0] * 30, contact)
    check(all(near(a, answer["nodes"][n][0], 60) for a, n in zip(glb.values(contact["arc"]), answer["contact_nodes"])),
          glb.values(contact["arc"]))
    check(glb.extras["contacts"] == SCENE["problem"]["contacts"], glb.extras["contacts"])


def test_pressure_is_on_both_surfaces_of_a_contact(s):
    """And nowhere else; on the slave it is that of the rows."""
    request = body(["quad4", "quad4"], [[4, 2], [5, 2]], [lambda a, b: [4 * a, b], lambda a, b: [4 * a, 1 + b]],
                   {"low": [(0, "top")], "high": [(1, "bottom")], "head": [(1, "top")], "foot": [(0, "bottom")]}, model="plane_strain",
                   materials=[{"on": "all", "young": 1000, "poisson": 0.3}], loads=[{"on": "head", "pressure": 2}],
                   supports=[{"on": "foot", "uy": 0}, {"on": "head", "ux": 0}, {"on": "foot", "ux": 0}], contacts=[{"on": "low", "with": "high"}])
    job = solved(s, request)
    glb, nodes = surface(s, job), request["problem"]["mesh"]["nodes"]
    pressure = glb.values(glb.extras["pressure"])
    touching = {k for k, x in enumerate(nodes) if x[1] == 1}
    check({k for k, p in enumerate(pressure) if p >= 0} == touching and len(touching) == 11, pressure)
    check(all(0.5 < pressure[k] < 4 for k in touching), pressure)
    rows = dict(zip(glb.array(glb.contact["vertex"]), glb.values(glb.contact["pressure"])))
    check(rows and all(near(pressure[k], p, 2) for k, p in rows.items()), rows)


def test_triangles_and_lines_of_a_plane(s):
    for element, cells, vertices, triangles, lines in (("quad4", [3, 2], 12, 12, 17), ("tri3", [3, 2], 12, 12, 23),
                                                       ("quad8", [3, 2], 29, 36, 34), ("tri6", [3, 2], 35, 48, 46)):
        request = copy.deepcopy(SCENE)
        request["problem"]["mesh"]["box"].update(cells=cells, element=element)
        glb = surface(s, solved(s, request))
        places = glb.places()
        check(len(places) == vertices and len(glb.indices(0, TRIANGLES)) == triangles, element, len(places))
        areas = [cross(*(places[i] for i in t))[2] / 2 for t in glb.indices(0, TRIANGLES)]
        check(min(areas) > 0 and near(sum(areas), 1200, 1200), element, areas)
        edges = glb.indices(0, LINES)
        check(len(edges) == lines and len({frozenset(e) for e in edges}) == lines, element, len(edges))
        border = sum(math.dist(places[a], places[b]) for a, b in glb.indices(1, LINES))
        check(near(border, 160, 160), element, border)


def test_the_faces_of_a_solid(s):
    for element, faces in (("hex8", 52 * 2), ("tet4", 104), ("tet10", 104 * 4)):
        glb = surface(s, solved(s, solid(element)))
        places, triangles = glb.places(), glb.indices(0, TRIANGLES)
        check(len(triangles) == faces and glb.extras["dim"] == 3, element, len(triangles))
        halves = [cross(*(places[i] for i in t)) for t in triangles]
        check(near(sum(math.hypot(*h) / 2 for h in halves), 52, 52), element)
        for h, t in zip(halves, triangles):  # every normal points out of the box, whose middle is at 1.5, 1, 2
            middle = [sum(places[i][c] for i in t) / 3 for c in range(3)]
            check(sum(n * (x - o) for n, x, o in zip(h, middle, (1.5, 1, 2))) > 0, element, t)
        check(near(sum(math.dist(places[a], places[b]) for a, b in glb.indices(1, LINES)), 36, 36), element)
        check("arc" not in glb.contact and "part" not in glb.contact, glb.contact)


def test_inner_nodes_are_left_out_and_the_others_keep_their_numbers(s):
    job = solved(s, solid())
    glb, answer = surface(s, job), result(s, job, "nodes,displacements,reactions,von_mises")
    nodes = glb.nodes()
    check(len(nodes) == 60 - 2 * 1 * 3 and nodes == sorted(nodes), len(nodes))
    for v, n in enumerate(nodes):
        check(all(near(a, b, 4) for a, b in zip(glb.places()[v], answer["nodes"][n])), v, n)
    check([nodes[v] for v in glb.array(glb.contact["vertex"])] == answer["contact_nodes"], glb.contact)
    stress = glb.extras["von_mises"]
    check(all(near(a, answer["von_mises"][n], stress["high"]) for a, n in zip(glb.values(stress), nodes)), stress)


def test_every_obstacle_in_the_words_of_the_request(s):
    for obstacle in ({"sphere": {"center": [1.5, -5, 2], "radius": 5, "inside": False}},
                     {"cylinder": {"point": [1.5, -5, 0], "axis": [0, 0, 1], "radius": 5, "inside": False}},
                     {"cylinder": {"point": [1.5, 9, 0], "axis": [0, 0, 1], "radius": 10, "inside": True}}):
        contacts = surface(s, solved(s, solid(obstacle=obstacle))).extras["contacts"]
        check(contacts == [{"on": "bottom", "obstacle": obstacle}], contacts)
    lines = ({"circle": {"center": [30, -100], "radius": 100, "inside": False}},
             {"polyline": {"points": [[0, 0], [20, -0.001], [60, 0]]}}, {"height": {"x": [0, 20, 60], "z": [0, -0.001, 0]}})
    for obstacle in lines:
        request = copy.deepcopy(SCENE)
        request["problem"]["contacts"][0]["obstacle"] = obstacle
        contacts = surface(s, solved(s, request)).extras["contacts"]
        check(contacts == [{"on": "bottom", "obstacle": obstacle}], contacts)
    table = {"height": {"x": [0, 3], "y": [0, 2], "z": [[0, -0.1], [-0.2, 0.1]]}}
    request = solid(obstacle=table)
    request["problem"]["contacts"][0]["on"] = "back"
    request["problem"]["supports"] = [{"on": "front", "ux": 0, "uy": 0}]
    request["problem"]["loads"] = [{"on": "front", "pressure": 1}]
    check(surface(s, solved(s, request)).extras["contacts"][0]["obstacle"] == table, table)


def test_arc_runs_around_corners_and_counts_pieces(s):
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"] = {"nodes": [[x, y] for y in (0, 1) for x in range(5)],
                                  "elements": {"quad4": [[i, i + 1, i + 6, i + 5] for i in range(4)]},
                                  "groups": {"left": {"nodes": [0, 5]}, "top": {"edges": [[6, 5], [7, 6], [8, 7], [9, 8]]},
                                             "feet": {"edges": [[3, 4], [4, 9], [1, 2]]}}}
    problem = request["problem"]
    problem["supports"] = [{"on": "left", "ux": 0, "uy": 0}]
    problem["loads"] = [{"on": "top", "traction": [0, -1]}]
    problem["contacts"] = [{"on": "feet", "obstacle": {"plane": {"point": [0, -0.001], "normal": [0, 1]}}}]
    glb = surface(s, solved(s, request))
    arc = dict(zip((glb.nodes()[v] for v in glb.array(glb.contact["vertex"])),
                   zip(glb.values(glb.contact["arc"]), glb.array(glb.contact["part"]))))
    check(arc == {3: (0, 0), 4: (1, 0), 9: (2, 0), 1: (2, 1), 2: (3, 1)}, arc)


def test_each_case_has_its_own(s):
    request = copy.deepcopy(SCENE)
    request["cases"] = [{"name": "pressed & \"bent\"", "loads": [{"on": "top", "traction": [0, -1]}]},
                        {"name": "free", "loads": []}]
    job = solved(s, request)
    expect(s.get(f"/v1/jobs/{job}/surface"), 400, "case_needed")
    expect(s.get(f"/v1/jobs/{job}/surface?case=none"), 404, "case_not_found")
    pressed, free = surface(s, job, "?case=pressed%20%26%20%22bent%22"), surface(s, job, "?case=free")
    check(pressed.extras["case"] == "pressed & \"bent\"" and pressed.extras["largest_displacement"] > 0, pressed.extras)
    check(free.extras["largest_displacement"] == 0 and free.extras["factor"] == 1, free.extras)
    check(set(free.values(free.extras["von_mises"])) == {0}, free.extras)


def test_fields_that_are_asked_for(s):
    job = solved(s, SCENE)
    bare, pressed = surface(s, job, "?fields=displacements"), surface(s, job, "?fields=pressure")
    check("von_mises" not in bare.extras and "pressure" not in bare.contact, bare.extras)
    check("pressure" in pressed.contact and "von_mises" not in pressed.extras, pressed.contact)
    check("_VON_MISES" not in bare.primitive(0, TRIANGLES)["attributes"], bare.gltf["meshes"])
    expect(s.get(f"/v1/jobs/{job}/surface?fields=strain"), 400, "bad_parameter")
    expect(s.get(f"/v1/jobs/{job}/surface?factor=2"), 400, "unknown_parameter")


def test_units_at_the_ends_of_the_range(s):
    """The same body in other units: single precision must hold it, and every number means the same."""
    plain = surface(s, solved(s, SCENE))
    for length, force in ((1e-40, 1e40), (1e40, 1e-30)):
        request = copy.deepcopy(SCENE)
        problem = request["problem"]
        problem["mesh"]["box"]["size"] = [60 * length, 20 * length]
        problem["thickness"] = 5 * length
        problem["materials"][0]["young"] = 200e3 * force / length ** 2
        problem["loads"] = [{"on": "top", "traction": [0, -0.05 * force / length ** 2]},
                            {"on": "right", "traction": [0.5 * force / length ** 2, 0]}]
        glb = surface(s, solved(s, request))
        check(near(glb.extras["largest_displacement"] / length, plain.extras["largest_displacement"], 1e-4, 1e-3),
              glb.extras)
        stress = glb.values(glb.extras["von_mises"])
        check(all(near(a / (force / length ** 2), b, 1, 1e-3)
                  for a, b in zip(stress, plain.values(plain.extras["von_mises"]))), length)
        check(all(math.isfinite(x) for u in glb.array(glb.extras["displacement"]) for x in u), length)


def test_compressed_known_and_in_parts(s):
    job = solved(s, SCENE)
    path = f"/v1/jobs/{job}/surface"
    whole = expect(s.get(path), 200)
    small = expect(s.get(path, Accept_Encoding="gzip"), 200)
    check(small.headers["content-encoding"] == "gzip" and gzip.decompress(small.body) == whole.body, small.headers)
    check(len(small.body) < 0.7 * len(whole.body) and small.headers["etag"] != whole.headers["etag"], len(small.body))
    check(s.get(path, If_None_Match=whole.headers["etag"]).status == 304, whole.headers)
    check(s.get(path, Range="bytes=0-3").body == b"glTF", "a part of it")
    check(s.request("HEAD", path).headers["content-length"] == str(len(whole.body)), "HEAD")


def test_errors_as_of_other_fields(s):
    expect(s.get(f"/v1/jobs/{solved(s, MATRICES)}/surface"), 409, "not_a_scene")
    expect(s.get(f"/v1/jobs/{'0' * 32}/surface"), 404, "not_found")
    job = s.post(service.ENDLESS).json["id"]
    expect(s.get(f"/v1/jobs/{job}/surface"), 409, "not_ended")
    s.request("DELETE", f"/v1/jobs/{job}")
    expect(s.request("POST", f"/v1/jobs/{job}/surface"), 405, "method_not_allowed")


def test_a_body_without_contacts(s):
    request = copy.deepcopy(SCENE)
    request["problem"]["contacts"] = []
    glb = surface(s, solved(s, request))
    check(glb.contact["rows"] == 0 and "vertex" not in glb.contact and glb.extras["contacts"] == [], glb.contact)
    check(len(glb.indices(0, TRIANGLES)) == 600, "triangles")


def test_obstacle_far_away_is_left_out_of_the_picture(s):
    """Pixels beyond the range of ints are not painted, row by row, for days."""
    request = {"problem": {"kind": "scene", "model": "solid",
                           "mesh": {"box": {"size": [1, 1, 1], "cells": [2, 2, 2], "element": "hex8"}},
                           "materials": [{"on": "all", "young": 1e3, "poisson": 0.3}],
                           "supports": [{"on": "top", "ux": 0, "uy": 0, "uz": 0}],
                           "loads": [{"on": "bottom", "traction": [0, -1, 0]}],
                           "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, -1e8, 0], "normal": [0, 1, 0]}}}]}}
    job = s.solve(request)
    picture = expect(s.get(f"/v1/jobs/{job['id']}/deformed.svg"), 200)
    check(b"<svg" in picture.body[:200], picture.body[:200])
    expect(s.get(f"/v1/jobs/{job['id']}/surface"), 200)


def test_body_without_a_surface(s):
    """Five tetrahedra between five nodes, each side of which lies between two of them."""
    nodes = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 0.2]]

    def volume(a, b, c, d):
        (ux, uy, uz), (vx, vy, vz), (wx, wy, wz) = ([nodes[k][i] - nodes[a][i] for i in range(3)] for k in (b, c, d))
        return ux * (vy * wz - vz * wy) - uy * (vx * wz - vz * wx) + uz * (vx * wy - vy * wx)

    tets = [[k for k in range(5) if k != left] for left in range(5)]
    tets = [tet if volume(*tet) > 0 else [tet[1], tet[0], *tet[2:]] for tet in tets]
    request = {"problem": {"kind": "scene", "model": "solid",
                           "mesh": {"nodes": nodes, "elements": {"tet4": tets}, "groups": {"three": {"nodes": [0, 1, 2]}}},
                           "materials": [{"on": "all", "young": 1e3, "poisson": 0.3}],
                           "supports": [{"on": "three", "ux": 0, "uy": 0, "uz": 0}],
                           "loads": [{"node": 3, "force": [0, 0, 1]}], "contacts": []}}
    job = s.solve(request)
    problem = s.get(f"/v1/jobs/{job['id']}/surface")
    check(400 <= problem.status < 500 and "no surface" in problem.json["detail"], problem.status, problem.json)


# ------------------------------------------------------------- sections

PULL = 3.0  # of a bar whose side is free: the stress is uniform, the displacement linear, in every mesh


def bar(element):
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"size": [4, 2, 1], "cells": [4, 3, 2], "element": element, "grading": [1.5, 1, 1]}},
                        "materials": [{"on": "all", "young": 1000.0, "poisson": 0.25}],
                        "supports": [{"on": name, key: 0} for name, key in (("left", "ux"), ("bottom", "uy"), ("back", "uz"))],
                        "loads": [{"on": "right", "traction": [PULL, 0, 0]}]},
            "solver": {"accuracy": "exact"}}


def test_sections_of_every_solid_element(s):
    """Their area and what stands in them are known; a plane between cells, and one across, cut as any other."""
    planes = (((1.37, 0, 0), (2, 0, 0), 2), ((0, 0.7, 9), (0, -1, 0), 4), ((0, 0, 0.5), (0, 0, 1), 8), ((0, 0.75, 0.75), (0, 1, 1), 4 * math.sqrt(2)))
    for element in ("tet4", "hex8", "tet10", "hex20", "wedge6", "wedge15"):
        job = solved(s, bar(element))
        for point, normal, area in planes:
            words = "&".join(f"{key}={','.join(map(str, value))}" for key, value in (("point", point), ("normal", normal)))
            got = Surface(expect(s.get(f"/v1/jobs/{job}/section?{words}"), 200).body)
            places, moved = got.places(), [tuple(got.extras["unit"] * x for x in u) for u in got.array(got.extras["displacement"])]
            check(all(abs(sum(n * (x - p) for n, x, p in zip(normal, place, point))) < 1e-5 for place in places), element, normal, "off the plane")
            check(all(abs(u[0] - PULL / 1000 * x[0]) < 1e-8 and abs(u[1] + 0.25 * PULL / 1000 * x[1]) < 1e-8 for x, u in zip(places, moved)), element)
            check(all(abs(value - PULL) < 1e-5 for value in got.values(got.extras["von_mises"])), element)
            total = 0
            for a, b, c in ([places[i] for i in triangle] for triangle in got.indices(0, TRIANGLES)):
                across = [(b[i - 2] - a[i - 2]) * (c[i - 1] - a[i - 1]) - (b[i - 1] - a[i - 1]) * (c[i - 2] - a[i - 2]) for i in range(3)]
                total += sum(n * x for n, x in zip(normal, across)) / 2 / math.hypot(*normal)
            check(abs(total - area) < 1e-4, element, normal, "has the area", total, "not", area)
            check(len(got.indices(0, LINES)) == len(got.indices(0, TRIANGLES)) and got.contact["rows"] == 0, element)
    only = Surface(expect(s.get(f"/v1/jobs/{job}/section?{words}&fields=displacements"), 200).body)
    check("von_mises" not in only.extras and len(only.places()) == len(places), "what was not asked for")


def test_sections_that_are_none(s):
    job = solved(s, bar("hex8"))
    for query in ("", "point=0,0,0", "point=0,0&normal=0,0,1", "point=0,0,0&normal=0,0,0", "point=0,0,0&normal=1,2", "point=0,0,0&normal=nan,0,1",
                  "point=0,0,0&normal=0,0,1&fields=pressure", "point=0,0,0&normal=0,0,1&count=3"):
        check(s.get(f"/v1/jobs/{job}/section?{query}").status == 400, query)
    missed = s.get(f"/v1/jobs/{job}/section?point=0,0,1.5&normal=0,0,1")
    check(missed.status == 422 and "does not cut" in missed.json["detail"], missed.body)
    flat = s.get(f"/v1/jobs/{solved(s, SCENE)}/section?point=0,0,0&normal=0,1,0")
    check(flat.status == 422 and "of a solid" in flat.json["detail"], flat.body)
    check(s.get(f"/v1/jobs/{s.solve(MATRICES)['id']}/section?point=0,0,0&normal=0,1,0").status == 409, "matrices have no body")


service.main(globals())
