"""Pages of other origins: what they can have their visitor's browser send. usage: test_origins.py BUILD_DIR [FILTER]"""
import contextlib
import http.server
import json
import threading

import browser
from browser import check
from service import MATRICES

# Everything that a browser sends without asking the service first, and what it would send if the service let it.
TRY = """const [url, body, done] = arguments;
const urls = {job: url + '/v1/jobs', upload: url + '/v1/uploads', check: url + '/v1/admin/check', verify: url + '/v1/verify'};
(async () => {
  const answered = [];
  for (const [what, at] of Object.entries(urls))
    for (const init of [{body, headers: {'Content-Type': 'text/plain'}}, {body: new Blob([body])}, {body: new URLSearchParams({a: body})},
                        {}, {body, mode: 'cors', headers: {'Content-Type': 'application/json'}}])
      try { answered.push(what + ' ' + (await fetch(at, {method: 'POST', mode: 'no-cors', credentials: 'include', ...init})).type); }
      catch (error) { answered.push(what + ' refused'); }
  navigator.sendBeacon(urls.job, new Blob([body], {type: 'text/plain'}));
  const frame = document.body.appendChild(Object.assign(document.createElement('iframe'), {name: 'away'}));
  const form = Object.assign(document.createElement('form'), {method: 'post', action: urls.job, target: 'away', enctype: 'text/plain'});
  form.append(Object.assign(document.createElement('input'), {name: '{"x": "', value: '"}'}));
  document.body.append(form);
  frame.onload = () => done(answered);
  form.submit();
})();"""


@contextlib.contextmanager
def other_server():
    """A server of its own that has one empty page; its port."""
    class Page(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><link rel=icon href=data:,><title>another page</title><body>")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def test_pages_from_another_port_and_another_name(s, b):
    with other_server() as port:
        for page in (f"http://127.0.0.1:{port}", f"http://localhost:{port}", f"http://page.example:{port}"):
            for url in (s.url, s.url.replace("127.0.0.1", "localhost"), s.url.replace("127.0.0.1", "solver.example")):
                b.driver.get(page)
                answered = b.driver.execute_async_script(TRY, url, json.dumps(MATRICES))
                check(not any("cors" in one or "basic" in one for one in answered), page, url, answered)
                b.console()
    check(s.get("/v1/jobs").json["jobs"] == [], "a page got a job in")
    s.end()
    posts = [one for one in s.events("request") if one["method"] == "POST"]
    check(len(posts) >= 9 * 16 and {one["status"] for one in posts} <= {403, 415, 421}, [(one["path"], one["status"]) for one in posts])


if __name__ == "__main__":
    browser.main(globals())
