"""A job's page: live, plots, words, files. usage: test_job.py BUILD_DIR [FILTER]"""
import copy
import json
import math
import pathlib
import time
import xml.etree.ElementTree

import browser
from browser import check, options
from service import ENDLESS, MATRICES, PATIENT_S, SCENE

CURVES = """return [...document.querySelectorAll('#convergence path.line')].map((path) =>
    [path.dataset.series, path.getAttribute('d').split(/[ML]/).length - 1])"""


# Whether no curve goes back.
FORWARD = """return [...document.querySelectorAll('#convergence path.line')].every((path) =>
    [...path.getAttribute('d').matchAll(/[ML](-?[\\d.]+)/g)].every(([, x], i, all) => i === 0 || +x >= +all[i - 1][1]))"""
# What the service says to DELETE while the job still runs, and what comes after the end that it led to.
RUNS_STILL = """const fetched = window.fetch;
window.fetch = async (...asked) => {
    const answer = await fetched(...asked);
    if (asked[1]?.method !== 'DELETE') return answer;
    const said = JSON.stringify({...await answer.json(), status: 'running', summary: null});
    await new Promise((done) => setTimeout(done, 300));
    setTimeout(() => (window.said = true), 50);
    return new Response(said, {headers: {'Content-Type': 'application/json'}});
};"""


def plain(text):
    """A number as the page writes it."""
    return float(text.replace("×10", "e").replace(",", "").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))


def file_saved(b, name, seconds=PATIENT_S):
    """The bytes of a file that the page saved; a browser first puts an empty one in its place."""
    path = pathlib.Path(b.downloads, name)
    end = time.monotonic() + seconds
    while not path.exists() or not path.stat().st_size:
        check(time.monotonic() < end, name, "is not among", list(pathlib.Path(b.downloads).iterdir()))
        time.sleep(0.05)
    return path.read_bytes()


@options("--workers", "1")
def test_is_watched_live_from_the_editor_on(s, b):
    b.open(s, "new")
    b.says("#verdict", "Valid")
    b.write("#job-text", json.dumps({**ENDLESS, "tags": ["watched"]}))
    b.says("#verdict", "Valid")
    b.click("#submit")
    b.says(".title", "running")
    b.says("#progress-text", "certified bound")
    first = b.wait("a curve", CURVES)
    rows = "return document.querySelector('#convergence p[role=status]').innerText"
    said = b.run(rows)
    b.wait("more iterations", rows.replace("return ", "return arguments[0] !== "), said)
    # Two answers to the same question, as a slow one is asked again meanwhile: each iteration is drawn once.
    b.hold("/history?")
    b.held(2)
    b.release()
    check(b.run(FORWARD), b.run(CURVES))
    check({one[0] for one in first} >= {"certified bound", "total residual"}, first)
    # What is asked for is a line, the bound is told relative to the answer, and how long that may take.
    b.wait("the line", "return [...document.querySelectorAll('#convergence path.line')].some((path) => path.dataset.series.startsWith('asked for'))")
    check("asked for: a relative error of 1×10⁻⁸" in b.text("#convergence .legend"), b.text("#convergence .legend"))
    b.says("#progress-text", "asked for, time left")
    words = b.text("#progress-text")
    row = s.get(f"/v1/jobs/{s.get('/v1/jobs?tag=watched').json['jobs'][0]['id']}/history").json
    last = dict(zip(row["columns"], row["rows"][-1]))
    relative = last["error_bound"] / math.sqrt(2 * abs(last["dual_objective"]))
    check(relative / 30 < plain(words.split("relative ")[1].split(" of the")[0]) < 1e4 * relative, words, relative)
    check("time left unknown" in words or "time left about" in words, words)
    b.click("#stop")
    b.says("#stop", "Cancel?")
    b.run(RUNS_STILL)
    b.click("#stop")
    b.says(".verdict h2", "Dismissed")
    b.wait("the late answer", "return window.said")
    b.says(".title", "dismissed")
    b.says("#certificate", "differs by at most")
    check(s.get("/v1/jobs?tag=watched").json["jobs"][0]["summary"]["outcome"] == "dismissed", "the daemon says otherwise")
    check(not b.run("return document.querySelector('section.progress').checkVisibility()"), "there is progress no longer")


def test_whole_error_is_drawn(s, b):
    paper = json.loads((browser.ROOT / "tests/data/paper_body.json").read_text())
    paper["problem"]["mesh"].update(refine="auto")
    paper["solver"] = {"accuracy": {"total": 0.02, "guaranteed": True}}
    grids = s.solve(paper)["summary"]["mesh"]["ladder"]
    chart = "#whole"
    for dark, (width, height, phone) in ((False, (1200, 900, False)), (True, (760, 900, False)), (False, (360, 740, True))):
        b.size(width, height, phone)
        b.media("prefers-color-scheme", "dark" if dark else "light")
        b.open(s, f"jobs/{s.get('/v1/jobs').json['jobs'][0]['id']}")
        b.says(chart, "Whole error and its price")
        b.shows(f"{chart} .chart", "--series-1", 60)
        b.shows(f"{chart} .chart", "--series-2", 50)
        # Numbers at the axis stand between its name and the axis.
        b.wait("each chart", "return [...document.querySelectorAll('.chart')].every((one) => !one.checkVisibility() || one.querySelector('.label[transform]'))")
        boxes = b.run("""const box = (e) => { const r = e.getBoundingClientRect(); return [r.left, r.right]; };
            const all = [...document.querySelectorAll('.chart')].filter((one) => one.checkVisibility());
            return all.map((one) => [box(one.querySelector('.label[transform]')), ...[...one.querySelectorAll('.tick[text-anchor=end]')].map(box)])""")
        check(all(tick[0] >= name[1] - 1 for name, *ticks in boxes for tick in ticks), width, "numbers lie on the axis' name", boxes)
        check(b.run("return document.documentElement.scrollWidth <= innerWidth"), width, "the page is wider than the screen")
    b.click(f"{chart} summary")
    rows = b.run("return [...document.querySelectorAll('table.grids tbody tr')].map((row) => row.innerText.split('\\t'))")
    check([int(row[1].replace(",", "")) for row in rows] == [one["d"] for one in grids], rows, grids)
    unknowns = b.run(f"return document.querySelector('{chart} path.line').getAttribute('d')")
    b.click(f"{chart} input[value=at]")
    b.wait("seconds", f"return document.querySelector('{chart} .chart').getAttribute('aria-label').includes('time')")
    check(b.run(f"return document.querySelector('{chart} path.line').getAttribute('d')") != unknowns, "the same curve over seconds")


def test_cases_are_a_table_and_a_curve(s, b):
    loads = {f"pull {t}": [{"on": "top", "traction": [0, -0.05]}, {"on": "right", "traction": [t, 0]}] for t in (0.2, 1.2, 0.5, 0.8)}
    problem = {**SCENE["problem"], "units": {"length": "mm", "force": "N"}}
    job = s.solve({**SCENE, "name": "Four pulls", "problem": problem, "cases": [{"name": name, "loads": one} for name, one in loads.items()]})
    cases = {one["name"]: one["summary"] for one in s.get(f"/v1/jobs/{job['id']}/result?fields=summary").json["cases"]}
    b.open(s, f"jobs/{job['id']}")
    b.says("h1", "Four pulls")
    b.one("#cases-table")
    names = "return [...document.querySelectorAll('#cases-table tbody th')].map((one) => one.innerText)"
    check(b.run(names) == list(cases), b.run(names))
    check("MPa" in b.text("#cases-table thead") and "mm²" in b.text("#cases-table thead"), b.text("#cases-table thead"))
    for wanted in (True, False):
        b.click("#cases-table [data-by=active] button")
        check(b.run(names) == sorted(cases, key=lambda name: cases[name]["contact"]["active"], reverse=wanted), wanted, b.run(names))
    # The curve is over the number in the names, from left to right.
    marks = "return [...document.querySelectorAll('#cases circle.series-1')].map((one) => [+one.getAttribute('cx'), +one.getAttribute('cy')])"
    at = b.wait("a dot for each", marks)
    pressed = [cases[name]["contact"]["max_pressure"] for name in sorted(cases, key=lambda name: float(name.split()[1]))]
    check(len(at) == 4 and at == sorted(at), at)
    check([low > high for (_, low), (_, high) in zip(at, at[1:])] == [a < c for a, c in zip(pressed, pressed[1:])], at, pressed)
    b.run("[...document.querySelectorAll('#cases-table button.link')].find((one) => one.innerText === 'pull 0.2').click()")
    b.wait("the case is chosen", "return document.querySelector('#case').value === 'pull 0.2' && document.querySelector('tr.here').innerText.includes('pull 0.2')")
    b.says(".facts", f"{cases['pull 0.2']['contact']['active']} of 30")
    b.click("#request summary")
    b.says("#request", '"Four pulls"')
    b.click("#stop")
    b.click(".menu [data-label=Delete]")
    b.click(".menu [data-label=Delete]")
    b.says(".empty", "No jobs yet")


def test_a_path_is_a_curve_and_a_slider(s, b):
    """Force against displacement in the order of the path, and the body at each of its points."""
    problem = {"kind": "scene", "model": "plane_strain", "kinematics": "finite", "mesh": {"box": {"size": [1, 1], "cells": [2, 2], "element": "quad8"}},
               "materials": [{"on": "all", "young": 1, "poisson": 0.3, "law": "neo_hooke"}], "supports": [{"on": "left", "ux": 0}, {"on": "top", "uy": -1}],
               "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]}
    job = s.solve({"problem": problem, "cases": [{"name": "way", "steps": [0.1, 0.2, 0.3, 0.15]}]})
    summaries = [one["summary"] for one in s.get(f"/v1/jobs/{job['id']}/result?fields=summary").json["cases"]]
    b.open(s, f"jobs/{job['id']}")
    b.one("#cases-table")
    fields = b.run("return ['#case-curve', '#case-over'].map((one) => document.querySelector(one).value)")
    check(fields[0] in ("force_y", "support_1_y") and fields[1] == "displacement", fields)
    at = b.wait("a dot for each", "return [...document.querySelectorAll('#cases circle.series-1')].map((one) => [+one.getAttribute('cx'), +one.getAttribute('cy')])")
    moved = [one["finite"]["displacement"] for one in summaries]
    check(len(at) == 4 and [a[0] < c[0] for a, c in zip(at, at[1:])] == [a < c for a, c in zip(moved, moved[1:])] == [True, True, False], at, moved)
    b.one(".body-way input")
    b.wait("the worst case is shown", "return document.querySelector('.body-way output').value === document.querySelector('#case').value")
    for point, name in ((0, "way 1"), (2, "way 3"), (3, "way")):
        before = b.one(".body-legend svg").get_attribute("aria-label")
        b.run(f"""const range = document.querySelector('.body-way input');
                  range.value = {point}; range.dispatchEvent(new Event('input', {{bubbles: true}}));""")
        b.wait("the point is named", f"return document.querySelector('.body-way output').value === '{name}'")
        b.wait("the body is drawn there", f"return [...document.querySelectorAll('.body-tools select')].some((one) => one.value === '{name}')")
        check(point == 0 or b.wait("other values", "return document.querySelector('.body-legend svg').getAttribute('aria-label') !== arguments[0]", before), point)


def test_convergence_is_drawn(s, b):
    job = s.solve(SCENE)
    b.open(s, f"jobs/{job['id']}")
    b.wait("three curves", "return document.querySelectorAll('#convergence path.line').length === 3")
    for number in (1, 2, 3):
        b.shows("#convergence .chart", f"--series-{number}", 150)
    b.click("#convergence input[value=residual_total]")
    b.wait("two curves", "return document.querySelectorAll('#convergence path.line').length === 2")
    check(b.near("#convergence .chart", "--series-2") < 30, "a curve that was switched off is still seen")
    b.click("#convergence input[value=seconds]")
    b.wait("seconds", "return document.querySelector('#convergence .chart').getAttribute('aria-label').includes('time')")
    # The curve ends where the history does: decoded back from the picture.
    rows = s.get(f"/v1/jobs/{job['id']}/history").json["rows"]
    b.click("#convergence input[value=iteration]")
    b.click("#convergence input[name=axis]")  # linear in iterations
    b.wait("a linear axis", """return [...document.querySelectorAll('#convergence .tick')].some((t) => t.textContent === '0')""")
    x, y, ticks = b.run("""
        const path = [...document.querySelectorAll('#convergence path.line')].find((p) => p.dataset.series === 'certified bound');
        const end = path.getPointAtLength(path.getTotalLength());
        return [end.x, end.y, [...document.querySelectorAll('#convergence .tick')].map((t) =>
            [t.textContent, +t.getAttribute('x'), +t.getAttribute('y') - 4, t.getAttribute('text-anchor')])]""")
    across = [(float(text.replace(",", "")), at) for text, at, _, anchor in ticks if anchor == "middle"]
    (x0, at0), (x1, at1) = across[0], across[-1]
    check(abs(x0 + (x - at0) / (at1 - at0) * (x1 - x0) - rows[-1][0]) < 1, "ends at", x, across, rows[-1][0])
    check(y < 320, y)


def check_few_iterations_and_near_names(s, b, cells):
    problem = {**SCENE["problem"], "mesh": {"box": {"size": [60, 20], "cells": cells, "element": "tri3"}}}
    job = s.solve({"problem": problem, "solver": {"accuracy": "precise"}})
    check(job["summary"]["iterations"] < 10, "this is about short histories", job)
    b.open(s, f"jobs/{job['id']}")
    names = b.wait("names of levels", """const all = [...document.querySelectorAll('#precision .point-text')];
        return all.length >= 4 && all.map((t) => { const r = t.getBoundingClientRect(); return [t.textContent, r.x, r.y, r.right, r.bottom]; })""")
    for i, (one, left, top, right, bottom) in enumerate(names):
        for other, x, y, end, under in names[:i]:
            # A line of 12 px has boxes of more: its letters are apart where the lines are.
            check(end <= left or x >= right or abs(y - top) >= 11, one, "lies on", other, names)
    levels = {one["level"]: one["relative_error"] for one in s.get(f"/v1/jobs/{job['id']}/work-precision").json["levels"]}
    downwards = [name for name, _, _, _, _ in sorted(names, key=lambda one: one[2])]
    check(downwards == sorted(levels, key=levels.get, reverse=True), "names stand in the order of their errors", downwards, levels)
    b.wait("the convergence", "return document.querySelector('#convergence path.line')")
    ticks = b.run("return [...document.querySelectorAll('#convergence .tick[text-anchor=middle]')].map((t) => t.textContent)")
    check(len(ticks) >= 2 and all(text.isdigit() for text in ticks), "an iteration is a whole number", ticks)
    mesh = b.run("return document.querySelector('#precision path.line.series-2')?.getBoundingClientRect().width")
    check(mesh > 200, "the error of the mesh is a level over the whole width", mesh)


def test_few_iterations_and_near_names_can_be_read(s, b):
    check_few_iterations_and_near_names(s, b, [30, 10])
    check_few_iterations_and_near_names(s, b, [6, 2])  # here balanced asks for less than quick


def test_other_jobs_are_laid_over(s, b):
    job = s.solve(SCENE)
    other = s.solve({**SCENE, "solver": {"method": "accelerated", "accuracy": "quick"}})
    b.open(s, f"jobs/{job['id']}")
    b.wait("curves", "return document.querySelectorAll('#convergence path.line').length === 3")
    b.write("#overlay", "nonsense")
    b.click("#overlay-add")
    b.says("#convergence [role=alert]", "32 digits")
    b.write("#overlay", other["id"])
    b.click("#overlay-add")
    b.wait("six curves", "return document.querySelectorAll('#convergence path.line').length === 6")
    b.shows("#convergence .chart", "--series-2", 100)
    check(other["id"][-8:] in b.text("#convergence .legend") and "accelerated" in b.text("#convergence .legend"), b.text("#convergence .legend"))
    b.click(".overlays button")
    b.wait("three curves again", "return document.querySelectorAll('#convergence path.line').length === 3")


def test_says_in_words_how_good_the_answer_is(s, b):
    job = s.solve({**SCENE, "solver": {"accuracy": "precise"}})
    b.open(s, f"jobs/{job['id']}")
    b.says("#certificate", "The exact answer of its equations differs by at most")
    said = b.text("#certificate").split("at most ")[1].split(" %")[0]
    plain = said.replace("×10", "e").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
    error = job["summary"]["certificate"]["relative_error"]
    check(error <= float(plain) / 100 <= 1.11 * error + 1e-30, said, "of", error)  # never less than the bound
    facts = b.text(".facts")
    for text in ("660 unknowns, 30 contact rows", f"{job['summary']['contact']['active']} of 30 candidates", "condensed operator"):
        check(text in facts, text, facts)
    pieces = b.run("return [...document.querySelectorAll('.timings .piece')].map((p) => p.getBoundingClientRect().width)")
    check(len(pieces) >= 4 and sum(pieces) > 500, pieces)
    check("iterations" in b.text(".timing-keys") and "factorization" in b.text(".timing-keys"), b.text(".timing-keys"))


def test_motions_of_rigid_groups_are_told(s, b):
    request = copy.deepcopy(SCENE)
    request["problem"] |= {"units": {"length": "mm", "force": "N"}, "loads": [{"on": "right", "force": [0, 0], "at": [60, 10], "moment": [5]}]}
    request["problem"]["supports"].append({"on": "right", "rigid": {"point": [60, 10], "ux": 0.001}})
    job = s.post(request, {"Prefer": "wait=30"}).json
    moved = job["summary"]["resultants"]["supports"][1]["rigid"]
    b.open(s, f"jobs/{job['id']}")
    b.says("#rigid caption", "Rigid groups")
    head, cells = (b.run(f"return [...document.querySelectorAll('#rigid {name}')].map((one) => one.innerText)") for name in ("th", "td"))
    check(head == ["On", "Point, mm", "Displacement, mm", "Rotation, degrees", "Force, N", "Moment at the point, N·mm"], head)
    check(cells[:2] == ["right", "(60, 10)"] and len(cells) == 6, cells)
    told = [plain(one) for one in cells[2].strip("()").split(", ")] + [plain(cells[3].strip("()"))]
    check(all(abs(a - c) <= 5e-3 * abs(c) for a, c in zip(told, moved["displacement"] + moved["rotation"])), cells, moved)
    request["problem"]["supports"].pop()
    b.open(s, f"jobs/{s.post(request, {'Prefer': 'wait=30'}).json['id']}")
    b.says("main", "Imbalance")
    check(b.run("return document.querySelector('#rigid') === null"))


def test_an_obstacle_on_the_other_side_is_hinted_at(s, b):
    plane = {"plane": {"point": [0, 0], "normal": [0, -1]}}
    job = s.solve({"problem": {**SCENE["problem"], "contacts": [{"on": "bottom", "obstacle": plane}]}})
    check(job["summary"]["contact"]["active"] == 0, job)
    b.open(s, f"jobs/{job['id']}")
    b.says(".verdict .warn", "normal points to the body")


def test_other_endings_are_said_plainly(s, b):
    limit = s.solve({**SCENE, "solver": {"method": "uzawa", "max_iterations": 3}})
    b.open(s, f"jobs/{limit['id']}")
    b.says(".verdict h2", "Iteration limit")
    check("best answer so far" in b.text(".verdict"), b.text(".verdict"))
    matrices = MATRICES["problem"]
    infeasible = s.solve({"problem": {**matrices, "N": "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 1 -1\n", "h": [-1, -1]}})
    check(infeasible["summary"]["outcome"] == "infeasible", infeasible["summary"])
    b.open(s, f"jobs/{infeasible['id']}")
    b.says(".verdict h2", "Infeasible")
    b.says("#certificate", "It is proved that no displacement")
    failed = s.solve({"problem": {**matrices, "K": matrices["K"].replace("2 2 1\n", "2 2 -1\n")}})
    b.open(s, f"jobs/{failed['id']}")
    b.says(".verdict h2", "not positive definite")
    check("not_positive_definite" in b.text(".verdict"), b.text(".verdict"))


def test_files_are_saved(s, b):
    job = s.solve(SCENE)
    stem = job["id"][-8:]
    b.open(s, f"jobs/{job['id']}")
    b.one(".downloads button")
    for name in b.run("return [...document.querySelectorAll('.downloads button')].map((one) => one.dataset.file)"):
        b.click(f'[data-file="{name}"]')
        content = file_saved(b, name)
        if name.endswith(".json"):
            told = json.loads(content)
            check(told.get("id", told.get("job", job["id"])) == job["id"] and ("problem" in told) == ("request" in name), name)
        elif name.endswith(".csv"):
            check(content == s.get(f"/v1/jobs/{job['id']}/history.csv").body, name)
        else:
            check(xml.etree.ElementTree.fromstring(content).tag.endswith("svg" if name.endswith(".svg") else "VTKFile"), name)
    saved = {path.name for path in pathlib.Path(b.downloads).iterdir()}
    check({f"{stem}-job.json", f"{stem}-result.json", f"{stem}-history.csv", f"{stem}.vtu", f"{stem}-deformed.svg"} <= saved, saved)


def test_its_request_is_edited(s, b):
    job = s.solve({**SCENE, "tags": ["again"]})
    b.open(s, f"jobs/{job['id']}")
    b.says(".verdict h2", "Converged")
    b.click("#edit")
    b.says("#verdict", "Valid")
    written = b.run("return document.querySelector('#job-text').value")
    check(json.loads(written) == json.loads(s.get(f"/v1/jobs/{job['id']}/request").body), written[:300])
    b.click("#submit")
    b.says(".verdict h2", "Converged")
    check(len(s.get("/v1/jobs?tag=again").json["jobs"]) == 2, "it was not submitted again")


def test_refines(s, b):
    job = s.solve({**SCENE, "solver": {"method": "accelerated_restart", "accuracy": "quick"}})
    b.open(s, f"jobs/{job['id']}")
    b.says("#certificate", "at most")
    b.click("#refine")
    b.click(".refine button")
    b.says(".title", f"refines {job['id'][-8:]}")
    b.says(".verdict h2", "Converged")
    newest = s.get("/v1/jobs?limit=1").json["jobs"][0]
    check(newest["summary"]["requested_error"] <= 1e-12 and newest["summary"]["started_from"] == "continued", newest["summary"])


def test_each_load_case_has_its_own(s, b):
    cases = [{"name": name, "loads": [{"on": "top", "traction": [0, -pull]}, {"on": "right", "traction": [0.1, 0]}]}
             for name, pull in (("light", 0.01), ("heavy & <b>", 0.5))]
    job = s.solve({**SCENE, "cases": cases})
    b.open(s, f"jobs/{job['id']}")
    b.one("#case")
    for name in ("light", "heavy & <b>"):
        b.run("const f = document.querySelector('#case'); f.value = arguments[0]; f.dispatchEvent(new Event('change'))", name)
        answer = s.get("/v1/jobs/" + job["id"] + "/result?fields=summary&case=" + name.replace("&", "%26").replace(" ", "%20")).json
        answer = answer.get("summary") if "cases" not in answer else answer["cases"][0]["summary"]
        b.says(".facts", f"{answer['contact']['active']} of 30 candidates")
        b.wait("curves", "return document.querySelectorAll('#convergence path.line').length === 3")


def test_a_large_body_is_loaded_when_it_is_asked_for(s, b):
    request = copy.deepcopy(SCENE)
    request["problem"]["mesh"]["box"]["cells"] = [330, 160]
    request["solver"] = {"accuracy": "quick"}
    job = s.solve(request)
    b.open(s, f"jobs/{job['id']}")
    b.one("#open-body")
    time.sleep(0.5)
    check(not b.run("return document.querySelector('#body canvas, #body img')"), "it is drawn before it was asked for")
    b.click("#open-body")
    b.wait("a picture", "return document.querySelector('#body img, #body canvas, #body svg')")


def test_names_as_long_as_they_may_be_fit_a_phone(s, b):
    """Of a job, a tag, a group and cases, none of which has a place to break."""
    body = copy.deepcopy(SCENE)
    body["problem"]["groups"] = [{"name": "g" * 63, "where": {"y": 0}}]
    body["problem"]["contacts"][0]["on"] = "g" * 63
    body |= {"name": "n" * 63, "tags": ["t" * 60],
             "cases": [{"name": c * 63, "loads": [{"on": "right", "traction": [0.2, 0]}]} for c in "ab"]}
    job = s.solved(body)["id"]
    b.size(360, 740, phone=True)
    b.open(s, f"jobs/{job}")
    b.wait("the cases", "return document.querySelector('#case') && document.querySelector('#convergence .legend .key')")
    wide = b.run("""const hides = (e) => e && (getComputedStyle(e).overflowX !== 'visible' || hides(e.parentElement));
        return [...document.querySelectorAll('main *')].map((e) => [e, e.getBoundingClientRect().right])
            .filter(([e, right]) => right > 361 && !hides(e.parentElement)).map(([e, right]) => `${e.tagName} ${e.id} ${right}`)""")
    check(not wide, wide)


browser.main(globals())
