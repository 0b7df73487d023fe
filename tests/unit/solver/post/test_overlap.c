/* How deep deformed surfaces stand in each other: against displacements whose overlap is known. */
#include "body_fixture.h"
#include "post/overlap.h"

typedef void displacement(double u[3], const double x[3]);

/* What is measured of one contact where the nodes move so. */
static uz_overlap overlap_of(const uz_scene *s, displacement *move)
{
    uz_body_model model = body_model(s);
    const int dim = model.mesh.dim;
    double *u = body_room(model.mesh.n_nodes * dim, sizeof *u);
    uz_overlap out;
    uz_error err = {0};
    for (int64_t i = 0; i < model.mesh.n_nodes; i++) {
        double x[3] = {0}, v[3] = {0};
        memcpy(x, model.mesh.xyz + i * dim, (size_t)dim * sizeof *x);
        move(v, x);
        memcpy(u + i * dim, v, (size_t)dim * sizeof *v);
    }
    CHECK_MSG(uz_measure_overlap(&out, &model, s, u, &err) == UZ_OK, "%s", err.message);
    free(u);
    uz_body_model_clear(&model);
    return out;
}

static void stay(double u[3], const double x[3])
{
    (void)u;
    (void)x;
}

static void sink(double u[3], const double x[3])
{
    (void)x;
    u[1] = -0.25;
}

static void rise(double u[3], const double x[3])
{
    (void)x;
    u[1] = 0.25;
}

static bool is_solid(int element)
{
    return uz_element_type_of((uz_element_kind)element)->dim == 3;
}

/* A block 4 x 1 [x 4] of 4 cells over an obstacle under its bottom. */
static uz_scene block(int element)
{
    const double size[3] = {4, 1, 4};
    uz_scene s = body_scene(is_solid(element) ? UZ_SOLID : UZ_PLANE_STRAIN, uz_element_name((uz_element_kind)element),
                            size, (int64_t[3]){4, 1, 4});
    body_hold(&s, "top", 0, 0, 0);
    return s;
}

static uz_contact *ball(uz_scene *s, const double centre[3], double radius)
{
    uz_contact *c = body_plane(s, "bottom", centre, (double[3]){0, 1, 0});
    c->kind = UZ_OBSTACLE_ROUND;
    c->radius = radius;
    return c;
}

TEST(a_plane_is_entered_by_as_much_as_the_body_sinks)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++) {
        uz_scene s = block(i);
        body_plane(&s, "bottom", (double[3]){0}, (double[3]){0, 2, 0});
        CHECK_REL(overlap_of(&s, sink).depth, 0.25, 1e-12);
        CHECK(overlap_of(&s, stay).depth <= 1e-15);
        CHECK(overlap_of(&s, rise).depth == 0);
        CHECK_REL(overlap_of(&s, sink).motion, 0.25, 1e-12);
        uz_scene_clear(&s);
    }
}

/* It stands half its radius deep between nodes, which are at whole numbers: none of them is in it. */
TEST(an_obstacle_smaller_than_a_side_is_seen)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++)
        for (int k = 0; k < 7; k++) {
            uz_scene s = block(i);
            const double radius = 0.05 * (k + 1), x = 2.37 + 0.03 * k;
            ball(&s, (double[3]){x, -0.5 * radius, is_solid(i) ? 1.6 : 0}, radius);
            const uz_overlap found = overlap_of(&s, stay);
            CHECK_MSG(fabs(found.depth - 0.5 * radius) < 0.01 * radius, "%s, radius %g: %g",
                      uz_element_name((uz_element_kind)i), radius, found.depth);
            CHECK(fabs(found.at[0] - x) < 0.1 * radius);
            CHECK_REL(found.side, 1.0, 0.5);
            uz_scene_clear(&s);
        }
}

/* A ball above the block is behind its bottom, and nothing of the contact. */
TEST(what_a_side_does_not_face_is_no_overlap)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++) {
        uz_scene s = block(i);
        ball(&s, (double[3]){2, 0.5, 2}, 0.4);
        CHECK(overlap_of(&s, stay).depth == 0);
        uz_scene_clear(&s);
    }
}

TEST(the_approach_is_that_of_a_spring_but_no_more_than_the_motion)
{
    const uz_overlap two[2] = {{.motion = 0.5}, {.motion = 2}};
    CHECK(uz_contact_approach(3, 6, two, 2) == 1);
    CHECK(uz_contact_approach(30, 6, two, 2) == 2);
    CHECK(uz_contact_approach(30, 6, two, 1) == 0.5);
    CHECK(uz_contact_approach(30, 0, two, 2) == 0);
}
