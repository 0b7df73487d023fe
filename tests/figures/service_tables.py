"""What `make soak` measured: in words, and the figures as they are."""
import stamp
from tables import NONE, sig, table

DAGGER = " †"
FOOTNOTE = "† measured beside other work on the machine"
COUNTED = ("500 x kill -9, 16 posting clients", "200 x SIGTERM under load", "1,000 power losses, faults at every write, 1,000 damaged files",
           "200,000 malformed requests", "every allocation of a job fails", "100,000 jobs")


def row_of(data, name):
    """A run of tests/soak/soak.py by its name, or None."""
    return next((row for row in (data.get("soak") or {}).get("rows", []) if row["name"] == name), None)


def mark(row):
    """Other work says nothing about what is only counted."""
    return DAGGER if row["name"] not in COUNTED and stamp.beside_other_work(row.get("stamp", {})) else ""


def count(value):
    return NONE if value is None else f"{value:,}"


def ratio(value):
    return NONE if value is None else f"{value:.2f}"


def ms(value):
    return NONE if value is None else f"{sig(value)} ms"


def none_of(f, *keys):
    """What must not be, in words: "none lost", or how many."""
    found = [f"**{f[key]} {key}**" for key in keys if f.get(key)]
    words = [key.replace("_", " ") for key in keys]
    return ", ".join(found) or "none " + " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def errors(f, fine):
    return fine if not f.get("errors") else f"**{f['errors']} errors**"


def waits(f):
    return ", ".join(f"{name} {ms(f[key])}" for name, key in (("p50", "p50_ms"), ("p99", "p99_ms"), ("at most", "max_ms")) if key in f)


def told(f, which):
    event = f.get(which) or {}
    return f"{sig(event.get('first', 0) / 1e3)} to {sig(event['p99'] / 1e3)} s" if "p99" in event else NONE


def throughput(f):
    return f"{count(round(f['jobs_per_s']))} jobs a second, p99 of the wait {ms(f['p99_ms'])}" + (
        "" if not f.get("refused") and not f.get("broken") else ", " + none_of(f, "refused", "broken"))


# By the name of the run: what it did, and what came of it.
SHOWN = {
    "500 x kill -9, 16 posting clients": (lambda f: f"{count(f['cycles'])} x kill -9 with 16 clients posting, {count(f.get('acknowledged'))} jobs acknowledged",
                                          lambda f: none_of(f, "lost", "twice", "stuck", "damaged")),
    "500 x kill -9 of a worker, 16 posting clients": (
        lambda f: f"{count(f['kills'])} x kill -9 of a process that solves, with 16 clients posting, {count(f.get('acknowledged'))} jobs acknowledged",
        lambda f: none_of(f, "lost", "twice", "stuck")),
    "a mixed load of ten minutes: kills of workers, dismissals, reloads": (
        lambda f: f"{count(f['jobs'])} jobs with {count(f['killed'])} kills of processes that solve, {count(f['dismissed'])} dismissals "
                  f"at any moment, {count(f['reloaded'])} reloads",
        lambda f: none_of(f, "errors", "stuck", "twice", "broken") + f"; megabytes at each quarter {f['memory_mb']}"),
    "200 x SIGTERM under load": (lambda f: f"{count(f['cycles'])} x SIGTERM under load", lambda f: "all exit 0" if not f["wrong_exit"] else none_of(f, "wrong_exit")),
    "three daemons and PostgreSQL: 500 faults, 16 posting clients": (
        lambda f: f"{count(f['faults'])} faults of three daemons and their PostgreSQL (killed, stopped past the lease, restarted, cut off) with 16 clients posting, "
                  f"{count(f['acknowledged'])} jobs acknowledged",
        lambda f: none_of(f, "lost", "twice", "stuck", "damaged")),
    "two daemons: one dies": (lambda f: f"one of two daemons dies, lease {sig(f['lease_s'])} s", lambda f: f"its jobs wait {sig(f['waited_s'])} s; {none_of(f, 'stuck')}"),
    "three daemons: upgrade from the version before": (lambda f: f"three daemons are replaced by those of the next version, {count(f['acknowledged'])} jobs acknowledged",
                                                       lambda f: none_of(f, "errors", "lost", "twice", "stuck", "damaged")),
    "three daemons: 1,500 jobs of 200 bodies": (
        lambda f: f"{count(f['jobs'])} jobs of {count(f['bodies'])} bodies on three daemons, jobs where their body's factor is against jobs anywhere",
        lambda f: errors(f, f"{sig(f['hits_percent'])} % against {sig(f['hits_by_chance_percent'])} % of factors are there; time {ratio(f['time_ratio'])}")),
    "30 x 10 body, default solver, PostgreSQL": (lambda f: f"the 30 x 10 body through PostgreSQL, {f['clients']} keep-alive clients, to the certified answer", throughput),
    "1,000 power losses, faults at every write, 1,000 damaged files": (
        lambda f: f"{count(f.get('power_losses'))} simulated power losses; a full disk or an I/O error at every write; {count(f.get('damaged_files'))} damaged database files",
        lambda f: errors(f, f"nothing acknowledged lost, no crash; refused files left as they were; of the {count(f.get('opened'))} that opened, what was read is what was written")),
    "1,000 slow clients, /healthz": (lambda f: f"{count(f['clients'])} slow clients", lambda f: errors(f, f"`/healthz` p99 {ms(f['p99_ms'])}")),
    "2,000 event streams, 1,000 long polls": (
        lambda f: f"{count(f['streams'])} event streams and {count(f['polls'])} long polls at once",
        lambda f: errors(f, f"{sig(f['kb_each'])} kB each, {sig(f['idle_cpu_percent'])} % of a processor while nothing happens, told of a job's end after {told(f, 'event_ms')}")),
    "200,000 malformed requests": (
        lambda f: f"{count(f['mutants'])} malformed requests: mutated JSON, meshes, matrices, heads",
        lambda f: errors(f, f"no error of the server, {none_of(f, 'stuck')}; {' to '.join(f['memory_mb'].split('/')[::max(1, len(f['memory_mb'].split('/')) - 1)])} MB")),
    "200 requests in random orders, cold and cached": (
        lambda f: f"{count(f['requests'])} requests in random orders, on an empty cache and on one that others filled",
        lambda f: errors(f, f"{count(f['converged'])} bodies solved")),
    "every allocation of a job fails": (lambda f: f"every one of the {count(f['allocations'])} allocations of a job fails, once and from then on",
                                        lambda f: errors(f, f"no crash, other jobs finish; {none_of(f, 'stuck', 'leaked')}")),
    "600 x 200 cells: HTTP against the library": (lambda f: "a 600 x 200 scene through HTTP over the library call; as uploaded matrices",
                                                  lambda f: errors(f, f"{ratio(f['scene_ratio'])}; {ratio(f['matrices_ratio'])}")),
    "cancel": (lambda f: "cancel of a running job while it iterates", lambda f: errors(f, waits(f))),
    "cancel while ordering and factoring": (lambda f: "cancel while it orders or factors (d = 107,000)", lambda f: errors(f, waits(f))),
    "30 x 10 body, default solver": (lambda f: f"the 30 x 10 body, factor cached, {f['clients']} keep-alive clients, to the certified answer", throughput),
    "30 x 10 body, accelerated_restart": (lambda f: f"the same by `accelerated_restart`, {f['clients']} clients", throughput),
    "30 x 10 body, acknowledged only": (lambda f: f"the same, acknowledged only, {f['clients']} clients", throughput),
    "one million jobs in the database": (lambda f: f"{count(f['jobs'])} jobs in the database against none",
                                         lambda f: errors(f, f"list {ratio(f['list_ratio'])}, get {ratio(f['get_ratio'])}, submit {ratio(f['submit_ratio'])} times")),
    "100,000 jobs": (lambda f: f"{count(f['jobs'])} jobs in one run", lambda f: f"{f['descriptors'] or 'no'} descriptor, {sig(f['memory_grown_mb'])} MB"),
}


def figures_text(row):
    """The figures as they are; runs inside as "name.part"."""
    flat = {}
    for key, value in row["figures"].items():
        flat.update({f"{key}.{part}": one for part, one in value.items()} if isinstance(value, dict) else {key: value})
    return ("**WRONG** " if row.get("wrong") else "") + ", ".join(f"{key} {value}" for key, value in flat.items())


def shown(row):
    what, came = SHOWN[row["name"]]
    return [what(row["figures"]), ("**WRONG** " if row.get("wrong") else "") + came(row["figures"]) + mark(row)]


def footnote(rows):
    return ["", FOOTNOTE + "."] if any(mark(row) for row in rows) else []


def soak(data):
    """Two tables: what was done and what came of it; the figures of every run."""
    rows = (data.get("soak") or {}).get("rows")
    if not rows:
        return None
    words = [shown(row) if row["name"] in SHOWN else [row["name"], figures_text(row) + mark(row)] for row in rows]
    figures = [[row["name"], figures_text(row) + mark(row), NONE if row.get("seconds") is None else f"{row['seconds']:.0f}", row["stamp"].get("measured", NONE),
                f"`{row['stamp'].get('commit', 'unknown')}`", sig(row["stamp"].get("load")), sig(row["stamp"].get("others"))] for row in rows]
    return [*table(["what was done", "what came of it"], words), "",
            *table(["`make soak`", "figures", "s", "when", "commit", "load before", "processors of others"], figures), *footnote(rows)]
