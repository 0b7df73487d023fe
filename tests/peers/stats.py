"""What is made of many runs: which of them succeeded, shifted geometric means, performance profiles."""
import math


def best(runs, tolerance, strict=False):
    """The fastest run whose answer is certified to the tolerance; None where there is none. strict: only runs that
    were asked for that much count."""
    good = [run for run in runs if run.get("certified") is not None and run["certified"] <= tolerance
            and not (strict and run["asked"] > tolerance)]
    return min(good, key=lambda run: run["seconds"], default=None)


def why_not(runs, tolerance):
    """One phrase on what kept the runs of one solver on one problem from the tolerance."""
    ends = [run["status"] for run in runs if run.get("certified") is None]
    reached = min((run["certified"] for run in runs if run.get("certified") is not None), default=None)
    words = [] if reached is None else [f"certified {reached:.1e} only"]
    return ", ".join(dict.fromkeys(words + ends)) or "not run"


def shifted_geometric_mean(seconds, shift):
    """exp(mean(log(t + s))) - s; H. D. Mittelmann's benchmarks take s = 10 s, a small s weighs the quick problems."""
    if not seconds:
        return math.nan
    return math.exp(math.fsum(math.log(t + shift) for t in seconds) / len(seconds)) - shift


def performance_profile(times):
    """Dolan and More, Math. Program. 91 (2002): times[solver][problem] in seconds, None for a failure. Gives by solver
    the points (ratio, share of the problems solved within ratio times the best time), from ratio 1 on. Problems that
    nobody solved count as failures of all."""
    problems = {problem for row in times.values() for problem in row}
    least = {}
    for problem in problems:
        solved = [row[problem] for row in times.values() if row.get(problem) is not None]
        if solved:
            least[problem] = min(solved)
    profile = {}
    for solver, row in times.items():
        ratios = sorted(row[p] / least[p] for p in row if row[p] is not None)
        points = [(1.0, sum(ratio <= 1.0 for ratio in ratios) / len(problems))]
        points += [(ratio, (k + 1) / len(problems)) for k, ratio in enumerate(ratios) if ratio > 1.0]
        profile[solver] = points
    return profile


def table(head, rows):
    """Text columns: the first to the left, others to the right."""
    cells = [[str(cell) for cell in row] for row in [head, *rows]]
    widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
    lines = ["  ".join(cell.ljust(width) if k == 0 else cell.rjust(width)
                       for k, (cell, width) in enumerate(zip(row, widths))).rstrip() for row in cells]
    return "\n".join([lines[0], "  ".join("-" * width for width in widths), *lines[1:]])


def number(x, digits=3):
    """Seconds or ratios as text; "-" for what is not there."""
    return "-" if x is None or math.isnan(x) else f"{x:.{digits}g}"
