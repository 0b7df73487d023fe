"""The manual page and the completion of the client: up to date, well formed, and true.
usage: test_client_manual.py BUILD_DIR [FILTER]"""
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
from service import PATIENT_S, ROOT, Skip, check, options
from terminal import Terminal
from test_client_requests import DECK, GMSH

BUILD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve()
CLIENT = str(BUILD / "uzawa")
MANUAL, COMPLETION = BUILD / "uzawa.1", BUILD / "uzawa.bash"
SHELLS = {"zsh": "share/zsh/vendor-completions/_uzawa", "fish": "share/fish/vendor_completions.d/uzawa.fish"}


def text_of(*words):
    return subprocess.run([CLIENT, *words], capture_output=True, text=True, check=True).stdout


def commands():
    return json.loads(text_of("help", "--json"))["commands"]


@options(None)
def test_manual_is_well_formed(_):
    if not shutil.which("mandoc"):
        raise Skip("mandoc is not installed")
    lint = subprocess.run(["mandoc", "-T", "lint", str(MANUAL)], capture_output=True, text=True)
    check(lint.returncode == 0 and lint.stdout + lint.stderr == "", lint.stdout, lint.stderr)
    page = subprocess.run(["mandoc", "-T", "ascii", "-O", "width=100", str(MANUAL)], capture_output=True, text=True).stdout
    page = re.sub(".\b", "", page)
    for command in commands():
        check(f"uzawa {command['name']}" in page, command["name"])
        for option in command["options"]:
            check(option["name"] in page, option)
    check("\n     7       the job ended without converging (iteration" in page, "the list of exit codes is not legible:", page)
    for code in (0, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 130):
        check(re.search(rf"^ +{code}\s", page, re.M), "no exit status", code)


@options(None)
def test_help_and_manual_name_every_exit_code(_):
    codes = [int(code) for code in re.findall(r"= (\d+)", (ROOT / "client/local/exit_codes.h").read_text())]
    overview = text_of("help")
    for code in codes:
        check(re.search(rf"^ +{code}  ", overview, re.M), "no exit status", code, "in", overview)


def examples():
    """The command lines of the section EXAMPLES, as a person would copy them."""
    section = MANUAL.read_text().split(".Sh EXAMPLES\n")[1].split("\n.Sh ")[0]
    blocks = re.findall(r"^\.Bd -literal.*?\n(.*?)^\.Ed$", section, re.M | re.S)
    return [block.replace("\\-", "-").replace("\\&", "").replace("\\e", "\\") for block in blocks]


def fill(folder):
    """The files that the examples are about."""
    paper = json.loads((ROOT / "tests/data/paper_body.json").read_text())
    springs = json.loads((ROOT / "tests/data/small_matrices.json").read_text())
    part = json.loads(json.dumps(paper))
    part["problem"].update(supports=[{"on": "left", "ux": 0, "uy": 0}], contacts=[],
                           loads=[{"on": "right", "traction": [0.5, 0]}])
    files = {"body.json": json.dumps(paper), "matrices.json": json.dumps(springs), "part.json": json.dumps(part),
             "part.msh": GMSH, "part.inp": DECK, "answer.json": (ROOT / "tests/data/verify.json").read_text()}
    for name in "KNhp":
        files[f"{name}.mtx"] = (ROOT / f"tests/data/springs_{name}.mtx").read_text()
    for name, text in files.items():
        (folder / name).write_text(text)


def test_every_example_runs(server):
    if not shutil.which("jq"):
        raise Skip("jq is not installed")
    folder = pathlib.Path(server.folder) / "examples"
    folder.mkdir()
    fill(folder)
    lines = [line for block in examples() for line in block.splitlines()]
    check(len(lines) > 25, lines)
    used = {line.split("uzawa ")[1].split()[0] for line in lines if "uzawa " in line}
    missing = {one["name"] for one in commands()} - used - {"help", "version", "cancel", "picture"}
    check(not missing, "no example of", missing)
    if "/v1/jobs/{id}/convergence.svg" not in server.get("/openapi.json").json["paths"]:
        lines = [line for line in lines if "convergence.svg" not in line]
    script = "set -euo pipefail\n" + "".join(f"echo '#{i}'\n{line}\n" for i, line in enumerate(lines))
    done = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True, timeout=120,
                          env={**os.environ, "UZAWA_SERVER": server.url, "PATH": f"{BUILD}:{os.environ['PATH']}"})
    last = int(re.findall(r"^#(\d+)$", done.stdout, re.M)[-1])
    check(done.returncode == 0, "line", lines[last], "failed:", done.stderr, done.stdout[-2000:])
    for name in ("history.csv", "nodes.csv", "body.vtu", "body.svg"):
        check((folder / name).stat().st_size > 100, name)
    check("converged" in done.stdout and "10.51" in done.stdout, done.stdout)


# -------------------------------------------------------------- completion


def complete(line, server=None, cwd=None):
    """What bash offers at the end of the line."""
    script = f"""
source {COMPLETION}
COMP_WORDS=({line})
[[ "$LINE" == *' ' ]] && COMP_WORDS+=("")
COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
_uzawa
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    done = subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, cwd=cwd, timeout=PATIENT_S,
                          env={**os.environ, "LINE": line, "UZAWA_SERVER": server.url if server else "http://127.0.0.1:1",
                               "PATH": f"{BUILD}:{os.environ['PATH']}"})
    check(done.returncode == 0 and done.stderr == "", line, done)
    return done.stdout.split()


@options(None)
def test_completion_of_commands_and_options(_):
    names = [command["name"] for command in commands()]
    check(complete("uzawa ") == names, complete("uzawa "))
    check(complete("uzawa re") == ["refine", "result", "report", "request"], complete("uzawa re"))
    check(complete("uzawa --server http://h li") == ["list"])
    check(complete("uzawa --s") == ["--server"])
    for command in commands():
        offered = complete(f"uzawa {command['name']} --")
        check(sorted(offered) == sorted({option["name"] for option in command["options"]}), command["name"], offered)
    check(complete("uzawa help re") == ["refine", "result", "report", "request"])


@options(None)
def test_completion_of_values(_):
    check(complete("uzawa result x --format ") == ["json", "table", "csv", "npz", "vtu", "pvd"])
    check(complete("uzawa result x -f v") == ["vtu"])
    check(complete("uzawa list --status r") == ["running"])
    check(complete("uzawa refine x --accuracy e") == ["exact"])
    # As bash takes the words apart: at "=" and ":" as well.
    check(complete("uzawa result x --format = v") == ["vtu"] and complete("uzawa result x --format =") == ["json", "table", "csv", "npz", "vtu", "pvd"])
    check(complete("uzawa --server http : //h : 1 li") == ["list"])
    check(complete("uzawa --server = http : //h : 1 list --status = r") == ["running"])
    check(complete("uzawa submit --vary ") == [] and complete("uzawa list --limit ") == [])


@options(None)
def test_completion_of_files(server):
    os.makedirs(os.path.join(server.folder, "dir"))
    for name in ("body one.json", "dir/x.mtx", "K.mtx"):
        with open(os.path.join(server.folder, name), "w", encoding="utf-8"):
            pass
    check("body" in complete("uzawa submit b", cwd=server.folder)[0])
    check(complete("uzawa submit --K dir/", cwd=server.folder) == ["dir/x.mtx"])


def complete_jobs(line, server):
    """The service has a second to answer, which a busy machine may let pass."""
    return next((found for found in (complete(line, server) for _ in range(10)) if found), [])


def test_completion_of_jobs(server):
    ids = [server.post(service.MATRICES).json["id"] for _ in range(3)]
    check(complete_jobs("uzawa status ", server) == ids[::-1], ids)
    check(complete_jobs(f"uzawa wait {ids[0][:31]}", server), ids)
    check(complete("uzawa status ") == [], "nobody answers: nothing is offered")


def run_shell(command, server, script=None):
    done = subprocess.run(command, input=script, capture_output=True, text=True, timeout=60, cwd=server.folder if server else None,
                          env={**os.environ, "UZAWA_SERVER": server.url if server else "http://127.0.0.1:1", "HOME": os.devnull,
                               "PATH": f"{BUILD}:{os.environ['PATH']}", "TERM": "dumb"})
    check(done.returncode == 0, command, done)
    return done.stdout


def of_fish(line, server=None):
    """What fish offers at the end of the line."""
    script = f"source {BUILD / 'uzawa.fish'}; complete -C {line!r}"
    return [one.split("\t")[0] for one in run_shell(["fish", "--no-config", "-c", script], server).splitlines()]


def test_completion_of_fish(server):
    names = [command["name"] for command in commands()]
    check(sorted(of_fish("uzawa ")) == sorted(names), of_fish("uzawa "))
    check(of_fish("uzawa --server http://h li") == ["list"])
    for command in commands():
        offered = of_fish(f"uzawa {command['name']} --")
        check(sorted(offered) == sorted({option["name"] for option in command["options"]}), command["name"], offered)
    check(sorted(of_fish("uzawa result x --format ")) == ["csv", "json", "npz", "pvd", "table", "vtu"], of_fish("uzawa result x --format "))
    check(of_fish("uzawa list --limit ") == [] and of_fish("uzawa help ref") == ["refine"])
    job = server.post(service.MATRICES).json["id"]
    check(any(of_fish("uzawa status ", server) == [job] for _ in range(10)), "the service has a second to answer")


@options(None)
def test_completion_of_zsh(server):
    folder = pathlib.Path(server.folder)
    (folder / "_uzawa").write_text((BUILD / "uzawa.zsh").read_text())
    (folder / ".zshrc").write_text("PS1='READY '; fpath=($ZDOTDIR $fpath); autoload -U compinit; compinit -u -D\n"
                                   "zstyle ':completion:*' verbose no; LISTMAX=0; unsetopt beep; unset zle_bracketed_paste\n")
    environment = {"ZDOTDIR": str(folder), "PATH": f"{BUILD}:{os.environ['PATH']}", "UZAWA_SERVER": "http://127.0.0.1:1",
                   "TERM": "dumb"}
    lines = {"uzawa re\t\t": rb"refine +report +request +result", "uzawa result x -f \t\t": rb"csv +json +npz +pvd +table +vtu",
             "uzawa help ref\t": b"uzawa help refine", "uzawa submit --bas\t": b"uzawa submit --baseline"}
    with Terminal([shutil.which("zsh"), "-d", "-i"], columns=200, environment=environment) as terminal:
        wanted = b"READY "
        for line, following in [*lines.items(), ("", b"")]:
            before = len(terminal.bytes)
            terminal.until(lambda _, start=before, end=wanted: re.search(end, terminal.bytes[start:]))
            terminal.type("\x15print an''swered\r")  # the line is given up, and the next prompt awaited
            terminal.until(lambda _: re.search(rb"answered.*READY $", terminal.bytes, re.DOTALL))
            terminal.type(line)
            wanted = following


@options(None)
def test_install_puts_them_where_they_are_found(server):
    done = subprocess.run(["make", "-s", "-o", "all", f"BUILD={BUILD}", f"DESTDIR={server.folder}", "PREFIX=/usr", "install"],
                          cwd=ROOT, capture_output=True, text=True)
    check(done.returncode == 0, done)
    root = pathlib.Path(server.folder) / "usr"
    check((root / "share/man/man1/uzawa.1").read_text() == MANUAL.read_text())
    check((root / "share/bash-completion/completions/uzawa").read_text() == COMPLETION.read_text())
    for shell, place in SHELLS.items():
        check((root / place).read_text() == (BUILD / f"uzawa.{shell}").read_text(), shell)
    check(os.access(root / "bin/uzawa", os.X_OK))


if __name__ == "__main__":
    service.main(globals())
