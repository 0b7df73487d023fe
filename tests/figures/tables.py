"""The tables of docs/numbers.md, from the data in docs/figures. Each function returns
Markdown lines, or None where the data it needs was not measured."""
import math
import statistics

import stamp

LEVELS = ["quick", "balanced", "precise", "exact"]
NONE = "–"


def sig(value, digits=2):
    """A number with so many digits, all of them before the point, without an exponent where that reads better."""
    if value is None:
        return NONE
    if value == 0:
        return "0"
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    if not exponent:
        return mantissa
    if 0 < int(exponent) < 7:
        return f"{value:,.0f}"
    return f"{mantissa}e{int(exponent)}"


def duration(seconds):
    if seconds is None:
        return NONE
    for unit, scale in (("s", 1), ("ms", 1e3), ("µs", 1e6)):
        if seconds * scale >= 0.9995 or unit == "µs":
            return f"{sig(seconds * scale)} {unit}"


def table(head, rows):
    return ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]


def percent(value):
    return NONE if value is None else f"{sig(100 * value)} %"


# ---- when, and beside what

def stamps(data, name, key=None, shown=("",)):
    """Of the rows of a set of data whose names begin so; of the whole, where rows have none."""
    whole = data[name]["machine"]
    return [row.get("stamp") or whole for row in data[name].get(key) or [] if str(row.get("name", "")).startswith(shown)] or [whole]


def span(values, text=str):
    found = sorted({value for value in values if value is not None})
    return NONE if not found else text(found[0]) if len(found) == 1 else f"{text(found[0])} .. {text(found[-1])}"


def beside(data, name, key=None, shown=("",)):
    """A note for below a table of times, where other programs ran meanwhile."""
    found = [one for one in stamps(data, name, key, shown) if stamp.beside_other_work(one)]
    if not found:
        return []
    load, others = span((one.get("load") for one in found), sig), span((one.get("others") for one in found), sig)
    told = [f"load {load}" if load != NONE else "", f"{others} processors" if others != NONE else ""]
    told = ", ".join(text for text in told if text)
    return ["", f"Measured beside other work{f' ({told})' if told else ''}."]


# ---- work and precision

def find(problem, level, start, method="auto", operator="auto"):
    for run in problem["runs"]:
        if (run["method"], run["operator"], run["level"], run["start"]) == (method, operator, level, start):
            return run if "cpu_s" in run else None
    return None


def level_cell(problem, level):
    cold, cached = find(problem, level, "cold"), find(problem, level, "cached")
    if not cold or not cached:
        return NONE
    return f"{duration(cold['cpu_s'])} / {duration(cached['cpu_s'])}; {sig(cached['energy_error'], 1)}"


def levels(data):
    """What each accuracy level costs."""
    if not data.get("figures"):
        return None
    rows = [[p["title"], f"{p['d']:,}", percent(p["mesh_error"])] + [level_cell(p, level) for level in LEVELS]
            for p in data["figures"]["precision"]]
    return table(["cold / cached time of `auto`; error of the answer", "d", "error of the mesh"] + [f"`{name}`" for name in LEVELS], rows)


def level_rows(problem):
    """All levels of one problem, asked, certified and achieved."""
    rows = []
    for level in ["quick", "balanced", "1e-4", "1e-6", "precise", "1e-10", "exact"]:
        cold, cached = find(problem, level, "cold"), find(problem, level, "cached")
        if cold and cached:
            rows.append([f"`{level}`", "rounding" if level == "exact" else sig(cached["requested"]), duration(cold["cpu_s"]),
                         duration(cached["cpu_s"]), sig(cached["back_substitutions"]), sig(cached["certified"]),
                         sig(cached["energy_error"]), sig(cached["reaction_error"]), cached["mismatches"]])
    return table(["level", "asked", "cold", "cached", "back-substitutions", "certified", "achieved", "largest reaction", "mismatches"], rows)


def cheapest(problem):
    """For each level the series that is cheapest with the factor cached, and the gradient methods' best."""
    rows = []
    for level in ["quick", "balanced", "1e-4", "1e-6", "precise", "1e-10", "exact"]:
        row = [f"`{level}`"]
        for method in ("auto", "active_set", "conjugate", "accelerated_restart", "accelerated", "uzawa"):
            met = [run for run in problem["runs"] if run["method"] == method and run["level"] == level and
                   run["start"] == "cached" and run["outcome"] == "converged"]
            best = min(met, key=lambda run: run["cpu_s"], default=None)
            row.append(f"{duration(best['cpu_s'])} ({best['operator_used']})" if best else NONE)
        if any(cell != NONE for cell in row[1:]):
            rows.append(row)
    return table(["cached, cheapest form", "auto", "active_set", "conjugate", "accelerated_restart", "accelerated", "uzawa"], rows)


def ends(problem):
    """How many runs ended how: nothing is dropped."""
    count = {}
    for run in problem["runs"]:
        count[run["outcome"]] = count.get(run["outcome"], 0) + 1
    return ", ".join(f"{n} {name}" for name, n in sorted(count.items()))


def false_claims(problem):
    """Runs whose error is larger than the bound they carry: must be none. A rounding of the reference's own is forgiven."""
    return [run for run in problem["runs"] if run.get("certified") is not None and
            run["energy_error"] > run["certified"] * (1 + 1e-9) + 1e-16]


# ---- iterations

def way(size, name, rule):
    for run in size["ways"]:
        if run["name"] == name and run["rule"] == rule and "iterations" in run:
            return run
    return None


def count_cell(run):
    if not run:
        return NONE
    return ("> " if run["outcome"] == "time_limit" else "") + f"{run['iterations']:,}"


def over(run, base):
    """Iterations over those of another way."""
    if not run or not base or base["outcome"] == "time_limit":
        return NONE
    return ("> " if run["outcome"] == "time_limit" else "") + sig(run["iterations"] / base["iterations"], 3)


RULES = (("paper", "restart", "the paper's rule"), ("as_far", "restart_as_far", "the error that λ₁(K) had then"), ("certified", "restart", "certified 1e-6"))


def iteration_runs(size, rule, base):
    """The runs of a row: with restart, what it is compared with, and conjugate steps."""
    if rule == "as_far":
        return way(size, base, "certified"), way(size, "restart_paper_step", "paper"), None, None, way(size, "conjugate_as_far", "certified")
    return tuple(way(size, name, rule) for name in (base, "restart_paper_step", "accelerated", "uzawa", "conjugate"))


def iterations(data):
    """By size and rule: counts, their ratios, and what was certified of the answers whose ratio says least."""
    rows = []
    for rule, base, name in RULES:
        for size in data["figures"]["sizes"]:
            restart, step, plain, uzawa, conjugate = iteration_runs(size, rule, base)
            reached = [sig(run["certified"]) if run else NONE for run in (conjugate, restart, step)]
            rows.append([name, f"{size['nx']} x {size['nx'] // 3}"] + [count_cell(run) for run in (conjugate, restart, step, plain, uzawa)] +
                        [over(step, restart), over(uzawa, restart), over(step, conjugate), over(uzawa, conjugate)] + reached)
    return table(["until", "cells", "`conjugate`", "with restart", "with restart, step λ₁(K)", "without restart", "Uzawa", "λ₁(K) / restart",
                  "Uzawa / restart", "λ₁(K) / `conjugate`", "Uzawa / `conjugate`", "certified: `conjugate`", "restart", "λ₁(K)"], rows)


def least_ratio(data, rule, base, which, saver=0):
    """(ratio, NX) of the size at which the accelerated method with restart (saver 4: conjugate steps) saves least."""
    ratios = []
    for size in data["figures"]["sizes"]:
        runs = iteration_runs(size, rule, base)
        if runs[saver] and runs[which]:
            ratios.append((runs[which]["iterations"] / runs[saver]["iterations"], size["nx"]))
    return min(ratios, default=None)


def size_rows(data):
    """Figure 3 as a table."""
    rows = []
    names = [("uzawa", "paper"), ("accelerated", "paper"), ("restart", "paper"), ("restart_factored", "paper"), ("auto", "certified"), ("auto_cached", "certified")]
    for size in data["figures"]["sizes"]:
        row = [f"{size['nx']} x {size['nx'] // 3}", f"{size['d']:,}"]
        for name, rule in names:
            run = way(size, name, rule)
            text = NONE if not run else f"{duration(run['cpu_s'])}, {sig(run['residual'])}"
            row.append("> " + text if run and run["outcome"] == "time_limit" else text)
        rows.append(row)
    return table(["cells", "d", "Uzawa", "accelerated", "with restart", "with restart, a sparse solve per iteration", "auto, certified 1e-6", "the same, cached"], rows)


# ---- what other commands measure

def ratio(data, name, digits=2):
    for row in (data.get("bench") or {}).get("ratios", []):
        if row["name"] == name:
            return f"{row['median']:.{digits}f}"
    return NONE


IN_RATIOS, IN_DIGITS = ("cold_nx", "cached_nx", "100_load", "memory_nx"), ("accuracy_",)


def ratios(data):
    if not data.get("bench"):
        return None
    sizes = [150, 300, 600, 900]
    rows = [["d"] + [f"{2 * nx * (nx // 3 + 1):,}" for nx in sizes],
            ["cold, from assembled K to certified 1e-8, over the whole linear solve"] + [ratio(data, f"cold_nx{nx}_1e-08") for nx in sizes],
            ["cached factor, to 1e-8, with energy, resultants and warnings, over one `cholmod_solve`"] + [ratio(data, f"cached_nx{nx}_1e-08") for nx in sizes],
            ["100 load cases on one factor, each to 1e-8, over one `cholmod_solve`"] + [ratio(data, f"100_load_cases_nx{nx}", 0) for nx in sizes],
            ["peak memory of a cold solve over the linear solve's"] + [ratio(data, f"memory_nx{nx}") for nx in sizes]]
    return table(["paper's body, cells"] + [f"{nx} x {nx // 3}" for nx in sizes], rows)


def others(data):
    """The bench's rows that no other table has, as they are."""
    if not data.get("bench"):
        return None
    rows = [[f"`{r['name']}`", sig(r["median"], 3), f"{sig(r['min'], 3)} .. {sig(r['max'], 3)}", r["runs"], r["unit"]]
            for r in data["bench"]["ratios"] if not r["name"].startswith(IN_RATIOS + IN_DIGITS)]
    return table(["`make bench`", "median", "min .. max", "runs", "unit"], rows) if rows else None


SENTENCES = """A scene of 200,000 dofs (546 x 182 `quad4`) is assembled in {assembly_quad4_matrices} s; all fields and the `.vtu` with most of them again take {assembly_quad4_outputs} s: together {assembly_quad4} times CHOLMOD's analysis and factorization (`make bench FILTER=assembly`).

In three dimensions (a cube of 32^3 `hex8` bricks, d = 101,277) cold takes {cold_hex8_d101277} times the linear solve, and {memory_hex8_32} times its memory.

An oblique plane costs {oblique_nx600} times one along an axis.

Matrix Market: {matrix_market_read} MB/s read. The obstacle problem OBSTCLAE (d = 9,604, m = 19,208) to certified 1e-8: {obstclae} ms, {ipopt_over_uzawa_obstclae} times faster than Ipopt to its default tolerance."""


def sentences(data):
    """None unless the bench has run whole, Ipopt included."""
    if not data.get("bench"):
        return None
    values = {row["name"]: sig(row["median"], 3 if 0.9 < row["median"] < 2 else 2) for row in data["bench"]["ratios"]}
    try:
        return SENTENCES.format(**values).splitlines()
    except KeyError:
        return None


def digits(data):
    if not data.get("bench") or ratio(data, "accuracy_auto_1e-02") == NONE:
        return None
    rows = []
    for error in ("1e-02", "1e-04", "1e-06", "1e-08", "1e-10"):
        row = [f"1e-{int(error[-2:])}"]
        for method in ("auto", "accelerated_restart"):
            row += [ratio(data, f"accuracy_{method}_{error}", 1), ratio(data, f"accuracy_{method}_{error}_iterations", 0)]
        rows.append(row)
    return table(["relative error", "`auto`", "steps", "`accelerated_restart`", "iterations"], rows)


def exponent(rows, key):
    """The slope of log seconds over log d, least squares over the finer half."""
    upper = [(math.log(row["d"]), math.log(row[key])) for row in rows[len(rows) // 2:]]
    x, y = (sum(point[i] for point in upper) / len(upper) for i in (0, 1))
    spread = sum((point[0] - x) ** 2 for point in upper)
    return sum((point[0] - x) * (point[1] - y) for point in upper) / spread if spread else math.nan


def growth(data):
    sizes = data.get("bench_size")
    if not sizes:
        return None
    rows = [[f"{r['d']:,}", sig(r["linear_s"]), sig(r["cold_s"]), sig(r["cached_s"]), f"{r.get('cold_over_linear') or r['cold_s'] / r['linear_s']:.2f}", r["iterations"],
             f"{1e-6 * r['factor_bytes']:.1f}"] for r in sizes["sizes"]]
    return table(["d", "linear solve, s", "cold to 1e-8, s", "cached, s", "cold / linear", "steps", "factor, MB"], rows) + ["", (
        "Fitted exponents over the upper half: " + ", ".join(f"{name} {exponent(sizes['sizes'], key):.2f}" for name, key in
                                                            (("linear solve", "linear_s"), ("cold", "cold_s"), ("cached", "cached_s"))) + ".")]


FAMILIES = {"young": "Young's modulus 1e-6..1e15", "poisson": "Poisson's ratio -0.99..0.499999", "thickness": "thickness 1e-9..1e3",
            "aspect": "aspect ratio to 1e4", "length": "length 1e-9..1e6", "load": "load 0, 1e-12..1e12", "gap": "gap 0, negative, to 1e9",
            "fraction": "contact fraction 0, one node, 1", "motion": "prescribed motion", "cells": "numbers of cells",
            "scene elements": "elements: all kinds, nearly incompressible, thin, slivers",
            "scene obstacles": "obstacles: far, tiny, polylines of tiny segments, mm and m",
            "scene bodies": "two bodies: stiffness ratios to 1e8, gaps to 1e9", "mixture": "a mixture of all",
            "stiffness": "K near singular, to rcond 1e-17", "rows": "dependent, parallel, repeated, contradicting rows",
            "range": "numbers at the ends of the range", "exhaustive": "small problems, all active sets searched",
            "invariance": "units, row scaling, renumbering"}


def extremes(data):
    """Claims at the extremes by family; generated problems have a line of their own."""
    if not data.get("extremes"):
        return None
    rows = [[FAMILIES.get(f["family"], f["family"])] + [f[k] for k in ("rows", "converged", "other", "short", "refused", "failed")] +
            [sig(f["least_ratio"], 6)] for f in data["extremes"]["families"] if f["family"] != "generated"]
    total, made = data["extremes"], data["extremes"]["generated"]
    return table(["family", "rows", "converged", "other", "short", "refused", "false", "bound / true error, least"], rows) + ["", (
        f"{total['passed'] + total['failed']:,} claims, {total['failed'] or 'none'} false. {made['problems']:,} generated problems (condition 1 "
        f"to 1e14, dependent rows), {made['solves']:,} solves: {made['wrong'] or 'none'} false; bound over true error has the median "
        f"{sig(made['ratio_median'], 3)}, the least is {sig(made['ratio_least'], 6)}.")]


def theory_bodies(data):
    """{body: {quantity: [(cells, error in percent)]}}"""
    bodies = {}
    for row in data["theory"]["rows"]:
        name, _, cells = row["name"].rpartition(", ")
        errors = bodies.setdefault(name, {}).setdefault(row["quantity"], [])
        errors.append((cells.split(" ")[0], 100 * abs(row["computed"] / row["theory"] - 1)))
    return bodies


def side_by_side(errors):
    return " / ".join(sig(max(e, 1e-3), 2) for _, e in errors) if errors else NONE


def theory(data):
    """Errors in percent of every quantity."""
    if not data.get("theory"):
        return None
    bodies = theory_bodies(data)
    rows = [[name if k == 0 else "", quantity, " / ".join(c for c, _ in errors), side_by_side(errors)]
            for name, quantities in bodies.items() for k, (quantity, errors) in enumerate(quantities.items())]
    return table(["body", "quantity", "cells", "error, %"], rows)


def trade(data):
    """What a whole error costs: unknowns and seconds, refined where the error is and everywhere."""
    if not data.get("trade"):
        return None

    def cost(one):
        if not one:
            return NONE
        return f"{'' if one['reached'] else '~'}{sig(one['d'], 3)}" + (f" ({duration(one['seconds'])})" if one["seconds"] is not None else "")

    measured, rows = data["trade"]["rows"], []
    for row in measured:
        rows += [[row["body"], row["elements"], row["way"], "where it is"] + [cost(one if one and one["reached"] else None) for one in row["adaptive"]] + [sig(row["order_adaptive"])],
                 ["", "", "", "everywhere"] + [cost(one) for one in row["uniform"]] + [sig(row["order_uniform"])]]
    return table(["body", "elements", "error", "refined"] + [f"{sig(100 * t)} %" for t in measured[0]["targets"]] + ["order"], rows)


def forces(data):
    """What a contact force within 2 % takes, beside the best mesh found by hand."""
    rows = [[row["body"], row["element"], f"{row['first']:,}", f"{row['d']:,}", row["grids"], f"{row['value']:.5g}", f"{row['low']:.5g} .. {row['high']:.5g}", f"{row['true']:.5g}",
             f"{row['hand']:,} {row['hand_element']}", sig(row["d"] / row["hand"]), f"{row['sure']:,}" if row["sure"] else "none"] for row in (data.get("trade") or {}).get("forces", [])]
    return table(["body", "elements", "of the first mesh", "unknowns", "grids", "force", "interval", "true", "by hand, known", "unknowns over those", "by hand, told"], rows) if rows else None


def solids(data):
    """Estimated errors in space over true ones."""
    rows = [[f"`{row['element']}`", row["meshes"], *[f"{row[key]:.2f}" for key in ("median", "least", "largest")]] for row in (data.get("solids") or {}).get("rows", [])]
    return table(["element", "meshes", "told over true: median", "least", "largest"], rows) if rows else None


def decks(data):
    """CalculiX's own decks by both, and why others are not compared."""
    found = data.get("decks")
    if not found:
        return None
    rows = [[f"`{row['problem']}`", "tie" if row["ties"] else "contact", f"{row['unknowns']:,}", sig(row["apart"]) if row["apart"] is not None else NONE,
             sig(row["apart_stiff"]) if row["apart_stiff"] is not None else NONE, duration(row["calculix_s"]), duration(row["ours_s"])] for row in found["rows"]]
    why = {}
    for name, text in found["unsaid"].items():
        reason = next((said for word, said in REASONS if word in text), text)
        why.setdefault(reason, []).append(f"`{name}`")
    return table(["deck", "of", "unknowns", "apart", "with stiff contact", "CalculiX", "this service"], rows) + [
        "", f"{len(found['rows'])} of {found['decks']} are compared. Of the others:", "",
        *(f"- {reason}: {', '.join(names)}" for reason, names in sorted(why.items(), key=lambda one: -len(one[1])))]


def space(data):
    """Contact of solids over the linear solve of the same K by another program's multigrid."""
    rows = (data.get("peers_space") or {}).get("rows")
    spread = lambda row: f" ({row['cold_spread'][0]:.2f} .. {row['cold_spread'][1]:.2f})" if row["runs"] > 1 else ""  # noqa: E731
    told = [[f"`{row['mesh']}`" if row["mesh"] != "box" else "box of `hex8`", f"{row['unknowns']:,}", f"{duration(row['gamg_setup_s'])} + {duration(row['gamg_solve_s'])}",
             str(row["gamg_iterations"]), duration(row["cold_s"]), duration(row["cached_s"]),
             f"{row['cold_ratio']:.2f}{spread(row)}", sig(row["target"]), f"{row['cached_ratio']:.2f}", f"`{row['operator']}`", sig(row["certified"], 2)]
            for row in sorted(rows or (), key=lambda row: row["unknowns"])]
    return rows and table(["mesh", "unknowns", "GAMG", "its iterations", "cold", "another load", "cold over GAMG", "target", "another load", "operator", "certified"], told)


def large(data):
    """Large deformation against what is known, and over one solve of small deformation."""
    found = data.get("large")
    if not found:
        return None
    rows = [[row["scene"], f"{row['unknowns']:,}", "; ".join(f"{one['what']} {sig(one['value'], 6)} ({sig(100 * one['off'])} %)" for one in row["told"]) or NONE,
             row["qps"], row["steps"] or NONE, row.get("most") or NONE, sig(row.get("over_small"))] for row in found["rows"]]
    heights = {}
    for row in found["refined"]:
        heights.setdefault((row["element"], row["aside"]), []).append(f"{row['high']}: {sig(100 * row['off'])} %")
    return table(["scene", "unknowns", "found (off by)", "contact problems", "parts", "most in a part", "over small"], rows) + ["", *table(
        ["elements", "moved aside by", "elements through the height: the force is off by"], [[f"`{element}`", aside, "; ".join(each)] for (element, aside), each in heights.items()])]


def thresholds(data):
    """Up to which load auto stays at small deformation, over that up to which it suffices."""
    rows = [[row["body"], row["bodies"], *["" if row[key] is None else f"{row[key]:.3f}" for key in ("least", "largest")]] for row in (data.get("thresholds") or {}).get("rows", [])]
    return table(["body", "of them", "chosen over enough: least", "most"], rows) if rows else None


def peers_large(data):
    """Scenes of large deformation by other programs and the daemon."""
    def of(row, name, fits):
        value, seconds, steps = row[name], row[f"{name}_s"], row[f"{name}_steps"]
        return "off" if value is None or not fits(value) else f"{sig(value, 5)}, {steps}, {duration(seconds)}"

    rows = []
    for row in (data.get("peers_large") or {}).get("rows", []):
        fits = lambda value, ours=row["ours"]: abs(value / ours - 1) <= 0.02  # noqa: E731
        rows.append([row["scene"], f"{row['unknowns']:,}", f"{sig(row['ours'], 5)}, {row['qps']}, {duration(row['ours_s'])}", *(of(row, name, fits) for name in ("calculix", "getfem")),
                     NONE if row["ratio"] is None else f"{row['ratio']:.1f}"])
    return table(["scene", "unknowns", "ours", "CalculiX", "GetFEM", "ratio"], rows) if rows else None


def large_solids(data):
    """Two bodies that slide under large deformation against a finer mesh and GetFEM: parts of a hundred."""
    def part(x):
        return "" if x is None else f"{100 * x:.2f} %"

    def stiff(row):
        """CalculiX's, by the stiffness of its contact."""
        return "; ".join(f"{one['stiffness']}: {part(one['off']) or NONE}" for one in (row.get("calculix") or {}).get("rows", []))

    rows = []
    for row in (data.get("large_solids") or {}).get("rows", []):
        compared = next(one for one in row["rows"] if one["element"] == row["finer"]["element"])  # the mesh of the others
        rows += [[row["scene"], f"`{one['element']}`{'' if 'force_off' in one else ', finest'}", f"{one['unknowns']:,}", one["qps"], *(part(one.get(key)) for key in ("force_off", "area_off", "pressure_off", "getfem_off")),
                  stiff(row) if one is compared else ""] for one in row["rows"]]
    return table(["scene", "element", "unknowns", "contact problems", "force", "area", "largest pressure", "force, GetFEM", "force, CalculiX"], rows) if rows else None


def cycles(data):
    """Iterations on boxes by their cells, and how much they grow."""
    found = data["bench_solids"]["boxes"]
    sides = sorted({row["cells"] for row in found})
    rows = []
    for aspect in sorted({row["aspect"] for row in found}, reverse=True):
        own = {row["cells"]: row["iterations"] for row in found if row["aspect"] == aspect}
        rows.append([sig(aspect), *(str(own.get(side, NONE)) for side in sides), f"{max(own.values()) / min(own.values()):.2f} (1.3)"])
    return table(["aspect", *(str(side) for side in sides), "grown (target)"], rows)


def shapes(data):
    """What makes a solid dearer than the plain cube, and many load cases."""
    rows = []
    for row in data["bench_solids"]["rows"]:
        told = [duration(value) if row["unit"] else f"{value:.2f}" for value in (row["cold"], row["cached"]) if value is not None]
        rows.append([row["what"], "box of `hex8`" if row["mesh"] == "box" else f"`{row['mesh']}`", f"{row['unknowns']:,}", f"`{row['operator']}`", *told, *[NONE] * (2 - len(told)), f"{row['target']}{' ' + row['unit'] if row['unit'] else ''}"])
    return table(["what", "mesh", "unknowns", "operator", "cold", "another load", "target"], rows)


def predictions(data):
    """Ratios of what was predicted to what it took, and of forms that were asked for to what was chosen."""
    found = (data.get("bench_predictions") or {}).get("rows", [])
    body = lambda row: (row["element"], tuple(row["cells"]), row["poisson"], row["stretch"], row["jump"], row["moved"])  # noqa: E731
    chosen = {body(row): row for row in found if row["asked"] == "auto"}
    keys = (("predicted_s", "cold_s", 1.5), ("predicted_cached_s", "cached_s", 1.5), ("predicted_bytes", "peak_bytes", 1.2))
    ratios = {name: [row[name] / row[actual] for row in found] for name, actual, _ in keys}
    rows = []
    for row in found:
        special = [text for text, said in ((f"nu {sig(row['poisson'])}", row["poisson"] != 0.3), (f"{sig(row['stretch'])} times as long", row["stretch"] != 1),
                                           ("stiff ball", row["jump"] != 1), ("nodes moved", row["moved"])) if said]
        own = chosen.get(body(row))
        over = NONE if row["asked"] == "auto" or not own or own["operator"] == row["operator"] else f"{row['cold_s'] / own['cold_s']:.2f}, {row['cached_s'] / own['cached_s']:.2f}"
        rows.append([f"`{row['element']}` {' x '.join(str(c) for c in row['cells'] if c)}", ", ".join(special) or NONE, f"{row['unknowns']:,}", f"`{row['operator']}`",
                     *(f"{row[name] / row[actual]:.2f}" for name, actual, _ in keys), over])
    within = [f"{sum(1 / most <= ratio <= most for ratio in ratios[name])} of {len(found)}" for name, _, most in keys]
    return found and table(["body", "special", "unknowns", "operator", *(f"{what} ({count})" for what, count in zip(("cold", "another load", "bytes"), within)), "over the one chosen"], rows)


def roof(data):
    """What two threads of the machine do over what one does."""
    found = data["bench_solids"].get("roof")
    told = found and ", ".join(f"{row['ratio']:.2f} of {'reads of ' + str(row['read_mb']) + ' MB each' if row['read_mb'] else 'arithmetic'}" for row in found)
    return [f"Two threads of this machine do at most so many times what one does: {told}."] if found else []


def runs_of_shapes(data):
    runs = data["bench_solids"]["runs"]
    return [f"Ratios are medians of {runs} runs." if runs > 1 else "Ratios are of single runs."]


REASONS = (("first step is", "the first step is no static one"), ("FRICTION", "friction"), ("EQUATION", "equations between displacements"),
           ("SPRINGA", "springs"), ("in place of a spring", "contact softer than a twentieth of the body"),
           ("PLASTIC", "plasticity"), ("ADJUST", "nodes that are moved to the other surface (ADJUST)"), ("TRANSFORM", "turned axes of nodes"), ("CYCLIC", "cyclic symmetry"),
           ("a shell", "shells"), ("a beam", "beams"))


def bounds(data):
    """Guaranteed bounds over true errors."""
    rows = (data.get("bounds") or {}).get("rows", [])
    proved = [row for row in rows if row.get("bound")]
    if not proved:
        return None
    found = {kind: sorted(row["ratio"] for row in proved if row["ratio"] and row["element"] in of) for kind, of in
             (("linear", ("tri3", "quad4")), ("quadratic", ("tri6", "quad8")))}
    told = [[row["name"], f"`{row['element']}`", f"{row['d']:,}", sig(row["bound"], 3), sig(row["low"], 3) + " .. " + sig(row["high"], 3),
             f"{row['ratio']:.3f}" if row["ratio"] else NONE] for row in proved]
    without = list(dict.fromkeys(row["name"] for row in rows if not row.get("bound")))
    return table(["scene", "element", "unknowns", "bound", "true", "ratio"], told) + ["", "; ".join(
        f"{kind} elements: median {statistics.median(ratios):.3f}, {ratios[0]:.3f} .. {ratios[-1]:.3f}" for kind, ratios in found.items() if ratios) +
        f". False: {data['bounds']['false'] or 'none'}." + (f" Not proved: {', '.join(without)}." if without else "")]


FORMULATIONS = (("quad4", "standard"), ("quad4", "incompatible_modes"), ("quad4", "bbar"), ("quad8", "standard"))


def formulations(data):
    """What a formulation buys: Cook's membrane and a rubber tube."""
    cook = {(r["element"], r["formulation"], r["cells"]): f"{r['deflection']:.2f}" if r["cells"] < 10 else f"{r['deflection']:.3f}" for r in data["theory"]["cook"]}
    tubes = {(r["element"], r["formulation"]): percent(r["ratio"]) if r["ratio"] < 0.5 else f"{100 * r['ratio']:.1f} %" for r in data["theory"]["tubes"]}
    rows = [[f"{kind} `{way}`" if kind == "quad4" else kind, cook.get((kind, way, 4), NONE), cook.get((kind, way, 64), NONE), tubes.get((kind, way), NONE)]
            for kind, way in FORMULATIONS]
    return table(["", "4 cells", "64 cells", "rubber tube, of the exact displacement"], rows)


def elements(data):
    """What a formulation buys; the patch test and the order of every element."""
    rows = (data.get("theory") or {}).get("elements")
    if not rows:
        return None
    return [*formulations(data), "", *table(["element, model, formulation", "patch test, off by", "degree", "order of convergence"],
                                        [[f"`{r['name']}`", sig(r["patch"]), r["degree"], f"{r['order']:.4f}"] for r in rows])]


def peers(data):
    """The paper's body at certified 1e-6: the fastest other solver against ours."""
    if not data.get("peers"):
        return None
    rows = [[x["problem"].replace("body/", "NX = "), f"{x['d']:,}", x["fastest"] or "none", duration(x["seconds"]), duration(x["cold_seconds"]),
             sig(x["cold"]), duration(x["cached_seconds"]), sig(x["cached"])] for x in data["peers"]["body"]]
    return table(["paper's body", "d", "fastest other solver", "its time", "ours, cold", "ratio", "ours, cached", "ratio"], rows)


def means(data):
    """Shifted geometric means over all problems; what was not solved and certified counts as the limit."""
    if not data.get("peers"):
        return None
    asked = [key for key in data["peers"]["means"][0] if key != "solver"]
    rows = [[f"`{entry['solver']}`"] + [cell for key in asked for cell in (f"{entry[key]['solved']} of {entry[key]['of']}",
                                                                          duration(entry[key]["shift_10s"]), duration(entry[key]["shift_10ms"]))]
            for entry in data["peers"]["means"]]
    return table(["solver"] + [f"{key}: {what}" for key in asked for what in ("solved and certified", "mean, shift 10 s", "shift 10 ms")], rows)


def failures(data):
    """Why answers are missing at 1e-6: nothing is dropped."""
    rows = [[row["problem"], f"`{row['solver']}`", " ".join(row["why"].split()).replace("|", "/")] for row in data["peers"]["rows"] if row["tolerance"] == 1e-6 and not row["success"]]
    return table(["problem", "solver", "why there is no answer certified to 1e-6"], rows) if rows else []
