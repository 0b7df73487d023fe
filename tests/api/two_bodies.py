"""Meshes of two bodies, made of plates or bricks that are mapped to their place: requests of scenes."""
import itertools

PLANE = ["tri3", "quad4", "tri6", "quad8"]
SOLID = ["hex8", "tet4", "wedge6", "hex20", "tet10", "wedge15"]
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
# Parts of a brick by its corners, edges with a node amid them, and faces.
TETS = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
PIECES = {"hex": [tuple(range(8))], "tet": TETS, "wedge": [(0, 2, 1, 4, 6, 5), (0, 3, 2, 4, 7, 6)]}
EDGES = {"hex": [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)],
         "tet": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
         "wedge": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]}
FACES = {"hex": [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
         "tet": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)],
         "wedge": [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)]}


def plate(kind, cells, first, place):
    """The unit square in cells, mapped by place(x, y): nodes, elements (numbered from first) and edges by side."""
    step = 2 if kind in ("quad8", "tri6") else 1
    wide, high = step * cells[0], step * cells[1]
    number, nodes, elements = {}, [], []

    def node(i, j):
        if (i, j) not in number:
            number[i, j] = first + len(nodes)
            nodes.append(list(place(i / wide, j / high)))
        return number[i, j]

    for j, i in itertools.product(range(0, high, step), range(0, wide, step)):
        a, b, c, d = (i, j), (i + step, j), (i + step, j + step), (i, j + step)
        ab, bc, cd, da, ac = (i + 1, j), (i + 2, j + 1), (i + 1, j + 2), (i, j + 1), (i + 1, j + 1)
        elements += [[node(*x) for x in e] for e in
                     {"quad4": [[a, b, c, d]], "quad8": [[a, b, c, d, ab, bc, cd, da]],
                      "tri3": [[a, b, c], [a, c, d]], "tri6": [[a, b, c, ab, bc, ac], [a, c, d, ac, cd, da]]}[kind]]
    edges = {"bottom": [((k, 0), (k + step, 0)) for k in range(0, wide, step)],
             "top": [((k, high), (k + step, high)) for k in range(0, wide, step)],
             "left": [((0, k), (0, k + step)) for k in range(0, high, step)],
             "right": [((wide, k), (wide, k + step)) for k in range(0, high, step)]}
    return nodes, elements, {side: [[node(*x) for x in e] for e in pairs] for side, pairs in edges.items()}


def brick(kind, cells, first, place):
    """The same of the unit cube, its sides named x0, x1, y0, ..."""
    shape, step = kind.rstrip("0123456789"), 2 if kind in ("hex20", "tet10", "wedge15") else 1
    size = [step * n for n in cells]
    number, nodes, elements, faces = {}, [], [], {f"{axis}{end}": [] for axis in "xyz" for end in "01"}

    def node(at):
        if at not in number:
            number[at] = first + len(nodes)
            nodes.append(list(place(*(i / n for i, n in zip(at, size)))))
        return number[at]

    for cell in itertools.product(*(range(0, n, step) for n in size)):
        corner = [tuple(i + step * c for i, c in zip(cell, at)) for at in CORNERS]
        for piece in PIECES[shape]:
            mine = [corner[c] for c in piece]
            middles = [tuple((i + j) // 2 for i, j in zip(mine[a], mine[b])) for a, b in EDGES[shape]]
            elements.append([node(x) for x in mine + (middles if step == 2 else [])])
            for axis, end in itertools.product(range(3), (0, 1)):
                faces["xyz"[axis] + "01"[end]] += [[node(mine[c]) for c in face] for face in FACES[shape]
                                                   if all(mine[c][axis] == end * size[axis] for c in face)]
    return nodes, elements, faces


def body(kinds, cells, places, groups, **scene):
    """Two plates or bricks; groups: name -> list of (part, side)."""
    nodes, elements, sides = [], {}, []
    solid = kinds[0] in SOLID
    for kind, n, place in zip(kinds, cells, places):
        part = (brick if solid else plate)(kind, n, len(nodes), place)
        nodes += part[0]
        elements.setdefault(kind, []).extend(part[1])
        sides.append(part[2])
    mesh = {"nodes": nodes, "elements": elements,
            "groups": {name: {"faces" if solid else "edges": sum((sides[k][side] for k, side in parts), [])}
                       for name, parts in groups.items()}}
    return {"problem": {"kind": "scene", "mesh": mesh, **scene}}
