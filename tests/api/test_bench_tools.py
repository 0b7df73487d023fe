"""What compares benchmarks and counts instructions. usage: test_bench_tools.py BUILD_DIR [FILTER]"""
# not under sanitizers: about tools and tables, with no memory of ours
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import service
from service import ROOT, check, options

sys.path.insert(0, str(ROOT / "tests" / "guard"))

import guard  # noqa: E402  the path is set above

OLD = {"ratios": [{"name": "cold", "median": 1.2, "min": 1.1, "max": 1.3, "runs": 9, "unit": "x"},
                  {"name": "read", "median": 200.0, "min": 190.0, "max": 210.0, "runs": 5, "unit": "MB/s"},
                  {"name": "gone", "median": 1.0, "min": 1.0, "max": 1.0, "runs": 1, "unit": "x"}],
       "instructions": [{"name": "paper_cold", "instructions": 1000000, "library_calls": 500}]}


def compared(old, new, *more):
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for name, content in (("old", old), ("new", new)):
            paths.append(os.path.join(folder, name))
            pathlib.Path(paths[-1]).write_text(content if isinstance(content, str) else json.dumps(content))
        ran = subprocess.run([sys.executable, "-B", str(ROOT / "tests/bench/compare.py"), *paths, *more],
                             capture_output=True, text=True)
    return ran.returncode, ran.stdout + ran.stderr


def changed(kind, name, **values):
    new = json.loads(json.dumps(OLD))
    next(row for row in new[kind] if row["name"] == name).update(values)
    return new


@options(None)
def test_ratios_between_two_benchmarks(s):
    status, text = compared(OLD, OLD)
    check(status == 0 and "5 compared, 0 slower" in text, text)
    for new, wanted in ((changed("ratios", "cold", median=1.6, min=1.5, max=1.7), 1),
                        (changed("ratios", "cold", median=1.6, min=1.2, max=1.7), 0),  # within the scatter
                        (changed("ratios", "cold", median=1.31, min=1.305, max=1.32), 0),  # below the threshold
                        (changed("ratios", "cold", median=0.5, min=0.4, max=0.6), 0),
                        (changed("ratios", "read", median=100.0, min=90.0, max=110.0), 1),
                        (changed("ratios", "read", median=400.0, min=390.0, max=410.0), 0),
                        (changed("instructions", "paper_cold", instructions=1060000), 1),
                        (changed("instructions", "paper_cold", library_calls=530), 1),
                        (changed("instructions", "paper_cold", instructions=1040000), 0)):
        status, text = compared(OLD, new)
        check(status == wanted and ("SLOWER" in text) == bool(wanted), wanted, text)
    check(compared(OLD, changed("ratios", "cold", median=1.31, min=1.305, max=1.32), "1.05")[0] == 1, "threshold")
    fewer = {"ratios": OLD["ratios"][:2]}
    status, text = compared(OLD, fewer)
    check(status == 0 and "gone (old only)" in text and "paper_cold (old only)" in text, text)
    for bad in ("", "{", {"ratios": []}):
        check(compared(OLD, bad)[0] in (1, 2), bad)
    check(compared(OLD, "[", )[0] == 2 and compared(OLD, OLD, "x")[0] == 2, "unreadable")


COSTS = """# callgrind format
events: Ir

ob=(1) /lib/libc.so.6
fn=(1) memcpy
10 500
+2
cob=(2) /x/guard
calls=3 7
12 60

ob=(2)
fn=(2) guard_measured
5 100
* 20
-1 3
cob=(1)
cfn=(1)
calls=4 10
6 2000
cfn=(3) own
calls=2 20
7 50

fn=(3)
20 50
"""


@options(None)
def test_costs_are_read(s):
    """By hand: own lines 100 + 20 + 3 + 50, four calls of libc, two of its own."""
    found = list(guard.objects_of(COSTS.splitlines()))
    own = [one for one in found if one[0] == "/x/guard"]
    check(sum(count for _, called, count, _ in own if called is None) == 173, found)
    check([(called, calls) for _, called, _, calls in own if called] == [("/lib/libc.so.6", 4), ("/x/guard", 2)], found)
    check(sum(count for here, called, count, _ in found if here == "/lib/libc.so.6" and not called) == 500, found)


@options(None)
def test_a_filter_that_matches_nothing_is_an_error(s):
    for command in (["tests/soak/soak.py", s.build, "nonsense"], ["tests/peers/peers.py", s.build, "ONLY=nonsense"],
                    ["tests/same_answers.py", s.build, s.build, "nonsense"]):
        ran = subprocess.run([sys.executable, "-B", *map(str, command)], cwd=ROOT, capture_output=True, text=True, check=False)
        check(ran.returncode != 0, command, ran.stdout, ran.stderr)
        check("nonsense" in ran.stderr + ran.stdout, command, ran.stdout, ran.stderr)
    ran = subprocess.run(["tests/run.sh", str(s.build), "api", "test_bench_tools.nonsense"], cwd=ROOT, capture_output=True, text=True, check=False)
    check(ran.returncode != 0 and "nonsense" in ran.stdout, ran.stdout)


if __name__ == "__main__":
    service.main(globals())
