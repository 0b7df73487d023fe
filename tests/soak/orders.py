"""What a request gets does not depend on what others solved before: the same requests in random orders, on a cache that keeps what
it can and on one that keeps nothing. usage: orders.py BUILD_DIR [REQUESTS [SEED]]
"""
import copy
import json
import pathlib
import random
import sys
import threading

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / "api")]

import service  # noqa: E402  the path is set above

BOTTOM = {"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}


def scene(chance):
    """A plane body: of few kinds and sizes, so that bodies come again with other loads, contacts and settings."""
    kind, long = chance.choice(["quad4", "quad4", "quad8", "tri3", "tri6"]), chance.choice([3, 20, 400, 1000])
    cells = chance.choice([[12, 4], [30, 10], [40, 3]])
    problem = {"kind": "scene", "model": chance.choice(["plane_stress", "plane_strain"]), "thickness": 5,
               "mesh": {"box": {"size": [long, 1], "cells": cells, "element": kind}},
               "materials": [{"on": "all", "young": 200e3, "poisson": 0.3}],
               "supports": [{"on": "left", "ux": 0, "uy": 0}],
               "loads": [{"on": "top", "traction": [0, chance.choice([-0.05, 0.02])]},
                         {"on": "right", "traction": [chance.choice([0, 0.5]), chance.choice([0, 0.001])]}]}
    if chance.random() < 0.75:  # else first without contact, which leaves a factor in another order
        problem["contacts"] = [copy.deepcopy(BOTTOM)]
        if chance.random() < 0.3:
            problem["contacts"][0]["on"] = "right"
            problem["contacts"][0]["obstacle"] = {"plane": {"point": [long * 1.0001, 0], "normal": [-1, 0]}}
    return problem


def cube(chance):
    n = chance.choice([3, 5])
    return {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [1, 1, 1], "cells": [n, n, n], "element": "hex8"}},
            "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
            "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": 0}],
            "loads": [{"on": "right", "traction": [chance.choice([1, 2]), 0, 0]}],
            "contacts": [{"on": "front", "obstacle": {"sphere": {"center": [0.5, 0.5, 2.98], "radius": 2}}}]}


def matrices(chance):
    """A string with springs: one K for several N, h and p."""
    d, spring = chance.choice([8, 60, 300]), chance.choice([1, 1e-6, 1e-10])
    entries = [f"{i} {i} {2 + spring!r}" for i in range(1, d + 1)] + [f"{i + 1} {i} -1" for i in range(1, d)]
    rows = list(range(1, d + 1, chance.choice([1, 2, 3])))
    two = chance.random() < 0.3
    N = [f"{k + 1} {i} 1" for k, i in enumerate(rows)]
    if two:
        N += [f"{k + 1} {i + 1} 0.5" for k, i in enumerate(rows) if i < d]
    return {"kind": "matrices",
            "K": f"%%MatrixMarket matrix coordinate real symmetric\n{d} {d} {len(entries)}\n" + "\n".join(entries) + "\n",
            "N": f"%%MatrixMarket matrix coordinate real general\n{len(rows)} {d} {len(N)}\n" + "\n".join(N) + "\n",
            "h": [chance.choice([0.1, 1, 10])] * len(rows), "p": [chance.choice([0.01, 1])] * d}


def make_requests(count, seed):
    chance, made = random.Random(seed), []
    for _ in range(count):
        problem = chance.choice([scene, scene, scene, cube, matrices])(chance)
        solver = {"accuracy": {"relative_error": chance.choice([1e-2, 1e-6, 1e-8, 1e-10])}, "max_iterations": 3000}
        if chance.random() < 0.3:
            solver["method"] = chance.choice(["active_set", "accelerated_restart", "conjugate"])
        if chance.random() < 0.2:
            solver["operator"] = chance.choice(["condensed", "factored", "matrix_free"])
        made.append({"problem": problem, "solver": solver})
    return made + [copy.deepcopy(chance.choice(made)) for _ in range(count // 4)]  # and some again


def answer(s, request):
    """What the request is told, but for times and for what says itself that it depends on the cache."""
    job = s.solve(request)
    if job["status"] != "successful":
        return {"failed": job["error"]["code"]}, None
    result = s.get(f"/v1/jobs/{job['id']}/result?fields=displacements").json
    told = job["summary"]
    kept = {key: told[key] for key in ("outcome", "operator", "method", "lambda_max") if key in told}
    return {**kept, "error": told["certificate"]["relative_error"], "iterations": told["iterations"]}, result


def numbers(result):
    return [x for row in result["displacements"] for x in (row if isinstance(row, list) else [row])]


def differs(request, one, other):
    """Why the two answers are not the same to whoever asked; None: they are."""
    (told, result), (also, again) = one, other
    if told.get("failed") != also.get("failed") or told.get("outcome") != also.get("outcome"):
        return f"{told} and {also}"
    if result is None or told["outcome"] != "converged":
        return None
    if told["operator"] != also["operator"] or (told["lambda_max"] is None) != (also["lambda_max"] is None):
        return f"{told} and {also}"
    u, v = numbers(result), numbers(again)
    size = max(map(abs, u), default=0.0)
    far = max((abs(a - b) for a, b in zip(u, v)), default=0.0)
    allowed = 10 * request["solver"]["accuracy"]["relative_error"] * size  # the request is in the energy norm
    return f"displacements differ by {far / size:.2g}: {told} and {also}" if far > allowed else None


def orders(build, count, seed=1, rounds=2):
    """The requests on nothing kept; then in random orders, by two clients, on a cache that they share."""
    requests = make_requests(count, seed)
    found, tally = [], {}
    cold = service.Service(build, "--log-level", "warn", "--workers", "1", "--cache", "1")
    try:
        cold.start()
        alone = [answer(cold, request) for request in requests]
    finally:
        cold.stop()
    for told, _ in alone:
        name = told.get("outcome") or told["failed"]
        tally[name] = tally.get(name, 0) + 1
    for r in range(rounds):
        warm = service.Service(build, "--log-level", "warn", "--workers", "2")
        todo = list(range(len(requests)))
        random.Random(seed + 100 + r).shuffle(todo)
        try:
            warm.start()

            def client():
                while todo:
                    i = todo.pop()
                    why = differs(requests[i], alone[i], answer(warm, requests[i]))
                    if why:
                        found.append((i, why))
            clients = [threading.Thread(target=client) for _ in range(2)]
            for one in clients:
                one.start()
            for one in clients:
                one.join()
        finally:
            warm.stop()
    return {"requests": len(requests) * rounds, "differences": len(found), "outcomes": tally, "first": found[:20]}


def counted(build, requests, rounds):
    """For the table: how many differ."""
    figures = orders(build, requests * 4 // 5, seed=1, rounds=rounds)
    return {"requests": figures["requests"], "errors": figures["differences"], "converged": figures["outcomes"]["converged"]}


if __name__ == "__main__":
    print(json.dumps(orders(sys.argv[1], *map(int, sys.argv[2:])), indent=1))
