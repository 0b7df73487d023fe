"""README.md and the pages of docs: every command runs as printed, links lead somewhere, lines are short. usage: test_readme.py BUILD_DIR
[FILTER]

Each page has a daemon and a shell of its own, in which its ```sh blocks run in order; a block with a line <!-- not run: REASON --> before
it does not. The daemon's port is put in for 127.0.0.1:8080 and the build folder for build/. JSON that a block prints must meet its schema.
"""
# not under sanitizers: it is documents that are tried here
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import PATIENT_S, ROOT, Skip, check, options

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^(<!-- not run: [^\n]+ -->\n)?```sh\n(.*?)^```$", re.M | re.S)
FENCE = re.compile(r"^```.*?^```$", re.M | re.S)
UNFINISHED = re.compile(r"^<!-- not run(?!: [^\n]+ -->\n```sh\n)", re.M)
MOST_NOT_RUN = 6  # of all pages
OF_MAKE = ("BUILD", "CC", "OPT", "SAN", "CFLAGS", "LDFLAGS", "FILTER")  # given to the make that runs the tests, not to one of a block
MOST_LINES, WIDTH = 150, 120
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")


def blocks(text):
    """Those that are to be run."""
    return [block for spared, block in BLOCK.findall(text) if not spared]


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
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS")) and name not in OF_MAKE}
    environment["UZAWA_SERVER"] = "http://" + address
    done = subprocess.run(["bash", "-c", script], cwd=root, env=environment, timeout=120)
    return done.returncode


def read(root, name):
    path = root / name
    return path.read_text() if path.exists() else ""


def run_page(server, page):
    if not shutil.which("jq") or not shutil.which("curl"):
        raise Skip("curl or jq is not installed")
    found = blocks(page.read_text())
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


def of_page(page):
    @options(None)
    def test(server):
        run_page(server, page)
    return test


for one in PAGES:
    if blocks(one.read_text()):
        globals()[f"test_blocks_of_{one.stem.replace('-', '_')}"] = of_page(one)


@options(None)
def test_blocks_are_found(_):
    text = "a\n```sh\nx\ny\n```\n<!-- not run: why -->\n```sh\nnot this\n```\n```json\n{}\n```\n```sh\nz\n```\n"
    check(blocks(text) == ["x\ny\n", "z\n"], blocks(text))
    for bad in ("<!-- not run: why -->\n\n```sh\n", "<!-- not run -->\n```sh\n", "<!-- not run: -->\n```sh\n"):
        check(UNFINISHED.search(bad), bad)
    check(not UNFINISHED.search(text))
    check(json_values(' {"a": 1}\n[2]\n') == [{"a": 1}, [2]] and json_values("iteration,seconds\n") == [])
    for name in ("README.md", "docs/tutorial.md", "docs/http.md", "docs/operations.md", "docs/contributing.md"):
        check(blocks((ROOT / name).read_text()), name, "has no block that is run")
    texts = [page.read_text() for page in PAGES]
    check(not any(UNFINISHED.search(text) for text in texts), "a mark stands before something that is no sh block, or gives no reason")
    spared = [block for text in texts for mark, block in BLOCK.findall(text) if mark]
    check(len(spared) <= MOST_NOT_RUN, "too many blocks are not run:", spared)


# ---- links and lines

def anchor(title):
    """As GitHub makes it of a heading."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title).replace("`", "")
    return re.sub(r"[^\w\- ]", "", plain.lower()).replace(" ", "-")


def anchors(text):
    found = {}
    for title in re.findall(r"^#+ (.*)$", FENCE.sub("", text), re.M):
        name = anchor(title)
        found[name] = found.get(name, -1) + 1
    return {f"{name}-{i}" if i else name for name, count in found.items() for i in range(count + 1)}


def broken_links(page, text):
    """Of a page's links those to files that are not there, or to headings that their page has not."""
    bad = []
    for link in LINK.findall(FENCE.sub("", text)):
        path, _, heading = link.partition("#")
        if re.match(r"[a-z]+:", link):
            continue
        target = (page.parent / path).resolve() if path else page
        if target == page:
            bad += [] if heading in anchors(text) else [link]
        elif not target.exists():
            bad.append(link)
        elif heading and heading not in anchors(target.read_text()):
            bad.append(link)
    return bad


@options(None)
def test_links(_):
    for page in PAGES:
        check(broken_links(page, page.read_text()) == [], page, broken_links(page, page.read_text()))
    text = "# A b, `c`: d\n[1](#a-b-c-d) [2](#a) [3](faq.md#general) [4](faq.md#genera) [5](no.md) [6](http://h/x) ![7](figures/no.svg)\n```sh\n[8](no)\n```\n"
    check(broken_links(ROOT / "docs/x.md", text) == ["#a", "faq.md#genera", "no.md", "figures/no.svg"], broken_links(ROOT / "docs/x.md", text))
    check(anchors("# A\n## A\n") == {"a", "a-1"})


@options(None)
def test_every_page_is_reached(_):
    """From the README, link by link."""
    seen, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop()
        seen.add(page)
        for link in LINK.findall(page.read_text()):
            target = (page.parent / link.partition("#")[0]).resolve()
            if target.suffix == ".md" and target.is_file() and target not in seen:
                left.append(target)
    missing = [page.name for page in PAGES if page not in seen and not page.name.endswith(".in.md")]
    check(not missing, "no page links to", missing)


def long_lines(text):
    """Rows of tables cannot be broken."""
    return [line for line in text.splitlines() if len(line) >= WIDTH and not line.startswith("|")]


@options(None)
def test_lines(_):
    for page in PAGES:
        check(long_lines(page.read_text()) == [], page, long_lines(page.read_text()))
    check(long_lines("x" * 119 + "\n" + "y" * 120 + "\n|" + "z" * 200) == ["y" * 120])
    check(len((ROOT / "README.md").read_text().splitlines()) <= MOST_LINES, "the README is for a reader in a hurry")


@options(None)
def test_every_error_code_is_explained(_):
    sources = "".join(path.read_text() for path in sorted((ROOT / "server").rglob("*.c")))
    codes = set(re.findall(r'\b[45]\d\d,\s*"([a-z]+(?:_[a-z]+)*)"', sources))
    codes |= set(re.findall(r"([a-z]+(?:_[a-z]+)+)[,;]", json.loads((service.SCHEMAS / "problem-details.json").read_text())["properties"]["code"]["description"]))
    check(len(codes) > 60, sorted(codes))
    explained = (ROOT / "docs/faq.md").read_text()
    missing = sorted(code for code in codes if f"`{code}`" not in explained)
    check(not missing, "docs/faq.md says nothing about", missing)


@options(None)
def test_references_are_complete(s):
    """What programs and operators look up: routes with their parameters, outcomes, warnings, fields, options."""
    def enums(node, key):
        """What may stand at a key, wherever a schema has it."""
        if isinstance(node, dict):
            found = node.get("properties", {}).get(key, {}).get("enum", [])
            return set(found).union(*(enums(value, key) for value in node.values()))
        return set().union(*(enums(value, key) for value in node)) if isinstance(node, list) else set()

    text, summary = (ROOT / "docs/http.md").read_text(), json.loads((service.SCHEMAS / "summary.json").read_text())
    paths = json.loads((service.SCHEMAS / "openapi.json").read_text())["paths"]
    routes = [f"{method.upper()} {path}" for path, methods in paths.items() for method in methods if method in ("get", "post", "delete")]
    words = routes + [one["name"] for methods in paths.values() for method in methods.values() if isinstance(method, dict)
                      for one in method.get("parameters", [])
                      if one.get("in") == "query" and one["name"] != "validate"]
    words += enums(summary, "outcome") | enums(summary, "code")
    check(len(words) > 60 and "mesh_limit" in words and "locking" in words, words)
    missing = [word for word in words if f"`{word}`" not in text]
    check(not missing, "docs/http.md says nothing about", missing)
    told = subprocess.run([f"{s.build}/uzawad", "--help"], capture_output=True, text=True, timeout=PATIENT_S).stdout
    flags = set(re.findall(r"--[a-z-]+[a-z]", told))
    check(len(flags) > 40, flags)
    missing = [flag for flag in sorted(flags) if f"`{flag}`" not in (ROOT / "docs/operations.md").read_text()]
    check(not missing, "docs/operations.md says nothing about", missing)


@options(None)
def test_demo(_):
    """What `make demo` runs, of whose answer the README has the lines."""
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
