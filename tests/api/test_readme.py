"""Runs the README's marked shell blocks, in order, in one shell. usage: test_readme.py BUILD_DIR [FILTER]

A block counts when the line before its ```sh is <!-- test -->. The daemon's port is put in for 127.0.0.1:8080 and the
build folder for build/. JSON that a block prints must meet its schema. README_FILE names another file than README.md.
"""
# not under ThreadSanitizer: about answers, not about threads
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import ROOT, Skip, check, options

README = ROOT / os.environ.get("README_FILE", "README.md")
MARKED = re.compile(r"^<!-- test -->\n```sh\n(.*?)^```$", re.M | re.S)
UNFINISHED = re.compile(r"^<!-- test -->\n(?!```sh\n)", re.M)


def blocks(text):
    return [found.group(1) for found in MARKED.finditer(text)]


def mirror(folder):
    """A folder that looks like the checkout's root, where blocks may write files without leaving any behind."""
    root = pathlib.Path(folder) / "root"
    root.mkdir()
    for entry in ROOT.iterdir():
        if entry.name not in ("build", ".git"):
            (root / entry.name).symlink_to(entry)
    (root / "build").symlink_to(pathlib.Path(sys.argv[1]).resolve())
    return root


def json_values(text):
    """The JSON values that a text consists of; [] for what is no JSON."""
    values, decoder, text = [], json.JSONDecoder(), text.lstrip()
    while text.startswith(("{", "[")):
        value, end = decoder.raw_decode(text)
        values.append(value)
        text = text[end:].lstrip()
    check(not values or not text, "something else follows the JSON:", text[:200])
    return values


class Printed:
    """What schema_of looks at, for JSON that came through a shell."""

    def __init__(self, value):
        self.json, self.headers = value, {"content-type": "application/json"}


def run_blocks(found, root, address):
    """One shell for all, so that a later block may use an earlier one's variables; output by block."""
    script = "set -euo pipefail\n"
    for i, block in enumerate(found):
        (root / f".block{i}").write_text(block.replace("127.0.0.1:8080", address))
        script += f". ./.block{i} >.out{i} 2>.err{i}\ntouch .done{i}\n"
    environment = {**os.environ, "UZAWA_SERVER": "http://" + address}
    done = subprocess.run(["bash", "-c", script], cwd=root, env=environment, timeout=120)
    return done.returncode


def read(root, name):
    path = root / name
    return path.read_text() if path.exists() else ""


@options(None)
def test_blocks(server):
    if not README.exists():
        raise Skip(f"{README.name} is not there")
    if not shutil.which("jq") or not shutil.which("curl"):
        raise Skip("curl or jq is not installed")
    found = blocks(README.read_text())
    check(found, "the README has no marked block")
    check(not UNFINISHED.search(README.read_text()), "a marker stands before something that is no sh block")
    server.start()
    root = mirror(server.folder)
    status = run_blocks(found, root, f"{server.host}:{server.port}")
    for i, block in enumerate(found):
        shown = f"block {i + 1}:\n{block}printed:\n{read(root, f'.out{i}')[:2000]}{read(root, f'.err{i}')[:2000]}"
        check((root / f".done{i}").exists(), f"status {status} in", shown)
        check(read(root, f".err{i}") == "", "errors in", shown)
        for value in json_values(read(root, f".out{i}")):
            check(isinstance(value, dict) and "code" not in value, "a problem in", shown)
            service.validate(Printed(value))


@options(None)
def test_blocks_are_found(_):
    text = "a\n<!-- test -->\n```sh\nx\ny\n```\n```sh\nnot this\n```\n<!-- test -->\n```sh\nz\n```\n"
    check(blocks(text) == ["x\ny\n", "z\n"], blocks(text))
    check(UNFINISHED.search("<!-- test -->\n\n```sh\n") and not UNFINISHED.search(text))
    check(json_values(' {"a": 1}\n[2]\n') == [{"a": 1}, [2]] and json_values("iteration,seconds\n") == [])


@options(None)
def test_demo(_):
    """What `make demo` runs, of which the first lines of the README speak."""
    done = subprocess.run(["tests/demo.sh", str(pathlib.Path(sys.argv[1]).resolve())], cwd=ROOT, capture_output=True,
                          text=True, timeout=120)
    check(done.returncode == 0, done)
    check("outcome     converged" in done.stdout and "from the cache" in done.stdout and "make run" in done.stdout, done)
    shape = [re.sub(r"[0-9]+", "#", line) for line in done.stdout.splitlines()]
    shown = (ROOT / "README.md").read_text().split("<!-- demo -->\n```\n")[1].split("\n```")[0].splitlines()
    for line in shown:  # its words; digits of other machines may differ in the last place
        check(re.sub(r"[0-9]+", "#", line) in shape, "the demo does not say", line, done.stdout)


if __name__ == "__main__":
    service.main(globals())
