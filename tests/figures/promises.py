"""What was promised against what was measured: the verdicts are computed. Each promise is (what, target, figure as text, kept: True,
False or None where it was not measured, a mark where it was timed beside other work)."""
import tables
from service_tables import FOOTNOTE, count, mark, ms, ratio, row_of
from tables import NONE, sig, table


def iterations(data):
    """Half of the iterations of the paper's step λ₁(K), a tenth of plain Uzawa's, at every size."""
    if not data.get("figures"):
        return []
    found = []
    for which, promised, name in ((1, 2, "with the paper's step size λ₁(K)"), (3, 10, "of plain Uzawa")):
        for saver, saving in ((0, "those with restart"), (4, "those of `conjugate`")):
            for rule, base, until in tables.RULES:
                least = tables.least_ratio(data, rule, base, which, saver)
                if least:
                    found.append((f"iterations {name} over {saving}, until {until}", f"at least {promised} at every size",
                                  f"{sig(least[0], 3)} (least, NX = {least[1]})", least[0] >= promised, ""))
    return found


COLD, CACHED = {240: 5, 480: 8, 600: 8}, {nx: 50 for nx in (120, 180, 240, 300, 480, 600)}


def peers(data):
    """The fastest other solver over ours, certified 1e-6, on the paper's body."""
    bodies = {int(row["problem"].split("/")[1]): row for row in (data.get("peers") or {}).get("body", [])}
    found = []
    for key, wanted, name in (("cold", COLD, "cold"), ("cached", CACHED, "with the factor cached")):
        for nx, promised in wanted.items():
            row = bodies.get(nx) or {}
            found.append((f"paper's body, NX = {nx}: the fastest other solver over ours {name}", f"at least {promised} x", *ratio_to_peers(row, key, promised), ""))
    return found


def ratio_to_peers(row, key, promised):
    """(figure, kept). Where no other solver has an answer, ours is faster than any."""
    if row.get(key) is not None:
        return f"{sig(row[key], 3)} x", row[key] >= promised
    return ("no other solved it", True) if row.get(f"{key}_seconds") is not None else (NONE, None)


# (name of the run, what, target, figure as text, whether it is kept; both of the run's figures)
SERVICE = [
    ("500 x kill -9, 16 posting clients", "kill -9 while 16 clients post: lost, twice, stuck, damaged", "0 in 500 cycles",
     lambda f: f"{sum(f[k] for k in ('lost', 'twice', 'stuck', 'damaged'))} in {count(f['cycles'])}",
     lambda f: f["cycles"] >= 500 and not any(f[k] for k in ("lost", "twice", "stuck", "damaged"))),
    ("1,000 power losses, faults at every write, 1,000 damaged files", "simulated power losses: acknowledged jobs lost; faults at every write; damaged files",
     "0 in 1,000; 1,000 files", lambda f: f"{f['errors']} in {count(f['power_losses'])}; {count(f['damaged_files'])} files",
     lambda f: f["errors"] == 0 and f["power_losses"] >= 1000 and f["damaged_files"] >= 1000),
    ("every allocation of a job fails", "every allocation fails in turn: crashes, leaks, jobs that do not end", "0",
     lambda f: f"{sum(f.get(k, 0) for k in ('errors', 'stuck', 'leaked'))} in {count(f['allocations'])}",
     lambda f: not any(f.get(k) for k in ("errors", "stuck", "leaked", "wrong_exit"))),
    ("200,000 malformed requests", "malformed requests: 5xx but 503 and 507", "0 in at least 100,000",
     lambda f: f"{f['errors']} in {count(f['mutants'])}", lambda f: f["errors"] == 0 and f["mutants"] >= 100000),
    ("1,000 slow clients, /healthz", "1,000 slow clients: `/healthz` p99", "under 100 ms", lambda f: ms(f["p99_ms"]),
     lambda f: f["p99_ms"] < 100 and f["clients"] >= 1000 and f["errors"] == 0),
    ("200 x SIGTERM under load", "SIGTERM under load: other exit than 0", "0 in 200", lambda f: f"{f['wrong_exit']} in {count(f['cycles'])}",
     lambda f: f["wrong_exit"] == 0 and f["cycles"] >= 200),
    ("cancel", "cancel while iterating, p99", "under 100 ms", lambda f: ms(f["p99_ms"]), lambda f: f["p99_ms"] < 100 and f["errors"] == 0),
    ("cancel while ordering and factoring", "cancel while ordering or factoring, p99", "under 2 s", lambda f: ms(f.get("p99_ms", f["max_ms"])),
     lambda f: f.get("p99_ms", f["max_ms"]) < 2000 and f["errors"] == 0),
    ("30 x 10 body, default solver", "30 x 10 body, factor cached, 64 clients, durable", "at least 1,000 jobs/s",
     lambda f: f"{count(round(f['jobs_per_s']))} jobs/s", lambda f: f["jobs_per_s"] >= 1000 and f["clients"] == 64 and not f["refused"] and not f["broken"]),
    ("30 x 10 body, default solver", "the same: p99 of the wait", "under 250 ms", lambda f: ms(f["p99_ms"]), lambda f: f["p99_ms"] < 250),
    *[("one million jobs in the database", f"one million jobs against none: {what}", "within 2 x", lambda f, k=what + "_ratio": f"{ratio(f[k])} x",
       lambda f, k=what + "_ratio": f[k] <= 2 and f["jobs"] >= 1000000 and f["errors"] == 0) for what in ("list", "get", "submit")],
    ("600 x 200 cells: HTTP against the library", "a 600 x 200 scene through HTTP over the library call", "at most 1.25 x", lambda f: f"{ratio(f['scene_ratio'])} x",
     lambda f: f["scene_ratio"] <= 1.25 and f["errors"] == 0),
    ("600 x 200 cells: HTTP against the library", "the same as raw matrices", "at most 1.6 x", lambda f: f"{ratio(f['matrices_ratio'])} x",
     lambda f: f["matrices_ratio"] <= 1.6 and f["errors"] == 0),
    ("100,000 jobs", "100,000 jobs: descriptors; memory grown by", "0; less than 10 MB", lambda f: f"{f['descriptors']}; {sig(f['memory_grown_mb'])} MB",
     lambda f: f["descriptors"] <= 0 and f["memory_grown_mb"] < 10 and f["jobs"] >= 100000),
]


def service(data):
    found = []
    for name, what, target, text, kept in SERVICE:
        row = row_of(data, name)
        if row is None:
            found.append((what, target, NONE, None, ""))
        else:
            found.append((what, target, text(row["figures"]), kept(row["figures"]) and not row.get("wrong"), mark(row)))
    return found


SERVICE_JOB = "600 x 200 scene through HTTP, "
# (row of the bench, which of its values, what, how many times at most, of how many runs at least)
BENCH = [
    ("service_cold", "median", SERVICE_JOB + "cold, over the linear solve: median", 1.1, 20),
    ("service_cold", "max", SERVICE_JOB + "cold, over the linear solve: worst of 20, the first of a new daemon included", 1.3, 20),
    ("service_second", "median", SERVICE_JOB + "second job on a body, over one `cholmod_solve`", 2.5, 20),
    ("service_tenth", "median", SERVICE_JOB + "tenth job on a body, over one `cholmod_solve`", 1.3, 20),
    ("beam_quad4_m400", "median", "beam 1000:1, `quad4`, 400 contacts, certified 1e-8, over the linear solve", 20, 5),
    ("beam_quad4_m1000", "median", "the same, 1,000 contacts", 20, 5),
    ("beam_quad8_m400", "median", "the same, `quad8`, 400 contacts", 20, 5),
    ("chenhark_d5000", "median", "CHENHARK, 5,000 dofs, certified 1e-8, over the linear solve", 20, 5),
]


def bench(data):
    rows = {row["name"]: row for row in (data.get("bench") or {}).get("ratios", [])}
    found = []
    for name, which, what, most, runs in BENCH:
        row = rows.get(name)
        kept = row and row["runs"] >= runs and row[which] <= most
        found.append((what, f"at most {most} x", f"{sig(row[which], 3)} x" if row else NONE, kept, mark(row) if row else ""))
    return found


VERDICT = {True: "kept", False: "**missed**", None: "not measured"}


def every(data):
    return iterations(data) + peers(data) + bench(data) + service(data)


def lines(data):
    """The table of docs/numbers.md."""
    found = every(data)
    beside = tables.beside(data, "peers", "problems")[1:] if "peers" in data else []
    rows = [[what, target, text + dagger, VERDICT[kept]] for what, target, text, kept, dagger in found]
    count_of = {verdict: sum(kept is verdict for _, _, _, kept, _ in found) or "none" for verdict in VERDICT}
    told = f"{count_of[True]} kept, {count_of[False]} missed, {count_of[None]} not measured."
    return table(["promised", "target", "measured", "verdict"], rows) + [
        "", " ".join([told] + [f"{FOOTNOTE}."] * any(dagger for *_, dagger in found) + [f"The other solvers: {line[0].lower()}{line[1:]}" for line in beside])]
