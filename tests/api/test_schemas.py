"""The schema files against another implementation of JSON Schema: usage: test_schemas.py BUILD_DIR [FILTER].

Each schema is itself valid, its examples are, references resolve, and the requests that the C checker takes or refuses
(tests/data/requests.json, also read by tests/unit/server/codec/test_schema.c) are taken or refused here too.
"""
# not under ThreadSanitizer: about answers, not about threads
import json
import pathlib
import subprocess
import sys

import service

SHARED = True  # one service for all tests

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCHEMAS = {path.name: json.loads(path.read_text()) for path in sorted((ROOT / "schemas").glob("*.json"))}
OPENAPI = SCHEMAS.pop("openapi.json")

try:
    import jsonschema
except ImportError:
    jsonschema = None


def validator(schema):
    store = {"/schemas/" + name: text for name, text in SCHEMAS.items()}
    resolver = jsonschema.RefResolver(schema["$id"], schema, store=store)
    return jsonschema.Draft202012Validator(schema, resolver=resolver)


def walk(node):
    """Every object in a document."""
    if isinstance(node, dict):
        yield node
    for child in node.values() if isinstance(node, dict) else node if isinstance(node, list) else ():
        yield from walk(child)


def at(document, fragment):
    for step in fragment.split("/")[1:]:
        document = document[step.replace("~1", "/").replace("~0", "~")]
    return document


def test_schemas_are_valid():
    assert len(SCHEMAS) >= 9, sorted(SCHEMAS)
    for name, schema in SCHEMAS.items():
        jsonschema.Draft202012Validator.check_schema(schema)
        assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema", name
        assert schema["$id"] == "/schemas/" + name, name
        assert schema.get("title"), name


def test_examples_are_valid():
    seen = 0
    for name, schema in SCHEMAS.items():
        for example in schema.get("examples", []):
            validator(schema).validate(example)
            seen += 1
    assert seen >= 10, seen


def test_references_resolve():
    for name, schema in SCHEMAS.items():
        for node in walk(schema):
            if isinstance(node.get("$ref"), str):
                file, _, fragment = node["$ref"].partition("#")
                at(SCHEMAS[file] if file else schema, fragment)


def test_requests_are_judged_alike():
    requests = json.loads((ROOT / "tests/data/requests.json").read_text())
    check = validator(SCHEMAS["request.json"])
    names = [item["name"] for item in requests]
    assert len(set(names)) == len(names) > 100
    wrong = [item["name"] for item in requests if check.is_valid(item["body"]) != item["valid"]]
    assert not wrong, wrong


def test_a_wrong_number_stays_where_long_lists_are_cut():
    """service.py cuts the replies of all tests before they are checked."""
    count = {"type": "integer", "minimum": 0, "maximum": 9}
    numbers = jsonschema.Draft202012Validator({"items": count})
    rows = jsonschema.Draft202012Validator({"items": {"items": count, "minItems": 2}})
    for place in (0, 500, 999):
        for wrong in (-1, 10, 0.5, None, "x", [7]):
            for judge, right, bad in ((numbers, 7, wrong), (rows, [7, 7], [7, wrong]), (rows, [7, 7], [7])):
                told = [right] * 1000
                assert judge.is_valid(service.shortened(told))
                told[place] = bad
                assert not judge.is_valid(service.shortened(told)), (place, bad)
    assert len(service.shortened([7] * 1000)) < 20


def test_request_objects_are_strict():
    for node in walk(SCHEMAS["request.json"]["$defs"]):
        if node.get("type") == "object" and "properties" in node:
            assert node.get("additionalProperties") is False, node


def test_openapi_has_every_route():
    wanted = {"/v1/jobs": {"get", "post"}, "/v1/jobs/{id}": {"get", "delete"}, "/v1/jobs/{id}/result": {"get"},
              "/v1/jobs/{id}/history": {"get"}, "/v1/jobs/{id}/history.csv": {"get"}, "/v1/factors": {"get"},
              "/v1/limits": {"get"}, "/v1/events": {"get"}, "/metrics": {"get"}, "/v1/admin/check": {"post"},
              "/healthz": {"get"}, "/readyz": {"get"}, "/openapi.json": {"get"}, "/schemas/{name}": {"get"}}
    assert OPENAPI["openapi"].startswith("3.1")
    got = {path: set(item) - {"parameters"} for path, item in OPENAPI["paths"].items()}
    for path, methods in wanted.items():
        assert methods <= got.get(path, set()), path


def test_openapi_is_consistent():
    ids = []
    for path, item in OPENAPI["paths"].items():
        for method, operation in item.items():
            if method == "parameters":
                continue
            ids.append(operation["operationId"])
            assert operation["summary"] and operation["responses"], path
            for response in operation["responses"].values():
                assert "$ref" in response or response["description"], path
            named = [at(OPENAPI, p["$ref"][1:]) if "$ref" in p else p
                     for p in item.get("parameters", []) + operation.get("parameters", [])]
            in_path = {p["name"] for p in named if p["in"] == "path"}
            assert in_path == {part[1:-1] for part in path.split("/") if part.startswith("{")}, path
    assert len(set(ids)) == len(ids)
    for node in walk(OPENAPI):
        if isinstance(node.get("$ref"), str):
            file, _, fragment = node["$ref"].partition("#")
            at(SCHEMAS[file] if file else OPENAPI, fragment)
    names = OPENAPI["paths"]["/schemas/{name}"]["parameters"][0]["schema"]["enum"]
    assert set(names) == set(SCHEMAS) | {"openapi.json"}


def test_openapi_in_one_piece():
    """What the daemon serves: each reference leads to what it leads to in the files."""
    names = [str(ROOT / "schemas" / name) for name in [*sorted(SCHEMAS), "openapi.json"]]
    made = subprocess.run(["awk", "-f", str(ROOT / "schemas" / "bundle.awk"), *names], capture_output=True, text=True, check=True)
    whole, seen = json.loads(made.stdout), set()

    def same(old, file, new):
        if isinstance(old, dict) and isinstance(old.get("$ref"), str):
            name, _, fragment = old["$ref"].partition("#")
            file = name or file
            assert new["$ref"].startswith("#/components/"), new
            assert {key: value for key, value in old.items() if key != "$ref"} == {key: value for key, value in new.items() if key != "$ref"}
            if (file, fragment) not in seen:
                seen.add((file, fragment))
                same(at(SCHEMAS[file] if file in SCHEMAS else OPENAPI, fragment), file, at(whole, new["$ref"][1:]))
        elif isinstance(old, dict):
            root = file in SCHEMAS and old is SCHEMAS[file]
            rest = set(old) - ({"$schema", "$id", "$defs"} if root else set())
            assert rest == set(new) - ({"schemas"} if old is OPENAPI["components"] else set()), (rest, set(new))
            for key in rest:
                same(old[key], file, new[key])
        elif isinstance(old, list):
            assert len(old) == len(new)
            for one, other in zip(old, new):
                same(one, file, other)
        else:
            assert old == new, (old, new)
    same(OPENAPI, "openapi.json", whole)
    assert len(seen) > 60, len(seen)
    parts = whole["components"]["schemas"]
    assert set(SCHEMAS) == {f"{name}.json" for name in parts if "." not in name}, parts.keys()
    assert not any("$defs" in part or "$id" in part for part in parts.values())


def main():
    word = sys.argv[2] if len(sys.argv) > 2 else ""
    failed = 0
    for name, test in list(globals().items()):
        if not name.startswith("test_") or word not in name:
            continue
        label = "test_schemas." + name.removeprefix("test_")
        if jsonschema is None:
            print(f"skip {label}: python3-jsonschema is not installed")
            continue
        try:
            test()
            print(f"ok {label}")
        except Exception as error:  # noqa: BLE001: any failure is this test's failure
            print(f"# {type(error).__name__}: {str(error)[:500]}")
            print(f"not ok {label}")
            failed += 1
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
