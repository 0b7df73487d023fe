"""Every command of the client against the real daemon. usage: test_client.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import csv
import gzip
import hashlib
import json
import os
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import PATIENT_S, check, options

SHARED = True  # one service for all tests

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
PAPER, SPRINGS = "tests/data/paper_body.json", "tests/data/small_matrices.json"
# No displacement can satisfy both rows: u1 <= -1 and -u1 <= -1.
IMPOSSIBLE = {"problem": {"kind": "matrices",
                          "K": "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1\n2 2 1\n",
                          "N": "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n2 1 -1\n",
                          "h": [-1, -1], "p": [0, 0]}}


def run(server, *words, stdin=None, code=None, seconds=90, **environment):
    """Runs the client with --server (a Service or None) and checks its exit status."""
    where = ["--server", server.url] if server else []
    done = subprocess.run([CLIENT, *where, *words], input=stdin, capture_output=True, text=True, timeout=seconds,
                          env={**os.environ, **environment})
    if code is not None:
        check(done.returncode == code, f"{words}: exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}")
    return done


def submit(server, body, *words, code=0):
    """Sends a dict from standard input and returns the id."""
    return run(server, "submit", "-", *words, stdin=json.dumps(body), code=code).stdout.strip()


def test_submit_and_wait_prints_the_summary(server):
    done = run(server, "submit", PAPER, "--wait", code=0)
    for part in ("outcome     converged", "22 of 30 candidates touch", "sum -10.51371", "accelerated_restart",
                 "whole error about 2", "by estimate", "exact solution of these equations", "asked for 1e-08: met", "-0.0039608186"):
        check(part in done.stdout, part, "is missing in\n" + done.stdout)
    check(done.stderr == "", done.stderr)


def test_submit_prints_the_id(server):
    done = run(server, "submit", SPRINGS, code=0)
    check(len(done.stdout.split()) == 1 and done.stderr == "", done)
    run(server, "wait", done.stdout.strip(), "--quiet", code=0)
    quiet = run(server, "submit", SPRINGS, "--wait", "--quiet", code=0)
    check(len(quiet.stdout.split()) == 1 and quiet.stderr == "", quiet)


def test_matrices_have_the_answer_of_hand(server):
    job = json.loads(run(server, "submit", SPRINGS, "--wait", "--json", code=0).stdout)
    result = json.loads(run(server, "result", job["id"], "--fields", "displacements,reactions,gaps", code=0).stdout)
    wanted = {"displacements": [0.4 / 3, 0.8 / 3, 0.4], "reactions": [0, -1000 + 400 / 3], "gaps": [0.5 - 0.8 / 3, 0]}
    for name, values in wanted.items():
        worst = max(abs(got - want) for got, want in zip(result[name], values))
        check(len(result[name]) == len(values) and worst < 1e-5, name, result[name], values)
    check(job["summary"]["contact"]["active"] == 1, job)


@options()
def test_status_list_and_tags(server):
    first = run(server, "submit", SPRINGS, "--wait", "--quiet", "--tag", "one", code=0).stdout.strip()
    run(server, "submit", SPRINGS, "--wait", "--quiet", "--tag", "two", code=0)
    shown = run(server, "status", first, code=0).stdout
    check(first in shown and "successful" in shown and "springs one" in shown, shown)
    job = json.loads(run(server, "status", first, "--json", code=0).stdout)
    check(job["tags"] == ["springs", "one"], job)
    check(len(run(server, "list", code=0).stdout.splitlines()) == 3)
    check(len(run(server, "list", "--limit", "1", code=0).stdout.splitlines()) == 2)
    found = json.loads(run(server, "list", "--tag", "one", "--status", "successful", "--json", code=0).stdout)
    check([job["id"] for job in found] == [first], found)
    check(json.loads(run(server, "list", "--status", "failed", "--json", code=0).stdout) == [])
    check(json.loads(run(server, "list", "--tag", "one", "--format", "json", code=0).stdout) == found)


@options()
def test_list_as_csv(server):
    """Whole names, whatever is in them."""
    name = 'a "spring", and another one'
    run(server, "submit", SPRINGS, "--wait", "--quiet", "--tag", "one", "--tag", "two", "--name", name, code=0)
    row, = csv.DictReader(run(server, "list", "--format", "csv", code=0).stdout.splitlines())
    check((row["name"], row["status"], row["outcome"], row["tags"]) == (name, "successful", "converged", "springs,one,two"), row)


def test_list_pages(server):
    ids = [submit(server, service.MATRICES) for _ in range(7)]
    found = json.loads(run(server, "list", "--json", "--limit", "7", code=0).stdout)
    check([job["id"] for job in found] == ids[::-1], found)


def test_key_makes_a_repeat_safe(server):
    ids = {run(server, "submit", SPRINGS, "--key", "monday", code=0).stdout for _ in range(3)}
    check(len(ids) == 1, ids)
    run(server, "submit", PAPER, "--key", "monday", code=4)
    check(run(server, "submit", SPRINGS, code=0).stdout not in ids, "without a key each submit is a job")


def test_closed_standard_output(server):
    """The connection does not get its number, so that what is printed is no part of a request."""
    submit(server, service.SCENE, "--wait")
    for words in ("plot", "@last"), ("result", "@last"), ("list",):
        with open(os.devnull, "wb") as nowhere:
            done = subprocess.run([CLIENT, "--server", server.url, *words], stdout=nowhere, stderr=subprocess.PIPE,
                                  preexec_fn=lambda: os.close(1), check=False, timeout=90)
        check(done.returncode == 11 and b"cannot write to standard output" in done.stderr, words, done)


def test_result_goes_to_a_file(server):
    job = run(server, "submit", PAPER, "--wait", "--quiet", code=0).stdout.strip()
    target = os.path.join(server.folder, "result.json")
    done = run(server, "result", job, "--fields", "displacements", "-o", target, code=0)
    result = json.load(open(target))
    check(done.stdout == "" and len(result["displacements"]) == 31 * 11, len(result["displacements"]))
    run(server, "result", job, "--fields", "nonsense", code=4)


def test_forces_and_warnings_are_printed(server):
    done = run(server, "submit", PAPER, "--wait", code=0)
    for part in ("forces      contact bottom (0, 10.513", "support left (-50, 4.486", "loads (50, -15)", "area of 215",
                 "largest pressure 0.053669", " at (36, 0)"):
        check(part in done.stdout, part, "is missing in\n" + done.stdout)
    check("warning" not in done.stdout, done.stdout)
    far = json.loads(open(PAPER).read())
    far["problem"]["loads"][0]["traction"] = [0, 1000]
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(far), code=0)
    check("\nwarning     large_rotation: element" in done.stdout, done.stdout)
    check("forces" not in run(server, "submit", SPRINGS, "--wait", code=0).stdout)


def test_files_for_people_and_programs(server):
    cases = json.loads(open(PAPER).read())
    cases["cases"] = [{"name": "a b", "loads": cases["problem"].pop("loads")}, {"name": "none", "loads": []}]
    job = submit(server, cases, "--wait", "--quiet")
    target = os.path.join(server.folder, "result.vtu")
    check(run(server, "result", job, "--format", "vtu", "--case", "a b", "--fields", "stress", "-o", target,
              code=0).stdout == "")
    vtu = open(target, encoding="utf-8").read()
    check("UnstructuredGrid" in vtu and 'Name="stress"' in vtu and 'Name="gaps"' not in vtu, vtu[:2000])
    run(server, "result", job, "--format", "vtu", code=4)  # which case?
    json.loads(run(server, "result", job, "--format", "json", code=0).stdout)
    target = os.path.join(server.folder, "deformed.svg")
    run(server, "picture", job, "--case", "a b", "--width", "400", "--factor", "3", "--colour", "displacements", "-o",
        target, code=0)
    wide = run(server, "picture", job, "--case", "a b", code=0).stdout
    picture = open(target, encoding="utf-8").read()
    check('width="400"' in picture and 'width="900"' in wide and "</svg>" in picture, picture[:300])
    for wrong in (["--factor", "much"], ["--colour", "mauve"], ["--case", "c"]):
        done = run(server, "picture", job, "--case", "a b", *wrong, "-o", target, code=4)
        check(wrong[0][2:] in done.stderr.lower(), wrong, done.stderr)
    check(open(target, encoding="utf-8").read() == picture, "a refusal must leave the file")
    springs = run(server, "submit", SPRINGS, "--wait", "--quiet", code=0).stdout.strip()
    run(server, "picture", springs, code=4)


def test_upload_prints_the_id(server):
    request = json.loads(open(SPRINGS).read())
    stiffness = request["problem"]["K"].encode()
    plain, packed = (os.path.join(server.folder, name) for name in ("K.mtx", "K.mtx.gz"))
    for name, data in ((plain, stiffness), (packed, gzip.compress(stiffness))):
        with open(name, "wb") as file:
            file.write(data)
    ids = {run(server, "upload", plain, code=0).stdout, run(server, "upload", packed, code=0).stdout,
           run(server, "upload", "-", stdin=stiffness.decode(), code=0).stdout}
    check(ids == {hashlib.sha256(stiffness).hexdigest() + "\n"}, ids)
    known = json.loads(run(server, "upload", plain, "--json", code=0).stdout)
    check(known["bytes"] == len(stiffness), known)
    request["problem"]["K"] = {"upload": known["id"]}
    submit(server, request, "--wait")
    run(server, "upload", "/dev/null", code=4)
    run(server, "upload", os.path.join(server.folder, "none"), code=11)


def test_history_in_three_forms(server):
    job = run(server, "submit", PAPER, "--wait", "--quiet", code=0).stdout.strip()
    rows = json.loads(run(server, "history", job, code=0).stdout)["rows"]
    lines = run(server, "history", job, "--csv", code=0).stdout.splitlines()
    check(lines[0] == "iteration,seconds,dual_objective,residual_total,e1,e2,e3,e4,step_norm,error_bound,contacts,restart",
          lines[0])
    check(len(lines) == len(rows) + 1, len(lines), len(rows))
    drawing = run(server, "history", job, "--plot", code=0, LC_ALL="C.UTF-8").stdout.splitlines()
    check(len(drawing) == 20 and max(map(len, drawing)) <= 72 and "\u2502" in drawing[1], drawing)
    plain = run(server, "history", job, "--plot", "--width", "60", "--height", "10", code=0, LC_ALL="C").stdout
    check(plain.isascii() and len(plain.splitlines()) == 10, plain)
    target = os.path.join(server.folder, "plot.txt")
    run(server, "history", job, "--plot", "-o", target, "--ascii", code=0)
    check(len(open(target).read().splitlines()) == 20)


def test_refused_requests(server):
    done = run(server, "submit", "-", stdin='{"problem": {"kind": "matrices", "Q": 1}}', code=4)
    check("/problem" in done.stderr and "HTTP status 4" in done.stderr and done.stdout == "", done)
    broken = json.loads(open(SPRINGS).read())
    broken["problem"]["K"] = broken["problem"]["K"].replace("2 2 2000", "2 2 two")
    done = run(server, "submit", "-", stdin=json.dumps(broken), code=4)
    check("/problem/K, line 6" in done.stderr, done.stderr)
    done = run(server, "submit", "-", stdin='{\n\n"problem" 1}', code=4)
    check("line 3" in done.stderr, done.stderr)
    done = run(server, "submit", "-", "--tag", "x", stdin='{\n\n"problem" 1}', code=4)
    check("line 3" in done.stderr, "tags must not move lines", done.stderr)
    run(server, "submit", "-", stdin="", code=4)
    for command in ("status", "wait", "result", "history", "cancel"):
        run(server, command, "0" * 32, code=4)
    run(server, "list", "--status", "nonsense", code=4)


def test_job_that_fails(server):
    broken = json.loads(open(SPRINGS).read())
    broken["problem"]["K"] = broken["problem"]["K"].replace("3 3 1000", "3 3 -1000")
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(broken), code=6)
    check("not_positive_definite" in done.stderr, done.stderr)


def test_limits_end_without_converging(server):
    limited = {**json.load(open(PAPER)), "solver": {"method": "accelerated_restart", "max_iterations": 3}}
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(limited), code=7)
    check("iteration_limit" in done.stdout and "not met" in done.stdout, done.stdout)
    paper = {**limited, "solver": {"method": "accelerated_restart", "stopping": "paper", "epsilon": 10,
                                   "accuracy": "precise"}}
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(paper), code=7)
    check("paper_rule" in done.stdout, done.stdout)


def test_an_obstacle_on_the_other_side_is_hinted_at(server):
    scene = json.load(open(PAPER))
    words = "normal points to the body"
    check(words not in run(server, "submit", "-", "--wait", stdin=json.dumps(scene), code=0).stdout)
    scene["problem"]["contacts"][0]["obstacle"]["plane"]["normal"] = [0, -1]
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(scene), code=0)
    check("0 of 30 candidates touch" in done.stdout and words in done.stdout, done.stdout)
    matrices = {"kind": "matrices", **{name: open(f"tests/data/springs_{name}.mtx").read() for name in "KNh"}, "p": [0, 0, 0]}
    done = run(server, "submit", "-", "--wait", stdin=json.dumps({"problem": matrices}), code=0)
    check("0 of 2 candidates touch" in done.stdout and words not in done.stdout, done.stdout)


def test_infeasible_is_never_called_converged(server):
    done = run(server, "submit", "-", "--wait", stdin=json.dumps(IMPOSSIBLE))
    check(done.returncode in (7, 8), done)
    check("converged:" not in done.stdout and "digits are certain" not in done.stdout, done.stdout)


@options("--workers", "1")
def test_cancel_waiting_running_and_ended(server):
    running = submit(server, service.ENDLESS)
    server.wait_status(running, "running")
    waiting = submit(server, service.MATRICES)
    check(run(server, "cancel", waiting, code=0).stdout == "dismissed\n")
    run(server, "wait", waiting, code=9)
    start = time.monotonic()
    done = run(server, "wait", running, "--timeout", "1", code=10)
    check(0.8 < time.monotonic() - start < 60 and running in done.stderr, done.stderr)
    check("running" in run(server, "status", running, code=0).stdout)
    run(server, "result", running, code=4)
    run(server, "history", running, "--plot", code=0)
    run(server, "cancel", running, "--quiet", code=0)
    run(server, "wait", running, code=9)
    done = run(server, "cancel", running, code=4)
    check("has ended already: dismissed" in done.stderr and f"uzawa delete {running}" in done.stderr, done.stderr)
    check("dismissed" in run(server, "status", running, code=0).stdout, "an ended job is never deleted by cancel")
    check(run(server, "delete", running, code=0).stdout == "deleted\n")
    run(server, "status", running, code=4)


@options("--workers", "1")
def test_submit_wait_times_out_and_the_job_goes_on(server):
    done = run(server, "submit", "-", "--wait", "--timeout", "1", "--quiet", stdin=json.dumps(service.ENDLESS), code=10)
    job = done.stdout.strip()
    check("running" in run(server, "status", job, code=0).stdout)
    run(server, "cancel", job, code=0)


def test_progress_is_shown_when_asked(server):
    done = run(server, "submit", PAPER, "--wait", "--progress", code=0)
    check("successful 100 %" in done.stderr, done.stderr)


@options(None)
def test_wait_survives_a_restart(server):
    server.start()
    port = server.url.rsplit(":", 1)[1]
    job = submit(server, service.ENDLESS)
    server.wait_status(job, "running")
    waiting = subprocess.Popen([CLIENT, "--server", server.url, "wait", job], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    try:
        server.process.kill()
        server.process.wait()
        server.process.stdout.close()
        server.process = subprocess.Popen(server.command("--listen", f"127.0.0.1:{port}", "--db", server.db),
                                          stdout=subprocess.PIPE, stderr=server.log_file)
        check(server.process.stdout.readline().startswith(b"listening"), server.log())
        server.wait_status(job, "running")
        run(server, "cancel", job, code=0)
        out, err = waiting.communicate(timeout=150)  # on PostgreSQL the lease of who was killed has to end
        check(waiting.returncode == 9, waiting.returncode, out, err)
    finally:
        if waiting.poll() is None:
            waiting.kill()
            waiting.communicate()


@options(None)
def test_server_from_the_environment(server):
    server.start()
    run(None, "list", code=0, UZAWA_SERVER=server.url)
    run(None, "list", code=12, UZAWA_SERVER="http://127.0.0.1:1", seconds=PATIENT_S)
    run(server, "list", code=0, UZAWA_SERVER="http://127.0.0.1:1")


@options(None)
def test_usage(_):
    for words in ([], ["frobnicate"], ["submit"], ["list", "--frob"], ["help", "frobnicate"], ["wait", "x", "--csv"]):
        done = run(None, *words, code=2)
        check(done.stdout == "" and "usage:" in done.stderr, words, done)
    check("see: uzawa help submit" in run(None, "submit", "x", "--accuracy", "1", code=2).stderr, "of the command that was named")
    run(None, "--server", "nonsense", "list", code=2)
    for words in (["submt", "--json"], ["list", "-j", "--limit", "x"], ["--server", "nonsense", "list", "--json"]):
        said = json.loads(run(None, *words, code=2).stderr)
        check(said["exit"] == 2 and said["detail"], words, said)
    for words in (["--help"], ["help"], ["submit", "--help"], ["help", "history"]):
        done = run(None, *words, code=0)
        check(done.stderr == "" and done.stdout.startswith("usage: uzawa"), words, done)
    check(run(None, "version", code=0).stdout == run(None, "--version", code=0).stdout)


if __name__ == "__main__":
    service.main(globals())
