"""Contact between surfaces through every method, form of the dual operator and way to ask: each answer is certified and is the
default's within its bound. usage: test_contact_core.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import base64
import itertools
import math
import re
import struct
import zlib

import service
from service import check, expect, some
from two_bodies import body

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=120"}
METHODS = ["uzawa", "accelerated", "accelerated_restart", "conjugate", "active_set", "dual_active_set"]
OPERATORS = ["condensed", "factored", "matrix_free"]
CORNERS = {"tri6": 3, "quad8": 4, "tet10": 4, "hex20": 8}
EXACT = ["auto", "active_set", "dual_active_set"]


def blocks(kinds, pushed, model="plane_strain"):
    """A narrow block on a wide one: pressed by a load that only the contact carries, or pushed down with an open part."""
    solid = model == "solid"
    names = ("x0", "z0", "z1") if solid else ("left", "bottom", "top")

    def low(x, *y):
        return (4 * x, *y[:-1], y[-1] - 1)

    def high(x, *y):
        return (0.5 + 2.5 * x, *y[:-1], (0.02 * x if pushed else 0) + y[-1] * (1 - 0.02 * x * pushed))
    groups = {"low": [(0, names[2])], "high": [(1, names[1])], "left": [(0, names[0]), (1, names[0])],
              "base": [(0, names[1])], "head": [(1, names[2])]}
    up = "uz" if solid else "uy"
    supports = [{"on": "left", "ux": 0}, {"on": "base", up: 0}]
    if solid:
        groups["front"] = [(0, "y0"), (1, "y0")]
        supports.append({"on": "front", "uy": 0})
    loads = [] if pushed else [{"on": "head", "pressure": 1}]
    if pushed:
        supports.append({"on": "head", up: -0.015})
    cells = [(4, 2, 1), (3, 2, 1)] if solid else [(8, 2), (5, 2)]
    return body(kinds, cells, [low, high], groups, model=model, materials=[{"on": "all", "young": 100, "poisson": 0.3}],
                supports=supports, loads=loads, contacts=[{"on": "low", "with": "high"}])


def fit(kinds):
    """A press fit, all of which touches."""
    def ring(inner, outer):
        return lambda x, y: ((inner + (outer - inner) * x) * math.cos(math.pi / 2 * y),
                             (inner + (outer - inner) * x) * math.sin(math.pi / 2 * y))
    return body(kinds, [(2, 11), (2, 9)], [ring(10, 20.02), ring(20, 40)],
                {"low": [(0, "right")], "high": [(1, "left")], "x": [(0, "bottom"), (1, "bottom")],
                 "y": [(0, "top"), (1, "top")]}, model="plane_stress",
                materials=[{"on": "all", "young": 1000, "poisson": 0.3}],
                supports=[{"on": "x", "uy": 0}, {"on": "y", "ux": 0}], contacts=[{"on": "low", "with": "high"}])


SCENES = {"open part": blocks(["quad4", "tri6"], True), "press fit": fit(["quad8", "quad4"]),
          "rings": blocks(["tri3", "quad8"], True, "axisymmetric"), "space": blocks(["hex20", "tet10"], True, "solid"),
          "loose": blocks(["quad8", "tri3"], False), "loose in space": blocks(["tet4", "hex8"], False, "solid")}


def scenes(first):
    """All; with a sanitizer a third of them, another one for each `first` of 0 to 2."""
    return list(SCENES.items())[first::3] if service.INSTRUMENTED else SCENES.items()


def answer_of(s, request, outcome="converged"):
    job = s.solved(request, outcome)
    return job, expect(s.get(f"/v1/jobs/{job['id']}/result?fields=reactions,displacements,pressure"), 200).json


def near(answer, known, *context):
    """Energies within what both certify, and forces alike."""
    for one in (answer["summary"], known["summary"]):
        check(one["certificate"]["absolute_error"] is not None, *context)
    bound = sum(x["summary"]["certificate"]["absolute_error"] ** 2 for x in (answer, known)) / 2
    energies = [x["summary"]["energy"]["primal"] for x in (answer, known)]
    check(abs(energies[0] - energies[1]) <= bound + 1e-10 * abs(known["summary"]["energy"]["strain"]), energies, bound, *context)
    sums = [sum(x["reactions"]) for x in (answer, known)]
    error = answer["summary"]["certificate"]["relative_error"]
    check(abs(sums[0] - sums[1]) <= (100 * error + 1e-7) * abs(sums[1]), sums, error, *context)


def test_all_methods_on_all_forms(s):
    known = {name: answer_of(s, request)[1] for name, request in SCENES.items()}
    for name, answer in known.items():
        part = answer["summary"]["contact"]["active"] < answer["summary"]["contact"]["candidates"]
        check(part or name == "press fit" or "loose" in name, name)
    for name, method, operator in some(itertools.product(SCENES, METHODS, OPERATORS), 11):
        solver = {"method": method, "operator": operator,
                  "accuracy": {"relative_error": 1e-6 if method in EXACT else 1e-3}}
        job = expect(s.post({**SCENES[name], "solver": solver}, WAIT), 200).json
        if job["summary"]["outcome"] == "precision_limit" and (method, operator) == ("active_set", "matrix_free"):
            # It refuses wide rows, and says so, where the body is too large to be solved in rational numbers.
            check("few rows" in job["summary"]["message"], job["summary"])
            continue
        _, answer = answer_of(s, {**SCENES[name], "solver": solver})
        near(answer, known[name], name, method, operator)


def test_loose_bodies_have_energies(s):
    """Also where rows penetrate by rounding: no motion is bounded by a K that is singular, but the answer's energy is."""
    for pressure, method in itertools.product((1, 0.37, 3.3), ("conjugate", "accelerated_restart")):
        request = blocks(["hex8", "tet4"], False, "solid")
        request["problem"]["loads"][0]["pressure"] = pressure
        _, answer = answer_of(s, {**request, "solver": {"method": method, "operator": "factored", "accuracy": {"relative_error": 1e-3}}})
        energy = answer["summary"]["energy"]
        check(energy["primal"] is not None and energy["dual"] <= energy["primal"] < 0, pressure, method, energy)


def test_all_row_scalings(s):
    for name, request in scenes(0):
        _, known = answer_of(s, request)
        for scaling, method in itertools.product(("auto", "none", "unit"), ("auto", "accelerated_restart")):
            _, answer = answer_of(s, {**request, "solver": {"row_scaling": scaling, "method": method}})
            near(answer, known, name, scaling, method)


def test_levels_and_candidates(s):
    for name, request in scenes(1):
        _, known = answer_of(s, request)
        for accuracy in ("quick", "balanced", "precise"):
            _, answer = answer_of(s, {**request, "solver": {"accuracy": accuracy}})
            near(answer, known, name, accuracy)
        _, answer = answer_of(s, {"problem": {**request["problem"], "candidates": "all"}})
        near(answer, known, name, "all candidates")


def test_load_cases(s):
    """Each case is what a job of its own would be; the body's factor serves all."""
    for name, request in scenes(2):
        problem = request["problem"]
        if not problem.get("loads"):
            continue
        heavy = [{**problem["loads"][0], "pressure": 3}]
        job = s.solved({**request, "cases": [{"name": "given", "loads": problem["loads"]}, {"name": "heavy", "loads": heavy}]})
        for case, loads in (("given", problem["loads"]), ("heavy", heavy)):
            answer = expect(s.get(f"/v1/jobs/{job['id']}/result?case={case}&fields=reactions,displacements,pressure"), 200).json
            near(answer, answer_of(s, {"problem": {**problem, "loads": loads}})[1], name, case)


def test_refined_and_verified(s):
    for name, request in scenes(0):
        _, known = answer_of(s, request)
        job, rough = answer_of(s, {**request, "solver": {"accuracy": "quick"}})
        reply = s.request("POST", f"/v1/jobs/{job['id']}/refine", {"accuracy": {"relative_error": 1e-7}},
                          {**WAIT, "Content-Type": "application/json"})
        better = expect(reply, 200).json
        check(better["summary"]["outcome"] == "converged", name, better)
        near(expect(s.get(f"/v1/jobs/{better['id']}/result?fields=reactions"), 200).json, known, name, "refined")
        given = {"problem": request["problem"], "solver": {"accuracy": {"relative_error": 1e-6}},
                 "answer": {key: known[key] for key in ("displacements", "reactions")}}
        verdict = s.request("POST", "/v1/verify", given, {**WAIT, "Content-Type": "application/json"})
        if "loose" in name:  # an answer from elsewhere is looked at only where supports hold the body
            expect(verdict, 422, "free_body")
            continue
        check(expect(verdict, 200).json["summary"]["outcome"] == "verified", name, verdict)
        given["answer"]["reactions"] = [1.01 * r for r in known["reactions"]]
        verdict = s.request("POST", "/v1/verify", given, {**WAIT, "Content-Type": "application/json"})
        check(expect(verdict, 200).json["summary"]["outcome"] == "not_verified", name, verdict)


def vtu_numbers(file, name):
    """An array of doubles of a .vtu file: three numbers and the sizes of its blocks, then the blocks."""
    text = re.search(rf'Name="{name}"[^>]*>([A-Za-z0-9+/=]+)<', file.decode()).group(1)
    count = struct.unpack("<Q", base64.b64decode(text[:12])[:8])[0]
    head = (3 + count) * 8 + 2  # in base64 three bytes are four characters
    sizes = struct.unpack(f"<{count}Q", base64.b64decode(text[:head // 3 * 4])[24:])
    packed, at, data = base64.b64decode(text[head // 3 * 4:]), 0, b""
    for size in sizes:
        data += zlib.decompress(packed[at:at + size])
        at += size
    return struct.unpack(f"<{len(data) // 8}d", data)


def test_pressure_on_both_sides(s):
    for name, request in scenes(1):
        mesh = request["problem"]["mesh"]
        job, _ = answer_of(s, request)
        rows = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=pressure"), 200).json["pressure"]
        at = vtu_numbers(expect(s.get(f"/v1/jobs/{job['id']}/result.vtu?fields=pressure"), 200).body, "pressure")
        check(len(at) == len(mesh["nodes"]) and max(at) == max(rows), name, max(at), max(rows))
        sides = {group: {node for side in sum(mesh["groups"][group].values(), []) for node in side} for group in ("low", "high")}
        # Groups name the corners of sides: of the nodes amid their edges nothing is known here.
        corners = {node for kind, of in mesh["elements"].items() for element in of for node in element[:CORNERS.get(kind)]}
        check(not any(at[node] for node in corners - sides["low"] - sides["high"]), name)
        for group, nodes in sides.items():
            pressed = [at[node] for node in nodes if at[node] > 0]
            check(len(pressed) >= (len(nodes) if name == "press fit" else 2), name, group, len(pressed), len(nodes))
            check(max(pressed) <= max(rows) * (1 + 1e-12), name, group, max(pressed))
            check(name != "press fit" or min(pressed) >= min(rows) * (1 - 1e-12), group, pressed)
        picture = expect(s.get(f"/v1/jobs/{job['id']}/deformed.svg?colour=pressure"), 200).body
        told = re.search(rb">contact pressure: [^<]* to ([^<]*)<", picture)
        check(told and abs(float(told[1]) / max(rows) - 1) < 0.005, name, told, max(rows))


def test_pictures_and_fields(s):
    for name, request in scenes(2):
        job, answer = answer_of(s, request)
        result = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions,gaps,pressure,stress"), 200).json
        check(len(result["pressure"]) == len(result["gaps"]) == len(result["contact_nodes"]), name)
        check(max(result["pressure"]) == answer["summary"]["contact"]["max_pressure"], name)
        for path in ("deformed.svg", "convergence.svg", "result.vtu"):
            reply = expect(s.get(f"/v1/jobs/{job['id']}/{path}"), 200)
            check(len(reply.body) > 500 and b">nan" not in reply.body and b'"nan' not in reply.body and b" nan" not in reply.body, name, path)


if __name__ == "__main__":
    service.main(globals())
