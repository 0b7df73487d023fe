"""Parts from CAD programs, of which gmsh makes a mesh.
usage: test_client_cad.py BUILD_DIR [FILTER]"""
# not under sanitizers: gmsh is a program of others, and what is done with its mesh is tested elsewhere
import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import Skip, check

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
LENGTH, E, STRESS = 20.0, 1000.0, 2.0
BLOCK = f'SetFactory("OpenCASCADE"); Box(1) = {{0, 0, 0, {LENGTH}, 10, 5}};'
DRILLED = BLOCK + (' Cylinder(2) = {10, 5, 0, 0, 0, 5, 2};'
                   ' BooleanDifference{ Volume{1}; Delete; }{ Volume{2}; Delete; }')


def scene(on):
    """A bar that is pulled along x, and becomes thinner under a plane at its top; on: its six faces, two of each axis."""
    return {"problem": {"kind": "scene", "model": "solid", "mesh": {},
                        "materials": [{"on": "body1", "young": E, "poisson": 0.25}],
                        "supports": [{"on": on[0], "ux": 0}, {"on": on[2], "uy": 0}, {"on": on[4], "uz": 0}],
                        "loads": [{"on": on[1], "traction": [STRESS, 0, 0]}],
                        "contacts": [{"on": on[5], "obstacle": {"plane": {"point": [0, 0, 5], "normal": [0, 0, -1]}}}]}}


FACES = [f"face{i}" for i in range(1, 7)]
DRILLED_FACES = ["face1", "face6", "face2", "face4", "face5", "face3"]


@contextlib.contextmanager
def folder():
    """An empty one, in which temporary folders are made too, and none is left."""
    with tempfile.TemporaryDirectory() as name:
        yield pathlib.Path(name)
        check(not list(pathlib.Path(name).glob("uzawa-*")), "a temporary folder was left")


def part(to, geometry, name="part.step"):
    if not shutil.which("gmsh"):
        raise Skip("gmsh is not installed")
    (to / "make.geo").write_text(geometry + "\n")
    subprocess.run(["gmsh", "-0", "make.geo", "-o", "part.step", "-v", "1"], cwd=to, check=True, capture_output=True)
    (to / "part.step").rename(to / name)
    return str(to / name)


def submit(url, *words, code=0, path=None, within=None):
    environment = {**os.environ, **({"PATH": str(path)} if path else {}), **({"TMPDIR": str(within)} if within else {})}
    done = subprocess.run([os.path.abspath(CLIENT), "--server", url, "submit", *words], capture_output=True, text=True,
                          timeout=90, env=environment)
    check(done.returncode == code, f"{words}: exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}")
    return done


def longest(server, job):
    """The largest displacement along x."""
    nodes = server.get(f"/v1/jobs/{job}/result?fields=displacements").json["displacements"]
    return max(u[0] for u in nodes)


def test_a_part_is_pulled(server):
    with folder() as here:
        path = part(here, BLOCK, name='a "drawn" part.STEP')
        (here / "scene.json").write_text(json.dumps(scene(FACES)))
        done = submit(server.url, str(here / "scene.json"), "--mesh", path, "--size", "4", "--wait", "--json",
                      within=here)
        check("face2: x 20, y 0 to 10, z 0 to 5" in done.stderr, done.stderr)
        job = json.loads(done.stdout)
        check(job["summary"]["outcome"] == "converged", job)
        check(abs(longest(server, job["id"]) / (STRESS / E * LENGTH) - 1) < 1e-9, longest(server, job["id"]))


def test_the_scene_of_a_part_comes_by_set(server):
    with folder() as here:
        path = part(here, BLOCK)
        words = [f"--set={key}={json.dumps(value)}" for key, value in scene(FACES)["problem"].items()
                 if key not in ("kind", "model", "mesh")]
        done = submit(server.url, path, "--size", "4", *words, "--wait", "--json", "--name", "bar", within=here)
        check(json.loads(done.stdout)["summary"]["outcome"] == "converged", done.stdout)
        check("materials" in submit(server.url, path, "--size", "4", within=here, code=4).stderr, "none was missed")


def test_middle_nodes_are_on_the_part(server):
    """Six sides around a hole of radius 2 would be off by a quarter of it; quadratic ones have it to a thousandth."""
    with folder() as here:
        path = part(here, DRILLED)
        (here / "scene.json").write_text(json.dumps(scene(DRILLED_FACES)))
        done = submit(server.url, str(here / "scene.json"), "--mesh", path, "--size", "4", "--wait", "--json",
                      within=here)
        check("face7: x 8 to 12, y 3 to 7, z 0 to 5" in done.stderr, done.stderr)
        job = json.loads(done.stdout)
        nodes = server.get(f"/v1/jobs/{job['id']}/result?fields=nodes").json["nodes"]
        away = [((x - 10) ** 2 + (y - 5) ** 2) ** 0.5 for x, y, _ in nodes]
        around = sum(abs(r - 2) < 1e-6 for r in away)
        check(job["summary"]["outcome"] == "converged" and min(away) > 2 - 1e-6 and around >= 48, (min(away), around))


def test_what_goes_wrong_is_told(server):
    with folder() as here:
        (here / "bad.step").write_text("no part")
        (here / "scene.json").write_text(json.dumps(scene(FACES)))
        bad, known = str(here / "bad.step"), str(here / "scene.json")

        def says(part_of, *words, code=11, path=None):
            said = submit(server.url, *words, code=code, path=path, within=here).stderr
            check(part_of in said, said)
        says("wants --size", bad, code=2)
        says("wants --size", known, "--mesh", bad, "--size", "0", code=2)
        says("--size is of a part", known, "--size", "1", code=2)
        says("leave --mesh out", bad, "--mesh", bad, "--size", "1", code=2)
        says("cannot read", str(here / "none.step"), "--size", "1")
        says("Debian: gmsh", bad, "--size", "1", path=here / "empty")
        for signal, why in (("XCPU", "processor time"), ("ABRT", "want of memory")):
            (here / "gmsh").write_text(f"#!/bin/sh\nkill -{signal} $$\n")
            (here / "gmsh").chmod(0o755)
            says(why, bad, "--size", "1", path=f"{here}:/bin")
        if shutil.which("gmsh"):
            says("gmsh made no mesh of", bad, "--size", "1")


if __name__ == "__main__":
    service.main(globals())
