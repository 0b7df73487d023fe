"""The daemon as a process: command line, signals, drain, restart, descriptors, log."""
# not under ThreadSanitizer: about one process, which every test there begins, signals and ends
import os
import signal
import socket
import subprocess
import threading
import time

import service
from service import ENDLESS, MATRICES, PATIENT_S, SCENE, Skip, check, expect, options, wait_until

# ------------------------------------------------------------------ process

def test_terminates(s):
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if s.process.poll() is not None:
            s.start()
        s.get("/healthz")
        started = time.monotonic()
        check(s.terminate(number=number) == 0, s.log())
        check(time.monotonic() - started < 20, "an idle daemon drained for", time.monotonic() - started)


@options("--drain-s", "6", "--workers", "1")
def test_drain(s):
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    poll = {}

    def long_poll():
        poll["reply"] = s.get(f"/v1/jobs/{job['id']}", Prefer="wait=60")
    thread = threading.Thread(target=long_poll)
    thread.start()
    time.sleep(0.3)
    started = time.monotonic()
    s.process.send_signal(signal.SIGTERM)
    wait_until(lambda: s.get("/readyz").status == 503)
    expect(s.get("/readyz"), 503, "draining")
    reply = expect(s.post(MATRICES), 503, "draining")
    check(int(reply.headers["retry-after"]) >= 1, reply)
    check(s.get("/healthz").status == 200 and s.get(f"/v1/jobs/{job['id']}").status == 200)
    thread.join(timeout=PATIENT_S)
    check(poll["reply"].status == 200 and time.monotonic() - started < 5.5, poll)
    check(s.process.wait(timeout=60) == 0 and 5.5 < time.monotonic() - started, time.monotonic() - started)
    s.start()  # the job was put back and runs again
    again = s.wait_status(job["id"], "running")
    check(again["attempts"] == 1, again)


@options("--drain-s", "60", "--workers", "16")
def test_second_signal_ends_the_drain(s):
    # Of many workers it is hardly the one that began the process who has the second job: who has none must not end it.
    s.solve(SCENE)
    job = s.post(ENDLESS).json
    s.wait_status(job["id"], "running")
    started = time.monotonic()
    s.process.send_signal(signal.SIGTERM)
    time.sleep(0.5)
    check(s.process.poll() is None, "it did not drain")
    check(s.terminate() == 0 and time.monotonic() - started < 40, s.log())


def test_killed_daemon_keeps_jobs(s):
    done = s.solve(MATRICES)
    running = s.post(ENDLESS).json
    s.wait_status(running["id"], "running")
    s.restart()
    check(s.get(f"/v1/jobs/{done['id']}").json["summary"] == done["summary"])
    check(s.wait_status(running["id"], "running")["attempts"] == 2)


def test_signals_are_blocked_in_every_thread(s):
    s.begins_masked = False
    s.restart(signal.SIGTERM)
    s.solve(SCENE)
    # The first thread takes the signals: while it waits for them they are open there, and only there.
    for task in set(os.listdir(f"/proc/{s.process.pid}/task")) - {str(s.process.pid)}:
        try:
            with open(f"/proc/{s.process.pid}/task/{task}/status", encoding="ascii") as file:
                blocked = next(int(line.split()[1], 16) for line in file if line.startswith("SigBlk"))
        except OSError:  # a connection's thread that ended meanwhile
            continue
        for number in (signal.SIGTERM, signal.SIGABRT, signal.SIGINT):
            check(blocked >> (number - 1) & 1, "signal", number, "is open in thread", task)


def run(s, *arguments):
    return subprocess.run(s.command(*arguments), capture_output=True, text=True, timeout=PATIENT_S, check=False)


def test_port_in_use(s):
    got = run(s, "--listen", f"127.0.0.1:{s.port}", "--db", s.db + ("" if "://" in s.db else "2"))
    check(got.returncode == 1 and got.stdout == "" and "cannot listen" in got.stderr and "in use" in got.stderr, got)
    check("give another port" in got.stderr, "no remedy", got)


def test_database_in_use(s):
    got = run(s, "--listen", "127.0.0.1:0", "--db", s.file())
    check(got.returncode == 1 and got.stdout == "" and s.file() in got.stderr, got)
    check(s.solve(MATRICES)["status"] == "successful")


@options(None)
def test_command_line(s):
    got = run(s, "--help")
    check(got.returncode == 0 and got.stdout.startswith("usage:") and got.stderr == "", got)
    got = run(s, "--version")
    check(got.returncode == 0 and got.stdout.startswith("uzawad "), got)
    for wrong in (["--nonsense"], ["--workers", "0"], ["--workers", "two"], ["--max-body", "10X"], ["--max-body"],
                  ["--drain-s", "nan"], ["--drain-s", "-1"], ["--cache", "-1"], ["--log-level", "loud"], ["here"],
                  ["--request-deadline-s", "0"]):
        got = run(s, *wrong)
        check(got.returncode == 2 and got.stdout == "" and "usage:" in got.stderr, wrong, got)
    for wrong in ("127.0.0.1", "127.0.0.1:x", "127.0.0.1:70000", "::1:80", ":80", "[::1]", "300.1.1.1:80"):
        got = run(s, "--listen", wrong, "--db", os.path.join(s.folder, "x.db"))
        check(got.returncode == 1 and got.stderr.startswith("uzawad: "), wrong, got)
    got = run(s, "--listen", "127.0.0.1:0", "--db", "/nonexistent/x.db")
    check(got.returncode == 1 and "/nonexistent/x.db" in got.stderr and "make its folder first" in got.stderr, got)
    got = run(s, "--lisen", "127.0.0.1:0")
    check(got.returncode == 2 and "did you mean --listen?" in got.stderr, got)
    got = run(s, "--qqqqqqqqqqqqq")
    check(got.returncode == 2 and "unknown option --qqqqqqqqqqqqq\n" in got.stderr, got)


@options(None)
def test_closed_standard_streams(s):
    """What is printed and logged goes nowhere then, not into the file of jobs, which would be the next to be opened."""
    file = s.file()
    with socket.create_server(("127.0.0.1", 0)) as free:
        s.host, s.port = free.getsockname()
    command = s.command("--listen", f"127.0.0.1:{s.port}", "--db", file)
    with subprocess.Popen(command, preexec_fn=lambda: os.closerange(0, 3)) as daemon:
        try:
            wait_until(lambda: daemon.poll() is not None or os.path.exists(file) and answers(s))
            check(s.solve(MATRICES)["status"] == "successful")
        finally:
            daemon.kill()
    with open(file, "rb") as text:
        check(text.read(16) == b"SQLite format 3\0", "the file of jobs was written over")


def answers(s):
    try:
        return s.get("/healthz").status == 200
    except OSError:
        return False


@options(None)
def test_little_memory(s):
    """Threads of BLAS, which the daemon has no use for, waited for memory, and its end for them."""
    if service.INSTRUMENTED:
        raise Skip("shadow memory takes more")
    limited = ["sh", "-c", 'ulimit -v 200000 && exec "$@"', "sh", *s.command("--listen", "127.0.0.1:0", "--db", os.path.join(s.folder, "limited.db"))]
    with subprocess.Popen(limited, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as daemon:
        try:
            check(daemon.stdout.readline().startswith(b"listening on "))
            daemon.terminate()
            check(daemon.wait(timeout=service.PATIENT_S) == 0)
        finally:
            daemon.kill()


@options(None)
def test_ipv6(s):
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError as why:
        raise Skip("no IPv6 loopback here") from why
    with subprocess.Popen(s.command("--listen", "[::1]:0", "--db", s.db), stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL) as process:
        line = process.stdout.readline().decode()
        process.send_signal(signal.SIGTERM)
        check(line.startswith("listening on http://[::1]:") and process.wait(timeout=PATIENT_S) == 0, line)


def test_descriptors_do_not_leak(s):
    def count():
        return len(os.listdir(f"/proc/{s.process.pid}/fd"))
    s.solve(MATRICES)
    for _ in range(8):
        s.get("/v1/jobs")
    time.sleep(0.3)
    before = count()
    for i in range(200):
        if i % 4 == 0:
            s.post(MATRICES, query="?validate=true")
        elif i % 4 == 1:
            s.raw(b"GET / HTTP/1.1\r\nHost: x\r\nHost: y\r\n\r\n")
        else:
            s.get("/v1/jobs" if i % 4 == 2 else "/nothing")
    end = time.monotonic() + PATIENT_S  # a connection is let go after its reply
    while count() > before + 2 and time.monotonic() < end:
        time.sleep(0.05)
    check(count() <= before + 2, "descriptors grew from", before, "to", count())


def test_access_log(s):
    job = s.solve(MATRICES)
    s.get(f"/v1/jobs/{job['id']}/result?fields=gaps")
    s.get("/no%22thing\\")
    end = time.monotonic() + PATIENT_S  # a line follows its reply, and lines of two connections come in either order
    lines = {}
    while len(lines) < 2 and time.monotonic() < end:
        lines = {event["path"].rpartition("/")[2]: event for event in s.events("request")
                 if event["path"].endswith("/result") or event["path"] == '/no%22thing\\'}
        time.sleep(0.02)
    check(len(lines) == 2, s.log())
    result = lines["result"]
    check(result["method"] == "GET" and result["status"] == 200 and result["job"] == job["id"], result)
    check(result["bytes"] > 10 and 0 <= result["seconds"] < 10 and result["end"] == "complete", result)
    check(lines['no%22thing\\']["status"] == 404, lines)


if __name__ == "__main__":
    service.main(globals())
