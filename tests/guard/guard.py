"""Counts instructions of small problems under callgrind and compares them with those that are kept.

usage: guard.py BUILD_DIR [--keep | --into BENCH.json | --show]

Counted is what the program's own code executes in guard_measured (tests/guard/guard.c), and how often it calls a
library: BLAS, libc and the others choose their code by the processor, so that their own instructions would differ from
machine to machine. More than 5 % more than tests/data/guard.json fails; more than 5 % fewer asks to keep the new counts,
so that the next slip is seen. Another compiler makes other code: then nothing is compared.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
KEPT = ROOT / "tests" / "data" / "guard.json"
LIMIT = 0.05
# One thread, every symbol bound at the start.
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "LD_BIND_NOW": "1", "OPENBLAS_CORETYPE": "Haswell",
               "LC_ALL": "C"}


def objects_of(lines):
    """Yields (object, called object or None, count, calls) for each line of costs (Valgrind manual, callgrind format)."""
    names, here, called, calls = {}, None, None, 0

    def name(text):
        key, _, rest = text.partition(" ")
        if rest:
            names[key] = rest
        return names.get(key, key)

    for line in lines:
        line = line.rstrip("\n")
        if line.startswith("ob="):
            here = name(line[3:])
        elif line.startswith("cob="):
            called = name(line[4:])
        elif line.startswith("calls="):
            calls = int(line[6:].split()[0])
        elif line and line[0] in "+-*0123456789":
            costs = line.split()[1:]  # zeros at the end are left out
            yield here, (called or here) if calls else None, int(costs[0]) if costs else 0, calls
            called, calls = None, 0


def count(build, name, repeats=None):
    """Instructions of the program's own code, and calls from it into libraries."""
    program = build / "guard"
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "counts"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--toggle-collect=guard_measured",
                   "--quiet", str(program), name] + ([str(repeats)] if repeats else [])
        ran = subprocess.run(command, env={**os.environ, **ENVIRONMENT}, capture_output=True, text=True)
        if ran.returncode != 0:
            raise RuntimeError(f"{name}: {ran.stderr.strip()[-600:]}")
        with open(out, encoding="utf-8", errors="replace") as lines:
            own = calls = 0
            for here, called, instructions, times in objects_of(lines):
                if pathlib.Path(here).name != program.name:
                    continue
                if called is None:
                    own += instructions
                elif pathlib.Path(called).name != program.name:
                    calls += times
    return {"instructions": own, "library_calls": calls}


def names(build):
    listed = subprocess.run([str(build / "guard"), "--names"], capture_output=True, text=True, check=True).stdout
    return {line.split()[0]: int(line.split()[1]) for line in listed.splitlines()}


def compiler(build):
    return subprocess.run([str(build / "guard"), "--compiler"], capture_output=True, text=True, check=True).stdout.strip()


def ratio(now, before):
    return now / before if before else float("inf") if now else 1.0


def compare(name, now, before):
    """A line for the log; True where it is good."""
    ratios = {what: ratio(now[what], before[what]) for what in ("instructions", "library_calls")}
    text = ", ".join(f"{what} {before[what]} -> {now[what]} ({value:.3f})" for what, value in ratios.items())
    if max(ratios.values()) > 1 + LIMIT:
        print(f"# {text}: more than {LIMIT:.0%} slower\nnot ok guard.{name}")
    elif min(ratios.values()) < 1 - LIMIT:
        print(f"# {text}: better; keep it by `make guard KEEP=1`\nnot ok guard.{name}")
    else:
        print(f"ok guard.{name}: {text}")
        return True
    return False


def sees_a_tenth(build, repeats, now):
    """Work that is a tenth more must be seen."""
    more = count(build, "decode_request", repeats + repeats // 10)
    seen = ratio(more["instructions"], now["instructions"])
    good = 1 + LIMIT < seen < 1.12
    print(f"{'ok' if good else 'not ok'} guard.a_tenth_more_is_seen: {seen:.3f}")
    return good


def why_not(build):
    """Why nothing can be compared, or None."""
    try:
        subprocess.run(["valgrind", "--version"], capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "there is no valgrind"
    with open("/proc/cpuinfo", encoding="utf-8") as cpu:
        if " avx2 " not in cpu.read().replace("\n", " "):
            return "the processor has no AVX2: other code would run"
    return None


def main():
    build, mode = pathlib.Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else ""
    problem = why_not(build)
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {"counts": {}}
    if not problem and not mode and kept.get("compiler") != compiler(build):
        problem = f"counts are kept for gcc {kept.get('compiler')}, this is {compiler(build)}"
    if problem:
        print(f"skip guard: {problem}")
        return 0
    listed = names(build)
    counts = {name: count(build, name) for name in listed}
    if mode == "--into":
        path = pathlib.Path(sys.argv[3])
        bench = json.loads(path.read_text())
        bench["instructions"] = [{"name": name, **one} for name, one in counts.items()]
        path.write_text(json.dumps(bench, indent=1) + "\n")
    if mode == "--keep":
        KEPT.write_text(json.dumps({"compiler": compiler(build), "counts": counts}, indent=2) + "\n")
    if mode:
        for name, one in counts.items():
            print(f"{name:20} {one['instructions']:12} instructions {one['library_calls']:9} calls of libraries")
        return 0
    good = True
    for name, one in counts.items():
        if name not in kept["counts"]:
            print(f"not ok guard.{name}: nothing is kept; `make guard KEEP=1`")
            good = False
        else:
            good = compare(name, one, kept["counts"][name]) and good
    return 0 if sees_a_tenth(build, listed["decode_request"], counts["decode_request"]) and good else 1


if __name__ == "__main__":
    sys.exit(main())
