"""Makes docs/scenes.md of docs/scenes.in.md, whose lines `<!-- keys: PLACE ... -->` become lists of keys from
schemas/request.json, so that the page says what the service checks.

usage: scenes_page.py [TEMPLATE [SCHEMA]]        to standard output

A PLACE is a JSON pointer into the schema. A list has the properties of each place and of the objects in them that have
no place of their own. Every key of a request must be in exactly one list: else this fails and says which is not.
"""
import json
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
WIDTH = 119
MARK = re.compile(r"^<!-- keys: (.*) -->$", re.M)


class Guide:
    def __init__(self, schema, template):
        self.schema = schema
        self.template = template
        self.places = [place for found in MARK.findall(template) for place in self.places_of(found)]
        self.told = {}  # place of an object -> the list it is in

    @staticmethod
    def places_of(text):
        return [place.rstrip("/") for place in text.split()]  # the whole is ""

    def at(self, place):
        node = self.schema
        for step in filter(None, place.split("/")):
            node = node[int(step)] if isinstance(node, list) else node[step]
        return node

    def follow(self, node, place):
        """The schema behind references and its place, with the description of the nearest that has one."""
        description = node.get("description", "")
        while "$ref" in node:
            place = node["$ref"].lstrip("#")
            node = self.at(place)
            description = description or node.get("description") or node.get("title", "")
        return node, place, description or node.get("title", "")

    # ---- what a value may be

    @staticmethod
    def number(node, word):
        low, high = node.get("minimum"), node.get("maximum")
        above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
        if low is not None and high is not None:
            return f"{word}, {low:.12g} to {high:.12g}"
        ends = [f"{words} {value:.12g}" for words, value in (("at least", low), ("above", above), ("at most", high), ("below", below))
                if value is not None]
        return " ".join([word] + ([", ".join(ends)] if ends else []))

    def array(self, node, place):
        least, most = node.get("minItems", 0), node.get("maxItems")
        items, where, _ = self.follow(node["items"], place) if "items" in node else ({}, place, "")
        many = self.shape(items, where, plural=True) if items else "items"
        if least == most:
            return f"list of {least} {many}"
        ends = f"{least} to {most} " if most is not None and least > 0 and most <= 16 else f"at most {most} " if most is not None else ""
        return f"list of {ends}{many}"

    def shape(self, node, place, plural=False):
        s = "s" if plural else ""
        if "const" in node:
            return f"`{json.dumps(node['const'])}`"
        if "enum" in node:
            return " or ".join(f"`{value}`" for value in node["enum"])
        choices = node.get("oneOf") or node.get("anyOf")
        if choices:
            words = [self.shape(*self.follow(one, place)[:2], plural) for one in choices]
            return "; or ".join(dict.fromkeys(words))
        kind = node.get("type")
        if isinstance(kind, list):
            words = node.get("then", {}).get("enum", [])
            rest = {key: value for key, value in node.items() if key not in ("if", "then")}
            return "; or ".join([self.shape({**rest, "type": one}, place) for one in kind if one != "string"] +
                                [f"`{word}`" for word in words])
        if kind in ("number", "integer"):
            return self.number(node, ("whole number" if kind == "integer" else "number") + s)
        if kind == "array":
            return self.array(node, place) if not plural else f"lists ({self.array(node, place)[8:]})"
        if kind == "object" and len(node.get("properties", {})) == 1 and node.get("required"):
            return f"`{{\"{node['required'][0]}\": ...}}`"
        if kind == "boolean":
            return "`true` or `false`"
        return {"string": f"text{s}", "object": f"object{s}"}.get(kind, "anything")

    # ---- lists

    def row(self, key, node, place, required, depth_name):
        target, where, description = self.follow(node, place)
        if not description:
            raise ValueError(f"{place} has no description")
        said = [description]
        if "default" in node or "default" in target:
            said.append(f"Default: `{json.dumps(node.get('default', target.get('default')))}`.")
        name = f"{depth_name}{key}"
        shape = self.shape(target, where) + (", needed" if required else "")
        return textwrap.fill(f"- `{name}` ({shape}): {' '.join(said)}", WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)

    def inner(self, node, place):
        """The objects that a value may hold, with their places and what stands between its key and theirs."""
        node, place, _ = self.follow(node, place)
        if "properties" in node or isinstance(node.get("additionalProperties"), dict):
            yield node, place, "."
        for word in ("oneOf", "anyOf"):
            for i, one in enumerate(node.get(word, [])):
                yield from self.inner(one, f"{place}/{word}/{i}")
        if isinstance(node.get("items"), dict):
            yield from ((found, where, "[]" + dot) for found, where, dot in self.inner(node["items"], f"{place}/items"))

    def rows(self, node, place, table, name=""):
        """The keys of an object, and those of the objects in it that no list of their own has."""
        if place in self.told:
            return
        self.told[place] = table
        for key, value in node.get("properties", {}).items():
            where = f"{place}/properties/{key}"
            yield self.row(key, value, where, key in node.get("required", []), name)
            for found, at, dot in self.inner(value, where):
                if at not in self.places:
                    yield from self.rows(found, at, table, f"{name}{key}{dot}")
        more = node.get("additionalProperties")
        if isinstance(more, dict):
            where = f"{place}/additionalProperties"
            yield self.row("NAME", more, where, False, name)
            for found, at, dot in self.inner(more, where):
                yield from self.rows(found, at, table, f"{name}NAME{dot}")

    def table(self, mark):
        rows = [row for place in self.places_of(mark.group(1)) for row in self.rows(self.at(place), place, mark.group(1))]
        if not rows:
            raise ValueError(f"{mark.group(0)}: nothing is left to tell there")
        return "\n".join(rows)

    def objects(self, node=None, place=""):
        """Every object that a request may hold."""
        seen = set()

        def walk(node, place):
            for found, at, _ in self.inner(node, place):
                if at in seen:
                    continue
                seen.add(at)
                for key, value in found.get("properties", {}).items():
                    walk(value, f"{at}/properties/{key}")
                if isinstance(found.get("additionalProperties"), dict):
                    walk(found["additionalProperties"], f"{at}/additionalProperties")

        walk(self.schema, "")
        for case in ("matrices_case", "scene_case"):  # by the kind of the problem
            walk({"$ref": f"#/$defs/{case}"}, "")
        return seen

    def make(self):
        text = MARK.sub(self.table, self.template)
        missing = sorted(self.objects() - set(self.told))
        if missing:
            raise ValueError("no list has the keys of " + ", ".join(missing))
        return text


def main(template=ROOT / "docs/scenes.in.md", schema=ROOT / "schemas/request.json"):
    text = pathlib.Path(template).read_text(encoding="utf-8")
    made = Guide(json.loads(pathlib.Path(schema).read_text(encoding="utf-8")), text).make()
    head = f"<!-- made by `make guide` from {pathlib.Path(template).name} and schemas/request.json: change those -->\n"
    sys.stdout.write(head + made)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except ValueError as error:
        sys.exit(f"scenes_page.py: {error}")
