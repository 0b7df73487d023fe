"""What a request gets does not depend on what others solved before: the short form of tests/soak/orders.py, with bodies
whose outcome once did. usage: test_orders.py BUILD_DIR [FILTER]
"""
# not under sanitizers: about answers, of code that other tests run there
import pathlib
import sys

import service
from service import check

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parent.parent / "soak")]

import orders  # noqa: E402  the path is set above


def test_random_orders(s):
    figures = orders.orders(s.build, 32, seed=4, rounds=1)
    check(figures["differences"] == 0 and figures["outcomes"]["converged"] > 20, figures)


def test_lambda_max_is_told_to_whoever_needed_it(s):
    stepping = s.solve(service.SCENE)["summary"]
    direct = s.solve({**service.SCENE, "solver": {"method": "active_set"}})["summary"]
    check(stepping["lambda_max"] is not None and direct["factor"]["cached"] and direct["lambda_max"] is None, direct)


def test_the_certificate_is_the_same_whatever_the_cache_knows(s):
    """Cached bodies were certified by a bound on K^-1 that got better from job to job: at first it was 40,000 times worse."""
    told = [s.solve(service.SCENE)["summary"] for _ in range(9)]
    check(not told[0]["factor"]["cached"] and told[-1]["factor"]["cached"], told[-1]["factor"])
    for later in told[1:]:
        check(later["certificate"] == told[0]["certificate"] and later["energy"] == told[0]["energy"], told[0], later)


def slender(contact, *, relative_error):
    """A beam whose condition makes the order of elimination tell."""
    problem = {**service.SCENE["problem"], "mesh": {"box": {"size": [1000, 1], "cells": [40, 3], "element": "quad4"}}}
    if not contact:
        problem.pop("contacts")
    return {"problem": problem, "solver": {"accuracy": {"relative_error": relative_error}, "max_iterations": 3000}}


def test_a_body_solved_without_contact_before(s):
    s.solve(slender(False, relative_error=1e-2))
    own = s.solve(slender(True, relative_error=1e-8))["summary"]
    check(not own["factor"]["reused"]["factor"] and own["factor"]["contact_last"], own["factor"])
    # where nothing depends on it, the factor serves both
    plain = {**service.SCENE, "problem": {**service.SCENE["problem"]}}
    free = {**plain, "problem": {key: value for key, value in plain["problem"].items() if key != "contacts"}}
    s.solve(free)
    told = s.solve(plain)["summary"]
    check(told["factor"]["reused"]["factor"])
    # it is not predicted to be made again
    check(told["cost"]["predicted"]["flops"] < told["factor"]["flops"], told["cost"], told["factor"])


if __name__ == "__main__":
    service.main(globals())
