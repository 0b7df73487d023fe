/* Supports along normals, springs, several materials and every kind of load, against theory. */
#include "body_fixture.h"

static const double PI = 3.14159265358979323846;

/* ------------------------------------------------------------- turned scenes */

static double turn_by; /* of the maps below */

static void turn_plane(double x[3])
{
    const double c = cos(turn_by), s = sin(turn_by), at[2] = {x[0], x[1]};
    x[0] = c * at[0] - s * at[1];
    x[1] = s * at[0] + c * at[1];
}

/* About the axis (1, 2, 3) by Rodrigues' formula. */
static void turn_space(double x[3])
{
    const double n = sqrt(14.0), k[3] = {1 / n, 2 / n, 3 / n}, c = cos(turn_by), s = sin(turn_by);
    const double dot = k[0] * x[0] + k[1] * x[1] + k[2] * x[2], at[3] = {x[0], x[1], x[2]};
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        x[i] = at[i] * c + (k[j] * at[l] - k[l] * at[j]) * s + k[i] * dot * (1 - c);
    }
}

/* A block between planes of symmetry, one side moved, pulled sideways and pressed on a floor: in the frame that `map`
 * makes of the axes. Where there are `components`, supports are along the axes. */
static uz_result *rotated_block(uz_model model, const char *element, body_map map, double angle, bool components)
{
    const body_map turn = map;
    uz_scene s = body_scene(model, element, (double[3]){4, 2, 2}, (int64_t[3]){4, 2, 2});
    double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, load[2][3] = {{1, -6, 0.5}, {9, 4, 0}};
    turn_by = angle;
    for (int c = 0; c < 3; c++)
        turn(axis[c]);
    for (int c = 0; c < 2; c++)
        turn(load[c]);
    if (components) {
        body_hold(&s, "left", 1e-4, NAN, NAN);
        if (model == UZ_SOLID)
            body_hold(&s, "back", NAN, NAN, 0);
    } else {
        body_hold_normal(&s, "left", axis[0], 1e-4);
        if (model == UZ_SOLID)
            body_hold_normal(&s, "back", axis[2], 0);
    }
    body_load(&s, UZ_LOAD_TRACTION, "top", load[0][0], load[0][1], load[0][2]);
    body_load(&s, UZ_LOAD_TRACTION, "right", load[1][0], load[1][1], load[1][2]);
    body_load(&s, UZ_LOAD_PRESSURE, "top", 3, 0, 0);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, axis[1]);
    body_give_mesh(&s, turn);
    uz_result *x = body_solve(&s, 1e-10);
    uz_scene_clear(&s);
    return x;
}

static void check_rotated(uz_model model, const char *element, body_map turn, double angle)
{
    uz_result *straight = rotated_block(model, element, turn, 0, true);
    uz_result *turned = rotated_block(model, element, turn, angle, false);
    const int dim = straight->summary.dim;
    const double most = body_most(straight->u, straight->n_nodes * dim);
    CHECK(straight->summary.active > 0 && straight->summary.active < straight->m);
    CHECK_INT(turned->m, straight->m);
    CHECK_INT(turned->summary.active, straight->summary.active);
    CHECK_INT(turned->summary.semicoercive.free_modes, 1);
    CHECK_REL(turned->summary.certificate.energy_primal, straight->summary.certificate.energy_primal, 1e-9);
    for (int64_t a = 0; a < straight->n_nodes; a++) {
        double u[3] = {0};
        memcpy(u, straight->u + a * dim, (size_t)dim * sizeof *u);
        turn(u);
        for (int c = 0; c < dim; c++)
            CHECK(fabs(turned->u[a * dim + c] - u[c]) < 1e-8 * most);
    }
    CHECK(fabs(body_most(turned->r, turned->m) / body_most(straight->r, straight->m) - 1) < 1e-7);
    uz_result_free(straight);
    uz_result_free(turned);
}

TEST(a_turned_scene_has_the_turned_answer)
{
    check_rotated(UZ_PLANE_STRESS, "quad4", turn_plane, 0.4);
    check_rotated(UZ_PLANE_STRAIN, "tri6", turn_plane, 2.5);
    check_rotated(UZ_SOLID, "hex8", turn_space, 1.1);
    check_rotated(UZ_SOLID, "tet4", turn_space, -0.7);
    check_rotated(UZ_SOLID, "tet10", turn_space, 0.3);
}

/* The supports of one node: two planes leave a line, three nothing, a fourth must agree. */
TEST(several_supports_at_one_node)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){1, 1, 1}, (int64_t[3]){1, 1, 1});
    uz_error err = {0};
    const double a[3] = {1, 1, 0}, b[3] = {0, 1, 1}, c[3] = {1, 2, 1};
    body_hold(&s, "bottom", 0, 0, 0);
    body_hold_normal(&s, "top", a, 1e-3);
    body_hold_normal(&s, "top", b, -2e-3);
    body_hold_normal(&s, "top", c, (sqrt(2) * 1e-3 - sqrt(2) * 2e-3) / sqrt(6)); /* the sum of both */
    body_load(&s, UZ_LOAD_TRACTION, "right", 30, 20, 10);
    uz_result *x = body_solve(&s, 1e-10);
    for (int64_t i = 0; i < x->n_nodes; i++) {
        const double *u = x->u + 3 * i;
        if (x->mesh.xyz[3 * i + 1] == 0)
            continue;
        CHECK(fabs(u[0] + u[1] - sqrt(2) * 1e-3) < 1e-15);
        CHECK(fabs(u[1] + u[2] + sqrt(2) * 2e-3) < 1e-15);
        CHECK(fabs(u[0] - u[1] + u[2]) > 1e-9); /* along the line that is left it moves */
    }
    /* What was solved verifies, and only with the supports' values. */
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = s};
    uz_settings settings = uz_settings_default();
    uz_result *verified = NULL;
    CHECK_MSG(uz_verify(&verified, &problem, x->u, x->r, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    CHECK(verified && verified->summary.outcome == UZ_VERIFIED);
    uz_result_free(verified);
    x->u[3 * 7] += 1e-9;
    CHECK_INT(uz_verify(&verified, &problem, x->u, x->r, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    CHECK_MSG(strstr(err.message, "node 7 is supported: its displacement along the normal"), "%s", err.message);
    uz_result_free(x);
    s.supports[3].value += 1e-6;
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/supports/3/u");
    CHECK_MSG(strstr(err.message, "is given"), "%s", err.message);
    uz_scene_clear(&s);
}

static int64_t row_entries(const uz_csc *N, int64_t row)
{
    int64_t count = 0;
    for (int64_t q = 0; q < N->ptr[N->cols]; q++)
        count += N->idx[q] == row;
    return count;
}

/* On what an inclined plane of symmetry leaves of a node, the normal of an obstacle is a dof again. */
TEST(an_obstacle_at_inclined_supports_costs_one_dof)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 1}, (int64_t[3]){2, 2, 2});
    body_hold_normal(&s, "left", (double[3]){2, 1, 1}, 0);
    body_hold_normal(&s, "right", (double[3]){0, 3, 1}, 0);
    body_plane(&s, "bottom", (double[3]){0, -1, 0}, (double[3]){0.3, 1, -0.2});
    uz_body_model model = body_model(&s);
    CHECK_INT(model.m, 9);
    for (int64_t i = 0; i < model.m; i++) {
        const int64_t a = model.info.contact_node[i];
        CHECK_INT(row_entries(&model.N, i), 1);
        for (int64_t t = 0; t < model.info.n_rotated; t++)
            for (int k = 0; k < 9 && model.info.rotated_node[t] == a; k++) { /* its frame is orthogonal */
                const double *Q = model.info.frame + 9 * t;
                double dot = 0;
                for (int c = 0; c < 3; c++)
                    dot += Q[k / 3 * 3 + c] * Q[k % 3 * 3 + c];
                CHECK(fabs(dot - (k / 3 == k % 3)) < 1e-15);
            }
    }
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}

/* What the obstacle bounds is held already, but for rounding in the frame: no row. */
TEST(an_obstacle_along_the_held_direction_has_no_rows)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 1}, (int64_t[3]){2, 2, 2});
    body_hold(&s, "bottom", 0, 0, 0);
    body_hold_normal(&s, "left", (double[3]){2, 1, 1}, 0);
    body_plane(&s, "left", (double[3]){-9, 0, 0}, (double[3]){4, 2, 2});
    body_plane(&s, "right", (double[3]){9, 0, 0}, (double[3]){-4, 2, 2});
    uz_body_model model = body_model(&s);
    CHECK_INT(model.m, 6);
    CHECK_INT(model.info.contact_of[0], 1);
    uz_body_model_clear(&model);
    uz_scene_clear(&s);
}

/* -------------------------------------------------------------------- springs */

/* A block on elastic ground: it sinks by force over stiffness, whatever else it does, and nothing is left free. */
TEST(springs_hold)
{
    static const char *const elements[] = {"hex8", "tet4", "tet10"};
    for (int k = 0; k < 3; k++) {
        uz_scene s = body_scene(UZ_SOLID, elements[k], (double[3]){2, 1, 1}, (int64_t[3]){2, 2, 2});
        uz_error err = {0};
        body_spring(&s, "bottom", 10, 40, 20);
        body_load(&s, UZ_LOAD_TRACTION, "top", 1, -3, 2);
        CHECK_MSG(uz_scene_check(&s, &err) == UZ_OK, "%s", err.message);
        uz_body_model model = body_model(&s);
        uz_result *x = body_solve(&s, 1e-10);
        double force[3] = {0};
        for (int64_t i = 0; i < 3 * x->n_nodes; i++)
            force[i % 3] += model.spring[i] * x->u[i];
        CHECK_REL(force[0], 2.0, 1e-8);
        CHECK_REL(force[1], -6.0, 1e-8);
        CHECK_REL(force[2], 4.0, 1e-8);
        uz_result_free(x);
        uz_body_model_clear(&model);
        s.supports[0].spring[2] = 0;
        CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_FREE_BODY);
        CHECK_MSG(strstr(err.message, "leave translation along z"), "%s", err.message);
        uz_scene_clear(&s);
    }
}

/* At a turned node a spring is a full matrix: one along x, the node held along an inclined normal. */
TEST(springs_at_inclined_supports)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){1, 1, 0}, (int64_t[3]){1, 1, 0});
    body_hold_normal(&s, "bottom", (double[3]){3, 4, 0}, 0);
    body_spring(&s, "bottom", 5, 0, 0);
    body_load(&s, UZ_LOAD_FORCE, "top", 4, 1, 0);
    uz_result *x = body_solve(&s, 1e-10);
    /* The slide is (0.8, -0.6), the force along it 3.2 - 0.6 = 2.6, the stiffness 5 * 0.64. */
    CHECK_REL(x->u[0] + x->u[2], 2 * 0.8 * 2.6 / 3.2, 1e-8);
    CHECK_REL(x->u[1] + x->u[3], -2 * 0.6 * 2.6 / 3.2, 1e-8);
    uz_result_free(x);
    uz_scene_clear(&s);
}

/* ---------------------------------------------------------------------- loads */

/* A column hung at its top, or pressed by its own weight: exact at the nodes of a column of linear elements. */
TEST(gravity_column_of_two_materials)
{
    static const char *const elements[] = {"quad4", "tri6", "quad8", "hex8", "tet10", "hex20"};
    for (int k = 0; k < 6; k++) {
        const uz_model model = k < 3 ? UZ_PLANE_STRESS : UZ_SOLID;
        uz_scene s = body_scene(model, elements[k], (double[3]){1, 8, 1}, (int64_t[3]){1, 8, 1});
        const double E = 1000, rho[2] = {0.5, 2}, g = 10;
        s.materials[0] = (uz_material){.on = "low", .young = E, .density = rho[0]};
        s.materials[1] = (uz_material){.on = "high", .young = 4 * E, .density = rho[1]};
        s.n_materials = 2;
        body_give_mesh(&s, NULL);
        for (int half = 0; half < 2; half++) { /* the elements below and above y = 4 */
            uz_given_group *group = &s.given.groups[s.given.n_groups++];
            snprintf(group->name, sizeof group->name, half ? "high" : "low");
            group->element = body_room(s.given.n_elements, sizeof *group->element);
            for (int64_t e = 0; e < s.given.n_elements; e++) {
                double y = 0;
                const int64_t first = s.given.first[e], count = s.given.first[e + 1] - first;
                for (int64_t i = first; i < first + count; i++)
                    y += s.given.xyz[s.given.node[i] * s.given.dim + 1] / (double)count;
                if ((y > 4) == half)
                    group->element[group->n_elements++] = e;
            }
        }
        body_hold(&s, "bottom", 0, 0, 0);
        body_load(&s, UZ_LOAD_GRAVITY, "all", 0, -g, 0);
        uz_result *x = body_solve(&s, 1e-10);
        /* w(4) = -(rho0 g 16/2 + rho1 g 4 * 4)/E, then with 4E above. */
        const double middle = -(rho[0] * g * 8 + rho[1] * g * 16) / E, end = middle - rho[1] * g * 8 / (4 * E);
        for (int64_t a = 0; a < x->n_nodes; a++) {
            const double y = x->mesh.xyz[a * x->summary.dim + 1], u = x->u[a * x->summary.dim + 1];
            if (y == 4)
                CHECK_MSG(fabs(u - middle) < 1e-8 * fabs(end), "%s: %g, %g", elements[k], u, middle);
            if (y == 8)
                CHECK_MSG(fabs(u - end) < 1e-8 * fabs(end), "%s: %g, %g", elements[k], u, end);
        }
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* The sum of every kind of load is what it says. */
TEST(loads_add_up)
{
    static const struct {
        uz_model model;
        const char *element;
    } kinds[] = {{UZ_PLANE_STRESS, "tri3"}, {UZ_PLANE_STRAIN, "quad8"}, {UZ_SOLID, "hex8"}, {UZ_SOLID, "tet10"}};
    for (int k = 0; k < 4; k++) {
        uz_scene s = body_scene(kinds[k].model, kinds[k].element, (double[3]){3, 2, 0.5}, (int64_t[3]){3, 2, 2});
        uz_error err = {0};
        const bool solid = kinds[k].model == UZ_SOLID;
        s.thickness = 0.5;
        s.materials[0].density = 7;
        s.materials[0].expansion = 1e-5;
        body_hold(&s, "left", 0, 0, 0);
        body_load(&s, UZ_LOAD_TRACTION, "right", 1, 2, solid ? 3 : 0);
        body_load(&s, UZ_LOAD_PRESSURE, "top", 4, 0, 0);
        body_load(&s, UZ_LOAD_FORCE, "right", 11, 12, solid ? 13 : 0);
        body_load(&s, UZ_LOAD_FORCE, "all", 1, 1, solid ? 1 : 0);
        body_load(&s, UZ_LOAD_BODY_FORCE, "all", 0.1, 0.2, solid ? 0.3 : 0);
        body_load(&s, UZ_LOAD_GRAVITY, "all", 0, -9, 0);
        body_load(&s, UZ_LOAD_NODE_FORCE, "all", 5, 6, solid ? 7 : 0)->node = 2;
        body_load(&s, UZ_LOAD_TEMPERATURE, "all", 100, 0, 0);
        uz_body_model model = body_model(&s);
        const int dim = model.mesh.dim;
        double *f = body_room(model.mesh.n_nodes * dim, sizeof *f), sum[3] = {0};
        CHECK_MSG(uz_nodal_loads(f, &model, &s, &err) == UZ_OK, "%s", err.message);
        for (int64_t i = 0; i < model.mesh.n_nodes * dim; i++)
            sum[i % dim] += f[i];
        CHECK_REL(sum[0], 1 + 11 + 1 + 0.3 + 5, 1e-12);
        CHECK_REL(sum[1], 2 - 4 * 1.5 + 12 + 1 + 0.6 - 7 * 9 * 3 + 6, 1e-12);
        CHECK_REL(sum[2], solid ? 3 + 13 + 1 + 0.9 + 7 : 0, 1e-12);
        s.loads[6].node = model.mesh.n_nodes;
        CHECK_INT(uz_nodal_loads(f, &model, &s, &err), UZ_ERR_SCENE);
        CHECK_STR(err.where, "/loads/6/node");
        free(f);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}

/* Free to expand: the strain is expansion times rise and there is no stress; held, it is pressed on the obstacle. */
TEST(free_expansion_has_no_stress)
{
    static const struct {
        uz_model model;
        const char *element;
    } kinds[] = {{UZ_PLANE_STRESS, "tri3"}, {UZ_PLANE_STRAIN, "quad4"}, {UZ_AXISYMMETRIC, "quad8"},
                 {UZ_AXISYMMETRIC, "tri3"}, {UZ_SOLID, "hex8"},         {UZ_SOLID, "tet10"}};
    for (int k = 0; k < 6; k++) {
        uz_scene s = body_scene(kinds[k].model, kinds[k].element, (double[3]){3, 2, 1}, (int64_t[3]){3, 2, 2});
        const double rise = 1e-5 * 80, eps = kinds[k].model == UZ_PLANE_STRAIN ? 1.3 * rise : rise;
        s.materials[0].expansion = 1e-5;
        body_hold(&s, "left", kinds[k].model == UZ_AXISYMMETRIC ? NAN : 0, NAN, NAN);
        s.n_supports = kinds[k].model == UZ_AXISYMMETRIC ? 0 : 1;
        body_hold(&s, "bottom", NAN, 0, NAN);
        if (kinds[k].model == UZ_SOLID)
            body_hold(&s, "back", NAN, NAN, 0);
        body_load(&s, UZ_LOAD_TEMPERATURE, "all", 80, 0, 0);
        uz_result *x = body_solve(&s, 1e-10);
        for (int64_t i = 0; i < x->n_nodes * x->summary.dim; i++)
            CHECK_MSG(fabs(x->u[i] - eps * x->mesh.xyz[i]) < 1e-8 * eps, "%s", kinds[k].element);
        uz_body_model model = body_model(&s);
        uz_mesh_look look;
        CHECK(uz_estimate_mesh_error(NULL, &look, &model, &s, x->u) <= 0 && look.share >= 1);
        uz_body_model_clear(&model);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* A bar between a wall and an obstacle with a gap, heated by more than the gap lets it: sigma = E (gap/L - alpha T). */
TEST(heated_bar_meets_an_obstacle)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){10, 1, 0}, (int64_t[3]){10, 2, 0});
    s.materials[0].expansion = 1e-5;
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_TEMPERATURE, "all", 100, 0, 0);
    body_plane(&s, "right", (double[3]){10.004, 0, 0}, (double[3]){-1, 0, 0});
    uz_result *x = body_solve(&s, 1e-10);
    CHECK_INT(x->summary.active, 3);
    CHECK_REL(x->summary.force[0], 200e3 * (4e-4 - 1e-3), 1e-8);
    uz_result_free(x);
    uz_scene_clear(&s);
}

/* The loads of a case replace all of the scene's, temperature among them. */
TEST(cases_replace_temperatures)
{
    uz_scene s = body_scene(UZ_PLANE_STRESS, "quad4", (double[3]){10, 1, 0}, (int64_t[3]){10, 2, 0});
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
    uz_settings settings = uz_settings_default();
    uz_result **x = NULL;
    uz_error err = {0};
    s.materials[0].expansion = 1e-5;
    body_hold(&s, "left", 0, NAN, NAN);
    body_hold(&s, "bottom", NAN, 0, NAN);
    body_load(&s, UZ_LOAD_TEMPERATURE, "all", 100, 0, 0);
    uz_load pull = {.kind = UZ_LOAD_TRACTION, .on = "right", .v = {20, 0, 0}};
    uz_load_case cases[2] = {{.name = "hot"}, {.name = "pulled", .loads = &pull, .n_loads = 1}};
    problem.scene = s;
    problem.cases = cases;
    problem.n_cases = 2;
    CHECK_MSG(uz_solve_cases(&x, &problem, &settings, NULL, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    if (x) {
        CHECK_REL(x[0]->u[2 * 10], 10 * 1e-3, 1e-7);
        CHECK_REL(x[1]->u[2 * 10], 10 * 1e-4, 1e-7);
    }
    uz_results_free(x, 2);
    uz_scene_clear(&s);
}

/* ------------------------------------------------------------- thick cylinder */

enum { INNER = 1, OUTER = 2 };

static void quarter(double x[3])
{
    const double r = INNER + x[0], angle = 0.5 * PI * x[1];
    x[0] = r * cos(angle);
    x[1] = r * sin(angle);
}

static void shift_out(double x[3])
{
    x[0] += INNER;
}

/* Lame: u_r = p a^2 / (b^2 - a^2) (1 + nu) / E ((1 - 2 nu) r + b^2 / r) in plane strain. */
static double lame(double r, double p)
{
    const double a2 = INNER * INNER, b2 = OUTER * OUTER;
    return p * a2 / (b2 - a2) * 1.3 / 200e3 * (0.4 * r + b2 / r);
}

/* Mean radial displacement of the inside, by refinement n. */
static double inside_of_cylinder(bool ring, const char *element, int64_t n)
{
    uz_scene s = body_scene(ring ? UZ_AXISYMMETRIC : UZ_PLANE_STRAIN, element, (double[3]){1, 1, 0},
                            (int64_t[3]){n, ring ? 2 : 2 * n, 0});
    if (ring) {
        body_hold(&s, "top", NAN, 0, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
    } else {
        body_hold(&s, "top", 0, NAN, NAN);
        body_hold(&s, "bottom", NAN, 0, NAN);
    }
    body_load(&s, UZ_LOAD_PRESSURE, "left", 50, 0, 0);
    body_give_mesh(&s, ring ? shift_out : quarter);
    uz_result *x = body_solve(&s, 1e-10);
    double sum = 0, count = 0;
    for (int64_t a = 0; a < x->n_nodes; a++)
        if (fabs(hypot(ring ? 0 : x->mesh.xyz[2 * a + 1], x->mesh.xyz[2 * a]) - INNER) < 1e-9) {
            sum += ring ? x->u[2 * a] : hypot(x->u[2 * a], x->u[2 * a + 1]);
            count++;
        }
    uz_result_free(x);
    uz_scene_clear(&s);
    return sum / count;
}

TEST(thick_cylinder_is_lames)
{
    static const char *const elements[] = {"tri3", "quad4", "tri6", "quad8"};
    for (int ring = 0; ring < 2; ring++)
        for (int k = 0; k < 4; k++) {
            const double exact = lame(INNER, 50);
            const double coarse = fabs(inside_of_cylinder(ring, elements[k], 4) / exact - 1);
            const double fine = fabs(inside_of_cylinder(ring, elements[k], 8) / exact - 1);
            CHECK_MSG(fine < (k < 2 ? 0.02 : 1e-3) && fine < 0.4 * coarse, "%s%s: %g, then %g", elements[k],
                      ring ? " ring" : "", coarse, fine);
        }
}
