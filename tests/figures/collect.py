"""Turns what the measuring programs left in the build folder into the data files of docs/figures."""
import json
import math
import pathlib
import statistics

import stamp

KEPT_ROWS = 400  # of a history: more than can be drawn


def thin(rows, most=KEPT_ROWS):
    """Rows of a history evenly spread over the logarithm of the iteration; the first and the last stay."""
    if len(rows) <= most:
        return rows
    last = len(rows) - 1
    wanted = {round(math.expm1(math.log1p(last) * k / (most - 1))) for k in range(most)}
    return [rows[k] for k in sorted(wanted | {0, last})]


def stamped(rows, when):
    """Rows with a stamp: their own, or the one of the whole."""
    return [{**row, "stamp": row.get("stamp") or stamp.brief(when)} for row in rows]


def renewed(key, name, raw, old, when):
    """{key: rows}: a run of a part renews its own rows only, each of which keeps when and beside what it was measured; of two the newer
    counts. name: of the member that tells rows apart."""
    rows = {}
    for row in stamped((old or {}).get(key, []), (old or {}).get("machine", {})) + stamped(raw.get(key) or [], when):
        if row[name] not in rows or not older(row["stamp"], rows[row[name]]["stamp"]):
            rows[row[name]] = row
    return {key: list(rows.values())}


def older(one, other):
    """By stamps, whose times compare as text."""
    return one.get("measured", "") < other.get("measured", "")


def renewed_rows(key, name="name"):
    return lambda raw, old, when: renewed(key, name, raw, old, when)


def figures(raw, old, when):
    """Histories and sizes are measured whole, problems one by one."""
    for run in raw.get("history", []):
        run["rows"] = thin(run["rows"])
    parts = {part: stamped(raw[part], when) if raw.get(part) else stamped((old or {}).get(part, []), (old or {}).get("machine", {}))
             for part in ("history", "sizes")}
    return {**parts, **renewed("precision", "name", raw, old, when)}


def bench_size(raw, old, when):
    rows = renewed("sizes", "d", raw, old, when)["sizes"]
    return {"sizes": sorted(rows, key=lambda row: row["d"])}


def extremes(raw):
    """By family, as the program's own last table."""
    families = {}
    for row in raw["rows"]:
        f = families.setdefault(row["family"], {"family": row["family"], "rows": 0, "converged": 0, "other": 0, "short": 0, "refused": 0,
                                                "failed": 0, "least_ratio": None})
        refused, converged = row["outcome"].startswith("error "), row["outcome"] == "converged"
        f["rows"] += 1
        f["converged"] += converged
        f["refused"] += refused
        f["other"] += not converged and not refused
        f["short"] += row["verdict"] == "short"
        f["failed"] += row["verdict"] in ("WRONG", "MISSED")
        if row["ratio"] is not None and converged:
            f["least_ratio"] = row["ratio"] if f["least_ratio"] is None else min(f["least_ratio"], row["ratio"])
    return {"families": list(families.values()), "generated": raw["generated"], "passed": raw["passed"], "failed": raw["failed"]}


def peers(raw):
    """All runs, the best of each solver by problem and tolerance, and what follows from them. nx: of the paper's body."""
    rows = []
    for row in raw["results"]:
        family, _, size = row["problem"].partition("/")
        rows.append({**row, **({"nx": int(size)} if family == "body" else {})})
    return {"time_limit_s": raw["time_limit_s"], "packages": raw["packages"], "problems": raw.get("problems", []), "rows": rows,
            "runs": raw["runs"], "means": raw["means"], "body": raw["body"], "profiles": raw["profiles"]}


def trade(raw, old, when):
    return {**renewed("rows", "name", raw, old, when), **renewed("forces", "name", raw, old, when)}


def solids(raw):
    """By element: what was told of errors over what they are."""
    rows = []
    for element in dict.fromkeys(row["element"] for row in raw["rows"]):
        ratios = sorted(row["told"] / row["true"] for row in raw["rows"] if row["element"] == element)
        rows.append({"element": element, "meshes": len(ratios), "median": statistics.median(ratios), "least": ratios[0], "largest": ratios[-1]})
    return {"scenes": raw["scenes"], "rows": rows}


def quantities(raw):
    """Of what was told of values on coarse meshes, and proved: the counts."""
    return {"scenes": raw["scenes"], "told": raw["told"], "held": raw["held"]}


def thresholds(raw):
    """By kind of body: the load up to which small deformation is chosen over that up to which it suffices."""
    rows = []
    for body in dict.fromkeys(row["body"] for row in raw["rows"]):
        of = [row for row in raw["rows"] if row["body"] == body]
        ratios = [row["ratio"] for row in of if "ratio" in row]
        rows.append({"body": body.replace("_", " "), "bodies": len(of), "compared": len(ratios), "least": min(ratios, default=None), "largest": max(ratios, default=None)})
    return {"rows": rows}


def decks(raw):
    """What was compared; of the others that their reasons are."""
    keys = ("problem", "ties", "unknowns", "apart", "apart_stiff", "calculix_s", "ours_s")
    return {"decks": raw["decks"], "rows": [{key: row[key] for key in keys} for row in raw["rows"]], "unsaid": raw["unsaid"]}


def alone(make):
    return lambda raw, old, when: make(raw)


KINDS = {"figures": figures, "bench": renewed_rows("ratios"), "bench-size": bench_size, "bench-solids": alone(dict), "bench-predictions": alone(dict), "extremes": alone(extremes),
         "theory": alone(dict), "soak": renewed_rows("rows"), "trade": trade, "solids": alone(solids), "quantities": alone(quantities), "thresholds": alone(thresholds), "bounds": alone(dict), "decks": alone(decks), "peers-space": renewed_rows("rows"), "large": alone(dict), "peers-large": alone(dict), "large-solids": alone(dict), "peers": alone(peers), "gallery": alone(dict), "page": alone(dict)}


def dump(value):
    """JSON with one line for each run or row, so that a change of one number is a change of one line."""
    def lines(value, depth):
        if isinstance(value, dict) and depth < 1 and value:
            inner = ",\n".join(f"{json.dumps(k)}: {lines(v, depth + 1)}" for k, v in value.items())
            return "{\n" + inner + "\n}"
        if isinstance(value, list) and value and isinstance(value[0], dict):
            return "[\n" + ",\n".join(lines(v, depth + 1) for v in value) + "\n]"
        if isinstance(value, dict) and any(isinstance(v, list) and v and isinstance(v[0], dict) for v in value.values()):
            return "{" + ", ".join(f"{json.dumps(k)}: {lines(v, depth + 1)}" for k, v in value.items()) + "}"
        return json.dumps(value, ensure_ascii=False)
    return lines(value, 0) + "\n"


def stamp_of(raw, source):
    """What measure.py wrote; of data without it only the file's time is known."""
    return raw.pop("stamp", None) or {**stamp.machine(), "measured": stamp.at(source.stat().st_mtime), "commit": "unknown", "load": None}


def renew(source, target, kind, by_rows):
    """True where the data file is another afterwards. by_rows: its rows have stamps of their own."""
    try:
        raw = json.loads(source.read_text())
    except ValueError:
        print(f"{source}: not whole, left out")
        return False
    before = target.read_text() if target.exists() else None
    old, when = before and json.loads(before), stamp_of(raw, source)
    whole = raw.pop("whole", False)  # then rows that are not there any more go
    if old and not by_rows and older(when, old["machine"]):
        print(f"{source}: older than {target.name}, left out")
        return False
    text = dump({"machine": when, **kind(raw, None if whole else old, when)})
    if text == before:
        return False
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text)
    return True


def collect(build, folder):
    """Renews the data of every program that has run since. Returns the names renewed."""
    sources = {name: pathlib.Path(build) / f"{name}.json" for name in KINDS}
    return [name for name, kind in KINDS.items() if sources[name].exists() and
            renew(sources[name], folder / f"{name.replace('-', '_')}.json", kind, name == "soak")]
