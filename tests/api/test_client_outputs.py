"""What the client fetches and prints: tables, pictures, the price of digits, factors, the doctor, JSON everywhere.
usage: test_client_outputs.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import base64
import csv
import datetime
import email.utils
import html.parser
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import urllib.parse
import xml.etree.ElementTree

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from fake_server import Fake
from service import Skip, check, options

SHARED = True  # one service for all tests

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
PAPER, SPRINGS = "tests/data/paper_body.json", "tests/data/small_matrices.json"
ID = "0" * 31 + "1"


def run(server, *words, code=0, stdin=None, **environment):
    url = server if isinstance(server, str) else server.url
    done = subprocess.run([CLIENT, "--server", url, *words], input=stdin, capture_output=True, text=True, timeout=90,
                          env={**os.environ, **environment})
    check(code in (None, done.returncode), f"{words}: exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}")
    return done


def solved(server, body=PAPER, *words, stdin=None):
    return run(server, "submit", body, "--wait", "--quiet", *words, stdin=stdin).stdout.strip()


def table(server, job, *words):
    return list(csv.DictReader(io.StringIO(run(server, "result", job, "--format", "csv", *words).stdout)))


# ------------------------------------------------------- jobs by short names

def test_jobs_by_less_than_their_id(server):
    check("no job yet" in run(server, "status", "@last", code=4).stderr)
    jobs = [solved(server, SPRINGS) for _ in range(3)]
    for word, job in (("@last", jobs[2]), (jobs[0][-8:], jobs[0]), (jobs[1][-12:], jobs[1]), (jobs[1], jobs[1])):
        check(json.loads(run(server, "status", word, "--json").stdout)["id"] == job, word, job)
    begins = os.path.commonprefix(jobs)
    first = next(n for n in range(len(begins) + 1, 33) if sum(job.startswith(jobs[0][:n]) for job in jobs) == 1)
    check(json.loads(run(server, "status", jobs[0][:max(first, 4)], "--json").stdout)["id"] == jobs[0])
    check("of several jobs" in run(server, "status", begins[:4], code=2).stderr)
    check("begins or ends with ffffffff" in run(server, "status", "ffffffff", code=4).stderr)
    check("3 digits" not in run(server, "status", "abc", code=4).stderr)  # too short to be looked for: the service refuses it
    run(server, "wait", "@last", "--baseline", jobs[0][-10:])
    run(server, "delete", jobs[2][-8:])
    check(json.loads(run(server, "status", "@last", "--json").stdout)["id"] == jobs[1])
    short = run(server, "list", "--limit", "1")
    check("--limit shows more" in short.stderr and short.stdout.count(jobs[1]) == 1, short)
    check(run(server, "list").stderr == "", "nothing was cut")


# ------------------------------------------------- requests and reports

class Page(html.parser.HTMLParser):
    """The tags that are open, the images, and the words of a page."""
    VOID = {"meta", "img", "br"}

    def __init__(self, text):
        super().__init__()
        self.open, self.images, self.words, self.outside = [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append(tag)
        self.images += [dict(attrs)["src"]] if tag == "img" else []
        self.outside += [value for name, value in attrs if name in ("src", "href") and not value.startswith("data:")]

    def handle_endtag(self, tag):
        check(self.open.pop() == tag, tag, self.open)

    def handle_data(self, data):
        self.words.append(data)


def test_requests_come_back_as_they_were_sent(server):
    job = solved(server)
    with open(PAPER, encoding="utf-8") as file:
        sent = json.load(file)
    check(json.loads(run(server, "request", job).stdout) == sent)
    check("no job" in run(server, "request", ID, code=4).stderr)


def test_a_report_is_one_file_with_everything(server):
    """Well formed, its pictures in it, every text of others escaped."""
    with open(PAPER, encoding="utf-8") as file:
        request = json.load(file)
    request["tags"] = ["<script>alert(1)</script>"]
    request["assert"] = [{"quantity": "contact.active", "min": 1, "name": "it <b>touches</b> & holds"}]
    request["quantities"] = [{"quantity": "contact.force", "name": "<i>push"}]
    job = solved(server, "-", stdin=json.dumps(request))
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.html")
        run(server, "report", job, "-o", path)
        with open(path, encoding="utf-8") as file:
            text = file.read()
    page = Page(text)
    said = " ".join(page.words)
    check(page.open == ["html"] and not page.outside and "<script" not in text and "<b>touches" not in text, page.open)
    check("converged" in said and "whole error" in said and "it <b>touches</b> & holds" in said and "<i>push" in said, said)
    check("Center of pressure" in said and job in said and '"kind": "scene"' in said, said)
    pictures = [base64.b64decode(one.partition(",")[2]) for one in page.images]
    check(len(pictures) == 4, len(pictures))
    for picture in pictures:
        xml.etree.ElementTree.fromstring(picture)
    with_cases = {**request, "assert": [], "cases": [{"name": "a", "loads": request["problem"]["loads"]}, {"name": "b & c", "loads": []}]}
    job = solved(server, "-", stdin=json.dumps(with_cases))
    said = " ".join(Page(run(server, "report", job, "--case", "b & c").stdout).words)
    check("b & c" in said and "Load cases" in said, said)
    check("no load case" in run(server, "report", job, "--case", "z", code=2).stderr)
    of_box = {"kind": "scene", "model": "plane_strain", "mesh": {"box": {"size": [2, 1], "cells": [4, 2], "element": "quad4"}}, "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
              "supports": [{"on": "left", "ux": 0}], "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]}
    cases = [{"name": name, "loads": [{"on": "top", "traction": [0, by]}]} for name, by in (("on", -1), ("off", 1))]
    job = run(server, "submit", "--wait", "-", stdin=json.dumps({"problem": of_box, "cases": cases}), code=7).stdout.split()[1]
    said = " ".join(Page(run(server, "report", job, "--case", "off").stdout).words)  # it has no picture of the body
    check("unheld" in said and "push the body away" in said, said)
    said = " ".join(Page(run(server, "report", solved(server, SPRINGS)).stdout).words)
    check("exact solution" in said and "Contacts" not in said, said)
    check("no job" in run(server, "report", ID, code=4).stderr)


def test_motions_of_rigid_groups_are_told(server):
    """A strip of stiffness E I / L under a moment: its end turns by M L / (E I), and its support takes what is left."""
    problem = {"kind": "scene", "model": "plane_stress", "units": {"length": "mm", "force": "N"}, "mesh": {"box": {"size": [10, 1], "cells": [20, 2], "element": "quad8"}},
               "materials": [{"on": "all", "young": 1000, "poisson": 0}], "loads": [{"on": "right", "force": [0, 0], "at": [10, 0.5], "moment": [0.2]}],
               "supports": [{"on": "left", "ux": 0, "uy": 0}, {"on": "right", "rigid": {"point": [10, 0.5]}}]}
    job = solved(server, "-", stdin=json.dumps({"problem": problem}))
    said = run(server, "status", job).stdout
    check("rigid: its point (10, 0.5) moves by (" in said and ", 0.12) mm and turns by (1.3751) degrees; moment (" in said and said.count("rigid: ") == 1, said)
    page = Page(run(server, "report", job).stdout)
    words = " ".join(page.words)
    check("Rigid groups" in words and "Rotation, degrees" in words and "(1.3751)" in words, words)
    check(page.words[page.words.index("Rigid groups"):].count("left") == 0, "only supports that are rigid are in the table")
    problem["supports"][1] = {"on": "right", "uy": 0}
    other = solved(server, "-", stdin=json.dumps({"problem": problem}))
    check("rigid" not in run(server, "status", other).stdout and "Rigid groups" not in run(server, "report", other).stdout)


# ----------------------------------------------------------------- tables


def test_table_of_nodes(server):
    job = solved(server)
    rows = table(server, job, "--field", "displacements", "--field", "stress", "--field", "von_mises")
    result = json.loads(run(server, "result", job, "--fields", "nodes,displacements,stress,von_mises").stdout)
    check(list(rows[0]) == ["node", "x", "y", "ux", "uy", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "von_mises"],
          rows[0])
    check(len(rows) == 31 * 11, len(rows))
    for i, row in enumerate(rows):
        numbers = [float(value) for value in row.values()]
        check(numbers == [i, *result["nodes"][i], *result["displacements"][i], *result["stress"][i], result["von_mises"][i]],
              "every digit:", row)


def test_tables_for_the_eye(server):
    """The columns of the CSV below each other, with five digits; names as they are, whatever is in them."""
    job = solved(server)
    for fields in ("displacements,von_mises", "reactions,gaps", "summary"):
        rows = list(csv.reader(io.StringIO(run(server, "result", job, "--format", "csv", "--fields", fields).stdout)))
        lines = run(server, "result", job, "--format", "table", "--fields", fields).stdout.splitlines()
        check(len({len(line) for line in lines}) == 1 and len(lines) == len(rows), lines[:3])
        check(lines[0].split() == rows[0], lines[0], rows[0])
        for line, row in zip(lines[1:], rows[1:]):
            check(line.split() == [f"{float(one):.5g}" if one and one[0] in "-0123456789" else one or "-" for one in row], line, row)
    with open("tests/data/cases.json", encoding="utf-8") as file:
        request = json.load(file)
    request["cases"][0]["name"] = 'a, "b" n\u00e4her'
    lines = run(server, "result", solved(server, "-", stdin=json.dumps(request)), "--format", "table").stdout.splitlines()
    check(lines[1].startswith('a, "b" n\u00e4her  ') and all(line.rstrip() == line for line in lines) and len({len(line) for line in lines[2:]}) == 1, lines)


def test_table_of_contacts(server):
    job = solved(server)
    rows = table(server, job)
    result = json.loads(run(server, "result", job, "--fields", "nodes,reactions,gaps").stdout)
    check(list(rows[0]) == ["contact", "node", "x", "y", "reactions", "gaps"] and len(rows) == 30, rows[0])
    for i, row in enumerate(rows):
        node = result["contact_nodes"][i]
        check([float(value) for value in row.values()] ==
              [i, node, *result["nodes"][node], result["reactions"][i], result["gaps"][i]], row)
    status = table(server, job, "--fields", "contact_status,pressure")
    check(sum(int(row["contact_status"]) for row in status) == 22, status)


def test_tables_of_other_kinds(server):
    job = solved(server)
    points = table(server, job, "--field", "stress_gauss")
    check(len(points) == 4 * 300 and list(points[0])[:3] == ["element", "x", "y"], points[0])
    check(list(table(server, job, "--field", "nodes")[0]) == ["node", "x", "y"])
    springs = solved(server, SPRINGS)
    rows = table(server, springs, "--field", "displacements")
    check(list(rows[0]) == ["dof", "u"] and len(rows) == 3, rows)
    check(list(table(server, springs)[0]) == ["contact", "reactions", "gaps"])
    cases = solved(server, PAPER, "--vary", "loads.1.traction.0=0.1,0.2")
    rows = table(server, cases)
    check([row["case"] for row in rows] == ["0.1"] * 30 + ["0.2"] * 30, rows[::30])
    one = table(server, cases, "--case", "0.2")
    check("case" not in one[0] and [row["gaps"] for row in one] == [row["gaps"] for row in rows[30:]])
    target = os.path.join(server.folder, "t.csv")
    run(server, "result", job, "--format", "csv", "-o", target)
    check(open(target, encoding="utf-8").read() == run(server, "result", job, "--format", "csv").stdout)


def test_a_path_is_a_table_and_a_series(server):
    """A row for each point, and a file for each that ParaView opens as one series."""
    block = {"problem": {"kind": "scene", "model": "plane_strain", "kinematics": "finite", "mesh": {"box": {"size": [1, 1], "cells": [2, 2], "element": "quad8"}},
                         "materials": [{"on": "all", "young": 1, "poisson": 0.3, "law": "neo_hooke"}],
                         "supports": [{"on": "left", "ux": 0}, {"on": "top", "uy": -1}],
                         "contacts": [{"on": "bottom", "obstacle": {"plane": {"point": [0, 0], "normal": [0, 1]}}}]},
             "cases": [{"name": 'a "way"', "steps": [0.1, 0.2, 0.3]}]}
    job = solved(server, "-", stdin=json.dumps(block))
    rows = table(server, job, "--fields", "summary")
    check([row["case"] for row in rows] == ['a "way" 1', 'a "way" 2', 'a "way"'] and [row["part"] for row in rows] == ["0.10000000000000001", "0.20000000000000001", "0.29999999999999999"], rows)
    check(all(abs(float(row["contact_force_y"]) + float(row["support_1_force_y"])) < 1e-8 and row["outcome"] == "converged" for row in rows), rows)
    check(abs(float(rows[2]["contact_force_y"]) - 0.45842392) < 1e-7 and float(rows[2]["displacement"]) > 0.3, rows[2])
    check([row["outcome"] for row in table(server, job, "--fields", "summary", "--case", 'a "way"')] == ["converged"])
    check(list(table(server, solved(server, SPRINGS), "--fields", "summary")[0])[0] == "outcome")
    with tempfile.TemporaryDirectory() as folder:
        run(server, "result", job, "--format", "pvd", "-o", os.path.join(folder, "x.pvd"))
        series = xml.etree.ElementTree.parse(os.path.join(folder, "x.pvd")).getroot().findall("Collection/DataSet")
        check([(one.get("timestep"), one.get("file")) for one in series] == [("0.1", "x-1.vtu"), ("0.2", "x-2.vtu"), ("0.3", "x-3.vtu")], series)
        for one, row in zip(series, rows):
            kept = open(os.path.join(folder, one.get("file")), "rb").read()
            check(kept == server.get(f"/v1/jobs/{job}/result.vtu?case={urllib.parse.quote(row['case'])}").body, row)
    for words in ((), ("-o", "-"), ("-o", "x.pvd", "--case", "a")):
        check("FILE.pvd" in run(server, "result", job, "--format", "pvd", *words, code=2).stderr)


def test_tables_that_cannot_be(server):
    job = solved(server)
    for fields, says in (("reactions,displacements", "is not of the same"), ("nonsense", "no field"), ("summary,reactions", "no field")):
        done = run(server, "result", job, "--format", "csv", "--fields", fields, code=2)
        check(says in done.stderr and done.stdout == "", done)
    run(server, "result", solved(server, SPRINGS), "--format", "csv", "--field", "stress", code=4)


@options(None)
def test_names_in_a_table_are_quoted(_):
    answer = {"job": ID, "summary": {}, "cases": [{"name": 'a,"b"', "reactions": [1, None]}], "nodes": []}
    with Fake((200, answer)) as fake:
        done = run(fake.url, "result", ID, "--format", "csv", "--field", "reactions")
    check(done.stdout == 'case,contact,reactions\n"a,""b""",0,1\n"a,""b""",1,\n', done.stdout)


def test_fields_along_a_line(server):
    job, ends = solved(server), ("--from", "-2,10", "--to", "58,10", "--count", "31")
    want = server.get(f"/v1/jobs/{job}/path?from=-2,10&to=58,10&count=31").json
    check(json.loads(run(server, "path", job, *ends, "--json").stdout) == want == json.loads(run(server, "path", job, *ends, "-f", "json").stdout))
    rows = list(csv.DictReader(io.StringIO(run(server, "path", job, *ends, "--format", "csv").stdout)))
    check([float(row["von_mises"]) for row in rows[1:]] == want["von_mises"][1:] and rows[0]["ux"] == "nan", rows[:2])
    lines = run(server, "path", job, *ends).stdout.splitlines()
    check(lines[0].split() == list(rows[0]) and len({len(line) for line in lines}) == 1 and len(lines) == 32, lines[:3])
    check(lines[1].split() == ["0", "-2", "10"] + 7 * ["-"], lines[1])
    for line, row in zip(lines[2:], rows[1:]):
        check(all(abs(float(cell) - float(value)) <= 6e-5 * abs(float(value)) for cell, value in zip(line.split(), row.values())), line, row)
    target = os.path.join(server.folder, "along.csv")
    run(server, "path", job, *ends, "--format", "csv", "--output", target)
    check(open(target, encoding="utf-8").read().startswith("distance,x,y,ux,uy,stress_xx"))


def test_lines_that_cannot_be(server):
    check("wants --from and --to" in run(server, "path", ID, "--from", "0,0", code=2).stderr)
    check("from 2 to 10000" in run(server, "path", ID, "--from", "0,0", "--to", "1,1", "--count", "1", code=2).stderr)
    check("contradict" in run(server, "path", ID, "--from", "0,0", "--to", "1,1", "--json", "-f", "csv", code=2).stderr)
    job = solved(server)
    check("points of 2 numbers" in run(server, "path", job, "--from", "0,0,0", "--to", "1,1,1", code=4).stderr)
    check("from is a point" in run(server, "path", job, "--from", "left", "--to", "1,1", code=4).stderr)
    cases = solved(server, PAPER, "--vary", "loads.1.traction.0=0.1,0.2")
    words = ("path", cases, "--from", "0,10", "--to", "60,10", "-f", "csv")
    check("case" in run(server, *words, code=4).stderr)
    check(run(server, *words, "--case", "0.1").stdout != run(server, *words, "--case", "0.2").stdout)


# ---------------------------------------------------------------- contexts


def in_context(folder, text, *words, code=0, **environment):
    """The client with this configuration file, and no --server."""
    place = os.path.join(folder, "uzawa")
    os.makedirs(place, exist_ok=True)
    with open(os.path.join(place, "config"), "w", encoding="utf-8", opener=lambda path, flags: os.open(path, flags, 0o600)) as file:
        file.write(text)
    clean = {key: value for key, value in os.environ.items() if not key.startswith("UZAWA_")}
    done = subprocess.run([CLIENT, *words], capture_output=True, text=True, timeout=60, env={**clean, "XDG_CONFIG_HOME": folder, **environment})
    check(done.returncode == code, f"{words}: exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}")
    return done


@options(None)
def test_contexts_name_services(_):
    with tempfile.TemporaryDirectory() as folder, Fake(*[(200, {"jobs": [], "next": None})] * 20) as lab, Fake(*[(200, {"jobs": [], "next": None})] * 20) as far:
        text = f"# services\ncontext = lab\n\n[lab]\nserver = {lab.url}\ntoken = secret\n[far]\n  server={far.url}\n"
        in_context(folder, text, "list")
        check(len(lab.requests) == 1 and lab.requests[0].headers["Authorization"] == "Bearer secret", lab.requests)
        in_context(folder, text, "list", "--context", "far", UZAWA_TOKEN="of another")
        check(len(far.requests) == 1 and "Authorization" not in far.requests[0].headers, "the token of the environment is not for it")
        in_context(folder, text, "list", UZAWA_CONTEXT="far", UZAWA_SERVER=lab.url)
        in_context(folder, text, "list", UZAWA_SERVER=far.url)
        in_context(folder, text, "--server", far.url, "list")
        check((len(lab.requests), len(far.requests)) == (1, 4), "who was asked")
        for wrong, says, words in ((text, "no context [home]", ("--context", "home")), (text, "both name", ("--context", "lab", "--server", "http://h")),
                                   ("[lab]\nsever = x\n", 'line 2: "sever"', ()), ("[lab]\nserver\n", "no [name] and no key", ()),
                                   ("context = lab\n[lab]\ntoken = x\n", "has no server", ())):
            check(says in in_context(folder, wrong, "list", *words, code=2).stderr, says)
        os.chmod(os.path.join(folder, "uzawa", "config"), 0o644)
        check("chmod 600" in in_context(folder, text, "list", code=2).stderr, "others may read the token")
        check("where contexts are" in in_context(folder, "", "list", "--context", "lab", code=2, XDG_CONFIG_HOME=folder + "/none").stderr)


# ---------------------------------------------------------------- pictures


def test_pictures_are_seen_from_where_one_wants(server):
    """Each option reaches the service: what is drawn is what it draws for these."""
    block = {"problem": {"kind": "scene", "model": "solid", "mesh": {"box": {"size": [3, 2, 1], "cells": [3, 2, 1]}}, "materials": [{"on": "all", "young": 1000, "poisson": 0.3}],
                         "supports": [{"on": "back", "ux": 0, "uy": 0, "uz": 0.01}], "contacts": [{"on": "front", "obstacle": {"plane": {"point": [0, 0, 1], "normal": [0, 0, -1]}}}]}}
    job = solved(server, "-", stdin=json.dumps(block))
    seen = {"": run(server, "picture", job).stdout}
    for query, words in (("view=front", ["--view", "front"]), ("up=z", ["--up", "z"]), ("view=left&up=z", ["--view", "left", "--up", "z"]), ("width=300&colour=pressure&factor=5", ["--width", "300", "--colour", "pressure", "--factor", "5"])):
        drawn = server.get(f"/v1/jobs/{job}/deformed.svg?{query}").body.decode()
        for command in (["picture"], ["plot", "--deformed"]):
            check(run(server, *command, job, *words).stdout == drawn, command, words)
        seen[query] = drawn
    check(len(set(seen.values())) == len(seen), "they are the same")


def test_pictures_go_to_files(server):
    job = solved(server)
    target = os.path.join(server.folder, "body.svg")
    said = json.loads(run(server, "plot", job, "--deformed", "--width", "300", "-o", target, "--json").stdout)
    svg = open(target, encoding="utf-8").read()
    check(said == {"file": target, "bytes": len(svg.encode())} and 'width="300"' in svg, said)
    check(run(server, "plot", job, "--deformed", "--factor", "2").stdout.rstrip().endswith("</svg>"))
    run(server, "plot", job, "--deformed", "--colour", "mauve", code=4)


def test_png_by_the_converter(server):
    if not shutil.which("rsvg-convert"):
        raise Skip("rsvg-convert is not installed")
    target = os.path.join(server.folder, "body.png")
    for command in (["plot", "--deformed"], ["picture"]):
        run(server, *command, solved(server), "-o", target)
        check(open(target, "rb").read(8) == b"\x89PNG\r\n\x1a\n")
        os.remove(target)
    with Fake((200, "<svg" + " " * 300_000)) as fake:  # more than the pipes hold, and no picture
        done = run(fake.url, "plot", ID, "-o", os.path.join(server.folder, "none.png"), code=11)
        check("rsvg-convert could not" in done.stderr and not os.path.exists(os.path.join(server.folder, "none.png")), done)


def test_png_without_the_converter(server):
    job = solved(server)
    target = os.path.join(server.folder, "body.png")
    done = run(server, "plot", job, "--deformed", "-o", target, code=11, PATH="/nonexistent")
    check("librsvg2-bin" in done.stderr and not os.path.exists(target), done.stderr)


@options(None)
def test_convergence_is_asked_for(_):
    with Fake((200, "<svg></svg>")) as fake:
        done = run(fake.url, "plot", ID, "--x", "seconds", "--with", "a", "--with", "b", "--case", "c d")
        check(done.stdout == "<svg></svg>\n", done)
        check(fake.requests[0].path == f"/v1/jobs/{ID}/convergence.svg?case=c%20d&x=seconds&with=a%2Cb", fake.requests[0].path)


@options(None)
def test_price_of_digits(_):
    decades = [{"relative_error": 10.0**-k, "seconds": 0.001 * 2**k if k < 9 else None, "iterations": 10 * k if k < 9 else None,
                "by": "iteration"} for k in range(1, 11)]
    trade = {"job": ID, "decades": decades, "mesh_error": 0.022}
    with Fake((200, trade)) as fake:
        done = run(fake.url, "plot", ID, "--trade", LC_ALL="C")
        check(fake.requests[0].path == f"/v1/jobs/{ID}/work-precision", fake.requests[0].path)
        narrow = run(fake.url, "plot", ID, "--trade", LC_ALL="C.UTF-8", COLUMNS="40").stdout
        least = run(fake.url, "plot", ID, "--trade", LC_ALL="C.UTF-8", COLUMNS="26").stdout
        check(json.loads(run(fake.url, "plot", ID, "--trade", "--json").stdout) == trade)
    lines = done.stdout.splitlines()
    bars = [line.count("#") for line in lines[1:9]]
    check(bars == sorted(bars) and 0 < bars[0] < bars[-1], lines)
    steps = [after - before for before, after in zip(bars, bars[1:])]
    check(max(steps) - min(steps) <= 1, "a factor of two is the same length anywhere:", bars)
    check("2 ms" in lines[1] and "never" in lines[9] and "never" in lines[10], lines)
    check("0.022" in lines[11] and len(lines) == 12, lines)
    check(all(len(line) <= 40 for line in narrow.splitlines()[:11]) and "\u2588" in narrow, narrow)
    check(all(len(line) <= 26 for line in least.splitlines()[:11]), least)
    with Fake((200, {"a": 1})) as fake:
        run(fake.url, "plot", ID, "--trade", code=5)


def path_point(k, up=4.0, aside=-30.0):
    return {"name": f"p {k}", "summary": {"outcome": "converged", "finite": {"displacement": 0.1 * k, "part": k / 5},
                                          "contact": {"force": [0.0, up * min(k, 3)]},
                                          "resultants": {"supports": [{"force": [aside * k, 1.0]}]}}}


@options(None)
def test_a_path_is_drawn_in_characters(_):
    """The force that changes most over the displacement, as a line of points; others where that one stays."""
    cases = [path_point(k) for k in range(1, 6)]
    for aside, name, last in ((-30.0, "support 0 along x", -150), (0.0, "contacts along y", 12)):
        for case in cases:
            case["summary"]["resultants"]["supports"][0]["force"][0] = aside * round(10 * case["summary"]["finite"]["displacement"])
        with Fake((200, {"cases": cases})) as fake:
            lines = run(fake.url, "plot", ID, "--path", "--width", "60", LC_ALL="C").stdout.splitlines()
            check(fake.requests[0].path == f"/v1/jobs/{ID}/result?fields=summary", fake.requests[0].path)
            told = json.loads(run(fake.url, "plot", ID, "--path", "--json").stdout)
        check(f"force of {name}, over the largest displacement" in lines[0] and len(lines) == 20 and all(len(line) <= 60 for line in lines), lines)
        check([point["displacement"] for point in told["points"]] == [case["summary"]["finite"]["displacement"] for case in cases] and
              told["points"][-1] == {"case": "p 5", "displacement": 0.5, "force": last}, told)
        rows = [line.find("*") for line in lines[1:-2]]
        drawn = [row for row in rows if row >= 0]
        check(drawn == sorted(drawn, reverse=aside == 0) and max(line.rfind("*") for line in lines[1:-2]) == 59, lines)
        check(lines[-1].split()[0] == "0" and lines[-1].split()[-1] == "0.5", lines)
    check(any(line.split()[:2] == ["10", "+"] for line in lines) and any(line.split()[:2] == ["0", "+"] for line in lines), lines)
    for reply in ({"summary": {}}, {"cases": [{"name": "a", "summary": {}}]}):
        with Fake((200, reply)) as fake:
            check("steps" in run(fake.url, "plot", ID, "--path", code=11).stderr)


# ------------------------------------------------------- delete and factors


@options("--workers", "1")
def test_delete_is_for_ended_jobs(server):
    running = run(server, "submit", "-", stdin=json.dumps(service.ENDLESS)).stdout.strip()
    server.wait_status(running, "running")
    done = run(server, "delete", running, code=4)
    check("uzawa cancel " + running in done.stderr and server.get(f"/v1/jobs/{running}").json["status"] == "running", done)
    run(server, "cancel", running)
    server.wait_status(running, "dismissed")
    check(run(server, "delete", running).stdout == "deleted\n")
    run(server, "delete", running, code=4)
    check(json.loads(run(server, "delete", solved(server), "--json").stdout)["status"] == "deleted")
    check(run(server, "delete", solved(server), "--quiet").stdout == "")


@options(None)
def test_delete_survives_a_lost_reply(_):
    ended = (200, {"id": ID, "status": "successful"})
    gone = (404, {"detail": "there is no job with this id"})
    for fault in ("drop", "cut", (503, "")):
        with Fake(ended, fault, gone) as fake:
            check(run(fake.url, "delete", ID).stdout == "deleted\n")
            check([request.method for request in fake.requests] == ["GET", "DELETE", "DELETE"])
    with Fake(ended, gone) as fake:
        run(fake.url, "delete", ID, code=4)


@options()
def test_factors(server):
    check(json.loads(run(server, "factors", "--json").stdout)["factors"] == [])
    solved(server), solved(server)
    lines = run(server, "factors").stdout.splitlines()
    check(len(lines) == 3 and lines[1].split()[1:3] == ["660", "30"] and lines[1].split()[4] == "1", lines)


def test_nodes(server):
    name = json.loads(run(server, "nodes", "--json").stdout)["nodes"][0]["name"]
    lines = run(server, "nodes").stdout.splitlines()
    check(len(lines) == 2 and lines[1].split()[:2] == [name, "active"], lines)


# ------------------------------------------------------------------ doctor


def doctor(url, code, **environment):
    lines = json.loads(run(url, "doctor", "--json", code=code, **environment).stdout)
    return {line["check"]: line for line in lines}


@options()
def test_doctor_of_a_healthy_service(server):
    found = doctor(server.url, 0)
    check(all(line["state"] == "ok" and line["remedy"] == "" for name, line in found.items() if name != "disk"), found)
    known = {"connection", "clock", "alive", "ready", "reading", "submitting", "version", "queue", "limits"}
    shared = "://" in server.db  # a database has its disk elsewhere
    check(known | ({"disk"} if not shared else set()) <= set(found), found)
    lines = run(server, "doctor").stdout.splitlines()
    check(all(line.startswith("ok ") for line in lines if " disk " not in line and line[0] != " "), lines)
    check(not any(line.startswith("ok ") for line in run(server, "doctor", "--quiet").stdout.splitlines()))
    check(json.loads(run(server, "list", "--json").stdout) == [], "it must leave no job")


@options("--workers", "1", "--max-queue", "1")
def test_doctor_sees_a_full_queue(server):
    for _ in range(2):
        job = run(server, "submit", "-", stdin=json.dumps(service.ENDLESS)).stdout.strip()
        if _ == 0:
            server.wait_status(job, "running")
    queue = doctor(server.url, 5)["queue"]
    check(queue["state"] == "wrong" and "full: 1 of 1" in queue["about"] and "--max-queue" in queue["remedy"], queue)


@options(None)
def test_doctor_without_a_service(_):
    for url, says, remedy in (("http://127.0.0.1:1", "Failed to connect", "is uzawad running"),
                              ("http://no-such-host.invalid:80", "resolve", "name")):
        found = doctor(url, 12)["connection"]
        check(says.lower() in found["about"].lower() and remedy in found["remedy"], found)
    with Fake((200, "<html>")) as fake:
        check(doctor(fake.url, 5)["service"]["state"] == "wrong")
        found = doctor(fake.url.replace("http:", "https:"), 12)["connection"]
        check("http://" in found["remedy"], found)
    with Fake("drop") as fake:
        check(doctor(fake.url, 12)["connection"]["state"] == "wrong")


def healthy(**headers):
    return 200, {"status": "ok", "workers": 2, "jobs": {"accepted": 0}}, headers


@options(None)
def test_doctor_of_an_ailing_service(_):
    allowed, listed = (200, {"valid": True}), (200, {"jobs": [], "next": None})
    metrics = (200, 'uzawad_build_info{version="9.9",compiler="x"} 1\nuzawad_queue_depth 95\nuzawad_store_free_bytes 5e8\n')
    limits = (200, {"limits": {"max_queue": {"value": 100}}})
    with Fake(healthy(), healthy(), listed, allowed, metrics, limits) as fake:
        found = doctor(fake.url, 0)
    for name, part in (("version", "9.9"), ("queue", "95 of 100"), ("disk", "0.5 GB")):
        check(found[name]["state"] == "warning" and part in found[name]["about"] and found[name]["remedy"], name, found)
    with Fake(healthy(), (503, {"title": "The store does not answer", "detail": "d", "code": "store_unavailable"}),
              (500, {"detail": "broken"})) as fake:
        found = doctor(fake.url, 5)
    check("disk" in found["ready"]["remedy"] and found["reading"]["about"] == "broken", found)


def clock_of(when):
    """A fake service whose clock says `when`."""
    date = email.utils.format_datetime(when, usegmt=True)
    reply = ("HTTP/1.1 200 OK\r\nDate: %s\r\nContent-Type: application/json\r\nContent-Length: %d\r\nConnection: close\r\n\r\n%s")
    body = json.dumps({"status": "ok", "workers": 1, "jobs": {}})
    return (reply % (date, len(body), body)).encode()


@options(None)
def test_doctor_compares_clocks(_):
    behind = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(hours=1)
    with Fake(clock_of(behind)) as fake:
        found = doctor(fake.url, None)
    check(found["clock"]["state"] == "warning" and "ahead of" in found["clock"]["about"], found)


def token_file(server, lines):
    path = os.path.join(server.folder, "tokens")
    with open(path, "w", encoding="utf-8") as file:
        file.write(lines)
    os.chmod(path, 0o600)
    return path


@options(None)
def test_doctor_checks_the_token(server):
    server.options = ("--token-file", token_file(server, f"reader read {'r' * 40}\nwriter submit {'w' * 40}\n"))
    server.start()
    found = doctor(server.url, 4, UZAWA_TOKEN="")
    check("none is set" in found["reading"]["about"] and "submitting" not in found, found)
    found = doctor(server.url, 4, UZAWA_TOKEN="x" * 40)
    check("does not know the token" in found["reading"]["about"], found)
    found = doctor(server.url, 4, UZAWA_TOKEN="r" * 40)
    check(found["reading"]["state"] == "ok" and found["submitting"]["state"] == "wrong", found)
    found = doctor(server.url, 0, UZAWA_TOKEN="w" * 40)
    check(found["submitting"]["state"] == "ok", found)


def certificate(folder, days):
    key, cert = os.path.join(folder, "key.pem"), os.path.join(folder, "cert.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days",
                    str(days), "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout",
                    key, "-out", cert], check=True, capture_output=True)
    os.chmod(key, 0o600)
    return key, cert


@options(None)
def test_doctor_checks_the_certificate(server):
    if not shutil.which("openssl"):
        raise Skip("openssl is not installed")
    key, cert = certificate(server.folder, 5)
    server.options = ("--tls-key", key, "--tls-cert", cert)
    process = subprocess.Popen(server.command("--listen", "127.0.0.1:0", "--db", server.db, *server.options),
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        url = process.stdout.readline().split()[-1]
        found = doctor(url, 12)["connection"]
        check("UZAWA_CA" in found["remedy"], found)
        found = doctor(url, 0, UZAWA_CA=cert)["certificate"]
        check(found["state"] == "warning" and "localhost" in found["about"] and "days left" in found["about"], found)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


# ---------------------------------------------------------- JSON everywhere


def test_json_of_every_command(server):
    job = solved(server)
    target = os.path.join(server.folder, "x.svg")
    answer = {"problem": json.load(open(SPRINGS))["problem"], "answer": {"displacements": [0, 0, 0], "reactions": [0, 0]}}
    lines = [["submit", SPRINGS], ["submit", SPRINGS, "--wait"], ["submit", SPRINGS, "--vary", "solver.max_iterations=100,200"],
             ["upload", "tests/data/springs_K.mtx"], ["status", job], ["wait", job], ["refine", job, "-a", "1e-9", "--wait"],
             ["result", job], ["picture", job, "-o", target], ["history", job], ["plot", job, "--deformed", "-o", target],
             ["list"], ["factors"], ["nodes"], ["doctor"]]
    for words in lines:
        done = run(server, *words, "--json")
        check(isinstance(json.loads(done.stdout), (dict, list)) and done.stderr == "", words, done)
    check(json.loads(run(server, "verify", "-", "--json", code=7, stdin=json.dumps(answer)).stdout)["status"] == "successful")
    check(json.loads(run(server, "delete", job, "--json").stdout)["status"] == "deleted")
    for words in (["version"], ["help"], ["help", "--format", "json"]):
        done = subprocess.run([CLIENT, *words, *([] if "--format" in words else ["--json"])], capture_output=True, text=True)
        check(json.loads(done.stdout)["version"], done)
    for words, code in ((["status", job], 4), (["wait", "0" * 32], 4), (["submit", "tests/none"], 11),
                        (["submit", SPRINGS, "--set", "x.y=1"], 2)):
        wrong = json.loads(run(server, *words, "--json", code=code).stderr)
        check(wrong["exit"] == code and wrong["detail"], wrong)


if __name__ == "__main__":
    service.main(globals())
