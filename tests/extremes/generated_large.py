"""Generated scenes of large deformation, held against code of its own: bodies of quad4, quad8, tri3 and hex8, bent at random, in plane
strain, as rings and as solids, of every law, pressed on planes, circles and spheres by supports and loads, along paths too.

What claims to have converged must be in equilibrium: with elements and laws written here once more, in numpy's extended
precision (64 bits), forces vanish on free dofs away from the contact; on it they press, and along the obstacle there are none. No
point of a fine grid in any element is turned inside out, no node stands in the obstacle, supports are where they were put.
Every eighth is asked mirrored as well, and answered by the mirror image. usage: generated_large.py BUILD_DIR OUTPUT.json [SCENES]"""
import itertools
import json
import math
import pathlib
import random
import sys

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import plate  # noqa

REAL = numpy.longdouble
LAWS = ("neo_hooke", "neo_hooke_isochoric", "st_venant_kirchhoff")
LEFT_OVER, DEEP, OFF, MIRRORED = 1e-6, 1e-8, 1e-9, 1e-8  # of the largest nodal force; of the body's extent
ROOT = numpy.sqrt(REAL(3) / 5)
GAUSS = {2: ([-1 / numpy.sqrt(REAL(3)), 1 / numpy.sqrt(REAL(3))], [REAL(1)] * 2), 3: ([-ROOT, REAL(0), ROOT], [REAL(5) / 9, REAL(8) / 9, REAL(5) / 9])}
CORNERS = {2: [(-1, -1), (1, -1), (1, 1), (-1, 1)], 3: [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]}
MIDDLES = [(0, -1), (1, 0), (0, 1), (-1, 0)]


def shape(element, at):
    """Values and derivatives by local coordinates at a point: products of (1 + p x) / 2; of quad8 less the middles' halves."""
    if element == "tri3":
        return numpy.array([1 - at[0] - at[1], at[0], at[1]], REAL), numpy.array([[-1, -1], [1, 0], [0, 1]], REAL)
    dim = 3 if element == "hex8" else 2
    N, D = [], []
    for corner in CORNERS[dim]:
        factors = [(1 + p * x) / 2 for p, x in zip(corner, at)]
        N.append(numpy.prod(factors))
        D.append([corner[i] * REAL(0.5) * numpy.prod([f for j, f in enumerate(factors) if j != i]) for i in range(dim)])
    if element == "quad8":
        x, y = at
        for p, q in MIDDLES:
            N.append((1 - x * x) * (1 + q * y) / 2 if p == 0 else (1 - y * y) * (1 + p * x) / 2)
            D.append([-x * (1 + q * y), q * (1 - x * x) / 2] if p == 0 else [p * (1 - y * y) / 2, -y * (1 + p * x)])
        for m, (a, b) in enumerate(((0, 1), (1, 2), (2, 3), (3, 0))):
            for c in (a, b):
                N[c] -= N[4 + m] / 2
                D[c] = [d - e / 2 for d, e in zip(D[c], D[4 + m])]
    return numpy.array(N, REAL), numpy.array(D, REAL)


def rule(element, ring):
    if element == "tri3":
        return [((REAL(1) / 3,) * 2, REAL(1) / 2)] if not ring else [((a, b), REAL(1) / 6) for a, b in ((REAL(1) / 6,) * 2, (REAL(2) / 3, REAL(1) / 6), (REAL(1) / 6, REAL(2) / 3))]
    places, weights = GAUSS[3 if element == "quad8" else 2]
    of = list(zip(places, weights))
    return [(tuple(p for p, _ in one), numpy.prod([w for _, w in one])) for one in itertools.product(of, repeat=3 if element == "hex8" else 2)]


def grid(element):
    if element == "tri3":
        return [(REAL(1) / 3, REAL(1) / 3)]
    return list(itertools.product(numpy.linspace(REAL(-1), REAL(1), 5), repeat=3 if element == "hex8" else 2))


def piola(law, lam, mu, F):
    """P of F (n x 3 x 3)."""
    J = (F[:, 0, 0] * (F[:, 1, 1] * F[:, 2, 2] - F[:, 1, 2] * F[:, 2, 1]) - F[:, 0, 1] * (F[:, 1, 0] * F[:, 2, 2] - F[:, 1, 2] * F[:, 2, 0]) +
         F[:, 0, 2] * (F[:, 1, 0] * F[:, 2, 1] - F[:, 1, 1] * F[:, 2, 0]))
    if law == "st_venant_kirchhoff":
        E = (numpy.einsum("nki,nkj->nij", F, F) - numpy.eye(3, dtype=REAL)) / 2
        S = 2 * mu * E + lam * numpy.einsum("nkk->n", E)[:, None, None] * numpy.eye(3, dtype=REAL)
        return numpy.einsum("nik,nkj->nij", F, S), J
    G = numpy.empty_like(F)  # the inverse, transposed: cofactors over J
    for i, j in itertools.product(range(3), repeat=2):
        a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        G[:, i, j] = (F[:, a, c] * F[:, b, d] - F[:, a, d] * F[:, b, c]) / J
    with numpy.errstate(invalid="ignore"):
        if law == "neo_hooke":
            return mu * F + (lam * numpy.log(J) - mu)[:, None, None] * G, J
        K, trace, root = lam + 2 * mu / 3, numpy.einsum("nij,nij->n", F, F), J ** (REAL(-2) / 3)
    return (mu * root)[:, None, None] * F + (K * (J - 1) * J - mu * root * trace / 3)[:, None, None] * G, J


def deformed(scene, u, at):
    """F, the derivatives of shape functions, their values over the radius, and the measure at a local point of all elements."""
    N, D = shape(scene.element, at)
    x, v = scene.nodes[scene.cells], u[scene.cells]
    dim = x.shape[2]
    inverse, det = inverses(numpy.einsum("eac,ai->eci", x, D))
    grad = numpy.einsum("ai,eij->eaj", D, inverse)
    F = numpy.tile(numpy.eye(3, dtype=REAL), (len(x), 1, 1))
    F[:, :dim, :dim] += numpy.einsum("eac,eaj->ecj", v - v[:, :1], grad)
    around = None
    if scene.model == "axisymmetric":
        radius = numpy.einsum("a,ea->e", N, x[:, :, 0])
        around = N[None, :] / radius[:, None]
        F[:, 2, 2] += numpy.einsum("ea,ea->e", around, v[:, :, 0])
        det = det * 2 * REAL(math.pi) * radius
    return F, grad, around, det


def inverses(J):
    if J.shape[1] == 2:
        det = J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
        return numpy.stack([numpy.stack([J[:, 1, 1], -J[:, 0, 1]], 1), numpy.stack([-J[:, 1, 0], J[:, 0, 0]], 1)], 1) / det[:, None, None], det
    out = numpy.empty_like(J)
    for i, j in itertools.product(range(3), repeat=2):
        a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        out[:, j, i] = J[:, a, c] * J[:, b, d] - J[:, a, d] * J[:, b, c]
    det = numpy.einsum("ej,ej->e", J[:, 0, :], out[:, :, 0])
    return out / det[:, None, None], det


def internal(scene, u):
    force = numpy.zeros_like(u)
    for at, weight in rule(scene.element, scene.model == "axisymmetric"):
        F, grad, around, det = deformed(scene, u, at)
        P, _ = piola(scene.law, scene.lam, scene.mu, F)
        dim = u.shape[1]
        own = numpy.einsum("eij,eaj->eai", P[:, :dim, :dim], grad)
        if around is not None:
            own[:, :, 0] += P[:, 2, 2][:, None] * around
        numpy.add.at(force, scene.cells, own * (weight * det)[:, None, None])
    return force


class Scene:
    """A block of one to three by one, bent; its lower side is on an obstacle, its upper one moves or is loaded."""

    def __init__(self, number):
        rng = random.Random(f"large {number}")
        self.number, self.law = number, rng.choice(LAWS)
        self.element = rng.choice(("quad4", "quad8", "tri3", "hex8"))
        self.model = "solid" if self.element == "hex8" else rng.choice(("plane_strain", "axisymmetric"))
        self.long = rng.uniform(1, 3)
        ring = 2 if self.model == "axisymmetric" else 0
        bend = [rng.uniform(-0.06, 0.06) for _ in range(3)]
        place = lambda x, y: (ring + self.long * x + bend[0] * y * math.sin(4 * x), y + bend[1] * y * math.sin(3 * x + 1))
        if self.element == "hex8":
            self.nodes, self.cells, self.side = self.bricks(rng, place)
        else:
            nodes, cells, edges = plate("quad4" if self.element == "tri3" else self.element, (rng.randint(2, 6), rng.randint(2, 4)), 0, place)
            self.nodes, self.side = nodes, {name: [[e[0], e[-1]] for e in on] for name, on in edges.items()}
            self.cells = [t for a, b, c, d in cells for t in ([a, b, c], [a, c, d])] if self.element == "tri3" else cells
        self.poisson = rng.uniform(0, 0.42)
        self.mu, self.lam = REAL(1) / (2 * (1 + REAL(self.poisson))), REAL(self.poisson) / ((1 + REAL(self.poisson)) * (1 - 2 * REAL(self.poisson)))
        self.nodes, self.cells = numpy.array(self.nodes, REAL), numpy.array(self.cells)
        self.down, self.aside = rng.uniform(0.05, 0.35), 0 if ring else rng.choice((0, rng.uniform(-0.5, 0.5)))
        self.center, self.radius = (rng.uniform(0.2, 0.8) * self.long, rng.uniform(1, 4)) if not ring and rng.random() < 0.6 else (None, None)
        self.tilt = 0 if ring else rng.uniform(-0.15, 0.15)
        self.steps = [round(rng.uniform(0.2, 1), 2) for _ in range(rng.randint(1, 3))] + [1] if rng.random() < 0.3 else None
        self.pull = [rng.uniform(-0.06, 0.06) for _ in range(2)] if self.element != "hex8" and not ring and rng.random() < 0.5 else None  # on its right side

    def bricks(self, rng, place):
        nx, ny, nz = rng.randint(1, 4), rng.randint(1, 3), rng.randint(1, 3)
        at = lambda i, j, k: i + (nx + 1) * (j + (ny + 1) * k)
        nodes = [[*place(i / nx, j / ny), k / nz] for k in range(nz + 1) for j in range(ny + 1) for i in range(nx + 1)]
        cells = [[at(i + p, j + q, k + r) for p, q, r in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
                 for k in range(nz) for j in range(ny) for i in range(nx)]
        faces = lambda j: [[at(i, j, k), at(i + 1, j, k), at(i + 1, j, k + 1), at(i, j, k + 1)] for k in range(nz) for i in range(nx)]
        return nodes, cells, {"bottom": faces(0), "top": faces(ny)}

    def obstacle(self):
        dim = self.nodes.shape[1]
        if self.radius:
            place = [self.center, -self.radius] + [0.4] * (dim - 2)
            return {"sphere" if dim == 3 else "circle": {"center": place, "radius": self.radius}}
        return {"plane": {"point": [0] * dim, "normal": [0, 1] + [0] * (dim - 2)}}

    def gaps(self, x):
        """And normals, of places."""
        if self.radius:
            way = x - numpy.array([self.center, -self.radius] + [0.4] * (x.shape[1] - 2), REAL)
            size = numpy.sqrt((way * way).sum(1))
            return size - REAL(self.radius), way / size[:, None]
        return x[:, 1], numpy.tile(numpy.array([0, 1] + [0] * (x.shape[1] - 2), REAL), (len(x), 1))

    def request(self):
        dim = self.nodes.shape[1]
        keys = ("ux", "uy", "uz")[:dim]
        groups = {name: {"edges" if dim == 2 else "faces": on} for name, on in self.side.items()}
        mesh = {"nodes": [[float(c) for c in node] for node in self.nodes], "elements": {self.element: self.cells.tolist()}, "groups": groups}
        top = {"ux": self.aside, **({"uz": 0} if dim == 3 else {})}
        problem = {"kind": "scene", "model": self.model, "kinematics": "finite", "mesh": mesh, "materials": [{"on": "all", "young": 1, "poisson": self.poisson, "law": self.law}],
                   "supports": [{"on": "top", **top, "uy": -self.down}], "contacts": [{"on": "bottom", "obstacle": self.obstacle()}]}
        if self.pull:
            problem["loads"] = [{"on": "right", "traction": self.pull}]
        self.held = {key: value for support in problem["supports"] for key, value in support.items() if key in keys}
        return {"problem": problem, **({"cases": [{"name": "way", "steps": self.steps}]} if self.steps else {})}

    def wrong(self, found, part):
        """What is wrong with an answer that is said to have converged."""
        u = numpy.array(found["displacements"], REAL)
        dim, said = u.shape[1], []
        for at in grid(self.element) + [point for point, _ in rule(self.element, False)]:
            if not (piola(self.law, self.lam, self.mu, deformed(self, u, at)[0])[1] > 0).all():
                said.append("inverted")
        force = internal(self, u)
        most = numpy.abs(force).max()
        below, above = ({n for side in self.side[name] for n in side} for name in ("bottom", "top"))
        if self.element == "quad8":
            for on, name in ((below, "bottom"), (above, "top")):
                ends = {frozenset(side) for side in self.side[name]}
                on |= {int(cell[4 + m]) for cell in self.cells for m in range(4) if frozenset((int(cell[m]), int(cell[(m + 1) % 4]))) in ends}
        held = numpy.zeros(u.shape, bool)
        for key, value in self.held.items():
            c = "xyz".index(key[1])
            held[list(above), c] = True
            if numpy.abs(u[list(above), c] - part * value).max() > OFF:
                said.append(f"support {key}")
        left = force - part * self.loads()
        free = ~held
        free[list(below)] = False
        if numpy.abs(left[free]).max(initial=0) > LEFT_OVER * most:
            said.append(f"left over {float(numpy.abs(left[free]).max() / most):.2g}")
        on = sorted(below)
        gaps, normals = self.gaps(self.nodes[on] + u[on])
        if gaps.min() < -DEEP * self.long:
            said.append(f"deep {float(gaps.min()):.2g}")
        pressing = numpy.einsum("nc,nc->n", left[on], normals)
        total = left[on].sum(0)
        if self.radius:
            way = self.nodes[on] + u[on] - numpy.array([self.center, -self.radius] + [0.4] * (dim - 2), REAL)
            turn = numpy.abs(numpy.cross(way, left[on]).sum(0)).max()
            if turn > LEFT_OVER * most * self.radius:
                said.append(f"turns by {float(turn / most):.2g}")
        else:
            along = numpy.abs(numpy.delete(left[on], 1, 1)).max()
            if along > LEFT_OVER * most:
                said.append(f"along the plane {float(along / most):.2g}")
        if pressing.sum() < -LEFT_OVER * most:
            said.append("pulls")
        told = numpy.array(found["summary"]["contact"]["force"][:dim], REAL)
        ring = self.model == "axisymmetric"
        if numpy.abs(told - total)[1 if ring else 0:].max() > 10 * LEFT_OVER * most:
            said.append(f"force {told} {total}")
        return said

    def loads(self):
        """Of the traction on the right side, whose edges are straight, at nodes: Simpson's rule, or a half each."""
        out = numpy.zeros_like(self.nodes)
        for a, b in self.side["right"] if self.pull else ():
            traction = numpy.array(self.pull, REAL) * numpy.sqrt(((self.nodes[a] - self.nodes[b]) ** 2).sum())
            middle = next((int(cell[4 + m]) for cell in self.cells for m in range(4) if {int(cell[m]), int(cell[(m + 1) % 4])} == {a, b}), None) if self.element == "quad8" else None
            for node, share in ((a, 1), (b, 1), (middle, 4)) if middle is not None else ((a, 3), (b, 3)):
                out[node] += traction * share / 6
        return out


def mirrored(request, axis_in_cells):
    """Along x, with cells in an order that is not inside out."""
    image = json.loads(json.dumps(request))
    problem = image["problem"]
    mesh = problem["mesh"]
    mesh["nodes"] = [[-x, *rest] for x, *rest in mesh["nodes"]]
    for cells in mesh["elements"].values():
        for cell in cells:
            cell[:] = [cell[k] for k in axis_in_cells]
    for group in mesh["groups"].values():
        group.update({kind: [side[::-1] for side in sides] for kind, sides in group.items()})
    for support in problem["supports"]:
        support["ux"] = -support["ux"]
    for load in problem.get("loads", []):
        load["traction"][0] *= -1
    for shape in problem["contacts"][0]["obstacle"].values():
        if "center" in shape:
            shape["center"][0] *= -1
    return image


ORDERS = {"tri3": [0, 2, 1], "quad4": [0, 3, 2, 1], "quad8": [0, 3, 2, 1, 7, 6, 5, 4], "hex8": [1, 0, 3, 2, 5, 4, 7, 6]}


def answers(s, request):
    """Of every case; None: it was refused, with why."""
    reply = s.post(request)
    service.check(reply.status == 202, reply)
    end = s.wait_status(reply.json["id"], "successful", "failed", seconds=120)
    if end["status"] == "failed":
        return None, end["error"]["detail"]
    found = s.get(f"/v1/jobs/{reply.json['id']}/result?fields=summary,displacements").json
    return found.get("cases", [found]), ""


def look(s, number, outcomes):
    """What is wrong with a scene's answers."""
    scene = Scene(number)
    request, said = scene.request(), []
    cases, why = answers(s, request)
    if cases is None:
        return [why]
    for case, part in zip(cases, scene.steps or [1]):
        outcome = case["summary"]["outcome"]
        outcomes[outcome] = outcomes.get(outcome, 0) + 1
        said += scene.wrong(case, part) if outcome == "converged" else []
    if number % 8 == 0 and scene.model != "axisymmetric":
        images, _ = answers(s, mirrored(request, ORDERS[scene.element]))
        for case, image in zip(cases, images):
            flip = numpy.array(image["displacements"])
            flip[:, 0] *= -1
            apart = numpy.abs(flip - case["displacements"]).max() / numpy.abs(flip).max()
            if case["summary"]["outcome"] != image["summary"]["outcome"] or (apart > MIRRORED and case["summary"]["outcome"] == "converged"):
                said.append(f"mirrored: {image['summary']['outcome']}, apart {apart:.2g}")
    return [f"{scene.element} {scene.model} {scene.law}: {one}" for one in said]


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    s, outcomes, false = service.Service(sys.argv[1]), {}, []
    try:
        s.start()
        for number in range(int(sys.argv[3]) if len(sys.argv) > 3 else 500):
            said = look(s, number, outcomes)
            if said:
                false.append(number)
                print(number, said, flush=True)
    finally:
        s.stop()
    print(f"{outcomes}, {len(false)} false")
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"outcomes": outcomes, "false": false}), encoding="utf-8")
    sys.exit(1 if false else 0)


if __name__ == "__main__":
    main()
