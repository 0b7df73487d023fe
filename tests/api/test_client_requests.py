"""Requests that the client makes itself: from matrices and meshes, with values put in and varied.
usage: test_client_requests.py BUILD_DIR [FILTER]"""
# not under ThreadSanitizer: about answers, not about threads
import copy
import gzip
import hashlib
import json
import math
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import service
from fake_server import Fake
from service import check, options

SHARED = True  # one service for all tests

CLIENT = os.path.join(sys.argv[1] if len(sys.argv) > 1 else "build", "uzawa")
PAPER = "tests/data/paper_body.json"
MATRICES = {name: f"tests/data/springs_{name}.mtx" for name in "KNhp"}
ID = "0" * 31 + "1"


def run(url, *words, stdin=None, code=0, text=True):
    done = subprocess.run([CLIENT, "--server", url, *words], input=stdin, capture_output=True, text=text, timeout=90)
    check(done.returncode == code, f"{words}: exit {done.returncode}, want {code}\n{done.stdout}{done.stderr}")
    return done


def job(url, *words, stdin=None, code=0):
    return json.loads(run(url, "submit", *words, "--wait", "--json", stdin=stdin, code=code).stdout)


def sent(*words, stdin=None, answers=1):
    """What the client posts, as a server sees it that accepts everything."""
    with Fake(*[(202, {"id": ID, "status": "accepted", "progress": 0, "tags": []})] * answers) as fake:
        run(fake.url, "submit", *words, stdin=stdin)
        return [json.loads(request.body) for request in fake.requests if request.path == "/v1/jobs"]


def refused(*words, says, code=2, stdin=None):
    """Nothing may be sent, and stderr must have every part of `says`."""
    with Fake((202, {"id": ID, "status": "accepted"})) as fake:
        done = run(fake.url, "submit", *words, code=code, stdin=stdin)
        check(not fake.requests and done.stdout == "", fake.requests, done)
    for part in [says] if isinstance(says, str) else says:
        check(part in done.stderr, part, "is not in", done.stderr)


def matrices(without=""):
    return [word for name, path in MATRICES.items() if name not in without for word in ("--" + name, path)]


def scene(**more):
    return {**json.load(open(PAPER)), **more}


def test_requests_are_only_checked(server):
    """What they will take, or every mistake with its place; no job is made, for each of several requests."""
    before = len(server.get("/v1/jobs").json["jobs"])
    said = run(server.url, "submit", PAPER, "--validate").stdout
    check(said.startswith("valid: 660 unknowns, 30 contact conditions; about ") and " MB by the condensed operator" in said, said)
    done = run(server.url, "submit", PAPER, "--validate", "--vary", "materials.0.young=1e3,2e3")
    check([line.split(": ")[:2] for line in done.stdout.splitlines()] == [["1000", "valid"], ["2000", "valid"]] and not done.stderr, done)
    told = json.loads(run(server.url, "submit", PAPER, "--validate", "--json").stdout)
    check(told["valid"] is True and told["predicted"]["d"] == 660, told)
    check(run(server.url, "submit", PAPER, "--validate", "--quiet").stdout == "")
    wrong = scene()
    wrong["problem"]["model"], wrong["problem"]["foo"], wrong["problem"]["mesh"]["box"]["cells"] = "plane", 1, [0, 1]
    said = run(server.url, "submit", "-", "--validate", stdin=json.dumps(wrong), code=4).stderr
    check([line.split("at ")[1] for line in said.splitlines() if line.startswith("  at ")] == ["/problem/foo", "/problem/model", "/problem/mesh/box/cells/0"] and said.count("uzawa: ") == 3, said)
    told = json.loads(run(server.url, "submit", "-", "--validate", "--json", stdin=json.dumps(wrong), code=4).stderr)
    check(len(told["mistakes"]) == 3 and told["exit"] == 4, told)
    inside = scene()
    inside["problem"]["contacts"][0]["obstacle"]["plane"]["point"] = [0, 1]
    inside["problem"]["supports"].append({"on": "bottom", "uy": 0})
    check("obstacle" in run(server.url, "submit", "-", "--validate", stdin=json.dumps(inside), code=4).stderr)
    with Fake((200, {"valid": True, "predicted": None}), (200, {"valid": True, "predicted": {"d": 9, "m": 3, "operator": "factored", "bytes": 2e9, "seconds": 3.0, "fits": False}})) as fake:
        check("is not known" in run(fake.url, "submit", PAPER, "--validate").stdout)
        said = run(fake.url, "submit", PAPER, "--validate").stdout
        check("2e+03 MB" in said and "would be refused" in said, said)
    check(len(server.get("/v1/jobs").json["jobs"]) == before)


# ------------------------------------------------------------------ files


def test_matrices_from_files(server):
    answer = job(server.url, *matrices())
    check(answer["summary"]["outcome"] == "converged" and answer["summary"]["problem"]["d"] == 3, answer)
    linear = job(server.url, *matrices("Nh"), "--tag", "free")
    check(linear["summary"]["method"] == "linear" and linear["tags"] == ["free"], linear)
    with open(MATRICES["p"], encoding="utf-8") as file:
        again = job(server.url, *matrices("p"), "--p", "-", stdin=file.read())
    check(again["summary"]["energy"] == answer["summary"]["energy"], again["summary"])


@options(None)
def test_matrices_into_a_request(_):
    body = {"problem": {"kind": "matrices", "K": "old", "p": [1, 2, 3], "N": "n", "h": [0]}, "solver": {"accuracy": "quick"}}
    request, = sent("-", "--K", MATRICES["K"], stdin=json.dumps(body))
    check(request["problem"] == {**body["problem"], "K": open(MATRICES["K"]).read()}, request)
    check(request["solver"] == body["solver"], request)
    request, = sent("-", *matrices(), stdin='{"solver": {"method": "active_set"}}')
    check(request["problem"]["kind"] == "matrices" and request["solver"]["method"] == "active_set", request)


@options(None)
def test_files_that_do_not_go_together(_):
    refused("--K", MATRICES["K"], says="--K and --p")
    refused(*matrices("h"), says="both or neither")
    refused("--mesh", "part.msh", says="wants a FILE")
    refused(PAPER, "--mesh", "part.msh", "--K", MATRICES["K"], says="choose one")
    refused("-", "--mesh", "-", says="only one file")
    refused(PAPER, *matrices(), says="the problem of FILE is none")
    refused("tests/data/small_matrices.json", "--mesh", "-", says="the problem of FILE is none", stdin="x")
    refused("--K", "tests/none.mtx", "--p", MATRICES["p"], says="tests/none.mtx", code=11)
    refused("-", "--set", "solver.accuracy=quick", stdin='{\n"problem": }', says="line 2", code=11)
    refused("-", "--set", "solver.accuracy=quick", stdin="[1]", says="no object", code=11)


def test_large_files_are_uploaded_once(server):
    size = 9000
    lines = [f"%%MatrixMarket matrix coordinate real symmetric\n{size} {size} {size}"]
    big = "\n".join(lines + [f"{i + 1} {i + 1} 2" for i in range(size)]) + "\n"
    load = f"%%MatrixMarket matrix array real general\n{size} 1\n" + "1\n" * size
    names = {name: os.path.join(server.folder, name) for name in ("K.mtx", "K.mtx.gz", "p.mtx")}
    for name, data in (("K.mtx", big.encode()), ("K.mtx.gz", gzip.compress(big.encode())), ("p.mtx", load.encode())):
        with open(names[name], "wb") as file:
            file.write(data)
    for stiffness in ("K.mtx", "K.mtx", "K.mtx.gz"):
        done = job(server.url, "--K", names[stiffness], "--p", names["p.mtx"])
        check(done["summary"]["outcome"] == "converged", done)
    digest = hashlib.sha256(big.encode()).hexdigest()
    check(server.get(f"/v1/uploads/{digest}").json["used_by"] == 3)
    posted = [line for line in server.get("/metrics").body.decode().splitlines()
              if line.startswith("uzawad_http_request_seconds_count") and 'route="/v1/uploads"' in line]
    check(posted and posted[0].endswith(" 2"), "sent once, and once packed:", posted)


def test_mesh_from_a_file(server):
    path = os.path.join(server.folder, "part.msh")
    body = scene()
    with open(path, "w", encoding="utf-8") as file:
        file.write(GMSH)
    body["problem"]["supports"] = [{"on": "left", "ux": 0, "uy": 0}]
    body["problem"]["loads"] = [{"on": "right", "traction": [0.5, 0]}]
    body["problem"]["contacts"] = []
    del body["problem"]["mesh"]
    done = job(server.url, "-", "--mesh", path, stdin=json.dumps(body))
    check(done["summary"]["outcome"] == "converged" and done["summary"]["problem"]["d"] > 0, done)
    done = run(server.url, "submit", "-", "--mesh", "tests/data/springs_K.mtx", stdin=json.dumps(body), code=4)
    check("/problem/mesh/gmsh" in done.stderr, done.stderr)


def test_a_text_of_another_system(server):
    """By a byte order mark before it files were taken for another format, or refused; UTF-16 is told. A pipe is read once: what tells the
    format of a mesh without a name was missing in it."""
    body = scene()
    body["problem"].update(supports=[{"on": "property_3", "ux": 0, "uy": 0, "uz": 0}], loads=[], contacts=[], model="solid")
    del body["problem"]["mesh"], body["problem"]["thickness"]
    with open("tests/data/meshes/meshio_hex20.bdf", encoding="utf-8") as file:
        bulk = file.read()
    for text, key in ((bulk, "nastran"), (INPUT_FILE, "abaqus"), (GMSH, "gmsh")):
        asked = copy.deepcopy(body) if key == "nastran" else scene(problem={**body["problem"], "model": "plane_stress", "supports": [{"on": "LEFT" if key == "abaqus" else "left", "ux": 0, "uy": 0}]})
        asked["problem"]["mesh"] = {key: text}
        if key != "nastran":
            asked["problem"]["materials"] = [{**asked["problem"]["materials"][0], "on": "Body" if key == "abaqus" else "body"}]
        plain = server.post(asked, query="?validate=true")
        asked["problem"]["mesh"] = {key: "\ufeff" + text}
        marked = server.post(asked, query="?validate=true")
        check(plain.status == marked.status and plain.json.get("d") == marked.json.get("d") and plain.json.get("line") == marked.json.get("line"), key, plain, marked)
        digest = service.expect(server.request("POST", "/v1/uploads", text.encode("utf-16")), 201).json["id"]
        asked["problem"]["mesh"] = {key: {"upload": digest}}
        reply = service.expect(server.post(asked), 422, "text_encoding")
        check("UTF-8" in reply.json["detail"] and reply.json["pointer"].startswith(f"/problem/mesh/{key}"), reply)
    for mark in "", "\ufeff":
        end, into = os.pipe()
        with subprocess.Popen([CLIENT, "--server", server.url, "submit", "-", "--validate", "--mesh", f"/dev/fd/{end}"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, pass_fds=[end]) as client, open(into, "wb") as pipe:
            os.close(end)
            pipe.write((mark + bulk).encode())
            pipe.close()
            out, err = client.communicate(json.dumps(body).encode(), timeout=60)
        check(client.returncode == 0 and b"valid" in out, out, err)


def test_mesh_of_an_input_file(server):
    path = os.path.join(server.folder, "part.inp")
    body = scene()
    problem = body["problem"]
    problem["supports"], problem["contacts"] = [{"on": "left", "ux": 0, "uy": 0}], []
    problem["loads"], problem["materials"][0]["on"] = [{"on": "PULLED", "traction": [0.5, 0]}], "Body"
    del problem["mesh"]
    told = []
    for text in (INPUT_FILE, INPUT_FILE.replace("CPS4R", "CPS4I")):
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        told.append(job(server.url, "-", "--mesh", path, stdin=json.dumps(body))["summary"])
    problem["mesh"] = {"gmsh": GMSH}
    problem["loads"][0]["on"], problem["materials"][0]["on"] = "right", "body"
    same = job(server.url, "-", stdin=json.dumps(body))["summary"]
    for one in told:
        check(one["outcome"] == "converged" and abs(one["energy"]["primal"] / same["energy"]["primal"] - 1) < 1e-12, one["energy"], same["energy"])
    with open(path, "w", encoding="utf-8") as file:
        file.write(INPUT_FILE + "*INCLUDE, INPUT=more.inp\n")
    del problem["mesh"]
    done = run(server.url, "submit", "-", "--mesh", path, stdin=json.dumps(body), code=4)
    check("*INCLUDE is not read" in done.stderr and "/problem/mesh/abaqus" in done.stderr, done.stderr)
    problem["mesh"] = {"abaqus": INPUT_FILE + "*NSET, NSET=gone\n77\n"}
    reply = server.post(body, query="?validate=true")
    check(reply.status == 422 and reply.json["code"] == "abaqus_syntax" and reply.json["line"] == 20, reply)


def test_meshes_of_other_programs(server):
    """Hexahedra that meshio has written, known by the name of the file and by what is in it."""
    path, body = os.path.join(server.folder, "part.txt"), scene()
    problem = body["problem"]
    del problem["mesh"], problem["thickness"]
    problem.update(model="solid", contacts=[])

    def same(sent, names, stdin):
        told = job(server.url, "-", "--mesh", sent, stdin=json.dumps(stdin))["summary"]
        # a bar of two cubes, pulled by 0.5 / (1 * 1) at its upper face
        check(told["outcome"] == "converged" and told["problem"]["d"] == 3 * (32 - 8), sent, names, told)
        return told["energy"]["primal"]

    told = []
    for ending, left, top in ((".bdf", "property_3", "property_4"), (".vtu", "part_3", "part_4"), ("_zlib.vtu", "part_3", "part_4"),
                              (".vtk", "part_3", "part_4")):
        problem["supports"] = [{"on": left, "ux": 0, "uy": 0, "uz": 0}]
        problem["loads"] = [{"on": top, "pressure": 0.5}]
        file = f"tests/data/meshes/meshio_hex20{ending}"
        with open(file, "rb") as given, open(path, "wb") as other:
            other.write(given.read())
        told += [same(sent, left, body) for sent in (file, path)]
    check(max(told) - min(told) < 1e-12 * abs(told[0]), told)
    problem["mesh"] = {"nastran": "GRID,1,5,0.,0.\n"}
    reply = server.post(body, query="?validate=true")
    check(reply.status == 422 and reply.json["code"] == "nastran_unsupported" and reply.json["line"] == 1, reply)
    check(reply.json["pointer"] == "/problem/mesh/nastran", reply)


def test_a_whole_deck(server):
    """Two squares on each other, pressed: the pressure goes through the contact as it is."""
    path, out = os.path.join(server.folder, "squares.inp"), os.path.join(server.folder, "squares.json")

    def write(text):
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    write(DECK)
    done = run(server.url, "submit", path, "--wait", "--json")
    check(done.stderr.splitlines() == ["uzawa: line 30: *SURFACE BEHAVIOR: hard contact in place of a spring of 1e+07 between the "
                                       "surfaces, which gives way by about 5e-05 of what the body does"], done.stderr)
    summary = json.loads(done.stdout)["summary"]
    check(summary["outcome"] == "converged" and abs(summary["contact"]["force"][1] / 20 - 1) < 1e-6, summary["contact"])
    # the same by way of a file, which tells everything and may be changed
    done = run(server.url, "import", path, "-o", out)
    check("line 40: *NODE PRINT" in done.stderr and "says nothing about the answer" in done.stderr, done.stderr)
    problem = json.load(open(out))["problem"]
    check(problem["model"] == "plane_strain" and problem["contacts"] == [{"on": "SLAVE", "with": "MASTER"}], problem)
    twice = job(server.url, out, "--set", "loads.0.pressure=20")["summary"]
    check(abs(twice["contact"]["force"][1] / 40 - 1) < 1e-6, twice["contact"])
    # what would change the answer is refused, with its line, and may be left out
    write(DECK.replace("*STEP", "*FRICTION\n0.1\n*STEP", 1))
    done = run(server.url, "submit", path, "--wait", code=4)
    check("*FRICTION: the coefficient 0.1 is left out" in done.stderr and "line 32" in done.stderr, done.stderr)
    done = run(server.url, "submit", path, "--leave-out", "--wait", "--json")
    check("line 32: *FRICTION" in done.stderr and json.loads(done.stdout)["summary"]["energy"] == summary["energy"], done.stderr)
    check(run(server.url, "import", path, "--leave-out", "--quiet").stderr == "")
    # without the client, also uploaded and packed
    reply = server.request("POST", "/v1/decks", {"abaqus": DECK})
    check(reply.status == 200 and reply.json["request"]["problem"] == problem and reply.json["node_numbers"][4:6] == [11, 12], reply)
    digest = server.request("POST", "/v1/uploads", DECK.encode()).json["id"]
    check(server.request("POST", "/v1/decks", {"abaqus": {"upload": digest}}).json == reply.json)
    with gzip.open(path + ".gz", "wb") as file:
        file.write(DECK.encode())
    run(server.url, "import", path + ".gz", "-o", out, "--quiet")
    check(json.load(open(out))["problem"] == problem)
    for body, status, code in (({"abaqus": "*NODE\n1, x\n"}, 422, "abaqus_syntax"), ({"abaqus": {"upload": "0" * 64}}, 422, "unknown_upload"),
                               ({"abaqus": "x", "gmsh": "x"}, 422, "unknown_key"), ({}, 422, "missing_key")):
        reply = server.request("POST", "/v1/decks", body)
        check(reply.status == status and reply.json["code"] == code, body, reply)


def test_rigid_bodies_of_decks(server):
    """The lid of the upper square held and turned by a node beside it: the same scene as written by hand."""
    head, tail = DECK.split("*STEP", 1)
    lid = ("*NODE\n98, 1, 3\n99, 1, 3\n*NSET, NSET=LID\n13, 14\n*RIGID BODY, NSET=LID, REF NODE=98, ROT NODE=99\n*STEP" + tail.split("*BOUNDARY")[0] +
           "*BOUNDARY\n1, 1, 2\n2, 1, 2\n98, 1, 1, 0.\n99, 3, 3, 0.001\n*CLOAD\n98, 2, -20.\n*END STEP\n")
    reply = server.request("POST", "/v1/decks", {"abaqus": head + lid})
    check(reply.status == 200, reply)
    problem = reply.json["request"]["problem"]
    rigid = problem["supports"][0]["rigid"]
    check(problem["supports"][0]["on"] == "LID" and rigid["point"] == [1, 3] and rigid["ux"] == 0 and abs(rigid["rz"] - math.degrees(1e-3)) < 1e-12, problem)
    check(problem["loads"] == [{"on": "LID", "force": [0, -20], "at": [1, 3], "moment": [0]}], problem["loads"])
    summary = server.solve({"problem": problem})["summary"]
    held = summary["resultants"]["supports"][0]["rigid"]
    check(summary["outcome"] == "converged" and abs(summary["contact"]["force"][1] / 20 - 1) < 1e-6, summary["contact"])
    check(abs(held["displacement"][0]) < 1e-15 and abs(held["rotation"][0] - math.degrees(1e-3)) < 1e-9, held)


DECK = """*HEADING
two squares
*NODE
1, 0, 0
2, 2, 0
3, 2, 1
4, 0, 1
11, 0, 1
12, 2, 1
13, 2, 2
14, 0, 2
*ELEMENT, TYPE=CPE4, ELSET=LOW
1, 1, 2, 3, 4
*ELEMENT, TYPE=CPE4, ELSET=HIGH
2, 11, 12, 13, 14
*NSET, NSET=SIDES
1, 4, 11, 14
*MATERIAL, NAME=EL
*ELASTIC
1000., 0.25
*SOLID SECTION, ELSET=LOW, MATERIAL=EL
*SOLID SECTION, ELSET=HIGH, MATERIAL=EL
*SURFACE, NAME=SLAVE
HIGH, S1
*SURFACE, NAME=MASTER
LOW, S3
*CONTACT PAIR, INTERACTION=I1, TYPE=SURFACE TO SURFACE
SLAVE, MASTER
*SURFACE INTERACTION, NAME=I1
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
1.E7
*STEP
*STATIC
*BOUNDARY
SIDES, 1
1, 2
2, 2
*DLOAD
2, P3, 10.
*NODE PRINT, NSET=SIDES
U
*END STEP
"""

INPUT_FILE = """*HEADING
two quadrilaterals
*NODE
1, 0, 0
2, 30, 0
3, 60, 0
4, 0, 20
5, 30, 20
6, 60, 20
*ELEMENT, TYPE=CPS4R, ELSET=Body
10, 1, 2, 5, 4
20, 2, 3, 6, 5
*NSET, NSET=left
1, 4
*SURFACE, NAME=PULLED
20, S2
*MATERIAL, NAME=passed over
*ELASTIC
"""

# Two quad4 in a row, with the groups that the scene names.
GMSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "left"
1 2 "right"
2 3 "body"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 30 0 0
3 60 0 0
4 0 20 0
5 30 20 0
6 60 20 0
$EndNodes
$Elements
4
1 1 2 1 1 1 4
2 1 2 2 2 3 6
3 3 2 3 3 1 2 5 4
4 3 2 3 3 2 3 6 5
$EndElements
"""


# -------------------------------------------------------------------- --set


@options(None)
def test_values_are_put_in(_):
    request, = sent(PAPER, "--set", "loads.1.traction.0=0.25", "--set", "problem.materials.0.young=70e3", "--set",
                    "solver.accuracy.relative_error=1e-3", "--set", "thickness=2", "--set", "tags=[\"a\"]", "--tag", "b",
                    "--set", "loads.2={\"on\": \"top\", \"pressure\": 1}", "--set", "webhook.url=http://h/x=1")
    problem = request["problem"]
    check(problem["loads"][1]["traction"][0] == 0.25 and problem["materials"][0]["young"] == 70e3, problem)
    check(request["solver"]["accuracy"] == {"relative_error": 1e-3} and problem["thickness"] == 2, request)
    check(request["tags"] == ["a", "b"] and problem["loads"][2]["pressure"] == 1, request)
    check(request["webhook"] == {"url": "http://h/x=1"}, request)
    untouched = scene()["problem"]
    check(problem["mesh"] == untouched["mesh"] and problem["contacts"] == untouched["contacts"], problem)
    request, = sent(PAPER, "--set", "solver.accuracy=quick", "--set", "problem.model=plane_strain", "--set", "priority=3")
    check(request["solver"]["accuracy"] == "quick" and request["problem"]["model"] == "plane_strain", request)
    check(request["priority"] == 3, request)


@options(None)
def test_numbers_stay_what_they_are(_):
    body = {"problem": {"kind": "matrices", "K": "k", "p": [0.1, 1e-300, 123456789012345678, -0.0, 1.7976931348623157e308]}}
    request, = sent("-", "--set", "solver.accuracy=quick", stdin=json.dumps(body))
    check(repr(request["problem"]) == repr(body["problem"]), request)


@options(None)
def test_without_changes_the_file_goes_as_it_is(_):
    with Fake((202, {"id": ID, "status": "accepted"})) as fake:
        run(fake.url, "submit", PAPER)
        check(fake.requests[0].body == open(PAPER, "rb").read())


@options(None)
def test_wrong_paths_say_what_is_there(_):
    cases = [("laods.1.traction.0=1", ["problem has no \"laods\"", "it has: kind, model"]),
             ("loads.7.traction.0=1", ["problem.loads is a list of 2", "0 to 1"]),
             ("loads.x=1", ["is none of its indices"]),
             ("loads.1.tracton.0=1", ["problem.loads.1 has no \"tracton\"", "it has: on, traction"]),
             ("loads.1.traction.0.x=1", ["is a single value"]),
             ("problem.mesh.bax.cells=1", ["problem.mesh has no \"bax\"", "it has: box"]),
             ("loads..0=1", ["is no path"]), ("=1", ["empty"]), ("loads", ["PATH=VALUE"]),
             (".".join("a" * 40) + "=1", ["is no path"]), ("a" * 300 + "=1", ["255"])]
    for word, says in cases:
        refused(PAPER, "--set", word, says=says)
    refused("-", "--set", "loads.0=1", says="the request has no \"problem\"", stdin='{"solver": {}}')


def test_a_new_key_is_the_servers_to_judge(server):
    done = run(server.url, "submit", PAPER, "--set", "materials.0.yong=3", code=4)
    check("/problem/materials/0" in done.stderr and "yong" in done.stderr, done.stderr)


# ------------------------------------------------------------------- --vary


def test_loads_become_cases(server):
    done = job(server.url, PAPER, "--vary", "loads.1.traction.0=0.1:1.0:10")
    check(done["summary"]["cases"]["count"] == 10, done["summary"]["cases"])
    whole = json.loads(run(server.url, "result", done["id"], "--field", "reactions").stdout)
    check([case["name"] for case in whole["cases"]] == ["0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"],
          [case["name"] for case in whole["cases"]])
    single = job(server.url, PAPER, "--set", "loads.1.traction.0=0.3")
    answer = json.loads(run(server.url, "result", single["id"], "--field", "reactions").stdout)["reactions"]
    worst = max(abs(a - b) for a, b in zip(answer, whole["cases"][2]["reactions"]))
    check(worst < 1e-6 * max(map(abs, answer)), worst)


@options(None)
def test_several_make_every_combination(_):
    request, = sent(PAPER, "--vary", "loads.0.traction.1=-0.05,-0.1", "--vary", "loads.1.traction=[0.1,0],[0.2,0],[0.3,0]")
    cases = request["cases"]
    check([case["name"] for case in cases][:2] == ["-0.05,[0.1,0]", "-0.05,[0.2,0]"] and len(cases) == 6, cases)
    check([case["loads"][0]["traction"][1] for case in cases] == [-0.05] * 3 + [-0.1] * 3, cases)
    check([case["loads"][1]["traction"][0] for case in cases] == [0.1, 0.2, 0.3] * 2, cases)
    check(request["problem"] == scene()["problem"], "the problem keeps its own load")
    body = {"problem": {"kind": "matrices", "K": "k", "p": [1, 2], "N": "n", "h": [0]}}
    request, = sent("-", "--vary", "p.1=3,4", "--vary", "h.0=0,1", stdin=json.dumps(body))
    check(request["cases"] == [{"name": "3,0", "p": [1, 3], "h": [0]}, {"name": "3,1", "p": [1, 3], "h": [1]},
                               {"name": "4,0", "p": [1, 4], "h": [0]}, {"name": "4,1", "p": [1, 4], "h": [1]}], request)


def test_other_values_become_jobs(server):
    done = run(server.url, "submit", PAPER, "--vary", "materials.0.young=70e3,210e3", "--vary", "loads.1.traction.0=0.1,0.2",
               "--vary", "materials.0.poisson=0.2:0.3:2", "--wait", "--json")
    jobs = json.loads(done.stdout)
    check(len(jobs) == 4 and all(one["summary"]["cases"]["count"] == 2 for one in jobs), jobs)
    common = set.intersection(*[set(one["tags"]) for one in jobs]) - {"paper"}
    check(len(common) == 1 and next(iter(common)).startswith("vary-"), common)
    check([one["tags"][-1] for one in jobs] == ["70000,0.2", "70000,0.3", "210000,0.2", "210000,0.3"],
          [one["tags"] for one in jobs])
    shown = run(server.url, "submit", PAPER, "--vary", "materials.0.young=70e3,210e3", "--tag", "metals", "--wait")
    check(len(shown.stdout.splitlines()) == 3 and shown.stdout.count("converged") == 2 and shown.stderr == "", shown)
    ids = run(server.url, "submit", PAPER, "--vary", "materials.0.young=1e3,2e3", "--tag", "metals").stdout.split()
    listed = run(server.url, "list", "--tag", "metals", "--quiet").stdout.split()
    check(len(ids) == 2 and len(listed) == 4 and set(ids) <= set(listed), ids, listed)
    again = [run(server.url, "submit", PAPER, "--vary", "thickness=1,2", "--key", key, *tags).stdout
             for key, tags in (("k", ["--tag", "t"]), ("untagged", [])) for _ in range(2)]
    check(again[0] == again[1] and again[2] == again[3] and len(set(" ".join(again).split())) == 4, again)


def test_the_worst_of_several_is_the_exit_status(server):
    limited = scene(solver={"method": "accelerated_restart"})
    run(server.url, "submit", "-", "--vary", "solver.max_iterations=3,100000", "--tag", "t", "--wait", "--quiet",
        stdin=json.dumps(limited), code=7)
    run(server.url, "submit", "-", "--vary", "solver.max_iterations=3,x", "--tag", "t", "--wait", "--quiet",
        stdin=json.dumps(limited), code=4)


@options(None)
def test_wrong_variations(_):
    cases = [("loads.1.traction.0=1:2", "FIRST:LAST:COUNT"), ("loads.1.traction.0=1:2:1", "FIRST:LAST:COUNT"),
             ("loads.1.traction.0=1:2:99999", "FIRST:LAST:COUNT"), ("loads.1.traction.0=1:inf:3", "FIRST:LAST:COUNT"),
             ("loads.1.traction.0=", "no list"), ("loads.1.traction.0=1,,2", "no list"), ("loads.1.traction.0", "PATH=VALUES"),
             ("loads.1.traction.7=1,2", "0 to 1"), ("materials.0.yong=1,2", "has no \"yong\""),
             ("loads.1.traction.0=1,1.0", "twice")]
    for word, says in cases:
        refused(PAPER, "--vary", word, says=says)
    with_cases = scene(cases=[{"name": "a", "loads": []}])
    refused("-", "--vary", "loads.1.traction.0=1,2", says="cases of its own", stdin=json.dumps(with_cases))
    refused(PAPER, "--vary", "loads.1.traction.0=0:1:200", "--vary", "loads.0.traction.1=0:1:200", says="10000 cases")
    refused(PAPER, "--vary", "thickness=1:2:2000", says="1000 jobs")


if __name__ == "__main__":
    service.main(globals())
