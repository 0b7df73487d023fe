"""Each wrong input has its own clear error and harms nothing else. usage: test_bad_input.py BUILD_DIR [FILTER]

After every refusal the daemon must be well: it answers /healthz and solves the springs, whose answer is known.
"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import json
import socket
import time

import service
from service import MATRICES, PATIENT_S, SCENE, check, expect, head_of, read_all

SHARED = True  # one service for all tests

BODY = json.dumps(MATRICES)
AS_JSON = {"Content-Type": "application/json"}
BANNER = "%%MatrixMarket matrix coordinate real "
NO_NORMALS = BANNER + "general\n0 2 0\n"


# ---------------------------------------------------------------- helpers

def matrices(**members):
    """The springs with other members; None takes one away."""
    request = copy.deepcopy(MATRICES)
    request["problem"].update(members)
    request["problem"] = {name: value for name, value in request["problem"].items() if value is not None}
    return request


def symmetric(size, *entries):
    return f"{BANNER}symmetric\n{size} {size} {len(entries)}\n" + "".join(entry + "\n" for entry in entries)


def scene(change, solver=None):
    request = copy.deepcopy(SCENE)
    change(request["problem"])
    if solver is not None:
        request["solver"] = solver
    return request


def is_well(s):
    check(expect(s.get("/healthz"), 200).json["status"] == "ok")
    job = s.solve(MATRICES)
    check(job["status"] == "successful" and abs(job["summary"]["energy"]["primal"] + 2.0 + 0.75) < 1e-9, job)
    reactions = s.get(f"/v1/jobs/{job['id']}/result?fields=reactions").json["reactions"]
    check(abs(reactions[0] + 1) < 1e-9, reactions)


def refused(s, body, status, code, pointer=None, line=None, says=()):
    """A refusal at the door: nothing is stored. body: dict, text or bytes."""
    before = sum(expect(s.get("/readyz"), 200).json["jobs"].values())
    body = body.encode() if isinstance(body, str) else body
    reply = expect(s.request("POST", "/v1/jobs", body, AS_JSON), status, code)
    what = (body if len(str(body)) < 600 else "a long body", reply)
    check(reply.json.get("pointer") == pointer, "pointer", pointer, what)
    check(line is None or reply.json["line"] == line, "line", line, what)
    for part in says:
        check(part in reply.json["detail"], part, what)
    check(sum(s.get("/readyz").json["jobs"].values()) == before, "a refused request was stored", what)
    is_well(s)
    return reply


def fails(s, request, code, pointer=None, says=()):
    """A job that was taken and then fails: what is wrong shows only in the matrices."""
    job = s.solve(request)
    check(job["status"] == "failed" and job["error"]["code"] == code and not job["summary"], request, job)
    check(job["error"].get("pointer") == pointer, pointer, job)
    for part in says:
        check(part in job["error"]["detail"], part, job)
    expect(s.get(f"/v1/jobs/{job['id']}/result"), 409, "job_failed")
    is_well(s)


def solved(s, request):
    job = s.solve(request)
    check(job["status"] == "successful" and job["summary"]["outcome"] == "converged", request, job)
    return job["summary"], s.get(f"/v1/jobs/{job['id']}/result?fields=displacements,reactions,gaps").json


# ---------------------------------------------------------------- numbers

def test_no_json_numbers(s):
    for token in ("NaN", "Infinity", "-Infinity", "nan", "inf", "+1", "0x1", ".5", "1.", "01", "1e", "--1", "1_0"):
        for body in (BODY.replace("[0.5]", f"[{token}]"), BODY.replace("[2, 2]", f"[2, {token}]"),
                     BODY[:-1] + ', "solver": {"alpha": ' + token + "}}"):
            refused(s, body, 400, "json_syntax", says=("Line 1, column",), line=1)
    refused(s, BODY.replace("[0.5]", "[" + "0.1, " * 20000 + "NaN]"), 400, "json_syntax", says=("'N'",))


def test_json_numbers_beyond_doubles(s):
    for token in ("1e999", "-1e999", "1e400000000000000000000", "1" + "0" * 400):
        refused(s, BODY.replace("[0.5]", f"[{token}]"), 422, "number_out_of_range", "/problem/h/0", says=("1.8e308",))
        refused(s, BODY[:-1] + ', "solver": {"alpha": ' + token + "}}", 422, "number_out_of_range", "/solver/alpha")
    refused(s, BODY.replace("[2, 2]", "[" + "0.1, " * 20000 + "1e999]"), 422, "number_out_of_range",
            "/problem/p/20000")
    text = json.dumps(SCENE).replace("[0.5, 0]", "[1e999, 0]")
    refused(s, text, 422, "number_out_of_range", "/problem/loads/1/traction/0")
    summary, _ = solved(s, json.loads(BODY.replace("[0.5]", "[1e-999]")))  # nothing is wrong with a tiny number
    check(summary["contact"]["active"] == 1, summary)


def test_not_finite_in_matrix_market(s):
    for word in ("nan", "NaN", "inf", "-inf", "+Inf", "Infinity", "1e999", "-1e999"):
        K = MATRICES["problem"]["K"].replace("2 2 1\n", f"2 2 {word}\n")
        N = MATRICES["problem"]["N"].replace("1 1 1\n", f"1 1 {word}\n")
        vector = "%%%%MatrixMarket matrix array real general\n%d 1\n" + word + "\n"
        refused(s, matrices(K=K), 422, "not_finite", "/problem/K", 4, (word,))
        refused(s, matrices(N=N), 422, "not_finite", "/problem/N", 3, (word,))
        refused(s, matrices(h=vector % 1), 422, "not_finite", "/problem/h", 3, (word,))
        refused(s, matrices(p=vector % 2 + "1\n"), 422, "not_finite", "/problem/p", 3, (word,))
    for word in ("0x10", "1d3", "1,5", "one"):
        K = MATRICES["problem"]["K"].replace("2 2 1\n", f"2 2 {word}\n")
        refused(s, matrices(K=K), 422, "matrix_market_syntax", "/problem/K", 4)


def test_huge_but_finite_numbers(s):
    """Products that overflow must not end as an answer that says converged."""
    for member, value in (("p", [1e308, 1e308]), ("h", [1e308]), ("p", [1e-320, 1e-320]), ("h", [-1e308]),
                          ("K", symmetric(2, "1 1 1e308", "2 2 1e308")),
                          ("K", symmetric(2, "1 1 1e-288", "2 2 1e-288")),
                          ("N", BANNER + "general\n1 2 1\n1 1 1e308\n"),
                          ("N", BANNER + "general\n1 2 1\n1 1 1e-308\n")):
        job = s.solve(matrices(**{member: value}))
        check(job["status"] in ("successful", "failed"), job)
        summary = job["summary"]
        if summary and summary["outcome"] == "converged":
            u = s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json["displacements"]
            check(all(value is not None for value in u), member, value, job)
            check(summary["certificate"]["relative_error"] is not None, member, value, job)
        is_well(s)


# ---------------------------------------------------------------- shapes

def test_stiffness_not_square(s):
    refused(s, matrices(K=BANNER + "general\n2 3 2\n1 1 1\n2 2 1\n"), 422, "size_mismatch", "/problem/K",
            says=("2 x 3, but a stiffness matrix is square",))
    refused(s, matrices(K=BANNER + "general\n3 2 2\n1 1 1\n2 2 1\n"), 422, "size_mismatch", "/problem/K")
    refused(s, matrices(K=BANNER + "symmetric\n2 3 2\n1 1 1\n2 2 1\n"), 422, "matrix_market_syntax", "/problem/K", 2)
    refused(s, matrices(K=BANNER + "general\n0 0 0\n", N=None, h=None, p=[]), 422, "size_mismatch", "/problem/K",
            says=("not empty",))


def test_stiffness_not_symmetric(s):
    refused(s, matrices(K=BANNER + "general\n2 2 3\n1 1 2\n1 2 1\n2 2 1\n"), 422, "not_symmetric", "/problem/K",
            says=("(2, 1)", "(1, 2)"))
    refused(s, matrices(K=BANNER + "general\n2 2 4\n1 1 2\n1 2 0.5\n2 1 0.5001\n2 2 1\n"), 422, "not_symmetric",
            "/problem/K", says=("0.500",))
    summary, _ = solved(s, matrices(K=BANNER + "general\n2 2 4\n1 1 2\n1 2 0.5\n2 1 0.50000000000000011\n2 2 1\n"))
    check(summary["problem"]["d"] == 2, summary)  # rounding is no asymmetry


def test_stiffness_not_positive_definite(s):
    solvers = ({}, {"operator": "factored"}, {"operator": "condensed", "method": "uzawa"})
    # The row of N reaches dof 0 only, and what is singular at dof 1 stays so.
    for entries in (("1 1 2", "2 2 -1"), ("1 1 2", "2 2 0"), ("1 1 2",), (), ("1 1 1", "2 1 2", "2 2 1"),
                    ("1 1 -1", "2 2 -1"), ("1 1 1", "2 1 1", "2 2 0.999999")):
        for solver in solvers:
            fails(s, {**matrices(K=symmetric(2, *entries)), "solver": solver}, "not_positive_definite", "/problem/K",
                  says=("K is ",))
    # Semidefinite, if somebody says so, and the row reaches its null vector (1, -1): the load must press it on.
    for corner in ("1", "0.9999999999999999"):
        K = symmetric(2, "1 1 1", "2 1 1", f"2 2 {corner}")
        for solver in solvers:
            fails(s, {**matrices(K=K, p=[3, 2]), "solver": solver}, "not_positive_definite", "/problem/K")
            solver = {**solver, "semidefinite": True}
            fails(s, {**matrices(K=K), "solver": solver}, "free_body", "/problem/K", says=("costs nothing", "dof 1"))
            fails(s, {**matrices(K=K, p=[1, 2]), "solver": solver}, "free_body", "/problem/p", says=("pushes", "dof 0"))
            summary, result = solved(s, {**matrices(K=K, p=[3, 2]), "solver": solver})
            check(summary["semicoercive"] == {"free_modes": 1, "rounds": summary["semicoercive"]["rounds"], "held": 1,
                                              "held_by_rows": [0]}, summary)
            check(abs(result["displacements"][1] - 1.5) < 1e-7 and abs(result["reactions"][0] + 1) < 1e-7, result)
    free = matrices(K=symmetric(1, "1 1 -4"), N=None, h=None, p=[1])
    fails(s, free, "not_positive_definite", "/problem/K", says=("dof 0",))
    fails(s, {**free, "problem": {**free["problem"], "K": symmetric(1, "1 1 0")}}, "not_positive_definite",
          "/problem/K")
    # No contact anywhere: the same refusal, and not a failure of the condensation.
    fails(s, matrices(K=symmetric(2, "1 1 1", "2 2 -1"), N=NO_NORMALS, h=[]), "not_positive_definite", "/problem/K")


def test_sizes_that_disagree(s):
    vector = "%%MatrixMarket matrix array real general\n{0} 1\n" + "1\n" * 7
    refused(s, matrices(N=BANNER + "general\n1 3 1\n1 1 1\n"), 422, "size_mismatch", "/problem/N",
            says=("1 x 3", "2 x 2"))
    refused(s, matrices(N=BANNER + "general\n1 1 1\n1 1 1\n"), 422, "size_mismatch", "/problem/N")
    refused(s, matrices(N=BANNER + "general\n2 1 1\n1 1 1\n"), 422, "size_mismatch", "/problem/N")  # its transpose
    for h in ([], [0.5, 1], [0.5] * 30000, vector.format(7)):
        refused(s, matrices(h=h), 422, "size_mismatch", "/problem/h", says=("N has 1 rows",))
    for p in ([], [1], [1, 2, 3], [0.5] * 30000, vector.format(7)):
        refused(s, matrices(p=p), 422, "size_mismatch", "/problem/p", says=("K is 2 x 2",))
    refused(s, matrices(h="%%MatrixMarket matrix array real general\n2 2\n1\n1\n1\n1\n"), 422, "size_mismatch",
            "/problem/h", 2, ("2 x 2",))
    refused(s, matrices(N=None), 422, "size_mismatch", "/problem/h")
    refused(s, matrices(h=None), 422, "missing_key", "/problem", says=('"h"',))


def test_no_contact_rows(s):
    """A plain linear solve, and nothing is paid for contact: no iteration."""
    for members in ({"N": None, "h": None}, {"N": None, "h": []}, {"N": NO_NORMALS, "h": []}):
        for solver in ({"method": "accelerated_restart"}, {"method": "uzawa", "operator": "factored"},
                       {"method": "accelerated", "operator": "condensed"}):
            summary, result = solved(s, {**matrices(**members), "solver": solver})
            check(max(abs(result["displacements"][0] - 1), abs(result["displacements"][1] - 2)) < 1e-14, result)
            check(result["reactions"] == [] and result["gaps"] == [], result)
            check(summary["contact"]["candidates"] == 0 and summary["contact"]["reaction_sum"] == 0, summary)
            check(summary["iterations"] == 0, solver, members, summary)


def test_no_contact_takes_no_iteration(s):
    """Where nothing can touch or nothing does, the method that is chosen by itself iterates no more than the others."""
    upward = [{"on": "right", "traction": [0, 0.5]}]
    for request in (matrices(N=None, h=None), matrices(h=[100]), scene(lambda problem: problem.pop("contacts"), {}),
                    scene(lambda problem: problem.update(loads=upward), {})):
        summary, _ = solved(s, request)
        check(summary["iterations"] == 0 and summary["contact"]["active"] == 0, request, summary)


def test_rows_without_entries(s):
    empty_row = BANNER + "general\n1 2 0\n"
    summary, result = solved(s, matrices(N=empty_row))
    check(result["reactions"] == [0] and result["gaps"] == [0.5] and summary["iterations"] == 0, result, summary)
    job = s.solve(matrices(N=empty_row, h=[-1]))
    check(job["summary"]["outcome"] == "infeasible" and job["summary"]["message"], job)


def test_one_unknown(s):
    K, N = symmetric(1, "1 1 4"), BANNER + "general\n1 1 1\n1 1 1\n"
    for operator in ("condensed", "factored", "auto"):
        for method in ("uzawa", "accelerated", "accelerated_restart", "conjugate", "auto"):
            request = {**matrices(K=K, N=N, h=[0.25], p=[2]), "solver": {"operator": operator, "method": method}}
            summary, result = solved(s, request)
            check(abs(result["displacements"][0] - 0.25) < 1e-9 and abs(result["reactions"][0] + 1) < 1e-7, result)
            check(abs(summary["energy"]["primal"] + 0.375) < 1e-9, summary)
    # The same place given many times: D has rank one.
    N = BANNER + "general\n4 1 4\n" + "".join(f"{row} 1 1\n" for row in range(1, 5))
    summary, result = solved(s, matrices(K=K, N=N, h=[0.25, 0.5, 0.25, 9], p=[2]))
    check(abs(sum(result["reactions"]) + 1) < 1e-7 and abs(result["displacements"][0] - 0.25) < 1e-9, result)


# ---------------------------------------------------------------- keys and types

BOX, PLANE = ("mesh", "box"), ("contacts", 0, "obstacle", "plane")


def inner(problem, path):
    for step in path:
        problem = problem[step]
    return problem


def changed(path, **members):
    return scene(lambda problem: inner(problem, path).update(members))


def without(path, name):
    return scene(lambda problem: inner(problem, path).pop(name))


def at(path, name=None):
    return "/".join(["/problem", *map(str, path), *([name] if name else [])])


def test_unknown_keys(s):
    refused(s, {**MATRICES, "solvr": {}}, 422, "unknown_key", "/solvr", says=('Did you mean "solver"?',))
    refused(s, {**MATRICES, "solver": {"methd": "uzawa"}}, 422, "unknown_key", "/solver/methd", says=('"method"?',))
    refused(s, {**MATRICES, "solver": {"accuracy": {"relative_eror": 1}}}, 422, "unknown_key",
            "/solver/accuracy/relative_eror", says=('"relative_error"?',))
    refused(s, matrices(k="x"), 422, "unknown_key", "/problem/k", says=('"K"?',))
    for path, key, meant in (((), "modle", "model"), ((), "materals", "materials"), (("mesh",), "bx", "box"),
                             (BOX, "sise", "size"), (BOX, "cell", "cells"), (("materials", 0), "yung", "young"),
                             (("supports", 0), "Ux", "ux"), (("loads", 0), "tration", "traction"),
                             (("contacts", 0), "obstcle", "obstacle"), (PLANE, "normals", "normal")):
        refused(s, changed(path, **{key: 1}), 422, "unknown_key", at(path, key), says=(f'Did you mean "{meant}"?',))
    reply = refused(s, changed((), zzzzzzzzzzzz=1), 422, "unknown_key", "/problem/zzzzzzzzzzzz")
    check("Did you mean" not in reply.json["detail"], reply)


def test_wrong_types(s):
    for wrong in (None, True, 1, "text", [1]):
        refused(s, {"problem": wrong}, 422, "wrong_type", "/problem")
        refused(s, {**MATRICES, "solver": wrong}, 422, "wrong_type", "/solver")
    for wrong in (None, True, {}, 1):
        refused(s, {**MATRICES, "tags": wrong}, 422, "wrong_type", "/tags")
    for wrong in (None, True, 1):
        refused(s, {"problem": {**MATRICES["problem"], "p": wrong}}, 422, "wrong_type", "/problem/p")
    for wrong in (None, True, [1], 1, {"x": 1}):
        reply = s.post({**MATRICES, "problem": {**MATRICES["problem"], "K": wrong}})
        check(expect(reply, 422).json["pointer"].startswith("/problem/K"), reply)
    for body in ("[]", "null", "1", '"problem"', "true"):
        refused(s, body, 422, "wrong_type", "")
    for path, name in (((), "model"), ((), "mesh"), ((), "thickness"), (BOX, "size"), (BOX, "cells"),
                       (("materials", 0), "young"), (("supports", 0), "ux"), (("loads", 0), "traction"),
                       (PLANE, "normal")):
        for wrong in (None, True, {}):
            if name == "mesh" and wrong == {}:
                continue
            refused(s, changed(path, **{name: wrong}), 422, "wrong_type", at(path, name))
    refused(s, matrices(h=[0.5, "x"]), 422, "wrong_type", "/problem/h/1")
    refused(s, changed(BOX, cells=[30, 10.5]), 422, "wrong_type", "/problem/mesh/box/cells/1", says=("10.5",))
    refused(s, changed(BOX, size=[60]), 422, "out_of_range", "/problem/mesh/box/size")
    refused(s, changed(PLANE, normal=[0, 0]), 422, "out_of_range", "/problem/contacts/0/obstacle/plane/normal")


def test_missing_keys(s):
    refused(s, {}, 422, "missing_key", "", says=('"problem"',))
    refused(s, {"problem": {}}, 422, "missing_key", "/problem", says=('"kind"',))
    for name in ("K", "p"):
        refused(s, matrices(**{name: None}), 422, "missing_key", "/problem", says=(f'"{name}"',))
    for path, name in (((), "kind"), ((), "model"), ((), "mesh"), ((), "materials"), (("mesh",), "box"), (BOX, "size"),
                       (BOX, "cells"), (("materials", 0), "poisson"), (("loads", 0), "traction"),
                       (("contacts", 0), "obstacle"), (PLANE, "point")):
        refused(s, without(path, name), 422, "missing_key", at(path), says=(f'"{name}"',))


def test_values_out_of_range(s):
    for path, name, wrong in (((), "thickness", 0), ((), "thickness", -5), (("materials", 0), "young", 0),
                              (("materials", 0), "poisson", 0.6), (("materials", 0), "poisson", -1)):
        refused(s, changed(path, **{name: wrong}), 422, "out_of_range", at(path, name))
    refused(s, changed(BOX, size=[0, 20]), 422, "out_of_range", "/problem/mesh/box/size/0")
    refused(s, changed(BOX, cells=[30, 0]), 422, "out_of_range", "/problem/mesh/box/cells/1")
    refused(s, changed((), model="plane_stres"), 422, "not_allowed", "/problem/model", says=('"plane_stress"?',))
    refused(s, changed(("loads", 0), on="topp"), 422, "not_allowed", "/problem/loads/0/on", says=('"top"?',))
    for solver, pointer in (({"alpha": 0}, "/solver/alpha"), ({"alpha": -1}, "/solver/alpha"),
                            ({"accuracy": {"relative_error": 0}}, "/solver/accuracy/relative_error"),
                            ({"accuracy": {"relative_error": 2}}, "/solver/accuracy/relative_error"),
                            ({"max_iterations": -1}, "/solver/max_iterations"),
                            ({"time_limit_s": 0}, "/solver/time_limit_s")):
        refused(s, {**MATRICES, "solver": solver}, 422, "out_of_range", pointer)
    refused(s, {**MATRICES, "solver": {"method": "newton"}}, 422, "not_allowed", "/solver/method")
    for cells in ([1000000, 1000000], [100000, 101]):
        reply = s.post(changed(BOX, cells=cells))
        check(reply.status == 422 and reply.json["pointer"].startswith("/problem/mesh/box"), reply)
    is_well(s)


def test_unsupported_body(s):
    both, rotation = ("translation along x", "translation along y"), "rotation"
    for supports, modes, beside in (([], (*both, rotation), both[:1]), ([{"on": "left", "ux": 0}], both[1:], ()),
                                    ([{"on": "bottom", "uy": 0}], both[:1], both[:1])):
        def change(problem, supports=supports):
            problem["supports"] = supports
        refused(s, scene(lambda problem, c=change: (c(problem), problem.pop("contacts"))), 422, "free_body", "/problem/supports", says=modes)
        if beside:  # the obstacle holds the others
            refused(s, scene(change), 422, "free_body", "/problem/supports", says=beside)
            continue
        summary, _ = solved(s, scene(change))
        check(summary["semicoercive"]["free_modes"] == 1 and summary["semicoercive"]["held"] > 0, summary)
        check(abs(summary["contact"]["force"][1] - 15) < 1e-4, summary)  # 60 x 5 x 0.05
        fails(s, scene(lambda problem, c=change: (c(problem), problem["loads"][0].update(traction=[0, 0.05]))),
              "free_body", "/problem/loads", says=("translation along +y",))
    job = s.solve(scene(lambda problem: problem.update(supports=[{"on": "bottom", "uy": 0}, {"on": "left", "ux": 0}],
                                                       contacts=[])))
    check(job["status"] == "successful", job)


def test_a_piece_that_hangs_on_a_node(s):
    """Two squares with one corner in common, two cubes with one and with an edge: the node is named, and what it leaves free."""
    square = {"kind": "scene", "model": "plane_strain", "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
              "mesh": {"nodes": [[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2]], "elements": {"quad4": [[0, 1, 2, 3], [2, 4, 5, 6]]},
                       "groups": {"base": {"edges": [[0, 1]]}, "up": {"edges": [[5, 6]]}, "piece": {"elements": [1]}}},
              "supports": [{"on": "base", "ux": 0, "uy": 0}], "loads": [{"on": "up", "pressure": 1}],
              "contacts": [{"on": "up", "obstacle": {"plane": {"point": [0, 3], "normal": [0, -1]}}}]}
    for operator in "auto", "matrix_free":
        fails(s, {"problem": square, "solver": {"operator": operator}}, "free_body", "/problem/mesh",
              says=("node 2 at (1, 1) alone", "up, piece", "rotation about (1, 1)", "all nodes of a side"))
    held = {**square, "supports": [*square["supports"], {"on": "up", "ux": 0}]}
    check(solved(s, {"problem": held})[0]["outcome"] == "converged")
    # of four elements each
    cells = [(i + k, j + k) for k in (0, 2) for j in (0, 1) for i in (0, 1)]
    around = [[(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in cells]
    places = sorted({place for corners in around for place in corners})
    quads = [[places.index(place) for place in corners] for corners in around]
    larger = {**square, "mesh": {"nodes": places, "elements": {"quad4": quads},
                                 "groups": {"base": {"edges": [quads[0][:2]]}, "up": {"edges": [quads[7][2:]]}, "piece": {"elements": [4, 5, 6, 7]}}}}
    joint = f"node {places.index((2, 2))} at (2, 2) alone"
    fails(s, {"problem": larger}, "free_body", "/problem/mesh", says=(joint, "up, piece)", "rotation about (2, 2)"))
    corners = [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    for at, says in (([1, 1, 1], ("node 6 at (1, 1, 1) alone", "every rotation about it")),
                     ([1, 0, 1], ("node 5 at (1, 0, 1), node 6 at (1, 1, 1) alone", "rotation about the axis through (1, 0.5, 1) along y"))):
        nodes, second = list(corners), []
        for corner in corners:
            place = [a + b for a, b in zip(corner, at)]
            if place not in nodes:
                nodes.append(place)
            second.append(nodes.index(place))
        cubes = {**square, "model": "solid", "contacts": [], "supports": [{"on": "base", "ux": 0, "uy": 0, "uz": 0}],
                 "mesh": {"nodes": nodes, "elements": {"hex8": [list(range(8)), second]},
                          "groups": {"base": {"faces": [[0, 1, 2, 3]]}, "up": {"faces": [second[4:]]}}}}
        fails(s, {"problem": cubes}, "free_body", "/problem/mesh", says=says)


# ---------------------------------------------------------------- texts

def test_truncated_matrix_market(s):
    """Cut anywhere it is refused with the line where it ends, but for the last line break."""
    for member in ("K", "N"):
        text = MATRICES["problem"][member]
        for cut in range(1, len(text) - 1):
            reply = s.post(matrices(**{member: text[:cut]}))
            lines = text[:cut].rstrip("\n").count("\n") + 1
            check(expect(reply, 422, "matrix_market_syntax").json["pointer"] == f"/problem/{member}", reply)
            check(reply.json["line"] == lines, repr(text[:cut]), reply)
        check(s.solve(matrices(**{member: text[:-1]}))["status"] == "successful", text[:-1])
    text = "%%MatrixMarket matrix array real general\n% comment\n2 1\n2\n2\n"
    for cut in range(1, len(text) - 1):
        reply = expect(s.post(matrices(p=text[:cut])), 422, "matrix_market_syntax")
        check(reply.json["line"] == text[:cut].rstrip("\n").count("\n") + 1, repr(text[:cut]), reply)
    is_well(s)


def test_surplus_in_matrix_market(s):
    refused(s, matrices(K=MATRICES["problem"]["K"] + "1 2 1\n"), 422, "matrix_market_syntax", "/problem/K", 5)
    refused(s, matrices(K=symmetric(2, "1 1 1", "1 1 1")), 422, "matrix_market_syntax", "/problem/K", 4, ("(1, 1)",))
    refused(s, matrices(K=symmetric(2, "1 1 1", "1 2 1")), 422, "matrix_market_syntax", "/problem/K", 4)
    refused(s, matrices(K=BANNER + "symmetric\n999999999 999999999 999999999\n1 1 1\n"), 422, "memory_limit",
            "/problem/K", 2)
    refused(s, matrices(K=BANNER + "symmetric\n2 2 99999999999999999999\n1 1 1\n"), 422, "matrix_market_syntax",
            "/problem/K", 2)


def test_nul_bytes(s):
    for body in (BODY.encode() + b"\0", b"\0" + BODY.encode(), BODY.replace("matrices", "matr\0ices").encode(),
                 BODY.replace("[0.5]", "[0.5\0]").encode(), BODY.replace("real", "re\0al").encode(), b"\0", b"[1\0]"):
        refused(s, body, 400, "json_syntax", says=("0x00",))
    refused(s, BODY.replace("matrices", "matrices\\u0000"), 422, "not_allowed", "/problem/kind")
    refused(s, BODY.replace("real symmetric", "real\\u0000symmetric"), 422, "matrix_market_syntax", "/problem/K", 1)
    refused(s, BODY.replace("1 1 2", "1 1 2\\u0000"), 422, "matrix_market_syntax", "/problem/K", 3)
    refused(s, BODY[:-1] + ', "tags": ["a\\u0000b"]}', 422, "not_allowed", "/tags/0")


def test_duplicate_keys(s):
    refused(s, BODY.replace('"h":', '"h": [1], "h":'), 422, "duplicate_key", "/problem/h")
    refused(s, BODY.replace('"h":', '"\\u0068": [1], "h":'), 422, "duplicate_key", "/problem/h")
    refused(s, BODY[:-1] + ', "problem": {}}', 422, "duplicate_key", "/problem")
    refused(s, BODY[:-1] + ', "solver": {"method": "uzawa", "method": "uzawa"}}', 422, "duplicate_key",
            "/solver/method")


def test_deep_and_wide_json(s):
    refused(s, "[" * 100000, 400, "json_depth", "/0" * 64, says=("64",))
    reply = s.request("POST", "/v1/jobs", b'{"problem":' * 50000, AS_JSON)
    check(expect(reply, 400, "json_depth").json["pointer"].startswith("/problem/problem"), reply)
    for body in ('{"problem": [' + "{}," * 2000000 + "{}]}", '{"problem": [' + '"a",' * 2000000 + '"a"]}',
                 "{" + ",".join(f'"k{i}": 1' for i in range(300000)) + "}"):
        reply = s.request("POST", "/v1/jobs", body.encode(), AS_JSON)
        check(reply.status in (400, 413, 422), reply)
        is_well(s)


def test_not_utf8(s):
    for bad in (b"\xff", b"\xc0\xaf", b"\xed\xa0\x80", b"\xf5\x80\x80\x80", b"\xe2\x82"):
        refused(s, BODY.replace("matrices", "matr#").encode().replace(b"#", bad), 400, "json_syntax")
        refused(s, BODY.replace("real", "re#").encode().replace(b"#", bad), 400, "json_syntax")


# ---------------------------------------------------------------- the request around the body

HEAD = b"POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
LIMIT, HUGE = 64 << 20, 100 << 20


def send(s, head, piece, count):
    """Sends it all, as far as the daemon takes it, and returns what came back."""
    with s.connect(timeout=PATIENT_S) as c:
        try:
            c.sendall(head)
            for _ in range(count):
                c.sendall(piece)
            c.sendall(b"0\r\n\r\n")
        except OSError:
            pass  # it may stop reading whenever it likes
        data, closed = read_all(c)
    check(closed, "the connection stayed open", data[:300])
    return data


def peak_memory(s):
    """Of the daemon so far, in bytes."""
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) << 10 for line in file if line.startswith("VmHWM"))


def is_instrumented(s):
    return "san" in s.build.name


def check_too_large(s, data):
    status, fields, body = head_of(data)
    problem = json.loads(body)
    check(status == 413 and problem["code"] == "body_too_large" and fields["connection"] == "close", data[:600])
    check(str(LIMIT) in problem["detail"] and data.count(b"HTTP/1.1 ") == 1, problem)
    is_well(s)


def test_hundred_megabytes_announced(s):
    check_too_large(s, send(s, HEAD + b"Content-Length: %d\r\n\r\n" % HUGE, b" " * 0x100000, HUGE >> 20))
    check(is_instrumented(s) or peak_memory(s) < LIMIT, "it kept what it refused:", peak_memory(s))


def test_hundred_megabytes_in_chunks(s):
    piece = b"100000\r\n" + b" " * 0x100000 + b"\r\n"
    check_too_large(s, send(s, HEAD + b"Transfer-Encoding: chunked\r\n\r\n", piece, HUGE >> 20))
    check(is_instrumented(s) or peak_memory(s) < 3 * LIMIT, "it kept what it refused:", peak_memory(s))


def test_body_of_the_limit(s):
    """The limit itself is allowed; a megabyte of spaces more is not, whatever stands in it."""
    body = BODY.encode()
    reply = s.request("POST", "/v1/jobs?validate=true", body + b" " * (LIMIT - len(body)), AS_JSON, timeout=120)
    check(expect(reply, 200).json["valid"] is True, reply)
    expect(s.request("POST", "/v1/jobs?validate=true", body + b" " * (LIMIT + 1 - len(body)), AS_JSON), 413,
           "body_too_large")
    check(is_instrumented(s) or peak_memory(s) < 4 * LIMIT, "one body of the limit took", peak_memory(s))


def test_two_content_lengths(s):
    for first, second in ((len(BODY), len(BODY)), (len(BODY), 5), (0, len(BODY))):
        lines = b"Content-Length: %d\r\nContent-Length: %d\r\n\r\n" % (first, second)
        data, closed = s.raw(HEAD + lines + BODY.encode())
        status, fields, body = head_of(data)
        check(status == 400 and closed and data.count(b"HTTP/1.1 ") == 1, data)
        check(json.loads(body)["detail"] and "Content-Length" in json.loads(body)["detail"], body)
        is_well(s)


def test_wrong_content_type(s):
    for wrong in ("text/plain", "application/xml", "application/x-www-form-urlencoded",
                  "multipart/form-data; boundary=x"):
        reply = expect(s.request("POST", "/v1/jobs", BODY.encode(), {"Content-Type": wrong}), 415, "content_type")
        check("application/json" in reply.json["detail"], reply)
    is_well(s)


def test_body_that_never_comes(s):
    with s.connect() as c, s.connect() as half:
        c.sendall(HEAD + b"Content-Length: 1000\r\n\r\n{")
        half.sendall(HEAD + b"Content-Length: 1000\r\n\r\n{")
        half.shutdown(socket.SHUT_WR)
        time.sleep(0.1)
        is_well(s)
    is_well(s)


def test_validation_tells_all_mistakes(s):
    ask = lambda body: s.post(body, query="?validate=true")  # noqa: E731
    wrong = copy.deepcopy(SCENE)
    wrong["problem"]["materials"][0]["poison"] = wrong["problem"]["materials"][0].pop("poisson")
    wrong["problem"]["thickness"] = -1
    wrong["problem"]["loads"] += [{"on": "top"}, {"on": 3, "traction": [1, 0]}]
    wrong["solver"] = {"method": "magic", "accuracy": {"relative_error": 0}, "acuracy": 1}
    reply = ask(wrong)
    check(reply.status == 422 and reply.headers["content-type"] == "application/problem+json", reply.status, reply.headers)
    got = {one["pointer"]: one["code"] for one in reply.json["mistakes"]}
    check(got == {"/problem/materials/0/poison": "unknown_key", "/problem/thickness": "out_of_range", "/problem/loads/2": "missing_key", "/problem/loads/3/on": "wrong_type",
                  "/solver/method": "not_allowed", "/solver/accuracy/relative_error": "out_of_range", "/solver/acuracy": "unknown_key"}, reply.json)
    first = reply.json["mistakes"][0]
    check(all(reply.json[key] == first[key] for key in first), reply.json)
    check("mistakes" not in s.post(wrong).json, "a job is refused by the first")
    wrong = copy.deepcopy(SCENE)
    wrong["problem"]["thickness"] = -1
    check("mistakes" not in ask(wrong).json, "one is told as it always is")
    wrong["problem"]["loads"] = [{}] * 500
    check(len(ask(wrong).json["mistakes"]) == 20, "no more than twenty")



if __name__ == "__main__":
    service.main(globals())
