"""Very many event streams and long polls at one daemon: what they cost while nothing happens, how soon each is told, and
what is left for those who submit beside them."""
import datetime
import os
import resource
import selectors
import socket
import threading
import time

import scenarios
import service

TOLD = b'"status":"successful"'


class Crowd:
    """Connections that each sent one request and wait for TOLD; `told` is when each read it, by time.time()."""

    def __init__(self, s, count, path, fields=""):
        request = f"GET {path} HTTP/1.1\r\nHost: x\r\n{fields}\r\n".encode()
        self.selector, self.open, self.told, self.broken, self.bytes = selectors.DefaultSelector(), [], [], 0, 0
        self.count = count
        for _ in range(count):
            one = socket.create_connection((s.host, s.port), timeout=30)
            one.sendall(request)
            one.setblocking(False)
            self.open.append(one)
            self.selector.register(one, selectors.EVENT_READ, bytearray())

    def read(self, seconds, until=lambda self: False):
        """Reads what comes for so long, or until that holds."""
        end = time.monotonic() + seconds
        while not until(self) and time.monotonic() < end:
            for key, _ in self.selector.select(min(0.1, max(0, end - time.monotonic()))):
                self._take(key)
        return self

    def _take(self, key):
        try:
            data = key.fileobj.recv(65536)
        except OSError:
            data = b""
        self.bytes += len(data)
        key.data.extend(data)
        if TOLD in key.data:
            self.told.append(time.time())
        elif not data:
            self.broken += 1
        if TOLD in key.data or not data:
            self.selector.unregister(key.fileobj)

    def close(self):
        for one in self.open:
            one.close()
        self.selector.close()


def all_told(crowd):
    return len(crowd.told) + crowd.broken == crowd.count


def first_words(crowd):
    return all(len(key.data) > 0 for key in crowd.selector.get_map().values())


def settle(crowd):
    """The rest of the first words: until nothing more comes."""
    had = -1
    while had < crowd.bytes:
        had = crowd.bytes
        crowd.read(0.3)


def memory_mb(s):
    with open(f"/proc/{s.process.pid}/status", encoding="ascii") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024


def threads_seconds(s):
    """Processor seconds of all threads but the one that solves, which has most, and how many threads there are."""
    ticks = []
    for thread in os.listdir(f"/proc/{s.process.pid}/task"):
        try:
            with open(f"/proc/{s.process.pid}/task/{thread}/stat", encoding="ascii") as file:
                fields = file.read().rpartition(")")[2].split()
            ticks.append(int(fields[11]) + int(fields[12]))
        except OSError:
            pass  # it ended
    return (sum(ticks) - max(ticks)) / os.sysconf("SC_CLK_TCK"), len(ticks)


def delays_ms(crowd, finished):
    waits = [1e3 * (told - finished) for told in crowd.told]
    return {"first": round(min(waits), 1), "p50": round(scenarios.quantile(waits, 0.5), 1),
            "p99": round(scenarios.quantile(waits, 0.99), 1)} if waits else {}


def seconds_of(text):
    """A time of a reply, "...T12:00:00.123Z", as time.time() counts."""
    return datetime.datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp()


def crowds(build, streams=2000, polls=1000, idle_s=10, load_s=5):
    """errors: connections that were not told of the end of the job that they follow."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, max(soft, 2 * (streams + polls) + 500)), hard))
    s = service.Service(build, "--workers", "1", "--max-connections", str(streams + polls + 200), "--max-streams",
                        str(streams + 10), "--log-level", "warn", "--max-client-rate", "0")
    s.environment = {"OPENBLAS_NUM_THREADS": "1"}  # its threads would spin beside the one job that runs all the time
    held, figures = [], {"streams": streams, "polls": polls}
    try:
        s.start()
        first = s.post(service.ENDLESS).json["id"]
        s.wait_status(first, "running")
        followed = s.post({**service.MATRICES, "priority": 10}).json["id"]
        body = os.path.join(s.folder, "small.json")
        with open(body, "wb") as file:
            file.write(scenarios.BODY)
        alone = scenarios.load(build, s.port, 16, load_s, body, "wait=0") if load_s else None
        before = memory_mb(s)
        crowd = Crowd(s, streams, f"/v1/jobs/{followed}/events")
        held.append(crowd.read(30, first_words))
        settle(crowd)
        figures["mb"] = round(memory_mb(s) - before, 1)
        figures["kb_each"] = round(1024 * figures["mb"] / streams, 1)
        begun, silent = threads_seconds(s)[0], crowd.bytes
        crowd.read(idle_s)
        figures["idle_cpu_percent"] = round(100 * (threads_seconds(s)[0] - begun) / idle_s, 2)
        figures["threads"] = threads_seconds(s)[1]
        figures["idle_bytes"] = crowd.bytes - silent
        if load_s:
            beside = scenarios.load(build, s.port, 16, load_s, body, "wait=0")
            figures |= {"alone_per_s": round(alone["per_s"]), "beside_per_s": round(beside["per_s"])}
        before = memory_mb(s)
        waiting = Crowd(s, polls, f"/v1/jobs/{followed}", "Prefer: wait=60\r\n")
        held.append(waiting)
        waiting.read(4)  # a long poll gives up its thread after a second
        figures["poll_kb_each"] = round(1024 * (memory_mb(s) - before) / polls, 1)
        figures["threads_waiting"] = threads_seconds(s)[1]
        reader = threading.Thread(target=waiting.read, args=(60, all_told))
        reader.start()
        s.request("DELETE", f"/v1/jobs/{first}")
        crowd.read(60, all_told)
        reader.join()
        finished = seconds_of(s.get(f"/v1/jobs/{followed}").json["finished"])
        figures["event_ms"], figures["poll_ms"] = delays_ms(crowd, finished), delays_ms(waiting, finished)
        figures["errors"] = streams + polls - len(crowd.told) - len(waiting.told)
        return figures
    finally:
        for crowd in held:
            crowd.close()
        s.stop()
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
