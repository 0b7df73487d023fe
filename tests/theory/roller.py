"""A roller of radius 10 pushed by 0.1 into a block, on meshes graded towards the contact, from either side: the force with
`moving` on ever finer ones. quad8 with 128, 192 and 256 cells have 1738.93, 1738.96 and 1738.91, with gradings 0.9 and
0.8 times as steep and 128 cells 1738.87 and 1738.93: 1738.9 it is. quad4 comes down to that as the square of the cells'
size: 1751.09, 1741.53, 1739.58 with 64, 128, 256, on to 1738.9. CalculiX has 1743.2 on the mesh of 32 quad8, where this is
1742.0. Minutes; not part of `make ci`. usage: roller.py BUILD_DIR"""
import itertools
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: after its place is known
from two_bodies import body

TRUE = 1738.9


def towards(middle, end, steep):
    """A map of [0, 1] to [0, end] that is finest at 0, or of [0, 1] to [-end, end], finest amid."""
    if middle:
        return lambda t: end * math.sinh(steep * (2 * t - 1)) / math.sinh(steep)
    return lambda t: end * math.sinh(steep * t) / math.sinh(steep)


def request(element, n, exchanged, steep=1):
    """n cells along the block's top, graded so many times as steeply; half widths of contact are 0.6. Stress units: MPa, lengths: mm."""
    wide, deep = towards(True, 100, 7 * steep), towards(False, 100, 8 * steep)
    around, inwards = towards(True, 0.25 * math.pi, 4.5 * steep), towards(False, 1, 5 * steep)

    def block(x, y):
        return wide(x), 100 - deep(1 - y)

    def arc(angle):
        return 10 * math.sin(angle), 110 - 10 * math.cos(angle)

    def roller(x, y):
        """Coons' patch: an eighth of the circle to either side of the contact, the next ones, and the diameter."""
        s, t = 0.5 + around(x) / (0.5 * math.pi), inwards(y)
        low, left, right = arc(around(x)), arc(-0.25 * math.pi * (1 + t)), arc(0.25 * math.pi * (1 + t))
        high = (10 * (2 * s - 1), 110)
        ends = [arc(-0.25 * math.pi), arc(0.25 * math.pi), (-10, 110), (10, 110)]
        return [(1 - t) * low[c] + t * high[c] + (1 - s) * left[c] + s * right[c] -
                (1 - t) * ((1 - s) * ends[0][c] + s * ends[1][c]) - t * ((1 - s) * ends[2][c] + s * ends[3][c]) for c in range(2)]
    on, other = ("arc", "top") if exchanged else ("top", "arc")
    scene = body([element] * 2, [(n, n // 2), (n - n // 8, n // 2)], [block, roller],
                 {"base": [(0, "bottom")], "top": [(0, "top")], "arc": [(1, "bottom")], "lid": [(1, "top")]},
                 model="plane_strain", kinematics="moving",
                 materials=[{"on": "block", "young": 70e3, "poisson": 0.3}, {"on": "roller", "young": 210e3, "poisson": 0.3}],
                 supports=[{"on": "base", "ux": 0, "uy": 0}, {"on": "lid", "ux": 0, "uy": -0.1}],
                 contacts=[{"on": on, "with": other}])
    first = 1 if element in ("quad4", "quad8") else 2
    cells = [first * n * (n // 2), first * (n // 2) * (2 * n - n // 8)]
    scene["problem"]["mesh"]["groups"].update(block={"elements": list(range(cells[0]))}, roller={"elements": list(range(*cells))})
    return scene


def main():
    s, forces, false = service.Service(sys.argv[1]), {}, []
    try:
        s.start()
        for element, n, exchanged in itertools.product(("quad4", "quad8"), (32, 64, 128, 256), (False, True)):
            if (element, n) in (("quad4", 32), ("quad8", 256)):
                continue
            job = s.solve(request(element, n, exchanged))
            if job["status"] != "successful" or job["summary"]["outcome"] != "converged":
                sys.exit(f"{n}: {job.get('error') or job['summary']['message']}")
            contact = job["summary"]["contact"]
            forces[element, n, exchanged] = abs(contact["force"][1])
            print(f"{element} {n:4d} cells, {'arc on top' if exchanged else 'top on arc'}: {forces[element, n, exchanged]:.3f}, {contact['active']} in contact, "
                  f"{contact['geometry']['passes']} passes, {[w['code'] for w in job['summary']['warnings']]}", flush=True)
    finally:
        s.stop()
    for (element, n, exchanged), force in forces.items():
        if abs(force / forces[element, n, False] - 1) > 1e-3:
            false.append(f"{element} {n}: {force} exchanged")
        if n >= (256 if element == "quad4" else 64) and abs(force / TRUE - 1) > 5e-4:
            false.append(f"{element} {n}: {force} for {TRUE}")
    print(f"false: {false}" if false else f"from either side the same, and {TRUE} within 0.05 %")
    sys.exit(bool(false))


if __name__ == "__main__":
    main()
