"""Makes docs/numbers.md, the figures and CSV files beside it, and the measured numbers that other pages cite, from the data in docs/figures.

usage: numbers_page.py collect BUILD   renew the data from what BUILD/*.json holds, then write everything
       numbers_page.py write           write everything from the data that is there
       numbers_page.py check           exit status 1, naming the files, where what is there is not what would be written
NUMBERS_ROOT names another checkout than this file's own.
"""
import csv
import io
import json
import os
import pathlib
import sys
import textwrap

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import collect  # noqa: E402  the path is set above
import draw  # noqa: E402
import inline  # noqa: E402
import promises  # noqa: E402
import service_tables  # noqa: E402
import stamp  # noqa: E402
import tables  # noqa: E402

ROOT = pathlib.Path(os.environ.get("NUMBERS_ROOT") or pathlib.Path(__file__).resolve().parent.parent.parent)
WIDTH = 119
COMMANDS = {"figures": "make figures", "bench": "make bench", "bench_size": "make bench-size", "bench_solids": "make bench-solids", "bench_predictions": "make bench-predictions", "extremes": "make extremes", "solids": "make extremes FILTER=solids", "bounds": "make extremes FILTER=bounds", "quantities": "make extremes FILTER=quantities", "thresholds": "make extremes FILTER=thresholds", "trade": "make trade",
            "theory": "make theory", "large": "make large", "soak": "make soak", "peers": "make peers", "decks": "make peers-decks", "peers_space": "make peers-space", "peers_large": "make peers-large", "large_solids": "make peers-large-solids", "gallery": "make gallery", "page": "make figures (the page)"}
ROWS = {"figures": "precision", "bench": "ratios", "bench_size": "sizes", "soak": "rows", "peers": "problems", "trade": "rows", "peers_space": "rows"}  # what is measured by parts


TIMED = ("figures", "bench", "bench_size", "bench_solids", "bench_predictions", "soak", "peers", "decks", "peers_space", "large", "trade")  # what other programs on the machine can change


def timed(lines, data, name, key=None, shown=("",)):
    """A table of times, with a note where it was measured beside other work."""
    return lines and lines + tables.beside(data, name, key, shown)


def load(folder):
    return {path.stem: json.loads(path.read_text()) for path in sorted(folder.glob("*.json"))}


def csv_text(rows, columns):
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([["" if row.get(c) is None else row[c] for c in columns] for row in rows])
    return out.getvalue()


TIMES = ["runs", "cpu_s", "cpu_min_s", "cpu_max_s", "wall_s", "wall_min_s", "wall_max_s"]


def csv_files(data):
    """The numbers behind each figure."""
    measured = data["figures"]
    history = [dict(zip(("iteration", "dual_objective", "residual"), row), nx=run["nx"], method=run["method"], minimum=run["minimum"])
               for run in measured["history"] for row in run["rows"]]
    sizes = [{**run, "nx": s["nx"], "d": s["d"], "m": s["m"], "lambda_1": s["lambda_1"]} for s in measured["sizes"] for run in s["ways"]]
    precision = [{**run, "problem": p["name"], "d": p["d"], "m": p["m"]} for p in measured["precision"] for run in p["runs"]]
    peers = (data.get("peers") or {}).get("runs", [])
    more = {"peers.csv": csv_text(peers, list(peers[0]))} if peers else {}
    return {**more, "history.csv": csv_text(history, ["nx", "method", "iteration", "dual_objective", "minimum", "residual"]),
            "sizes.csv": csv_text(sizes, ["nx", "d", "m", "name", "rule", "outcome", "lambda_1", "alpha", "iterations", "restarts", "residual",
                                          "certified"] + TIMES),
            "precision.csv": csv_text(precision, ["problem", "d", "m", "method", "operator", "operator_used", "level", "start", "outcome",
                                                  "requested", "certified", "energy_error", "reaction_error", "mismatches", "iterations",
                                                  "back_substitutions", "cycles"] + TIMES)}


def figure_files(data):
    measured, peers = data["figures"], (data.get("peers") or {}).get("rows", [])
    files = {"history.svg": draw.history(measured["history"]), "sizes.svg": draw.sizes(measured["sizes"], peers),
             "iterations.svg": draw.iterations(measured["sizes"])}
    if "peers" in data:
        files["peers.svg"] = draw.profiles(data["peers"]["profiles"])
    for problem in measured["precision"]:
        if len({(run["method"], run["operator"]) for run in problem["runs"]}) > 1:
            files[f"precision_{problem['name']}.svg"] = draw.precision(problem)
    return files


def machine_lines(data):
    """The machines with their versions, and a line for each command; where parts of it were measured at different times, from the first to
    the last."""
    lines, machines = [], {}
    for name, command in COMMANDS.items():
        if name not in data:
            continue
        m, found = data[name]["machine"], tables.stamps(data, name, ROWS.get(name))
        text = (f"{m['processor']}, {m['cores']} cores, {m['memory_bytes'] / 2**30:.0f} GiB; {m['system']}; " +
                ", ".join([f"gcc {m['compiler']}"] + [f"{k} {v}" for k, v in m["packages"].items() if k != "gcc"]))
        machines.setdefault(text, []).append(f"`{command}`")
        said = [tables.span(one.get("measured") for one in found) + (", from an earlier README" if any(one.get("origin") for one in found) else ""),
                "commit " + ", ".join(dict.fromkeys(f"`{one.get('commit', 'unknown')}`" for one in found)),
                f"load {tables.span((one.get('load') for one in found), tables.sig)}",
                f"processors of others {tables.span((one.get('others') for one in found), tables.sig)}"]
        if name in TIMED:
            said.append("beside other work" if any(stamp.beside_other_work(one) for one in found) else "on a quiet machine")
        lines.append(f"- `{command}`: {', '.join(said)}")
    told = [f"Machine{'' if len(machines) == 1 else ' of ' + ', '.join(names)}: {text}." for text, names in machines.items()]
    return [*prose(*told), *lines]


def problem_lines(problem, files):
    name = f"precision_{problem['name']}.svg"
    mesh = (f"The error of the mesh is {tables.percent(problem['mesh_error'])}, {problem['mesh_how']}: below that line more digits describe "
            f"the mesh, not the body." if problem["mesh_error"] else "It has no mesh, so there is no line.")
    lines = [f"### {problem['title'][0].upper()}{problem['title'][1:]}", "",
             f"d = {problem['d']:,}, m = {problem['m']:,}, {problem['active']:,} rows touch, the least pressed of them with "
             f"{tables.sig(problem['reference_margin'], 1)} of the largest reaction. {mesh} The last correction of the reference was "
             f"{tables.sig(problem['reference_change'], 1)} of its norm. Runs: {tables.ends(problem)} (limit {tables.sig(problem['limit_s'])} s). "
             f"Errors above their certified bound: {len(tables.false_claims(problem)) or 'none'}.", ""]
    if name in files:
        lines += [f"![work against precision](figures/{name})", ""]
    lines += ["`auto`:", ""] + tables.level_rows(problem) + [""]
    if name in files:
        lines += tables.cheapest(problem) + [""]
    return lines


INTRODUCTION = f"""Everything here is written by `make figures` from the data in `docs/figures`; nothing is typed by hand, and a test fails where a number is not
that of its data file. `make numbers` measures all of it again.

Times are medians of several runs in one thread after a warm-up, of the processor's clock for that thread: on a quiet machine they are those of the wall, which stand beside
them in the CSV files with minima and maxima. "load" is that of the minute before (older data: of the measurement itself too), "processors of others" how many other programs
kept busy meanwhile; where that is above {stamp.QUIET_OTHERS}, or unknown with a load above {stamp.QUIET_LOAD:.0f}, the numbers count as measured beside other work, and say so.

*Cold* is a solve with nothing in the cache, *cached* one whose factor is there; d is the number of unknowns, m of contact rows. The paper's body is the plate of [the paper](theory.md#the-paper)."""

RESIDUAL = """The paper's body and stopping rule, with the step 1/λ_max(N K⁻¹ N'). The residual is the paper's: of r with the displacement of that iteration, which in the
accelerated methods belongs to the extrapolated ρ: e1 = N'(ρ − r) is most of it, and vanishes for an iteration where a restart sets ρ = r."""

ITERATIONS = """Uzawa and the accelerated methods take the step 1/λ_max(N K⁻¹ N') unless it says λ₁(K), the step of the paper. The paper's rule stops when ‖ρ − r‖ ≤ 1e-6 N: a shorter
step makes that small sooner, so λ₁(K) ends with a larger error, as the last columns show; the second group of rows asks of all what λ₁(K) had then. Certified errors are
looked at in growing intervals, so those counts come in steps. `accelerated_restart` is Algorithm 2 as published, with its counts. `conjugate` applies D once in an iteration
as well; its ‖ρ − r‖ is that of a plain step from the r it has, and for each bound it applies D once more."""

LEVELS = "What each accuracy level costs with `auto`, and the energy-norm error that the answer then has."

PRECISION = """Each line is a method (colour) on a form of the operator (line and mark); its points are the accuracies asked for, loosest first: `quick`, `balanced` (scenes),
1e-4, 1e-6, `precise`, 1e-10, `exact`. What is drawn is the *achieved* error against a reference of some 30 digits: the touching rows are taken as equations, the rest is
solved by iterative refinement with the residual in `__float128`, and the optimality conditions are checked in `__float128` (`tests/figures/reference.h`). Three measures: the
energy norm; the largest error of a reaction over the largest reaction; rows wrongly in or out of contact. Work is seconds, cold and with the factor cached, from the scene
(or the matrices, where there is no scene) to the certified answer with everything that the summary says; and passes over the factor, one forward and one backward being one
back-substitution (those along the paths of a few dofs and those with the factor of the free dofs count as whole ones), for `matrix_free` cycles of multigrid. A cross is a
run that was stopped by the limit on its time, at the error that it had reached; tighter levels of such a line are not run. `balanced` stands hollow beside its line, as it
pays for the estimate of the mesh's error too."""

LINEAR = """Ratios within one run. The reference is CHOLMOD's own analyse + factorise + solve of the same K with the better of AMD and METIS and one thread, in the same
process and with the same huge-page allocator; both keep the memory that they have touched. A certified contact solve costs less than CHOLMOD's linear solve where ordering
and symbolic analysis on the graph of nodes, and substitutions in strips, save more than the contact costs."""

DIGITS = """The paper's body at 300 x 100 elements with its factor cached: time in units of one `cholmod_solve`, and iterations (`make bench FILTER=accuracy`)."""

OTHERS = """The rows `service_` are jobs of a new daemon at its default settings, from the request to the reply that tells of the stored answer: ten on each of 20 bodies of
600 to 619 x 200 elements, each with a load of its own, and CHOLMOD's linear solve of the same K between two bodies (`make bench FILTER=service`)."""

GROWTH = """The paper's body, medians of 3 (`make bench-size`); the linear solve has the better of AMD and METIS."""

EXTREMES = """Problems at the extremes, in six ways each (default, `exact`, cached, `factored`, `active_set`, `matrix_free`); every claim is held against a reference in `__float128`
(`make extremes`). "Other" are named outcomes (`precision_limit`, `iteration_limit`, `infeasible`), "short" those of them where doubles could have held the answer; the last
column is the least ratio of bound to true error among the converged."""

THEORY = """Scenes against theory (`make theory`), errors in %, meshes side by side. The half width of a contact is taken twice: from the second moment of the reactions, and
from the reported area, which on these meshes (a node at the edge of the contact) is half a cell too large."""

ELEMENTS = """What a formulation buys: Cook's membrane, tip displacement (converged 23.96), and a rubber tube at Poisson's ratio 0.4999; then the patch test and the order of
convergence of every element. The stiffness of CalculiX's tetrahedra is reproduced to rounding."""

TRADE = """Unknowns of the last mesh and seconds of the whole job, all its meshes and proofs included, until the whole error is small enough (`make trade`): refined where it is
(`refine`: `auto`) and everywhere, each side halved again and again, with what a target takes interpolated between two meshes. `~`: extrapolated by the order of the last two;
nothing: it was not reached in the time that each job had, at most two minutes. Elements are quadrilaterals with straight sides, of which a guaranteed refinement makes triangles. The
order is that of the error in unknowns: 0.5 and 1 are the best that linear and quadratic elements can do in the plane. Bodies that press on each other along curves have no guarantee. Times are of a machine on
which others worked; unknowns are what counts."""

FORCES = """`{"quantity": "contact.force", "relative": 0.02}` on a coarse mesh with `refine`: `auto` (`make trade FILTER=force`): the unknowns of the first mesh and of the last, the force
and its interval by estimate; the true force is that of a mesh many times finer. By hand: the least unknowns of many meshes of `quad8` and `tri6`, graded towards the
contact, whose own force is within 2 % of the true one, and stays so where the mesh is made finer, as only somebody can tell who knows it; and of the same meshes the least unknowns that are told to be within it, by the same
estimate."""

DECKS = """Decks with contact or ties that CalculiX is tested by (Debian's `calculix-ccx-test`, `make peers-decks`), as `POST /v1/decks` makes scenes of them: how far apart the
displacements are, over the largest; the same with CalculiX's contact made stiff, as its springs between surfaces may give way by per cents; seconds of processor of the whole, of
CalculiX from deck to answer, of the daemon from request to answer."""
SPACE = """A cube of cells in contact with a plane below, clamped on one side, pulled on the opposite one (`make peers-space`): seconds of processor of the daemon from request to
answer, certified to 1e-6, of a body that it has not seen and of another load on it, over those of PETSc's multigrid GAMG at its defaults, setup and solve to 1e-8 of the same K, with or
without the rigid motions, whichever takes less. Nodes within `hex8` and `tet4` are moved at random, and their meshes come as uploaded files. Ratios are of runs one after the
other: medians, with the least and the largest where there were several."""
PEERS_LARGE = """Scenes of large deformation by CalculiX, by GetFEM and by the daemon, on the same meshes of `quad8` (`make peers-large`): the force through the contact (of the cantilever, how far
its end has gone), how many steps it takes (of the daemon, contact problems), and seconds of processor: of the daemon from request to answer, of the others of the solve alone or from deck to answer.
Off: no answer in half a minute, or one more than a fiftieth off. The ratio is that of the quickest of the others that has an answer."""
LARGE_SOLIDS = """Two bodies under large deformation (`make peers-large-solids`): a block is pressed on a longer one and moved along it by about its own length, in space and in the plane,
another one is pressed on a dome and moved along that, and a quarter of a ring on one of a larger ring, the whole way at once. How far the force between them, as a vector, the area in contact and, where no edge makes it infinite, the largest pressure are off those of the
finest mesh of `hex20`, or `quad8`; and how far the force is off that of GetFEM, with cells of 27 nodes, or 9, on its coarsest, contact by integrals along rays, the way in parts; of solids also how far that of CalculiX is off ours
of the same mesh and of the law that both have (`neo_hooke_isochoric`), by the stiffness of its contact, in E for the length of a side."""
CYCLES = """Iterations of conjugate gradients to 1e-8 on boxes of equal `hex8`, clamped on one side, with the multigrid that they have without a matrix (`make bench-solids`), by cells
along each side; aspect: how many times as long as its other sides a cell is along one axis. Grown: the most over the fewest of a row."""

SHAPES = """The same cube as above, one thread, seconds of processor of the daemon from request to answer, certified to 1e-6 (`make bench-solids`): ratios to the plain cube of the same
mesh, of a body that is not known and of another load on one that is, of runs one after the other. The stiff ball has a twelfth of the cube's volume and no plane of its
mesh at its surface. Of load cases: all of them in one run, of a body that is not known."""

PREDICTIONS = """Cubes of solid elements as above and the paper's body (`make bench-predictions`), one thread: what `cost` told of them before they were solved, over what they took, certified to
1e-6: seconds of processor without assembly, of a body that is not known and of another load on it; bytes, over the largest resident set less what was there before. In brackets
how many rows are within 1.5 and 1.2. Of rows with a form that was asked for: what it took over what `auto` did."""

BOUNDS = """Scenes of [theory](#against-theory), of the gallery and of the pages on a coarse mesh (`make extremes FILTER=bounds`): the guaranteed bound on the whole error and the
true error, in the energy norm itself, by potential energies, in which what its pressures do on the gaps of the answer counts, too: that of the body is known from a mesh refined to a tenth of the error. Where an answer stands in a round obstacle
between its nodes its energy tells less: there is no ratio where the square of the true error is left open by more than a tenth to either side."""

LARGE = """Scenes of [large deformation](theory.md#large-deformation) at the daemon's defaults (`make large`) against closed forms (A, J), the elastica of a beam that stretches
(B), and what finer meshes converge to: contact problems, of them the most in one part of the load, and the time of the processor over that of one solve of small deformation on the same mesh, with nothing in the cache, the least of
seven each. Below, the block over the roller by elements through its height: by how much its force is off."""

THRESHOLDS = """Of bodies whose load grows (`make extremes FILTER=thresholds`), of every law: the load up to which `auto` has the answer of small deformation, under the
linear law without the warning `large_deformation`, over that up to which this is off by less than 5 % of the answer of large deformation, in displacements, forces and energy."""

SOLIDS = """Of generated solids (`make extremes FILTER=solids`: boxes, wedges, inner nodes moved at random, a re-entrant edge; half of them on planes and balls), two or three
elements deep, the estimated error of the mesh over the true one, by the potential energy of a mesh of `hex20` that is many times finer."""

SERVICE = "What was done to the service (`make soak`), and what came of it; below, the figures as they are."


def wrapped(text):
    """The text with its lines of prose broken; rows of tables, pictures and headings stay."""
    return "\n".join(line if line[:1] in "|#!" else textwrap.fill(line, WIDTH, subsequent_indent="  " if line.startswith("- ") else "", break_long_words=False, break_on_hyphens=False) for line in text.split("\n"))


def prose(*texts):
    """Paragraphs as lines, each with an empty one behind it."""
    return [line for text in texts for part in text.split("\n\n") for line in (" ".join(part.split()), "")]


def page(data, files):
    measured = data["figures"]
    lines = ["# Numbers", "", *prose(INTRODUCTION), *machine_lines(data), ""]

    def add(title, table, *before):
        if table:
            lines.extend([f"## {title}", "", *prose(*before), *table, ""])

    peers = " Other solvers are drawn at the tolerance 1e-6, with what they were certified for." if "peers" in data else ""
    add("What was promised", promises.lines(data))
    add("Convergence: the paper's Figure 2", ["![convergence](figures/history.svg)", "", "[CSV](figures/history.csv)"], RESIDUAL)
    add("Time and residual against size: the paper's Figure 3",
        ["![sizes](figures/sizes.svg)", "", *tables.size_rows(data), *tables.beside(data, "figures", "sizes"), "", "[CSV](figures/sizes.csv)"],
        f"From the assembled matrices; time, and total residual of the answer. A cross or `>` is a run that was stopped after "
        f"{tables.sig(measured['sizes'][0]['limit_s'])} s of the processor.{peers}")
    add("Iterations", ["![iterations](figures/iterations.svg)", "", *tables.iterations(data)], ITERATIONS)
    add("Accuracy levels", timed(tables.levels(data), data, "figures", "precision"), LEVELS)
    add("Work against precision", sum((problem_lines(p, files) for p in measured["precision"]), []), PRECISION, "[CSV of all runs](figures/precision.csv)")
    add("Against one linear solve", timed(tables.ratios(data), data, "bench", "ratios", tables.IN_RATIOS), LINEAR)
    add("Single measurements", tables.sentences(data))
    add("What digits cost", timed(tables.digits(data), data, "bench", "ratios", tables.IN_DIGITS), DIGITS)
    add("Other ratios", tables.others(data), OTHERS)
    add("Cost against size", timed(tables.growth(data), data, "bench_size", "sizes"), GROWTH)
    if "peers" in data:
        limit = tables.sig(data["peers"]["time_limit_s"])
        packages = ", ".join(f"{name} {version}" for name, version in data["peers"]["packages"].items())
        add("Other solvers", [*timed(tables.peers(data), data, "peers", "problems"), "", "![profiles](figures/peers.svg)", "", *tables.means(data), "",
                              *tables.failures(data), "", "[CSV of all runs](figures/peers.csv)"],
            f"On the same matrices, each asked until the same external certificate holds, processor seconds of one thread, {limit} s for each run (`make peers`). "
            f"The paper's body is certified to 1e-6. Means are shifted geometric ones over all problems, where a failure costs the limit. {packages}.")
    add("Decks of CalculiX", timed(tables.decks(data), data, "decks"), DECKS)
    add("Solids over one multigrid solve", timed(tables.space(data), data, "peers_space", "rows"), SPACE)
    add("Large deformation against other programs", tables.peers_large(data), PEERS_LARGE)
    add("Bodies that slide under large deformation", tables.large_solids(data), LARGE_SOLIDS)
    add("Solids without a factor", timed([*tables.cycles(data), "", *tables.shapes(data), "", *tables.runs_of_shapes(data), *tables.roof(data)] if "bench_solids" in data else None, data, "bench_solids"), CYCLES, SHAPES)
    add("Predicted and actual", timed(tables.predictions(data), data, "bench_predictions"), PREDICTIONS)
    add("What the whole error costs", timed(tables.trade(data), data, "trade", "rows"), TRADE)
    add("A contact force within 2 %", tables.forces(data), FORCES)
    add("Claims at the extremes", tables.extremes(data), EXTREMES)
    add("Guaranteed bounds over true errors", tables.bounds(data), BOUNDS)
    add("Estimates in space", tables.solids(data), SOLIDS)
    add("Against theory", tables.theory(data), THEORY)
    add("Large deformation", timed(tables.large(data), data, "large"), LARGE)
    add("Where small deformation suffices", tables.thresholds(data), THRESHOLDS)
    add("Elements", tables.elements(data), ELEMENTS)
    add("The service", service_tables.soak(data), SERVICE)
    return wrapped("\n".join(lines).rstrip()) + "\n"


def pages(root):
    """The pages that may cite measured numbers."""
    return [root / "README.md", *sorted(path for path in (root / "docs").glob("*.md") if path.name != "numbers.md")]


def outputs(root):
    """{path: text} of all that is made, and the marks without data."""
    folder = root / "docs" / "figures"
    data = load(folder)
    made, missing = {}, []
    if "figures" in data:
        files = {**figure_files(data), **csv_files(data)}
        made = {folder / name: text for name, text in files.items()}
        made[root / "docs" / "numbers.md"] = page(data, files)
    for path in pages(root):
        made[path], unfilled = inline.fill(path.read_text(), data)
        missing += [f"{path.relative_to(root)}: {name}" for name in unfilled]
    return made, missing


def stale(root):
    """Files that differ from what the data gives, and files that nothing makes; the marks without data."""
    made, missing = outputs(root)
    wrong = [str(path.relative_to(root)) for path, text in made.items() if not path.exists() or path.read_text() != text]
    extra = [path for kind in ("*.svg", "*.csv") for path in (root / "docs" / "figures").glob(kind) if path not in made]
    return wrong + [str(path.relative_to(root)) for path in extra], missing


def write(root):
    """Returns the marks without data."""
    made, missing = outputs(root)
    for path, text in made.items():
        path.write_text(text)
    return missing


def tell(root, missing):
    for name in missing:
        print(f"{name}: no data yet, left as it is")
    for path in stale(root)[0]:
        print(f"{path}: nothing makes it")


def main():
    command = sys.argv[1] if len(sys.argv) > 1 else ""
    if command == "collect" and len(sys.argv) == 3:
        renewed = collect.collect(sys.argv[2], ROOT / "docs" / "figures")
        print("data renewed:", ", ".join(renewed) or "none")
        tell(ROOT, write(ROOT))
    elif command == "write":
        tell(ROOT, write(ROOT))
    elif command == "check":
        wrong, _ = stale(ROOT)
        for path in wrong:
            print(f"{path}: not what its data gives; run make figures")
        sys.exit(bool(wrong))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
