"""Our solver and what Debian has, on the same problems, with the same certificate for everybody.

usage: peers.py BUILD_DIR [SIZES=30,60,...] [TIME=seconds] [ONLY=part of a solver's name,...] [PROBLEMS=part,...]
                [CASES=folder] [MEMORY=megabytes] [OUT=folder]

Each solver solves each problem in a process of its own, with one thread. Its own tolerance is tightened step by step
until an answer is certified to 1e-9; at each of 1e-3, 1e-6 and 1e-9 its fastest run counts that is certified to it,
whatever the solver says of it. (Ours counts only where it was asked for that much.) The bound is uz_verify's, on the
relative error in the energy norm, from the original data.

What is counted: seconds of processor from K, N, h, p in memory to u and r; not the start of a program and the
reading of files. Solvers of bound-constrained and complementarity problems get the condensed dual: its formation by
CHOLMOD (D in blocks of right-hand sides) and u = K^-1 (p + N'r) at the end are in their time. A failure costs the time
limit in the means. A solver that ran out of time or memory on the paper's body is not run on a larger one with that
tolerance; a dense one on no larger problem at all. Methods that ask their tolerance only whether to stop are not run with
a tighter one once they ended at their limit of iterations: it would be the same run again.

Writes OUT/peers.json (OUT: BUILD_DIR), peers.csv (every run), peers-results.csv (every solver, problem and tolerance)
and peers-profile-*.svg, and prints tables. A run of a part (SIZES, ONLY, PROBLEMS) renews its own rows: the others are
those of OUT/peers.json, or of docs/figures.
"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.append(str(ROOT / "tests/figures"))

import draw  # noqa: E402  the path is set above
import stamp  # noqa: E402
import stats  # noqa: E402
from worker import Ended, Worker  # noqa: E402

TOLERANCES = [1e-3, 1e-6, 1e-9]
SIZES = [30, 60, 120, 180, 240, 300, 480, 600]
PYTHON = "/usr/bin/python3"
PACKAGES = ["coinor-libipopt1v5", "libmumps-seq-5.5", "python3-cvxopt", "octave", "python3-siconos", "coinor-libclp1",
            "libpetsc-real3.18", "libcholmod3", "libopenblas0-pthread"]
QUICK = 1.0         # seconds: a first run that takes no longer is followed by all of a solver's tolerances
REPEATED = 0.5      # seconds: runs on the paper's body are repeated, to the median of nine, until they took this long
REPEATED_ELSE = 0.1  # the same on others, whose times are in means only
LARGE = 1000        # dofs from which a time-out of dense methods is put down to the size
DENSE_MOST = 500e6  # bytes of D: the solvers hold several copies of it
# How methods say that they ended at their limit of iterations, and that the tolerance only tells when to stop.
AT_LIMIT = ("TAO reason -2", "Siconos info 1")


class Solver:
    """command: from (build, problem file, condensed file, name, d). fine, coarse: its own tolerances, for problems that
    are quick and others. dense: takes the matrices in full, so that a time-out tells about all larger problems. shared: its
    process may be that of another method of the same program, as its start takes longer than most of its runs."""

    def __init__(self, name, method, command, fine, coarse=None, dual=False, ours=False, dense=False, shared=False):
        self.name, self.method, self.command, self.dual, self.ours, self.shared = name, method, command, dual, ours, shared
        self.fine, self.coarse, self.dense = fine, coarse or fine, dense


def solvers():
    def lab(x):
        return [x.build / "peers/lab", "serve", x.name, x.file, str(DENSE_MOST / 1e6)]

    def program(name):
        return lambda x: [x.build / "peers" / name, x.file]

    def script(name, dual):
        return lambda x: [PYTHON, HERE / name, x.condensed if dual else x.file, str(x.d)]

    def octave(dual):
        rest = (lambda x: ["dual", x.condensed, str(x.d)]) if dual else (lambda x: ["primal", x.file])
        return lambda x: ["octave-cli", "--no-init-file", "--no-history", HERE / "octave_qp.m", *rest(x)]

    def power(*exponents):
        return [float(f"1e-{e}") for e in exponents]

    dense = power(3, 6, 9, 12, 15)
    return [
        Solver("uzawa", "cold", lab, TOLERANCES, ours=True),
        Solver("uzawa_cached", "cached", lab, TOLERANCES, ours=True),
        Solver("ipopt", "default", program("ipopt"), power(6, 8, 10, 13, 16, 19, 22, 24), power(10, 16, 23)),
        Solver("cvxopt", "chol2", script("cvxopt_peer.py", False), power(4, 6, 8, 10, 12, 14, 16, 18), power(7, 13, 17)),
        Solver("clp", "barrier", program("clp"), power(6, 9, 12, 14, 16), power(9, 12, 16)),
        Solver("octave_qp", "primal", octave(False), [1.0], dense=True),
        Solver("octave_qp_dual", "dual", octave(True), [1.0], dual=True),
        Solver("siconos_lemke", "lemke", script("siconos_peer.py", True), [1e-12], dual=True, shared=True),
        Solver("siconos_newton_min", "newton_min", script("siconos_peer.py", True), dense, dual=True, shared=True),
        Solver("siconos_newton_fb", "newton_fb", script("siconos_peer.py", True), dense, dual=True, shared=True),
        Solver("siconos_psor", "psor", script("siconos_peer.py", True), dense, dual=True, shared=True),
        Solver("tao_blmvm", "blmvm", script("tao_peer.py", True), dense, dual=True, shared=True),
        Solver("tao_tron", "tron", script("tao_peer.py", True), dense, dual=True, shared=True),
        Solver("tao_bqpip", "bqpip", script("tao_peer.py", True), dense, dual=True, shared=True),
    ]


class Problem:
    """A problem in a file, the process that condenses it and certifies answers, and what condensing took."""

    def __init__(self, options, folder, name):
        self.name, self.build, self.options = name, options.build, options
        self.file, self.condensed = folder / "problem", folder / "condensed"
        self.answer = folder / "answer"
        text = subprocess.run([self.build / "peers/lab", "write", name, self.file, options.cases], check=True,
                              stdout=subprocess.PIPE, text=True).stdout
        size = json.loads(text)
        self.d, self.m = size["d"], size["m"]
        self.judge = Worker([self.build / "peers/lab", "serve", name, self.file, str(DENSE_MOST / 1e6)], 0)
        self.dual, self.workers = None, {}

    def condense(self):
        """Seconds, or why there is no D. Formed once; each solver's time has the seconds in it."""
        if self.dual is None:
            if 8.0 * self.m ** 2 > DENSE_MOST:
                self.dual = (None, f"not run: D takes {8e-6 * self.m ** 2:.0f} MB, of which solvers hold several copies")
            else:
                reply = self.judge.ask("condense", 0.0, self.condensed, 1000)
                self.dual = (reply["seconds"], reply["status"])
        return self.dual

    def certify(self):
        """(bound or None, seconds of recovering u)"""
        try:
            reply = self.judge.ask("certify", 0.0, self.answer, 1000)
            bound = float(reply["status"])
            return (bound if math.isfinite(bound) else None), reply["seconds"]
        except ValueError:
            return None, 0.0

    def worker(self, solver):
        """A process for it: one that is left of another method of its program, or a new one. Raises Ended."""
        command = tuple(map(str, solver.command(self)))
        return self.workers.pop(command, None) or Worker(list(command), self.options.memory)

    def keep(self, solver, worker):
        """A process that has answered to the end may serve another method."""
        if solver.shared and worker.process.poll() is None:
            self.workers[tuple(map(str, solver.command(self)))] = worker
        else:
            worker.close()

    def close(self):
        for worker in [self.judge, *self.workers.values()]:
            worker.close()


class Comparison:
    def __init__(self, options):
        self.options, self.runs, self.kept, self.stamps = options, [], *earlier(options)
        self.watch = stamp.Watch()
        self.stopped = {}  # (solver, family): (step of its tolerances that ended in a time-out or so, why, size)

    def ask(self, worker, problem, solver, tolerance, setup):
        """One run, the median of up to nine where it is quick. Raises Ended."""
        limit = self.options.time - setup
        took = []
        if limit <= 0:
            raise Ended("timed out")
        repeated = REPEATED if problem.name.startswith("body/") else REPEATED_ELSE
        while len(took) < 9 and sum(took) < repeated:
            problem.answer.unlink(missing_ok=True)
            reply = worker.ask(solver.method, tolerance, problem.answer, limit)
            took.append(reply["seconds"])
            if not problem.answer.exists():
                break
        reply["seconds"] = sorted(took)[len(took) // 2]
        if reply["seconds"] + setup > self.options.time:
            raise Ended("timed out")
        return reply

    def run(self, worker, problem, solver, tolerance, setup):
        run = {"problem": problem.name, "d": problem.d, "m": problem.m, "solver": solver.name, "asked": tolerance,
               "seconds": None, "setup": setup, "iterations": None, "certified": None, "status": None}
        self.runs.append(run)
        try:
            reply = self.ask(worker, problem, solver, tolerance, setup)
        except Ended as why:
            run["status"] = str(why)
            raise
        run.update(status=reply["status"], iterations=reply["iterations"], seconds=reply["seconds"] + setup)
        if problem.answer.exists():
            run["certified"], recovering = problem.certify()
            run["seconds"] += recovering
            if run["certified"] is None and run["status"] == "ok":
                run["status"] = "no bound"
        return run

    def skip(self, problem, solver, why, asked=None):
        self.runs.append({"problem": problem.name, "d": problem.d, "m": problem.m, "solver": solver.name, "asked": asked,
                          "seconds": None, "setup": None, "iterations": None, "certified": None, "status": why})

    def ladder(self, worker, problem, solver, setup, steps):
        """Tightens the solver's own tolerance until an answer is certified to the last of TOLERANCES."""
        done, asked, k, first = [], solver.coarse, 0, 0
        while k < min(len(asked), steps):
            try:
                done.append(self.run(worker, problem, solver, asked[k], setup))
            except Ended as why:
                if not solver.dense or problem.d >= LARGE:
                    self.stopped[solver.name, self.family(problem, solver)] = (k, str(why), problem)
                return
            if k == 0 and len(done) == 1 and asked is not solver.fine and done[0]["seconds"] < QUICK:
                asked, k, first = solver.fine, -1, len(done)
            k += 1
            if not solver.ours and stats.best(done, TOLERANCES[-1]):
                return
            if done[-1]["status"] in AT_LIMIT:
                for tighter in asked[k:steps]:
                    self.skip(problem, solver, f"not run: at its limit of iterations for {done[-1]['asked']:g} already", tighter)
                return
            if not solver.ours and not solver.dual and stalled(done[first:]):  # on the dual a run more costs little
                return

    @staticmethod
    def family(problem, solver):
        """Problems of which a larger one can't be done where a smaller one could not."""
        name = problem.name.split("/")[0]
        return "all" if solver.dense else name if name == "body" else problem.name

    def solve(self, problem, solver):
        step, why, other = self.stopped.get((solver.name, self.family(problem, solver)), (99, "", None))
        if step < 99 and problem.d >= other.d:
            self.skip(problem, solver, f"not run: {why} at {other.name}")
            if step == 0:
                return
        else:
            step = 99
        setup, status = problem.condense() if solver.dual else (0.0, "ok")
        if setup is None or status != "ok":
            self.skip(problem, solver, status)
            return
        try:
            worker = problem.worker(solver)
        except Ended as why:
            self.skip(problem, solver, f"not started: {why}")
            return
        self.ladder(worker, problem, solver, setup, step)
        problem.keep(solver, worker)

    def all(self, names, chosen):
        for name in names:
            watch = stamp.Watch()
            with tempfile.TemporaryDirectory() as folder:
                problem = Problem(self.options, pathlib.Path(folder), name)
                for solver in chosen:
                    self.solve(problem, solver)
                    say(problem, solver, self.runs)
                problem.close()
            self.stamps[name] = watch.stamp(ROOT)
            write_report(self, self.options)  # what is measured stays, whatever becomes of the rest

    def all_runs(self):
        """Those of this run, and those of earlier ones that it has not renewed, in the solvers' and the problems' order."""
        renewed = {(run["problem"], run["solver"]) for run in self.runs}
        runs = [run for run in self.kept if (run["problem"], run["solver"]) not in renewed] + self.runs
        problems = {name: k for k, name in enumerate(dict.fromkeys(run["problem"] for run in self.kept + self.runs))}
        order = {solver.name: k for k, solver in enumerate(solvers())}
        return sorted(runs, key=lambda run: (problems[run["problem"]], order.get(run["solver"], len(order))))


def earlier(options):
    """(runs, stamps by problem) that a run of a part leaves as they are; of a whole run there are none."""
    if not options.part:
        return [], {}
    for path in [options.out / "peers.json"] + [ROOT / "docs/figures/peers.json"] * (options.out == options.build):
        if path.exists():
            old = json.loads(path.read_text())
            if old["time_limit_s"] != options.time:
                print(f"{path} has another time limit, {old['time_limit_s']:g} s: its rows are left out")
                return [], {}
            when = stamp.brief(old.get("stamp") or old.get("machine") or {})
            return old["runs"], {run["problem"]: when for run in old["runs"]} | {row["name"]: row["stamp"] for row in old.get("problems", [])}
    return [], {}


def stalled(done):
    """The last two runs are not better than the one before them."""
    bounds = [run["certified"] if run["certified"] is not None else float("inf") for run in done]
    return len(bounds) > 2 and min(bounds[-2:]) >= 0.5 * min(bounds[:-2]) and min(bounds) < float("inf")


def say(problem, solver, runs):
    mine = [run for run in runs if run["solver"] == solver.name and run["problem"] == problem.name]
    found = [stats.best(mine, tolerance, solver.ours) for tolerance in TOLERANCES]
    texts = [stats.number(run["seconds"] if run else None) for run in found]
    why = "" if found[-1] else stats.why_not(mine, TOLERANCES[-1])
    print(f"{problem.name:28} {solver.name:20} {texts[0]:>9} {texts[1]:>9} {texts[2]:>9}  {why}", flush=True)


# ------------------------------------------------------------------ what is made of it


def results(runs, chosen):
    """A row for each problem, solver and tolerance: success, seconds, bound and own tolerance, or why not."""
    rows, groups = [], {}
    for run in runs:
        groups.setdefault((run["problem"], run["solver"]), []).append(run)
    ours = {solver.name for solver in chosen if solver.ours}
    for (problem, solver), mine in groups.items():
        for tolerance in TOLERANCES:
            run = stats.best(mine, tolerance, solver in ours)
            rows.append({"problem": problem, "d": mine[0]["d"], "m": mine[0]["m"], "solver": solver,
                         "tolerance": tolerance, "success": run is not None, "seconds": run and run["seconds"],
                         "certified": run and run["certified"], "asked": run and run["asked"],
                         "why": "" if run else stats.why_not(mine, tolerance)})
    return rows


def means(rows, limit):
    """Solved problems and shifted geometric means by solver; a failure counts as the time limit."""
    out = []
    for solver in dict.fromkeys(row["solver"] for row in rows):
        entry = {"solver": solver}
        for tolerance in TOLERANCES:
            mine = [row for row in rows if row["solver"] == solver and row["tolerance"] == tolerance]
            seconds = [row["seconds"] if row["success"] else limit for row in mine]
            entry[f"{tolerance:.0e}"] = {"solved": sum(row["success"] for row in mine), "of": len(mine),
                                         "shift_10s": stats.shifted_geometric_mean(seconds, 10.0),
                                         "shift_10ms": stats.shifted_geometric_mean(seconds, 0.01)}
        out.append(entry)
    return out


def body_ratios(rows):
    """At certified 1e-6, the fastest peer against ours on the paper's body."""
    out = []
    bodies = {row["problem"]: row["d"] for row in rows if row["problem"].startswith("body/")}
    for problem in sorted(bodies, key=bodies.get):
        at = {row["solver"]: row for row in rows if row["problem"] == problem and row["tolerance"] == 1e-6}
        cold, cached = at.get("uzawa"), at.get("uzawa_cached")
        peers = [row for row in at.values() if row["success"] and row["solver"] not in ("uzawa", "uzawa_cached")]
        first = min(peers, key=lambda row: row["seconds"], default=None)
        ratios = {name: first["seconds"] / row["seconds"] if first and row and row["success"] else None
                  for name, row in (("cold", cold), ("cached", cached))}
        out.append({"problem": problem, "d": bodies[problem], "fastest": first and first["solver"],
                    "seconds": first and first["seconds"], "cold_seconds": cold and cold["seconds"],
                    "cached_seconds": cached and cached["seconds"], **ratios})
    return out


def profiles(rows):
    """Performance profiles by tolerance; a cached solve, which starts from a factor, is none of the peers' kind."""
    out = {}
    for tolerance in TOLERANCES:
        times = {}
        for row in rows:
            if row["tolerance"] == tolerance and row["solver"] != "uzawa_cached":
                times.setdefault(row["solver"], {})[row["problem"]] = row["seconds"] if row["success"] else None
        out[f"{tolerance:.0e}"] = stats.performance_profile(times)
    return out


def draw_profiles(all_profiles, folder):
    for tolerance, profile in all_profiles.items():
        (folder / f"peers-profile-{tolerance}.svg").write_text(draw.profiles({tolerance: profile}))


def print_tables(report):
    print("\nShifted geometric means, s; a failure counts as the time limit\n")
    head = ["solver"] + [f"{text} {tolerance:.0e}" for tolerance in TOLERANCES for text in ("solved", "10 s", "10 ms")]
    rows = []
    for entry in report["means"]:
        cells = [entry[f"{tolerance:.0e}"] for tolerance in TOLERANCES]
        rows.append([entry["solver"]] + [text for x in cells for text in (
            f"{x['solved']}/{x['of']}", stats.number(x["shift_10s"]), stats.number(x["shift_10ms"]))])
    print(stats.table(head, rows))
    print("\nThe paper's body at certified 1e-6: the fastest peer against ours\n")
    head = ["problem", "d", "fastest peer", "s", "cold, s", "ratio", "cached, s", "ratio"]
    rows = [[x["problem"], x["d"], x["fastest"] or "none", stats.number(x["seconds"]), stats.number(x["cold_seconds"]),
             stats.number(x["cold"]), stats.number(x["cached_seconds"]), stats.number(x["cached"])]
            for x in report["body"]]
    print(stats.table(head, rows))
    seconds = spent(report["runs"], report["time_limit_s"])
    print(f"\nSeconds of processor, each run once: {sum(seconds.values()):.0f}: " + ", ".join(f"{name} {s:.0f}" for name, s in seconds.items()))


def spent(runs, limit):
    """{solver: seconds of processor, each run once, a time-out as the limit}: where the time of a comparison goes."""
    total = {}
    for run in runs:
        timed_out = run["seconds"] is None and run["status"] == "timed out"
        total[run["solver"]] = total.get(run["solver"], 0.0) + (limit if timed_out else (run["seconds"] or 0.0) - (run["setup"] or 0.0))
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def versions():
    found = subprocess.run(["dpkg-query", "-W", "-f", "${Package} ${Version} ${Status}\n", *PACKAGES],
                           stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout.splitlines()
    return {line.split()[0]: line.split()[1] for line in found if line.endswith("installed")}


def write_csv(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def write_report(comparison, options):
    runs = comparison.all_runs()
    rows = results(runs, solvers())
    report = {"stamp": {**stamp.machine(), **comparison.watch.stamp(ROOT)}, "packages": versions(),
              "time_limit_s": options.time, "memory_limit_mb": options.memory,
              "problems": [{"name": name, "stamp": comparison.stamps[name]} for name in dict.fromkeys(run["problem"] for run in runs) if name in comparison.stamps],
              "runs": runs, "results": rows, "means": means(rows, options.time), "body": body_ratios(rows), "profiles": profiles(rows)}
    with open(options.out / "peers.json", "w") as file:
        json.dump(report, file, indent=1, allow_nan=False)
    write_csv(options.out / "peers.csv", runs)
    write_csv(options.out / "peers-results.csv", rows)
    draw_profiles(report["profiles"], options.out)
    return report


class Options:
    def __init__(self, arguments):
        self.build = pathlib.Path(arguments[0])
        given = dict(argument.split("=", 1) for argument in arguments[1:])
        words = {key: value.replace(",", " ").split() for key, value in given.items()}
        self.out = pathlib.Path(given.get("OUT") or self.build)
        self.out.mkdir(parents=True, exist_ok=True)
        self.part = any(given.get(key) for key in ("SIZES", "ONLY", "PROBLEMS"))
        self.sizes = [int(size) for size in words.get("SIZES", [])] or SIZES
        self.time = float(given.get("TIME") or 20)
        self.memory = float(given.get("MEMORY") or 4000)  # 0: no limit
        self.only, self.problems = words.get("ONLY", []), words.get("PROBLEMS", [])
        shared = HERE.parents[2] / "shared/cases/qp"
        self.cases = pathlib.Path(given.get("CASES") or (shared if shared.is_dir() else HERE.parent / "data/qp"))

    def names(self):
        generated = subprocess.run([self.build / "peers/lab", "list"], check=True, stdout=subprocess.PIPE,
                                   text=True).stdout.split()
        cases = sorted(path.name for path in self.cases.iterdir() if (path / "K.mtx").exists())
        every = [f"body/{size}" for size in self.sizes] + [f"cases/{name}" for name in cases] + generated
        return [name for name in every if not self.problems or any(part in name for part in self.problems)]


def main():
    options = Options(sys.argv[1:])
    chosen = [solver for solver in solvers() if not options.only or any(part in solver.name for part in options.only)]
    if not chosen:
        sys.exit(f"peers: no solver's name contains any of {options.only}; there are: {[one.name for one in solvers()]}")
    if not options.names():
        sys.exit(f"peers: no problem's name contains any of {options.problems}")
    print(f"{'':49} {'1e-3, s':>9} {'1e-6, s':>9} {'1e-9, s':>9}", flush=True)
    comparison = Comparison(options)
    comparison.all(options.names(), chosen)
    print_tables(write_report(comparison, options))


if __name__ == "__main__":
    main()
