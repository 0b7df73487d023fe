"""Gmsh files for the tests: one in text of version 4.1, taken apart and written in the other forms of the format."""
import struct


class Mesh:
    """What an ASCII file of version 4.1 says."""

    def __init__(self, text):
        self.sections = {}
        lines = iter(text.splitlines())
        for line in lines:
            name = line.strip()[1:]
            body = []
            while (line := next(lines)).strip() != "$End" + name:
                body.append(line)
            self.sections[name] = body

    def words(self, name):
        return iter(" ".join(self.sections[name]).split())

    def names(self):
        """The section of the names, which is text in every form."""
        if "PhysicalNames" not in self.sections:
            return b""
        return "\n".join(["$PhysicalNames", *self.sections["PhysicalNames"], "$EndPhysicalNames", ""]).encode()


def packed(words, kinds):
    """The next words as bytes: i is 4 bytes, s 8 without a sign, d a double."""
    out = b""
    for kind in kinds:
        word = next(words)
        out += struct.pack("<" + {"i": "i", "s": "Q", "d": "d"}[kind], float(word) if kind == "d" else int(word))
    return out


def counted(words, kind):
    """A count and so many numbers."""
    count = int(next(words))
    return struct.pack("<Q", count) + packed(words, kind * count)


def section(name, content):
    return f"${name}\n".encode() + content + f"\n$End{name}\n".encode()


def entities(words):
    counts = [int(next(words)) for _ in range(4)]
    out = struct.pack("<4Q", *counts)
    for dim, count in enumerate(counts):
        for _ in range(count):
            out += packed(words, "i" + ("ddd" if dim == 0 else "dddddd")) + counted(words, "i")
            if dim:
                out += counted(words, "i")
    return out


def nodes(words):
    blocks = next(words)
    out = packed(iter([blocks]), "s") + packed(words, "sss")
    for _ in range(int(blocks)):
        out += packed(words, "iii")
        count = int(next(words))
        out += struct.pack("<Q", count) + packed(words, "s" * count + "ddd" * count)
    return out


NODES_OF = {1: 2, 2: 3, 3: 4, 4: 4, 5: 8, 15: 1}  # of the kinds of element in the files of the tests


def blocks_of_elements(words):
    """(entity's dimension, tag, kind, [[number, node...]...]) of each block, and the four numbers of the head."""
    head = [int(next(words)) for _ in range(4)]
    blocks = []
    for _ in range(head[0]):
        dim, tag, kind, count = (int(next(words)) for _ in range(4))
        blocks.append((dim, tag, kind, [[int(next(words)) for _ in range(1 + NODES_OF[kind])] for _ in range(count)]))
    return head, blocks


def elements(words):
    head, blocks = blocks_of_elements(words)
    out = struct.pack("<4Q", *head)
    for dim, tag, kind, rows in blocks:
        out += struct.pack("<iiiQ", dim, tag, kind, len(rows))
        out += b"".join(struct.pack(f"<{len(row)}Q", *row) for row in rows)
    return out


def binary_41(text):
    mesh = Mesh(text)
    out = section("MeshFormat", b"4.1 1 8\n" + struct.pack("<i", 1)) + mesh.names()
    for name, write in (("Entities", entities), ("Nodes", nodes), ("Elements", elements)):
        out += section(name, write(mesh.words(name)))
    return out


def physical(words):
    """The first physical tag of each entity, by (dimension, tag); 0 where there is none."""
    counts = [int(next(words)) for _ in range(4)]
    found = {}
    for dim, count in enumerate(counts):
        for _ in range(count):
            tag = int(next(words))
            for _ in range(6 if dim else 3):
                next(words)
            tags = [int(next(words)) for _ in range(int(next(words)))]
            found[dim, tag] = tags[0] if tags else 0
            for _ in range(int(next(words)) if dim else 0):
                next(words)
    return found


def binary_22(text):
    mesh = Mesh(text)
    words = mesh.words("Nodes")
    points = []
    for _ in range([int(next(words)) for _ in range(4)][0]):
        count = [int(next(words)) for _ in range(4)][3]
        numbers = [int(next(words)) for _ in range(count)]
        points += [(number, *(float(next(words)) for _ in range(3))) for number in numbers]
    of = physical(mesh.words("Entities"))
    _, blocks = blocks_of_elements(mesh.words("Elements"))
    rows = b"".join(struct.pack("<iii", kind, len(block), 2) +
                    b"".join(struct.pack(f"<{len(row) + 2}i", row[0], of[dim, tag], tag, *row[1:]) for row in block)
                    for dim, tag, kind, block in blocks)
    count = sum(len(block) for *_, block in blocks)
    return (section("MeshFormat", b"2.2 1 8\n" + struct.pack("<i", 1)) + mesh.names() +
            section("Nodes", f"{len(points)}\n".encode() + b"".join(struct.pack("<iddd", *point) for point in points)) +
            section("Elements", f"{count}\n".encode() + rows))
