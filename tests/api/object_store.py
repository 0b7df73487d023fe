"""A stand-in for an object store with the S3 interface: one bucket in memory, that looks at every signature and fails on
command. Source: Amazon S3 API Reference, "Authenticating Requests: Using the Authorization Header (AWS Signature
Version 4)"."""
import contextlib
import hashlib
import hmac
import http.server
import re
import socket
import threading
import time
import urllib.parse

KEY, SECRET, REGION, BUCKET = "AKIDEXAMPLE", "secret/with+signs", "eu-test-1", "results"
WHOLE = re.compile(r"AWS4-HMAC-SHA256 Credential=([^/]+)/(\d{8})/([^/]+)/s3/aws4_request, *SignedHeaders=([^,]+),"
                   r" *Signature=([0-9a-f]{64})")


def signature_of(request, date, region, signed):
    """What the one who has the secret would have signed."""
    path, _, query = request.path.partition("?")
    pairs = sorted(urllib.parse.parse_qsl(query, keep_blank_values=True))
    canonical = "\n".join([
        request.command, path, "&".join(f"{urllib.parse.quote(a, '')}={urllib.parse.quote(b, '')}" for a, b in pairs),
        *(f"{name}:{' '.join(request.headers[name].split())}" for name in signed), "", ";".join(signed),
        request.headers["x-amz-content-sha256"]])
    to_sign = "\n".join(["AWS4-HMAC-SHA256", request.headers["x-amz-date"], f"{date}/{region}/s3/aws4_request",
                         hashlib.sha256(canonical.encode()).hexdigest()])
    key = ("AWS4" + SECRET).encode()
    for word in (date, region, "s3", "aws4_request", to_sign):
        key = hmac.new(key, word.encode(), hashlib.sha256).digest()
    return key.hex()


def refusal(request, body):
    """The code of S3 for what is wrong with a request; None: nothing is."""
    found = WHOLE.fullmatch(request.headers.get("authorization", ""))
    if not found:
        return "AccessDenied"
    key, date, region, signed, signature = found.groups()
    if key != KEY:
        return "InvalidAccessKeyId"
    if region != REGION:
        return "AuthorizationHeaderMalformed"
    signed = signed.split(";")
    if not {"host", "x-amz-date", "x-amz-content-sha256"} <= set(signed) or not request.headers["x-amz-date"].startswith(date):
        return "AccessDenied"
    if not hmac.compare_digest(signature_of(request, date, region, signed), signature):
        return "SignatureDoesNotMatch"
    if hashlib.sha256(body).hexdigest() != request.headers["x-amz-content-sha256"]:
        return "XAmzContentSHA256Mismatch"
    return None


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def setup(self):
        super().setup()
        self.server.store.connections.add(self.connection)

    def finish(self):
        self.server.store.connections.discard(self.connection)
        super().finish()

    def answer(self, status, body=b"", length=None, **headers):
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)

    def refuse(self, status, code):
        self.answer(status, f"<?xml version='1.0'?><Error><Code>{code}</Code></Error>".encode())

    def serve(self):
        store = self.server.store
        body = self.rfile.read(int(self.headers.get("content-length", 0)))
        bucket, _, name = self.path.lstrip("/").partition("/")
        code = refusal(self, body)
        fault = store.fault if store.faults(self.command, name) else None
        with store.lock:
            store.seen.append((self.command, name, self.headers.get("range"), code))
        if fault == "slow":
            time.sleep(0.3)
        if fault == "cut":
            self.connection.shutdown(socket.SHUT_RDWR)
            self.close_connection = True
        elif fault == "500":
            self.refuse(500, "InternalError")
        elif code:
            self.refuse(403, code)
        elif bucket != BUCKET:
            self.refuse(404, "NoSuchBucket")
        else:
            getattr(self, f"serve_{self.command}")(name, body, fault)

    do_PUT = do_GET = do_DELETE = serve

    def serve_PUT(self, name, body, fault):
        self.server.store.objects[name] = body
        if fault == "hang":  # it is there, and nobody is told
            self.server.store.released.wait(60)
        self.answer(200)

    def serve_DELETE(self, name, _, __):
        self.server.store.objects.pop(name, None)
        self.answer(204)

    def serve_GET(self, name, _, fault):
        whole = self.server.store.objects.get(name)
        if whole is None:
            return self.refuse(404, "NoSuchKey")
        first, last = (int(word) for word in re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers["range"]).groups())
        if first >= len(whole):
            return self.refuse(416, "InvalidRange")
        part = whole[first:last + 1]
        if fault == "wrong":
            part = bytes([part[0] ^ 1]) + part[1:]
        if fault == "truncated":  # less than it says
            self.answer(206, part[:len(part) // 2], len(part))
            self.close_connection = True
            return None
        return self.answer(206, part, Content_Range=f"bytes {first}-{first + len(part) - 1}/{len(whole)}")

    def log_message(self, *_):
        pass


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, *_):
        """Who asked has gone."""


class ObjectStore:
    """objects: by name. seen: (method, name, range, why it was refused) of each request."""

    def __init__(self, port=0):
        self.objects, self.seen, self.lock, self.connections = {}, [], threading.Lock(), set()
        self.fault, self.methods, self.released = None, (), threading.Event()
        self.port = port
        self.start()

    def start(self):
        self.server = Server(("127.0.0.1", self.port), Handler)
        self.server.store, self.port = self, self.server.server_port
        threading.Thread(target=self.server.serve_forever, args=(0.05,), daemon=True).start()

    def stop(self):
        """With its connections."""
        self.server.shutdown()
        self.server.server_close()
        for one in list(self.connections):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)

    def url(self, bucket=BUCKET):
        return f"http://127.0.0.1:{self.port}/{bucket}"

    def faults(self, method, name):
        return self.fault and method in self.methods and not name.startswith("probe")

    @contextlib.contextmanager
    def failing(self, fault, *methods):
        """Meanwhile these requests end so: "500", "cut", "slow", "hang", "wrong", "truncated"."""
        self.methods, self.fault = methods or ("PUT", "GET", "DELETE"), fault
        try:
            yield
        finally:
            self.fault = None
            self.released.set()

    def count(self, method):
        return sum(1 for one in self.seen if one[0] == method and not one[1].startswith("probe"))
