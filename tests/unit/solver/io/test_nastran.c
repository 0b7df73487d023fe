/* NASTRAN bulk data: right meshes and groups from all forms of fields, refusals with the right line. */
#include "mesh_text.h"
#include "scene/mesh.h"
#include "uzawa.h"

#include <math.h>

/* Two bricks on each other in all forms of fields, with everything that is read. */
static const char BRICKS[] =
    "$ made by hand\r\n"
    "SOL 101\nCEND\nSET 5 = 1 THRU 3\nbegin bulk\n"
    "MAT1,1,2.1+5,,.3\nGRDSET,,0,,,,0\n"
    "GRID    11              0.      0.      0.\n"
    "GRID    12      0       1.0D0   0.      0.      0       123     0\n"
    "GRID*                 13                             1.0             1.0*A\n*A                   0.0\n"
    "grid*,14,,0.,10.-1,*B\n*B,0.\n"
    "GRID,25,,0.,0.,1.+0\nGRID,26,,1.,0.,+1.E0\nGRID,27,,1.,1.,1. $ a comment\nGRID,28,,0.,1.,1.\n"
    "GRID\t5\t\t0.\t0.\t2.\nGRID,6,,1.,0.,2.\nGRID,7,,1.,1.,2.\nGRID,8,,0.,1.,2.\n\nGRID,99,,5.,5.,5.\n"
    "CHEXA   200     2       25      26      27      28      5       6       +X\n"
    "+X      7       8\n"
    "CHEXA,100,1,11,12,13,14,25,26,\n,27,28\n"
    "CQUAD4,300,3,11,14,13,12,0.\nCBAR,301,4,11,12,0.,0.,1.\nPLOTEL,302,12,13\n"
    "SET3,1,GRID,11,THRU,14,5\nSET3,2,ELEM,100,300,THRU,302\nSET3,3,PROP,1,THRU,2\n"
    "SPC1,1,123,11,12,13,14,25,26\n,27,28\nENDDATA\nwhatever follows\n";

TEST(everything_that_is_read)
{
    uz_given_mesh given;
    uz_mesh mesh;
    uz_error err = {0};
    read_text(&given, BRICKS);
    CHECK(given.dim == 3 && given.n_nodes == 13 && given.n_elements == 2 && given.kind[0] == UZ_HEX8);
    CHECK(strcmp(given.from_file, "/mesh/nastran") == 0);
    CHECK(given.node[0] == 4 && given.node[4] == 8 && given.node[7] == 11 && given.node[8] == 0);
    CHECK(given.xyz[3 * 1] == 1.0 && given.xyz[3 * 2 + 1] == 1.0 && given.xyz[3 * 3 + 1] == 1.0);
    CHECK(given.xyz[3 * 4 + 2] == 1.0 && given.xyz[3 * 8 + 2] == 2.0);
    CHECK(find_given(&given, "property_1")->n_elements == 1 && find_given(&given, "property_1")->element[0] == 1);
    CHECK_INT(find_given(&given, "property_3")->n_faces, 1);
    CHECK_INT(find_given(&given, "property_4")->n_nodes, 2);
    CHECK_INT(find_given(&given, "set_1")->n_nodes, 5);
    CHECK_INT(find_given(&given, "set_2")->n_elements, 1);
    CHECK_INT(find_given(&given, "set_2.sides")->n_faces, 1);
    CHECK_INT(find_given(&given, "set_2.nodes")->n_nodes, 4);
    CHECK_INT(find_given(&given, "set_3")->n_elements, 2);
    CHECK_INT(given.n_groups, 9);
    CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(mesh.n_unused, 1);
    uz_mesh_clear(&mesh);
    uz_given_mesh_clear(&given);
}

/* Each middle node lies amid the edge that the element has it on. */
static void check_middles(const uz_given_mesh *mesh)
{
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        for (int i = type->corners; i < type->nodes; i++)
            for (int c = 0; c < mesh->dim; c++) {
                const int *ends = type->edge[i - type->corners];
                const double *x = mesh->xyz + c;
                CHECK_MSG(fabs(x[node[i] * mesh->dim] -
                               0.5 * (x[node[ends[0]] * mesh->dim] + x[node[ends[1]] * mesh->dim])) < 1e-12,
                          "%s: node %d is not amid its edge", type->name, i);
            }
    }
}

/* Every type, its nodes numbered as the format's manual draws them: G1 to G4 or G8 corners, then middles of the edges
 * of the first end, between the ends, of the second end. */
TEST(orders_of_nodes)
{
    static const struct {
        const char *type;
        int corners, edges, edge[12][2];
        double corner[8][3];
    } TYPES[] = {
        {"CTRIA3", 3, 0, {{0}}, {{0, 0}, {1, 0}, {0, 1}}},
        {"CTRIA6", 3, 3, {{0, 1}, {1, 2}, {2, 0}}, {{0, 0}, {1, 0}, {0, 1}}},
        {"CQUAD4", 4, 0, {{0}}, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
        {"CQUAD8", 4, 4, {{0, 1}, {1, 2}, {2, 3}, {3, 0}}, {{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
        {"CTETRA", 4, 0, {{0}}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
        {"CTETRA",
         4,
         6,
         {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
         {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
        {"CPENTA", 6, 0, {{0}}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}},
        {"CPENTA",
         6,
         9,
         {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 4}, {2, 5}, {3, 4}, {4, 5}, {5, 3}},
         {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}}},
        {"CHEXA",
         8,
         12,
         {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 5}, {2, 6}, {3, 7}, {4, 5}, {5, 6}, {6, 7}, {7, 4}},
         {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}},
    };
    for (size_t t = 0; t < sizeof TYPES / sizeof TYPES[0]; t++) {
        static char text[4000];
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        const int nodes = TYPES[t].corners + TYPES[t].edges;
        int used = 0;
        for (int i = 0; i < nodes; i++) {
            double x[3];
            for (int c = 0; c < 3; c++)
                x[c] = i < TYPES[t].corners ? TYPES[t].corner[i][c]
                                            : 0.5 * (TYPES[t].corner[TYPES[t].edge[i - TYPES[t].corners][0]][c] +
                                                     TYPES[t].corner[TYPES[t].edge[i - TYPES[t].corners][1]][c]);
            used +=
                snprintf(text + used, sizeof text - (size_t)used, "GRID,%d,,%.2f,%.2f,%.2f\n", i + 1, x[0], x[1], x[2]);
        }
        used += snprintf(text + used, sizeof text - (size_t)used, "%-8s%8d%8d", TYPES[t].type, 9, 9);
        for (int i = 0; i < nodes; i++)
            used += snprintf(text + used, sizeof text - (size_t)used, "%s%8d", (i + 2) % 8 ? "" : "\n        ", i + 1);
        read_text(&given, text);
        CHECK_INT(given.n_elements == 1 ? given.first[1] : -1, nodes);
        check_middles(&given);
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, given.dim, &err) == UZ_OK, "%s: %s", TYPES[t].type, err.message);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

TEST(a_file_of_meshio)
{
    uz_given_mesh given;
    uz_mesh mesh;
    uz_error err = {0};
    static char text[20000];
    FILE *in = fopen("tests/data/meshes/meshio_hex20.bdf", "rb");
    const size_t len = in ? fread(text, 1, sizeof text - 1, in) : 0;
    CHECK(in && fclose(in) == 0 && len > 0);
    CHECK_MSG(uz_mesh_read(&given, "nastran", text, len, 0, &err) == UZ_OK, "line %lld: %s", (long long)err.line,
              err.message);
    CHECK(given.n_elements == 2 && given.kind[0] == UZ_HEX20 && given.n_nodes == 32);
    check_middles(&given);
    CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(uz_mesh_group(&mesh, "property_4", "", NULL)->n_faces, 2);
    CHECK_INT(uz_mesh_group(&mesh, "property_3", "", NULL)->n_nodes, 8);
    uz_mesh_clear(&mesh);
    uz_given_mesh_clear(&given);
}

#define NODES "GRID,1,,0.,0.\nGRID,2,,1.,0.\nGRID,3,,0.,1.\n"
#define TRI   NODES "CTRIA3,7,1,1,2,3\n"

static const mesh_refusal REFUSALS[] = {
    {"", UZ_ERR_FORMAT, 1, "no element"},
    {NODES, UZ_ERR_FORMAT, 3, "no element"},
    {NODES "CBAR,1,1,1,2\n", UZ_ERR_UNSUPPORTED, 4, "no elements of a body"},
    {TRI "INCLUDE 'more.bdf'\n", UZ_ERR_UNSUPPORTED, 5, "INCLUDE is not read; put the lines"},
    {"GRID,1,5,0.,0.\n", UZ_ERR_UNSUPPORTED, 1, "coordinate system 5 (CP) is not read; give nodes in the basic"},
    {"GRID,1,,0.,0.,0.,6\n", UZ_ERR_UNSUPPORTED, 1, "coordinate system 6 (CD)"},
    {"GRDSET,,3\n", UZ_ERR_UNSUPPORTED, 1, "coordinate system 3 (CP)"},
    {"GRID,1,,x,0.\n", UZ_ERR_FORMAT, 1, "a coordinate was expected, found \"X\""},
    {"GRID,1,,1.+999,0.\n", UZ_ERR_NOT_FINITE, 1, "not a finite number"},
    {"GRID,1,,1.-,0.\n", UZ_ERR_FORMAT, 1, "a coordinate was expected"},
    {"GRID,1,,nan,0.\n", UZ_ERR_FORMAT, 1, "a coordinate was expected"},
    {"GRID,-1,,0.,0.\n", UZ_ERR_FORMAT, 1, "the number of a node was expected, found \"-1\""},
    {"GRID,9999999999999999999,,0.,0.\n", UZ_ERR_FORMAT, 1, "the number of a node was expected"},
    {"GRID,1,,0.,0.,0.,,,,,0.\n", UZ_ERR_FORMAT, 1, "more than 10 fields"},
    {"+A,1\n", UZ_ERR_FORMAT, 1, "a continuation of no entry"},
    {TRI "GRID,4,,0.,0.,0.,,,,+A\n+B,1\n", UZ_ERR_UNSUPPORTED, 6, "a continuation \"+B\" where \"+A\""},
    {TRI "GRID,2,,4.,4.\n", UZ_ERR_FORMAT, 5, "two nodes have the number 2"},
    {TRI "CTRIA3,7,1,1,2,3\n", UZ_ERR_FORMAT, 5, "two elements have the number 7"},
    {TRI "CTRIA3,8,1,1,2,9\n", UZ_ERR_FORMAT, 5, "element 8 has node 9, which is not there"},
    {TRI "CTRIA3,8,1,1,2\n", UZ_ERR_FORMAT, 5, "there are 2 nodes; there have to be 3"},
    {TRI "CTRIA6,8,1,1,2,3,1\n", UZ_ERR_UNSUPPORTED, 5, "there are 4 nodes; there have to be 3, or 6"},
    {TRI "CTETRA,8,1,1,2,3,1,2,3,\n,1,2,3,1,2\n", UZ_ERR_FORMAT, 5, "more than its 10 nodes"},
    {TRI "CELAS1,9,1,1,1\n", UZ_ERR_UNSUPPORTED, 5, "CELAS1 is not read; mesh with"},
    {TRI "CQUADX,9,1,1,1\n", UZ_ERR_UNSUPPORTED, 5, "CQUADX is not read"},
    {TRI "SET3,1,GRID,4\n", UZ_ERR_FORMAT, 5, "SET3 1 has 4, which is not there"},
    {TRI "SET3,1,GRID,3,THRU,1\n", UZ_ERR_FORMAT, 5, "from 3 THRU 1 is nothing"},
    {TRI "SET3,1,GRID,1\nSET3,1,GRID,2\n", UZ_ERR_FORMAT, 6, "second group \"set_1\""},
    {NODES "GRID,4,,0.,1.,1.\nCQUAD4,1,1,1,2,3,4\n", UZ_ERR_UNSUPPORTED, 5, "z = constant"},
    {TRI "!?\n", UZ_ERR_FORMAT, 5, "no entry of bulk data"},
};

TEST(refusals_say_where)
{
    check_refusals(uz_nastran_read, REFUSALS, sizeof REFUSALS / sizeof REFUSALS[0]);
}

TEST(every_beginning_of_a_file)
{
    check_beginnings(uz_nastran_read, "two bricks", BRICKS, sizeof BRICKS);
}

/* Sets that name far more than there is, and continuations of nothing, take no more memory than is allowed. */
TEST(memory_is_bounded)
{
    enum { ROOM = 60000 };
    static char text[ROOM];
    uz_given_mesh mesh;
    uz_error err = {0};
    int used = snprintf(text, ROOM, TRI "SET3,1,GRID,");
    for (int i = 0; i < 1000; i++)
        used += snprintf(text + used, (size_t)(ROOM - used), "1,THRU,999999,\n,,");
    CHECK_MSG(uz_nastran_read(&mesh, text, strlen(text), 0, &err) == UZ_OK, "%s", err.message);
    uz_given_mesh_clear(&mesh);
    CHECK(uz_nastran_read(&mesh, text, strlen(text), 20000, &err) == UZ_ERR_LIMIT);
    used = snprintf(text, ROOM, "MAT1,1,1.\n");
    while (used + 4 < ROOM)
        used += snprintf(text + used, (size_t)(ROOM - used), "+\n");
    CHECK(uz_nastran_read(&mesh, text, strlen(text), 20000, &err) == UZ_ERR_FORMAT);
}
