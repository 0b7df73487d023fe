"""Numbers that the README's sentences may have without a mark: none is measured. Each stands in a phrase that must be there word for
word; what the program says of it is compared where it can be.

A number counts when it has a point, an exponent, four digits or a unit after it (NUMBER); what stands in blocks, marks, code and
addresses does not.
"""
import json
import re

BLOCK = re.compile(r"<!-- numbers:[a-z_]+ -->.*?<!-- /numbers -->|<!-- n:[a-z0-9_.]+ -->.*?<!-- /n -->|```.*?```|`[^`\n]*`|(?m:^    [^\n]*$)|(?<=\])\([^)\n]*\)", re.S)
UNIT = (r"(?:%|‰|ns|ms|s|µs|min|h|kB|MB|GB|KiB|MiB|GiB|bytes?|times|x(?! ?\d)|fold|hours?|minutes?|seconds?|days?|percent|million|thousand|rad|"
        r"jobs|requests|clients|iterations|steps|digits|dofs|unknowns|MB/s)")
NUMBER = re.compile(rf"(?<![\w.])(?:\d[\d,]*\.\d+(?:e-?\d+)?|\d+e-?\d+|\d{{1,3}}(?:,\d{{3}})+|\d{{4,}}|\d+(?= ?{UNIT}(?!\w)))")


class Program:
    """What the program says of itself: its sources and schemas, and the limits of a running daemon (None: not asked)."""

    def __init__(self, root, limits=None):
        self.root, self.limits = root, limits

    def constant(self, path, pattern):
        """The number that the pattern's one group finds in a source."""
        return float(re.search(pattern, (self.root / path).read_text())[1])

    def schema(self, *keys):
        value = json.loads((self.root / "schemas/request.json").read_text())
        for key in keys:
            value = value[key]
        return value

    def limit(self, name):
        return self.limits[name]["value"]


def constant(value, path, pattern):
    return lambda program: program.constant(path, pattern) == value


def limit(name, value):
    return lambda program: program.limits is None or program.limit(name) == value


def webhook_hours(program):
    """Waits between the attempts, each twice the one before, up to the longest."""
    text = "server/work/webhook.c"
    first, longest, most = (program.constant(text, rf"#define {name} +([\d.]+)") for name in ("FIRST_RETRY_S", "LONGEST_WAIT_S", "MOST_ATTEMPTS"))
    waits = sum(min(longest, first * 2 ** attempt) for attempt in range(int(most) - 1))
    return most == 16 and 6 < waits / 3600 < 7


PHRASES = {
    # addresses, versions, requests of examples
    "127.0.0.1:8080 with its database in": None, "Gmsh file, 2.2 or 4.1,": None, "waiting up to 30 s for its end": None,
    # bodies
    "aluminium shaft 0.05 mm too thick": None, "(d = 60,600) with its factor cached": lambda program: 2 * 300 * 101 == 60600,
    "tip displacement (converged 23.96), and a rubber tube at Poisson's ratio 0.4999": None,  # the literature's; the material's
    # rules of the program
    "from Poisson's ratio 0.4 on, except in plane stress": constant(0.4, "solver/element/stiffness.c", r"#define NEARLY_INCOMPRESSIBLE ([\d.]+)"),
    "the default there, is 5 %": constant(5e-2, "solver/include/uzawa.h", r"UZ_BALANCED_TOTAL_ERROR ([\de.-]+)"), "For the paper's body 5 % takes": None, "cells, 2 % takes": None,  # asked for
    "start near an obstacle (2 % of the body's extent": constant(0.02, "solver/obstacle/candidates.h", r"UZ_CANDIDATES_REACH ([\d.]+)"),
    "(0.1 rad), `large_strain` (0.05),": lambda program: constant(0.1, "solver/post/warnings.c", r"MOST_ROTATION = ([\d.]+)")(program) and
    constant(0.05, "solver/post/warnings.c", r"MOST_STRAIN = ([\d.]+)")(program),
    "obstacle's normal turned by 0.1 rad on the way": constant(0.1, "solver/post/warnings.c", r"MOST_TURN = ([\d.]+)"),
    "from Poisson's ratio 0.45 on)": constant(0.45, "solver/post/warnings.c", r"LOCKS = ([\d.]+)"),
    "more than 131,072 iterations every second row is kept": constant(131072, "solver/methods/method.h", r"UZ_HISTORY_ROWS = (\d+)"),
    "| 1e-2 |": constant(1e-2, "server/codec/decode_settings.c", r'\{"quick", ([\de.-]+)'),
    "(default) | 1e-8 |": constant(1e-8, "server/codec/decode_settings.c", r'\{"precise", ([\de.-]+)'),
    "rounding level, 1e-12": None, "1e-9 the certificate must solve once more": None, "when the certificate is within 1e-2": None,
    "by default 80 % of the machine or its control group": None,
    "up to 10,000 loads on one body": lambda program: program.schema("properties", "cases", "maxItems") == 10000,
    "names of 1 to 63 bytes": None, "have at most 4 million numbers": constant(4e6, "server/http/results.c", r"#define MOST_NUMBERS (\d+)"),
    "tried 16 times in more than 6 hours": webhook_hours,
    "lock as Poisson's ratio nears 0.5, visibly from 0.4 on": None,
    "the summary warns from 0.45 on": constant(0.45, "solver/post/warnings.c", r"LOCKS = ([\d.]+)"), "Over TLS and HTTP/1.0": None,
    "A scene may have 20 million unknowns": constant(20e6, "solver/scene/mesh.h", r"UZ_SCENE_MAX_DOFS (\d+)"),
    "1000 items in each list": None, "4096 groups": constant(4096, "solver/scene/given.h", r"UZ_MESH_MAX_GROUPS (\d+)"),
    "estimate that fails with a probability below 1e-12": None, "bound: it fails with a probability below 1e-12": None,  # of the theorem used
    "above d times 2e-16": None,
    # limits
    "A request body may have 64 MiB": limit("max_body", 64 << 20), "an upload 1 GiB": limit("max_upload", 1 << 30),
    "three quarters of `--max-connections` (1,024)": limit("max_connections", 1024),
}


def plain(text):
    """The text with blanks where numbers may stand, every place as it was."""
    return BLOCK.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def unexplained(text, phrases=None):
    """(line, number, what stands around it) of every number that no phrase has; and the phrases that are not in the text."""
    phrases = PHRASES if phrases is None else phrases
    allowed, unused = [], []
    for phrase in phrases:
        places = [found.span() for found in re.finditer(re.escape(phrase), text)]
        allowed += places
        unused += [] if places else [phrase]
    left = [(text.count("\n", 0, found.start()) + 1, found[0], text[max(0, found.start() - 40):found.end() + 20]) for found in NUMBER.finditer(plain(text))
            if not any(begin <= found.start() and found.end() <= end for begin, end in allowed)]
    return left, unused


def wrong(program):
    """Phrases that the program contradicts."""
    return [phrase for phrase, check in PHRASES.items() if check and not check(program)]
