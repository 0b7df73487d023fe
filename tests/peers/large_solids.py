"""Two solids that slide over each other by several elements under large deformation: the daemon's elements against a finer
mesh of its own, and against GetFEM and CalculiX.
usage: large_solids.py BUILD_DIR OUTPUT.json [ONLY=part of a name]

A block is pressed on a longer one and moved along it, by four to five elements; another one is pressed on a dome, a part of
a ball, and moved along that. Compared are the force between them, and on the dome, where no edge makes it infinite, the
largest pressure. GetFEM (getfem_solids.py) has bricks of 27 nodes, its contact by integrals over rays (K. Poulios and
Y. Renard), with multipliers that are linear along sides, and the load in the parts that its Newton's method needs. CalculiX
has the coarsest mesh of hex20, of 20 nodes too, the law neo_hooke_isochoric, which it has as *HYPERELASTIC, NEO HOOKE with
C10 = mu / 2 and D1 = 2 / K, and a penalty between surfaces, of some stiffnesses in E for the length of a side; it is held against ours of that
mesh and law. It goes down first, then aside, in increments that it takes by itself. Ours is put on at once."""
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


# name: places of the lower and the upper body, their cells, the way of what is held, is the pressure finite, how many times
# as fine the meshes of each element are; the last of hex20 is what the others are held against, the first that of others
SCENES = {"block on a block": ((box((0, 0, 0), (3, 1, 1.4)), box((0.4, 1, 0.2), (1, 0.7, 1))), ((8, 3, 4), (4, 2, 3)), (1.2, -0.15, 0), False,
                                {"hex8": (1, 2), "hex20": (1, 2), "tet10": (1,)}),
          "block on a dome": ((dome, box((-1.25, 1, -0.7), (2, 0.5, 1.4))), ((4, 2, 4), (4, 1, 3)), (0.5, -0.06, 0.2), True,
                             {"hex8": (1, 2, 4), "hex20": (1, 2, 3), "tet10": (1, 2)})}


def request(name, element, fine, law="neo_hooke"):
    places, cells, way, *_ = SCENES[name]
    return body((element, element), [[fine * n for n in c] for c in cells], places,
                {"foot": [(0, "y0")], "top": [(0, "y1")], "under": [(1, "y0")], "held": [(1, "y1")]},
                model="solid", kinematics="finite",
                materials=[{"on": "all", "young": YOUNG, "poisson": POISSON, "law": law}],
                supports=[{"on": "foot", "ux": 0, "uy": 0, "uz": 0}, {"on": "held", **dict(zip(("ux", "uy", "uz"), way))}],
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
    return {"element": element, "unknowns": summary["problem"]["d"], "force": contact["force"], "pressure": contact["max_pressure"], "area": contact["area"],
            "qps": summary["finite"]["qps"]}


def points(place, cells):
    """Of each brick its 27 nodes, the first axis fastest."""
    return [[place(*((c + k / 2) / n for c, k, n in zip((x, y, z), (i, j, k), cells))) for k in range(3) for j in range(3) for i in range(3)]
            for z in range(cells[2]) for y in range(cells[1]) for x in range(cells[0])]


def limited():
    """Of a process that begins."""
    resource.setrlimit(resource.RLIMIT_CPU, (OTHERS_LIMIT, OTHERS_LIMIT))


def by_getfem(name, fine):
    places, cells, way, *_ = SCENES[name]
    asked = {"parts": [points(p, [fine * n for n in c]) for p, c in zip(places, cells)], "cells": [[fine * n for n in c] for c in cells],
             "way": way, "young": YOUNG, "poisson": POISSON}
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
    way = SCENES[name][2]
    down, whole = ([{**one, **dict(zip(("ux", "uy", "uz"), w))} if one["on"] == "held" else one for one in scene["supports"]] for w in ((0, way[1], 0), way))
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
    smooth, meshes = SCENES[name][3:]
    found = [{**by_daemon(s, name, element, fine), "fine": fine} for element, times in meshes.items() for fine in times]
    finest = next(one for one in reversed(found) if one["element"] == "hex20")
    other = meshes["hex20"][0]
    row = {"scene": name, "finer": finest, "getfem": by_getfem(name, other), "calculix": by_calculix(s, name, other), "rows": found}
    true = row["getfem"]["force"] if row["getfem"]["load"] == 1 else None
    text = "".join(f"{x:10.5f}" for x in finest["force"])
    print(f"{name}: {text}, pressure {finest['pressure']:.5f}; GetFEM {row['getfem']}; CalculiX {row['calculix']}", flush=True)
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
