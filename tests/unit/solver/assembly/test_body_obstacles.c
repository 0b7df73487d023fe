/* Bodies on obstacles of every shape. */
#include "body_fixture.h"

/* A block pressed on its floor and pulled sideways at its top: a part of the floor opens. */
static uz_scene pulled_block(uz_model model, const char *element)
{
    uz_scene s = body_scene(model, element, (double[3]){6, 2, 2}, (int64_t[3]){9, 3, 3});
    if (model == UZ_SOLID)
        body_hold(&s, "back", NAN, NAN, 0);
    body_hold(&s, "left", 0, NAN, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -3, 0);
    body_load(&s, UZ_LOAD_TRACTION, "right", 0, 4, 0);
    return s;
}

static uz_contact *put_obstacle(uz_scene *s, uz_obstacle_kind kind)
{
    uz_contact *x = body_plane(s, "bottom", (double[3]){0}, (double[3]){0, 1, 0});
    x->kind = kind;
    return x;
}

static void copy_points(double **to, const double *from, int64_t n)
{
    *to = body_room(n, sizeof **to);
    memcpy(*to, from, (size_t)n * sizeof **to);
}

static void same_answer(const uz_result *a, const uz_result *b)
{
    const int64_t n = a->n_nodes * a->summary.dim;
    const double most = body_most(a->u, n);
    CHECK(a->summary.active > 0 && a->summary.active < a->m);
    CHECK_INT(b->m, a->m);
    CHECK_INT(b->summary.active, a->summary.active);
    for (int64_t i = 0; i < n; i++)
        CHECK(fabs(a->u[i] - b->u[i]) < 1e-7 * most);
}

/* A flat line or table is a plane. */
TEST(flat_obstacles_are_planes)
{
    static const double line_x[3] = {-10, 1, 4}, line_y[3] = {-1e-4, -1e-4, -1e-4};
    uz_scene plane = pulled_block(UZ_PLANE_STRAIN, "quad4");
    put_obstacle(&plane, UZ_OBSTACLE_PLANE)->point[1] = -1e-4;
    uz_result *want = body_solve(&plane, 1e-10);
    for (int k = 0; k < 2; k++) {
        uz_scene s = pulled_block(UZ_PLANE_STRAIN, "quad4");
        uz_contact *x = put_obstacle(&s, k == 0 ? UZ_OBSTACLE_POLYLINE : UZ_OBSTACLE_HEIGHT);
        if (k == 0) { /* to the right, the obstacle below */
            x->n_x = 3;
            copy_points(&x->x, line_x, 3);
            copy_points(&x->y, line_y, 3);
        } else {
            x->n_x = 2;
            copy_points(&x->x, line_x, 2);
            copy_points(&x->z, line_y, 2);
        }
        uz_result *got = body_solve(&s, 1e-10);
        same_answer(want, got);
        uz_result_free(got);
        uz_scene_clear(&s);
    }
    uz_result_free(want);
    uz_scene_clear(&plane);
}

/* The gap at the answer, measured anew at the moved nodes, is that of the rows up to curvature times sliding squared;
 * the contact forces point to the centre. */
static void check_round(uz_model model, const char *element, bool cylinder)
{
    const double R = 40, c[3] = {1, -R - 1e-5, 0.5};
    uz_scene s = pulled_block(model, element);
    const int dim = model == UZ_SOLID ? 3 : 2;
    uz_contact *x = put_obstacle(&s, cylinder ? UZ_OBSTACLE_CYLINDER : UZ_OBSTACLE_ROUND);
    memcpy(x->point, c, sizeof c);
    memcpy(x->normal, (double[3]){0, 0, 1}, sizeof x->normal);
    x->radius = R;
    const int across = cylinder || dim == 2 ? 2 : 3;
    uz_result *r = body_solve(&s, 1e-10);
    CHECK(r->summary.active > 0 && r->summary.active < r->m);
    double sum[3] = {0};
    for (int64_t i = 0; i < r->m; i++) {
        const int64_t a = r->mesh.contact_node[i];
        double square = 0, place = 0, moved = 0;
        for (int k = 0; k < across; k++) {
            const double at = r->mesh.xyz[a * dim + k] - c[k];
            place += at * at;
            square += (at + r->u[a * dim + k]) * (at + r->u[a * dim + k]);
            moved += r->u[a * dim + k] * r->u[a * dim + k];
        }
        for (int k = 0; k < dim; k++) {
            const double at = k < across ? r->mesh.xyz[a * dim + k] - c[k] : 0;
            CHECK(fabs(r->mesh.contact_normal[i * dim + k] - at / sqrt(place)) < 1e-12);
            sum[k] -= r->r[i] * at / sqrt(place);
        }
        CHECK(fabs(sqrt(square) - R - r->g[i]) < moved / R + 1e-9 * 1e-3);
    }
    for (int k = 0; k < dim; k++)
        CHECK_REL(r->summary.force[k], sum[k], 1e-9);
    CHECK_REL(sum[1], model == UZ_SOLID ? 20.0 : 10.0, 1e-6);
    uz_result_free(r);
    uz_scene_clear(&s);
}

TEST(round_obstacles)
{
    check_round(UZ_PLANE_STRESS, "quad4", false);
    check_round(UZ_PLANE_STRAIN, "tri6", false);
    check_round(UZ_SOLID, "hex8", true);
    check_round(UZ_SOLID, "tet4", false);
    check_round(UZ_SOLID, "tet10", true);
}

/* A prescribed displacement moves the gaps of the rows' own normals, and what it pushes into an obstacle is refused. */
TEST(supported_nodes_at_a_round_obstacle)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 0}, (int64_t[3]){4, 2, 0});
    uz_error err = {0};
    uz_contact *x = put_obstacle(&s, UZ_OBSTACLE_ROUND);
    body_hold(&s, "top", 0, -0.1, NAN);
    x->point[0] = 1;
    x->point[1] = -3;
    x->radius = 3;
    uz_result *r = body_solve(&s, 1e-10);
    CHECK(r->summary.active == 1 || r->summary.active == 3);
    uz_result_free(r);
    memcpy(s.supports[0].on, "bottom", 7);
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/contacts/0");
    CHECK_MSG(strstr(err.message, "inside the obstacle"), "%s", err.message);
    x->point[1] = 0;
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_SCENE); /* node 2 is its centre */
    uz_scene_clear(&s);
}

/* A sphere under a ring: axisymmetric against a quarter of the solid would need a fine mesh; here, that the force is
 * the load and that the ring touches symmetric to its plane: r = 0 first. */
TEST(a_disc_on_a_sphere)
{
    uz_scene s = body_scene(UZ_AXISYMMETRIC, "quad8", (double[3]){4, 2, 0}, (int64_t[3]){8, 4, 0});
    body_load(&s, UZ_LOAD_PRESSURE, "top", 50, 0, 0);
    uz_contact *x = put_obstacle(&s, UZ_OBSTACLE_ROUND);
    x->point[1] = -30;
    x->radius = 30;
    uz_result *r = body_solve(&s, 1e-9);
    CHECK(r->r[0] < 0 && r->summary.active < r->m);
    CHECK_INT(r->summary.semicoercive.free_modes, 1);
    CHECK_REL(r->summary.force[1], acos(-1) * 16 * 50, 1e-6);
    uz_result_free(r);
    uz_scene_clear(&s);
}

/* Before a ball that is small against a face of eight nodes the row of a middle with a share of its ends' gaps pressed
 * from as far as a tenth of its edge. The ball is beside the middle of an edge, or was far from the face at rest. */
TEST(a_ball_presses_only_what_it_touches)
{
    static const uz_kinematics KINDS[] = {UZ_KINEMATICS_FIXED, UZ_KINEMATICS_MOVING, UZ_KINEMATICS_FINITE};
    for (int k = 0; k < 6; k++) {
        const double way = k < 3 ? 0.02 : 3;
        uz_scene s = body_scene(UZ_SOLID, "hex20", (double[3]){2, 2, 1}, (int64_t[3]){2, 2, 1});
        s.materials[0].young = 100;
        s.materials[0].law = k % 3 == 2 ? UZ_ELASTIC_NEO_HOOKE : UZ_ELASTIC_LINEAR;
        s.kinematics = KINDS[k % 3];
        body_hold(&s, "front", 0, 0, -way);
        uz_contact *ball = body_plane(&s, "back", (double[3]){1, 0.5, -0.5 - way - 0.01}, (double[3]){0, 0, 1});
        ball->kind = UZ_OBSTACLE_ROUND;
        ball->radius = 0.5;
        for (int touches = 0; touches < 2; touches++) {
            uz_result *result = body_solve_to(&s, 1e-8);
            const uz_summary *found = &result->summary;
            CHECK_MSG(found->outcome == UZ_CONVERGED && (found->active > 0) == (touches == 1), "%d %d: %d, %lld rows",
                      k, touches, found->outcome, (long long)found->active);
            for (int i = 0; i < result->evaluation->n_warnings; i++) {
                const char *text = result->evaluation->warnings[i].message; /* whole, with what to do at its end */
                CHECK_MSG(strcmp(result->evaluation->warnings[i].code, "coarse_contact") != 0 ||
                              strcmp(text + strlen(text) - strlen("refine it"), "refine it") == 0,
                          "%s", text);
            }
            uz_result_free(result);
            ball->point[2] += 0.02;
        }
        uz_scene_clear(&s);
    }
}
