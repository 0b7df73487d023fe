"""Two bodies that slide over each other by several elements under large deformation: the daemon's elements against a finer
mesh of its own, and against GetFEM and CalculiX.
usage: large_solids.py BUILD_DIR OUTPUT.json [ONLY=part of a name]

A block is pressed on a longer one and moved along it, by four to five elements, in the plane and in space; another one is
pressed on a dome, a part of a ball, and moved along that; and a ring is pressed on a larger one, of both a quarter.
Compared are the force between them, and where no edge makes it infinite the largest pressure. GetFEM (getfem_solids.py) has
cells of 9 and 27 nodes, its contact by integrals over rays (K. Poulios and Y. Renard), with multipliers that are linear
along sides, and the load in the parts that its Newton's method needs. CalculiX, in space,
has the coarsest mesh of hex20, of 20 nodes too, the law neo_hooke_isochoric, which it has as *HYPERELASTIC, NEO HOOKE with
C10 = mu / 2 and D1 = 2 / K, and a penalty between surfaces, of some stiffnesses in E for the length of a side; it is held against ours of that
mesh and law. It goes down first, then aside, in increments that it takes by itself. Ours is put on at once."""
import itertools
import json
import math
import pathlib
import resource
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "api"))
import calculix  # noqa: E402  the path is set above
import service  # noqa: E402
from two_bodies import body  # noqa: E402

LIMIT, YOUNG, POISSON = 600, 1.0, 0.3
OTHERS_LIMIT = 60  # seconds of processor of one run of another program
STIFFNESS = (10, 100, 1000)  # of CalculiX's contact, in E for the length of a side


def box(origin, size):
    return lambda *t: [o + s * x for o, s, x in zip(origin, size, t)]


def dome(*t):
    """A plate whose top is a part of a ball of radius 2."""
    x, z = 1.6 * t[0] - 0.8, 1.6 * t[2] - 0.8
    return [x, t[1] * (1 - 2 + math.sqrt(4 - x * x - z * z)), z]


def quarter(inner, outer, middle, begin):
    """Of a ring, from the angle `begin` in right angles on; its outer side is x1."""
    return lambda x, y: [(inner + (outer - inner) * x) * math.cos(math.pi / 2 * (begin + y)),
                         middle + (inner + (outer - inner) * x) * math.sin(math.pi / 2 * (begin + y))]


def pushed(*way):
    """The lower body is held by its side y0, the upper one's y1 is moved so, and y0 touches y1: (part, side, u)."""
    return [(0, "y0", dict(enumerate([0] * len(way)))), (1, "y1", dict(enumerate(way)))]


# Places of the lower and the upper body, their cells, which sides are held and how they are moved, which side of the upper
# one touches which of the lower one, is the pressure finite, how many times as fine the meshes of each element are. The last
# one of ELEMENT[dimensions] is what the others are held against, the first is that of other programs.
SCENES = {"block on a block": {"places": (box((0, 0, 0), (3, 1, 1.4)), box((0.4, 1, 0.2), (1, 0.7, 1))), "cells": ((8, 3, 4), (4, 2, 3)), "held": pushed(1.2, -0.15, 0),
                               "touch": ("y0", "y1"), "smooth": False, "meshes": {"hex8": (1, 2), "hex20": (1, 2), "tet10": (1,)}},
          "block on a dome": {"places": (dome, box((-1.25, 1, -0.7), (2, 0.5, 1.4))), "cells": ((4, 2, 4), (4, 1, 3)), "held": pushed(0.5, -0.06, 0.2),
                              "touch": ("y0", "y1"), "smooth": True, "meshes": {"hex8": (1, 2, 4), "hex20": (1, 2, 3), "tet10": (1, 2)}},
          "block on a block, plane": {"places": (box((0, 0), (3, 1)), box((0.4, 1), (1, 0.7))), "cells": ((12, 4), (5, 3)), "held": pushed(0.9, -0.15),
                                      "touch": ("y0", "y1"), "smooth": False, "meshes": {"quad4": (1, 2, 4), "quad8": (1, 2, 4)}},
          "ring on a ring": {"places": (quarter(1.6, 2, 0, 0), quarter(0.7, 1, 3, -1)), "cells": ((2, 16), (2, 12)),
                             "held": [(0, "y0", {1: 0}), (0, "y1", {0: 0}), (1, "y0", {0: 0}), (1, "y1", {1: -0.8})],
                             "touch": ("x1", "x1"), "smooth": True, "meshes": {"quad4": (1, 2, 4), "quad8": (1, 2, 4)}}}
ELEMENT = {2: "quad8", 3: "hex20"}
PLANE_SIDES = {"x0": "left", "x1": "right", "y0": "bottom", "y1": "top"}


def dimensions(name):
    return len(SCENES[name]["cells"][0])


def request(name, element, fine, law="neo_hooke"):
    scene, dim = SCENES[name], dimensions(name)

    def side(of):
        return of if dim == 3 else PLANE_SIDES[of]
    groups = {"under": [(1, side(scene["touch"][0]))], "top": [(0, side(scene["touch"][1]))],
              **{f"held {k}": [(part, side(of))] for k, (part, of, _) in enumerate(scene["held"])}}
    return body((element, element), [[fine * n for n in c] for c in scene["cells"]], scene["places"], groups,
                model="solid" if dim == 3 else "plane_strain", kinematics="finite",
                materials=[{"on": "all", "young": YOUNG, "poisson": POISSON, "law": law}],
                supports=[{"on": f"held {k}", **{f"u{'xyz'[c]}": value for c, value in u.items()}} for k, (_, _, u) in enumerate(scene["held"])],
                contacts=[{"on": "under", "with": "top"}])


def by_daemon(s, name, element, fine, law="neo_hooke"):
    job = s.post({**request(name, element, fine, law), "solver": {"time_limit_s": LIMIT}}).json
    while job["status"] in ("accepted", "running"):  # for longer than a request may wait
        time.sleep(0.2)
        job = s.get(f"/v1/jobs/{job['id']}").json
    summary = job["summary"]
    if summary["outcome"] != "converged":
        sys.exit(f"{name}, {element}: {summary['outcome']}: {summary.get('message')}")
    contact = summary["contact"]
    return {"element": element, "unknowns": summary["problem"]["d"], "force": contact["force"][:dimensions(name)], "pressure": contact["max_pressure"], "area": contact["area"],
            "qps": summary["finite"]["qps"]}


def points(place, cells):
    """Of each cell its 9 or 27 nodes, the first axis fastest."""
    def all_of(counts):
        return [at[::-1] for at in itertools.product(*map(range, reversed(counts)))]
    return [[place(*((c + k / 2) / n for c, k, n in zip(cell, node, cells))) for node in all_of([3] * len(cells))] for cell in all_of(cells)]


def limited():
    """Of a process that begins."""
    resource.setrlimit(resource.RLIMIT_CPU, (OTHERS_LIMIT, OTHERS_LIMIT))


def by_getfem(name, fine):
    scene = SCENES[name]
    cells = [[fine * n for n in c] for c in scene["cells"]]
    asked = {"parts": [points(p, c) for p, c in zip(scene["places"], cells)], "cells": cells, "held": [[part, of, list(u.items())] for part, of, u in scene["held"]],
             "touch": scene["touch"], "young": YOUNG, "poisson": POISSON}
    done = subprocess.run(["/usr/bin/python3", "-B", HERE / "getfem_solids.py"], input=json.dumps(asked), capture_output=True, text=True,
                          check=False, preexec_fn=limited, env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"})
    if done.returncode < 0:  # the limit has ended it
        return {"load": 0, "seconds": OTHERS_LIMIT, "steps": 0}
    if done.returncode > 0:
        sys.exit(done.stderr)
    return json.loads(done.stdout.strip().splitlines()[-1])


def steps(name, fine, stiffness):
    """What calculix.deck makes of the scene, with its law, and the way in two steps."""
    scene = request(name, "hex20", fine)["problem"]
    whole = scene["supports"]
    down = [{key: value if key in ("on", "uy") else 0 for key, value in one.items()} for one in whole]
    texts = [calculix.deck({**scene, "supports": supports}, "surfaces", stiffness) for supports in (down, whole)]
    shear, bulk = YOUNG / 2 / (1 + POISSON), YOUNG / 3 / (1 - 2 * POISSON)
    head = texts[0].split("*STEP", 1)[0].replace(f"*ELASTIC\n{YOUNG}, {POISSON}", f"*HYPERELASTIC, NEO HOOKE\n{shear / 2:.15g}, {2 / bulk:.15g}")
    held = [text.split("*BOUNDARY\n", 1)[1].split("*NODE PRINT", 1)[0] for text in texts]
    return head + "".join(f"*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1.\n*BOUNDARY\n{each}*NODE PRINT, NSET=ALL, FREQUENCY=100000\nU, RF\n*END STEP\n" for each in held)


def by_calculix(s, name, fine):
    """The force on the upper body by CalculiX, and how far it is off ours of its law, by the stiffness of its contact."""
    scene, rows = request(name, "hex20", fine)["problem"], []
    ours = by_daemon(s, name, "hex20", fine, "neo_hooke_isochoric")["force"]
    for stiffness in STIFFNESS:
        printed, seconds = calculix.by_calculix(steps(name, fine, stiffness), limited)
        force = calculix.force_on_slave(scene, printed) if printed else None
        rows.append({"stiffness": stiffness, "seconds": seconds, "force": force, "off": off(force, ours) if force else None})
    return {"ours": ours, "rows": rows}


def off(value, true):
    return math.dist(value, true) / math.hypot(*true)


def row_of(s, name):
    smooth, meshes, element = SCENES[name]["smooth"], SCENES[name]["meshes"], ELEMENT[dimensions(name)]
    found = [{**by_daemon(s, name, each, fine), "fine": fine} for each, times in meshes.items() for fine in times]
    finest = next(one for one in reversed(found) if one["element"] == element)
    other = meshes[element][0]
    row = {"scene": name, "finer": finest, "getfem": by_getfem(name, other), "rows": found}
    if dimensions(name) == 3:
        row["calculix"] = by_calculix(s, name, other)
    true = row["getfem"]["force"] if row["getfem"]["load"] == 1 else None
    text = "".join(f"{x:10.5f}" for x in finest["force"])
    print(f"{name}: {text}, pressure {finest['pressure']:.5f}; GetFEM {row['getfem']}; CalculiX {row.get('calculix')}", flush=True)
    for one in found:
        one["getfem_off"] = off(one["force"], true) if true else None
        if one is not finest:
            one.update(force_off=off(one["force"], finest["force"]), area_off=abs(one["area"] / finest["area"] - 1),
                       pressure_off=abs(one["pressure"] / finest["pressure"] - 1) if smooth else None)
        print({key: one[key] for key in one if key != "force"}, flush=True)
    return row


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    only = "".join(option[5:] for option in sys.argv[3:] if option.startswith("ONLY="))
    s = service.Service(sys.argv[1])
    try:
        s.start()
        rows = [row_of(s, name) for name in SCENES if only in name]
    finally:
        s.stop()
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"rows": rows}), encoding="utf-8")


if __name__ == "__main__":
    main()
