"""A server whose every answer is scripted: for faults that a healthy daemon does not have."""
import http.server
import json
import socket
import threading
import time


class Request:
    def __init__(self, handler, body):
        self.method, self.path, self.headers, self.body = handler.command, handler.path, handler.headers, body
        self.time = time.monotonic()


class Fake:
    """Answers the n-th request with the n-th step of the script, and all later ones with the last step.

    A step is (status, body[, headers]) with a str or JSON value as body, "drop" (close without a word), "cut" (promise
    more than is sent), a number of seconds of silence, or bytes: all that is sent before the connection is closed."""

    def __init__(self, *script):
        self.script, self.requests, self.lock = script, [], threading.Lock()
        self.stopping = threading.Event()
        fake = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def answer(self):
                length = int(self.headers.get("Content-Length") or 0)
                body = self.rfile.read(length)
                with fake.lock:
                    step = fake.script[min(len(fake.requests), len(fake.script) - 1)]
                    fake.requests.append(Request(self, body))
                fake.play(self, step)

            do_GET = do_POST = do_DELETE = answer

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.url = "http://127.0.0.1:%d" % self.server.server_address[1]
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.02,))
        self.thread.start()

    def play(self, handler, step):
        if step == "drop" or step == "cut":
            if step == "cut":
                handler.wfile.write(b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n{\"id\"")
            handler.close_connection = True
            return
        if isinstance(step, bytes):
            handler.wfile.write(step)
            handler.close_connection = True
            return
        if isinstance(step, (int, float)):
            self.stopping.wait(step)
            handler.close_connection = True
            return
        status, body, headers = step if len(step) == 3 else (*step, {})
        data = (body if isinstance(body, str) else json.dumps(body)).encode()
        handler.send_response(status)
        for name, value in headers.items():
            handler.send_header(name, value)
        if status != 204:
            handler.send_header("Content-Length", str(len(data)))
        handler.end_headers()
        handler.wfile.write(data)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stopping.set()
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()


class Cutter:
    """Stands between a client and a server. The first connection breaks off after `count` bytes of the reply, the later ones
    are left alone."""

    def __init__(self, address, count):
        self.address, self.count, self.connections = address, count, 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.url = "http://127.0.0.1:%d" % self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            self.connections += 1
            with client, socket.create_connection(self.address) as server:
                self.carry(client, server, self.count if self.connections == 1 else None)

    @staticmethod
    def carry(client, server, count):
        def request():
            try:
                while data := client.recv(65536):
                    server.sendall(data)
                server.shutdown(socket.SHUT_WR)
            except OSError:
                pass

        forward = threading.Thread(target=request)
        forward.start()
        left = count
        try:
            while left != 0 and (data := server.recv(65536)):
                client.sendall(data if left is None else data[:left])
                left = None if left is None else max(0, left - len(data))
            if left == 0 and count == 0:
                server.recv(1)  # the server has answered: the job is there
            client.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        forward.join()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.thread.join()
