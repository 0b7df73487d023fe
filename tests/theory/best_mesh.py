"""What the best mesh of linear triangles takes for the bracket of the gallery, whatever chooses it, beside one of equal elements.

On a triangle of a mesh of tri6, let e be the energy norm of the answer less its linear interpolation. Parted into k triangles of its shape it has
e / sqrt(k) of that, for linear elements. The sum of e^2 / k is least for so many elements in all, N, where k is as e: (sum e)^2 / N. Where k is as the
area a, as on equal elements, it is (sum a) (sum e^2 / a) / N. Triangles have about one unknown each. Singular corners leave the first sum finite, and make
the second one grow from mesh to mesh.

usage: best_mesh.py BUILD_DIR
"""
import pathlib
import sys

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests" / part) for part in ("api", "figures")]
import service  # noqa: E402  after its place is known
import trade  # noqa: E402

ERRORS = (0.05, 0.02, 0.01)
MESHES = 3


def elasticity(problem, mesh, count):
    """Of each element, in plane stress."""
    found = numpy.zeros((count, 3, 3))
    for material in problem["materials"]:
        young, poisson = material["young"], material["poisson"]
        part = slice(None) if material["on"] == "all" else mesh["groups"][material["on"]]["elements"]
        found[part] = young / (1 - poisson ** 2) * numpy.array([[1, poisson, 0], [poisson, 1, 0], [0, 0, (1 - poisson) / 2]])
    return found


def energies(corner, of, at):
    """Twice the energy of displacements at the six nodes of each triangle, with straight sides; and its area."""
    (a, b, c) = (corner[:, k] for k in range(3))
    twice = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    slope = [numpy.stack([q[:, 1] - w[:, 1], w[:, 0] - q[:, 0]], 1) / twice[:, None] for q, w in ((b, c), (c, a), (a, b))]
    total = numpy.zeros(len(twice))
    for place in ((0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5)):  # exact for squares of linear strains
        shape = [(4 * place[k] - 1) * slope[k] for k in range(3)]
        shape += [4 * (place[k] * slope[(k + 1) % 3] + place[(k + 1) % 3] * slope[k]) for k in range(3)]
        gradient = sum(at[:, k, :, None] * shape[k][:, None, :] for k in range(6))
        strain = numpy.stack([gradient[:, 0, 0], gradient[:, 1, 1], gradient[:, 0, 1] + gradient[:, 1, 0]], 1)
        total += abs(twice) / 6 * numpy.einsum("ni,nij,nj->n", strain, of, strain)
    return total, abs(twice) / 2


def look(s, problem, mesh):
    job = s.post({"problem": {**problem, "mesh": mesh}}).json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=20").json
    moved = numpy.array(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json["displacements"])
    nodes, elements = numpy.array(mesh["nodes"]), numpy.array(mesh["elements"]["tri6"])
    at, of = moved[elements], elasticity(problem, mesh, len(elements))
    beyond = numpy.zeros_like(at)
    for k in range(3):
        beyond[:, 3 + k] = at[:, 3 + k] - (at[:, k] + at[:, (k + 1) % 3]) / 2
    whole, area = energies(nodes[elements[:, :3]], of, at)
    square, _ = energies(nodes[elements[:, :3]], of, beyond)
    return [(error, numpy.sqrt(square).sum() ** 2 / (error ** 2 * whole.sum()), area.sum() * (square / area).sum() / (error ** 2 * whole.sum())) for error in ERRORS]


def main():
    problem, mesh = trade.bodies()["bracket"]
    s = service.Service(sys.argv[1])
    try:
        s.start()
        for _ in range(MESHES):
            told = [f"{100 * error:g} %: {best:,.0f} of {equal:,.0f}" for error, best, equal in look(s, problem, mesh.json(True))]
            print(f"from {len(mesh.elements)} tri6, unknowns of the best mesh of linear triangles, of one of equal ones: {'; '.join(told)}", flush=True)
            mesh = mesh.halved()
    finally:
        s.stop()


if __name__ == "__main__":
    main()
