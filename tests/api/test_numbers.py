"""Every measured number of docs/numbers.md and of the README's blocks is that of its data file, and the tables say what the data does.
usage: test_numbers.py BUILD_DIR [FILTER]"""
import json
import pathlib
import re
import shutil
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "figures"))

import collect  # noqa: E402  the path is set above
import draw  # noqa: E402
import numbers_page as numbers  # noqa: E402
import service  # noqa: E402
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
    for name in missing:
        print(f"# README block {name} has no data yet")


@options(None)
def test_a_changed_number_is_found(s):
    measured()
    with tempfile.TemporaryDirectory() as folder:
        root = copy(folder)
        check(numbers.stale(root)[0] == [], "a copy is as good")
        for name in ("docs/numbers.md", "docs/figures/sizes.csv", "docs/figures/history.svg", "README.md"):
            path = root / name
            text = path.read_text()
            place = re.search(r"numbers:iterations.*?(\d)\d*,\d{3} \|", text, re.S) if name == "README.md" else re.search(r"[^\d](\d)\d*\.\d+", text)
            at = place.start(1)
            path.write_text(text[:at] + str((int(text[at]) + 1) % 10) + text[at + 1:])
            check(numbers.stale(root)[0] == [name], name, numbers.stale(root)[0])
            numbers.write(root)
            check(path.read_text() == text, name, "is not what it was")
        (root / "docs" / "figures" / "old.svg").write_text("<svg/>")
        check(numbers.stale(root)[0] == ["docs/figures/old.svg"])


@options(None)
def test_blocks_without_data_stay(s):
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs" / "figures").mkdir(parents=True)
        text = "a\n<!-- numbers:growth -->\n| by hand |\n<!-- /numbers -->\nb\n"
        (root / "README.md").write_text(text)
        check(numbers.stale(root) == ([], ["growth"]))
        rows = [{"d": 1000, "m": 10, "iterations": 4, "factor_bytes": 2500000, "linear_s": 0.5, "cold_s": 0.25, "cached_s": 0.01}]
        (root / "docs" / "figures" / "bench_size.json").write_text(
            json.dumps({"sizes": rows, "exponents": {"linear": 1.234, "cold": 1.3, "cached": 1.0}}))
        check(numbers.stale(root) == (["README.md"], []))
        numbers.write(root)
        new = (root / "README.md").read_text()
        check("| 1,000 | 0.5 | 0.25 | 0.01 | 0.50 | 4 | 2.5 |" in new and "linear solve 1.23" in new, new)
        check(new.startswith("a\n<!-- numbers:growth -->\n") and new.endswith("<!-- /numbers -->\nb\n"), new)


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


PEERS = {"machine": {"packages": {"octave": "7.3"}}, "time_limit_s": 60,
         "runs": [{"problem": "body/30", "d": 660, "m": 30, "solver": "x", "asked": 1e-7, "seconds": 2.0, "certified": 1e-8, "status": "ok"}],
         "results": [{"problem": "body/30", "d": 660, "m": 30, "solver": "x", "tolerance": 1e-6, "success": True, "seconds": 2.0, "certified": 1e-8, "why": ""},
                     {"problem": "cases/A", "d": 6, "m": 3, "solver": "x", "tolerance": 1e-6, "success": False, "seconds": None, "certified": None,
                      "why": "timed out"}],
         "means": [{"solver": "x", "1e-06": {"solved": 1, "of": 2, "shift_10s": 12.0, "shift_10ms": 3.0}}],
         "body": [{"problem": "body/30", "d": 660, "fastest": "x", "seconds": 2.0, "cold_seconds": 0.5, "cached_seconds": 0.01, "cold": 4.0, "cached": 200.0}],
         "profiles": {"1e-06": {"x": [[1.0, 0.5], [8.0, 0.75]], "uzawa": [[1.0, 1.0]]}}}


@options(None)
def test_other_solvers(s):
    measured()
    with tempfile.TemporaryDirectory() as folder:
        root = copy(folder)
        (root / "peers.json").write_text(json.dumps(PEERS))
        check(collect.collect(root, root / "docs" / "figures", root) == ["peers"])
        with (root / "README.md").open("a") as readme:
            readme.write("<!-- numbers:peers -->\n<!-- /numbers -->\n")
        numbers.write(root)
        check(numbers.stale(root)[0] == [])
        text = (root / "docs" / "numbers.md").read_text()
        check("| NX = 30 | 660 | x | 2 s | 500 ms | 4 | 10 ms | 200 |" in text and "| cases/A | `x` | timed out |" in text, text[-3000:])
        check("| `x` | 1 of 2 | 12 s | 3 s |" in text and "octave 7.3" in text)
        check("| NX = 30 |" in (root / "README.md").read_text())
        check(">x</text>" in (root / "docs" / "figures" / "sizes.svg").read_text())
        xml.etree.ElementTree.fromstring((root / "docs" / "figures" / "peers.svg").read_text())


@options(None)
def test_parts_are_renewed_alone(s):
    old = {"history": [{"rows": [[0, 1, 2]]}], "sizes": [{"nx": 30}], "precision": [{"name": "a", "x": 1}, {"name": "b", "x": 1}]}
    new = collect.figures({"precision": [{"name": "b", "x": 2}]}, old)
    check(new == {**old, "precision": [{"name": "a", "x": 1}, {"name": "b", "x": 2}]}, new)


@options(None)
def test_collected(s):
    rows = [[k, 0, 0] for k in range(5000)]
    thinned = collect.thin(rows)
    check(thinned[0] == rows[0] and thinned[-1] == rows[-1] and 200 < len(thinned) <= collect.KEPT_ROWS + 1, len(thinned))
    check(all(a[0] < b[0] for a, b in zip(thinned, thinned[1:])) and collect.thin(rows[:7]) == rows[:7])
    merged = collect.renewed_rows("ratios")({"ratios": [{"name": "b", "median": 3}]}, {"ratios": [{"name": "a", "median": 1}, {"name": "b", "median": 2}]})
    check([(r["name"], r["median"]) for r in merged["ratios"]] == [("a", 1), ("b", 3)], merged)
    value = {"machine": {"a": 1}, "list": [{"x": 1, "runs": [{"y": 2}]}, {"x": 2}], "none": []}
    check(json.loads(collect.dump(value)) == value)


if __name__ == "__main__":
    service.main(globals())
