"""Every measured number of docs/numbers.md, and those that README.md and the other pages of docs cite, are those of their data files, and
the tables say what the data does.
usage: test_numbers.py BUILD_DIR [FILTER]"""
# not under sanitizers: about tools and tables, with no memory of ours
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "figures"))

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "soak"))

import collect  # noqa: E402  the path is set above
import constants  # noqa: E402
import draw  # noqa: E402
import inline  # noqa: E402
import numbers_page as numbers  # noqa: E402
import page_size  # noqa: E402
import promises  # noqa: E402
import service  # noqa: E402
import service_tables  # noqa: E402
import soak  # noqa: E402
import stamp  # noqa: E402
import svg  # noqa: E402
import tables  # noqa: E402
from service import ROOT, Skip, check, options  # noqa: E402


def copy(folder):
    """What the generator reads and writes, somewhere else."""
    root = pathlib.Path(folder)
    shutil.copytree(ROOT / "docs", root / "docs")
    shutil.copy(ROOT / "README.md", root / "README.md")
    return root


def measured():
    data = numbers.load(ROOT / "docs" / "figures")
    if "figures" not in data:
        raise Skip("no data in docs/figures")
    return data


@options(None)
def test_nothing_is_stale(s):
    wrong, missing = numbers.stale(ROOT)
    check(not wrong, "not what the data gives (make figures):", wrong)
    check(not missing, "a page shows what has no data:", missing)


@options(None)
def test_a_changed_number_is_found(s):
    measured()
    with tempfile.TemporaryDirectory() as folder:
        root = copy(folder)
        check(numbers.stale(root)[0] == [], "a copy is as good")
        for name in ("docs/numbers.md", "docs/figures/sizes.csv", "docs/figures/history.svg", "docs/accuracy.md", "docs/scenes.md"):
            path = root / name
            text = path.read_text()
            cites = name in ("docs/accuracy.md", "docs/scenes.md")
            at = re.search(r"<!-- n:[a-z0-9_.]+ -->[^<\d]*(\d)" if cites else r"[^\d](\d)\d*\.\d+", text).start(1)
            path.write_text(text[:at] + str((int(text[at]) + 1) % 10) + text[at + 1:])
            check(numbers.stale(root)[0] == [name], name, numbers.stale(root)[0])
            numbers.write(root)
            check(path.read_text() == text, name, "is not what it was")
        (root / "docs" / "figures" / "old.svg").write_text("<svg/>")
        check(numbers.stale(root)[0] == ["docs/figures/old.svg"])


def one_digit_more(text, begin, end):
    """The text with the first digit between these places changed; None where there is none."""
    found = re.compile(r"\d").search(text, begin, end)
    return found and f"{text[:found.start()]}{(int(found[0]) + 1) % 10}{text[found.end():]}"


@options(None)
def test_every_mark_is_written_from_data(s):
    data, used = measured(), set()
    for path in numbers.pages(ROOT):
        text = path.read_text()
        for found in inline.MARK.finditer(text):
            changed = one_digit_more(text, *found.span(2))
            check(changed and changed != text and inline.fill(changed, data) == (text, []), path.name, found[1])
            used.add(found[1])
        check(not re.search("^ *<!-- n:", text, re.M), path.name, "has a mark at the beginning of a line: Markdown ends the paragraph there")
        check(len(inline.MARK.findall(text)) == len(re.findall("<!-- (?:n:|/n)", re.sub("`[^`\n]*`", "", text))) / 2, path.name, "has a mark that is not whole, or broken over two lines")
    check(used == {*inline.VALUES}, "made, but on no page, or the other way round")


@options(None)
def test_every_data_file_shows_on_a_page(s):
    data = measured()
    files = numbers.figure_files(data)

    def shown(data):
        return [numbers.page(data, files)] + [inline.fill(path.read_text(), data)[0] for path in numbers.pages(ROOT)]

    before = shown(data)
    for part, value in (("soak", lambda d: d["rows"][0]["figures"]), ("bench_size", lambda d: d["sizes"][0]), ("gallery", lambda d: d["scenes"][0]),
                        ("page", lambda d: d), ("theory", lambda d: d["cook"][0])):
        changed = json.loads(json.dumps(data))
        row = value(changed[part])
        for key in row:
            row[key] = row[key] * 3 + 7 if isinstance(row[key], (int, float)) else row[key]
        check(shown(changed) != before, part)


@options()
def test_no_number_is_typed_by_hand(s):
    """What has a unit, a point, an exponent or four digits is in a mark, or one of the constants, which are the program's own."""
    pages = {path.name: path.read_text() for path in numbers.pages(ROOT) if path.name != "scenes.md"}  # made of scenes.in.md and the schema
    check({"README.md", "scenes.in.md", "http.md", "operations.md", "theory.md", "accuracy.md"} <= set(pages), sorted(pages))
    left, unused = constants.unexplained(pages)
    check(not left, "measured? then in a mark (tests/figures/inline.py), else in tests/figures/constants.py:", left)
    check(not unused, "on no page any more:", unused)
    program = constants.Program(ROOT, s.get("/v1/limits").json["limits"])
    check(constants.wrong(program) == [], constants.wrong(program))
    program.limits["max_body"]["value"] += 1
    check(constants.wrong(program) == ["A request body may have 64 MiB"], constants.wrong(program))
    for typed in ("solves in 25 ms", "3.5 times faster", "needs 12 MB", "certified to 4e-14", "1,209 jobs", "1209 clients", "about 2 % of it", "`x` 7 s"):
        found, _ = constants.unexplained({**pages, "a.md": "It " + typed + ".\n"})
        check(len(found) == 1, typed, found)
    for free in ("<!-- n:x -->25 ms<!-- /n -->", "`sleep 25 s`", "[x](http://h/2.5)", "```sh\nsleep 2.5\n```", "a 60 x 20 body", "quad4, 3 dofs of each"[:5], "a 60 x\n20 body"):
        check(constants.unexplained({**pages, "a.md": "It " + free + "\n"})[0] == [], free)


@options(None)
def test_soak_runs_keep_the_rows_of_others(s):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "soak.json"
        path.write_text(json.dumps({"rows": [{"name": "cancel", "figures": "as text, of an older program"}]}))
        for name, lost in (("cancel", 1), ("500 x kill -9, 16 posting clients", 2), ("cancel", 3), ("new", 4)):
            soak.keep(path, {"name": name, "figures": {"lost": lost}})
        rows = json.loads(path.read_text())["rows"]
        check([(row["name"], row["figures"]["lost"]) for row in rows] == [("500 x kill -9, 16 posting clients", 2), ("cancel", 3), ("new", 4)], rows)


@options(None)
def test_soak_rows_as_text(s):
    names = {name for name, _ in soak.RUNS}
    check(set(service_tables.SHOWN) == names, "a run has no words of its own on the page")
    check({row["name"] for row in measured()["soak"]["rows"]} <= names, "figures of a run that there is not any more")
    row = {"name": "cancel", "figures": {"errors": 0, "p50_ms": 2.0, "p99_ms": 63.0}, "stamp": {"load": 0.2, "others": 0.1}}
    lines = service_tables.soak({"soak": {"rows": [row]}})
    check(lines[2] == "| cancel of a running job while it iterates | p50 2 ms, p99 63 ms |" and not any("†" in line for line in lines), lines)
    check(lines[-1].startswith("| cancel | errors 0, p50_ms 2.0, p99_ms 63.0 |"), lines)
    row["stamp"]["others"], row["wrong"], row["figures"]["errors"] = 1.5, ["errors"], 3
    lines = service_tables.soak({"soak": {"rows": [row, {"name": "another", "figures": {"a": 1, "b": {"c": 2}}, "stamp": {"load": 9}}]}})
    check("**WRONG** **3 errors** †" in lines[2] and lines[3] == "| another | a 1, b.c 2 † |" and lines[-1].startswith("†"), lines)


@options(None)
def test_promises_are_computed(s):
    body = [{"problem": "body/240", "cold": 4.99, "cached": 50.0, "cold_seconds": 1}, {"problem": "body/480", "cold": None, "cold_seconds": 1, "cached": 49.9}]
    kept = {(what, target): verdict for what, target, _, verdict, _ in promises.peers({"peers": {"body": body}})}
    ours = "paper's body, NX = {}: the fastest other solver over ours {}".format
    check(kept[ours(240, "cold"), "at least 5 x"] is False and kept[ours(240, "with the factor cached"), "at least 50 x"] is True, kept)
    check(kept[ours(480, "cold"), "at least 8 x"] is True and kept[ours(480, "with the factor cached"), "at least 50 x"] is False, kept)
    check(kept[ours(600, "cold"), "at least 8 x"] is None, kept)
    data = measured()
    check({name for name, *_ in promises.SERVICE} <= {name for name, _ in soak.RUNS}, "a promise about a run that there is not")
    for row in data["soak"]["rows"]:
        fine = sum(verdict is True for *_, verdict, _ in promises.service(data))
        bad = json.loads(json.dumps(data))
        next(one for one in bad["soak"]["rows"] if one["name"] == row["name"])["wrong"] = ["lost"]
        of_it = sum(name == row["name"] for name, *_ in promises.SERVICE)
        check(sum(verdict is True for *_, verdict, _ in promises.service(bad)) == fine - of_it, row["name"])
        bad["soak"]["rows"] = [one for one in bad["soak"]["rows"] if one["name"] != row["name"]]
        check(sum(verdict is None for *_, verdict, _ in promises.service(bad)) >= of_it, row["name"])
    check("**missed**" in "".join(promises.lines({"peers": {"body": body, "machine": {"load": 0}}})))


@options(None)
def test_beside_other_work(s):
    for one, beside in (({"load": 9, "others": 0.1}, False), ({"load": 0, "others": 0.5}, True), ({"load": 1.5}, False), ({"load": 3}, True), ({}, True)):
        check(stamp.beside_other_work(one) == beside, one)
    watch = stamp.Watch()
    one = watch.stamp(ROOT)
    check(one["others"] >= 0 and one["load"] >= 0 and re.match(r"[0-9a-f]{12}\+?$|unknown$", one["commit"]), one)
    note = numbers.tables.beside({"bench": {"machine": {"load": 0}, "ratios": [{"name": "a", "stamp": {"load": 3}}, {"name": "b"}]}}, "bench", "ratios")
    check(note == ["", "Measured beside other work (load 3)."], note)
    check(numbers.tables.beside({"bench": {"machine": {"load": 0}, "ratios": [{"name": "a", "stamp": {"load": 3}}]}}, "bench", "ratios", ("b",)) == [])


@options(None)
def test_measured_by_parts(s):
    """Two runs of a part each leave both; one that fails leaves what was there."""
    def run(folder, text, *more, status=0):
        program = f"import pathlib, sys; pathlib.Path(sys.argv[1]).write_text({text!r}); sys.exit({status})"
        path = str(pathlib.Path(folder) / "bench.json")
        ran = subprocess.run([sys.executable, "-B", ROOT / "tests/figures/measure.py", folder, "bench", *more, sys.executable, "-c", program, path], check=False)
        check(ran.returncode == status, ran)
        return json.loads(pathlib.Path(path).read_text())

    with tempfile.TemporaryDirectory() as folder:
        first = run(folder, '{"ratios": [{"name": "a", "median": 1}, {"name": "b", "median": 2}], "instructions": []}')
        check(first["stamp"]["cores"] >= 1 and "stamp" not in first["ratios"][0], first)
        path = pathlib.Path(folder) / "bench.json"
        path.write_text(json.dumps({**first, "stamp": {**first["stamp"], "load": 99}}))
        second = run(folder, '{"ratios": [{"name": "b", "median": 3}]}', "--part")
        check(second["ratios"][0]["stamp"]["load"] == 99 and second["stamp"]["load"] == second["ratios"][1]["stamp"]["load"] != 99, second)
        check([(row["name"], row["median"]) for row in second["ratios"]] == [("a", 1), ("b", 3)] and second["ratios"][1]["stamp"]["commit"], second)
        check(second["instructions"] == [] and second["whole"], second)
        check(run(folder, "not JSON", "--part", status=3) == second)
        check((pathlib.Path(folder) / "bench.failed.json").read_text() == "not JSON")
        third = run(folder, '{"ratios": [{"name": "c", "median": 3}]}')
        check([row["name"] for row in third["ratios"]] == ["c"], third)
        docs = pathlib.Path(folder) / "docs"
        for text, more, names in (('{"ratios": [{"name": "a"}, {"name": "b"}]}', (), "ab"), ('{"ratios": [{"name": "c"}]}', (), "c")):
            run(folder, text, *more)  # a whole run leaves nothing of the ones before
            collect.collect(folder, docs)
            check("".join(row["name"] for row in json.loads((docs / "bench.json").read_text())["ratios"]) == names, names)
        path.unlink()
        check("whole" in run(folder, '{"ratios": [{"name": "d"}]}', "--part"))
        collect.collect(folder, docs)
        check([row["name"] for row in json.loads((docs / "bench.json").read_text())["ratios"]] == ["c", "d"])


@options(None)
def test_of_two_measurements_the_newer_counts(s):
    """Whatever the times of the files say: a checkout makes new files of old data."""
    def row(name, value, measured):
        return {"name": name, "figures": {"lost": value}, "stamp": {"measured": measured}}

    with tempfile.TemporaryDirectory() as name:
        build, docs = pathlib.Path(name), pathlib.Path(name) / "docs"
        (build / "soak.json").write_text(json.dumps({"rows": [row("a", 1, "2026-01-02"), row("b", 1, "2026-01-02")]}))
        (build / "theory.json").write_text(json.dumps({"stamp": {"measured": "2026-01-02"}, "rows": [1]}))
        check(collect.collect(build, docs) == ["theory", "soak"] and collect.collect(build, docs) == [])
        (build / "soak.json").write_text(json.dumps({"rows": [row("a", 2, "2026-01-01"), row("b", 2, "2026-01-03")]}))
        (build / "theory.json").write_text(json.dumps({"stamp": {"measured": "2026-01-01"}, "rows": [2]}))
        check(collect.collect(build, docs) == ["soak"])
        check([one["figures"]["lost"] for one in json.loads((docs / "soak.json").read_text())["rows"]] == [1, 2])
        check(json.loads((docs / "theory.json").read_text())["rows"] == [1])


@options(None)
def test_page_size(s):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for file, text in (("index.html", ""), ("page-X.css", ""), ("main-X.js", 'import{a as b}from"./chunk-A.js";import"./chunk-B.js";x(()=>import("./job-X.js"))'),
                           ("chunk-A.js", ""), ("chunk-B.js", 'import{c}from"./chunk-A.js"'), ("job-X.js", "")):
            (folder / file).write_text(text)
        check(sorted(page_size.loaded(folder, "main-*.js")) == ["chunk-A.js", "chunk-B.js", "index.html", "main-X.js", "page-X.css"])


@options(None)
def test_marks_without_data_stay(s):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs" / "figures").mkdir(parents=True)
        (root / "README.md").write_text("nothing\n")
        (root / "docs" / "a.md").write_text("a <!-- n:linear.100000 -->by hand<!-- /n --> b\n")
        check(numbers.stale(root) == ([], ["docs/a.md: n:linear.100000"]))
        rows = [{"d": d, "m": 10, "iterations": 4, "factor_bytes": 2500000, "linear_s": 0.5 * (d / 1000) ** 1.5, "cold_s": 0.25, "cached_s": 0.01}
                for d in (10, 100, 1000, 10000)]
        data = {"machine": {"load": 0.5}, "sizes": rows}
        (root / "docs" / "figures" / "bench_size.json").write_text(json.dumps(data))
        check(numbers.stale(root) == (["docs/a.md"], []))
        numbers.write(root)
        check((root / "docs" / "a.md").read_text() == "a <!-- n:linear.100000 -->16 s at 10,000 dofs<!-- /n --> b\n")
        new = "\n".join(numbers.timed(tables.growth({"bench_size": data}), {"bench_size": data}, "bench_size", "sizes"))
        check("| 1,000 | 0.5 | 0.25 | 0.01 | 0.50 | 4 | 2.5 |" in new and "linear solve 1.50, cold 0.00" in new and "beside" not in new, new)


@options(None)
def test_prose_is_wrapped(s):
    long = " ".join(["word"] * 60)
    text = numbers.wrapped(f"## {long}\n\n{long}\n\n| {long} |\n")
    lines = text.split("\n")
    check(lines[0] == f"## {long}" and lines[-2] == f"| {long} |" and " ".join(lines[2:-3]) == long, text)
    check(all(len(line) < 120 for line in lines[2:-3]) and len(lines) == 8, text)


@options(None)
def test_no_run_claims_too_much(s):
    """The bound that an answer carries is never below its error."""
    data = measured()
    checked = 0
    for problem in data["figures"]["precision"]:
        check(tables.false_claims(problem) == [], problem["name"], tables.false_claims(problem))
        check(problem["reference_change"] < 1e-20, problem["name"], problem["reference_change"])
        for run in problem["runs"]:
            if run["outcome"] == "converged":
                check(run["certified"] <= run["requested"] or run["level"] == "exact", run)
                checked += 1
    check(checked > 100, checked)
    claim = {"runs": [{"certified": 1e-6, "energy_error": 2e-6}, {"certified": 1e-6, "energy_error": 1e-7}]}
    check(tables.false_claims(claim) == claim["runs"][:1])


@options(None)
def test_figures_are_svg(s):
    for path in sorted((ROOT / "docs" / "figures").glob("*.svg")):
        root = xml.etree.ElementTree.fromstring(path.read_text())
        width, height = float(root.get("width")), float(root.get("height"))
        found = list(root.iter("{http://www.w3.org/2000/svg}text"))
        check(len(found) > 20, path)
        for text in found:
            x, y = float(text.get("x")), float(text.get("y"))
            check(0 <= x <= width and 0 <= y <= height, path, text.text, x, y)


@options(None)
def test_numbers_as_text(s):
    got = [tables.sig(v) for v in (None, 0, 0.0123, 1.26, 12.6, 99.7, 126, 12600, 1.2e-9, 9.96e-5, 2.5e-5)]
    check(got == ["–", "0", "0.012", "1.3", "13", "100", "126", "12,600", "1.2e-9", "0.0001", "2.5e-5"], got)
    got = [tables.duration(v) for v in (2.5, 1.0, 0.0123, 0.99999, 4.2e-5, None)]
    check(got == ["2.5 s", "1 s", "12 ms", "1 s", "42 µs", "–"], got)
    check(tables.percent(0.0213) == "2.1 %")


@options(None)
def test_axes(s):
    axis = svg.Log(2e-4, 0.5)
    check([v for v, _ in axis.ticks()] == [1e-4, 1e-3, 1e-2, 1e-1, 1.0] and abs(axis.at(1e-2) - 0.5) < 1e-12 and axis.at(0) == 0)
    check([label for _, label in svg.Linear(-0.3, 1.1).ticks()][:2] == ["−0.4", "−0.2"] or svg.Linear(-0.3, 1.1).low <= -0.3)
    check(svg.Count(30).at(0) == 0 and svg.Count(30).at(30) == 1)


@options(None)
def test_peers_are_drawn_where_certified(s):
    rows = [{"solver": "a", "nx": 60, "d": 2520, "seconds": 3.0, "certified": 1e-7}, {"solver": "a", "nx": 60, "d": 2520, "seconds": 2.0, "certified": 1e-8},
            {"solver": "a", "nx": 30, "d": 660, "seconds": 1.0, "certified": 1e-6}, {"solver": "a", "nx": 60, "d": 2520, "seconds": 0.1, "certified": 1e-3},
            {"solver": "b", "nx": 30, "d": 660, "seconds": 1.0, "certified": None}, {"solver": "c", "d": 5, "seconds": 1.0, "certified": 1e-9}]
    found = draw.peers_of(rows)
    check(list(found) == ["a"] and [r["seconds"] for r in found["a"]] == [1.0, 2.0], found)
    data = measured()["figures"]["sizes"]
    check(">a</text>" in draw.sizes(data, rows) and ">a</text>" not in draw.sizes(data, []))


PEERS = {"packages": {"octave": "7.3"}, "time_limit_s": 60,
         "runs": [{"problem": "body/30", "d": 660, "m": 30, "solver": "x", "asked": 1e-7, "seconds": 2.0, "certified": 1e-8, "status": "ok"}],
         "results": [{"problem": "body/30", "d": 660, "m": 30, "solver": "x", "tolerance": 1e-6, "success": True, "seconds": 2.0, "certified": 1e-8, "why": ""},
                     {"problem": "cases/A", "d": 6, "m": 3, "solver": "x", "tolerance": 1e-6, "success": False, "seconds": None, "certified": None,
                      "why": "timed out"}],
         "means": [{"solver": name, "1e-06": {"solved": 1, "of": 2, "shift_10s": 12.0, "shift_10ms": 3.0}} for name in ("uzawa", "x")],
         "body": [{"problem": "body/30", "d": 660, "fastest": "x", "seconds": 2.0, "cold_seconds": 0.5, "cached_seconds": 0.01, "cold": 4.0, "cached": 200.0}],
         "profiles": {"1e-06": {"x": [[1.0, 0.5], [8.0, 0.75]], "uzawa": [[1.0, 1.0]]}}}


@options(None)
def test_other_solvers(s):
    measured()
    with tempfile.TemporaryDirectory() as folder:
        root = copy(folder)
        when = {**stamp.machine(), "measured": "9999-01-01 00:00 UTC", "commit": "abc", "load": 0.5, "others": 0.0}
        (root / "peers.json").write_text(json.dumps({**PEERS, "stamp": when}))
        check(collect.collect(root, root / "docs" / "figures") == ["peers"])
        numbers.write(root)
        check(numbers.stale(root)[0] == [])
        text = (root / "docs" / "numbers.md").read_text()
        check("| NX = 30 | 660 | x | 2 s | 500 ms | 4 | 10 ms | 200 |" in text and "| cases/A | `x` | timed out |" in text, text[-3000:])
        check("| `x` | 1 of 2 | 12 s | 3 s |" in text and "octave 7.3" in text)
        check("-->4 to 4 times<!--" in (root / "docs" / "comparison.md").read_text())
        check(">x</text>" in (root / "docs" / "figures" / "sizes.svg").read_text())
        xml.etree.ElementTree.fromstring((root / "docs" / "figures" / "peers.svg").read_text())


@options(None)
def test_parts_are_renewed_alone(s):
    old = {"history": [{"rows": [[0, 1, 2]]}], "sizes": [{"nx": 30}], "precision": [{"name": "a", "x": 1}, {"name": "b", "x": 1}]}
    new = collect.figures({"precision": [{"name": "b", "x": 2}]}, {**old, "machine": {"load": 7, "cores": 2}}, {"load": 1})
    check([(p["name"], p["x"], p["stamp"]) for p in new["precision"]] == [("a", 1, {"load": 7}), ("b", 2, {"load": 1})], new)
    check(new["sizes"] == [{"nx": 30, "stamp": {"load": 7}}] and new["history"][0]["rows"] == [[0, 1, 2]], new)


@options(None)
def test_collected(s):
    rows = [[k, 0, 0] for k in range(5000)]
    thinned = collect.thin(rows)
    check(thinned[0] == rows[0] and thinned[-1] == rows[-1] and 200 < len(thinned) <= collect.KEPT_ROWS + 1, len(thinned))
    check(all(a[0] < b[0] for a, b in zip(thinned, thinned[1:])) and collect.thin(rows[:7]) == rows[:7])
    merged = collect.renewed_rows("ratios")({"ratios": [{"name": "b", "median": 3}]}, {"machine": {"load": 5}, "ratios": [{"name": "a", "median": 1},
                                                                                   {"name": "b", "median": 2}]}, {"load": 1})
    check([(r["name"], r["median"], r["stamp"]) for r in merged["ratios"]] == [("a", 1, {"load": 5}), ("b", 3, {"load": 1})], merged)
    value = {"machine": {"a": 1}, "list": [{"x": 1, "runs": [{"y": 2}]}, {"x": 2}], "none": []}
    check(json.loads(collect.dump(value)) == value)


if __name__ == "__main__":
    service.main(globals())
