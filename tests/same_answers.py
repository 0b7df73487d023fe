"""Whether two builds give the same answers, bit for bit: usage: same_answers.py OLD_BUILD NEW_BUILD [derived=TOLERANCE] [FILTER...].

Posts every request of the gallery and of tests/data, the paper's reference table by method and form of the operator, and a
scene of each kind of element to a daemon of each build, and compares everything that is answered but times, names and
what is measured: summaries, reactions, gaps, all fields, histories, VTU files and drawings. Prints a line for each that
differs, and counts; the status is 0 where none does. FILTER: only the requests whose name contains it. With TOLERANCE
stresses and strains, which follow from the displacements, may differ by that part of their field's largest number."""
import copy
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "api"))
tolerance = max([float(one[8:]) for one in sys.argv[3:] if one.startswith("derived=")], default=0.0)
filters = [one for one in sys.argv[3:] if not one.startswith("derived=")]
import service  # noqa: E402

service.jsonschema = None  # what is answered is compared, not judged

ROOT = service.ROOT
DERIVED = ("stress", "principal", "von_mises", "strain", "stress_gauss")
FIELDS = "displacements,reactions,gaps,pressure,contact_status,nodes"
# Of one run only: times, names, and what follows from memory's size or from times.
VOLATILE = re.compile(r"^(id|job|links|created|started|finished|timings_s|seconds|.*_s|cost|trade|bytes|suggestion|rate|at)$")


def kept(value):
    """Without what is of one run only."""
    if isinstance(value, dict):
        return {key: kept(item) for key, item in value.items() if not VOLATILE.match(key)}
    return [kept(item) for item in value] if isinstance(value, list) else value


def elements():
    """A body of each kind of element on a plane, in each model it is for, pressed on an obstacle and with a temperature."""
    for element in ("tri3", "quad4", "tri6", "quad8"):
        for model in ("plane_stress", "plane_strain", "axisymmetric"):
            scene = copy.deepcopy(service.SCENE["problem"])
            scene["mesh"]["box"].update(cells=[12, 4], element=element, grading=[1.3, 1])
            scene["model"] = model
            if model == "axisymmetric":
                scene["mesh"]["box"]["origin"] = [1, 0]
            if model != "plane_stress":
                scene.pop("thickness")
            scene["loads"].append({"on": "all", "temperature": 3})
            scene["materials"][0]["expansion"] = 1e-6
            yield f"{element}.{model}", scene
    for element in ("tet4", "hex8", "tet10"):
        for poisson in (0.3, 0.49):
            yield f"{element}.{poisson}", {
                "kind": "scene", "model": "solid",
                "mesh": {"box": {"size": [4, 2, 3], "cells": [4, 2, 3], "element": element}},
                "materials": [{"on": "all", "young": 1000, "poisson": poisson}],
                "supports": [{"on": "left", "ux": 0, "uy": 0, "uz": 0}],
                "loads": [{"on": "top", "pressure": 2}, {"on": "right", "traction": [1, -2, 0.5]}],
                "contacts": [{"on": "bottom", "obstacle": {"sphere": {"center": [2.2, -20, 1], "radius": 20}}}]}
    for formulation in ("standard", "bbar", "incompatible_modes"):
        scene = copy.deepcopy(service.SCENE["problem"])
        scene["formulation"] = formulation
        yield f"formulation.{formulation}", scene


def requests():
    """(name, request), each a body for POST /v1/jobs."""
    for folder in ("client/examples/gallery", "tests/data"):
        for path in sorted((ROOT / folder).glob("*.json")):
            body = json.loads(path.read_text())
            if isinstance(body, dict) and "problem" in body:
                body.pop("answer", None)
                yield path.stem, {key: value for key, value in body.items()
                                  if key in ("problem", "solver", "cases", "tags", "assert")}
    for one in json.loads((ROOT / "tests/data/requests.json").read_text()):
        yield f"requests.{one['name']}", one["body"]
    for folder in sorted((ROOT / "tests/data/qp").iterdir()):
        if folder.is_dir():
            problem = {"kind": "matrices", **{name: (folder / f"{name}.mtx").read_text() for name in "KNhp"}}
            for accuracy in (1e-3, 1e-8):
                yield f"{folder.name}.{accuracy}", {"problem": problem, "solver": {"accuracy": {"relative_error": accuracy}}}
    for cells in ([30, 10], [60, 20], [120, 40]):
        scene = copy.deepcopy(service.SCENE["problem"])
        scene["mesh"]["box"]["cells"] = cells
        for method in ("auto", "uzawa", "accelerated", "accelerated_restart", "active_set", "conjugate"):
            if method == "uzawa" and cells[0] > 30:
                continue
            for operator in ("auto", "condensed", "factored", "matrix_free"):
                if cells[0] > 60 and (operator != "auto" or method == "uzawa"):
                    continue
                yield f"paper.{cells[0]}.{method}.{operator}", {
                    "problem": scene, "solver": {"method": method, "operator": operator, "max_iterations": 3000,
                                                 "accuracy": {"relative_error": 1e-6}}}
        yield f"paper.{cells[0]}.rule", {"problem": scene, "solver": {"method": "accelerated_restart", "stopping": "paper",
                                                                      "epsilon": 1e-6}}
        yield f"paper.{cells[0]}.balanced", {"problem": scene, "solver": {"accuracy": "balanced"}}
    for name, scene in elements():
        yield f"element.{name}", {"problem": scene}
        if "force" not in name:
            yield f"element.{name}.cases", {"problem": scene, "cases": [
                {"name": f"c{k}", "loads": [{"on": "right", "traction": [0.1 * k] * (3 if scene["model"] == "solid" else 2)}]}
                for k in range(1, 11)]}


def answer(s, name, body):
    """Everything that is answered to a request, but for what is of one run only: a list of (what, value)."""
    posted = s.post(json.dumps(body).encode(), {"Prefer": "wait=60", "Content-Type": "application/json"})
    if posted.status not in (200, 202):
        return [("refusal", kept(posted.json or {}))]
    job = posted.json
    while job["status"] in ("accepted", "running"):
        job = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=60").json
    found, place = [("job", kept(job))], f"/v1/jobs/{job['id']}"
    if job["status"] != "successful":
        return found
    scene = body["problem"]["kind"] == "scene"
    fields = ",".join((FIELDS, *DERIVED)) if scene else "displacements,reactions,gaps"
    result = s.get(f"{place}/result?fields={fields}")
    assert result.status == 200, result  # two refusals would be alike
    found += split(kept(result.json))
    cases = [f"&case={one['name']}" for one in body.get("cases", [])][:1] or [""]
    history = s.get(f"{place}/history?{cases[0][1:]}", Accept="application/json").json
    if history and "rows" in history:
        at = history["columns"].index("seconds")
        found.append(("history", [row[:at] + row[at + 1:] for row in history["rows"]]))
    if scene:
        files = f"fields={FIELDS.removesuffix(',nodes')}" if tolerance else ""
        found.append(("vtu", s.get(f"{place}/result.vtu?{files}{cases[0]}").body))
        found.append(("picture", s.get(f"{place}/deformed.svg?{cases[0][1:]}").body))
    return found


def split(result):
    """The result without its derived fields, and these by themselves: [(what, value)]."""
    found = []
    for i, one in enumerate(result.get("cases", [result])):
        found += [(f"{name}.{i}", one.pop(name)) for name in DERIVED if name in one]
    return [("result", result), *found]


def numbers(value):
    """All numbers of a field, in order."""
    if isinstance(value, dict):
        value = [value[key] for key in sorted(value)]
    if isinstance(value, list):
        return [x for item in value for x in numbers(item)]
    return [value] if isinstance(value, (int, float)) else []


def apart(old, new):
    """How far two fields are apart, in parts of the largest number."""
    a, b = numbers(old), numbers(new)
    if len(a) != len(b):
        return float("inf")
    return max((abs(x - y) for x, y in zip(a, b)), default=0.0) / (max(map(abs, a), default=0.0) or 1.0)


def alike(old, new):
    """Two of (what, value), bit for bit or a derived field within the tolerance."""
    if old != new and old[0].split(".")[0] in DERIVED and tolerance:
        worst[0] = max(worst[0], apart(old[1], new[1]))
        return apart(old[1], new[1]) <= tolerance
    return old == new


worst = [0.0]


def where(old, new, path=""):
    """Where two values first differ."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(set(old) | set(new)):
            if key not in old or key not in new:
                return f"{path}/{key} is in one only"
            if found := where(old[key], new[key], f"{path}/{key}"):
                return found
        return ""
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        return next((found for i, pair in enumerate(zip(old, new)) if (found := where(*pair, f"{path}/{i}"))), "")
    return "" if json.dumps(old) == json.dumps(new) else f"{path}: {str(old)[:60]} and {str(new)[:60]}"


def main():
    builds = [service.Service(build, "--workers", "1").start() for build in sys.argv[1:3]]
    same = different = 0
    try:
        for name, body in requests():
            if filters and not any(part in name for part in filters):
                continue
            old, new = (answer(s, name, body) for s in builds)
            bad = [f"{a[0]}{where(a[1], b[1]) if not isinstance(a[1], bytes) else ''}" for a, b in zip(old, new) if not alike(a, b)]
            if bad or len(old) != len(new):
                different += 1
                print(f"differs: {name}: {'; '.join(bad)}", flush=True)
            else:
                same += 1
    finally:
        for s in builds:
            s.stop()
    if filters and same + different == 0:
        print(f"no request's name contains any of {filters}")
    but = f", but for stresses and strains, {worst[0]:.2g} apart at most" if tolerance else ""
    print(f"{same} requests answered alike bit for bit{but}, {different} differently")
    return different > 0 or same == 0


if __name__ == "__main__":
    sys.exit(main())
