"""A program on a pseudo-terminal, and what a person would see there."""
import fcntl
import os
import pty
import select
import signal
import struct
import termios
import time

from service import PATIENT_S


class Screen:
    """Plays what a program writes: printable text, \\r, \\n, \\b, ESC [K and colours. `lines` is what is on the screen, `shown`
    every state that the last line was in, `widest` the most characters that ever stood in a line."""

    def __init__(self):
        self.lines, self.column, self.shown, self.widest = [""], 0, [], 0
        self.colours = 0
        self.rest = ""

    def feed(self, text):
        text = self.rest + text
        self.rest = ""
        at = 0
        while at < len(text):
            if text[at] == "\033":
                end = at + 2
                while end < len(text) and not text[end].isalpha():
                    end += 1
                if end >= len(text):
                    self.rest = text[at:]
                    return
                self.control(text[at + 2:end + 1])
                at = end + 1
                continue
            self.put(text[at])
            at += 1

    def control(self, sequence):
        if sequence == "K":
            self.lines[-1] = self.lines[-1][:self.column]
        elif sequence.endswith("m"):
            self.colours += 1
        else:
            raise AssertionError(f"an unexpected control sequence: {sequence!r}")

    def put(self, character):
        if character == "\r":
            self.note()
            self.column = 0
        elif character == "\n":
            self.note()
            self.lines.append("")
            self.column = 0
        elif character >= " ":
            line = self.lines[-1].ljust(self.column)
            self.lines[-1] = line[:self.column] + character + line[self.column + 1:]
            self.column += 1
            self.widest = max(self.widest, len(self.lines[-1]))
        else:
            raise AssertionError(f"an unexpected control character: {character!r}")

    def note(self):
        if self.lines[-1] and (not self.shown or self.shown[-1] != self.lines[-1]):
            self.shown.append(self.lines[-1])

    @property
    def text(self):
        return "\n".join(self.lines)


class Terminal:
    """Runs a command with the pseudo-terminal as all three standard streams and as its controlling terminal."""

    def __init__(self, command, columns=80, environment=None):
        self.screen, self.bytes, self.status = Screen(), b"", None
        self.start = time.monotonic()
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            try:
                # The size must be right before the program looks at it.
                fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
                os.execve(command[0], command, {**os.environ, "TERM": "xterm", **(environment or {})})
            finally:
                os._exit(126)

    def resize(self, columns):
        """As a window does: the kernel tells the program with SIGWINCH."""
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))

    def type(self, text):
        os.write(self.fd, text.encode())

    def read(self, seconds):
        """What comes within that time goes to the screen. False: the program has closed the terminal."""
        if not select.select([self.fd], [], [], seconds)[0]:
            return True
        try:
            data = os.read(self.fd, 65536)
        except OSError:  # EIO: nobody has the other side
            data = b""
        self.bytes += data
        self.screen.feed(data.decode("utf-8", "replace"))
        return bool(data)

    def until(self, condition, seconds=PATIENT_S):
        """Reads until condition(screen) holds."""
        end = time.monotonic() + seconds
        while not condition(self.screen):
            if time.monotonic() > end or not self.read(0.1):
                raise AssertionError(f"it was never seen; the screen has:\n{self.screen.text}\nbefore: {self.screen.shown}")

    def end(self, seconds=PATIENT_S):
        """Reads to the end and returns the exit status."""
        end = time.monotonic() + seconds
        while self.read(0.1):
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
                raise AssertionError(f"it did not end; the screen has:\n{self.screen.text}")
        if self.status is None:
            self.status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
            os.close(self.fd)
        return self.status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.status is None:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
            os.close(self.fd)
