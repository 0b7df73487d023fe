"""The figures of docs/numbers.md, drawn from the measured data."""
import svg
from svg import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, Count, Linear, Log, Panel

METHODS = {"auto": ("auto", BLACK), "active_set": ("active_set", BLUE), "accelerated_restart": ("accelerated_restart", VERMILION),
           "accelerated": ("accelerated", GREEN), "uzawa": ("uzawa", ORANGE), "conjugate": ("conjugate", PURPLE)}
OPERATORS = {"auto": ("", "circle"), "condensed": ("", "circle"), "factored": ("6,3", "square"), "matrix_free": ("1.5,2.5", "triangle")}
LEVELS = ["quick", "balanced", "1e-4", "1e-6", "precise", "1e-10", "exact"]
FLOOR = 1e-17  # what is smaller is drawn here
MISS = "time_limit"

WAYS = {"uzawa": ("Uzawa (Algorithm 1)", ORANGE, "6,3", "triangle"), "accelerated": ("accelerated", GREEN, "1.5,2.5", "down"),
        "restart": ("accelerated with restart", VERMILION, "", "circle"), "conjugate": ("conjugate", BLUE, "", "square"),
        "restart_paper_step": ("with restart, step λ₁(K)", PURPLE, "8,2,2,2", "diamond"),
        "restart_factored": ("with restart, a sparse solve per iteration", SKY, "4,2", "square"),
        "auto": ("auto, certified 1e-6", BLACK, "", "circle"), "auto_cached": ("auto, factor cached", BLACK, "2,2", "circle")}
PROFILE_COLOURS, PROFILE_DASHES = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY), ("", "6,3", "1.5,2.5")
PEER_STYLES = [(c, s) for s in ("cross", "plus", "square", "diamond", "down") for c in ("#7a7a7a", "#4a6a8a", "#a0522d")]


def history(data):
    """Figure 2 of the paper, with the distance to the minimum beside the objective."""
    parts, sizes = [], sorted({run["nx"] for run in data})
    names = ["uzawa", "accelerated", "restart"]
    key = [(WAYS[n][0], WAYS[n][1], WAYS[n][2], None, False) for n in names]
    drawn, _ = svg.legend(key, 70, 22, 260)
    parts += drawn
    for row, nx in enumerate(sizes):
        runs = [run for run in data if run["nx"] == nx]
        top, longest = 70 + 290 * row, max(run["iterations"] for run in runs)
        x, minimum = Log(1, longest), runs[0]["minimum"]
        lowest = min(values[1] for run in runs for values in run["rows"][1:])
        panels = [Panel(90, top, 240, 210, x, Linear(lowest * 1e3, minimum * 1e3)),
                  Panel(410, top, 250, 210, x, Log(1e-13, max(minimum - lowest, 1e-12), 8)),
                  Panel(740, top, 250, 210, x, Log(1e-10, max(v[2] for run in runs for v in run["rows"]), 8))]
        title = f"{nx} x {nx // 3}"
        for panel, name, unit in zip(panels, ("dual objective", "minimum − dual objective", "total residual (e1 to e4)"),
                                     ("10⁻³ N mm", "N mm", "mixed units, as in the paper")):
            panel.axes(f"{title}: {name}", "iteration", unit, 60 if panel is panels[0] else 40)
            for run in runs:
                way = WAYS["restart" if run["method"] == "accelerated_restart" else run["method"]]
                rows = [v for v in run["rows"] if v[0] >= 1]
                pick = {0: lambda v: v[1] * 1e3, 1: lambda v: minimum - v[1], 2: lambda v: v[2]}[panels.index(panel)]
                panel.line([(v[0], pick(v)) for v in rows], way[1], way[2])
            parts += panel.out
    return svg.document(1020, 45 + 290 * len(sizes), "Convergence of the paper's three methods", parts)


def profiles(data):
    """Share of all problems that each solver has solved and certified within so many times the fastest's time (Dolan and More, Math.
    Program. 91 (2002)), by tolerance."""
    names = sorted({name for profile in data.values() for name in profile})
    style = {"uzawa": (BLACK, "")}
    for k, name in enumerate(n for n in names if n not in style):
        style[name] = (PROFILE_COLOURS[k % len(PROFILE_COLOURS)], PROFILE_DASHES[k // len(PROFILE_COLOURS) % len(PROFILE_DASHES)])
    parts, tall = svg.legend([(n, style[n][0], style[n][1], None, False) for n in names], 70, 22, 180, 5)
    top = 40 + tall + 20
    longest = max((point[0] for profile in data.values() for points in profile.values() for point in points), default=10.0)
    for k, (tolerance, profile) in enumerate(data.items()):
        panel = Panel(75 + 325 * k, top, 260, 260, Log(1, max(longest, 10)), Linear(0, 1))
        panel.axes(f"certified to {tolerance}", "time over that of the fastest", "share of the problems" if k == 0 else "")
        for name in names:
            steps, share = [], 0.0
            for ratio, reached in profile.get(name, []):
                steps += [(ratio, share), (ratio, reached)]
                share = reached
            panel.line(steps + [(longest, share)], *style[name], 2.2 if name == "uzawa" else 1.4)
        parts += panel.out
    return svg.document(60 + 325 * max(3, len(data)), top + 330, "Performance profiles", parts)


def ways_of(data, rule, names):
    """{name: [(d, run)]} of runs that ended by their rule."""
    found = {}
    for size in data:
        for run in size["ways"]:
            if run["name"] in names and run["rule"] == rule and "iterations" in run:
                found.setdefault(run["name"], []).append((size, run))
    return found


def spread(values, factor=1.3):
    values = [v for v in values if v and v > 0]
    return min(values) / factor, max(values) * factor


def peers_of(peers, tolerance=1e-6):
    """{solver: [row by size]}: of each solver's runs on the paper's body the fastest whose answer was certified to the tolerance. The
    others are in the table."""
    best = {}
    for row in peers:
        ours = row["solver"].startswith("uzawa")  # drawn already
        if not ours and row.get("nx") and row.get("seconds") and (row.get("certified") or 1) <= tolerance:
            key = row["solver"], row["nx"]
            if key not in best or row["seconds"] < best[key]["seconds"]:
                best[key] = row
    found = {}
    for (solver, _), row in sorted(best.items()):
        found.setdefault(solver, []).append(row)
    return found


def sizes(data, peers):
    """Figure 3 of the paper: time and total residual against size; peers where they were measured."""
    names = ["uzawa", "accelerated", "restart", "restart_factored", "conjugate"]
    found = {**ways_of(data, "paper", names), **ways_of(data, "certified", ["auto", "auto_cached"])}
    others = peers_of(peers)
    style = {name: PEER_STYLES[k % len(PEER_STYLES)] for k, name in enumerate(others)}
    key = [(WAYS[n][0], WAYS[n][1], WAYS[n][2], WAYS[n][3], n == "auto_cached") for n in found]
    key += [(name, style[name][0], "1,0", style[name][1], False) for name in others]
    drawn, tall = svg.legend(key, 70, 22, 250, 4)
    parts, top = list(drawn), 40 + tall + 20
    x = Log(*spread([s["d"] for s in data], 1.05))
    for k, (title, what, theirs, y_label) in enumerate(SIZE_PANELS):
        values = [max(run[what], FLOOR) for runs in found.values() for _, run in runs]
        values += [row[theirs] for rows in others.values() for row in rows if theirs and row[theirs]]
        panel = Panel(75 + 350 * k, top, 275, 300, x, Log(*spread(values)))
        panel.axes(title, "unknowns d", y_label)
        for name, rows in others.items() if theirs else ():
            points = [(row["d"], max(row[theirs], FLOOR)) for row in rows]
            panel.line(points, style[name][0], "", 1.0)
            for point in points:
                panel.mark(style[name][1], *point, style[name][0])
        for name, runs in found.items():
            draw_way(panel, name, runs, what)
        parts += panel.out
    return svg.document(1080, top + 370, "Time and total residual against size", parts)


SIZE_PANELS = (("time", "cpu_s", "seconds", "seconds of one core, cold unless said"),
               ("total residual (e1 to e4)", "residual", None, "mixed units, as in the paper"),
               ("certified error of the answer", "certified", "certified", "relative, energy norm"))


def draw_way(panel, name, runs, what):
    _, colour, dash, shape = WAYS[name]
    panel.line([(s["d"], max(run[what], FLOOR)) for s, run in runs if run["outcome"] != MISS], colour, dash)
    for s, run in runs:
        panel.mark("cross" if run["outcome"] == MISS else shape, s["d"], max(run[what], FLOOR), colour, name == "auto_cached")


def iterations(data):
    names = ["uzawa", "accelerated", "restart_paper_step", "restart", "conjugate"]
    key = [(WAYS[n][0], WAYS[n][1], WAYS[n][2], WAYS[n][3], False) for n in names]
    drawn, tall = svg.legend(key, 70, 22, 220)
    parts, top = list(drawn), 40 + tall + 20
    runs = {rule: ways_of(data, rule, names) for rule in ("paper", "certified")}
    counts = [run["iterations"] for found in runs.values() for rows in found.values() for _, run in rows]
    for k, (rule, title) in enumerate((("paper", "to ‖ρ − r‖ ≤ 1e-6 N, the paper's rule"), ("certified", "to a certified error of 1e-6"))):
        panel = Panel(80 + 480 * k, top, 380, 300, Log(*spread([s["d"] for s in data], 1.05)), Log(*spread(counts)))
        panel.axes(title, "unknowns d", "iterations")
        for name in names:
            rows = runs[rule].get(name, [])
            panel.line([(s["d"], run["iterations"]) for s, run in rows if run["outcome"] != MISS], WAYS[name][1], WAYS[name][2])
            for s, run in rows:
                panel.mark("cross" if run["outcome"] == MISS else WAYS[name][3], s["d"], run["iterations"], WAYS[name][1])
        parts += panel.out
    return svg.document(980, top + 370, "Iterations against size", parts)


def series_of(problem, start):
    """[(method, operator, [runs with an answer, loosest level first])]"""
    found = {}
    for run in problem["runs"]:
        if run["start"] == start and "cpu_s" in run:
            found.setdefault((run["method"], run["operator"]), []).append(run)
    return [(m, o, sorted(runs, key=lambda r: LEVELS.index(r["level"]))) for (m, o), runs in found.items()]


def work_of(run):
    return run["cycles"] if run["operator"] == "matrix_free" else run["back_substitutions"]


COLUMNS = (("cold", "cpu_s", "seconds of one core, cold"), ("cached", "cpu_s", "seconds of one core, factor cached"),
           ("cached", "work", "back-substitutions, cached (matrix_free: cycles)"))
ROWS = (("energy_error", "‖u − u*‖ / ‖u*‖, energy norm"), ("reaction_error", "largest error of a reaction"),
        ("mismatches", "rows wrongly in or out of contact"))


def precision_key():
    key = [(name, colour, "", "diamond" if name == "auto" else None, name == "auto") for name, colour in METHODS.values()]
    key += [(name, svg.FAINT, OPERATORS[name][0], OPERATORS[name][1], False) for name in ("condensed", "factored", "matrix_free")]
    return key + [("stopped by the limit", svg.FAINT, None, "cross", False), ("balanced (with its estimate)", svg.FAINT, None, "circle", True)]


def precision(problem):
    """Achieved error against work: rows of panels by measure, columns by kind of work."""
    parts, tall = svg.legend(precision_key(), 70, 46, 190, 5)
    parts.append(f'<text x="70" y="24" font-size="14" font-weight="bold" fill="{svg.INK}">{svg.escape(problem["title"])}: '
                 f'd = {problem["d"]:,}, m = {problem["m"]:,}, {problem["active"]:,} touch</text>')
    top = 46 + tall + 26
    runs = [run for run in problem["runs"] if "cpu_s" in run]
    for row, (measure, y_label) in enumerate(ROWS):
        values = [max(run[measure] or 0, FLOOR) for run in runs]
        values += [2 * problem["mesh_error"]] if measure == "energy_error" and problem["mesh_error"] else []
        y = Count(max(run["mismatches"] for run in runs)) if measure == "mismatches" else Log(min(values), max(values), 9)
        for column, (start, work, x_label) in enumerate(COLUMNS):
            pick = work_of if work == "work" else lambda run: run[work]
            reach = [max(pick(run), 0.5) if work == "work" else pick(run) for run in runs if run["start"] == start]
            panel = Panel(75 + 345 * column, top + 285 * row, 275, 215, Log(*spread(reach, 1.1)), y)
            mesh = problem["mesh_error"] if measure == "energy_error" else None
            if mesh:
                panel.shade_below(mesh, f"– –  error of the mesh, {100 * mesh:.2g} %")
            panel.axes("", x_label, y_label if column == 0 else "")
            for method, operator, series in sorted(series_of(problem, start), key=lambda s: -list(METHODS).index(s[0])):
                draw_series(panel, method, operator, series, pick, measure)
            if mesh:
                panel.draw_edge()
            parts += panel.out
    return svg.document(1070, top + 285 * len(ROWS), f"Work against precision: {problem['title']}", parts)


def draw_series(panel, method, operator, series, pick, measure):
    """`balanced` stands beside the line: it pays for the estimate of the mesh's error too."""
    colour, (dash, shape), auto = METHODS[method][1], OPERATORS[operator], method == "auto"
    floor = 0 if measure == "mismatches" else FLOOR
    points = [(max(pick(run), 0.5) if pick is work_of else pick(run), max(run[measure] or 0, floor)) for run in series]
    panel.line([point for run, point in zip(series, points) if run["level"] != "balanced"], colour, dash, 2.0 if auto else 1.3)
    for run, point in zip(series, points):
        missed = run["outcome"] == MISS
        panel.mark("cross" if missed else "diamond" if auto else shape, *point, colour, auto or run["level"] == "balanced", 4.5 if auto else 3.4)
