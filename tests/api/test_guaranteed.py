"""The guaranteed bound on the whole error, through the service. usage: test_guaranteed.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy

import service
from service import SCENE, check, expect

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
LOWEST, HIGHEST = -3.96275665e-3, -3.96275643e-3  # the continuum's minimum for the paper's body lies between


def asked(accuracy, **changes):
    request = copy.deepcopy(SCENE)
    request["problem"].update(changes)
    request["solver"] = {"accuracy": accuracy}
    return request


def summary_of(s, request):
    job = expect(s.post(request, WAIT), 200).json
    check(job["status"] == "successful", job)
    return job["summary"]


def test_paper_body(s):
    summary = summary_of(s, asked({"total": 0.03, "guaranteed": True}))
    error = summary["error"]
    check(summary["outcome"] == "converged" and error["kind"] == "guaranteed" and "why" not in error, summary)
    check(abs(error["total"] - 0.0254) < 6e-5 and error["mesh"] >= error["total"], error)
    check(error["energy_low"] <= LOWEST and error["energy_high"] >= HIGHEST, error)
    check(0.019 < error["estimated_mesh"] < error["total"] and error["dual_unknowns"] == 2560 - 40, error)


def test_a_mesh_that_is_too_coarse(s):
    summary = summary_of(s, asked({"total": 0.02, "guaranteed": True}))
    check(summary["outcome"] == "mesh_limit" and summary["error"]["kind"] == "guaranteed", summary)
    check("at most 0.0254" in summary["message"] and summary["requested_error"] == 0.02, summary["message"])
    summary = summary_of(s, asked({"total": 0.03}))
    check(summary["outcome"] == "converged" and summary["error"]["kind"] == "estimated", summary)


def test_what_is_not_proved(s):
    contacts = [{"on": "bottom", "obstacle": {"polyline": {"points": [[0, -1], [30, 0], [60, -1]]}}}]
    summary = summary_of(s, asked({"guaranteed": True}, contacts=contacts))
    error = summary["error"]
    check(error["kind"] == "estimated" and "corners" in error["why"], error)
    check(summary["outcome"] == "converged" and error["total"] > 0 and "bound" not in error, summary)
    for cells in ([30, 10], "auto"):  # an estimate is not what was asked for
        request = asked({"total": 0.3, "guaranteed": True}, contacts=contacts)
        request["problem"]["mesh"]["box"]["cells"] = cells
        summary = summary_of(s, request)
        check(summary["outcome"] == "mesh_limit" and "not guaranteed" in summary["message"], summary)


def test_nothing_to_be_relative_to(s):
    for cells in ([30, 10], "auto"):  # nothing happens, and nothing is off
        request = asked({"total": 0.01, "guaranteed": True}, loads=[])
        request["problem"]["mesh"]["box"]["cells"] = cells
        summary = summary_of(s, request)
        check(summary["outcome"] == "converged" and summary["error"]["total"] == summary["error"]["bound"] == 0, summary)
    held = [{"on": "left", "ux": 1, "uy": 1}]
    summary = summary_of(s, asked({"total": 0.01, "guaranteed": True}, loads=[], supports=held, contacts=[]))
    check(summary["outcome"] == "mesh_limit" and 0 < summary["error"]["bound"] < 1e-6, summary["error"])
    check(summary["error"]["total"] is None and "may be all of the answer" in summary["message"], summary["message"])


def test_cases_and_chosen_cells(s):
    request = asked({"guaranteed": True})
    loads = request["problem"]["loads"]
    request["cases"] = [{"name": "as it is", "loads": loads}, {"name": "pulled", "loads": [loads[-1]]}]
    summary = summary_of(s, request)
    check(summary["error"]["kind"] == "guaranteed" and summary["error"]["total"] >= 0.0254 - 6e-5, summary["error"])
    request = asked({"total": 0.03, "guaranteed": True})
    request["problem"]["mesh"]["box"]["cells"] = "auto"
    summary = summary_of(s, request)
    check(summary["outcome"] == "converged" and summary["error"]["total"] <= 0.03, summary)
    check(summary["error"]["kind"] == "guaranteed" and summary["requested_error"] == 0.03, summary["error"])


if __name__ == "__main__":
    service.main(globals())
