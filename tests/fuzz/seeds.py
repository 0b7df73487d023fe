"""Writes what the fuzz targets start from: OUT/json/*, OUT/mm/*, OUT/gmsh/*, OUT/abaqus/*, OUT/nastran/*,
OUT/vtk/*, OUT/surface/* and OUT/numpy/*, one seed a file, and OUT/json.dict and the same of the others.

Seeds come from tests/data, and from the shared cases where they are there; the words of the JSON dictionary are the
member names and values that the schemas know.
"""
import hashlib
import io
import json
import pathlib
import struct
import sys
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DATA = ROOT / "tests" / "data"
CASES = ROOT.parent / "shared" / "cases"
LARGEST = 16384  # bytes; larger seeds slow every run down
MM_WORDS = ["%%MatrixMarket", "matrix", "coordinate", "array", "real", "double", "integer", "complex", "pattern", "general",
            "symmetric", "skew-symmetric", "hermitian", "vector", "\n", "\r\n", "%", "1e308", "1e-320", "-0.0", "nan", "inf",
            "9223372036854775807", "2147483648"]
GMSH_WORDS = ["$MeshFormat", "$EndMeshFormat", "2.2 0 8", "4.1 0 8", "2.2 1 8", "4.1 1 8", "$PhysicalNames", "$EndPhysicalNames",
              "$Entities", "$EndEntities", "$PartitionedEntities", "$EndPartitionedEntities", "$Nodes", "$EndNodes",
              "$Elements", "$EndElements", "$Periodic", "$EndPeriodic", "\n", "\r\n", '"a"', "1e308", "nan", "99999999999", "-1"]
ABAQUS_WORDS = ["*NODE", "*ELEMENT", "*NSET", "*ELSET", "*SURFACE", "*PART", "*INSTANCE", ", TYPE=", ", NSET=", ", ELSET=", ", NAME=", ", GENERATE",
                ", ELSET=E", "CPS3", "CPE8R", "CAX4", "C3D4", "C3D20R", "C3D15", "S4", "T3D2", "S1", "S6", "\n", "\r\n", "**", "1e308", "1D3",
                "9223372036854775807", '"a b"']
NASTRAN_WORDS = ["GRID", "GRID*", "CTRIA3", "CTRIA6", "CQUAD4", "CQUAD8", "CTETRA", "CPENTA", "CHEXA", "CBAR", "PLOTEL", "SET3", "ELEM", "PROP",
                 "THRU", "BEGIN BULK", "ENDDATA", "+", "*", ",", "\n", "\t", "$", "1.5-3", "1D3", "999999999999999999"]
VTK_WORDS = ["<VTKFile", 'type="UnstructuredGrid"', "<Piece", 'NumberOfPoints="4"', 'NumberOfCells="1"', "<DataArray", 'type="Int64"', 'format="appended"',
             'offset="0"', "<AppendedData", 'encoding="raw"', ">_", "</DataArray>", 'header_type="UInt64"', 'compressor="vtkZLibDataCompressor"',
             "BINARY", "ASCII", "POINTS", "CELLS", "OFFSETS vtktypeint64", "CONNECTIVITY", "CELL_TYPES", "CELL_DATA", "SCALARS", "LOOKUP_TABLE", "FIELD",
             "METADATA", "AQAAAA==", "\n", "99999999999"]
SURFACE_WORDS = ["solid", "facet normal", "outer loop", "vertex", "endloop", "endfacet", "endsolid", "v ", "f ", "vn ", "1/1/1", "-1", "\n", "1e308"]
NUMPY_WORDS = ["'descr': ", "'fortran_order': ", "'shape': ", "True", "False", "(2, 2)", "(2,)", "()", "<f8", ">f4", "|u1", "<i8", "|S3", "<U3", ", }",
               "csr", "csc", "coo", "format.npy", "shape.npy", "data.npy", "indices.npy", "indptr.npy", "row.npy", "col.npy", "PK"]
JSON_WORDS = ["null", "true", "false", "1e400", "-0.0", "1e-320", "9223372036854775808", "[[", "]]", "{}", "\\u0000", "\\ud800"]


def json_seeds():
    for entry in json.loads((DATA / "requests.json").read_text()):
        yield json.dumps(entry["body"]).encode()
    for path in DATA.glob("*.json"):
        yield path.read_bytes()
    for path in (CASES / "json").rglob("*.json"):
        yield path.read_bytes()


def mm_seeds():
    for folder in (DATA, CASES / "mm_edge"):
        for path in folder.rglob("*.mtx"):
            yield path.read_bytes()


def gmsh_seeds():
    """Files, and small ones of every element in both versions, ASCII and binary."""
    for folder in (DATA / "meshes", CASES / "meshes"):
        for path in folder.rglob("*.msh"):
            yield path.read_bytes()
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0, 0.5, 0.5), (0.5, 0, 0.5)]
    for nodes, kind in ((3, 2), (6, 9), (4, 4), (10, 11)):
        at = points[:3] + points[4:7] if nodes == 6 else points[:nodes]
        yield small_gmsh_2(at, kind, False)
        yield small_gmsh_2(at, kind, True)
        yield small_gmsh_4(at, kind, False)
        yield small_gmsh_4(at, kind, True)


def abaqus_seeds():
    """Small files of some elements with all that is read of a file."""
    nodes = "*NODE, NSET=N\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n"
    sets = "*NSET, NSET=A, GENERATE\n1,4,2\n*NSET, NSET=B\nA, 2\n*ELSET, ELSET=A\nE\n*SURFACE, NAME=S\nE, S1\n*SURFACE, NAME=T, TYPE=NODE\nB\n"
    for kind, of in (("CPS3", "1,2,4"), ("CPE4R", "1,2,3,4"), ("C3D4", "1,2,4,5"), ("C3D8", "1,2,3,4,5,6,7,8"), ("C3D6", "1,2,4,5,6,8")):
        yield f"** made\n{nodes}*ELEMENT, TYPE={kind}, ELSET=E\n10,{of}\n*ELEMENT, TYPE=T3D2, ELSET=L\n11,1,2\n{sets}*STEP\n*STATIC\n".encode()


def nastran_seeds():
    """Small files of some elements in each form of fields with all that is read of a file."""
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    forms = ("".join("GRID,{},,{}.,{}.,{}.\n".format(i + 1, *p) for i, p in enumerate(points)),
             "".join("GRID    {:<8}        {:<8.1f}{:<8.1f}{:<8.1f}\n".format(i + 1, *p) for i, p in enumerate(points)),
             "".join("GRID*   {:<16}                {:<16.1f}{:<16.1f}*\n*       {:<16.1f}\n".format(i + 1, *p) for i, p in enumerate(points)))
    rest = "PLOTEL,11,1,2\nSET3,1,GRID,1,THRU,4\nSET3,2,ELEM,10,11\nSET3,3,PROP,7\nENDDATA\n"
    for kind, of in (("CTRIA3", "1,2,4"), ("CQUAD4", "1,2,3,4"), ("CTETRA", "1,2,4,5"), ("CHEXA", "1,2,3,4,5,6,\n,7,8"), ("CPENTA", "1,2,4,5,6,8")):
        for form in forms:
            yield f"$ made\nBEGIN BULK\n{form}{kind},10,7,{of}\n{rest}".encode()
    yield (DATA / "meshes" / "meshio_hex20.bdf").read_bytes()


def vtk_seeds():
    """What meshio has written, and each form that it does not write."""
    for path in sorted((DATA / "meshes").glob("*.vt?")):
        yield path.read_bytes()
    head = "# vtk DataFile Version 5.1\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
    yield (head + "METADATA\nINFORMATION 0\n\nCELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\n"
           "SCALARS part int 1\nLOOKUP_TABLE default\n7\nFIELD FieldData 1\na 1 1 int\n3\nPOINT_DATA 4\nVECTORS v double\n0 0 0 0 0 0 0 0 0 0 0 0\n").encode()
    arrays = [("Points", "", "Float32", struct.pack("<12f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1)), ("Cells", "connectivity", "Int32", struct.pack("<4i", 0, 1, 2, 3)),
              ("Cells", "offsets", "Int32", struct.pack("<i", 4)), ("Cells", "types", "UInt8", b"\x0a"), ("CellData", "part", "Int8", b"\x07")]
    text, data = "", b""
    for place, name, kind, content in arrays:
        count = 3 if place == "Points" else 1
        text += f'<{place}><DataArray type="{kind}" Name="{name}" NumberOfComponents="{count}" format="appended" offset="{len(data)}"/></{place}>'
        data += struct.pack("<I", len(content)) + content
    yield (f'<VTKFile type="UnstructuredGrid"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="1">{text}</Piece></UnstructuredGrid>'
           '<AppendedData encoding="raw">_').encode() + data + b"</AppendedData></VTKFile>"


def surface_seeds():
    """A tetrahedron in each form, closed, and without its last triangle."""
    corner = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    for faces in ([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], [(0, 2, 1), (0, 1, 3), (0, 3, 2)]):
        yield ("solid a\n" + "".join("facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*corner[i]) for i in face) +
                                     "endloop\nendfacet\n" for face in faces) + "endsolid a\n").encode()
        yield bytes(80) + struct.pack("<I", len(faces)) + b"".join(
            struct.pack("<12fH", 0, 0, 0, *(x for i in face for x in corner[i]), 0) for face in faces)
        yield ("".join("v {} {} {}\n".format(*p) for p in corner) + "".join("f {}/1 {}//2 {}\n".format(*(i + 1 for i in face)) for face in faces)).encode()


def npy(descr, shape, data, fortran=False, version=1):
    head = f"{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY" + bytes([version, 0]) + struct.pack("<H" if version == 1 else "<I", len(head)) + head + data


def numpy_seeds():
    """Arrays of all types, and archives of sparse matrices, stored: a checksum of what is packed is seldom guessed."""
    for code, descr in (("d", "<f8"), ("f", "<f4"), ("q", "<i8"), ("i", "<i4"), ("h", "<i2"), ("b", "|i1"), ("B", "|u1"), ("H", "<u2"), ("I", "<u4"), ("Q", "<u8")):
        yield npy(descr, "(2, 2)", struct.pack("<4" + code, 2, 0, 1, 3), code == "d", 2 if code == "f" else 1)
        yield npy(descr.replace("<", ">"), "(3,)", struct.pack(">3" + code, 2, 0, 1))
    whole = [npy("<i4", f"({n},)", struct.pack(f"<{n}i", *range(n))) for n in (1, 2, 3)]
    for kind, names in ((b"csr", ("indices", "indptr")), (b"csc", ("indices", "indptr")), (b"coo", ("row", "col"))):
        parts = [("format", npy("|S3", "()", kind)), ("shape", npy("<i8", "(2,)", struct.pack("<2q", 2, 2))),
                 ("data", npy("<f8", "(2,)", struct.pack("<2d", 2, 1))), (names[0], whole[1]), (names[1], whole[1 if kind == b"coo" else 2])]
        for how in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            file = io.BytesIO()
            with zipfile.ZipFile(file, "w", how) as archive:
                for name, content in parts:
                    archive.writestr(name + ".npy", content)
            yield file.getvalue()


def gmsh_sections(version, binary, sections):
    """Each section a list of (struct code, values): numbers as bytes or as words; text is text in both."""
    out = f"$MeshFormat\n{version} {int(binary)} 8\n".encode() + (struct.pack("<i", 1) + b"\n" if binary else b"") + b"$EndMeshFormat\n"
    for name, items in sections:
        out += f"${name}\n".encode()
        for code, values in items:
            if code == "text":
                out += values.encode()
            elif binary:
                out += struct.pack("<" + code, *values)
            else:
                out += (" ".join(str(v) for v in values) + "\n").encode()
        out += f"\n$End{name}\n".encode()
    return out


def small_gmsh_2(points, kind, binary):
    numbers = range(1, len(points) + 1)
    nodes = [("text", f"{len(points)}\n")] + [("i3d", (i, *map(float, p))) for i, p in zip(numbers, points)]
    tail = f"{len(points)}i"
    elements = [("text", "2\n")]
    if binary:
        elements += [("3i", (1, 1, 2)), ("5i", (1, 3, 1, 1, 2)), ("3i", (kind, 1, 2)), ("3i" + tail, (2, 4, 1, *numbers))]
    else:
        elements += [("7i", (1, 1, 2, 3, 1, 1, 2)), ("5i" + tail, (2, kind, 2, 4, 1, *numbers))]
    names = [("text", '1\n1 3 "edge"\n')]
    return gmsh_sections("2.2", binary, [("PhysicalNames", names), ("Nodes", nodes), ("Elements", elements)])


def small_gmsh_4(points, kind, binary):
    numbers, n = range(1, len(points) + 1), len(points)
    dim = 3 if kind in (4, 11) else 2
    entity = ("i6dQiQ", (1, *6 * (0.0,), 1, 4, 0))
    entities = [("4Q", (0, 0, int(dim == 2), int(dim == 3))), entity]
    nodes = [("4Q", (1, n, 1, n)), ("3iQ", (dim, 1, 0, n)), (f"{n}Q", numbers)] + [("3d", tuple(map(float, p))) for p in points]
    elements = [("4Q", (1, 1, 1, 1)), ("3iQ", (dim, 1, kind, 1)), (f"{n + 1}Q", (1, *numbers))]
    return gmsh_sections("4.1", binary, [("Entities", entities), ("Nodes", nodes), ("Elements", elements)])


def words(value):
    """The member names and the constants in a schema."""
    if isinstance(value, list):
        for one in value:
            yield from words(one)
    if not isinstance(value, dict):
        return
    yield from value.get("properties", {})
    yield from (one for one in [*value.get("enum", []), value.get("const")] if isinstance(one, str))
    for one in value.values():
        yield from words(one)


def write_seeds(folder, seeds):
    folder.mkdir(parents=True, exist_ok=True)
    for seed in seeds:
        if len(seed) <= LARGEST:
            (folder / hashlib.sha1(seed).hexdigest()[:16]).write_bytes(seed)


def write_dictionary(path, entries):
    def escaped(word):
        return "".join(c if c.isalnum() else f"\\x{ord(c):02x}" for c in word)

    path.write_text("".join(f'"{escaped(word)}"\n' for word in sorted(set(entries))))


def main():
    out = pathlib.Path(sys.argv[1])
    schema = json.loads((ROOT / "schemas" / "request.json").read_text())
    write_seeds(out / "json", json_seeds())
    write_seeds(out / "mm", mm_seeds())
    write_seeds(out / "gmsh", gmsh_seeds())
    write_seeds(out / "abaqus", abaqus_seeds())
    write_seeds(out / "nastran", nastran_seeds())
    write_seeds(out / "vtk", vtk_seeds())
    write_seeds(out / "surface", surface_seeds())
    write_seeds(out / "numpy", numpy_seeds())
    write_dictionary(out / "json.dict", [*(f'"{word}"' for word in words(schema)), *JSON_WORDS])
    write_dictionary(out / "mm.dict", MM_WORDS)
    write_dictionary(out / "gmsh.dict", GMSH_WORDS)
    write_dictionary(out / "abaqus.dict", ABAQUS_WORDS)
    write_dictionary(out / "nastran.dict", NASTRAN_WORDS)
    write_dictionary(out / "vtk.dict", VTK_WORDS)
    write_dictionary(out / "surface.dict", SURFACE_WORDS)
    write_dictionary(out / "numpy.dict", NUMPY_WORDS)


main()
