/* VTK files: right meshes and groups from all forms of arrays, refusals with the right line, no trust in lengths. */
#include "mesh_text.h"
#include "scene/mesh.h"
#include "uzawa.h"

#include <math.h>

enum { ROOM = 20000 };
static size_t load(char text[ROOM], const char *name)
{
    char path[120];
    snprintf(path, sizeof path, "tests/data/meshes/%s", name);
    FILE *in = fopen(path, "rb");
    const size_t len = in ? fread(text, 1, ROOM, in) : 0;
    if (in)
        fclose(in);
    CHECK_MSG(len > 0, "%s", path);
    return len;
}

static const char *const FILES[] = {"meshio_hex20.vtu", "meshio_hex20_zlib.vtu", "meshio_hex20_ascii.vtu",
                                    "meshio_hex20.vtk", "meshio_hex20_ascii.vtk"};
enum { N_FILES = sizeof FILES / sizeof FILES[0] };

TEST(files_of_meshio)
{
    static char text[ROOM];
    for (int i = 0; i < N_FILES; i++) {
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        const size_t len = load(text, FILES[i]);
        CHECK_MSG(uz_mesh_read(&given, "vtk", text, len, 0, &err) == UZ_OK, "%s, line %lld: %s", FILES[i],
                  (long long)err.line, err.message);
        CHECK(given.n_elements == 2 && given.kind[1] == UZ_HEX20 && given.n_nodes == 32);
        CHECK(given.from_file && strcmp(given.from_file, "/mesh/vtk") == 0);
        for (int k = 8; k < 20 && given.n_elements > 0; k++)
            for (int c = 0; c < 3; c++) {
                const int *ends = uz_element_type_of(UZ_HEX20)->edge[k - 8];
                const double *x = given.xyz + c;
                CHECK(fabs(x[3 * given.node[k]] - 0.5 * (x[3 * given.node[ends[0]]] + x[3 * given.node[ends[1]]])) <
                      1e-12);
            }
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(find_given(&given, "part_7")->n_elements, 1);
        CHECK_INT(find_given(&given, "part_3")->n_faces, 1);
        CHECK_INT(find_given(&given, "part_4")->n_faces, 2);
        CHECK_INT(find_given(&given, "end_1")->n_nodes, 8);
        CHECK_INT(given.n_groups, 6);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

#define V "# vtk DataFile Version 5.1\na title\nASCII\nDATASET UNSTRUCTURED_GRID\n"
#define P V "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
#define C P "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"
#define X                                                                                                              \
    "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n"                            \
    "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\n"
#define XP "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>\n"
#define XC(connectivity, ends, types)                                                                                  \
    "<Cells><DataArray type=\"Int32\" Name=\"connectivity\">" connectivity "</DataArray>\n"                            \
    "<DataArray type=\"Int32\" Name=\"offsets\">" ends "</DataArray>\n"                                                \
    "<DataArray type=\"UInt8\" Name=\"types\">" types "</DataArray></Cells>\n"
#define XE "</Piece></UnstructuredGrid></VTKFile>\n"

/* What ParaView writes and meshio does not: offsets, metadata, fields, appended bytes, wedges either way. */
TEST(forms_of_paraview)
{
    static const char *const TEXTS[] = {
        P "METADATA\nINFORMATION 0\n\nCELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\n"
          "CELL_TYPES 1\n10\nCELL_DATA 1\nSCALARS part int 1\nLOOKUP_TABLE default\n7\nPOINT_DATA 4\n"
          "FIELD FieldData 2\nheat 1 4 double\n1 2 nan 4\nMETADATA\nINFORMATION 0\n\nside 1 4 int\n0 1 1 0\n"
          "VECTORS v double\n0 0 0 0 0 0 0 0 0 0 0 0\n",
        X XP XC("0 1 2 3", "4", "10") "<CellData><DataArray type=\"Int8\" Name=\"part\">7</DataArray></CellData>"
                                      "<PointData><DataArray type=\"Float32\" Name=\"heat\">1 nan 2 "
                                      "3</DataArray><DataArray type=\"UInt64\" "
                                      "Name=\"side\">0 1 1 0</DataArray></PointData>" XE,
        /* of base64, each array from its own offset; header and content coded one by one */
        X "<Points><DataArray type=\"Int8\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/></Points>"
          "<Cells><DataArray type=\"Int8\" Name=\"connectivity\" format=\"appended\" offset=\"24\"/>"
          "<DataArray type=\"Int8\" Name=\"offsets\" format=\"appended\" offset=\"40\"/>"
          "<DataArray type=\"Int8\" Name=\"types\" format=\"binary\">AQAAAA==Cg==</DataArray></Cells>"
          "<CellData><DataArray type=\"Int8\" Name=\"part\">7</DataArray></CellData>"
          "<PointData><DataArray type=\"Int8\" Name=\"side\">0 1 1 0</DataArray></PointData>"
          "</Piece></UnstructuredGrid><AppendedData encoding=\"base64\">\n _"
          "DAAAAA==AAAAAQAAAAEAAAAB"
          "BAAAAA==AAECAw=="
          "AQAAAA==BA=="
          "</AppendedData></VTKFile>",
    };
    for (size_t i = 0; i < sizeof TEXTS / sizeof TEXTS[0]; i++) {
        uz_given_mesh given;
        uz_error err = {0};
        CHECK_MSG(uz_mesh_read(&given, "vtk", TEXTS[i], strlen(TEXTS[i]), 0, &err) == UZ_OK, "%zu, line %lld: %s", i,
                  (long long)err.line, err.message);
        CHECK(given.n_elements == 1 && given.kind[0] == UZ_TET4 && given.node[3] == 3 && given.xyz[3] == 1.0);
        CHECK_INT(find_given(&given, "part_7")->n_elements, 1);
        CHECK_INT(find_given(&given, "side_1")->n_nodes, 2);
        CHECK_INT(given.n_groups, 3);
        uz_given_mesh_clear(&given);
    }
}

TEST(appended_bytes)
{
    static const char HEAD[] =
        "<VTKFile type=\"UnstructuredGrid\" byte_order=\"BigEndian\" header_type=\"UInt64\"><UnstructuredGrid>"
        "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">" XP "<Cells><DataArray type=\"Int16\" Name=\"connectivity\" "
        "format=\"appended\" offset=\"0\"/><DataArray type=\"Int8\" Name=\"offsets\">4</DataArray><DataArray "
        "type=\"Int8\" Name=\"types\">10</DataArray></Cells></Piece></UnstructuredGrid><AppendedData "
        "encoding=\"raw\">_";
    static const char DATA[] = "\0\0\0\0\0\0\0\10\0\0\0\1\0\2\0\3<&\377";
    char text[2000];
    uz_given_mesh given;
    uz_error err = {0};
    const size_t head = sizeof HEAD - 1;
    memcpy(text, HEAD, head);
    memcpy(text + head, DATA, sizeof DATA);
    CHECK_MSG(uz_vtk_read(&given, text, head + sizeof DATA, 0, &err) == UZ_OK, "line %lld: %s", (long long)err.line,
              err.message);
    CHECK(given.n_elements == 1 && given.node[1] == 1 && given.node[3] == 3);
    uz_given_mesh_clear(&given);
    CHECK(uz_vtk_read(&given, text, head + 15, 0, &err) == UZ_ERR_FORMAT && strstr(err.message, "cut off"));
}

TEST(wedges_either_way)
{
    for (int turned = 0; turned < 2; turned++) {
        char text[400];
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        snprintf(text, sizeof text,
                 V "POINTS 6 int\n0 0 0 1 0 0 0 1 0 0 0 1 1 0 1 0 1 1\nCELLS 1 7\n6 %s\nCELL_TYPES 1\n13\n",
                 turned ? "0 2 1 3 5 4" : "0 1 2 3 4 5");
        CHECK_MSG(uz_vtk_read(&given, text, strlen(text), 0, &err) == UZ_OK, "%s", err.message);
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

static const mesh_refusal REFUSALS[] = {
    {"", UZ_ERR_FORMAT, 1, "begins with"},
    {"# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\n", UZ_ERR_UNSUPPORTED, 4, "\"POLYDATA\""},
    {"# vtk DataFile Version 3.0\na\nTEXT\n", UZ_ERR_FORMAT, 3, "ASCII or BINARY"},
    {V "POINTS 99999999 float\n0 0 0\n", UZ_ERR_FORMAT, 5, "fewer numbers than are announced"},
    {V "POINTS 1 complex\n", UZ_ERR_UNSUPPORTED, 5, "of the type \"complex\""},
    {V "POINTS 1 float\n0 0 x\n", UZ_ERR_FORMAT, 6, "a number was expected, found \"x\""},
    {P, UZ_ERR_FORMAT, 7, "no CELLS"},
    {P "CELLS 1 5\n4 0 1 2 9\nCELL_TYPES 1\n10\n", UZ_ERR_FORMAT, 7, "point 9; there are 4"},
    {P "CELLS 1 5\n9 0 1 2 3\nCELL_TYPES 1\n10\n", UZ_ERR_FORMAT, 8, "more points than there are"},
    {P "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n12\n", UZ_ERR_FORMAT, 7, "has not the 8 nodes"},
    {P "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n42\n", UZ_ERR_UNSUPPORTED, 7, "type 42, which is not read; save"},
    {P "CELLS 1 4\n3 0 1 3\nCELL_TYPES 1\n5\n", UZ_ERR_UNSUPPORTED, 7, "z = constant"},
    {P "CELLS 1 3\n2 0 1\nCELL_TYPES 1\n3\n", UZ_ERR_UNSUPPORTED, 7, "no elements of a body"},
    {C "CELL_DATA 2\n", UZ_ERR_FORMAT, 11, "another number than the grid has"},
    {C "CELL_DATA 1\nSCALARS vtkGhostType unsigned_char\n1\n", UZ_ERR_UNSUPPORTED, 12, "ghost cells"},
    {C "CELL_DATA 1\nHYPER a\n", UZ_ERR_UNSUPPORTED, 12, "not read with \"HYPER\""},
    {"<a/>", UZ_ERR_FORMAT, 1, "<a> where a VTK file has <VTKFile>"},
    {"<VTKFile type=\"PolyData\"/>", UZ_ERR_UNSUPPORTED, 1, "save an unstructured grid"},
    {"<!DOCTYPE a [<!ENTITY b \"c\">]>\n<VTKFile/>", UZ_ERR_UNSUPPORTED, 1, "document type"},
    {"<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZ4DataCompressor\"/>", UZ_ERR_UNSUPPORTED, 1, "zlib"},
    {X XP XC("0 1 2 3", "4", "10"), UZ_ERR_FORMAT, 8, "no good XML"},
    {X "</Piece><Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"/>", UZ_ERR_UNSUPPORTED, 4, "second <Piece>"},
    {X XP XE, UZ_ERR_FORMAT, 1, "no <Piece> with points and cells"},
    {X XP XC("0 1 2 3 3", "4", "10") XE, UZ_ERR_FORMAT, 5, "more numbers than 4"},
    {X XP XC("0 1 2", "4", "10") XE, UZ_ERR_FORMAT, 5, "fewer numbers"},
    {X XP XC("0 1 2 3", "99999999999", "10") XE, UZ_ERR_FORMAT, 5, "longer than the file can hold"},
    {X XP XC("0 1 2 3", "4", "10.5") XE, UZ_ERR_FORMAT, 7, "something else"},
};

/* Cells of a grid along the axes, as VTK numbers them: their nodes by x, then y, then z. */
TEST(pixels_and_voxels)
{
    static const char VOXEL[] = "# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
                                "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n"
                                "CELLS 2 14\n8 0 1 2 3 4 5 6 7\n4 0 1 2 3\nCELL_TYPES 2\n11\n8\n"
                                "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n1\n2\n";
    static const char PIXEL[] = "# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
                                "0 0 0 1 0 0 0 1 0 1 1 0\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n8\n";
    static const int64_t AROUND[8] = {0, 1, 3, 2, 4, 5, 7, 6};
    for (int dim = 2; dim <= 3; dim++) {
        const char *text = dim == 3 ? VOXEL : PIXEL;
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        CHECK_MSG(uz_mesh_read(&given, "vtk", text, strlen(text), 0, &err) == UZ_OK, "%s", err.message);
        CHECK(given.n_elements == 1 && given.kind[0] == (dim == 3 ? UZ_HEX8 : UZ_QUAD4));
        CHECK(memcmp(given.node, AROUND, (dim == 3 ? 8 : 4) * sizeof *AROUND) == 0);
        if (dim == 3)
            CHECK_INT(find_given(&given, "part_2")->n_faces, 1);
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, dim, &err) == UZ_OK, "%s", err.message);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

TEST(refusals_say_where)
{
    check_refusals(uz_vtk_read, REFUSALS, sizeof REFUSALS / sizeof REFUSALS[0]);
}

TEST(every_beginning_of_a_file)
{
    static char text[ROOM];
    for (int i = 0; i < N_FILES; i++)
        check_beginnings(uz_vtk_read, FILES[i], text, load(text, FILES[i]));
}

TEST(memory_is_bounded)
{
    static char text[ROOM];
    for (int i = 0; i < N_FILES; i++) {
        uz_given_mesh given;
        uz_error err = {0};
        const size_t len = load(text, FILES[i]);
        CHECK(uz_vtk_read(&given, text, len, 500, &err) == UZ_ERR_LIMIT);
    }
}
