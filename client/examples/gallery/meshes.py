#!/usr/bin/env python3
"""Writes the scenes of the gallery whose meshes are made by numbers: cylinder.json, press_fit.json, gear.json.
usage: meshes.py [FOLDER]

Standard library only. The scenes are kept beside this file, so that nobody has to run it to use them.
"""
import json
import math
import pathlib
import sys


def rounded(x):
    return float(f"{x:.9g}")


def graded(n, ratio):
    """0..1 in n steps whose lengths grow by a constant factor, the last `ratio` times the first."""
    q = ratio ** (1 / (n - 1))
    steps = [q ** i for i in range(n)]
    total, at, out = sum(steps), 0.0, [0.0]
    for step in steps:
        at += step
        out.append(at / total)
    return out


class Mesh:
    def __init__(self):
        self.nodes, self.elements, self.groups = [], {}, {}

    def grid(self, place, n, m):
        """(n + 1) x (m + 1) nodes at place(s, t) with quad4 between them. Returns the number of the first."""
        first = len(self.nodes)
        for j in range(m + 1):
            for i in range(n + 1):
                self.nodes.append([rounded(c) for c in place(i, j)])
        for j in range(m):
            for i in range(n):
                a = first + j * (n + 1) + i
                self.elements.setdefault("quad4", []).append([a, a + 1, a + n + 2, a + n + 1])
        return first

    def edges(self, name, numbers):
        self.groups[name] = {"edges": [list(pair) for pair in zip(numbers, numbers[1:])]}

    def json(self):
        return {"nodes": self.nodes, "elements": self.elements, "groups": self.groups}


def cylinder():
    """Half of the lower part of a cylinder, R = 50 mm, pressed on a plane. Hertz: a line contact."""
    radius, n, m = 50.0, 48, 28
    mesh = Mesh()
    angles = [math.radians(75) * s for s in graded(n, 60)]
    depths = graded(m, 60)

    def place(i, j):
        # From the arc (j = 0) to the flat top (j = m).
        t, a = depths[j], angles[i]
        x, y = radius * math.sin(a), -radius * math.cos(a)
        return (1 - t) * x + t * 0.6 * radius * i / n, (1 - t) * y

    first = mesh.grid(place, n, m)
    mesh.edges("arc", [first + i for i in range(n + 1)])
    mesh.edges("middle", [first + j * (n + 1) for j in range(m, -1, -1)])
    mesh.edges("top", [first + m * (n + 1) + i for i in range(n, -1, -1)])
    return {"problem": {"kind": "scene", "model": "plane_strain", "thickness": 1, "mesh": mesh.json(),
                        "materials": [{"on": "all", "young": 210e3, "poisson": 0.3}],
                        "supports": [{"on": "middle", "ux": 0}, {"on": "top", "uy": -0.1}],
                        "contacts": [{"on": "arc", "obstacle": {"plane": {"point": [0, -radius], "normal": [0, 1]}}}]},
            "tags": ["gallery", "cylinder"]}


def press_fit():
    """A quarter of a hub (steel) pressed on a shaft (aluminium) that is 0.05 mm thicker than its bore."""
    n, m = 40, 10
    mesh = Mesh()

    def ring(inner, outer, steps):
        def place(i, j):
            a, r = math.pi / 2 * i / steps, inner + (outer - inner) * j / m
            return r * math.sin(a), r * math.cos(a)
        return mesh.grid(place, steps, m)

    shaft = ring(10, 20.05, n)
    count = len(mesh.elements["quad4"])
    hub = ring(20, 35, 3 * n // 2)
    total = len(mesh.elements["quad4"])
    width = n + 1
    mesh.groups["shaft"] = {"elements": list(range(count))}
    mesh.groups["hub"] = {"elements": list(range(count, total))}
    mesh.edges("seat", [shaft + m * width + i for i in range(n, -1, -1)])
    wide = 3 * n // 2 + 1
    mesh.edges("bore", [hub + i for i in range(wide)])
    left = [[shaft + j * width for j in range(m + 1)], [hub + j * wide for j in range(m + 1)]]
    low = [[shaft + n + j * width for j in range(m + 1)], [hub + wide - 1 + j * wide for j in range(m + 1)]]
    mesh.groups["left"] = {"edges": [list(p) for line in left for p in zip(line, line[1:])]}
    mesh.groups["low"] = {"edges": [list(p) for line in low for p in zip(line, line[1:])]}
    return {"problem": {"kind": "scene", "model": "plane_strain", "thickness": 1, "mesh": mesh.json(),
                        "materials": [{"on": "shaft", "young": 70e3, "poisson": 0.33},
                                      {"on": "hub", "young": 210e3, "poisson": 0.3}],
                        "supports": [{"on": "left", "ux": 0}, {"on": "low", "uy": 0}],
                        "contacts": [{"on": "seat", "with": "bore"}]},
            "tags": ["gallery", "press fit"]}


def gear():
    """A rubber block pressed on a row of teeth."""
    points, pitch, height = [[-10.0, 0.0]], 10.0, 3.0
    for k in range(6):
        x = pitch * k
        points += [[x + 2, 0.0], [x + 4, height], [x + 6, height], [x + 8, 0.0]]
    points.append([80.0, 0.0])
    return {"problem": {"kind": "scene", "model": "plane_strain", "thickness": 1,
                        "mesh": {"box": {"origin": [0, 3.05], "size": [60, 20], "cells": [150, 50],
                                         "element": "quad4"}},
                        "materials": [{"on": "all", "young": 5, "poisson": 0.45}],
                        "supports": [{"on": "top", "ux": 0, "uy": -0.4}],
                        "contacts": [{"on": "bottom", "obstacle": {"polyline": {"points": points}}}]},
            "tags": ["gallery", "gear"]}


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    for make in (cylinder, press_fit, gear):
        path = folder / f"{make.__name__}.json"
        path.write_text(json.dumps(make(), separators=(",", ":")) + "\n")


main()
