"""Two bodies in contact by CalculiX and by the daemon: the same meshes, supports and loads, small displacements.
usage: calculix.py BUILD_DIR OUTPUT.json

A block on another whose mesh does not match, and a press fit, with CalculiX's contact of surfaces with surfaces and of nodes
with surfaces. Compared are the force through the contact and seconds of processor of the whole: of CalculiX from deck to
answer, of the daemon from request to answer. CalculiX's contact is a penalty, here of 10,000 E for each unit of length."""
import json
import math
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import service  # noqa: E402  the path is set above
from two_bodies import body  # noqa: E402

# CalculiX's names of the faces of a C3D8, by corners.
FACES = {frozenset((0, 1, 2, 3)): 1, frozenset((4, 5, 6, 7)): 2, frozenset((0, 1, 5, 4)): 3, frozenset((1, 2, 6, 5)): 4,
         frozenset((2, 3, 7, 6)): 5, frozenset((3, 0, 4, 7)): 6}
KINDS = {"surfaces": "SURFACE TO SURFACE", "nodes": "NODE TO SURFACE"}


def block(n):
    """A block pushed on another: n and n + n / 5 cells along a side."""
    cells = [(n, n, n // 2), (n + n // 5, n + n // 5, n // 2)]
    both = {f"{axis}{end}": [(0, f"{axis}{end}"), (1, f"{axis}{end}")] for axis in "xy" for end in "01"}
    return body(["hex8", "hex8"], cells, [lambda x, y, z: (x, y, z - 1), lambda x, y, z: (0.8 * x, 0.8 * y, z)],
                {"low": [(0, "z1")], "high": [(1, "z0")], "base": [(0, "z0")], "head": [(1, "z1")], **both}, model="solid",
                materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                supports=[{"on": "x0", "ux": 0}, {"on": "y0", "uy": 0}, {"on": "base", "uz": 0}, {"on": "head", "uz": -0.01}],
                contacts=[{"on": "high", "with": "low"}])


def fit(n):
    """A quarter of a press fit with n facets on the shaft."""
    def ring(inner, outer):
        return lambda x, y, z: ((inner + (outer - inner) * x) * math.cos(math.pi / 2 * y),
                                (inner + (outer - inner) * x) * math.sin(math.pi / 2 * y), 2 * z)
    both = {f"{axis}{end}": [(0, f"{axis}{end}"), (1, f"{axis}{end}")] for axis in "yz" for end in "01"}
    return body(["hex8", "hex8"], [(n // 3, n, 2), (n // 3, n * 11 // 15, 3)], [ring(10, 20.02), ring(20, 40)],
                {"high": [(0, "x1")], "low": [(1, "x0")], **both}, model="solid",
                materials=[{"on": "all", "young": 210000, "poisson": 0.3}],
                supports=[{"on": "y0", "uy": 0}, {"on": "y1", "ux": 0}, {"on": "z0", "uz": 0}],
                contacts=[{"on": "high", "with": "low"}])


def deck(scene, discretization):
    """The scene as CalculiX reads it: hex8 only, supports along axes, one contact, no loads."""
    mesh, contact, young = scene["mesh"], scene["contacts"][0], scene["materials"][0]["young"]
    lines = ["*NODE, NSET=ALL"] + [f"{k + 1}, " + ", ".join(f"{t:.15g}" for t in x) for k, x in enumerate(mesh["nodes"])]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=ALL"]
    lines += [f"{k + 1}, " + ", ".join(str(i + 1) for i in e) for k, e in enumerate(mesh["elements"]["hex8"])]
    owner = {frozenset(e[c] for c in face): (k + 1, name) for k, e in enumerate(mesh["elements"]["hex8"])
             for face, name in FACES.items()}
    for name in (contact["on"], contact["with"]):
        lines += [f"*SURFACE, NAME={name.upper()}, TYPE=ELEMENT"]
        lines += ["{}, S{}".format(*owner[frozenset(face)]) for face in mesh["groups"][name]["faces"]]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{young}, {scene['materials'][0]['poisson']}", "*SOLID SECTION, ELSET=ALL, MATERIAL=M",
              "*SURFACE INTERACTION, NAME=I", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{1e4 * young}, {1e-3 * young}",
              f"*CONTACT PAIR, INTERACTION=I, TYPE={KINDS[discretization]}", f"{contact['on'].upper()}, {contact['with'].upper()}",
              "*STEP", "*STATIC", "1., 1.", "*BOUNDARY"]
    for support in scene["supports"]:
        nodes = sorted({k for face in mesh["groups"][support["on"]]["faces"] for k in face})
        for dof, key in enumerate(("ux", "uy", "uz"), 1):
            lines += [f"{k + 1}, {dof}, {dof}, {support[key]}" for k in nodes if key in support]
    lines += ["*NODE PRINT, NSET=ALL", "RF", "*END STEP"]
    return "\n".join(lines) + "\n"


def by_calculix(scene, discretization):
    """Force on the slave, and seconds of processor; None where CalculiX fails."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "job.inp").write_text(deck(scene, discretization), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, timeout=600, check=False,
                              env={"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        text = (path / "job.dat").read_text(encoding="utf-8") if (path / "job.dat").exists() else ""
        if done.returncode != 0 or "forces (fx,fy,fz)" not in text:
            return None, seconds
    second, seen = 0, -1  # the first node of the second body
    for element in scene["mesh"]["elements"]["hex8"]:
        second = min(element) if min(element) > seen >= 0 else second
        seen = max(seen, *element)
    mine = min(scene["mesh"]["groups"][scene["contacts"][0]["on"]]["faces"][0]) >= second
    force = [0.0] * 3
    for line in text.rsplit("forces (fx,fy,fz)", 1)[1].splitlines()[1:]:
        fields = line.split()
        if len(fields) == 4 and (int(fields[0]) > second) == mine:  # what supports do to the body, the contact undoes
            force = [f - float(t) for f, t in zip(force, fields[1:])]
    return force, seconds


def by_daemon(s, scene, discretization):
    """The same from the daemon."""
    problem = {**scene, "contacts": [{**scene["contacts"][0], "discretization": discretization}]}
    before = sum(map(int, pathlib.Path(f"/proc/{s.process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
    job = s.solve({"problem": problem})
    after = sum(map(int, pathlib.Path(f"/proc/{s.process.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]))
    assert job["summary"]["outcome"] == "converged", job
    return job["summary"]["resultants"]["contacts"][0]["force"], (after - before) / 100


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    if not shutil.which("ccx"):
        sys.exit("ccx is not installed: make bench-deps")
    rows = []
    print(f"{'problem':14s} {'contact':9s} {'force, CalculiX':>34s} {'force, ours':>34s} {'s':>8s} {'ours, s':>8s} {'ratio':>7s}")
    for name, make, sizes in (("block", block, (8, 16)), ("press fit", fit, (15, 30))):
        for size in sizes:
            scene = make(size)["problem"]
            for discretization in KINDS:
                s = service.Service(sys.argv[1])
                try:
                    s.start()
                    ours, our_s = by_daemon(s, scene, discretization)
                finally:
                    s.stop()
                theirs, their_s = by_calculix(scene, discretization)
                rows.append({"problem": f"{name} {size}", "contact": discretization, "calculix": theirs, "ours": ours,
                             "calculix_s": their_s, "ours_s": our_s})
                shown = ["-" if f is None else " ".join(f"{t + 0.0:.5g}" if abs(t) > 1e-6 * max(map(abs, f)) else "0" for t in f) for f in (theirs, ours)]
                print(f"{name + ' ' + str(size):14s} {discretization:9s} {shown[0]:>34s} {shown[1]:>34s} {their_s:8.2f} {our_s:8.2f} "
                      f"{their_s / max(our_s, 0.01):7.1f}", flush=True)
    pathlib.Path(sys.argv[2]).write_text(json.dumps({"measured": time.time(), "rows": rows}), encoding="utf-8")


if __name__ == "__main__":
    main()
