"""Mutated requests at a running daemon: how many, how they were answered, and whether it is as well afterwards."""
import collections
import json
import os
import random
import re
import socket
import sqlite3
import threading
import time

import no_memory
import service
from mutations import Mutator

FINE = ("503", "507")  # full, or ending: said so by the daemon
STATUS = re.compile(rb"HTTP/1\.1 (\d{3}) ")
LIMITS = ("--log-level", "warn", "--max-client-rate", "0", "--max-dofs", "20000", "--max-nonzeros", "1M", "--memory", "64M",
          "--max-solve-s", "0.5", "--cache", "16M", "--uploads", "4M", "--max-wait-s", "1")


class Client:
    """A kept connection that is opened again when it was closed."""

    def __init__(self, host, port):
        self.where, self.connection = (host, port), None

    def close(self):
        if self.connection:
            self.connection.close()
        self.connection = None

    def exchange(self, message, alone):
        """The bytes of the reply; a kept connection that had ended is opened again. alone: on a connection of its own that
        ends with the message, as its length may lie."""
        kept = self.connection and not alone
        try:
            return self._exchange(message, alone)
        except ConnectionError:
            if not kept:
                raise
            self.close()
            return self._exchange(message, alone)

    def _exchange(self, message, alone):
        if alone or not self.connection:
            self.close()
            self.connection = socket.create_connection(self.where, timeout=30)
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self.connection.sendall(message)
        except (BrokenPipeError, ConnectionResetError):
            return self._early_reply()
        if alone:
            self.connection.shutdown(socket.SHUT_WR)
            reply, _ = service.read_all(self.connection)
            self.close()
            return reply
        return self._one_reply()

    def _early_reply(self):
        """Of a daemon that refused a body for its length and did not wait for all of it."""
        reply, _ = service.read_all(self.connection)
        self.close()
        if not reply:
            raise ConnectionResetError("no reply")
        return reply

    def _one_reply(self):
        data = b""
        while b"\r\n\r\n" not in data:
            piece = self.connection.recv(65536)
            if not piece:
                raise ConnectionResetError("no reply")
            data += piece
        head, _, body = data.partition(b"\r\n\r\n")
        size = re.search(rb"(?i)\r\ncontent-length: *(\d+)", head)
        chunked = re.search(rb"(?i)\r\ntransfer-encoding: *chunked", head)
        while (len(body) < int(size.group(1)) if size else chunked and not body.endswith(b"0\r\n\r\n")):
            piece = self.connection.recv(65536)
            if not piece:
                break
            body += piece
        if re.search(rb"(?i)\r\nconnection: *close", head) or not (size or chunked):
            self.close()
        return head + b"\r\n\r\n" + body


def message_of(target, fields, body):
    lines = [f"{'GET' if body is None else 'POST'} {target} HTTP/1.1"]
    given = {"Host": "x", **({} if body is None else {"Content-Length": str(len(body))}), **fields}
    lines += [f"{name}: {value}" for name, value in given.items()]
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + (body or b"")


def _send(s, mutator, lock, chance, deal, seen, wrong):
    client = Client(s.host, s.port)
    while True:
        with lock:
            if deal["left"] <= 0:
                break
            deal["left"] -= 1
            kind, target, fields, body = mutator.mutant(chance)
        message = message_of(target, fields, body)
        try:
            reply = client.exchange(message, kind in ("fields", "read"))
            statuses = [one.decode() for one in STATUS.findall(reply)]
        except OSError as why:
            client.close()
            statuses, reply = ["none"], repr(why).encode()
        bad = [one for one in statuses if one == "none" or (one[0] == "5" and one not in FINE)]
        with lock:
            deal["sent"] += 1
            seen.update(f"{(one + 'xx' if one == 'none' else one[0] + 'xx')}" for one in statuses)
            if bad:
                wrong.append((kind, message[:3000], reply[:600]))
    client.close()


def resident(s):
    """Megabytes of its own that the daemon holds."""
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("RssAnon")) / 1024


def _drain(s, seconds=120):
    """True once no job waits or runs."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        jobs = s.get("/healthz").json["jobs"]
        if jobs["accepted"] == jobs["running"] == 0:
            return True
        time.sleep(0.05)
    return False


def _inner_failures(s):
    """Jobs that ended by a fault that is the daemon's own."""
    connection = sqlite3.connect(s.db)
    try:
        errors = [json.loads(row[0]) for row in connection.execute("SELECT error FROM job WHERE error IS NOT NULL")]
        return [one for one in errors if one["code"] in ("internal", "out_of_memory")]
    finally:
        connection.close()


def malformed(build, count, seed=1, clients=4, report=None):
    """Sends so many mutants; errors: replies that are 5xx but 503 and 507, or none; jobs that ended as "internal"."""
    s = service.Service(build, *LIMITS)
    seen, wrong, figures = collections.Counter(), [], {"mutants": 0}
    memory, blocks = [], []
    counts = no_memory.possible(build) is None
    heap = no_memory.Heap(os.path.join(s.folder, "heap"))
    s.environment = no_memory.environment(build, s) if counts else {}
    try:
        s.start()
        mutator = Mutator(s.solve(service.MATRICES)["id"])
        lock, chance = threading.Lock(), random.Random(seed)
        for part in (count // 4,) * 3 + (count - 3 * (count // 4),):
            deal = {"left": part, "sent": 0}
            threads = [threading.Thread(target=_send, args=(s, mutator, lock, chance, deal, seen, wrong)) for _ in range(clients)]
            for one in threads:
                one.start()
            for one in threads:
                one.join()
            figures["stuck"] = int(not _drain(s))
            memory.append(round(resident(s), 1))
            blocks.append(heap[no_memory.HELD])
            figures["mutants"] += deal["sent"]
        inner = _inner_failures(s)
        wrong += [("job", b"", json.dumps(one).encode()) for one in inner]
        right = s.solve(service.MATRICES)  # it still solves
        figures["errors"] = len(wrong) + (right["summary"]["outcome"] != "converged") + (figures["mutants"] != count)
        if counts:  # what is cached and kept differs; what were lost once in a few requests would show
            figures |= {"leaked": int(blocks[-1] - blocks[1] > 2000 + count // 50), "blocks": "/".join(map(str, blocks))}
        figures |= {"memory_mb": "/".join(map(str, memory)), **dict(sorted(seen.items()))}
        figures["wrong_exit"] = s.end()
        for one in wrong if report is None else ():
            print("#", *one, sep="\n#   ")
        if report is not None:
            report += wrong
        return figures
    finally:
        s.stop()
