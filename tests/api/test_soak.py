"""Short forms of `make soak`: a daemon that is ended under load, slow clients, cancels, many jobs. Nothing is timed:
usage: test_soak.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
# in the ordinary build too, no_memory: a sanitizer has a heap of its own
import os
import pathlib
import signal
import sys

os.environ.pop("UZAWA_STORE", None)  # they look into a file, or have a server of PostgreSQL of their own

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "soak"))

import daemons  # noqa: E402  the path is set above
import malformed  # noqa: E402
import no_memory  # noqa: E402
import overhead  # noqa: E402
import scenarios  # noqa: E402
import service  # noqa: E402
import streams  # noqa: E402
from service import INSTRUMENTED, Skip, check, options  # noqa: E402


def clean(figures):
    wrong = {key: figures[key] for key in scenarios.ZERO if figures.get(key)}
    check(not wrong, wrong, figures)
    return figures


@options(None)
def test_killed_under_load(s):
    figures = clean(scenarios.endings(s.build, 6 if INSTRUMENTED else 20, signal.SIGKILL))
    check(figures["acknowledged"] > 20, figures)


@options(None)
def test_terminated_under_load(s):
    figures = clean(scenarios.endings(s.build, 3 if INSTRUMENTED else 5, signal.SIGTERM))
    check(figures["acknowledged"] > 10, figures)


@options(None)
def test_workers_killed_under_load(s):
    figures = clean(scenarios.killed_workers(s.build, 10 if INSTRUMENTED else 25))
    check(figures["acknowledged"] > 20, figures)


@options(None)
def test_a_week(s):
    figures = clean(scenarios.week(s.build, 2 if INSTRUMENTED else 4))
    check(figures["jobs"] > 10, figures)


@options(None)
def test_faults_of_daemons_and_database(s):
    figures = clean(daemons.faults(s.build, 2 if INSTRUMENTED else 5, 4))
    check(figures["acknowledged"] > (4 if INSTRUMENTED else 10), figures)


@options(None)
def test_jobs_of_many_bodies(s):
    """By chance three daemons factor most bodies two or three times. How often one does that another has made is left to
    the pace of the machine: a job waits for its factor as long as making one takes."""
    near, far = (daemons.mixture(s.build, wait_s, 60, 10, [10, 10, 6], "256M", clients=6) for wait_s in (5, 0))
    check(near["errors"] == 0 and near["missed"] <= 0.8 * far["missed"], near, far)


@options(None)
def test_slow_clients(s):
    figures = clean(scenarios.slow_clients(s.build, 200, 2))
    check(figures["asked"] > 10, figures)


@options(None)
def test_streams_and_long_polls(s):
    figures = clean(streams.crowds(s.build, 120, 60, 0.5, 0))
    check(figures["idle_bytes"] == 0, figures)


@options(None)
def test_malformed_requests(s):
    wrong = []
    figures = malformed.malformed(s.build, 1500, report=wrong)
    check(not wrong, wrong[:3])
    clean(figures)
    check(figures["4xx"] > 500 and figures["2xx"] > 60, figures)


@options(None)
def test_no_memory(s):
    why = no_memory.possible(s.build)
    if why:
        raise Skip(why)
    figures = clean(no_memory.failing(s.build, 151, rounds=0))
    check(figures["failed"] > 5, figures)


@options(None)
def test_overhead(s):
    if not pathlib.Path(s.build, "library").exists():
        raise Skip("library was not built")
    clean(overhead.overhead(s.build, (60, 20), 1))


@options(None)
def test_cancels(s):
    clean(scenarios.cancels(s.build, 5))
    if not INSTRUMENTED:
        clean(scenarios.cancels(s.build, 2, scenarios.LARGE))


@options(None)
def test_many_jobs_in_the_database(s):
    clean(scenarios.full_database(s.build, 5000, 10))


if __name__ == "__main__":
    service.main(globals())
