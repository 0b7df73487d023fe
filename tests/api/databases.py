"""A PostgreSQL server of the package (tests/postgresql.sh) on a socket in a temporary folder, and databases there."""
import atexit
import functools
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import time

from service import PATIENT_S, Skip, check

SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "postgresql.sh"


def ask(address, statement):
    told = subprocess.run(["psql", "-X", "-q", "-A", "-t", "-F", "|", "-v", "ON_ERROR_STOP=1", "-d", address, "-c",
                           statement], capture_output=True, text=True, check=False)
    return told.returncode == 0, told.stdout + told.stderr


def rows(address, statement):
    good, told = ask(address, statement)
    check(good, statement, told)
    return [line.split("|") for line in told.splitlines()]


class Server:
    """settings: of the server, "name=value". It syncs nothing to the disk unless they say so."""

    def __init__(self, *settings):
        self.folder = tempfile.mkdtemp(prefix="test-postgresql-")
        self.settings = settings or ("fsync=off",)
        self.made = 0
        self.start()

    def start(self, port=5432):
        """port: as the settings say."""
        self.port = port
        os.chmod(self.folder, 0o711)
        with open(os.path.join(self.folder, "log"), "ab") as log:
            self.process = subprocess.Popen([SCRIPT, self.folder, *self.settings], stdout=log, stderr=log)
        end = time.monotonic() + PATIENT_S  # a machine that has much to do takes its time for initdb
        while self.process.poll() is None and time.monotonic() < end:
            if os.path.exists(os.path.join(self.folder, f".s.PGSQL.{port}")) and self.try_sql("postgres", "SELECT 1")[0]:
                return
            time.sleep(0.05)
        status = self.process.poll()
        with open(os.path.join(self.folder, "log"), encoding="utf-8", errors="replace") as log:
            told = log.read()
        self.end()
        if status == 77:
            raise Skip("no server of PostgreSQL (Debian: postgresql)")
        raise AssertionError(f"PostgreSQL did not start: {told}")

    def stop(self, number=signal.SIGQUIT):
        """SIGQUIT: at once, as after a power loss."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            self.process.wait(timeout=60)
        except subprocess.TimeoutExpired:  # still the script, to which a shell in the background has SIGQUIT ignored
            self.process.kill()
            self.process.wait()
            raise

    def end(self):
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def database(self):
        """The name of a new, empty one."""
        self.made += 1
        self.sql("postgres", f"CREATE DATABASE test{self.made} TEMPLATE template0")
        return f"test{self.made}"

    def address(self, database):
        return f"postgresql://postgres@/{database}?host={self.folder}" + (f"&port={self.port}" if self.port != 5432 else "")

    def try_sql(self, database, statement):
        """Did it go well, and what was printed."""
        return ask(self.address(database), statement)

    def sql(self, database, statement):
        """The rows, each a list of texts."""
        return rows(self.address(database), statement)

    def silent(self, database, statement):
        """A connection as of a daemon's that was stopped after this statement, in the midst of its transaction: no end of
        the pipeline follows."""
        def message(kind, *parts):
            body = b"".join(part if isinstance(part, bytes) else part.encode() + b"\0" for part in parts)
            return kind + struct.pack("!I", len(body) + 4) + body
        connection = socket.socket(socket.AF_UNIX)
        connection.connect(os.path.join(self.folder, f".s.PGSQL.{self.port}"))
        connection.sendall(message(b"", struct.pack("!I", 3 << 16), "user", "postgres", "database", database, "application_name",
                                   "uzawad", b"\0"))
        connection.sendall(message(b"P", "", statement, bytes(2)) + message(b"B", bytes(8)) + message(b"E", bytes(5)))
        return connection


@functools.cache
def shared():
    """A server that all tests of this program have, and that ends with it."""
    server = Server()
    atexit.register(server.end)
    return server


def address_of_new():
    """Of a new database of that server."""
    return shared().address(shared().database())
