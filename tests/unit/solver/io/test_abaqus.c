/* Input files of Abaqus and CalculiX: right meshes and groups, refusals with the right line, no trust in numbers. */
#include "mesh_text.h"
#include "scene/mesh.h"
#include "uzawa.h"

/* Two bricks on each other, numbered with gaps and not in order, with everything that is read. */
static const char BRICKS[] = "** made by hand\r\n"
                             "*Heading\n two bricks\n"
                             "*NODE, NSET=Nall\n"
                             "11, 0, 0\n12, 1., 0., 0.\n13, 1, 1, 0\n 14 , 0, 1.0D0, 0\n"
                             "25, 0, 0, 1\n26, 1, 0, 1\n27, 1, 1, 1\n28, 0, 1, 1\n"
                             "5, 0, 0, 2\n6, 1, 0, 2\n7, 1, 1, 2\n8, 0, 1, 2\n"
                             "99, 5, 5, 5\n"
                             "*Element, type=C3D8R, elset=Eall\n"
                             "200, 25, 26, 27, 28, 5,\n6, 7, 8\n"
                             "100, 11,12,13,14,25,26,27,28\n"
                             "*ELEMENT, TYPE = S4, ELSET=skin\n300, 11, 14, 13, 12\n"
                             "*ELEMENT, TYPE=T3D2, ELSET=rope\n301, 11, 12\n"
                             "*NSET, NSET=low, GENERATE\n11, 14\n"
                             "*NSET, NSET=Both\nlow, 5\n7,\n"
                             "*ELSET, ELSET=lower\n100\n"
                             "*NSET, NSET=ofset, ELSET=lower\n"
                             "*SURFACE, NAME=TOP, TYPE=ELEMENT\n200, S2\n"
                             "*SURFACE, NAME=sides\nEall, S3\n"
                             "*SURFACE, NAME=\"by nodes\", TYPE=NODE\nlow\n6\n"
                             "*NSET, NSET=top\n5, 6, 7, 8\n"
                             "*NSET, NSET=lower\n11, 12\n"
                             "*MATERIAL, NAME=EL\n*ELASTIC\n210000., .3\n"
                             "*STEP\n*STATIC\n*BOUNDARY\nlow, 1, 3\n*END STEP\n";

TEST(everything_that_is_read)
{
    uz_given_mesh given;
    uz_mesh mesh;
    uz_error err = {0};
    read_text(&given, BRICKS);
    CHECK(given.dim == 3 && given.n_nodes == 13 && given.n_elements == 2 && given.kind[0] == UZ_HEX8);
    CHECK(strcmp(given.from_file, "/mesh/abaqus") == 0);
    CHECK(given.node[0] == 4 && given.node[4] == 8 && given.node[7] == 11 && given.node[8] == 0);
    CHECK(given.xyz[3 * 3 + 1] == 1.0 && given.xyz[2] == 0.0);
    CHECK_INT(find_given(&given, "Nall")->n_nodes, 13);
    CHECK_INT(find_given(&given, "Eall")->n_elements, 2);
    CHECK_INT(find_given(&given, "low")->n_nodes, 4);
    CHECK_INT(find_given(&given, "Both")->n_nodes, 6);
    CHECK_INT(find_given(&given, "ofset")->n_nodes, 8);
    CHECK_INT(find_given(&given, "by nodes")->n_nodes, 5);
    CHECK_INT(find_given(&given, "rope")->n_nodes, 2);
    CHECK(find_given(&given, "skin")->n_faces == 1 && find_given(&given, "skin")->n_elements == 0);
    CHECK_INT(find_given(&given, "sides")->n_faces, 2);
    /* the nodes of the surface alone: they say nothing of their own */
    CHECK(find_given(&given, "TOP")->n_faces == 1 && find_given(&given, "TOP")->n_nodes == 0);
    /* other nodes than those of the elements */
    CHECK_INT(find_given(&given, "lower")->n_nodes, 2);
    CHECK_INT(find_given(&given, "lower.elements")->n_elements, 1);
    CHECK_INT(given.n_groups, 12);
    CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(mesh.n_unused, 1);
    CHECK_INT(uz_mesh_group(&mesh, "TOP", "", NULL)->n_nodes, 4);
    uz_mesh_clear(&mesh);
    uz_given_mesh_clear(&given);
}

/* Each side of each type is one of an element, and all of them are its surface. */
TEST(sides_of_every_type)
{
    static const struct {
        const char *type, *nodes;
        int dim, sides;
    } TYPES[] = {
        {"CPS3", "1,2,4", 2, 3},   {"CPE4", "1,2,3,4", 2, 4},     {"CAX4R", "1,2,3,4", 2, 4},
        {"C3D4", "1,2,4,5", 3, 4}, {"C3D6", "1,2,4,5,6,8", 3, 5}, {"C3D8I", "1,2,3,4,5,6,7,8", 3, 6},
    };
    for (size_t i = 0; i < sizeof TYPES / sizeof TYPES[0]; i++) {
        char text[600];
        uz_given_mesh given;
        uz_mesh mesh;
        uz_error err = {0};
        int used = snprintf(text, sizeof text,
                            "*NODE\n1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n"
                            "*ELEMENT,TYPE=%s,ELSET=E\n1,%s\n*SURFACE,NAME=skin\n",
                            TYPES[i].type, TYPES[i].nodes);
        for (int k = 1; k <= TYPES[i].sides; k++)
            used += snprintf(text + used, sizeof text - (size_t)used, "E, S%d\n", k);
        read_text(&given, text);
        CHECK_MSG(uz_mesh_from_given(&mesh, &given, TYPES[i].dim, &err) == UZ_OK, "%s: %s", TYPES[i].type, err.message);
        const uz_group *skin = uz_mesh_group(&mesh, "skin", "", NULL);
        CHECK_INT(skin ? skin->n_faces : -1, TYPES[i].sides);
        uz_mesh_clear(&mesh);
        uz_given_mesh_clear(&given);
    }
}

/* The order of CalculiX's wedge of 15 nodes: those amid the vertical edges come last. */
TEST(nodes_amid_edges)
{
    uz_given_mesh given;
    uz_mesh mesh;
    uz_error err = {0};
    read_text(&given, "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,1,0,1\n6,0,1,1\n7,.5,0,0\n8,.5,.5,0\n9,0,.5,0\n"
                      "10,.5,0,1\n11,.5,.5,1\n12,0,.5,1\n13,0,0,.5\n14,1,0,.5\n15,0,1,.5\n"
                      "*ELEMENT,TYPE=C3D15\n1,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15\n");
    CHECK_MSG(uz_mesh_from_given(&mesh, &given, 3, &err) == UZ_OK, "%s", err.message);
    uz_mesh_clear(&mesh);
    uz_given_mesh_clear(&given);
}

#define NODES "*NODE\n1,0,0\n2,1,0\n3,0,1\n"
#define TRI   NODES "*ELEMENT,TYPE=CPS3,ELSET=E\n7,1,2,3\n"

static const mesh_refusal REFUSALS[] = {
    {"", UZ_ERR_FORMAT, 1, "begins with a keyword"},
    {"1, 2, 3\n", UZ_ERR_FORMAT, 1, "begins with a keyword"},
    {NODES, UZ_ERR_UNSUPPORTED, 4, "no element of a body"},
    {"*INCLUDE, INPUT=mesh.inp\n", UZ_ERR_UNSUPPORTED, 1, "*INCLUDE is not read; put the lines"},
    {NODES "*NGEN\n1,3\n", UZ_ERR_UNSUPPORTED, 5, "*NGEN is not read; list the nodes"},
    {"*NODE, INPUT=nodes.txt\n", UZ_ERR_UNSUPPORTED, 1, "from another file"},
    {"*NODE, SYSTEM=C\n1,0,0\n", UZ_ERR_UNSUPPORTED, 1, "rectangular"},
    {"*NODE\n1,0,x\n", UZ_ERR_FORMAT, 2, "a coordinate was expected, found \"x\""},
    {"*NODE\n1,0,1e999\n", UZ_ERR_NOT_FINITE, 2, "not a finite number"},
    {"*NODE\n1,0,nan\n", UZ_ERR_FORMAT, 2, "a coordinate was expected"},
    {"*NODE\n-1,0,0\n", UZ_ERR_FORMAT, 2, "the number of a node was expected, found \"-1\""},
    {"*NODE\n99999999999999999999,0,0\n", UZ_ERR_FORMAT, 2, "the number of a node was expected"},
    {"*NODE\n1\n", UZ_ERR_FORMAT, 2, "has no coordinates"},
    {TRI "*NODE\n2,4,4\n", UZ_ERR_FORMAT, 8, "two nodes have the number 2"},
    {TRI "7,1,3,2\n", UZ_ERR_FORMAT, 7, "two elements have the number 7"},
    {NODES "*ELEMENT,TYPE=C3D99\n", UZ_ERR_UNSUPPORTED, 5, "type C3D99 are not read"},
    {NODES "*ELEMENT\n", UZ_ERR_FORMAT, 5, "*ELEMENT has no TYPE"},
    {NODES "*ELEMENT,TYPE=S3\n1,1,2,3\n", UZ_ERR_UNSUPPORTED, 6,
     "element 1, of type S3, is a shell, which is not modelled; give it its thickness in solid elements"},
    {NODES "*ELEMENT,TYPE=S3R5\n1,1,2,3\n", UZ_ERR_UNSUPPORTED, 6, "is a shell"},
    {NODES "*ELEMENT,TYPE=B31R\n5,1,2\n", UZ_ERR_UNSUPPORTED, 6, "element 5, of type B31, is a beam"},
    {NODES "*ELEMENT,TYPE=M3D3\n1,1,2,3\n", UZ_ERR_UNSUPPORTED, 6, "is a membrane"},
    {NODES "*ELEMENT,TYPE=SPRINGA\n1,1,2\n", UZ_ERR_UNSUPPORTED, 5, "SPRINGA are not read; a support"},
    {NODES "*ELEMENT,TYPE=MASS\n1,1\n", UZ_ERR_UNSUPPORTED, 5, "MASS are not read; a point mass"},
    {TRI "*ELEMENT,TYPE=S3\n1,1,2,3\n", UZ_ERR_UNSUPPORTED, 8, "is a shell"},
    {NODES "*ELEMENT,TYPE=CPS3\n1,1,2\n", UZ_ERR_FORMAT, 6, "has 2 of its 3 nodes"},
    {NODES "*ELEMENT,TYPE=CPS3\n1,1,2,\n*STEP\n", UZ_ERR_FORMAT, 7, "has 2 of its 3 nodes"},
    {NODES "*ELEMENT,TYPE=CPS3\n1,1,2,3,1\n", UZ_ERR_FORMAT, 6, "more than the 3 nodes"},
    {NODES "*ELEMENT,TYPE=CPS3\n1,1,2,9\n", UZ_ERR_FORMAT, 6, "element 1 has node 9, which is not there"},
    {"*NODE\n1,0,0\n2,1,0\n3,0,1,1\n*ELEMENT,TYPE=CPS3\n1,1,2,3\n", UZ_ERR_UNSUPPORTED, 6, "z = constant"},
    {TRI "*NSET,NSET=A\n1,4\n", UZ_ERR_FORMAT, 8, "\"A\" has nodes from 4 on of which one is not there"},
    {TRI "*NSET,NSET=A\nB\n", UZ_ERR_FORMAT, 8, "no set of nodes \"B\" before this line"},
    {TRI "*NSET,NSET=A\nA\n", UZ_ERR_FORMAT, 8, "member of itself"},
    {TRI "*NSET\n1\n", UZ_ERR_FORMAT, 7, "*NSET has no NSET"},
    {TRI "*NSET,NSET=A,ELSET=F\n", UZ_ERR_FORMAT, 7, "no set of elements \"F\""},
    {TRI "*NSET,NSET=A,GENERATE\n3,1\n", UZ_ERR_FORMAT, 8, "from a first to a larger last"},
    {TRI "*NSET,NSET=A,GENERATE\n1,3,0\n", UZ_ERR_FORMAT, 8, "from a first to a larger last"},
    {TRI "*ELSET,ELSET=A\n8\n", UZ_ERR_FORMAT, 8, "elements from 8 on"},
    {TRI "*SURFACE,NAME=A\nE\n", UZ_ERR_UNSUPPORTED, 8, "give the sides"},
    {TRI "*SURFACE,NAME=A\nE, TOP\n", UZ_ERR_UNSUPPORTED, 8, "S1 to S6"},
    {TRI "*SURFACE,NAME=A\nE, SPOS\n", UZ_ERR_UNSUPPORTED, 8, "SPOS is a side of a shell"},
    {TRI "*ELEMENT,TYPE=B21\n8,1,2\n*SURFACE,NAME=A\n8, S1\n", UZ_ERR_UNSUPPORTED, 8, "type B21, is a beam"},
    {TRI "*SURFACE,NAME=A\nE, S4\n", UZ_ERR_UNSUPPORTED, 6, "S4, that this element has not"},
    {TRI "*ELEMENT,TYPE=T3D2,ELSET=S\n8,1,2\n*SURFACE,NAME=S\nE, S1\n", UZ_ERR_UNSUPPORTED, 10,
     "a surface and of a set of sides"},
    {TRI "*SURFACE,NAME=A,TYPE=CUTTING SURFACE\n", UZ_ERR_UNSUPPORTED, 7, "type CUTTING SURFACE"},
    {TRI "*PART,NAME=A\n*END PART\n*PART,NAME=B\n", UZ_ERR_UNSUPPORTED, 9, "second part"},
    {TRI "*INSTANCE,NAME=A,PART=B\n1,0,0\n", UZ_ERR_UNSUPPORTED, 7, "instance that is moved"},
    {TRI "*NSET,NSET=A\n9223372036854775807, 9223372036854775807\n", UZ_ERR_FORMAT, 8, "one is not there"},
    {TRI "*NSET,NSET=A,\n", UZ_ERR_FORMAT, 7, "ends in a comma"},
    {TRI "*NSET,NSET=\"A\n", UZ_ERR_FORMAT, 7, "open quote"},
};

TEST(refusals_say_where)
{
    check_refusals(uz_abaqus_read, REFUSALS, sizeof REFUSALS / sizeof REFUSALS[0]);
}

TEST(every_beginning_of_a_file)
{
    check_beginnings(uz_abaqus_read, "two bricks", BRICKS, sizeof BRICKS);
}

/* Ranges and sets of sets that name far more than there is take no more memory than is allowed. */
TEST(memory_is_bounded)
{
    enum { ROOM = 60000 };
    static char text[ROOM];
    uz_given_mesh mesh;
    uz_error err = {0};
    read_text(&mesh, TRI "*NSET,NSET=A,GENERATE\n1,9223372036854775807\n");
    CHECK_INT(find_given(&mesh, "A")->n_nodes, 3);
    uz_given_mesh_clear(&mesh);
    int used = snprintf(text, ROOM, TRI "*NSET,NSET=S0,GENERATE\n1,3\n");
    for (int i = 1; i < 100; i++) {
        used += snprintf(text + used, (size_t)(ROOM - used), "*NSET,NSET=S%d\n", i);
        for (int k = 0; k < 100; k++)
            used += snprintf(text + used, (size_t)(ROOM - used), "S%d%s", i - 1, k % 10 == 9 ? "\n" : ",");
    }
    CHECK(uz_abaqus_read(&mesh, text, strlen(text), 0, &err) == UZ_OK);
    uz_given_mesh_clear(&mesh);
    CHECK(uz_abaqus_read(&mesh, text, strlen(text), 20000, &err) == UZ_ERR_LIMIT);
    uz_given_mesh_clear(&mesh);
}
