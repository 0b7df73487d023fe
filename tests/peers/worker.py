"""A solver in a process of its own, with limits of memory and time, that is asked line by line (peer.h)."""
import ctypes
import json
import os
import resource
import select
import signal
import subprocess
import time

THREADS = {"OMP_NUM_THREADS": "1", "OMP_THREAD_LIMIT": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
           "PYTHONDONTWRITEBYTECODE": "1"}
PR_SET_PDEATHSIG = 1  # <linux/prctl.h>: a solver does not outlive the driver
LIBC = ctypes.CDLL(None)
TICKS = os.sysconf("SC_CLK_TCK")


class Ended(Exception):
    """The process did not answer: its one argument says why."""


class Worker:
    def __init__(self, command, megabytes):
        """megabytes: of address space; 0: no limit. Raises Ended where it does not get as far as having read its
        problem."""
        room = int(megabytes * 1e6)

        def begin():
            LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
            if room:
                resource.setrlimit(resource.RLIMIT_AS, (room, room))
        try:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0,
                env={**os.environ, **THREADS}, preexec_fn=begin)
        except FileNotFoundError:
            raise Ended("not installed") from None
        self.text = b""
        os.set_blocking(self.process.stderr.fileno(), False)
        self._reply(60)

    def _processor_seconds(self):
        try:
            with open(f"/proc/{self.process.pid}/stat") as file:
                fields = file.read().rsplit(")", 1)[1].split()
            return (int(fields[11]) + int(fields[12])) / TICKS
        except OSError:
            return 0.0

    def _reply(self, limit):
        """The next line that is JSON, within `limit` seconds of processor, or thirty times as long by the clock. What the
        libraries print between is passed over."""
        begun, spent = time.monotonic(), self._processor_seconds()
        while not (line := self._next_line()).startswith(b"{"):
            if b"\n" in self.text:
                continue
            if select.select([self.process.stdout], [], [], 0.1)[0]:
                more = os.read(self.process.stdout.fileno(), 65536)
                if not more:
                    raise Ended(self._how_it_ended())
                self.text += more
            self._complaints()
            if self._processor_seconds() - spent > limit or time.monotonic() - begun > 30 * limit:
                self.close()
                raise Ended("timed out")
        return json.loads(line)

    def _next_line(self):
        """The first whole line of those that have come; empty where there is none or it is none of ours."""
        line, end, rest = self.text.partition(b"\n")
        if end:
            self.text = rest
        return line if end else b""

    def _complaints(self):
        """What it says on stderr, read so that it never waits for us."""
        try:
            return os.read(self.process.stderr.fileno(), 65536) or b""
        except (BlockingIOError, ValueError):
            return b""

    def _how_it_ended(self):
        said = self._complaints().decode(errors="replace").strip()
        code = self.process.wait()
        memory = any(word in said for word in ("bad_alloc", "emory", "Killed"))
        self.close()
        if memory:
            return "out of memory"
        return f"died of signal {-code}" if code < 0 else f"exit status {code}: {said[-80:]}".strip(": ")

    def ask(self, method, tolerance, file, limit):
        """Its reply, or Ended."""
        try:
            self.process.stdin.write(f"{method} {tolerance!r} {file}\n".encode())
        except BrokenPipeError:
            raise Ended(self._how_it_ended()) from None
        return self._reply(limit)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            pipe.close()
