/* Scenes of every kind from JSON to the solver's structs: right values, refusals that the schema cannot make. */
#include "codec/codec.h"
#include "codec/decode.h"
#include "harness.h"

static bool ready(void)
{
    char message[256] = "";
    const bool good = codec_init(NULL, message, sizeof message);
    CHECK_MSG(good, "%s", message);
    return good;
}

/* A request as the codec takes it, without asking whether the scene can be assembled. */
static bool decode(uz_scene *out, const char *body, problem_details *problem)
{
    json_tree doc;
    decoding d = {.bound = (size_t)64 << 20, .problem = problem};
    *problem = (problem_details){0};
    *out = (uz_scene){0};
    if (!ready() || !json_scan(&doc, body, strlen(body), problem))
        return false;
    const bool good = schemas_check(decode_schemas(), "request.json", doc.root, problem) &&
                      decode_scene(out, &d, json_get(doc.root, "problem"));
    json_clear(&doc);
    return good;
}

static uz_scene take(const char *body)
{
    uz_scene scene;
    problem_details problem;
    CHECK_MSG(decode(&scene, body, &problem), "%s %s: %s", problem.code, problem.pointer, problem.detail);
    return scene;
}

static void refuse(const char *body, const char *code, const char *pointer, const char *says)
{
    uz_scene scene;
    problem_details problem;
    CHECK_MSG(!decode(&scene, body, &problem), "taken: %s", body);
    CHECK_MSG(strcmp(problem.code, code) == 0, "code %s, want %s: %s", problem.code, code, problem.detail);
    CHECK_STR(problem.pointer, pointer);
    CHECK_MSG(strstr(problem.detail, says) != NULL, "\"%s\" lacks \"%s\"", problem.detail, says);
    uz_scene_clear(&scene);
}

#define HEAD(model)                                                                                                    \
    "{\"problem\":{\"kind\":\"scene\",\"model\":\"" model                                                              \
    "\",\"materials\":[{\"on\":\"all\",\"young\":2,\"poisson\":0.25}],"
#define PLANE HEAD("plane_stress") "\"mesh\":{\"box\":{\"size\":[2,1],\"cells\":[2,1]}}"
#define SOLID                                                                                                          \
    HEAD("solid")                                                                                                      \
    "\"mesh\":{\"box\":{\"size\":[2,1,3],\"cells\":[2,1,4],\"element\":\"tet10\",\"grading\":[1,2,0.5]}"               \
    "}"

#define NODES "\"nodes\":[[0,0],[1,0],[1,1],[0,1],[2,0]]"
#define MESH  HEAD("plane_strain") "\"mesh\":{" NODES ",\"elements\":{\"quad4\":[[0,1,2,3]],\"tri3\":[[1,4,2]]}"
#define LONG  "01234567890123456789012345678901234567890123456789012345678901\xc3\xa9"

TEST(boxes_models_and_materials)
{
    uz_scene s = take(SOLID ",\"candidates\":\"all\"}}");
    CHECK(s.model == UZ_SOLID && s.source == UZ_MESH_BOX && s.box.dim == 3 && s.all_candidates);
    CHECK(s.box.size[2] == 3 && s.box.cells[2] == 4 && s.box.grading[1] == 2 && s.box.grading[2] == 0.5);
    CHECK_STR(s.box.element, "tet10");
    uz_scene_clear(&s);
    s = take(HEAD("solid") "\"mesh\":{\"box\":{\"size\":[2,1,3],\"cells\":[2,1,4]}}}}");
    CHECK_STR(s.box.element, "hex8");
    CHECK(s.box.grading[0] == 1 && s.box.grading[2] == 1 && !s.all_candidates);
    uz_scene_clear(&s);
    s = take("{\"problem\":{\"kind\":\"scene\",\"model\":\"axisymmetric\",\"formulation\":\"incompatible_modes\","
             "\"mesh\":{\"box\":{\"size\":[2,1],\"cells\":[2,1]}},\"materials\":[{\"on\":\"all\",\"young\":2,"
             "\"poisson\":0.25,\"density\":7,\"expansion\":-1e-5}]}}");
    CHECK(s.model == UZ_AXISYMMETRIC && s.formulation == UZ_FORMULATION_INCOMPATIBLE && s.box.dim == 2);
    CHECK(s.materials[0].density == 7 && s.materials[0].expansion == -1e-5);
    uz_scene_clear(&s);
    refuse(HEAD("solid") "\"mesh\":{\"box\":{\"size\":[2,1,3],\"cells\":[1000,1000,11]}}}}", "out_of_range",
           "/problem/mesh/box/cells", "11000000 cells");
}

TEST(supports_and_loads)
{
    uz_scene s = take(SOLID ",\"supports\":[{\"on\":\"back\",\"uz\":0},{\"on\":\"left\",\"normal\":[1,0,2],\"u\":-3},"
                            "{\"on\":\"front\",\"spring\":[0,1,2]}],\"loads\":[{\"on\":\"front\",\"pressure\":4},"
                            "{\"node\":17,\"force\":[1,2,3]},{\"on\":\"top\",\"force\":[4,5,6]},{\"on\":\"all\","
                            "\"gravity\":[0,0,-9.81]},{\"on\":\"all\",\"body_force\":[7,8,9]},{\"on\":\"all\","
                            "\"temperature\":-20}]}}");
    CHECK(s.supports[0].kind == UZ_SUPPORT_COMPONENTS && isnan(s.supports[0].u[0]) && s.supports[0].u[2] == 0);
    CHECK(s.supports[1].kind == UZ_SUPPORT_NORMAL && s.supports[1].normal[2] == 2 && s.supports[1].value == -3);
    CHECK(s.supports[2].kind == UZ_SUPPORT_SPRING && s.supports[2].spring[1] == 1 && s.supports[2].spring[2] == 2);
    const uz_load_kind kinds[6] = {UZ_LOAD_PRESSURE, UZ_LOAD_NODE_FORCE, UZ_LOAD_FORCE,
                                   UZ_LOAD_GRAVITY,  UZ_LOAD_BODY_FORCE, UZ_LOAD_TEMPERATURE};
    for (int i = 0; i < 6; i++)
        CHECK_INT(s.loads[i].kind, kinds[i]);
    CHECK(s.loads[0].value == 4 && s.loads[1].node == 17 && s.loads[1].v[2] == 3 && s.loads[2].v[0] == 4);
    CHECK(s.loads[3].v[2] == -9.81 && s.loads[4].v[1] == 8 && s.loads[5].value == -20);
    CHECK_STR(s.loads[2].on, "top");
    uz_scene_clear(&s);
    s = take(PLANE ",\"loads\":[{\"node\":1e300,\"force\":[1,2]}]}}");
    CHECK(s.loads[0].node == INT64_MAX);
    uz_scene_clear(&s);
    /* 63 characters may be more bytes than a name has: what is left must not be another group's name */
    refuse(MESH ",\"groups\":{\"a\":{\"nodes\":[0]}}},\"loads\":[{\"on\":\"a\\u0000b\",\"force\":[1,2]}]}}",
           "not_allowed", "/problem/loads/0/on", "\"a\", \"all\", \"boundary\"");
    refuse(MESH "},\"loads\":[{\"on\":\"" LONG "\",\"force\":[1,2]}]}}", "not_allowed", "/problem/loads/0/on",
           "no group");
    refuse(PLANE ",\"supports\":[{\"on\":\"left\",\"normal\":[0,-0.0],\"u\":0}]}}", "out_of_range",
           "/problem/supports/0/normal", "is zero");
}

TEST(names_of_groups)
{
    uz_scene s = take(SOLID ",\"supports\":[{\"on\":\"-z\",\"uz\":0},{\"on\":\"+x\",\"ux\":0}],"
                            "\"contacts\":[{\"on\":[\"+y\",\"left\"],\"with\":\"+z\"}]}}");
    CHECK_STR(s.supports[0].on, "back");
    CHECK_STR(s.supports[1].on, "right");
    CHECK_STR(s.contacts[0].on, "left + top");
    CHECK_STR(s.contacts[0].with, "front");
    uz_scene_clear(&s);
    refuse(PLANE ",\"supports\":[{\"on\":\"lefft\",\"ux\":0}]}}", "not_allowed", "/problem/supports/0/on",
           "Did you mean \"left\"");
    refuse(PLANE ",\"supports\":[{\"on\":\"front\",\"ux\":0}]}}", "not_allowed", "/problem/supports/0/on", "\"left\"");
    refuse(PLANE ",\"loads\":[{\"on\":\"all\",\"traction\":[0,1]}]}}", "not_allowed", "/problem/loads/0/on",
           "name sides");
    refuse(PLANE ",\"contacts\":[{\"on\":\"bottom\",\"with\":[\"top\",\"tip\"]}]}}", "not_allowed",
           "/problem/contacts/0/with/1", "Did you mean \"top\"");
    refuse("{\"problem\":{\"kind\":\"scene\",\"model\":\"plane_stress\",\"mesh\":{\"box\":{\"size\":[2,1],"
           "\"cells\":[2,1]}},\"materials\":[{\"on\":\"left\",\"young\":2,\"poisson\":0.25}]}}",
           "not_allowed", "/problem/materials/0/on", "must be \"all\"");
}

#define WHERE(what) PLANE ",\"supports\":[{\"on\":{\"where\":{" what "}},\"ux\":0}]}}"

TEST(groups_by_where_they_are)
{
    uz_scene s =
        take(PLANE ",\"groups\":[{\"name\":\"roof\",\"where\":{\"y\":1}}],\"supports\":[{\"on\":\"roof\","
                   "\"uy\":0},{\"on\":{\"where\":{\"y\":0,\"x\":{\"min\":0.5}}},\"ux\":0},{\"on\":{\"where\":"
                   "{\"x\":{\"min\":0.5},\"y\":{\"min\":0,\"max\":0}}},\"uy\":0}],\"loads\":[{\"on\":{\"where\":"
                   "{\"nearest\":[2,1]}},\"force\":[0,1]}],\"contacts\":[{\"on\":[\"bottom\",{\"where\":"
                   "{\"normal\":{\"direction\":[1,0],\"within\":10},\"tolerance\":0.1}}],\"obstacle\":{"
                   "\"plane\":{\"point\":[0,0],\"normal\":[0,1]}}}]}}");
    CHECK_INT(s.n_selections, 4); /* what says the same is the same */
    CHECK_STR(s.selections[0].name, "roof");
    CHECK_STR(s.selections[0].place, "/groups/0/where");
    CHECK_STR(s.supports[1].on, "x>=0.5 y=0");
    CHECK_STR(s.supports[2].on, s.supports[1].on);
    CHECK_STR(s.selections[1].place, "/supports/1/on/where");
    CHECK(s.selections[1].by == UZ_SELECT_RANGE && s.selections[1].low[0] == 0.5 && isinf(s.selections[1].high[0]));
    CHECK(s.selections[1].low[1] == 0 && s.selections[1].high[1] == 0);
    CHECK_STR(s.loads[0].on, "nearest 2,1");
    CHECK(s.selections[3].by == UZ_SELECT_FACING && s.selections[3].within == 10 && s.selections[3].tolerance == 0.1);
    CHECK_STR(s.contacts[0].on, "bottom + normal 1,0 within 10 tolerance 0.1");
    uz_scene_clear(&s);
    s = take(SOLID ",\"supports\":[{\"on\":{\"where\":{\"x\":0.12345678901}},\"ux\":0},{\"on\":{\"where\":{\"x\":"
                   "0.12345678902}},\"uy\":0},{\"on\":{\"where\":{\"cylinder\":{\"point\":[1,2,3.25],\"axis\":"
                   "[0.5,0.25,0.125],\"radius\":0.75},\"of\":\"elements\"}},\"uz\":0}]}}");
    CHECK_STR(s.supports[0].on, "x=0.123456789"); /* two that would be called the same are told apart */
    CHECK_STR(s.supports[1].on, "x=0.123456789...#2");
    CHECK_STR(s.supports[2].on, "elements cylinder 1,2,3.25 axis 0.5,0.25,0.125 radius 0.75");
    CHECK(s.selections[2].by == UZ_SELECT_CYLINDER && s.selections[2].kind == UZ_SELECT_ELEMENTS);
    uz_scene_clear(&s);
    refuse(WHERE("\"z\":1"), "not_allowed", "/problem/supports/0/on/where/z", "for solids");
    refuse(WHERE("\"sphere\":{\"center\":[0,0],\"radius\":1}"), "not_allowed", "/problem/supports/0/on/where/sphere",
           "a circle");
    refuse(WHERE("\"circle\":{\"center\":[0,0,0],\"radius\":1}"), "out_of_range",
           "/problem/supports/0/on/where/circle/center", "2 numbers");
    refuse(WHERE("\"x\":{\"min\":2,\"max\":1}"), "out_of_range", "/problem/supports/0/on/where/x",
           "nothing is between");
    refuse(WHERE("\"tolerance\":2"), "missing_key", "/problem/supports/0/on/where", "circle, normal or nearest");
    refuse(WHERE("\"plane\":{\"point\":[0,0],\"normal\":[0,0]}"), "out_of_range",
           "/problem/supports/0/on/where/plane/normal", "is zero");
    refuse(WHERE("\"normal\":{\"direction\":[0,1]},\"of\":\"nodes\""), "not_allowed", "/problem/supports/0/on/where/of",
           "must be sides");
    refuse(WHERE("\"nearest\":[0,1],\"of\":\"sides\""), "not_allowed", "/problem/supports/0/on/where/nearest",
           "a node");
    refuse(PLANE ",\"groups\":[{\"name\":\"a\",\"where\":{\"y\":1}},{\"name\":\"a\",\"where\":{\"y\":0}}]}}",
           "not_allowed", "/problem/groups/1/name", "another of these");
}

TEST(obstacles)
{
    uz_scene s = take(PLANE ",\"contacts\":[{\"on\":\"top\",\"obstacle\":{\"circle\":{\"center\":[1,2],\"radius\":3,"
                            "\"inside\":true}}},{\"on\":\"top\",\"obstacle\":{\"polyline\":{\"points\":[[0,5],[1,6],"
                            "[2,7]]}}},{\"on\":\"top\",\"obstacle\":{\"height\":{\"x\":[0,1],\"z\":[3,4]}}},"
                            "{\"on\":\"top\",\"with\":\"bottom\"}]}}");
    CHECK(s.contacts[0].kind == UZ_OBSTACLE_ROUND && s.contacts[0].point[1] == 2 && s.contacts[0].radius == 3);
    CHECK(s.contacts[0].inside);
    CHECK(s.contacts[1].kind == UZ_OBSTACLE_POLYLINE && s.contacts[1].n_x == 3 && s.contacts[1].x[2] == 2);
    CHECK(s.contacts[1].y[0] == 5 && s.contacts[1].y[2] == 7);
    CHECK(s.contacts[2].kind == UZ_OBSTACLE_HEIGHT && s.contacts[2].n_x == 2 && s.contacts[2].n_y == 0);
    CHECK(s.contacts[2].z[1] == 4 && !s.contacts[2].inside);
    CHECK_INT(s.contacts[3].kind, UZ_OBSTACLE_BODY);
    CHECK_STR(s.contacts[3].with, "bottom");
    uz_scene_clear(&s);
    s = take(SOLID ",\"contacts\":[{\"on\":\"top\",\"obstacle\":{\"cylinder\":{\"point\":[1,2,3],\"axis\":[0,0,4],"
                   "\"radius\":5}}},{\"on\":\"top\",\"obstacle\":{\"sphere\":{\"center\":[1,2,3],\"radius\":5}}},"
                   "{\"on\":\"top\",\"obstacle\":{\"height\":{\"x\":[0,1,2],\"y\":[0,1],\"z\":[[1,2,3],[4,5,6]]}}}]}}");
    CHECK(s.contacts[0].kind == UZ_OBSTACLE_CYLINDER && s.contacts[0].normal[2] == 4 && s.contacts[0].point[2] == 3);
    CHECK(s.contacts[1].kind == UZ_OBSTACLE_ROUND && s.contacts[1].point[2] == 3 && !s.contacts[1].inside);
    CHECK(s.contacts[2].n_x == 3 && s.contacts[2].n_y == 2 && s.contacts[2].y[1] == 1 && s.contacts[2].z[5] == 6);
    uz_scene_clear(&s);
}

/* The three ways in which a table of numbers comes out of the scanner: small, as a whole, in long rows. */
TEST(every_kind_of_part_weighs)
{
    codec_request request = {.problem = {.kind = UZ_PROBLEM_SCENE}};
    uz_scene *scene = &request.problem.scene;
    int64_t *const parts[] = {&scene->n_selections, &scene->n_supports, &scene->n_loads, &scene->n_ties,
                              &scene->n_contacts};
    scene->source = UZ_MESH_BOX;
    scene->box = (uz_box){.dim = 2, .cells = {99, 99}};
    CHECK(codec_request_is_light(&request));
    for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++) {
        *parts[k] = 1000;
        CHECK(!codec_request_is_light(&request));
        *parts[k] = 100;
        CHECK(codec_request_is_light(&request));
        *parts[k] = 0;
    }
}

TEST(height_tables_of_every_size)
{
    const int sizes[3][2] = {{3, 2}, {3, 200}, {200, 3}};
    for (int k = 0; k < 3; k++) {
        char *body = malloc(40000), *at = body;
        at += sprintf(at, "%s,\"contacts\":[{\"on\":\"top\",\"obstacle\":{\"height\":{\"x\":[", SOLID);
        for (int i = 0; i < sizes[k][0]; i++)
            at += sprintf(at, "%s%d", i ? "," : "", i);
        at += sprintf(at, "],\"y\":[");
        for (int j = 0; j < sizes[k][1]; j++)
            at += sprintf(at, "%s%d", j ? "," : "", j);
        at += sprintf(at, "],\"z\":[");
        for (int j = 0; j < sizes[k][1]; j++)
            for (int i = 0; i < sizes[k][0]; i++)
                at += sprintf(at, "%s%d%s", i ? "," : j ? ",[" : "[", 1000 * j + i, i + 1 < sizes[k][0] ? "" : "]");
        sprintf(at, "]}}}]}}");
        uz_scene s = take(body);
        CHECK(s.contacts[0].n_x == sizes[k][0] && s.contacts[0].n_y == sizes[k][1]);
        for (int j = 0; j < sizes[k][1]; j++)
            for (int i = 0; i < sizes[k][0]; i++)
                CHECK(s.contacts[0].z[j * sizes[k][0] + i] == 1000 * j + i);
        uz_scene_clear(&s);
        free(body);
    }
}

#define HEIGHT_OF(model, table) model ",\"contacts\":[{\"on\":\"top\",\"obstacle\":{\"height\":{" table "}}}]}}"
#define HEIGHT_AT               "/problem/contacts/0/obstacle/height/z"

TEST(tables_fit_together)
{
    refuse(HEIGHT_OF(PLANE, "\"x\":[0,1],\"z\":[1,2,3]"), "size_mismatch", HEIGHT_AT, "one height for each x");
    refuse(HEIGHT_OF(PLANE, "\"x\":[0,1],\"z\":[[1,2],[1,2]]"), "size_mismatch", HEIGHT_AT, "one height for each x");
    refuse(HEIGHT_OF(SOLID, "\"x\":[0,1],\"y\":[0,1],\"z\":[1,2]"), "size_mismatch", HEIGHT_AT, "one for each y");
    refuse(HEIGHT_OF(SOLID, "\"x\":[0,1],\"y\":[0,1],\"z\":[[1,2],[1,2],[3,4]]"), "size_mismatch", HEIGHT_AT,
           "as many rows as there are y");
    refuse(HEIGHT_OF(SOLID, "\"x\":[0,1],\"y\":[0,1],\"z\":[[1,2],[1,2,3]]"), "size_mismatch", HEIGHT_AT,
           "as many heights as there are x");
}

/* ------------------------------------------------------------------ meshes */

TEST(meshes_in_numbers)
{
    uz_scene s = take(MESH ",\"groups\":{\"g\":{\"edges\":[[0,1],[1,4]]},\"p q\":{\"nodes\":[3],\"elements\":[1,0]},"
                           "\"\\u00e9\":{\"nodes\":[]}}}}}");
    const uz_given_mesh *m = &s.given;
    CHECK(s.source == UZ_MESH_GIVEN && m->dim == 2 && m->n_nodes == 5 && m->xyz[8] == 2 && !m->from_file);
    CHECK(m->n_elements == 2 && m->kind[0] == UZ_TRI3 && m->kind[1] == UZ_QUAD4); /* tri3 first, whatever the order */
    CHECK(m->first[1] == 3 && m->first[2] == 7 && m->node[1] == 4 && m->node[6] == 3);
    CHECK_INT(m->n_groups, 3);
    CHECK_STR(m->groups[0].name, "g");
    CHECK(m->groups[0].n_faces == 2 && m->groups[0].face_first[2] == 4 && m->groups[0].face_node[3] == 4);
    CHECK(m->groups[1].n_nodes == 1 && m->groups[1].node[0] == 3 && m->groups[1].n_elements == 2);
    CHECK_INT(m->groups[1].element[0], 1);
    CHECK_STR(m->groups[2].name, "\xc3\xa9");
    CHECK_INT(m->groups[2].n_nodes, 0);
    uz_scene_clear(&s);
}

/* Triangles and quadrilaterals in one group: the sides of wedges are both. */
TEST(faces_of_several_sizes)
{
    uz_scene s = take(HEAD("solid") "\"mesh\":{\"nodes\":[[0,0,0],[0,1,0],[1,0,0],[0,0,1],[0,1,1],[1,0,1]],"
                                    "\"elements\":{\"wedge6\":[[0,1,2,3,4,5]]},"
                                    "\"groups\":{\"g\":{\"faces\":[[0,1,2],[0,3,4,1],[3,5,4]]}}}}}");
    const uz_given_group *g = s.given.groups;
    CHECK_INT(g->n_faces, 3);
    CHECK(g->face_first[1] == 3 && g->face_first[2] == 7 && g->face_first[3] == 10);
    CHECK(g->face_node[2] == 2 && g->face_node[4] == 3 && g->face_node[9] == 4);
    uz_scene_clear(&s);
}

TEST(meshes_beyond_the_schema)
{
    refuse(MESH ",\"groups\":{\"g\":{\"faces\":[[0,1,2]]}}}}}", "not_allowed", "/problem/mesh/groups/g/faces",
           "plane meshes are edges");
    refuse(MESH ",\"groups\":{\"\":{\"nodes\":[0]}}}}}", "out_of_range", "/problem/mesh/groups", "is empty");
    refuse(MESH ",\"groups\":{\"a\\nb\":{\"nodes\":[0]}}}}}", "out_of_range", "/problem/mesh/groups", "has one");
    refuse(MESH ",\"groups\":{\"0123456789012345678901234567890123456789012345678901234567890123\":{\"nodes\":[0]}}}}}",
           "out_of_range", "/problem/mesh/groups", "is longer");
    refuse(MESH ",\"groups\":{\"g\":{\"edges\":[[0,1],[1,4,2]]}}}}}", "wrong_type", "/problem/mesh/groups/g/edges/1",
           "same size");
}

/* A mesh of many elements is taken out of the text as a whole, with the same answers and refusals. */
TEST(meshes_of_many_elements)
{
    enum { N = 2000 };
    char *body = malloc(200 * N), *at = body;
    at += sprintf(at, "%s\"mesh\":{\"nodes\":[", HEAD("plane_stress"));
    for (int i = 0; i <= N; i++)
        at += sprintf(at, "%s[%d,0],[%d,1]", i ? "," : "", i, i);
    at += sprintf(at, "],\"elements\":{\"quad4\":[");
    for (int i = 0; i < N; i++)
        at += sprintf(at, "%s[%d,%d,%d,%d]", i ? "," : "", 2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1);
    char *last = at;
    at += sprintf(at, "]},\"groups\":{\"floor\":{\"edges\":[");
    for (int i = 0; i < N; i++)
        at += sprintf(at, "%s[%d,%d]", i ? "," : "", 2 * i, 2 * i + 2);
    sprintf(at, "]}}}}}");
    uz_scene s = take(body);
    CHECK(s.given.n_elements == N && s.given.n_nodes == 2 * N + 2 && s.given.groups[0].n_faces == N);
    CHECK_INT(s.given.groups[0].face_node[2 * N - 1], 2 * N);
    CHECK_INT(s.given.node[4 * N - 1], 2 * N - 1);
    uz_scene_clear(&s);
    memcpy(last - 2, "]7", 2); /* breaks the last row: no longer JSON */
    refuse(body, "json_syntax", "", "");
    free(body);
}

TEST(gmsh_files)
{
    uz_scene s = take(HEAD("plane_stress") "\"mesh\":{\"gmsh\":\"$MeshFormat\\n2.2 0 8\\n$EndMeshFormat\\n$Nodes\\n3\\n"
                                           "1 0 0 0\\n2 1 0 0\\n3 0 1 0\\n$EndNodes\\n$Elements\\n1\\n1 2 1 5 1 2 3\\n"
                                           "$EndElements\\n\"}}}");
    CHECK(s.source == UZ_MESH_GIVEN && s.given.from_file && s.given.n_elements == 1 && s.given.n_groups == 1);
    CHECK_STR(s.given.groups[0].name, "physical_5");
    uz_scene_clear(&s);
    refuse(HEAD("plane_stress") "\"mesh\":{\"gmsh\":\"$MeshFormat\\n2.2 0 8\\nhello\"}}}", "gmsh_syntax",
           "/problem/mesh/gmsh", "$EndMeshFormat was expected");
    refuse(HEAD("plane_stress") "\"mesh\":{\"gmsh\":\"$MeshFormat\\n1.0 0 8\\nhello\"}}}", "gmsh_unsupported",
           "/problem/mesh/gmsh", "version 1");
}
