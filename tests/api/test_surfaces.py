"""Surfaces of triangles (STL, OBJ) as rigid obstacles, as their users send them."""
# not under ThreadSanitizer: about answers, not about threads
import json
import math
import os
import struct

import service
from service import check

SHARED = True  # one service for all tests


def sphere(radius, centre, turns):
    """Triangles of a ball by degrees of longitude and latitude, normals outwards, finest at its upper pole."""
    def at(i, j):
        polar, around = math.pi * (i / turns) ** 2, 2 * math.pi * (j % (2 * turns)) / (2 * turns)
        ring = 0 if i in (0, turns) else radius * math.sin(polar)
        return (centre[0] + ring * math.cos(around), centre[1] + ring * math.sin(around), centre[2] + radius * math.cos(polar))
    out = []
    for i in range(turns):
        for j in range(2 * turns):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            out += ([(a, b, c)] if i < turns - 1 else []) + ([(a, c, d)] if i > 0 else [])
    return out


def ascii_stl(triangles, normal="0 0 0"):
    facets = "".join(f"facet normal {normal}\n outer loop\n" + "".join("  vertex {!r} {!r} {!r}\n".format(*map(float, p)) for p in t) +
                     " endloop\nendfacet\n" for t in triangles)
    return f"solid made\n{facets}endsolid made\n"


def binary_stl(triangles):
    return b"solid as some writers begin".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *(x for p in t for x in p), 0) for t in triangles)


def obj(triangles):
    points = sorted({p for t in triangles for p in t})
    place = {p: i + 1 for i, p in enumerate(points)}
    return "# made\no part\n" + "".join("v {!r} {!r} {!r}\n".format(*p) for p in points) + "".join(
        "f " + " ".join(f"{place[p]}/1/{place[p] - len(points) - 1}" for p in t) + "\n" for t in triangles)


def turned(triangles):
    return [(a, c, b) for a, b, c in triangles]


def box(low, high, without=()):
    """The six sides of a box by name, two triangles each, normals outwards."""
    x, y = low, high
    corner = [(y[0] if i & 1 else x[0], y[1] if i & 2 else x[1], y[2] if i & 4 else x[2]) for i in range(8)]
    sides = {"-z": (0, 2, 3, 1), "+z": (4, 5, 7, 6), "-y": (0, 1, 5, 4), "+y": (2, 6, 7, 3), "-x": (0, 4, 6, 2), "+x": (1, 3, 7, 5)}
    return [tuple(corner[i] for i in t) for name, (a, b, c, d) in sides.items() if name not in without for t in ((a, b, c), (a, c, d))]


def scene(obstacle, **more):
    return {"problem": {"kind": "scene", "model": "solid",
                        "mesh": {"box": {"origin": [-1, -1, 0], "size": [2, 2, 1], "cells": [8, 8, 4]}},
                        "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                        "supports": [{"on": "front", "ux": 0, "uy": 0, "uz": -0.03}],
                        "contacts": [{"on": "back", "obstacle": obstacle}], **more}}


def force(done):
    check(done["summary"]["outcome"] == "converged", done["summary"])
    return done["summary"]["contact"]["force"]


def solved(s, obstacle, **more):
    done = s.solve(scene(obstacle, **more))
    check(done["status"] == "successful", done)
    return done


def test_a_fine_ball_is_a_sphere(s):
    ball = {"sphere": {"center": [0, 0, -4], "radius": 4}}
    fine = sphere(4, (0, 0, -4), 60)
    for how in ("fixed", "moving"):
        exact = solved(s, ball, kinematics=how)
        answer = solved(s, {"surface": {"stl": ascii_stl(fine)}}, kinematics=how)
        check(abs(force(answer)[2] / force(exact)[2] - 1) < 5e-3, how, force(answer), force(exact))
    check(not [w for w in answer["summary"]["warnings"] if w["code"] == "facets"], answer["summary"]["warnings"])
    coarse = solved(s, {"surface": {"stl": ascii_stl(sphere(4, (0, 0, -4), 12))}})["summary"]
    facets = [w["value"] for w in coarse["warnings"] if w["code"] == "facets"]
    off = abs(coarse["contact"]["force"][2] / force(exact)[2] - 1)
    check(facets and facets[0] > off / 4, "a coarse file is told", facets, off)


def test_all_forms_of_a_file_are_one(s):
    triangles = sphere(4, (0, 0, -4), 16)
    single = [tuple(tuple(struct.unpack("<3f", struct.pack("<3f", *p))) for p in t) for t in triangles]
    upload = s.request("POST", "/v1/uploads", binary_stl(triangles), {"Content-Type": "application/octet-stream"}).json["id"]
    one = force(solved(s, {"surface": {"stl": ascii_stl(single)}}))
    for other in ({"stl": {"upload": upload}}, {"obj": obj(single)}, {"stl": ascii_stl(turned(single)), "flip": True},
                  {"stl": ascii_stl([tuple(tuple(10 * x - (30 if i == 2 else 0) for i, x in enumerate(p)) for p in t) for t in single]),
                   "scale": 0.1, "offset": [0, 0, 3]}):
        same = force(solved(s, {"surface": other}))
        check(abs(same[2] / one[2] - 1) < 1e-6, other, same, one)


def test_a_half_open_box(s):
    """A body in a tray: its floor and walls hold it; flat facets are a plane's answer."""
    tray = turned(box((-1.2, -1.2, 0), (1.02, 1.2, 0.8), without=("+z",)))
    flat = {"plane": {"point": [0, 0, 0], "normal": [0, 0, 1]}}
    supports = {"supports": [{"on": "front", "uz": -0.03}, {"on": "right", "ux": -0.05}, {"on": "bottom", "uy": 0}]}
    exact, answer = (solved(s, one, **supports) for one in (flat, {"surface": {"stl": ascii_stl(tray)}}))
    check(abs(force(answer)[2] / force(exact)[2] - 1) < 1e-9, force(answer), force(exact))
    walls = scene({"surface": {"stl": ascii_stl(tray)}}, **supports)
    walls["problem"]["contacts"] = [{**walls["problem"]["contacts"][0], "on": "right"}]
    walls["problem"]["supports"] = [{"on": "left", "ux": 0.05}, {"on": "front", "uz": 0}, {"on": "bottom", "uy": 0}]
    pushed = force(s.solve(walls))
    check(pushed[0] < -1 and abs(pushed[2]) < 0.2 * -pushed[0], "the wall pushes back", pushed)


def test_what_is_refused(s):
    ball = sphere(4, (0, 0, -4), 8)
    text = ascii_stl(ball)

    def refused(surface, code, says, pointer="/problem/contacts/0/obstacle/surface", line=None):
        reply = s.post(scene({"surface": surface}), query="?validate=true")
        check(reply.status == 422 and reply.json["code"] == code, reply)
        check(says in reply.json["detail"] and reply.json["pointer"] == pointer, reply)
        check(line is None or reply.json["line"] == line, reply)

    stl, wave = ("/problem/contacts/0/obstacle/surface/" + key for key in ("stl", "obj"))
    refused({"stl": ascii_stl(turned(ball))}, "bad_scene", "normals point inwards")
    refused({"stl": ascii_stl(ball[1:]), "inside": True}, "bad_scene", "is open")
    refused({"stl": ascii_stl([turned(ball)[0]] + ball[1:])}, "bad_scene", "the same way")
    refused({"stl": ascii_stl(ball + turned(sphere(1, (20, 0, 0), 4)))}, "bad_scene", "inwards: what is the obstacle")
    refused({"stl": ascii_stl(box((-9, -9, -1), (9, 9, 0), ("-x", "+x", "-y", "+y", "-z")), "0 0 -1")}, "stl_syntax", "mirrored", stl, 2)
    refused({"stl": text.replace("outer loop", "outer", 3).replace("vertex", "vortex", 1)}, "stl_syntax", '"vertex" was expected', stl, 4)
    refused({"stl": text[:-14]}, "stl_syntax", "file ends", stl)
    refused({"stl": "solid nothing\nendsolid\n"}, "stl_syntax", "no triangles", stl)
    refused({"stl": text.replace("vertex ", "vertex x", 1)}, "stl_syntax", "a number was expected", stl, 4)
    refused({"obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"}, "obj_syntax", "vertex 4", wave, 4)
    refused({"obj": "v 0 0 0\nv 1 0 0\nf 1 2\n"}, "obj_syntax", "three corners", wave, 3)
    refused({"obj": "v 0 0 0\ncstype bspline\n"}, "obj_unsupported", "curves", wave, 2)
    data = binary_stl(ball)[:-7]
    upload = s.request("POST", "/v1/uploads", data, {"Content-Type": "application/octet-stream"}).json["id"]
    refused({"stl": {"upload": upload}}, "stl_syntax", "endsolid" if data[80:84] == b"" else "expected", stl)
    plane = scene({"surface": {"stl": text}})
    plane["problem"].update(model="plane_strain", mesh={"box": {"size": [2, 1], "cells": [2, 1]}}, supports=[])
    plane["problem"]["contacts"][0]["on"] = "bottom"
    reply = s.post(plane)
    check(reply.status == 422 and reply.json["pointer"].endswith("/obstacle/surface"), reply)


def test_many_triangles_and_pictures(s):
    """100,000 triangles: found by a tree, drawn, and in the surface file as far as they are near."""
    fine = sphere(4, (0, 0, -4), 160)
    check(len(fine) > 100000, len(fine))
    upload = s.request("POST", "/v1/uploads", binary_stl(fine), {"Content-Type": "application/octet-stream"}).json["id"]
    done = solved(s, {"surface": {"stl": {"upload": upload}}})
    exact = solved(s, {"sphere": {"center": [0, 0, -4], "radius": 4}})
    check(abs(force(done)[2] / force(exact)[2] - 1) < 1e-3, force(done), force(exact))
    picture = s.get(f"/v1/jobs/{done['id']}/deformed.svg")
    check(picture.status == 200 and len(picture.body) > 1000, picture)
    glb = s.get(f"/v1/jobs/{done['id']}/surface")
    length = struct.unpack("<I", glb.body[12:16])[0]
    shown = json.loads(glb.body[20:20 + length])["extras"]["contacts"][0]["obstacle"]["surface"]
    check(shown["triangles"] == len(fine) and 0 < len(shown["corners"]) <= 60000, shown["triangles"], len(shown["corners"]))


def test_the_client_sends_a_file_along(s):
    """uzawa submit scene.json --surface ball.stl"""
    triangles = sphere(4, (0, 0, -4), 16)
    paths = {}
    for name, data in (("ball.stl", binary_stl(triangles)), ("ball.OBJ", obj(triangles).encode())):
        paths[name] = os.path.join(s.folder, name)
        with open(paths[name], "wb") as file:
            file.write(data)
    import test_client_requests as client
    told = [client.job(s.url, "-", "--surface", path, stdin=json.dumps(scene({"surface": {}}))) for path in paths.values()]
    check(abs(force(told[0])[2] / force(told[1])[2] - 1) < 1e-4, told[0]["summary"]["contact"])
    done = client.run(s.url, "submit", "-", "--surface", paths["ball.stl"], stdin=json.dumps(scene({"sphere": {"center": [0, 0, -4], "radius": 4}})), code=2)
    check("no contact of FILE" in done.stderr, done.stderr)


if __name__ == "__main__":
    service.main(globals())
