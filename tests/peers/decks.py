"""Decks of CalculiX, made scenes by the daemon and solved by CalculiX itself.

translate(s, text) is the daemon's request for a deck, with the deck's number of each node, or Unsaid with what it says of
what it cannot take; first_step(text, numbers) the deck's first step as CalculiX has to solve it for a comparison;
stiffened(text, request, times) the same with a stiff contact; printed(text) the displacements that CalculiX prints."""
import gzip
import math
import pathlib
import re

# Sides by the places of their corners, S1 first.
SIDES = {3: [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)], 2: [(0, 1), (1, 2), (2, 3), (3, 0)]}
# Left out of a deck and of CalculiX's as well, they leave the same problem.
LATER = ("*STEP: ",)


class Unsaid(Exception):
    """A scene has no word for it."""


def contact_decks(folder):
    """(name, text) of those that have a contact pair or a tie, but ties of a sector to itself; some are packed."""
    for path in sorted(pathlib.Path(folder).iterdir()):
        if path.name.endswith((".inp", ".inp.gz")):
            text = (gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()).decode("latin-1")
            tie = re.search(r"(?im)^\*tie", text) and not re.search(r"(?im)^\*cyclic\s*symmetry", text)
            if re.search(r"(?im)^\*contact\s*pair", text) or tie:
                yield path.name.split(".")[0], text


def translate(s, text):
    """(request, numbers, what is left out). Refused is what would leave another problem."""
    body = {"abaqus": text.encode("latin-1").decode("ascii", "replace")}
    reply = s.request("POST", "/v1/decks", body)
    if reply.status == 422:
        first = reply.json["detail"]
        reply = s.request("POST", "/v1/decks", {**body, "leave_out": True})
        left = [note for note in reply.json.get("notes", []) if note["effect"] == "left_out"]
        if reply.status != 200 or not all(f"{note['keyword']}: {note['text']}".startswith(LATER) for note in left):
            raise Unsaid(first)
    left = [f"{note['keyword']}: {note['text']}" for note in reply.json["notes"] if note["effect"] == "left_out"]
    return reply.json["request"], reply.json["node_numbers"], left


def first_step(text, numbers):
    """The deck as far as its first step ends, where the displacements of all nodes are printed."""
    end = re.search(r"(?im)^\*end\s*step", text)
    head = re.sub(r"(?im)^\*(node|el|contact)\s*(print|file)[^\n]*\n(?:[^*\n][^\n]*\n)*", "", text[:end.start()])
    step = re.search(r"(?im)^\*step", head).start()
    nodes = "\n".join(f"{number}," for number in numbers)
    return (f"{head[:step]}*NSET, NSET=COMPARED\n{nodes}\n{head[step:]}"
            "*NODE PRINT, NSET=COMPARED, FREQUENCY=100000\nU\n*END STEP\n")


def stiffened(text, request, times):
    """The deck with a linear contact instead of its own: so many times E for the length of its shortest side."""
    mesh, lines, own = request["problem"]["mesh"], [], False
    side = min(math.dist(mesh["nodes"][e[0]], mesh["nodes"][e[1]]) for kind in mesh["elements"].values() for e in kind)
    young = max(material["young"] for material in request["problem"]["materials"])
    for line in text.splitlines():
        own = own and not line.lstrip().startswith("*")  # the numbers of its contact
        if line.lstrip().upper().startswith("*SURFACE BEHAVIOR"):
            own = True
            lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{times * young / side:.6g}"]
        elif not own:
            lines.append(line)
    return "\n".join(lines) + "\n"


def printed(text):
    """{node: displacement} of the last block that was printed."""
    if "displacements (" not in text:
        return {}
    found = {}
    for line in text.rsplit("displacements (", 1)[1].splitlines()[1:]:
        fields = line.split()
        if fields and not fields[0].isdigit():
            break
        if len(fields) == 4:
            found[int(fields[0])] = [float(x) for x in fields[1:]]
    return found
