"""The comparison with other solvers: what it makes of runs, and a run of our solver alone. usage: test_peers.py BUILD_DIR [FILTER]"""
# not under sanitizers: about tables, of solves that other tests make
import csv
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

import service
from service import ROOT, check, options

sys.path.insert(0, str(ROOT / "tests/peers"))
import decks  # noqa: E402
import peers  # noqa: E402
import stats  # noqa: E402
import draw  # noqa: E402  of tests/figures, whose path peers adds
from worker import Ended, Worker  # noqa: E402

BUILD = pathlib.Path(sys.argv[1])


def run(solver, seconds, certified, asked=1e-6, status="ok", problem="body/120"):
    return {"problem": problem, "d": 9840, "m": 120, "solver": solver, "asked": asked, "seconds": seconds,
            "setup": 0.0, "iterations": 1, "certified": certified, "status": status}


def python(text, megabytes=0):
    """A peer whose answer to each line is the Python text."""
    return Worker([sys.executable, "-c", f"import sys\nprint('{{\"status\": \"ready\"}}', flush=True)\n"
                                         f"for line in sys.stdin:\n    {text}"], megabytes)


def how_it_ended(worker, limit=60):
    try:
        worker.ask("x", 1.0, "nowhere", limit)
    except Ended as why:
        return str(why)
    finally:
        worker.close()
    return "answered"


@options(None)
def test_shifted_geometric_mean(_):
    check(abs(stats.shifted_geometric_mean([1.0, 4.0], 0.0) - 2.0) < 1e-12)
    check(abs(stats.shifted_geometric_mean([2.0, 14.0], 2.0) - 6.0) < 1e-12)
    check(abs(stats.shifted_geometric_mean([5.0] * 7, 10.0) - 5.0) < 1e-12)
    check(math.isnan(stats.shifted_geometric_mean([], 10.0)))


def test_a_deck_with_a_stiff_contact(server):
    """Only its contact is another one."""
    head = "*NODE\n" + "".join(f"{k + 1}, {x}, {y}\n" for k, (x, y) in enumerate([(0, 0), (2, 0), (2, 1), (0, 1), (0, 1), (2, 1), (2, 3), (0, 3)]))
    head += "*ELEMENT, TYPE=CPE4, ELSET=E\n1, 1, 2, 3, 4\n2, 5, 6, 7, 8\n*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=E, MATERIAL=M\n"
    head += "*SURFACE, NAME=S\n2, S1\n*SURFACE, NAME=T\n1, S3\n*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nS, T\n*SURFACE INTERACTION, NAME=I\n"
    tail = "*STEP\n*STATIC\n*BOUNDARY\n1, 1, 2\n*END STEP\n"
    request, numbers, left = decks.translate(server, head + tail)
    check(numbers == list(range(1, 9)) and not left and request["problem"]["contacts"] == [{"on": "S", "with": "T"}], request)
    check(decks.translate(server, head + tail + "*STEP\n*STATIC\n*END STEP\n")[2][0].startswith("*STEP"), head)
    try:
        decks.translate(server, head + "*FRICTION\n0.1\n" + tail)
        check(False, "friction was left out")
    except decks.Unsaid as why:
        check("*FRICTION" in str(why), why)
    check(decks.first_step(head + tail + "*STEP\n", [1, 2]).endswith("1, 1, 2\n*NODE PRINT, NSET=COMPARED, FREQUENCY=100000\nU\n*END STEP\n"))
    for own in ("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD\n** of its own\n", "*Surface behavior, pressure-overclosure=LINEAR\n1.E7, 3.\n"):
        text = decks.stiffened(head + own + tail, request, 100)
        check("=LINEAR\n50000\n" in text and "1.E7" not in text and text.startswith(head) and text.endswith(tail), text)


@options(None)
def test_performance_profile(_):
    """Three problems: a is fastest on two and fails on the third, b takes twice as long, nobody solves the fourth."""
    times = {"a": {"1": 1.0, "2": 2.0, "3": None, "4": None}, "b": {"1": 2.0, "2": 2.0, "3": 5.0, "4": None}}
    profile = stats.performance_profile(times)
    check(profile["a"] == [(1.0, 0.5)], profile)
    check(profile["b"] == [(1.0, 0.5), (2.0, 0.75)], profile)


@options(None)
def test_success_means_certified(_):
    """The fastest run that is certified counts, whatever a solver says of itself; ours only where it was asked for it."""
    runs = [run("x", 1.0, 1e-2), run("x", 2.0, 1e-7), run("x", 3.0, 1e-12, asked=1e-9), run("x", 0.5, None)]
    check(stats.best(runs, 1e-3)["seconds"] == 2.0)
    check(stats.best(runs, 1e-9)["seconds"] == 3.0)
    check(stats.best(runs, 1e-13) is None)
    check(stats.best([run("x", 1.0, 1e-12, asked=1e-3)], 1e-9, strict=True) is None)
    why = stats.why_not([run("x", 1.0, 1e-2), run("x", None, None, status="timed out")], 1e-3)
    check(why == "certified 1.0e-02 only, timed out", why)


@options(None)
def test_failures_are_listed_and_cost_the_limit(_):
    solvers = [s for s in peers.solvers() if s.name in ("uzawa", "ipopt", "clp")]
    runs = [run("uzawa", 0.1, 1e-9, asked=1e-9), run("ipopt", 2.0, 1e-7), run("ipopt", 1.5, 1e-7),
            run("clp", None, None, status="timed out")]
    rows = peers.results(runs, solvers)
    check(len(rows) == 3 * len(peers.TOLERANCES), rows)
    clp = [row for row in rows if row["solver"] == "clp"]
    check(all(not row["success"] and row["why"] == "timed out" for row in clp), clp)
    mean = {entry["solver"]: entry["1e-06"] for entry in peers.means(rows, 30.0)}
    check(mean["clp"]["solved"] == 0 and abs(mean["clp"]["shift_10s"] - 30.0) < 1e-9, mean)
    body = peers.body_ratios(rows)[0]
    check(body["fastest"] == "ipopt" and abs(body["cold"] - 15.0) < 1e-9 and body["cached"] is None, body)


@options(None)
def test_where_the_time_went(_):
    runs = [{**run("x", 2.0, 1e-9), "setup": 0.5}, run("x", None, None, status="timed out"), run("y", 1.0, 1e-9),
            {**run("y", None, None, status="not run: timed out at body/60"), "setup": None}]
    check(peers.spent(runs, 20.0) == {"x": 21.5, "y": 1.0}, peers.spent(runs, 20.0))


@options(None)
def test_stalled_ladder_ends(_):
    check(not peers.stalled([run("x", 1, 1e-2), run("x", 1, 1e-3)]))
    check(not peers.stalled([run("x", 1, 1e-2), run("x", 1, 1e-2), run("x", 1, 1e-3)]))
    check(peers.stalled([run("x", 1, 1e-4), run("x", 1, None), run("x", 1, 9e-5)]))


@options(None)
def test_table_lines_up(_):
    text = stats.table(["name", "s"], [["a", "1"], ["long name", "12.5"]]).split("\n")
    check(text[0] == "name          s" and text[3] == "long name  12.5", text)
    check(stats.number(None) == "-" and stats.number(0.012345) == "0.0123")


@options(None)
def test_limits_of_a_process(_):
    check(how_it_ended(python("print('noise')\n    print('{}', flush=True)")) == "answered")
    check(how_it_ended(python("while True: pass"), 1) == "timed out")
    check(how_it_ended(python("sys.exit(3)")).startswith("exit status 3"))
    check(how_it_ended(python("import os; os.abort()")) == "died of signal 6")
    check(how_it_ended(python("x = bytearray(1 << 30)", 600)) == "out of memory")
    try:
        Worker(["no-such-solver"], 0)
        check(False, "a program that is not there was started")
    except Ended as why:
        check(str(why) == "not installed", why)


@options(None)
def test_charts_are_svg(_):
    text = draw.profiles({"1e-06": {"a < b & c": [(1, 0.1), (100, 1.0)]}})
    root = xml.etree.ElementTree.fromstring(text)
    curves = [e.get("d") for e in root.iter() if e.tag.endswith("path") and e.get("stroke") == draw.PROFILE_COLOURS[0]]
    check(len(curves) == 1, text)
    corners = [[float(x) for x in place.split()] for place in curves[0][1:].split("L")]
    (left, bottom), (right, top) = corners[0], corners[-1]
    check(right - left == 260 and bottom - top == 260, "from the lower left corner to the upper right one", corners)
    check(corners[1] == [left, bottom - 26] and corners[2] == [right, bottom - 26], "in steps", corners)
    check(draw.Log(1, 100).at(0) == 0 and draw.Log(1, 100).at(10) == 0.5)


@options(None)
def test_wrong_answers_are_not_certified(_):
    """The body's own r = 0 and u = 0 are no solution, and neither is an r that pulls."""
    with tempfile.TemporaryDirectory() as folder:
        problem, answer = pathlib.Path(folder) / "problem", pathlib.Path(folder) / "answer"
        lab = BUILD / "peers/lab"
        size = json.loads(subprocess.run([lab, "write", "body/30", problem], check=True, stdout=subprocess.PIPE).stdout)
        check(size == {"d": 660, "m": 30}, size)
        judge = Worker([lab, "serve", "body/30", problem, "500"], 0)
        for value, with_u in ((0.0, True), (0.0, False), (1.0, False)):
            numbers = [0.0] * (660 if with_u else 0) + [value] * 30
            answer.write_bytes(struct.pack("=4q", 660, 30, with_u, 1) + struct.pack(f"={len(numbers)}d", *numbers))
            bound = float(judge.ask("certify", 0.0, answer, 60)["status"])
            check(bound > 1e-2, value, with_u, bound)
        answer.write_bytes(b"short")
        check(judge.ask("certify", 0.0, answer, 60)["status"] == "no answer to certify")
        judge.close()


@options(None)
def test_our_own_runs(_):
    """The whole driver without a peer: a body and a generated problem, every file that it writes."""
    def run_peers(out, *more):
        done = subprocess.run([sys.executable, "-B", ROOT / "tests/peers/peers.py", BUILD, "ONLY=uzawa", "MEMORY=0", "SIZES=30", "TIME=60",
                               f"OUT={out}", *more], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        check(done.returncode == 0, done.stdout)
        check("The paper's body at certified 1e-6" in done.stdout, done.stdout)
        return json.loads((out / "peers.json").read_text())

    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "not" / "there"
        report = run_peers(out, "PROBLEMS=body/,degenerate/vertex_20")
        check(len(report["runs"]) == 2 * 2 * 3 and len(report["results"]) == 12, len(report["runs"]))
        for row in report["results"]:
            check(row["success"] and row["certified"] <= row["tolerance"] and row["asked"] <= row["tolerance"], row)
        for name, rows in (("peers.csv", 12), ("peers-results.csv", 12)):
            with open(out / name) as file:
                check(len(list(csv.DictReader(file))) == rows, name)
        xml.etree.ElementTree.parse(out / "peers-profile-1e-06.svg")
        again = run_peers(out, "PROBLEMS=vertex_20")  # a part renews its own rows

        def of(one, problem):
            return [run for run in one["runs"] if run["problem"] == problem]
        check(of(again, "body/30") == of(report, "body/30") and of(again, "degenerate/vertex_20") != of(report, "degenerate/vertex_20"))
        check([row["name"] for row in again["problems"]] == ["body/30", "degenerate/vertex_20"] and len(again["results"]) == 12, again["problems"])
        check(again["problems"][0] == report["problems"][0] and again["problems"][1]["stamp"]["others"] >= 0, again["problems"])


class FakeProblem:
    """What a ladder asks of a problem; the answers are there and certified to 1e-2."""
    name, d, m = "body/30", 660, 30

    def __init__(self, folder):
        self.answer = pathlib.Path(folder) / "answer"

    def certify(self):
        return 1e-2, 0.0


@options(None)
def test_a_run_at_its_limit_is_not_repeated(_):
    """A tighter tolerance would make the same run again: it is listed, not made. Other ends are followed by all tolerances."""
    solver = next(one for one in peers.solvers() if one.name == "siconos_psor")
    for status, made in (("Siconos info 1", 1), ("ok", len(solver.fine))):
        with tempfile.TemporaryDirectory() as folder:
            settings = peers.Options([str(BUILD), f"OUT={folder}"])
            comparison, problem = peers.Comparison(settings), FakeProblem(folder)
            worker = python(f"open('{problem.answer}', 'w'); print('{{\"status\": \"{status}\", \"seconds\": 1.0, \"iterations\": 7}}', flush=True)")
            comparison.ladder(worker, problem, solver, 0.0, 99)
            worker.close()
        asked = [one["asked"] for one in comparison.runs]
        check(asked == solver.fine, asked)
        check(sum(one["certified"] is not None for one in comparison.runs) == made, comparison.runs)
        if made == 1:
            check(comparison.runs[1]["status"] == "not run: at its limit of iterations for 0.001 already", comparison.runs[1])
            check(stats.why_not(comparison.runs, 1e-6).startswith("certified 1.0e-02 only, not run"), stats.why_not(comparison.runs, 1e-6))


@options(None)
def test_generated_problems_are_solved(_):
    """Each has an answer that is certified; the sizes of the smallest are what their names say."""
    names = subprocess.run([BUILD / "peers/lab", "list"], check=True, stdout=subprocess.PIPE, text=True).stdout.split()
    check({name.split("/")[0] for name in names} == {"rank_deficient", "degenerate", "near_singular"}, names)
    with tempfile.TemporaryDirectory() as folder:
        problem, answer = pathlib.Path(folder) / "problem", pathlib.Path(folder) / "answer"
        for name in names:
            subprocess.run([BUILD / "peers/lab", "write", name, problem], check=True, stdout=subprocess.PIPE)
            lab = Worker([BUILD / "peers/lab", "serve", name, problem, "500"], 0)
            reply = lab.ask("cold", 1e-3, answer, 300)
            check(reply["status"] == "ok", name, reply)
            check(float(lab.ask("certify", 0.0, answer, 300)["status"]) <= 1e-3, name)
            lab.close()


service.main(globals())
