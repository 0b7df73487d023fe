"""Where, when and of what something was measured, and what else ran meanwhile. Written beside every set of data."""
import datetime
import json
import os
import pathlib
import platform
import subprocess
import time

TICKS = os.sysconf("SC_CLK_TCK")
BRIEF = ("measured", "commit", "load", "others", "origin")  # what a row keeps; the rest is the machine's
QUIET_LOAD, QUIET_OTHERS = 2.0, 0.25


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


def package_versions():
    names = ["gcc", "libsuitesparse-dev", "libopenblas0-pthread", "libc6"]
    found = {}
    for name in names:
        version = output_of("dpkg-query", "-W", "-f=${Version}", name)
        if version:
            found[name] = version
    return found


def commit(root):
    """Of the checkout, marked where files differ from it."""
    changed = output_of("git", "-C", str(root), "status", "--porcelain", "--untracked-files=no", "--", "solver", "server", "tests", "Makefile")
    return (output_of("git", "-C", str(root), "rev-parse", "--short=12", "HEAD") or "unknown") + ("+" if changed else "")


def at(seconds=None):
    """A time, by default now, as text."""
    moment = datetime.datetime.fromtimestamp(time.time() if seconds is None else seconds, datetime.timezone.utc)
    return moment.strftime("%Y-%m-%d %H:%M UTC")


def machine():
    system = next((line.split("=", 1)[1].strip('"') for line in pathlib.Path("/etc/os-release").read_text().splitlines()
                   if line.startswith("PRETTY_NAME=")), platform.system())
    return {"processor": processor(), "cores": os.cpu_count(), "memory_bytes": os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
            "system": system, "kernel": platform.release(), "compiler": output_of("gcc", "-dumpfullversion"), "packages": package_versions()}


def busy_seconds():
    """Of all processors together, what the host of a virtual machine took included (proc(5), the line "cpu" of /proc/stat)."""
    with open("/proc/stat", encoding="ascii") as file:
        user, nice, system, _, _, irq, softirq, steal = (int(field) for field in file.readline().split()[1:9])
    return (user + nice + system + irq + softirq + steal) / TICKS


def own_seconds():
    """Of this process and of its children that ended."""
    t = os.times()
    return t.user + t.system + t.children_user + t.children_system


class Watch:
    """From before a measurement to after it. load: of the minute before, so that it is not the measurement's own; others: how many
    processors other programs kept busy meanwhile."""

    def __init__(self):
        self.load, self.begun, self.busy, self.own = os.getloadavg()[0], time.monotonic(), busy_seconds(), own_seconds()

    def stamp(self, root):
        passed = max(time.monotonic() - self.begun, 1e-3)
        others = max(0.0, busy_seconds() - self.busy - (own_seconds() - self.own)) / passed
        return {"measured": at(), "commit": commit(root), "load": round(self.load, 2), "others": round(others, 2)}


def brief(full):
    """The part of a stamp that tells rows of one machine apart."""
    return {key: full[key] for key in BRIEF if full.get(key) is not None}


def beside_other_work(one):
    """True unless it is known that little else ran. A load without `others` was taken with the measurement running."""
    if one.get("others") is not None:
        return one["others"] > QUIET_OTHERS
    return one.get("load") is None or one["load"] > QUIET_LOAD


def write_whole(path, value):
    """JSON that another program never sees half written."""
    new = pathlib.Path(f"{path}.new")
    new.write_text(json.dumps(value, ensure_ascii=False))
    new.replace(path)
