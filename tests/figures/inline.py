"""Measured numbers within the sentences of README.md and docs: <!-- n:NAME -->text<!-- /n -->, which Markdown does not show, is filled with what
VALUES gives for NAME."""
import re

import service_tables
import tables
from tables import sig

MARK = re.compile(r"<!-- n:([a-z0-9_.]+) -->(.*?)<!-- /n -->")


def scene(data, name, key):
    return next((one[key] for one in (data.get("gallery") or {"scenes": []})["scenes"] if one["name"] == name), None)


def of_scene(name, key, text):
    """A quantity of a scene of the gallery."""
    def value(data):
        got = scene(data, name, key)
        return None if got is None else text(got)
    return value


def touching(name):
    return lambda data: None if not data.get("gallery") else f"{scene(data, name, 'active')} of {scene(data, name, 'candidates')} nodes"


def of_bench(name, text):
    def value(data):
        row = next((row for row in (data.get("bench") or {"ratios": []})["ratios"] if row["name"] == name), None)
        return None if row is None else text(row["median"])
    return value


def of_page(key):
    return lambda data: f"{data['page'][key] / 1000:.0f} kB" if data.get("page") else None


def grids(asked, last):
    """Of the ladder for a whole error: the grid of the answer, or those tried before it."""
    def value(data):
        for row in (data.get("theory") or {}).get("ladders", []):
            if row["asked"] == asked:
                shown = [row["cells"]] if last else [cells for cells in row["tried"] if cells != row["cells"]]
                return " and ".join(f"{nx} x {ny}" for nx, ny in shown)
        return None
    return value


def orders(degree):
    def value(data):
        found = [row["order"] for row in (data.get("theory") or {}).get("elements", []) if row["degree"] == degree]
        return f"{min(found):.3f} to {max(found):.3f}" if found else None
    return value


def worst_patch(data):
    found = [row["patch"] for row in (data.get("theory") or {}).get("elements", [])]
    return sig(max(found), 1) if found else None


def linear_near(d):
    """The linear solve at the measured size nearest to d: "0.25 s at 105,336 dofs"."""
    def value(data):
        rows = (data.get("bench_size") or {}).get("sizes")
        if not rows:
            return None
        row = min(rows, key=lambda one: abs(one["d"] - d))
        return f"{sig(row['linear_s'])} s at {row['d']:,} dofs"
    return value


def of_soak(name, text):
    def value(data):
        row = service_tables.row_of(data, name)
        return None if row is None else text(row["figures"])
    return value


def mesh_error(problem):
    """Of a problem."""
    def value(data):
        row = next((row for row in (data.get("figures") or {"precision": []})["precision"] if row["name"] == problem), None)
        return row and tables.percent(row["mesh_error"])
    return value


def gradient_digits(data):
    counts = [tables.ratio(data, f"accuracy_accelerated_restart_{error}_iterations", 0) for error in ("1e-02", "1e-10")]
    return None if tables.NONE in counts else f"{counts[0]} iterations to 1e-2 and {counts[1]} to 1e-10"


def over_peers(key):
    """The fastest other solver over ours on the paper's body, from the least to the largest ratio."""
    def value(data):
        found = [row[key] for row in (data.get("peers") or {}).get("body", []) if row[key] is not None]
        return f"{sig(min(found))} to {sig(max(found))} times" if found else None
    return value


def solved(ours):
    """Problems that were solved and certified to 1e-6: by us, by the best other solver."""
    def value(data):
        means = {row["solver"]: row["1e-06"] for row in (data.get("peers") or {}).get("means", [])}
        others = [row["solved"] for name, row in means.items() if not name.startswith("uzawa")]
        if "uzawa" not in means or not others:
            return None
        return f"{means['uzawa']['solved']} of {means['uzawa']['of']}" if ours else str(max(others))
    return value


def claims(data):
    total = data.get("extremes")
    return total and f"{total['passed'] + total['failed']:,} claims {total['failed'] or 'none'}"


def of_quantities(kind, text):
    """Of the estimated intervals of generated scenes."""
    def value(data):
        row = next((row for row in (data.get("quantities") or {"told": []})["told"] if row["quantity"] == kind), None)
        return None if row is None else text(row)
    return value


def proved_half(data):
    """Half a guaranteed interval's width over the error of the mesh's value: medians of bodies on their own obstacle, on lines, on each other."""
    rows = [row["half"] for row in (data.get("quantities") or {"held": []})["held"] if row["of"]]
    return f"{min(rows):.1f} to {max(rows):.1f} times" if rows else None


def steps_of_auto(data):
    return None if tables.ratio(data, "accuracy_auto_1e-02_iterations") == tables.NONE else tables.ratio(data, "accuracy_auto_1e-02_iterations", 0)


VALUES = {
    "cylinder.touching": touching("cylinder"), "cylinder.pressure": of_scene("cylinder", "max_pressure", "{:.0f}".format),
    "cylinder.hertz_pressure": of_scene("cylinder", "hertz_pressure", "{:.0f}".format), "cylinder.half_width": of_scene("cylinder", "area", "{:.3f}".format),
    "cylinder.hertz_half_width": of_scene("cylinder", "hertz_half_width", "{:.3f}".format),
    "press_fit.pressure": of_scene("press_fit", "mean_pressure", "{:.1f}".format), "press_fit.lame": of_scene("press_fit", "lame_pressure", "{:.1f}".format),
    "press_fit.most": of_scene("press_fit", "max_pressure", "{:.1f}".format), "gear.unknowns": of_scene("gear", "d", "{:,}".format), "paper_body.touching": touching("paper_body"),
    "paper_body.reaction_sum": of_scene("paper_body", "reaction_sum", "{:.6f}".format),
    "page.list": of_page("list_bytes"), "page.job": of_page("job_bytes"),
    "ladder.5": grids(0.05, True), "ladder.2": grids(0.02, True), "ladder.2.before": grids(0.02, False),
    "candidates.kept": of_bench("candidates_cube_n24_kept", "{:,.0f}".format), "candidates.given": of_bench("candidates_cube_n24_given", "{:,.0f}".format),
    "candidates.ratio": of_bench("candidates_cube_n24", "{:.2f} times".format), "patch.worst": worst_patch,
    "order.1": orders(1), "order.2": orders(2), "linear.100000": linear_near(100000), "streams.kb": of_soak("2,000 event streams, 1,000 long polls", lambda f: f"{sig(f['kb_each'])} kB"),
    "digits.steps": steps_of_auto, "digits.gradient": gradient_digits, "mesh_error.30": mesh_error("paper_30"), "mesh_error.600": mesh_error("paper_600"),
    "cold.600": of_bench("cold_nx600_1e-08", "{:.2f}".format), "cached.600": of_bench("cached_nx600_1e-08", "{:.2f}".format),
    "cold.cube": of_bench("cold_hex8_d101277", "{:.2f}".format), "peers.cold": over_peers("cold"), "peers.cached": over_peers("cached"),
    "quantities.scenes": lambda data: str(data["quantities"]["scenes"]) if data.get("quantities") else None,
    "quantities.inside": of_quantities("all", lambda row: f"{row['inside']} of {row['of']} values"), "quantities.half": of_quantities("all", lambda row: f"{row['half']:.1f} times"),
    "quantities.middle": of_quantities("all", lambda row: f"{row['middle']:.2f}"), "quantities.middle.energy": of_quantities("strain_energy", lambda row: f"{row['middle']:.2f}"),
    "quantities.middle.force": of_quantities("contact.force", lambda row: f"{row['middle']:.2f}"),
    "quantities.without": of_quantities("all", lambda row: f"{100 * row['without'] / row['asked']:.0f} %"), "quantities.proved": proved_half,
    "peers.solved": solved(True), "peers.others": solved(False), "extremes.claims": claims,
}


def fill(text, data):
    """The text with its marks filled. Returns it and the names whose data is not there: those stay."""
    missing = []

    def one(found):
        value = VALUES[found[1]](data)
        if value is None:
            missing.append(f"n:{found[1]}")
            return found[0]
        return f"<!-- n:{found[1]} -->{value}<!-- /n -->"
    return MARK.sub(one, text), missing
