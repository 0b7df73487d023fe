"""Requests that nobody should send, made from those that are right: what is sent follows from the seed alone.

mutant(chance) is (how it came about, target, header fields, body). Malformed JSON, Matrix Market and Gmsh files that
others collected are among the bodies where ../shared/cases is there.
"""
import copy
import gzip
import itertools
import json
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DATA = ROOT / "tests/data"
CASES = ROOT.parent / "shared/cases"

JSON = "application/json"
MOST_PLACES = 300000  # of a document
# Raw tokens stand for what json.dumps would not write: they are replaced in the text.
RAW = {"@huge": "1e999", "@nan": "NaN", "@long": "9" * 400, "@tiny": "1e-400", "@minus": "-0", "@hex": "0x10",
       "@lone": '"\\ud800"', "@nul": '"a\\u0000b"', "@dots": "1.", "@comma": "[1,]", "@open": "[", "@empty": ""}
VALUES = [None, True, False, "", "x", "all", "left", [], {}, [[]], [{}], [0], [None], -1, 0, 1, 2, 0.5, -0.0, 1e-300, 5e-324, 1e300,
          1.7976931348623157e308, -1.7976931348623157e308, 2**31 - 1, 2**31, 2**32, 2**53 + 1, 2**63 - 1, 2**63, -2**63,
          10**30, 1e-9, 10**6, "é" * 70, "\u0000", "../../etc/passwd", "0" * 32, {"upload": "0" * 64}, {"on": "all"}, *RAW]
KEYS = ["", "x", "problem", "kind", "K", "on", "mesh", "solver", "cases", "__proto__", "a/b~c", "é", "name", "gmsh", "nodes"]
WORDS = [b"0", b"-1", b"1", b"2147483648", b"9223372036854775807", b"99999999999999999999", b"1e999", b"nan", b"inf",
         b"-", b".", b"1e", b"0x1p3", b"%", b"$End", b"\n", b"\r", b"\t", b"\0", b"\xff\xfe", b"\xc0\xaf", b"\xed\xa0\x80",
         b"\xef\xbb\xbf", b"[", b"{", b'"', b",", b":", b"\\", b"\\u", b"1" * 300, b"complex", b"pattern", b"skew-symmetric"]
FIELDS = [("Content-Type", ["", "text/plain", "application/json; charset=utf-16", "application/json;" + "x" * 500, "é"]),
          ("Content-Encoding", ["gzip", "br", "identity", "gzip, gzip", ""]),
          ("Accept", ["*/*", "", "text/html", "application/json;q=nan", "a/b;" * 200, ";;;,,,"]),
          ("Accept-Encoding", ["gzip;q=1e9", "*;q=0", ",", "gzip" * 99]),
          ("Prefer", ["wait=0", "wait=-1", "wait=1e99", "wait=", "wait=0, wait=0", "respond-async", "=" * 300]),
          ("Idempotency-Key", ["", "k", "k" * 255, "k" * 5000, "\x7f"]), ("If-None-Match", ["*", '"', 'W/"x"', '"a",' * 300]),
          ("Range", ["bytes=0-", "bytes=-1", "bytes=9-1", "bytes=0-0,1-1", "bytes=" + "9" * 40 + "-", "lines=1"]),
          ("Last-Event-ID", ["-1", "9" * 40, "x"]), ("Authorization", ["Bearer", "Basic !!", "Bearer " + "x" * 3000]),
          ("Origin", ["null", "http://" + "a" * 300]), ("X-Request-Id", ["", "a b", "x" * 2000]),
          ("Expect", ["100-continue", "200-ok"]), ("Host", ["", "a b", "[::1", "x" * 300]), ("Connection", ["close", "x,,y"]),
          ("Content-Length", ["-1", "1e3", "0", "5", "99999999999999999999"]), ("Transfer-Encoding", ["chunked", "gzip", "x"])]
QUERIES = ["?validate=true", "?validate=", "?validate=yes", "?x=1", "?%", "?%zz=1", "?" + "a" * 900, "?&&==", "?limit=-1",
           "?fields=x", "?case=%00", "?case=é", "?limit=99999999999999999999&status=x", "?part=1&of=0", "?width=1e999"]
READS = ["/v1/jobs", "/v1/jobs/{job}", "/v1/jobs/{job}/result", "/v1/jobs/{job}/result.vtu", "/v1/jobs/{job}/deformed.svg",
         "/v1/jobs/{job}/history", "/v1/jobs/{job}/history.csv", "/v1/factors", "/v1/limits", "/openapi.json", "/schemas/x",
         "/v1/uploads/" + "0" * 64, "/", "/v1/../v1/jobs", "//", "/v1/jobs/%00", "/v1/jobs/" + "f" * 32]


def _read(folder, pattern="*", most=40000):
    if not folder.is_dir():
        return []
    return [path.read_bytes() for path in sorted(folder.rglob(pattern)) if path.is_file() and path.stat().st_size <= most]


class Mutator:
    """What the mutants are made of; job names one that ended, for the routes of a job."""

    def __init__(self, job):
        right = json.loads((DATA / "requests.json").read_text())
        self.requests = [one["body"] for one in right if one["valid"] and len(json.dumps(one["body"])) < 5000]
        self.requests += [json.loads((DATA / name).read_text()) for name in ("gmsh_scene.json", "mesh_scene.json")]
        verify = json.loads((DATA / "verify.json").read_text())
        self.posts = {"/v1/jobs": self.requests, "/v1/jobs?validate=true": self.requests,
                      "/v1/verify": [verify] + [{"problem": one["problem"], "answer": {"displacements": [0.5, 2], "reactions": [-1]}}
                                                for one in self.requests],
                      f"/v1/jobs/{job}/refine": [{"accuracy": {"relative_error": 1e-9}}, {"accuracy": "exact", "max_iterations": 9},
                                                 {"accuracy": "precise", "time_limit_s": 1}]}
        self.texts = _read(DATA / "mm") + _read(CASES / "mm_edge")
        self.meshes = _read(DATA / "meshes", "*.msh") + _read(CASES / "meshes", "*.msh")
        self.meshes.append(self.requests[-2]["problem"]["mesh"]["gmsh"].encode())
        self.collected = _read(CASES / "json", "*.json", 200000)
        self.job, self.turn = job, 0
        self.kinds = [self.document, self.bytes_of_document, self.matrices, self.mesh, self.upload, self.fields, self.read]

    def mutant(self, chance):
        """The collected files come first, each once; then a kind by chance."""
        self.turn += 1
        if self.turn <= len(self.collected):
            return "collected", chance.choice(list(self.posts)), {"Content-Type": JSON}, self.collected[self.turn - 1]
        return chance.choice(self.kinds)(chance)

    # ---- JSON

    def document(self, chance):
        target = chance.choice(list(self.posts))
        body = copy.deepcopy(chance.choice(self.posts[target]))
        for _ in range(chance.choice((1, 1, 1, 2, 5))):
            body = self._changed(body, chance)
            if next(itertools.islice(_places(body), MOST_PLACES, None), None):  # lists of lists, each some thousand times
                return self.document(chance)
        text = json.dumps(body, ensure_ascii=chance.random() < 0.5)
        for name, raw in RAW.items():
            text = text.replace(f'"{name}"', raw)
        return "document", target, {"Content-Type": JSON}, text.encode("utf-8", "surrogatepass")

    def _changed(self, body, chance):
        """One node is replaced, taken away, added to, repeated, wrapped or exchanged for one of another request."""
        places = list(_places(body))
        if not places:
            return body
        owner, key = chance.choice(places)
        action = chance.randrange(8)
        if action == 0:
            del owner[key]
        elif action == 1 and isinstance(owner, dict):
            owner[chance.choice(KEYS)] = copy.deepcopy(owner[key])
        elif action == 2 and isinstance(owner, list):
            owner[:] = (owner * chance.choice((2, 3, 1000)))[:2000]
        elif action == 3:
            owner[key] = _nested(chance.choice((1, 63, 64, 300)), owner[key])
        elif action == 4:
            other, at = chance.choice(list(_places(chance.choice(self.requests))))
            owner[key] = copy.deepcopy(other[at])
        elif action == 5 and isinstance(owner[key], (int, float)) and not isinstance(owner[key], bool):
            owner[key] = owner[key] * chance.choice((-1, 1e3, 1e-3, 1e150, 1e-150))
        else:
            owner[key] = copy.deepcopy(chance.choice(VALUES))
        return body

    def bytes_of_document(self, chance):
        target = chance.choice(list(self.posts))
        text = json.dumps(chance.choice(self.posts[target])).encode()
        return "bytes", target, {"Content-Type": JSON}, damaged(text, chance)

    # ---- texts within JSON, and uploads

    def matrices(self, chance):
        body = {"problem": {"kind": "matrices", "K": "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2\n2 2 1\n",
                            "N": "%%MatrixMarket matrix coordinate real general\n1 2 1\n1 1 1\n", "h": [0.5], "p": [2, 2]}}
        name = chance.choice("KKNhp")
        given = body["problem"][name]
        text = given.encode() if isinstance(given, str) and chance.random() < 0.5 else chance.choice(self.texts)
        body["problem"][name] = damaged(text, chance).decode("utf-8", "replace")
        return "matrices", chance.choice(("/v1/jobs", "/v1/jobs?validate=true")), {"Content-Type": JSON}, json.dumps(body).encode()

    def mesh(self, chance):
        body = copy.deepcopy(self.requests[-2])
        body["problem"]["mesh"]["gmsh"] = damaged(chance.choice(self.meshes[-1:] * 3 + self.meshes), chance).decode("utf-8", "replace")
        return "mesh", chance.choice(("/v1/jobs", "/v1/jobs?validate=true")), {"Content-Type": JSON}, json.dumps(body).encode()

    def upload(self, chance):
        body, fields = damaged(chance.choice(self.texts), chance), {"Content-Type": "application/octet-stream"}
        if chance.random() < 0.5:
            body, fields["Content-Encoding"] = damaged(gzip.compress(body, 1), chance), "gzip"
        return "upload", "/v1/uploads", fields, body

    # ---- heads

    def fields(self, chance):
        fields = {"Content-Type": JSON}
        for name, values in chance.sample(FIELDS, chance.choice((1, 1, 2, 4))):
            fields[name] = chance.choice(values)
        body = json.dumps(chance.choice(self.requests)).encode()
        return "fields", "/v1/jobs" + chance.choice(QUERIES), fields, body

    def read(self, chance):
        target = chance.choice(READS).replace("{job}", self.job) + chance.choice([""] + QUERIES)
        name, values = chance.choice(FIELDS[2:12])
        return "read", target, {name: chance.choice(values)}, None


def _places(node, depth=50):
    """(owner, key) of every node below this one, as deep as that."""
    for key, child in list(node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()):
        yield node, key
        if depth > 0:
            yield from _places(child, depth - 1)


def _nested(depth, value):
    for _ in range(depth):
        value = [value]
    return value


def damaged(text, chance):
    """Cut, with bytes exchanged, flipped, words in the wrong place or parts twice."""
    text = bytearray(text)
    for _ in range(chance.choice((1, 1, 2, 4))):
        size = max(1, len(text))
        at, to = sorted((chance.randrange(size), chance.randrange(size)))
        action = chance.randrange(7)
        if action == 0:
            del text[at:]
        elif action == 1:
            del text[at:min(to, at + 40)]
        elif action == 2 and len(text) > to:
            text[at], text[to] = text[to], text[at]
        elif action == 3 and len(text) > at:
            text[at] ^= 1 << chance.randrange(8)
        elif action == 4:
            text[at:at] = text[at:min(to, at + 200)] * chance.choice((1, 2, 20))
        else:
            text[at:at + chance.randrange(4)] = chance.choice(WORDS)
    return bytes(text)
