/* Gmsh files: right meshes in every version and form, right refusals with the right line, no trust in counts. */
#include "gmsh_text.h"
#include "mesh_text.h"
#include "scene/mesh.h"
#include "uzawa.h"

/* ---------------------------------------------------------------- files from elsewhere */

static const struct {
    const char *name;
    uz_status status;
    int64_t line;
    int dim;
    int64_t nodes, elements, groups;
    const char *says; /* of a refusal; else the name of a group, "" none */
    int64_t items;    /* faces or elements of that group */
} FILES[] = {
    {"gridap_cube.msh", UZ_OK, 0, 3, 27, 8, 0, "", 0},
    {"gridap_plane.msh", UZ_ERR_UNSUPPORTED, 51, 0, 0, 0, 0, "do not lie in a plane", 0},
    {"mfem_surfaces_in_3d.BINARY.v41.msh", UZ_ERR_UNSUPPORTED, 0, 0, 0, 0, 0, "shells are not modelled", 0},
    {"mfem_unstructured_quad.v22.msh", UZ_OK, 0, 2, 140, 119, 5, "Domain", 119},
    {"sfepy_msh_tetra.msh", UZ_OK, 0, 3, 66, 127, 1, "physical_2", 127},
    {"sfepy_msh_tri.msh", UZ_OK, 0, 2, 475, 795, 0, "", 0},
    {"skfem_box.msh", UZ_OK, 0, 3, 358, 1105, 4, "back", 104},
    {"skfem_mixedtriquad.msh", UZ_OK, 0, 2, 56, 52, 2, "boundary", 22},
    {"skfem_quadratic_quad.msh", UZ_ERR_UNSUPPORTED, 2057, 0, 0, 0, 0, "9-node quadrilateral", 0},
    {"skfem_quadratic_sphere_tet.msh", UZ_OK, 0, 3, 1310, 722, 0, "", 0},
    {"skfem_quadratic_tri.msh", UZ_OK, 0, 2, 262, 119, 0, "", 0},
    {"skfem_tagged_gmsh4.msh", UZ_OK, 0, 2, 55, 80, 3, "tagged", 8},
};

/* A mesh that was read must be one that can be computed with. */
static void check_usable(const uz_given_mesh *given, const char *group_name, int64_t items)
{
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_given(&mesh, given, given->dim, &err) == UZ_OK, "%s", err.message);
    if (mesh.n_groups > 0 && group_name[0]) {
        const uz_group *group = uz_mesh_group(&mesh, group_name, "", &err);
        CHECK_MSG(group != NULL, "%s", err.message);
        CHECK_INT(group ? group->n_faces + group->n_elements : -1, items);
    }
    CHECK_INT(mesh.n_unused, 0);
    uz_mesh_clear(&mesh);
}

static void check_file(const char *folder, size_t i)
{
    char path[256];
    size_t len;
    uz_given_mesh mesh;
    uz_error err = {0};
    snprintf(path, sizeof path, "%s/%s", folder, FILES[i].name);
    char *text = test_read_file(path, &len);
    CHECK_MSG(text != NULL, "no %s", path);
    if (!text)
        return;
    uz_status status = uz_gmsh_read(&mesh, text, len, 0, &err);
    CHECK_MSG(status == FILES[i].status && err.line == FILES[i].line, "%s: %s, line %lld: %s", path,
              uz_status_name(status), (long long)err.line, err.message);
    if (status == UZ_OK) {
        CHECK(mesh.from_file && mesh.dim == FILES[i].dim && mesh.n_nodes == FILES[i].nodes);
        CHECK(mesh.n_elements == FILES[i].elements && mesh.n_groups == FILES[i].groups);
        check_usable(&mesh, FILES[i].says, FILES[i].items);
    } else {
        CHECK_MSG(strstr(err.message, FILES[i].says) != NULL, "%s", err.message);
    }
    uz_given_mesh_clear(&mesh);
    free(text);
}

TEST(files_from_elsewhere)
{
    char folder[200];
    const char *cases = test_cases_dir();
    if (!cases) {
        test_skip("no folder ../shared/cases");
        return;
    }
    snprintf(folder, sizeof folder, "%s/meshes", cases);
    for (size_t i = 0; i < sizeof FILES / sizeof FILES[0]; i++)
        check_file(folder, i);
}

TEST(files_that_are_always_here)
{
    check_file("tests/data/meshes", 0);
    check_file("tests/data/meshes", 7);
}

/* ---------------------------------------------------------------- one mesh in every form */

static void check_tetrahedron(const uz_given_mesh *mesh)
{
    CHECK(mesh->dim == 3 && mesh->n_nodes == 11 && mesh->n_elements == 1 && mesh->kind[0] == UZ_TET10);
    CHECK(memcmp(mesh->xyz, TET_XYZ, sizeof TET_XYZ) == 0);
    for (int i = 0; i < 10; i++)
        CHECK_INT(mesh->node[i], i); /* the last two in VTK's order */
    CHECK_INT(mesh->n_groups, 5);
    const uz_given_group *floor = find_given(mesh, "the floor"), *all = find_given(mesh, "physical_7");
    CHECK(floor->n_faces == 1 && floor->face_first[1] == 6 && floor->face_node[1] == 2 && floor->face_node[3] == 6);
    CHECK(all->n_elements == 1 && all->element[0] == 0 && all->n_faces == 0 && all->n_nodes == 0);
    CHECK_INT(find_given(mesh, "physical_7_dim1")->n_nodes, 3);
    CHECK_INT(find_given(mesh, "physical_7_dim0")->n_nodes, 1);
    CHECK_INT(find_given(mesh, "c\xc3\xb6ntrol")->node[0], 10);
}

TEST(every_version_and_form)
{
    static gmsh_writer w;
    for (int k = 0; k < 6; k++) {
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        write_gmsh(&w, &TET_SOURCE, k < 2 ? 22 : k < 4 ? 41 : 40, k % 2);
        CHECK_MSG(uz_gmsh_read(&given, w.text, w.len, 0, &err) == UZ_OK, "form %d: %s", k, err.message);
        check_tetrahedron(&given);
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(mesh.n_unused, 1);
        CHECK_INT(uz_mesh_group(&mesh, "the floor", "", NULL)->n_nodes, 6);
        CHECK_INT(uz_mesh_group(&mesh, "c\xc3\xb6ntrol", "", NULL)->n_nodes, 0);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

/* Whatever is cut off, the rest is refused, and says where. */
TEST(every_beginning_of_a_file_is_refused)
{
    static gmsh_writer w;
    for (int k = 0; k < 6; k++) {
        write_gmsh(&w, &TET_SOURCE, k < 2 ? 22 : k < 4 ? 41 : 40, k % 2);
        const char *end = memmem(w.text, w.len, "$EndElements", 12);
        for (size_t len = 0; len < (size_t)(end - w.text) + 12; len++) {
            uz_given_mesh given;
            uz_error err = {0};
            char *part = malloc(len + 1); /* of its own length: a sanitizer sees what is read beyond it */
            memcpy(part, w.text, len);
            const uz_status status = uz_gmsh_read(&given, part, len, 0, &err);
            CHECK_MSG(status == UZ_ERR_FORMAT || status == UZ_ERR_UNSUPPORTED, "form %d, %zu bytes: %s", k, len,
                      uz_status_name(status));
            CHECK(err.line > 0 || strstr(err.message, "at byte"));
            CHECK(!given.xyz && !given.groups);
            free(part);
        }
    }
}

/* Physical groups of version 2.2 that share an element repeat it. */
TEST(element_of_two_groups)
{
    static const char text[] =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 5\n2 1 0 5\n3 0 1 5\n$EndNodes\n"
        "$Elements\n4\n1 2 2 4 1 1 2 3\n2 2 2 6 1 1 2 3\n3 1 2 -4 1 1 2\n4 1 0 2 3\n$EndElements";
    uz_given_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_gmsh_read(&mesh, text, sizeof text - 1, 0, &err) == UZ_OK, "%s", err.message);
    CHECK(mesh.dim == 2 && mesh.n_elements == 1 && mesh.n_groups == 3 && mesh.xyz[2] == 1);
    CHECK_INT(find_given(&mesh, "physical_6")->n_elements, 1);
    CHECK_INT(find_given(&mesh, "physical_4_dim1")->n_faces, 1);
    uz_given_mesh_clear(&mesh);
}

TEST(numbers_with_wide_gaps)
{
    static const char text[] = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
                               "$Nodes\n4\n9000000 0 0 0\n7 5 5 0\n123456789012 0 1 0\n8 1 0 0\n$EndNodes\n"
                               "$Elements\n1\n1 2 0 9000000 8 123456789012\n$EndElements";
    uz_given_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_gmsh_read(&mesh, text, sizeof text - 1, 0, &err) == UZ_OK, "%s", err.message);
    CHECK(mesh.n_elements == 1 && mesh.node[0] == 0 && mesh.node[1] == 3 && mesh.node[2] == 2);
    uz_given_mesh_clear(&mesh);
}

/* ---------------------------------------------------------------- refusals */

#define H2   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
#define H4   "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
#define FAR  "$Nodes\n3\n9000000 0 0 0\n7 1 0 0\n"
#define N2   "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
#define N4   "$Nodes\n1 3 1 3\n2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n"
#define TRI2 "$Elements\n1\n1 2 0 1 2 3\n$EndElements\n"
#define TRI4 "$Elements\n1 1 1 1\n2 1 2 1\n1 1 2 3\n$EndElements\n"

static const mesh_refusal REFUSALS[] = {
    {"", UZ_ERR_FORMAT, 1, "begins with $MeshFormat"},
    {"$NOD\n1\n", UZ_ERR_FORMAT, 2, "version 1"},
    {"\n\nhello\n", UZ_ERR_FORMAT, 3, "a section such as $Nodes was expected, found \"hello\""},
    {"$MeshFormat\n3 0 8\n$EndMeshFormat\n", UZ_ERR_UNSUPPORTED, 2, "version 3 of the format is not read"},
    {"$MeshFormat\n4.0 0 8\n$EndMeshFormat\n$PartitionedEntities\n", UZ_ERR_UNSUPPORTED, 5, "save as version 4.1"},
    {"$MeshFormat\n4.0 0 8\n$EndMeshFormat\n$Nodes\n1 1\n1 2 1 1\n1 0 0 0\n", UZ_ERR_UNSUPPORTED, 6, "parametric"},
    {"$MeshFormat\n4.1 2 8\n", UZ_ERR_FORMAT, 2, "file type is 2"},
    {"$MeshFormat\n4.1 0 4\n", UZ_ERR_UNSUPPORTED, 2, "4 bytes"},
    {"$MeshFormat\n4.1 1 8\n\0\0\0\1", UZ_ERR_FORMAT, 0, "the number 1 was expected"},
    {H2, UZ_ERR_FORMAT, 4, "no $Nodes"},
    {H2 N2, UZ_ERR_FORMAT, 10, "no elements"},
    {H2 TRI2, UZ_ERR_FORMAT, 5, "$Elements before $Nodes"},
    {H2 N2 N2, UZ_ERR_FORMAT, 12, "a second $Nodes"},
    {H2 N2 TRI2 TRI2, UZ_ERR_FORMAT, 15, "a second $Elements"},
    {H2 "$Nodes\n99999999999\n1 0 0 0\n", UZ_ERR_FORMAT, 6, "99999999999 nodes are announced"},
    {H2 "$Nodes\n99999999999999999999\n", UZ_ERR_FORMAT, 5, "the number of nodes was expected"},
    {H2 "$Nodes\n2\n1 0 0 0\n2 1 0 x\n", UZ_ERR_FORMAT, 7, "a number was expected, found \"x\""},
    {H2 "$Nodes\n2\n1 0 0 0\n2 1 0 nan\n", UZ_ERR_NOT_FINITE, 7, "not a finite number"},
    {H2 "$Nodes\n2\n1 0 0 0\n2 1 0 1e999\n", UZ_ERR_NOT_FINITE, 7, "not a finite number"},
    {H2 "$Nodes\n2\n1 0 0 0\n1 1 0 0\n$EndNodes\n", UZ_ERR_FORMAT, 7, "two nodes with the number 1"},
    {H2 "$Nodes\n2\n1 0 0 0\n-2 1 0 0\n$EndNodes\n", UZ_ERR_FORMAT, 7, "the number -2"},
    {H2 "$Nodes\n1\n1 0 0 0\n2 1 0 0\n$EndNodes\n", UZ_ERR_FORMAT, 7, "$EndNodes was expected, found \"2\""},
    {H2 N2 "$Elements\n1\n1 2 0 1 2 4\n$EndElements\n", UZ_ERR_FORMAT, 12, "has node 4, which $Nodes has not"},
    {H2 FAR "8 0 1 0\n$EndNodes\n$Elements\n1\n1 2 0 7 8 9\n", UZ_ERR_FORMAT, 12, "has node 9, which $Nodes has not"},
    {H2 FAR "7 0 1 0\n$EndNodes\n", UZ_ERR_FORMAT, 8, "two nodes with the number 7"},
    {H2 N2 "$Elements\n1\n1 10 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "Mesh.SecondOrderIncomplete = 1"},
    {H2 N2 "$Elements\n1\n1 7 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "5-node pyramid"},
    {H2 N2 "$Elements\n1\n1 19 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "tetrahedra, hexahedra or wedges"},
    {H2 N2 "$Elements\n1\n1 12 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "SecondOrderIncomplete = 1 for hexahedra of 20"},
    {H2 N2 "$Elements\n1\n1 13 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "wedges of 15"},
    {H2 N2 "$Elements\n1\n1 99 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "hexahedra or wedges of order 1 or 2"},
    {H2 N2 "$Elements\n1\n1 77 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "type 77"},
    {H2 N2 "$Elements\n1\n1 -3 0 1 2 3\n", UZ_ERR_UNSUPPORTED, 12, "type -3"},
    {H2 N2 "$Elements\n1\n1 1 0 1 2\n$EndElements\n", UZ_ERR_UNSUPPORTED, 11, "only lines"},
    {H2 N2 "$Elements\n1\n1 15 0 1\n$EndElements\n", UZ_ERR_UNSUPPORTED, 11, "only points"},
    {H2 "$PhysicalNames\n1\n2 1 \"core\n$EndPhysicalNames\n", UZ_ERR_FORMAT, 6, "no closing quote"},
    {H2 "$PhysicalNames\n1\n2 1 core\n$EndPhysicalNames\n", UZ_ERR_FORMAT, 6, "in double quotes"},
    {H2 "$PhysicalNames\n1\n2 1 \"\"\n$EndPhysicalNames\n", UZ_ERR_UNSUPPORTED, 6, "1 to 63"},
    {H2 "$PhysicalNames\n1\n2 1 \"a\xff\"\n$EndPhysicalNames\n", UZ_ERR_UNSUPPORTED, 6, "not UTF-8"},
    {H2 "$PhysicalNames\n1\n4 1 \"a\"\n$EndPhysicalNames\n", UZ_ERR_FORMAT, 6, "no dimension 4"},
    {H2 "$Periodic\n1\n", UZ_ERR_FORMAT, 5, "$EndPeriodic is missing"},
    {H4 "$Nodes\n1 3 1 3\n2 1 0 4\n1\n2\n3\n0 0 0\n1 0 0\n", UZ_ERR_FORMAT, 6, "more nodes than are announced"},
    {H4 "$Nodes\n0 3 1 3\n$EndNodes\n                                        ", UZ_ERR_FORMAT, 5,
     "3 nodes are announced, but there are 0"},
    {H4 N4 "$Elements\n1 1 1 1\n2 1 2 2\n1 1 2 3\n", UZ_ERR_FORMAT, 16, "more elements than are announced"},
    {H4 N4 "$Elements\n1 1 1 1\n1 1 2 1\n1 1 2 3\n", UZ_ERR_FORMAT, 16, "its dimension is 1"},
    {H4 N4 "$Elements\n1 9223372036854775807 1 1\n", UZ_ERR_FORMAT, 15, "are announced"},
    {H4 N4 TRI4 "$Entities\n0 0 0 0\n$EndEntities\n", UZ_ERR_FORMAT, 20, "after $Elements"},
    {H4 "$Entities\n0 0 1 0\n1 0 0 0 0 0 0 99999999 1 0\n", UZ_ERR_FORMAT, 6, "physical groups are announced"},
};

TEST(refusals_say_where)
{
    check_refusals(uz_gmsh_read, REFUSALS, sizeof REFUSALS / sizeof REFUSALS[0]);
}

TEST(binary_refusals_say_the_byte)
{
    static gmsh_writer w;
    uz_given_mesh mesh;
    uz_error err = {0};
    write_gmsh(&w, &TET_SOURCE, 41, true);
    char *one = memmem(w.text, w.len, "4.1 1 8\n", 8);
    memcpy(one + 8, "\0\0\0\1", 4);
    CHECK(uz_gmsh_read(&mesh, w.text, w.len, 0, &err) == UZ_ERR_UNSUPPORTED);
    CHECK(strstr(err.message, "other order") && strstr(err.message, "at byte 24"));
    write_gmsh(&w, &TET_SOURCE, 41, true);
    char *nodes = memmem(w.text, w.len, "$EndComments", 12); /* behind the "$Nodes" of the comment */
    nodes = memmem(nodes, w.len - (size_t)(nodes - w.text), "$Nodes\n", 7);
    memset(nodes + 7 + 8, 0x7f, 8);
    CHECK(uz_gmsh_read(&mesh, w.text, w.len, 0, &err) == UZ_ERR_FORMAT);
    CHECK_MSG(strstr(err.message, "are announced") != NULL, "%s", err.message);
    memset(nodes + 7 + 8, 0xff, 8);
    CHECK(uz_gmsh_read(&mesh, w.text, w.len, 0, &err) == UZ_ERR_FORMAT);
    CHECK_MSG(strstr(err.message, "found -1") != NULL, "%s", err.message);
}

TEST(memory_is_bounded)
{
    static gmsh_writer w;
    uz_given_mesh mesh;
    uz_error err = {0};
    write_gmsh(&w, &TET_SOURCE, 41, false);
    CHECK(uz_gmsh_read(&mesh, w.text, w.len, 200, &err) == UZ_ERR_LIMIT);
    CHECK(err.line > 0 && !mesh.xyz);
    CHECK(uz_gmsh_read(&mesh, w.text, w.len, 20000, &err) == UZ_OK);
    uz_given_mesh_clear(&mesh);
}

/* A surface across z is a shell, but one with z equal up to rounding is plane. */
TEST(flat_meshes_are_plane)
{
    for (int k = 0; k < 2; k++) {
        char text[400];
        uz_given_mesh mesh;
        uz_error err = {0};
        snprintf(text, sizeof text, H2 "$Nodes\n3\n1 0 0 5\n2 1 0 5\n3 0 1 %s\n$EndNodes\n" TRI2,
                 k ? "5.000001" : "5.00000000000001");
        CHECK(uz_gmsh_read(&mesh, text, strlen(text), 0, &err) == (k ? UZ_ERR_UNSUPPORTED : UZ_OK));
        CHECK(mesh.dim == (k ? 0 : 2));
        uz_given_mesh_clear(&mesh);
    }
}

/* A partitioned mesh names partitioned entities; CR LF ends lines as well. */
TEST(partitioned_files)
{
    static const char text[] =
        "$MeshFormat\r\n4.1 0 8\r\n$EndMeshFormat\r\n$Entities\r\n0 0 1 0\r\n1 0 0 0 1 1 0 1 9 0\r\n$EndEntities\r\n"
        "$PartitionedEntities\r\n2\r\n1\r\n3 1\r\n0 0 1 0\r\n2 2 1 1 1 0 0 0 1 1 0 1 9 0\r\n$EndPartitionedEntities\r\n"
        "$Nodes\r\n1 3 1 3\r\n2 2 0 3\r\n1\r\n2\r\n3\r\n0 0 0\r\n1 0 0\r\n0 1 0\r\n$EndNodes\r\n"
        "$Elements\r\n1 1 1 1\r\n2 2 2 1\r\n1 1 2 3\r\n$EndElements\r\n$GhostElements\r\n0\r\n$EndGhostElements\r\n";
    uz_given_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_gmsh_read(&mesh, text, sizeof text - 1, 0, &err) == UZ_OK, "line %d: %s", (int)err.line, err.message);
    CHECK_INT(find_given(&mesh, "physical_9")->n_elements, 1);
    uz_given_mesh_clear(&mesh);
}

/* ---------------------------------------------------------------- orders of nodes */

/* Elements as Gmsh's manual draws them ("Node ordering"): corners in its order, and the edges of the nodes behind. */
static const struct {
    int type;
    uz_element_kind kind;
    int corners, edges;
    double corner[8][3];
    int edge[12][2];
} DRAWN[] = {
    {4, UZ_TET4, 4, 0, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0}}},
    {11,
     UZ_TET10,
     4,
     6,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
     {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}}},
    {5, UZ_HEX8, 8, 0, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}, {{0}}},
    {17,
     UZ_HEX20,
     8,
     12,
     {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
     {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}}},
    {6, UZ_WEDGE6, 6, 0, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}, {{0}}},
    {18,
     UZ_WEDGE15,
     6,
     9,
     {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
     {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}}},
};

TEST(nodes_come_in_the_order_of_vtk)
{
    for (size_t k = 0; k < sizeof DRAWN / sizeof DRAWN[0]; k++) {
        char text[4096];
        const int nodes = DRAWN[k].corners + DRAWN[k].edges;
        int len = snprintf(text, sizeof text, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%d\n", nodes);
        for (int a = 0; a < nodes; a++) {
            double x[3];
            const int *edge = DRAWN[k].edge[a < DRAWN[k].corners ? 0 : a - DRAWN[k].corners];
            for (int c = 0; c < 3; c++)
                x[c] = a < DRAWN[k].corners ? DRAWN[k].corner[a][c]
                                            : 0.5 * (DRAWN[k].corner[edge[0]][c] + DRAWN[k].corner[edge[1]][c]);
            len += snprintf(text + len, sizeof text - (size_t)len, "%d %g %g %g\n", a + 1, x[0], x[1], x[2]);
        }
        len += snprintf(text + len, sizeof text - (size_t)len, "$EndNodes\n$Elements\n1\n1 %d 0", DRAWN[k].type);
        for (int a = 0; a < nodes; a++)
            len += snprintf(text + len, sizeof text - (size_t)len, " %d", a + 1);
        len += snprintf(text + len, sizeof text - (size_t)len, "\n$EndElements\n");
        uz_given_mesh given;
        uz_error err = {0};
        CHECK_MSG(uz_gmsh_read(&given, text, (size_t)len, 0, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(given.kind ? given.kind[0] : -1, DRAWN[k].kind);
        check_usable(&given, "boundary", uz_element_type_of(DRAWN[k].kind)->sides); /* and is not inverted */
        for (int m = DRAWN[k].corners; m < nodes && given.node; m++) {
            const int *end = uz_element_type_of(DRAWN[k].kind)->edge[m - DRAWN[k].corners];
            for (int c = 0; c < 3; c++)
                CHECK(given.xyz[3 * given.node[m] + c] ==
                      0.5 * (given.xyz[3 * given.node[end[0]] + c] + given.xyz[3 * given.node[end[1]] + c]));
        }
        uz_given_mesh_clear(&given);
    }
}

/* ---------------------------------------------------------------- readers */

TEST(readers_are_found_by_name)
{
    static gmsh_writer w;
    uz_given_mesh mesh;
    uz_error err = {0};
    for (int k = 0; k < 6; k++) {
        write_gmsh(&w, &TET_SOURCE, k < 2 ? 22 : k < 4 ? 41 : 40, k % 2);
        CHECK_MSG(uz_mesh_read(&mesh, "gmsh", w.text, w.len, 0, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(mesh.n_elements, 1);
        uz_given_mesh_clear(&mesh);
    }
    CHECK_INT(uz_mesh_read(&mesh, "gmsh", "*NODE\n", 6, 0, &err), UZ_ERR_FORMAT);
    CHECK_INT(uz_mesh_read(&mesh, "stl", w.text, w.len, 0, &err), UZ_ERR_UNSUPPORTED);
    CHECK_MSG(strstr(err.message, "\"stl\"") != NULL, "%s", err.message);
}
