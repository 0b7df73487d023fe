"""Numbers that the sentences of README.md and docs may have without a mark: none is measured. Each stands in a phrase that must be there
word for word, however its lines are broken; what the program says of it is compared where it can be.

A number counts when it has a point, an exponent, four digits or a unit after it (NUMBER); what stands in marks, code, addresses and
comments does not.
"""
import json
import re

APART = re.compile(r"<!-- n:[a-z0-9_.]+ -->.*?<!-- /n -->|<!--.*?-->|```.*?```|`[^`\n]*`|(?m:^    [^\n]*$)|(?<=\])\([^)\n]*\)|<http[^>]*>", re.S)
UNIT = (r"(?:%|‰|ns|ms|s|µs|min|h|kB|MB|GB|KiB|MiB|GiB|bytes?|times|x(?!\s*\d)|fold|hours?|minutes?|seconds?|days?|percent|million|thousand|rad|"
        r"jobs|requests|clients|iterations|steps|digits|dofs|unknowns|MB/s)")
NUMBER = re.compile(rf"(?<![\w.])(?:\d[\d,]*\.\d+(?:e-?\d+)?|\d+e-?\d+|\d{{1,3}}(?:,\d{{3}})+|\d{{4,}}|\d+(?= ?{UNIT}(?!\w)))")


class Program:
    """What the program says of itself: its sources and schemas, and the limits of a running daemon (None: not asked)."""

    def __init__(self, root, limits=None):
        self.root, self.limits = root, limits
        self.sources = "".join(path.read_text() for top in ("solver", "server") for path in sorted((root / top).rglob("*.[ch]")))

    def constant(self, pattern):
        """The number that the pattern's one group finds, once, in the sources."""
        found = re.findall(pattern, self.sources)
        if len(found) != 1:
            raise ValueError(f"{pattern} is found {len(found)} times in the sources")
        return float(found[0])

    def schema(self, *keys):
        value = json.loads((self.root / "schemas/request.json").read_text())
        for key in keys:
            value = value[key]
        return value

    def limit(self, name):
        return self.limits[name]["value"]


def constant(value, pattern):
    return lambda program: program.constant(pattern) == value


def limit(name, value):
    return lambda program: program.limits is None or program.limit(name) == value


def webhook_hours(program):
    """Waits between the attempts, each twice the one before, up to the longest."""
    first, longest, most = (program.constant(rf"#define {name} +([\d.]+)") for name in ("FIRST_RETRY_S", "LONGEST_WAIT_S", "MOST_ATTEMPTS"))
    waits = sum(min(longest, first * 2 ** attempt) for attempt in range(int(most) - 1))
    return most == 16 and 6 < waits / 3600 < 7


WARNS_OF_LOCKING = constant(0.45, r"LOCKS = ([\d.]+)")
ROTATION, STRAIN = constant(0.1, r"MOST_ROTATION = ([\d.]+)"), constant(0.05, r"MOST_STRAIN = ([\d.]+)")


def reference(row):
    """A row of the table of the paper's body: its numbers are those that a test compares with."""
    return lambda program: all(number in (program.root / "tests/api/test_reference.py").read_text() for number in row)


PHRASES = {
    "0.7 to 1.7 times the error of a ring": None, "2 to 3.4 times of a tube": None, "(1.9 of one that it hardly widens)": None, "relative to the root of 2 W": None,
    "the force within 2 %": None, "proved within 2 %": None, "so 108 unknowns where displacements have 3: 36 times": None, "18 unknowns for 3": None,
    "216 times the displacements'": None, "16,200 rows and takes 1.4e12 operations against 6.6e9": None, "it takes 130 GB against 3.6 GB": None,
    "27 unknowns for 3, and a cut of 9 for 3: 9 times the unknowns": None, "27 times the operations": None,
    "With a p of 0.4 to 4": constant(0.4, r"LEAST_ORDER ([\d.]+)"), "1.25 times the way": constant(1.25, r"#define SAFE +([\d.]+)"),
    "Aplikace matematiky 27, 1982": None, "J. Computational Physics 262, 2014": None,
    # addresses, versions, requests of examples
    "Gmsh file (2.2, 4.0 or 4.1)": None, "file of version 2.2, 4.0 or 4.1,": None, "| Gmsh `.msh` 2.2, 4.0, 4.1, ASCII": None,
    "partitions (of 4.0: refused)": None, "| VTK legacy `.vtk` to 5.1, ASCII": None, "Corners closer than 1e-6 of the size": constant(1e-6, r"#define SAME_CORNER ([\d.e-]+)"), "- 100,000 triangles are found by a tree": None, "waiting up to 30 s for its end": None, "Apache License 2.0": None,
    "GPL-3.0-or-later": None, "GPL-2.0-or-later": None, "## 0.1": None, "(RFC 9457)": None, "published on 127.0.0.1.": None,
    "aluminium shaft 0.05 mm too thick": None, "a traction of 0.05 on a side of 60": None,
    # published: units, materials, the paper and its example
    "(steel: 210e3)": None, "(steel: 7.85e-9)": None, "(9810)": None, "(steel: 210e9)": None, "(steel: 7850)": None, "(9.81)": None,
    "Poisson's ratio 0.3, clamped on the left": None, "the paper's 73.3 %": None,
    "| 30 x 10 | 9.427e-4 | 822 | -3.9608186040e-3 | -10.51371700 | 22 |": reference(("-3.9608186040e-3", "-10.51371700")),
    "| 60 x 20 | 1.838e-3 | 1603 | -3.9620174378e-3 | -10.53866779 | 44 |": reference(("-3.9620174378e-3", "-10.53866779")),
    "| 120 x 40 | 3.625e-3 | 3161 | -3.9624809230e-3 | -10.54546589 | 88 |": reference(("-3.9624809230e-3", "-10.54546589")),
    "SIAM J. Imaging Sciences 2, 2009": None, "Foundations of Computational Mathematics 15, 2015": None, "Methods in Engineering 24, 1987": None,
    "Optical Society of America A 4, 1987": None, "The group may have 1,500 nodes": constant(1500, r"MOST_POINT_NODES = (\d+)"),
    "Applied Mathematics 5, 1947": None, "SIAM J. Scientific Computing 23, 2001": None, "Equilibrium Finite Element Formulations, 2017": None,
    "in ordinary precision, with 1e-14 of what they add up": constant(1e-14, r"#define UZ_SUM_ROUNDING +([\d.e-]+)"),
    "off the middles of their sides by up to 1e-5 of these": constant(1e-5, r"#define NEARLY +([\d.e-]+)"),
    "end without a certified equilibrium in 20 steps": constant(20, r"MOST_QPS = (\d+)"),
    "large deformation where that is more than 5 %;": None, "(`small_deformation`), beyond 0.05.": None, "of strains from 0.02 on": constant(0.02, r"#define LEAST_STRAINED ([\d.]+)"), "Where that is more than 5 %": None,  # UZ_MOST_SLIDING
    "by up to 20,000 dofs.": constant(20000, r"UZ_MOST_COMPARED = (\d+)"), "Up to 0.02 the answer stays:": constant(0.02, r"#define UZ_SURELY_SMALL ([\d.]+)"),
    "So where that is more than 2 % of the edge before": constant(0.02, r"#define EARLY +([\d.]+)"), "from about R < 4.2 edges on": None,  # 1 / (12 EARLY)
    "solids of up to 20,000 dofs, in all": constant(20000, r"UZ_MOST_FINITE_DOFS (\d+)"), "for which solids have at most 20,000 dofs.": constant(20000, r"UZ_MOST_FINITE_DOFS (\d+)"),
    "counts 10 and 5 times, the rest 2.4 and 1.5 times": lambda program: all(one in program.sources for one in ("plane ? 2.4 : 7", "plane ? 10 : 7", "plane ? 1.5 : 3", "plane ? 5 : 3")),
    "of 1,200 generated scenes in plane strain 182 did, and were off by at most 2.6 %": None,  # test_weigh with 300 scenes
    "of 256 in plane stress, of rings, solids and two bodies 42, by at most 0.6 %": None,  # with 64 others
    "the force was off by 9 % where 0.02 was left out.": None,  # the last string of tests/extremes/large_thresholds.py
    "up to 0.04 of F the answer stays.": constant(0.04, r"#define UZ_SURELY_HELD +([\d.]+)"),
    "of a clamped arch (`make arch`) at 0.5758 with one `quad8` through its thickness, at 0.5730(1) with eight.": None, "with the force at the node on top, it is 0.5744(1).": None,  # what it prints and checks
    "held flat bears 0.2115 E, but one": None, "at 0.1954 E as one `quad8`, 0.1823 E as four, 0.1745 E as sixteen.": None,  # test_finite
    "A ring of 9.5..10.5 that is squeezed by a twentieth of its height errs by 7.7 % and turns by less than 0.1 rad": None,  # test_weigh
    "a cantilever of 10 x 0.2 errs by 3.5 % where its end turns by 0.06.": None,  # the same
    "no row is closer than -1e-9 of the body's extent": None, "no deeper than 0.03 of the side": constant(0.03, r"#define CUTS_IN +([\d.]+)"),
    "Once a step is less than 0.03 in the energy's norm": constant(0.03, r"#define CHORD_STEP +([\d.]+)"),
    "It runs for ten minutes of processor time and in 8 GiB at most.": lambda program: all(one in (program.root / "client/request/cad.c").read_text() for one in ("MOST_SECONDS 600", "(rlim_t)8 << 30")),
    "does not strain them by more than 0.01 per radian": constant(0.01, r"#define MOST_TIED ([\d.]+)"), "more than 0.01 for one radian is refused": None,
    "(rows leave 0.01 at most": constant(0.01, r"#define SLACK ([\d.]+)"),
    "are off the circle by 0.004, where the overlap that makes all of the stress is 0.05": None,  # of its geometry
    "Finite Element Analysis, 2nd edition, 2008": None, "Numerical Optimization, 2nd edition, 2006": None,
    "Computing 56, 1996": None, "SIAM J. Numerical Analysis 33, 1996": None, "Computing 22, 2000": None, "Contact Mechanics, 1985": None, "Acta Numerica 10, 2001": None, "SIAM J. Numerical Analysis 38, 2000": None,
    "Int. J. Numerical Methods in Engineering 83, 2010": None, "Applied Mechanics and Engineering 193, 2004": None,
    "Applied Mechanics and Engineering 200, 2011": None,
    "(quad4 and hex8, as of small strain: from Poisson's ratio 0.4 on": constant(0.4, r"#define NEARLY_INCOMPRESSIBLE ([\d.]+)"),
    "by `auto` from Poisson's ratio 0.4 on, in plane strain": None, "with each law, from 0.4 on or by `bbar`": None,
    "a ring of ratio 0.499 took 2.9 times the force": None, "takes 1 % less force with 192 `quad4`": None, "as `standard` 2.9 times the force": None,  # test_finite_rubber
    "(Nagtegaal, Parks and Rice, 1974; Simo, Taylor and Pister, 1985)": None, "(Rockafellar 1976)": None, "Control and Optimization 14, 1976": None, "Mechanics and Engineering 4, 1974": None, "Mechanics and Engineering 51, 1985": None,
    "(Huang and others, 2011)": None, "Computer Graphics 17, 2011": None,
    "(Farkas 1902)": None, "Goldfarb and Idnani (Math. Programming 27 (1983))": None, "a K below 1e-289 is": None, "(below 1e-289)": None, "Mathematical Programming 27, 1983": None, "SIAM J. Optimization 2, 1992": None,
    "Mathematical Programming Computation 4, 2012": None,
    "a block squeezed by 30 %": None,  # tests/peers/large.py
    "| 115,000 | 1.6 to 1.8 | 1.9 to 2.0 | 2.5 to 2.8 | 1.1 to 1.2 |": None, "| 335,000 | 3.8 to 4.2 | 3.7 to 3.8 | 6.0 to 6.2 | 0.90 to 0.98 |": None,  # by hand, on two processors
    "| 1,012,000 | 13.0 to 14.0 | 9.9 to 10.8 | 16.4 to 17.9 | 0.71 to 0.80 |": None, "Of 346,000 dofs it takes 1.1 s": None, "alone takes 1.9 s for `distributed`, and each of two others 4 s": None,  # likewise
    "4,000 jobs of solids of 20 x 20 x 12 hex8 (93 MB each) over three daemons, nothing else on the machine: 98.8 % of the jobs that could hit did, by chance 80 %, and all of them took 0.47 of the time": None,  # tests/soak/daemons.py zipf 4000
    "(plane bodies of 16,000 dofs, solids of 5,000:": None,  # likewise
    # rules of the program
    "A node of which less than 5 % is covered": constant(0.05, r"LEAST_COVER ([\d.]+)"),
    "by more than 1 % of its length": constant(0.01, r"#define SLACK ([\d.]+)"),
    "the answer by more than 5 %. What": constant(0.05, r"UZ_MOST_SLIDING ([\d.]+)"),
    "the answer by more than 5 % in the energy norm": None, "`sliding` from 5 % on.": None,  # the same
    "one of them is more than 2 % it tries another": constant(0.02, r"#define TRIED +([\d.]+)"),
    "is more than 2 % of the edge before anything moves, of a circle of radius R from about R < 4.2 edges": constant(0.02, r"#define EARLY +([\d.]+)"),  # 2/3 of a bow of 1/(8 R)
    "a tolerance of 1e-24 of the terms": None, "off by up to 0.2 %.": None,  # what was
    "was told to err by 99 % in forces": None,  # what was
    "300 of all kinds in other words": lambda program: "other words\", 300)" in (program.root / "tests/extremes/generated_words.py").read_text(),
    "and 300 of bodies on obstacles": lambda program: "on obstacles\", 300)" in (program.root / "tests/extremes/generated_obstacles.py").read_text(),
    "1,000 generated scenes of bodies": lambda program: "most=1000)" in (program.root / "tests/extremes/generated_contacts.py").read_text(),
    "to be 2 % of its length deep": constant(0.02, r"#define SINK +([\d.]+)"),
    "from Poisson's ratio 0.4 on, except in plane stress": constant(0.4, r"#define NEARLY_INCOMPRESSIBLE ([\d.]+)"),
    "the default there, is 5 %": constant(5e-2, r"UZ_BALANCED_TOTAL_ERROR ([\de.-]+)"), "the paper's body 5 % takes": None, "cells, and 2 % takes": None,  # asked for
    "start near an obstacle (2 % of the body's extent": constant(0.02, r"UZ_CANDIDATES_REACH ([\d.]+)"),
    "Where the bound is more than 0.001 something": constant(1e-3, r"MOST_STABILIZED = ([\de.-]+)"),
    "(0.1 rad), `large_strain` (0.05),": lambda program: ROTATION(program) and STRAIN(program),
    "from Poisson's ratio 0.45 on.": WARNS_OF_LOCKING, "the summary warns from 0.45 on": WARNS_OF_LOCKING,
    "lock as Poisson's ratio nears 0.5, visibly from 0.4 on": None, "Poisson's ratio near 0.5": None, "Poisson's ratio is below 0.5": None,
    "more than 131,072 iterations every second row is dropped": constant(131072, r"UZ_HISTORY_ROWS = (\d+)"),
    "| `\"quick\"` | 1e-2 |": constant(1e-2, r'\{"quick", ([\de.-]+)'),
    "(default) | 1e-8 |": constant(1e-8, r'\{"precise", ([\de.-]+)'),
    "rounding level, 1e-12": None, "beyond 1e-9 the certificate solves once more": None, "when the certificate is within 1e-2": None,
    "certified to 1e-6,": None, "certified to 1e-6;": None,
    "by default 80 % of the machine or its control group": None,
    "up to 10,000 loads on one body": lambda program: program.schema("properties", "cases", "maxItems") == 10000,
    "name of 1 to 63 bytes": None, "have at most 4 million numbers": constant(4e6, r"#define MOST_NUMBERS (\d+)"),
    "tried 16 times in more than 6 hours": webhook_hours, "Over TLS and HTTP/1.0": None,
    "A scene may have 20 million unknowns": constant(20e6, r"UZ_SCENE_MAX_DOFS (\d+)"),
    "1000 items in each list": None, "4096 groups": constant(4096, r"UZ_MESH_MAX_GROUPS (\d+)"),
    "Each fails with a probability below 1e-12": None, "All claims together fail with a probability below 1e-12": None,  # of the theorems used
    "8e-13 is spent on the first": constant(8e-13, r"#define CHANCE +([\d.e-]+)"), "and 1e-14 on each later one": constant(1e-14, r"#define CHANCE_MORE ([\d.e-]+)"),
    "1,500,000 entries a half solve": constant(1500000, r"UZ_CERTIFY_SPARES = (\d+)"),
    "d times 2e-16": None,
    "The certificate says 1e-9": None, "From 10 % on": None, "the mesh alone is off by 10 % and": None,
    "`error.mesh` is 0.1 or more": None, "TLS** is 1.3 or 1.2": None, "with TLS 1.3 or 1.2 and forward": None,
    "killed where it does not: after 0.2 s": constant(0.2, r"#define CANCEL_S  \(([0-9.]+)"),
    "0.7 s (a tenth of the limit more": constant(0.7, r"#define LIMIT_S +\(([0-9.]+)"),
    "an answer to be certified), 0.5 s": constant(0.5, r"#define RELEASE_S \(([0-9.]+)"),
    "times what the last 15 jobs": constant(15, r"KEPT = (\d+), FEWEST"), "Only converged jobs of 0.05 s": constant(0.05, r"#define SHORTEST_S +([\d.]+)"),
    "10,000 dofs in all cases together": constant(10000, r"#define SMALL_DOFS +(\d+)"), "and 1,000 rows": constant(1000, r"#define SMALL_ROWS +(\d+)"),
    "(a sixth of it, at least 1 GiB)": constant(30, r"least = \(size_t\)1 << (\d+), share"),
    "up to 256 and 128 MiB, lie ready": constant(256, r"RESERVE_MOST = \(SANITIZED \? 8 : (\d+)\) << 20"),
    "lanes have at most 64 MiB": constant(64, r"#define LANE_CACHE +\(\(size_t\)(\d+) << 20\)"),
    "keeps 4 MiB for what": constant(4, r"#define SPARE_BYTES +\(\(off_t\)(\d+) << 20\)"),
    "its cache and 512 MiB": constant(512, r"#define LIMIT_ROOM \(\(size_t\)(\d+) << 20\)"),
    "each of 30 times": None, "a handshake has 5 s": None, "Grooves of less\nthan 0.1 rad": None,
    "at most 80 lines, files of at most 1,000": None, "functions per 1,000 lines": None,
    "bytes (256 KiB) into an object store": lambda program: program.limits is None or program.limits["object_least"]["value"] == 256 << 10,
    "on the ports 8081 to 8083": None,
    # an estimate, of counts that were taken once
    "### On paper: 10,000 cores, 1,000,000,000 unknowns, 1,000,000 jobs a day": None, "a small job takes 9 commits, 7 new rows, 9 kB of log and 5 kB of the database": None,
    "pieces of 2 kB of what is large, 26 kB of log and 23 kB of the database": None, "1 to 2 ms of PostgreSQL's processor": None,
    "One body of 1,000,000,000 unknowns**: refused, a scene may have 20 million": constant(20e6, r"UZ_SCENE_MAX_DOFS (\d+)"),
    "displacements alone are 8 GB, 1,908 objects": constant(4, r"#define OBJECT_MOST +\((\d+) << 20\)"),
    "1,000,000 results of the 600 x 200 body": None, "10,000 cores are 313 daemons of 32 workers and 2,817 connections": None,
    "make 940 commits a second": None, "**1,000,000 jobs a day** are 12 a second, 2 % of a processor of PostgreSQL and 9 to 26 GB of log": None,
    # limits
    "A request body may have 64 MiB": limit("max_body", 64 << 20), "an upload 1 GiB": limit("max_upload", 1 << 30),
    "three quarters of `--max-connections` (1,024)": limit("max_connections", 1024),
}


def plain(text):
    """The text with blanks where numbers may stand, every place as it was."""
    return APART.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def anywhere(phrase):
    """The phrase, also where a line ends within it."""
    return re.compile(r"\s+".join(re.escape(word) for word in phrase.split(" ")))


def unexplained(pages, phrases=None):
    """(page, line, number, what stands around it) of every number that no phrase has; and the phrases that no page has.
    pages: {name: text}"""
    phrases = PHRASES if phrases is None else phrases
    left, unused = [], set(phrases)
    for name, text in pages.items():
        allowed = []
        for phrase in phrases:
            places = [found.span() for found in anywhere(phrase).finditer(text)]
            allowed += places
            unused -= {phrase} if places else set()
        left += [(name, text.count("\n", 0, found.start()) + 1, found[0], text[max(0, found.start() - 40):found.end() + 20])
                 for found in NUMBER.finditer(plain(text)) if not any(begin <= found.start() and found.end() <= end for begin, end in allowed)]
    return left, sorted(unused)


def wrong(program):
    """Phrases that the program contradicts."""
    return [phrase for phrase, check in PHRASES.items() if check and not check(program)]
