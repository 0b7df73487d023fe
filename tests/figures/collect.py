"""Turns what the measuring programs left in the build folder into the data files of docs/figures."""
import datetime
import json
import math
import os
import pathlib
import platform
import subprocess

KEPT_ROWS = 400  # of a history: more than can be drawn


def output_of(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.machine()


def memory_bytes():
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def package_versions():
    names = ["gcc", "libsuitesparse-dev", "libopenblas0-pthread", "libc6"]
    found = {}
    for name in names:
        version = output_of("dpkg-query", "-W", "-f=${Version}", name)
        if version:
            found[name] = version
    return found


def machine(root):
    """Where and of what: written beside every set of data. The commit is that of the checkout, marked where files differ."""
    changed = output_of("git", "-C", str(root), "status", "--porcelain", "--untracked-files=no", "--", "solver", "tests", "Makefile")
    commit = output_of("git", "-C", str(root), "rev-parse", "--short=12", "HEAD") or "unknown"
    system = next((line.split("=", 1)[1].strip('"') for line in pathlib.Path("/etc/os-release").read_text().splitlines()
                   if line.startswith("PRETTY_NAME=")), platform.system())
    return {"processor": processor(), "cores": os.cpu_count(), "memory_bytes": memory_bytes(), "system": system,
            "kernel": platform.release(), "compiler": output_of("gcc", "-dumpfullversion"), "packages": package_versions(),
            "commit": commit + ("+" if changed else ""), "load": round(os.getloadavg()[1], 2),
            "measured": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC")}


def thin(rows, most=KEPT_ROWS):
    """Rows of a history evenly spread over the logarithm of the iteration; the first and the last stay."""
    if len(rows) <= most:
        return rows
    last = len(rows) - 1
    wanted = {round(math.expm1(math.log1p(last) * k / (most - 1))) for k in range(most)}
    return [rows[k] for k in sorted(wanted | {0, last})]


def figures(raw, old):
    """Parts that were measured take the place of what was there, problems one by one."""
    for run in raw.get("history", []):
        run["rows"] = thin(run["rows"])
    problems = {problem["name"]: problem for problem in (old or {}).get("precision", [])}
    problems.update({problem["name"]: problem for problem in raw.get("precision", [])})
    parts = {part: raw.get(part) or (old or {}).get(part, []) for part in ("history", "sizes")}
    return {**parts, "precision": list(problems.values())}


def renewed_rows(key):
    """A filtered run renews its own rows only."""
    def merge(raw, old):
        rows = {row["name"]: row for row in (old or {}).get(key, [])}
        rows.update({row["name"]: row for row in raw[key]})
        return {key: list(rows.values())}
    return merge


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
    return {"time_limit_s": raw["time_limit_s"], "packages": raw["machine"].get("packages", {}), "rows": rows, "runs": raw["runs"],
            "means": raw["means"], "body": raw["body"], "profiles": raw["profiles"]}


def alone(make):
    return lambda raw, old: make(raw)


KINDS = {"figures": figures, "bench": renewed_rows("ratios"), "bench-size": alone(dict), "extremes": alone(extremes),
         "theory": alone(dict), "soak": renewed_rows("rows"), "peers": alone(peers)}


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


def collect(build, folder, root):
    """Renews the data of every program that has run since. Returns the names renewed."""
    renewed = []
    for name, kind in KINDS.items():
        source, target = pathlib.Path(build) / f"{name}.json", folder / f"{name.replace('-', '_')}.json"
        if not source.exists() or (target.exists() and target.stat().st_mtime >= source.stat().st_mtime):
            continue
        try:
            raw = json.loads(source.read_text())
        except ValueError:
            print(f"{source}: not whole, left out")
            continue
        old = json.loads(target.read_text()) if target.exists() else None
        data = kind(raw, old)
        folder.mkdir(parents=True, exist_ok=True)
        target.write_text(dump({"machine": machine(root), **data}))
        renewed.append(name)
    return renewed
