"""The shape of the C code: functions per 1,000 lines, their lengths, and statics that are named once beside their
definition. usage: shape.py [FOLDER...]; without, solver, server and client."""
import pathlib
import re
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEAD = re.compile(r"^(?!typedef|struct|enum|union|#|extern)([a-z_][\w \t*]*?)\b(\w+)\((?:[^;{]|\n)*?\)\s*\n\{\n", re.M)


def functions(text):
    """(name, static, lines between the braces) of each function: its braces stand alone in column one."""
    for match in HEAD.finditer(text):
        end = text.index("\n}", match.end() - 1)
        yield match.group(2), match.group(1).startswith("static"), text[match.end():end + 1].count("\n")


def measure(folder):
    lines, lengths, statics, once = 0, [], 0, 0
    files = [path for path in sorted((ROOT / folder).rglob("*.[ch]")) if "page" not in path.parts]
    for path in files:
        text = path.read_text(encoding="utf-8")
        bare = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
        lines += text.count("\n")
        for name, static, length in functions(text):
            lengths.append(length)
            if static:
                statics += 1
                once += len(re.findall(rf"\b{name}\b", bare)) == 2
    if not lengths:
        return
    lengths.sort()
    print(f"{folder:24} {len(files):4} files {lines:6} lines {len(lengths):5} functions {1000 * len(lengths) / lines:5.1f} per 1,000 lines;"
          f" lines median {statistics.median(lengths):.0f}, p90 {lengths[int(0.9 * len(lengths))]}, longest {lengths[-1]};"
          f" statics named once {100 * once / max(1, statics):.0f} %")


for one in sys.argv[1:] or ("solver", "server", "client"):
    measure(one)
