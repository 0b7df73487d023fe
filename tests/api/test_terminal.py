"""The client on a pseudo-terminal: the progress line, drawings, Ctrl-C, windows that change.
usage: test_terminal.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import json
import os
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from service import PATIENT_S, check, options
from terminal import Screen, Terminal

SHARED = True  # one service for all tests

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
PAPER = "tests/data/paper_body.json"
# Long enough to be watched, and it ends by itself: with exit status 7.
WATCHED = {**service.ENDLESS, "solver": {**service.ENDLESS["solver"], "time_limit_s": 2.5}}


def write(server, name, body):
    path = os.path.join(server.folder, name)
    with open(path, "w", encoding="utf-8") as file:
        json.dump(body, file)
    return path


def terminal(server, *words, columns=80, **environment):
    return Terminal([CLIENT, "--server", server.url, *words], columns, environment)


def run(server, *words, **environment):
    return subprocess.run([CLIENT, "--server", server.url, *words], capture_output=True, text=True, timeout=60,
                          env={**os.environ, **environment})


def post(server, body):
    return run(server, "submit", write(server, "posted.json", body)).stdout.strip()


def bars(screen):
    return [line for line in screen.shown if " %" in line and not line.startswith("whole error")]


def test_progress_line_moves_and_ends_clean(server):
    with terminal(server, "submit", write(server, "b.json", WATCHED), "--wait", columns=120) as seen:
        check(seen.end() == 7, seen.screen.text)
    shown = bars(seen.screen)
    check(len(set(shown)) >= 4, "it must move:", shown)
    running = [line for line in shown if "running" in line]
    for part in ("[", "iterating", "iteration ", "error ~", "bound ", "ETA ", " s "):
        check(any(part in line for line in running), part, "was never shown:", shown)
    check(seen.screen.widest < 120, seen.screen.widest)
    # Nothing of it stays: the summary begins at the top.
    check(seen.screen.lines[0].startswith("job "), seen.screen.text)
    check("%" not in seen.screen.lines[0] and "[#" not in seen.screen.text, seen.screen.text)
    iterations = [int(line.split("iteration ")[1].split()[0]) for line in running if "iteration " in line]
    check(iterations == sorted(iterations) and iterations[-1] > iterations[0], iterations)


def test_a_line_is_drawn_while_nothing_happens(server):
    """Seconds go on though the server says nothing: a job that waits behind another."""
    held = [post(server, service.ENDLESS) for _ in range(3)]
    with terminal(server, "wait", held[-1], columns=100) as seen:
        seen.until(lambda screen: len(set(bars(screen))) > 4)
        check("accepted" in bars(seen.screen)[-1] or "running" in bars(seen.screen)[-1], bars(seen.screen))
        for job in held:
            run(server, "cancel", job)
        check(seen.end() == 9, seen.screen.text)


def test_narrow_terminal(server):
    with terminal(server, "submit", write(server, "b.json", WATCHED), "--wait", "--quiet", columns=30) as quiet:
        check(quiet.end() == 7 and len(quiet.screen.text.split()) == 1, "quiet shows the id alone", quiet.screen.text)
    for _ in range(5):
        with terminal(server, "wait", post(server, WATCHED), columns=30) as seen:
            seen.end()
        shown = bars(seen.screen)
        if len(shown) > 1:  # else the job was over before anybody looked
            break
    check(shown and max(map(len, shown)) <= 29, shown)
    check(any("error ~" in line for line in shown), "the error stays when there is little room:", shown)
    with terminal(server, "wait", post(server, WATCHED), columns=9) as seen:
        seen.end()
    check(all(len(line) <= 8 for line in bars(seen.screen)), bars(seen.screen))


def test_window_changes_while_it_runs(server):
    job = post(server, service.ENDLESS)
    with terminal(server, "wait", job, columns=110) as seen:
        seen.until(lambda screen: any("iterating" in line and len(line) > 60 for line in bars(screen)))
        before = len(seen.screen.shown)
        seen.resize(30)
        seen.until(lambda screen: any(len(line) <= 29 for line in screen.shown[before:]))
        narrow = len(seen.screen.shown)
        time.sleep(1)
        seen.until(lambda screen: len(screen.lines[-1]) <= 29)
        check(all(len(line) <= 29 for line in seen.screen.shown[narrow:]), seen.screen.shown[before:])
        before = len(seen.screen.shown)
        seen.resize(100)
        seen.until(lambda screen: any(len(line) > 60 for line in screen.shown[before:]))
        run(server, "cancel", job)
        check(seen.end() == 9, seen.screen.text)


def test_interrupt_leaves_the_job(server):
    with terminal(server, "submit", write(server, "b.json", service.ENDLESS), "--wait", columns=300) as seen:
        seen.until(lambda screen: any("iteration " in line for line in bars(screen)))
        asked = time.monotonic()
        seen.type("\x03")
        check(seen.end() == 130, seen.screen.text)
        check(time.monotonic() - asked < 40, "it must not wait for the server")
    said = next(line for line in seen.screen.lines if "interrupted" in line)
    job = said.split("uzawa wait ")[1].split(";")[0]
    check(len(job) == 32 and f"uzawa cancel {job}" in said and " %" not in said, said)
    check("running" in run(server, "status", job).stdout, "the job must go on")
    done = run(server, "wait", job, "--timeout", "0.5")
    check(done.returncode == 10 and "goes on" in done.stderr, done)
    run(server, "cancel", job)


def test_interrupt_without_a_terminal(server):
    job = post(server, service.ENDLESS)
    waiting = subprocess.Popen([CLIENT, "--server", server.url, "wait", job, "--json"], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    time.sleep(1)
    waiting.send_signal(signal.SIGINT)
    out, err = waiting.communicate(timeout=PATIENT_S)
    check(waiting.returncode == 130 and json.loads(err)["exit"] == 130, waiting.returncode, out, err)
    check(not out or json.loads(out)["id"] == job, out)
    # A shell's background job does not hear of a Ctrl-C that is meant for another.
    waiting = subprocess.Popen([CLIENT, "--server", server.url, "wait", job], stdout=subprocess.PIPE, text=True,
                               preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    time.sleep(0.5)
    waiting.send_signal(signal.SIGINT)
    time.sleep(0.5)
    check(waiting.poll() is None, "it was ignored and must stay so")
    run(server, "cancel", job)
    waiting.communicate(timeout=PATIENT_S)
    check(waiting.returncode == 9, waiting.returncode)


def test_no_terminal(server):
    job = post(server, WATCHED)
    done = run(server, "wait", job, "--progress")
    lines = done.stderr.splitlines()
    check(done.returncode == 7 and 2 <= len(lines) <= 6, done.stderr)
    check("\r" not in done.stderr and "\033" not in done.stderr, repr(done.stderr))
    check(any("iteration " in line for line in lines) and "successful 100 %" in lines[-1], lines)
    check(run(server, "wait", job).stderr == "", "nothing unless asked for")


def test_plot(server):
    job = run(server, "submit", PAPER, "--wait", "--quiet").stdout.strip()
    with terminal(server, "history", job, "--plot", columns=100, LC_ALL="C.UTF-8") as seen:
        check(seen.end() == 0)
    check(seen.screen.widest <= 72 and len(seen.screen.lines) == 21 and seen.screen.colours > 10, seen.screen.text)
    check(any("\u2800" <= c <= "\u28ff" for c in seen.screen.text), seen.screen.text)
    with terminal(server, "history", job, "--plot", columns=30, LC_ALL="C.UTF-8") as narrow:
        check(narrow.end() == 0)
    check(narrow.screen.widest <= 30 and "bound" in narrow.screen.lines[0], narrow.screen.text)
    with terminal(server, "history", job, "--plot", columns=80, LC_ALL="C", NO_COLOR="1") as plain:
        check(plain.end() == 0)
    check(plain.screen.colours == 0 and plain.screen.text.isascii() and b"\033" not in plain.bytes, plain.screen.text)
    check("\033" not in run(server, "history", job, "--plot").stdout, "colours are for terminals")


@options(None)
def test_the_screen_itself(_):
    screen = Screen()
    for piece in ("ab", "c\r\033", "[", "Kxy\r", "z\n\033[36mq\033[0m"):
        screen.feed(piece)
    check(screen.lines == ["zy", "q"] and screen.colours == 2 and screen.shown == ["abc", "xy", "zy"], vars(screen))


if __name__ == "__main__":
    service.main(globals())
