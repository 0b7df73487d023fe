"""Generated scenes of large deformation with quantities, each posted on a coarse mesh and on one of cells a quarter of the size and of quadratic
elements: how many of the fine mesh's values lie in the coarse mesh's intervals, and how wide these are over the true errors.
usage: generated_large_quantities.py BUILD_DIR OUTPUT.json [SCENES [FIRST]]

Bodies are boxes of every element, law and model that bend, twist to an obstacle, stand on springs, are blown up or pressed flat by 10 to 40 %."""
import random

import generated_contacts as contacts
import generated_quantities as small

PLANE = ("quad4", "quad4", "quad8", "tri3", "tri6")
SOLID = ("hex8", "hex20")
ENDED = ("unstable", "inverted", "mesh_limit")  # loads are generated, too
LAWS = ("neo_hooke", "neo_hooke", "neo_hooke_isochoric", "st_venant_kirchhoff")


class Scene:
    def __init__(self, number):
        rng = random.Random(f"large quantities {number}")
        self.number, self.rng = number, rng
        self.dim = 3 if rng.random() < 0.1 else 2
        make = rng.choice((self.bent, self.pressed, self.pressed, self.on_springs, self.blown, self.pulled))
        self.model = "solid" if self.dim == 3 else rng.choice(("plane_strain", "plane_strain", "plane_stress", "axisymmetric")) if make != self.bent else \
            rng.choice(("plane_strain", "plane_stress"))
        self.element, self.law = rng.choice(PLANE if self.dim == 2 else SOLID), rng.choice(LAWS)
        self.poisson = rng.choice((0, 0.2, 0.3, 0.35))
        self.size, self.n = [rng.choice((1, 1.5, 2)), 1, 1][:self.dim], rng.randint(3, 7) if self.dim == 2 else 2
        self.n = max(2, self.n - 2) if self.element in ("quad8", "tri6") else self.n
        self.family, self.supports, self.loads, self.contacts = make.__name__, [], [], []
        self.quantities = [{"quantity": "strain_energy"}]
        make()

    def axes(self, **given):
        return {key: value for key, value in given.items() if self.dim == 3 or key != "uz"}

    def along(self, *components):
        return [*components, 0][:self.dim]

    def asked(self, **held):
        for on, direction in held.items():
            self.quantities.append({"quantity": "reaction" if on in ("top", "left", "bottom") else "displacement", "on": on, "direction": self.along(*direction)})

    def sides(self):
        """What symmetry holds."""
        return [{"on": "left", "ux": 0}] * (self.model != "axisymmetric") + [{"on": "back", "uz": 0}] * (self.dim == 3)

    def bent(self):
        """A cantilever, three to five times as long as it is high."""
        self.size[0] = self.rng.choice((3, 4, 5))
        self.supports = [{"on": "left", **self.axes(ux=0, uy=0, uz=0)}]
        load = self.rng.uniform(0.3, 1.5) / 4 / self.size[0] ** 2 / 3
        self.loads = [{"on": "right", "traction": self.along(0, -load)}]
        self.asked(left=(1, 1), right=(0, 1))
        self.quantities.append({"quantity": "displacement", "on": "right", "direction": self.along(1, 0), "name": "shortened"})

    def pressed(self):
        """On a plane or a circle, by its top."""
        round_one = self.rng.random() < 0.6 and self.model != "axisymmetric"
        radius = self.rng.uniform(0.8, 3)
        center = [self.rng.uniform(0.2, 0.8) * self.size[0], -radius, 0.5][:self.dim]
        self.contacts = [{"on": "bottom", "obstacle": {"sphere" if self.dim == 3 else "circle": {"center": center, "radius": radius}} if round_one else
                          {"plane": {"point": [0] * self.dim, "normal": self.along(0, 1)}}}]
        by = -self.rng.uniform(0.1, 0.2 if self.law == "st_venant_kirchhoff" else 0.35)
        self.supports = [*self.sides(), {"on": "top", **self.axes(uy=by, **({"ux": 0, "uz": 0} if self.rng.random() < 0.6 else {}))}]
        self.quantities += [{"quantity": "contact.force", "on": "bottom"},
                            {"quantity": "mean_pressure", "window": {"min": [-3] * self.dim, "max": [self.rng.choice((9, 0.6 * self.size[0])), 0.1, 9][:self.dim]}}]
        self.asked(top=(0, 1), right=(1, 0))

    def on_springs(self):
        self.supports = [*self.sides(), {"on": "bottom", "spring": self.along(0.05, self.rng.uniform(0.2, 3), )}]
        self.loads = [{"on": "top", "traction": self.along(0.05 * (self.model != "axisymmetric"), -self.rng.uniform(0.05, 0.2))}]
        self.asked(bottom=(0, 1), right=(0, 1))

    def blown(self):
        """By a pressure that follows it."""
        self.supports = [{"on": "left", **self.axes(ux=0, uy=0, uz=0)}, *([{"on": "back", "uz": 0}] * (self.dim == 3))] if self.model != "axisymmetric" else \
            [{"on": "bottom", "uy": 0}]
        self.loads = [{"on": "top", "pressure": self.rng.uniform(0.02, 0.1) * self.rng.choice((-1, 1))}]
        self.asked(**{"left" if self.model != "axisymmetric" else "bottom": (0, 1), "right": (0, 1)})

    def pulled(self):
        """With its end sides held fast."""
        self.supports = [{"on": "bottom", **self.axes(ux=0, uy=0, uz=0)}, {"on": "top", **self.axes(ux=self.rng.uniform(0, 0.4) * (self.model != "axisymmetric"),
                                                                                               uy=self.rng.uniform(0.1, 0.5), uz=0)}]
        self.asked(top=(0, 1), right=(1, 0))

    def request(self, fine=0):
        n = self.n << fine
        cells = [max(1, round(n * size)) for size in self.size]
        mesh = {"box": {"size": self.size, "cells": cells, "element": ("quad8" if self.dim == 2 else "hex20") if fine else self.element}}
        return {"problem": {"kind": "scene", "model": self.model, "mesh": mesh, "kinematics": "finite", "supports": self.supports, "loads": self.loads, "contacts": self.contacts,
                            "materials": [{"on": "all", "young": 1, "poisson": self.poisson, "law": self.law}]}, "quantities": self.quantities}


def run(s, numbers, say=print):
    """As generated_quantities: each interval with its reference, the finer of two meshes that tell how far it is to be trusted."""
    daemon, failures, rows = contacts.Daemon(s), [], []
    contacts.FIELDS = "contact_status"
    for number in numbers:
        scene = Scene(number)
        found = []
        for fine in (0, 1, 2) if scene.dim == 2 else (0, 1):
            answer, why = daemon.answer(scene.request(fine))
            found.append(answer)
            if not answer:
                break
        if not all(found):
            if not why.startswith(ENDED):
                failures.append((number, scene.family, why))
                say(*failures[-1], flush=True)
            continue
        lists = [one["summary"]["quantities"] for one in found]
        for a, c, b in zip(lists[0], lists[-2], lists[-1]):
            if abs(b["on_this_mesh"]) < small.ZERO:
                continue
            rows.append({"number": number, "family": scene.family, "element": scene.element, "model": scene.model, "dim": scene.dim, "law": scene.law, **a,
                         "true": b["value"] if b["low"] is not None else b["on_this_mesh"], "own": b["on_this_mesh"],
                         "reference": max(abs(b["value"] - b["on_this_mesh"]), 0.1 * abs(c["on_this_mesh"] - b["on_this_mesh"]) if len(found) > 2 else 0)})
    return {"scenes": len(numbers), "solves": daemon.solves, "failures": failures, "rows": rows}


told = small.told


def look(s, numbers):
    found = run(s, numbers)
    found["told"] = told(found["rows"])
    for one in found["told"]:
        print(f"{one['quantity']:14s} {one['inside']:4d} of {one['of']:4d} inside, half width over error of the mesh's value {one['half']:5.2f}, "
              f"error of the middle over it {one['middle']:5.2f}, {one['without']} of {one['asked']} without an interval")
    if found["told"][-1]["inside"] < 0.95 * found["told"][-1]["of"]:
        found["failures"].append("fewer than 95 of 100 values are in their intervals")
    return found


if __name__ == "__main__":
    contacts.command(__doc__, look, "scenes of large deformation with quantities", 30)
