/* What is seen of a body, as arrays: triangles, edges, where contact rows are, units. */
#include "body_fixture.h"
#include "picture/arc.h"
#include "picture/skin.h"

static const double SIZE[3] = {3, 2, 4};
static const int64_t CELLS[3] = {3, 2, 4};

static uz_mesh box_mesh(const char *element, int dim)
{
    uz_mesh mesh;
    uz_error err = {0};
    uz_box box = {.dim = dim, .size = {3, 2, 4}, .cells = {3, 2, 4}};
    snprintf(box.element, sizeof box.element, "%s", element);
    CHECK_MSG(uz_mesh_from_box(&mesh, &box, &err) == UZ_OK, "%s", err.message);
    return mesh;
}

static double distance(const uz_mesh *mesh, int64_t a, int64_t b)
{
    double sum = 0;
    for (int c = 0; c < mesh->dim; c++)
        sum += pow(mesh->xyz[a * mesh->dim + c] - mesh->xyz[b * mesh->dim + c], 2);
    return sqrt(sum);
}

/* A closed surface has as many faces and nodes, less edges, as a sphere has (Euler); each edge has two cells. */
TEST(edges_of_a_solid_are_those_of_a_sphere)
{
    static const char *const KINDS[] = {"hex8", "tet4", "tet10", "hex20"};
    for (int k = 0; k < 4; k++) {
        uz_mesh mesh = box_mesh(KINDS[k], 3);
        uz_skin skin;
        uz_skin_edges edges;
        uz_error err = {0};
        CHECK(uz_skin_build(&skin, &mesh, NULL, &err) == UZ_OK);
        CHECK(uz_skin_edges_build(&edges, &skin, &mesh, &err) == UZ_OK);
        const int64_t pieces = k >= 2 ? 2 : 1, faces = k % 3 == 0 ? 52 : 104, corners = 54;
        CHECK_INT(skin.n_cells, faces);
        CHECK_INT(edges.n_lines, pieces * (corners + faces - 2));
        double length = 0;
        for (int64_t i = 0; i < edges.n_outline; i++)
            length += distance(&mesh, edges.outline[2 * i], edges.outline[2 * i + 1]);
        CHECK_MSG(fabs(length - 36) < 1e-12, "%s: %g", KINDS[k], length);
        uz_skin_edges_clear(&edges);
        uz_skin_clear(&skin);
        uz_mesh_clear(&mesh);
    }
}

/* Many elements around one node: its bucket of edges is sorted the other way. */
TEST(a_wheel_of_triangles_has_a_rim)
{
    enum { SPOKES = 40 };
    double xyz[2 * (SPOKES + 1)] = {0};
    int64_t first[SPOKES + 1], node[3 * SPOKES];
    unsigned char kind[SPOKES];
    uz_mesh mesh = {.dim = 2, .n_nodes = SPOKES + 1, .n_elements = SPOKES, .xyz = xyz, .kind = kind, .first = first};
    uz_skin skin;
    uz_skin_edges edges;
    mesh.node = node;
    for (int i = 0; i < SPOKES; i++) {
        xyz[2 * (i + 1)] = cos(0.05 * M_PI * i);
        xyz[2 * (i + 1) + 1] = sin(0.05 * M_PI * i);
        kind[i] = UZ_TRI3;
        first[i] = 3 * i;
        node[3 * i] = 0;
        node[3 * i + 1] = i + 1;
        node[3 * i + 2] = (i + 1) % SPOKES + 1;
    }
    first[SPOKES] = 3 * SPOKES;
    CHECK(uz_skin_build(&skin, &mesh, NULL, NULL) == UZ_OK);
    CHECK(uz_skin_edges_build(&edges, &skin, &mesh, NULL) == UZ_OK);
    CHECK_INT(edges.n_lines, 2 * SPOKES);
    CHECK_INT(edges.n_outline, SPOKES);
    for (int64_t i = 0; i < 2 * edges.n_outline; i++)
        CHECK(edges.outline[i] > 0);
    uz_skin_edges_clear(&edges);
    uz_skin_clear(&skin);
}

TEST(triangles_of_a_cell_cover_it_once)
{
    /* A unit square, or half of one, with the middles of its edges: corners and middles in turn. */
    static const double QUAD[8][2] = {{0, 0}, {0.5, 0}, {1, 0}, {1, 0.5}, {1, 1}, {0.5, 1}, {0, 1}, {0, 0.5}};
    static const double TRI[6][2] = {{0, 0}, {0.5, 0}, {1, 0}, {0.5, 0.5}, {0, 1}, {0, 0.5}};
    for (int points = 3; points <= 8; points += points == 4 ? 2 : points == 6 ? 2 : 1) {
        const bool quad = points % 4 == 0;
        const int skip = points < 5 ? 2 : 1;
        const int(*triangle)[3];
        double area = 0;
        const int count = uz_cell_triangles(&triangle, points);
        for (int t = 0; t < count; t++) {
            const double(*at)[2] = quad ? QUAD : TRI;
            const double *a = at[skip * triangle[t][0]], *b = at[skip * triangle[t][1]], *c = at[skip * triangle[t][2]];
            const double half = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
            CHECK_MSG(half > 0.1, "triangle %d of %d points: %g", t, points, half);
            area += half;
        }
        CHECK_MSG(fabs(area - (quad ? 1 : 0.5)) < 1e-15, "%d points: %g", points, area);
    }
}

static uz_scene pressed_scene(uz_model model, const char *element)
{
    uz_scene s = body_scene(model, element, SIZE, CELLS);
    body_hold(&s, "top", 0, -0.001, model == UZ_SOLID ? 0 : NAN);
    uz_contact *contact = &s.contacts[s.n_contacts++];
    *contact = (uz_contact){.kind = UZ_OBSTACLE_PLANE, .normal = {0, 1, 0}};
    snprintf(contact->on, sizeof contact->on, "bottom");
    return s;
}

/* Any displacements and reactions will do: nothing is solved. */
static uz_field_source some_answer(const uz_scene *scene, double size)
{
    int dim;
    int64_t n_nodes, m;
    uz_error err = {0};
    CHECK_MSG(uz_scene_sizes(&dim, &n_nodes, &m, scene, &err) == UZ_OK, "%s", err.message);
    double *u = body_room(n_nodes * dim, sizeof *u), *r = body_room(m, sizeof *r), *g = body_room(m, sizeof *g);
    for (int64_t i = 0; i < n_nodes * dim; i++)
        u[i] = size * sin(0.1 * (double)i);
    for (int64_t i = 0; i < m; i++)
        r[i] = -size * (double)(i + 1);
    return (uz_field_source){.u = u, .r = r, .g = g, .n_u = n_nodes * dim, .m = m};
}

static void drop_answer(uz_field_source *answer)
{
    free((void *)(uintptr_t)answer->u);
    free((void *)(uintptr_t)answer->r);
    free((void *)(uintptr_t)answer->g);
}

TEST(units_are_powers_of_two_that_nothing_exceeds)
{
    static const double SIZES[] = {1e-30, 3e-4, 1, 7e5};
    for (int k = 0; k < 4; k++) {
        uz_scene scene = pressed_scene(UZ_SOLID, "hex8");
        uz_field_source answer = some_answer(&scene, SIZES[k]);
        uz_surface s;
        uz_error err = {0};
        CHECK_MSG(uz_surface_compute(&s, &scene, &answer, UZ_FIELD_PRESSURE | UZ_FIELD_VON_MISES, 0, NULL, &err) ==
                      UZ_OK,
                  "%s", err.message);
        int exponent;
        CHECK(frexp(s.reaction.unit, &exponent) == 0.5 && frexp(s.unit, &exponent) == 0.5);
        CHECK_INT(s.n_rows, answer.m);
        for (int64_t i = 0; i < s.n_rows; i++) {
            CHECK(fabsf(s.reaction.x[i]) <= 1);
            CHECK(fabs(s.reaction.unit * (double)s.reaction.x[i] - answer.r[i]) <= 1e-7 * fabs(s.reaction.low));
        }
        CHECK(s.reaction.low == answer.r[answer.m - 1] && s.reaction.high == answer.r[0]);
        CHECK(s.gap.unit == 1 && s.gap.low == 0 && s.gap.high == 0);
        uz_surface_clear(&s);
        drop_answer(&answer);
        uz_scene_clear(&scene);
    }
}

TEST(what_is_too_large_or_no_answer_is_refused)
{
    uz_scene scene = pressed_scene(UZ_PLANE_STRAIN, "quad4");
    uz_field_source answer = some_answer(&scene, 1e-3);
    uz_surface s;
    uz_error err;
    CHECK_INT(uz_surface_compute(&s, &scene, &answer, 0, 100, NULL, &err), UZ_ERR_LIMIT);
    CHECK(s.position == NULL && s.triangle == NULL && strstr(err.message, "12 triangles"));
    CHECK_INT(uz_surface_compute(&s, &scene, &answer, 0, 100000, NULL, &err), UZ_OK);
    CHECK(s.von_mises.x == NULL && s.pressure.x == NULL && s.node == NULL && s.arc.x);
    uz_surface_clear(&s);
    ((double *)(uintptr_t)answer.u)[3] = NAN;
    CHECK_INT(uz_surface_compute(&s, &scene, &answer, 0, 0, NULL, &err), UZ_ERR_NOT_FINITE);
    ((double *)(uintptr_t)answer.u)[3] = 1e35;
    CHECK_INT(uz_surface_compute(&s, &scene, &answer, 0, 0, NULL, &err), UZ_ERR_NOT_FINITE);
    answer.n_u--;
    CHECK_INT(uz_surface_compute(&s, &scene, &answer, 0, 0, NULL, &err), UZ_ERR_SIZE);
    drop_answer(&answer);
    uz_scene_clear(&scene);
}

TEST(arc_is_the_place_along_a_straight_side)
{
    uz_scene scene = pressed_scene(UZ_PLANE_STRAIN, "quad8");
    uz_body_model model;
    uz_error err = {0};
    CHECK(uz_body_model_build(&model, &scene, UZ_BODY_OUTLINE, &err) == UZ_OK);
    double arc[7];
    unsigned part[7];
    CHECK_INT(model.m, 7); /* middles too */
    CHECK(uz_contact_arc(arc, part, &model, &scene, &err) == UZ_OK);
    for (int64_t i = 0; i < model.m; i++) {
        const double x = model.mesh.xyz[2 * model.info.contact_node[i]];
        CHECK_MSG(fabs(arc[i] - x) < 1e-12 && part[i] == 0, "row %lld at %g: %g", (long long)i, x, arc[i]);
    }
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* A ring of sides has no end: it begins where the group does. A node that no side leads to is put behind. */
TEST(arc_goes_around_a_ring)
{
    double xyz[] = {0, 0, 3, 0, 3, 1, 0, 1, 9, 9};
    int64_t first[] = {0, 4}, node[] = {0, 1, 2, 3}, contact_node[] = {0, 1, 2, 3, 4}, contact_of[] = {0, 0, 0, 0, 0};
    unsigned char kind[] = {UZ_QUAD4};
    uz_face face[] = {{0, 2}, {0, 3}, {0, 0}, {0, 1}};
    uz_group ring = {.name = "ring", .kind = UZ_GROUP_FACES, .n_faces = 4, .face = face};
    const uz_body_model model = {.m = 5,
                                 .mesh = {.dim = 2,
                                          .n_nodes = 5,
                                          .n_elements = 1,
                                          .xyz = xyz,
                                          .kind = kind,
                                          .first = first,
                                          .node = node,
                                          .groups = &ring,
                                          .n_groups = 1},
                                 .info = {.dim = 2, .contact_node = contact_node, .contact_of = contact_of}};
    uz_contact contact = {.on = "ring"};
    const uz_scene scene = {.contacts = &contact, .n_contacts = 1};
    static const double EXPECTED[] = {4, 7, 0, 3, 8};
    double arc[5];
    unsigned part[5];
    CHECK(uz_contact_arc(arc, part, &model, &scene, NULL) == UZ_OK);
    for (int i = 0; i < 5; i++)
        CHECK_MSG(arc[i] == EXPECTED[i] && part[i] == (i == 4), "row %d: %g in %u", i, arc[i], part[i]);
}
