"""What accuracy took, and how a run converged. usage: test_trade.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import math
import xml.etree.ElementTree as ET

import service
from service import ENDLESS, MATRICES, SCENE, check, expect

SHARED = True  # one service for all tests

WAIT = {"Prefer": "wait=60"}
SVG = "{http://www.w3.org/2000/svg}"


def scene(error=1e-6, **solver):
    body = copy.deepcopy(SCENE)
    body["solver"] = {"method": "accelerated_restart", "accuracy": {"relative_error": error}, **solver}
    return body


def solved(s, request):
    job = s.solve(request)
    check(job["status"] == "successful", job)
    return job


def record(s, job, query=""):
    return expect(s.get(f"/v1/jobs/{job}/work-precision{query}"), 200).json


def check_record(found, summary):
    """What the certificate met was reached, in order, and nothing else."""
    certified = summary["certificate"]["relative_error"]
    check(found["solver_error"] == certified, found)
    check([round(math.log10(d["relative_error"]), 9) for d in found["decades"]] == list(range(-1, -11, -1)), found)
    for decade in found["decades"]:
        reached = certified <= decade["relative_error"]
        members = [decade[name] for name in ("seconds", "iterations", "applications", "by")]
        check(all((value is not None) == reached for value in members), decade, certified)
    for name in ("seconds", "iterations", "applications"):
        values = [d[name] for d in found["decades"] if d[name] is not None]
        check(values == sorted(values) and (not values or values[-1] <= max(summary["iterations"], 1) or
                                            name == "applications"), name, values)
    check(found["iterated_s"] <= found["total_s"], found)
    check([one["level"] for one in found["levels"]] == ["quick", "balanced", "precise", "exact"], found["levels"])
    for level in found["levels"]:
        reached = level["relative_error"] is not None and certified <= level["relative_error"]
        check(not reached or level["seconds"] is None or level["seconds"] <= found["total_s"] * (1 + 1e-9), level)


def test_decades_of_a_run(s):
    job = solved(s, scene())
    found = record(s, job["id"])
    check_record(found, job["summary"])
    check(found["job"] == job["id"] and "case" not in found, found)
    check(0.015 < found["mesh_error"] < 0.03, found)
    levels = {one["level"]: one for one in found["levels"]}
    check(math.isclose(levels["balanced"]["relative_error"], 0.1 * found["mesh_error"]), levels)
    quick = next(d for d in found["decades"] if abs(d["relative_error"] - 1e-2) < 1e-12)
    check(levels["quick"]["iterations"] == quick["iterations"] and levels["quick"]["seconds"] >= quick["seconds"], found)
    check(levels["exact"]["seconds"] is None and levels["precise"]["by"] is None, levels)
    # the levels are told as they are: `quick` takes these iterations
    again = solved(s, scene(1e-2))
    check(again["summary"]["iterations"] == levels["quick"]["iterations"], again["summary"], levels)


def test_every_method_and_operator(s):
    for solver in ({"method": "auto"}, {"method": "active_set"}, {"method": "accelerated"},
                   {"operator": "matrix_free"}, {"operator": "factored"}, {"method": "uzawa", "max_iterations": 1000000}):
        job = solved(s, scene(1e-4, **solver))
        check_record(record(s, job["id"]), job["summary"])


def test_matrices_have_no_mesh(s):
    job = solved(s, MATRICES)
    found = record(s, job["id"])
    check_record(found, job["summary"])
    check(found["mesh_error"] is None and "suggestion" not in found, found)
    check(found["levels"][1]["relative_error"] is None and found["levels"][1]["seconds"] is None, found)


def test_without_contact(s):
    body = scene()
    body["problem"]["contacts"] = []
    job = solved(s, body)
    check(job["summary"]["method"] == "linear", job)
    check_record(record(s, job["id"]), job["summary"])


def test_load_cases(s):
    body = {**scene(), "cases": [{"name": "a", "loads": [{"on": "right", "traction": [0.5, 0]}]},
                                 {"name": "b & c", "loads": [{"on": "right", "traction": [0.1, 0]}]}]}
    job = solved(s, body)
    all_cases = expect(s.get(f"/v1/jobs/{job['id']}/result?fields=summary"), 200).json["cases"]
    for case, query in zip(all_cases, ("?case=a", "?case=b%20%26%20c")):
        found = record(s, job["id"], query)
        check(found["case"] == case["name"], found)
        check_record(found, case["summary"])
    expect(s.get(f"/v1/jobs/{job['id']}/work-precision"), 400, "case_needed")
    expect(s.get(f"/v1/jobs/{job['id']}/work-precision?case=d"), 404, "case_not_found")
    expect(s.get(f"/v1/jobs/{job['id']}/convergence.svg"), 400, "case_needed")
    picture = drawing(s, job["id"], "?case=b%20%26%20c")
    check(any("b & c" in (text.text or "") for text in picture.iter(SVG + "text")), "no name")


def test_chosen_cells_and_verified_answers(s):
    body = scene(0.2)
    body["problem"]["mesh"]["box"]["cells"] = "auto"
    job = solved(s, body)
    found = record(s, job["id"])
    check_record(found, {**job["summary"], "iterations": 10 ** 9})
    check(found["mesh_error"] == job["summary"]["discretization_error"], found)
    earlier = sum(rung["seconds"] for rung in job["summary"]["mesh"]["ladder"][:-1])
    check(found["total_s"] >= 0.5 * earlier, "the grids before count", found, job["summary"]["mesh"])
    answer = expect(s.get(f"/v1/jobs/{solved(s, MATRICES)['id']}/result?fields=reactions,displacements"), 200).json
    given = {"problem": MATRICES["problem"],
             "answer": {name: answer[name] for name in ("displacements", "reactions")}}
    reply = s.request("POST", "/v1/verify", given, WAIT)
    check(reply.status == 200, reply)
    found = record(s, reply.json["job"] if "job" in reply.json else reply.json["id"])
    check({d["by"] for d in found["decades"]} <= {"certificate", None} and found["decades"][3]["iterations"] == 0, found)


def test_refined_jobs_keep_what_was_reached(s):
    first = solved(s, scene(1e-3))
    before = record(s, first["id"])
    reply = s.request("POST", f"/v1/jobs/{first['id']}/refine", {"accuracy": {"relative_error": 1e-6}}, WAIT)
    new = expect(reply, 200).json
    check(new["summary"]["started_from"] == "continued", new)
    after = record(s, new["id"])
    check_record(after, new["summary"])
    check(after["decades"][:3] == before["decades"][:3], before, after)
    check(after["decades"][5]["seconds"] > before["total_s"] and after["total_s"] > before["total_s"], before, after)
    check(after["decades"][5]["applications"] > before["decades"][2]["applications"], before, after)
    # a parent without a record is no reason to have none
    expect(s.request("DELETE", f"/v1/jobs/{first['id']}"), 204)
    check(record(s, new["id"]) == after, "the record is the job's own")


def test_survives_a_restart(s):
    job = solved(s, scene())["id"]
    before = record(s, job)
    picture = s.get(f"/v1/jobs/{job}/convergence.svg").body
    s.restart()
    check(record(s, job) == before, "another record")
    check(s.get(f"/v1/jobs/{job}/convergence.svg").body == picture, "another picture")
    tag = s.get(f"/v1/jobs/{job}/work-precision").headers["etag"]
    check(s.get(f"/v1/jobs/{job}/work-precision", If_None_Match=tag).status == 304, "not known")


def test_jobs_without_an_answer(s):
    running = s.post(ENDLESS).json["id"]
    s.wait_status(running, "running")
    expect(s.get(f"/v1/jobs/{running}/work-precision"), 409, "not_ended")
    drawing(s, running)
    expect(s.request("DELETE", f"/v1/jobs/{running}"), 200)
    bad = copy.deepcopy(MATRICES)
    bad["problem"]["K"] = bad["problem"]["K"].replace("1 1 2", "1 1 -2")
    failed = s.solve(bad)
    check(failed["status"] == "failed", failed)
    expect(s.get(f"/v1/jobs/{failed['id']}/work-precision"), 409, "job_failed")
    drawing(s, failed["id"])
    crossed = {"problem": {**MATRICES["problem"], "h": [0.5, -1],
                           "N": "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 1 -1\n"}}
    infeasible = solved(s, crossed)
    check(infeasible["summary"]["outcome"] == "infeasible", infeasible)
    found = record(s, infeasible["id"])
    check(all(d["seconds"] is None for d in found["decades"]) and found["solver_error"] is None, found)
    expect(s.get("/v1/jobs/" + "0" * 32 + "/work-precision"), 404)
    expect(s.get(f"/v1/jobs/{failed['id']}/work-precision?x=1"), 400, "unknown_parameter")


# ---------------------------------------------------------------- the picture

def drawing(s, job, query=""):
    reply = expect(s.get(f"/v1/jobs/{job}/convergence.svg{query}"), 200)
    check(reply.headers["content-type"] == "image/svg+xml", reply)
    check("style-src 'unsafe-inline'" in reply.headers["content-security-policy"], reply.headers)
    return ET.fromstring(reply.body)


def panel(picture, number):
    return next(group for group in picture.iter(SVG + "g") if group.get("id") == f"panel{number}")


def scale(picture, number, axis):
    """From pixels to values, by the numbers at the ticks."""
    ticks = [(float(text.get(axis)) - (4 if axis == "y" else 0), float(text.text), "1e" in text.text)
             for text in panel(picture, number).iter(SVG + "text") if text.get("class") == axis]
    (p, a, log), (q, b, _) = ticks[0], ticks[-1]
    if axis == "y" and log:
        a, b = math.log10(a), math.log10(b)
        return lambda pixel: 10 ** (a + (pixel - p) * (b - a) / (q - p))
    return lambda pixel: a + (pixel - p) * (b - a) / (q - p)


def points(picture, number, colour=0):
    found = []
    for line in panel(picture, number).iter(SVG + "polyline"):
        if line.get("class") == f"curve c{colour}":
            found += [tuple(map(float, pair.split(","))) for pair in line.get("points").split()]
    return found


def test_lines_are_the_history(s):
    job = solved(s, scene())["id"]
    history = expect(s.get(f"/v1/jobs/{job}/history"), 200).json
    rows = [dict(zip(history["columns"], row)) for row in history["rows"]]
    best = max(row["dual_objective"] for row in rows)
    for query, x in (("", "iteration"), ("?x=seconds&width=1400&theme=dark", "seconds")):
        picture = drawing(s, job, query)
        for number, value in ((0, lambda row: best - row["dual_objective"]), (1, lambda row: row["residual_total"]),
                              (2, lambda row: row["error_bound"]), (3, lambda row: row["contacts"])):
            read_x, read_y = scale(picture, 3, "x"), scale(picture, number, "y")
            wanted = [(row[x], value(row)) for row in rows if value(row) is not None and (number == 3 or value(row) > 0)]
            drawn = [(read_x(px), read_y(py)) for px, py in points(picture, number)]
            width = abs(read_x(1) - read_x(0))
            for at in (0, len(wanted) // 3, len(wanted) // 2, len(wanted) - 1):
                check(any(abs(dx - wanted[at][0]) <= 0.02 * width and abs(dy - wanted[at][1]) <= 0.02 * abs(wanted[at][1])
                          for dx, dy in drawn) or len(drawn) < len(wanted), number, wanted[at])
            check(abs(drawn[-1][0] - wanted[-1][0]) <= 0.02 * width, drawn[-1], wanted[-1])
            check(abs(drawn[-1][1] - wanted[-1][1]) <= 0.02 * abs(wanted[-1][1]), drawn[-1], wanted[-1])
    restarts = sum(row["restart"] for row in rows)
    marks = [path.get("d") for path in panel(drawing(s, job), 1).iter(SVG + "path") if "restart" in path.get("class")]
    check(restarts >= 1 and sum(d.count("M") for d in marks) == restarts, restarts, marks)


def test_jobs_over_each_other(s):
    jobs = [solved(s, scene(1e-4, method=method))["id"] for method in ("accelerated_restart", "accelerated", "auto")]
    picture = drawing(s, jobs[0], f"?with={jobs[1]},{jobs[2]}")
    texts = [text.text or "" for text in picture.iter(SVG + "text")]
    for method in ("accelerated_restart, condensed", "accelerated, condensed", "active_set, condensed"):
        check(any(text.startswith(method) for text in texts), method, texts)
    check(all(points(picture, 1, colour) for colour in range(3)), "a curve is missing")
    for query, status, code in (("?with=" + "0" * 32, 404, "job_not_found"), ("?with=x", 400, "bad_parameter"),
                                ("?with=", 400, "bad_parameter"), (f"?with={jobs[1]},", 400, "bad_parameter"),
                                ("?with=" + ",".join([jobs[1]] * 8), 400, "bad_parameter"),
                                (f"?with={jobs[1]}:a", 404, "case_not_found"), ("?x=time", 400, "bad_parameter"),
                                ("?theme=blue", 400, "bad_parameter"), ("?width=100", 400, "bad_parameter"),
                                ("?colour=red", 400, "unknown_parameter"), ("?case=a", 404, "case_not_found")):
        expect(s.get(f"/v1/jobs/{jobs[0]}/convergence.svg{query}"), status, code)
    expect(s.get("/v1/jobs/" + "0" * 32 + "/convergence.svg"), 404)
    drawing(s, jobs[0], "?with=" + ",".join([jobs[1]] * 7))


def test_light_and_dark(s):
    job = solved(s, MATRICES)["id"]
    style = {theme: drawing(s, job, f"?theme={theme}").find(SVG + "style").text for theme in ("auto", "light", "dark")}
    check("prefers-color-scheme:dark" in style["auto"] and "@media" not in style["light"] + style["dark"], style)
    check("#16181c" in style["dark"] and "#16181c" not in style["light"], style)
    check(drawing(s, job).find(SVG + "style").text == style["auto"], "auto is the default")


if __name__ == "__main__":
    service.main(globals())
