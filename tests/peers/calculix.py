"""Two bodies in contact by CalculiX and by the daemon: the same meshes, supports and loads, small displacements.
usage: calculix.py BUILD_DIR OUTPUT.json [DECKS]

Blocks on others whose meshes do not match, and press fits, with CalculiX's contact of surfaces with surfaces and of nodes
with surfaces; or of CalculiX's own decks with contact or ties, where DECKS is a folder of them (Debian: calculix-ccx-test), those that
the daemon makes scenes of (decks.py); these a second time with a stiff contact, as their own may give by per cents. Compared are the force through the contact, where it is known, displacements, and seconds of
processor of the whole: of CalculiX from deck to answer, of the daemon from request to answer. CalculiX's contact is a
penalty, in what is made here of 100 E for each length of a side."""
import json
import math
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "api"))
import decks  # noqa: E402  the path is set above
import service  # noqa: E402
from two_bodies import body  # noqa: E402

# Edges of a brick with nodes amid, in their order.
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
STIFF = 10000  # contact of CalculiX's own decks, in E for the length of the shortest side
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


def fit(n, kind="hex8"):
    """A quarter of a press fit with n facets on the shaft."""
    def ring(inner, outer):
        return lambda x, y, z: ((inner + (outer - inner) * x) * math.cos(math.pi / 2 * y),
                                (inner + (outer - inner) * x) * math.sin(math.pi / 2 * y), 2 * z)
    both = {f"{axis}{end}": [(0, f"{axis}{end}"), (1, f"{axis}{end}")] for axis in "yz" for end in "01"}
    return body([kind, kind], [(n // 3, n, 2), (n // 3, n * 11 // 15, 3)], [ring(10, 20.02), ring(20, 40)],
                {"high": [(0, "x1")], "low": [(1, "x0")], **both}, model="solid",
                materials=[{"on": "all", "young": 210000, "poisson": 0.3}],
                supports=[{"on": "y0", "uy": 0}, {"on": "y1", "ux": 0}, {"on": "z0", "uz": 0}],
                contacts=[{"on": "high", "with": "low"}])


def pushed(n):
    """Two squares of 10 mm on each other, pushed together from above and pressed from both sides: the first example of
    S. Hueeber's thesis (Stuttgart, 2008), which CalculiX has too, in plane strain; n and n + n / 6 cells along a side."""
    size, cells = 0.01, [(n, 1, n), (n + n // 6, 1, n + n // 6)]
    request = body(["hex8", "hex8"], cells, [lambda x, y, z: (size * x, 1e-3 * y, size * z), lambda x, y, z: (size * x, 1e-3 * y, size * (1 + z))],
                   {"low": [(0, "z1")], "high": [(1, "z0")], "base": [(0, "z0")], "head": [(1, "z1")], "left": [(0, "x0")], "right": [(0, "x1")],
                    "thin": [(0, "y0"), (1, "y0"), (0, "y1"), (1, "y1")]}, model="solid", materials=[],
                   supports=[{"on": "thin", "uy": 0}, {"on": "base", "ux": 0, "uz": 0}, {"on": "head", "ux": 0, "uz": -5e-7}],
                   contacts=[{"on": "high", "with": "low"}])
    problem = request["problem"]
    groups, loads = problem["mesh"]["groups"], {}
    for side, sign in (("left", 1), ("right", -1)):
        for face in groups[side]["faces"]:
            for k in face:
                force = loads.setdefault(k, [0, 0, 0])
                force[0] += sign * 1e5 * size / n * 1e-3 / 4
                force[2] -= 1e6 * size / n * 1e-3 / 4
    problem["loads"] = [{"node": k, "force": force} for k, force in sorted(loads.items())]
    groups.update(lower={"elements": list(range(n * n))}, upper={"elements": list(range(n * n, n * n + cells[1][0] ** 2))})
    problem["materials"] = [{"on": "lower", "young": 15e9, "poisson": 0.2}, {"on": "upper", "young": 20e9, "poisson": 0.4}]
    return request


def deck(scene, discretization, contact_stiffness=100):
    """The scene as CalculiX reads it: one kind of brick, supports along axes, one contact, of so many E for the length of a side,
    forces at nodes."""
    mesh, contact = scene["mesh"], scene["contacts"][0]
    kind, cells = next(iter(mesh["elements"].items()))
    stiff, side = max(m["young"] for m in scene["materials"]), min(math.dist(mesh["nodes"][e[0]], mesh["nodes"][e[1]]) for e in cells)
    lines = ["*NODE, NSET=ALL"] + [f"{k + 1}, " + ", ".join(f"{t:.15g}" for t in x) for k, x in enumerate(mesh["nodes"])]
    lines += [f"*ELEMENT, TYPE=C3D{kind[3:]}, ELSET=ALL"]
    for k, e in enumerate(cells):
        fields = [str(i + 1) for i in [k, *e]]
        lines += [", ".join(fields[first:first + 11]) + ("," if first + 11 < len(fields) else "") for first in range(0, len(fields), 11)]
    owner = {frozenset(e[c] for c in face): (k + 1, s + 1) for k, e in enumerate(cells) for s, face in enumerate(decks.SIDES[3])}
    for name in (contact["on"], contact["with"]):
        lines += [f"*SURFACE, NAME={name.upper()}, TYPE=ELEMENT"]
        lines += ["{}, S{}".format(*owner[frozenset(face[:4])]) for face in mesh["groups"][name]["faces"]]
    for k, material in enumerate(scene["materials"]):
        members = mesh["groups"].get(material["on"], {"elements": range(len(cells))})["elements"]
        lines += [f"*ELSET, ELSET=M{k}"] + [str(e + 1) for e in members] + [
            f"*MATERIAL, NAME=M{k}", "*ELASTIC", f"{material['young']}, {material['poisson']}", f"*SOLID SECTION, ELSET=M{k}, MATERIAL=M{k}"]
    lines += ["*SURFACE INTERACTION, NAME=I", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{contact_stiffness * stiff / side:.6g}, {1e-8 * stiff:.6g}",
              f"*CONTACT PAIR, INTERACTION=I, TYPE={KINDS[discretization]}", f"{contact['on'].upper()}, {contact['with'].upper()}",
              "*STEP", "*STATIC", "1., 1.", "*BOUNDARY"]
    # a face is told by its corners; what is held on it are all nodes of its elements there
    ends = {frozenset((e[a], e[b])): e[8 + q] for e in cells if kind == "hex20" for q, (a, b) in enumerate(EDGES)}
    for support in scene["supports"]:
        nodes = {k for face in mesh["groups"][support["on"]]["faces"] for k in face}
        nodes |= {ends[pair] for face in mesh["groups"][support["on"]]["faces"] for pair in map(frozenset, zip(face, face[1:] + face[:1])) if pair in ends}
        for dof, key in enumerate(("ux", "uy", "uz"), 1):
            lines += [f"{k + 1}, {dof}, {dof}, {support[key]}" for k in sorted(nodes) if key in support]
    if scene.get("loads"):
        lines += ["*CLOAD"] + [f"{one['node'] + 1}, {d + 1}, {f:.15g}" for one in scene["loads"] for d, f in enumerate(one["force"]) if f]
    lines += ["*NODE PRINT, NSET=ALL", "U, RF", "*END STEP"]
    return "\n".join(lines) + "\n"


def by_calculix(text, limited=None):
    """(what it prints, or None where it fails; seconds of processor). limited: what its process does before it begins."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "job.inp").write_text(text, encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, text=True, timeout=1200, check=False,
                              preexec_fn=limited, env={"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"})
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        printed = (path / "job.dat").read_text(encoding="utf-8") if (path / "job.dat").exists() else ""
    return (printed if done.returncode == 0 and decks.printed(printed) else None), seconds


def force_on_slave(scene, printed):
    """What supports do to a body, loads and the contact undo."""
    mesh, second, seen = scene["mesh"], 0, -1  # second: the first node of the second body
    for element in next(iter(mesh["elements"].values())):
        second = min(element) if min(element) > seen >= 0 else second
        seen = max(seen, *element)
    mine = min(mesh["groups"][scene["contacts"][0]["on"]]["faces"][0]) >= second
    force = [0.0] * 3
    for line in printed.rsplit("forces (fx,fy,fz)", 1)[1].splitlines()[1:]:
        fields = line.split()
        if len(fields) == 4 and (int(fields[0]) > second) == mine:
            force = [f - float(t) for f, t in zip(force, fields[1:])]
    return force  # of bodies with loads, those are among what CalculiX prints


def by_daemon(build, request, discretization):
    """The answer of a new daemon, and its seconds of processor."""
    s = service.Service(build)
    try:
        s.start()
        problem = {**request["problem"], "contacts": [{**one, "discretization": discretization} for one in request["problem"]["contacts"]]}
        before = s.settle()
        job = s.solve({"problem": problem})
        seconds = s.spent() - before
        if job["status"] != "successful" or job["summary"]["outcome"] != "converged":
            raise decks.Unsaid(job.get("error", {}).get("detail") or job["summary"]["outcome"])
        return s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json, seconds
    finally:
        s.stop()


def row_of(build, name, request, discretization, text, numbers=None):
    """One problem by both. numbers: the deck's of our nodes."""
    ours, our_s = by_daemon(build, request, discretization)
    printed, their_s = by_calculix(text)
    row = {"problem": name, "contact": discretization, "unknowns": ours["summary"]["problem"]["d"], "calculix": None, "apart": None,
           "ours": (ours["summary"]["resultants"]["contacts"] or [{"force": None}])[0]["force"], "calculix_s": their_s, "ours_s": our_s}
    place = {number: k for k, number in enumerate(numbers or range(1, len(ours["displacements"]) + 1))}

    def apart(printed):
        both = [(u, ours["displacements"][place[k]]) for k, u in decks.printed(printed).items() if k in place]
        return max(abs(a - b) for u, v in both for a, b in zip(u, v)) / max(abs(a) for u, _ in both for a in u)
    if printed:
        row["apart"] = apart(printed)
        row["calculix"] = None if numbers else force_on_slave(request["problem"], printed)
    shown = ["-" if f is None else " ".join(f"{t + 0.0:.5g}" if abs(t) > 1e-6 * max(map(abs, f)) else "0" for t in f) for f in (row["calculix"], row["ours"])]
    stiff = numbers and request["problem"]["contacts"] and by_calculix(decks.stiffened(text, request, STIFF))[0]
    row["apart_stiff"] = apart(stiff) if stiff else None
    told = " ".join(f"{'-' if row[key] is None else format(row[key], '.2g'):>8s}" for key in ("apart", "apart_stiff"))
    print(f"{name:22s} {discretization:9s} {shown[0]:>28s} {shown[1]:>28s} {told} {their_s:8.2f} {our_s:8.2f} {their_s / max(our_s, 0.01):7.1f}", flush=True)
    return row


def of_scenes(build):
    rows = []
    for name, make, sizes in (("block", block, (8, 16)), ("press fit", fit, (15, 30)), ("press fit, hex20", lambda n: fit(n, "hex20"), (15,)),
                              ("squares", pushed, (60,))):
        for size in sizes:
            request = make(size)
            for discretization in KINDS:
                rows.append(row_of(build, f"{name} {size}", request, discretization, deck(request["problem"], discretization)))
    return rows


def of_decks(build, folder):
    rows, unsaid, given = [], {}, list(decks.contact_decks(folder))
    reader = service.Service(build)
    reader.start()
    for name, text in given:
        try:
            request, numbers, left = decks.translate(reader, text)
            row = row_of(build, f"{name}.inp", request, "surfaces", decks.first_step(text, numbers), numbers)
            rows.append({**row, "ties": len(request["problem"].get("ties", [])), "left": left})
        except (decks.Unsaid, subprocess.TimeoutExpired) as why:
            unsaid[name] = str(why)
    reader.stop()
    print("\n".join(f"{name}.inp: {why}" for name, why in unsaid.items()))
    print(f"{len(given)} decks with contact or ties, {len(rows)} compared")
    return {"decks": len(given), "rows": rows, "unsaid": unsaid}


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    if not shutil.which("ccx"):
        sys.exit("ccx is not installed: make bench-deps")
    print(f"{'problem':22s} {'contact':9s} {'force, CalculiX':>28s} {'force, ours':>28s} {'apart':>8s} {'stiff':>8s} {'s':>8s} {'ours, s':>8s} {'ratio':>7s}")
    found = of_decks(sys.argv[1], sys.argv[3]) if len(sys.argv) > 3 else {"rows": of_scenes(sys.argv[1])}
    pathlib.Path(sys.argv[2]).write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main()
