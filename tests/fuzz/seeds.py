"""Writes what the fuzz targets start from: OUT/json/* and OUT/mm/*, one seed a file, and OUT/json.dict, OUT/mm.dict.

Seeds come from tests/data, and from the shared cases where they are there; the words of the JSON dictionary are the
member names and values that the schemas know.
"""
import hashlib
import json
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DATA = ROOT / "tests" / "data"
CASES = ROOT.parent / "shared" / "cases"
LARGEST = 16384  # bytes; larger seeds slow every run down
MM_WORDS = ["%%MatrixMarket", "matrix", "coordinate", "array", "real", "double", "integer", "complex", "pattern", "general",
            "symmetric", "skew-symmetric", "hermitian", "vector", "\n", "\r\n", "%", "1e308", "1e-320", "-0.0", "nan", "inf",
            "9223372036854775807", "2147483648"]
JSON_WORDS = ["null", "true", "false", "1e400", "-0.0", "1e-320", "9223372036854775808", "[[", "]]", "{}", "\\u0000", "\\ud800"]


def json_seeds():
    for entry in json.loads((DATA / "requests.json").read_text()):
        yield json.dumps(entry["body"]).encode()
    for path in DATA.glob("*.json"):
        yield path.read_bytes()
    for path in (CASES / "json").rglob("*.json"):
        yield path.read_bytes()


def mm_seeds():
    for folder in (DATA, CASES / "mm_edge"):
        for path in folder.rglob("*.mtx"):
            yield path.read_bytes()


def words(value):
    """The member names and the constants in a schema."""
    if isinstance(value, list):
        for one in value:
            yield from words(one)
    if not isinstance(value, dict):
        return
    yield from value.get("properties", {})
    yield from (one for one in [*value.get("enum", []), value.get("const")] if isinstance(one, str))
    for one in value.values():
        yield from words(one)


def write_seeds(folder, seeds):
    folder.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        if len(seed) <= LARGEST:
            (folder / hashlib.sha1(seed).hexdigest()[:16]).write_bytes(seed)


def write_dictionary(path, entries):
    def escaped(word):
        return "".join(c if c.isalnum() else f"\\x{ord(c):02x}" for c in word)

    path.write_text("".join(f'"{escaped(word)}"\n' for word in sorted(set(entries))))


def main():
    out = pathlib.Path(sys.argv[1])
    schema = json.loads((ROOT / "schemas" / "request.json").read_text())
    write_seeds(out / "json", json_seeds())
    write_seeds(out / "mm", mm_seeds())
    write_dictionary(out / "json.dict", [*(f'"{word}"' for word in words(schema)), *JSON_WORDS])
    write_dictionary(out / "mm.dict", MM_WORDS)


main()
