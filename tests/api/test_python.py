"""The Python package as its users have it: from a wheel, with arrays, in a notebook, with every refusal."""
# not under ThreadSanitizer: it is about the client
import contextlib
import copy
import importlib.util
import io
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import service
from service import ENDLESS, MATRICES, ROOT, SCENE, Skip, check

SHARED = True  # one service for all tests

PACKAGE = ROOT / "client/python"
sys.dont_write_bytecode = True
sys.path.insert(0, str(PACKAGE))
try:
    import numpy as np
    import uzawa
except ImportError:
    np = uzawa = None


def client(s):
    if not np:
        raise Skip("numpy is not installed")
    return uzawa.Uzawa(s.url)


def test_arrays_go_in_and_come_out(s):
    request = copy.deepcopy(SCENE)
    request["problem"]["loads"][0]["traction"] = np.array([0, -0.05]) if np else None
    request["problem"]["mesh"]["box"]["cells"] = np.array([30, 10]) if np else None
    job = client(s).solve(request)
    check(job.converged and job.passed and job.outcome == "converged" and 0 < job.whole_error < 0.1, job)
    check(job["displacements"].shape == (31 * 11, 2) and job["pressure"].shape == (30,), job["displacements"].shape)
    check(job["displacements"].dtype == float and job.summary["contact"]["active"] == (job["reactions"] < 0).sum())
    check(job["pressure"].max() == job.summary["contact"]["max_pressure"], job["pressure"].max())
    rows = job.result("stress", "stress_gauss", "nodes")
    check(rows["components"] == ["xx", "yy", "zz", "xy"] and rows["stress"].shape == (31 * 11, 4) and rows["nodes"].shape == (31 * 11, 2), rows)
    check(rows["stress_gauss"]["points"].shape == (4 * 300, 2) and rows["stress_gauss"]["elements"].max() == 299, rows["stress_gauss"])
    history = job.history()
    check(len(history) == 12 and history["iteration"][-1] >= job.summary["iterations"] - 1, history["iteration"][-1])
    check((np.diff(history["iteration"]) > 0).all() and history["error_bound"][-1] < history["error_bound"][0], history)
    try:
        job["presure"]
    except uzawa.Refused as refused:
        check("presure" in str(refused), refused)
    else:
        check(False, "a field that no answer has")


def test_load_cases_have_arrays_of_their_own(s):
    loads = [{"on": "top", "traction": [0, -0.1]}]
    job = client(s).solve({**SCENE, "cases": [{"name": "none", "loads": []}, {"name": "twice", "loads": loads}]})
    none, twice = job.result("pressure", "displacements")["cases"]
    check(none["name"] == "none" and (none["pressure"] == 0).all() and twice["pressure"].max() > 0 and twice["case"] == "twice", none, twice)
    check((job.result("displacements", case="twice")["displacements"] == twice["displacements"]).all())
    check([one["summary"]["outcome"] for one in job.result()["cases"]] == ["converged"] * 2)


def test_matrices_of_numpy_and_of_scipy(s):
    K, p, N, h = [[2.0, 0], [0, 1]], [2.0, 2], [[1.0, 0]], [0.5]
    one = client(s).solve({"problem": uzawa.matrices(K, p, N, h)})
    check(np.allclose(one["displacements"], [0.5, 2]) and np.allclose(one["reactions"], [-1]), one["displacements"])
    text = client(s).solve(MATRICES)
    check((text["displacements"] == one["displacements"]).all(), text["displacements"])

    class Sparse:
        """What of a scipy matrix is used."""
        shape = (2, 2)
        row, col, data = np.array([0, 1]), np.array([0, 1]), np.array([2, 1])
        T = property(lambda self: self)

        def tocoo(self):
            return self

        def __sub__(self, other):
            return type("Zero", (), {"__abs__": lambda zero: zero, "nnz": 0})()

    check(uzawa.matrix_market(Sparse(), symmetric=True) == uzawa.matrix_market(np.array(K), symmetric=True))
    for wrong, says in ((lambda: uzawa.matrices([[1, 2], [3, 4]], p), "not symmetric"), (lambda: uzawa.matrices(K, p, N), "together"),
                        (lambda: uzawa.matrix_market([1, 2]), "two dimensions")):
        try:
            wrong()
        except ValueError as error:
            check(says in str(error), error)
        else:
            check(False, says)


def test_refusals_say_where(s):
    for request, pointer in (({"problem": {"kind": "nothing"}}, "/problem/kind"),
                             ({**SCENE, "problem": {**SCENE["problem"], "supports": []}}, "/problem/supports")):
        try:
            client(s).solve(request)
        except uzawa.Refused as refused:
            check(refused.problem["pointer"] == pointer and str(refused).count(f"{pointer} ") == 1, refused.problem)
        else:
            check(False, "taken", request)
    for request, says in (({"problem": object()}, "holds no object"), ({"problem": float("nan")}, "NaN")):
        try:
            client(s).submit(request)
        except (TypeError, ValueError) as error:
            check(says in str(error) or "JSON" in str(error), error)
        else:
            check(False, "sent", request)
    check(client(s).validate(SCENE)["valid"] is True)


def test_progress_and_dismissal(s):
    seen = []
    job = client(s).submit(ENDLESS)

    def look(data):
        seen.append(data)
        if len(seen) == 2:
            job.dismiss()
    job.wait(look)
    check(len(seen) >= 2 and job.outcome == "dismissed" and "dismissed" in repr(job), job)
    said = io.StringIO()
    with contextlib.redirect_stderr(said):
        check(client(s).solve(SCENE, progress=True).converged)
    check([one.id for one in client(s).jobs(limit=2)][1] == job.id and client(s).job(job.id).outcome == "dismissed")


def test_the_notebook_runs(s):
    """Cell by cell, as a kernel would run it; what a cell ends in is shown."""
    client(s)
    names, shown = {}, []
    environment = os.environ.get("UZAWA_SERVER")
    os.environ["UZAWA_SERVER"] = s.url
    try:
        for cell in json.loads((PACKAGE / "contact.ipynb").read_text())["cells"]:
            if cell["cell_type"] != "code":
                continue
            lines = "".join(cell["source"]).split("\n")
            last = next(i for i in range(len(lines) - 1, -1, -1) if lines[i] and not lines[i].startswith((" ", "]", "}")))
            exec("\n".join(lines[:last]), names)
            try:
                shown.append(eval("\n".join(lines[last:]), names))
            except SyntaxError:
                exec("\n".join(lines[last:]), names)
    finally:
        os.environ.pop("UZAWA_SERVER")
        if environment:
            os.environ["UZAWA_SERVER"] = environment
    job, (shape, largest, error), forces, (u, r) = shown
    page = job._repr_html_()
    check(page.startswith("<table>") and "converged, whole error" in page and "<svg" in page and "</svg>" in page, page[:300])
    check(shape == (341, 2) and largest > 0 and error < 0.1 and (np.diff(forces) > 0).all(), forces)
    check(np.allclose(u, [0.5, 0.75, 1.75]) and np.allclose(r, [-0.75, 0]) or (r <= 0).all(), u, r)


def test_the_wheel_is_whole(s):
    """Built from the sources, and used where nothing of the checkout is in reach."""
    client(s)
    if not all(importlib.util.find_spec(name) for name in ("pip", "setuptools", "wheel")):
        raise Skip("pip, setuptools and wheel are not installed")
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["make", "-s", "-C", str(ROOT), "wheel", f"BUILD={folder}", f"PYTHON={sys.executable}"],
                              capture_output=True, text=True, timeout=180)
        wheels = list((pathlib.Path(folder) / "python").glob("uzawa-*-py3-none-any.whl"))
        check(done.returncode == 0 and len(wheels) == 1, done.stdout, done.stderr)
        program = ("import uzawa, sys; job = uzawa.Uzawa().solve({'problem': uzawa.matrices([[2.0]], [2.0], [[1.0]], [0.5])});"
                   "assert '.whl' in uzawa.__file__; print(job.outcome, job['reactions'], uzawa.__version__)")
        ran = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, timeout=60, cwd=folder,
                             env={**os.environ, "PYTHONPATH": str(wheels[0]), "UZAWA_SERVER": s.url})
        check(ran.returncode == 0 and ran.stdout.split()[0] == "converged", ran.stdout, ran.stderr)
        check(not shutil.which("git") or subprocess.run(["git", "-C", str(ROOT), "status", "--porcelain", "client/python"],
                                                        capture_output=True, text=True).stdout.find("egg-info") < 0)


service.main(globals())
