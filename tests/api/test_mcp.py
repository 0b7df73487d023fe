"""The service as tools of a language model: uzawa mcp. usage: test_mcp.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import base64
import json
import pathlib
import subprocess
import sys

import service
from service import SCENE, check, options

CLIENT = str(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build").resolve() / "uzawa")


class Model:
    """A program that starts the server and says one message a line."""

    def __init__(self, url):
        self.process = subprocess.Popen([CLIENT, "--server", url, "--retry", "0", "mcp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.number = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        rest = self.process.stdout.read()
        check(self.process.wait(timeout=60) == 0 and rest == "", rest)

    def say(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def hear(self):
        return json.loads(self.process.stdout.readline())

    def ask(self, method, **params):
        self.number += 1
        self.say(json.dumps({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params}))
        reply = self.hear()
        check(reply["jsonrpc"] == "2.0" and reply["id"] == self.number, reply)
        return reply

    def call(self, name, error=False, **arguments):
        result = self.ask("tools/call", name=name, arguments=arguments)["result"]
        check(result["isError"] == error and len(result["content"]) == 1, result)
        return result["content"][0], result.get("structuredContent")


def test_from_the_first_word_to_the_picture(s):
    with Model(s.url) as model:
        told = model.ask("initialize", protocolVersion="2025-06-18", capabilities={}, clientInfo={"name": "test", "version": "1"})["result"]
        check(told["protocolVersion"] == "2025-06-18" and "tools" in told["capabilities"] and told["serverInfo"]["name"] == "uzawa", told)
        model.say('{"jsonrpc": "2.0", "method": "notifications/initialized"}')
        tools = {tool["name"]: tool for tool in model.ask("tools/list")["result"]["tools"]}
        check(set(tools) == {"submit_job", "validate_request", "wait_for_job", "get_result", "get_picture"}, set(tools))
        check(tools["submit_job"]["inputSchema"] == s.get("/schemas/request.json").json, "the service's own schema")
        check(all(tool["inputSchema"]["type"] == "object" and len(tool["description"]) > 30 for tool in tools.values()), tools)

        expected = model.call("validate_request", **SCENE)[1]
        check(expected["valid"] and expected["predicted"]["d"] > 0, expected)
        text, job = model.call("submit_job", **SCENE)
        check(json.loads(text["text"]) == job and job["summary"]["outcome"] == "converged", job)
        check(model.call("wait_for_job", id=job["id"], timeout_s=5)[1]["status"] == "successful")
        found = model.call("get_result", id=job["id"], fields="pressure,nodes")[1]
        check(max(found["pressure"]) == job["summary"]["contact"]["max_pressure"], found)
        picture = model.call("get_picture", id=job["id"], colour="pressure")[0]
        start = {"image/png": b"\x89PNG", "image/svg+xml": b"<"}[picture["mimeType"]]
        check(picture["type"] == "image" and base64.b64decode(picture["data"]).startswith(start), picture["mimeType"])


def test_what_is_wrong_is_told(s):
    with Model(s.url) as model:
        check(model.ask("initialize", protocolVersion="1999-01-01")["result"]["protocolVersion"] == "2025-06-18", "the newest")
        check(model.ask("ping")["result"] == {}, "ping")
        refused = json.loads(model.call("submit_job", error=True, problem={"kind": "scene"})[0]["text"])
        check(refused["code"] == "missing_key" and refused["pointer"] == "/problem", refused)
        check("not_found" in model.call("get_picture", error=True, id="0" * 32)[0]["text"])
        check(model.ask("tools/call", name="make_tea", arguments={})["error"]["code"] == -32602)
        check(model.ask("tools/call", name="submit_job", arguments=[])["error"]["code"] == -32602)
        check(model.ask("resources/list")["error"]["code"] == -32601)
        for line, code in (("no JSON", -32700), ("[]", -32600), ('{"id": 7}', -32600)):
            model.say(line)
            check(model.hear()["error"]["code"] == code, line)
        model.say("")
        model.say('{"jsonrpc": "2.0", "id": 5, "result": {}}')  # an answer to nothing
        check(model.ask("ping")["result"] == {}, "it goes on")


@options(None)
def test_without_a_service(_):
    with Model("http://127.0.0.1:1") as model:
        tools = model.ask("tools/list")["result"]["tools"]
        check(tools[0]["inputSchema"] == {"type": "object"}, tools[0])
        check("127.0.0.1" in model.call("submit_job", error=True, **SCENE)[0]["text"])


service.main(globals())
