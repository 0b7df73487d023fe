"""CalculiX's decks as scenes, as far as these can say the same: one step of two elastic bodies without friction.

read(text) is a deck's cards; scene(cards) the request, or Unsaid with what a scene cannot say; printed(text) the
displacements that CalculiX prints for such a deck. Mesh, supports, forces at nodes and temperatures are taken over one by
one, so that both programs solve the same, but for CalculiX's penalty and, where a deck asks for it, large displacements."""
import math

KINDS = {"C3D8": ("hex8", "solid"), "C3D8I": ("hex8", "solid"), "C3D20": ("hex20", "solid"), "CAX8": ("quad8", "axisymmetric"),
         "CAX4": ("quad4", "axisymmetric"), "CPE4": ("quad4", "plane_strain"), "CPE8": ("quad8", "plane_strain"),
         "CPS4": ("quad4", "plane_stress"), "CPS8": ("quad8", "plane_stress")}
NODES = {"hex8": 8, "hex20": 20, "quad4": 4, "quad8": 8}
# Sides by the places of their corners, S1 first.
SIDES = {3: [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)], 2: [(0, 1), (1, 2), (2, 3), (3, 0)]}
# Cards that a scene says otherwise or needs not.
KNOWN = {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "BOUNDARY", "MATERIAL", "ELASTIC", "DENSITY", "EXPANSION", "SOLID SECTION", "CONTACT PAIR",
         "SURFACE INTERACTION", "SURFACE BEHAVIOR", "STEP", "STATIC", "CLOAD", "DLOAD", "TEMPERATURE", "INITIAL CONDITIONS", "NODE PRINT",
         "EL PRINT", "CONTACT PRINT", "NODE FILE", "EL FILE", "CONTACT FILE", "END STEP", "HEADING"}


class Unsaid(Exception):
    """A scene has no word for it."""


def read(text):
    """[(name, {parameter: value}, [fields of each line])], names and parameters in capitals; lines that end in a comma
    go on in the next one where elements need it."""
    cards = []
    for line in text.splitlines():
        line = line.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*"):
            name, *parameters = [part.strip() for part in line[1:].split(",")]
            pairs = [part.partition("=") for part in parameters if part]
            cards.append((name.upper(), {key.strip().upper(): value.strip() for key, _, value in pairs}, []))
        else:
            cards[-1][2].append([field.strip() for field in line.split(",")])
    return cards


def elements(rows, count):
    """Fields of all lines of an element card, an element of so many nodes after the other."""
    fields = [int(field) for row in rows for field in row if field]
    return {fields[k]: fields[k + 1:k + 1 + count] for k in range(0, len(fields), count + 1)}


class Deck:
    """What the cards say, by the deck's own numbers."""

    def __init__(self, cards):
        self.nodes, self.elements, self.kind, self.sets = {}, {}, None, {"NSET": {}, "ELSET": {}}
        self.young, self.poisson, self.expansion, self.sections, self.surfaces = {}, {}, {}, [], {}
        self.held, self.forces, self.pressures, self.heat, self.start, self.pair = {}, {}, [], {}, {}, None
        material, steps, slope = "", 0, math.inf
        for name, given, rows in cards:
            if name not in KNOWN or "CYCLIC SYMMETRY" in given:
                raise Unsaid(f"*{name}")
            if name == "NODE":
                self.nodes.update({int(row[0]): [float(x or 0) for x in (row[1:] + ["", ""])[:3]] for row in rows})
                self.add("NSET", given, [int(row[0]) for row in rows])
            elif name == "ELEMENT":
                if given["TYPE"].upper() not in KINDS or self.kind not in (None, KINDS[given["TYPE"].upper()]):
                    raise Unsaid(f"elements {given['TYPE']}")
                self.kind = KINDS[given["TYPE"].upper()]
                new = elements(rows, NODES[self.kind[0]])
                self.elements.update(new)
                self.add("ELSET", given, new)
            elif name in self.sets:
                self.add(name, given, [k for row in rows for field in row if field for k in self.of(name, field)])
            elif name == "SURFACE":
                self.surfaces[given["NAME"].upper()] = [(e, int(row[1][1:]) - 1) for row in rows for e in self.of("ELSET", row[0])]
            elif name == "MATERIAL":
                material = given["NAME"].upper()
            elif name == "ELASTIC":
                self.young[material], self.poisson[material] = map(float, rows[0][:2])
            elif name == "EXPANSION":
                self.expansion[material] = float(rows[0][0])
            elif name == "SOLID SECTION":
                self.sections.append((self.of("ELSET", given["ELSET"]), given["MATERIAL"].upper()))
            elif name == "CONTACT PAIR":
                if self.pair or given.get("TYPE", "").upper() != "SURFACE TO SURFACE" or "ADJUST" in given:
                    raise Unsaid("a contact pair of another kind, or a second one")
                self.pair = [field.upper() for field in rows[0][:2]]
            elif name == "SURFACE BEHAVIOR":
                if given.get("PRESSURE-OVERCLOSURE", "").upper() not in ("HARD", "LINEAR"):
                    raise Unsaid("soft contact")
                slope = float(rows[0][0]) if rows else slope
            elif name == "STEP":
                steps += 1
            else:
                self.act(name, given, rows)
        sides = [math.dist(self.nodes[e[0]], self.nodes[e[1]]) for e in self.elements.values()]
        if slope * min(sides, default=0) < max(self.young.values(), default=0):  # a penalty softer than an element
            raise Unsaid("soft contact")
        if steps != 1 or not self.pair:
            raise Unsaid(f"{steps} steps, {'a' if self.pair else 'no'} contact pair")

    def add(self, kind, given, members):
        if kind in given:
            self.sets[kind].setdefault(given[kind].upper(), []).extend(members)

    def of(self, kind, field):
        return [int(field)] if field.isdigit() else self.sets[kind][field.upper()]

    def act(self, name, given, rows):
        """Supports, loads and temperatures."""
        if name == "BOUNDARY":
            for row in rows:
                first, last, value = (row[1:] + ["", "", ""])[:3]
                for k in self.of("NSET", row[0]):
                    self.held.setdefault(k, {}).update({d: float(value or 0) for d in range(int(first), int(last or first) + 1)})
        elif name == "CLOAD":
            for row in rows:
                for k in self.of("NSET", row[0]):
                    self.forces.setdefault(k, [0.0, 0.0, 0.0])[int(row[1]) - 1] += float(row[2])
        elif name == "DLOAD":
            for row in rows:
                if not row[1].upper().startswith("P"):
                    raise Unsaid(f"the load {row[1]}")
                self.pressures += [(e, int(row[1][1:]) - 1, float(row[2])) for e in self.of("ELSET", row[0])]
        elif name == "TEMPERATURE":
            self.heat.update({k: float(row[1]) for row in rows for k in self.of("NSET", row[0])})
        elif name == "INITIAL CONDITIONS":
            self.start.update({k: float(row[1]) for row in rows for k in self.of("NSET", row[0])})


def scene(cards, discretization="surfaces"):
    """(request, the deck's number of each node)."""
    deck = Deck(cards)
    kind, model = deck.kind
    dim = 3 if model == "solid" else 2
    numbers = sorted({k for nodes in deck.elements.values() for k in nodes})
    place, order = {k: i for i, k in enumerate(numbers)}, sorted(deck.elements)
    at = {e: i for i, e in enumerate(order)}
    groups, problem = {}, {"kind": "scene", "model": model, "materials": [], "supports": [], "loads": []}

    def sides(members):
        return {"faces" if dim == 3 else "edges": [[place[deck.elements[e][c]] for c in SIDES[dim][s]] for e, s in members]}
    for k, (members, material) in enumerate(deck.sections):
        groups[f"section{k}"] = {"elements": [at[e] for e in members]}
        problem["materials"].append({"on": f"section{k}", "young": deck.young[material], "poisson": deck.poisson[material],
                                     **({"expansion": deck.expansion[material]} if deck.expansion.get(material) else {})})
    for name, surface in zip(("slave", "master"), deck.pair):
        groups[name] = sides(deck.surfaces[surface])
    values = {}
    for k, held in deck.held.items():
        for d, value in held.items():
            if k in place and d <= dim:
                values.setdefault((d, value), []).append(place[k])
    for k, ((d, value), nodes) in enumerate(values.items()):
        groups[f"held{k}"] = {"nodes": sorted(nodes)}
        problem["supports"].append({"on": f"held{k}", "u" + "xyz"[d - 1]: value})
    problem["loads"] += [{"node": place[k], "force": force[:dim]} for k, force in deck.forces.items() if k in place]
    for k, (e, s, value) in enumerate(deck.pressures):
        groups[f"pressed{k}"] = sides([(e, s)])
        problem["loads"].append({"on": f"pressed{k}", "pressure": value})
    for e, nodes in deck.elements.items():
        rise = {deck.heat.get(k, 0) - deck.start.get(k, 0) for k in nodes}
        if len(rise) > 1:
            raise Unsaid("a temperature that changes within an element")
        if rise != {0}:
            groups[f"warm{e}"] = {"elements": [at[e]]}
            problem["loads"].append({"on": f"warm{e}", "temperature": rise.pop()})
    problem["contacts"] = [{"on": "slave", "with": "master", "discretization": discretization}]
    problem["mesh"] = {"nodes": [deck.nodes[k][:dim] for k in numbers], "groups": groups,
                       "elements": {kind: [[place[k] for k in deck.elements[e]] for e in order]}}
    return {"problem": problem}, numbers


def stiffened(text, times):
    """The deck with a linear contact instead of its own: so many times E for the length of its shortest side."""
    deck, lines, own = Deck(read(text)), [], False
    side = min(math.dist(deck.nodes[e[0]], deck.nodes[e[1]]) for e in deck.elements.values())
    for line in text.splitlines():
        own = own and not line.lstrip().startswith("*")  # the numbers of its contact
        if line.lstrip().upper().startswith("*SURFACE BEHAVIOR"):
            own = True
            lines += ["*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{times * max(deck.young.values()) / side:.6g}"]
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
