/* Whole bodies of every element and model against what theory says of them. */
#include "body_fixture.h"
#include "internal_forces.h"

typedef struct {
    uz_model model;
    const char *element;
} body_kind;

static const body_kind KINDS[] = {
    {UZ_PLANE_STRESS, "tri3"},  {UZ_PLANE_STRESS, "quad4"}, {UZ_PLANE_STRESS, "tri6"},  {UZ_PLANE_STRESS, "quad8"},
    {UZ_PLANE_STRAIN, "tri3"},  {UZ_PLANE_STRAIN, "quad8"}, {UZ_AXISYMMETRIC, "quad4"}, {UZ_AXISYMMETRIC, "tri6"},
    {UZ_AXISYMMETRIC, "quad8"}, {UZ_SOLID, "tet4"},         {UZ_SOLID, "hex8"},         {UZ_SOLID, "tet10"},
    {UZ_SOLID, "hex20"},        {UZ_SOLID, "wedge6"},       {UZ_SOLID, "wedge15"},
};
enum { N_KINDS = sizeof KINDS / sizeof KINDS[0] };

static const double SIZE[3] = {3, 2, 1.5};
static const int64_t CELLS[3] = {3, 2, 2};

/* Strain along the load and across it under a stress of 1 along y. Plane strain is held along z. */
static void uniaxial(double *along, double *across, uz_model model)
{
    const double E = 200e3, nu = 0.3;
    *along = model == UZ_PLANE_STRAIN ? (1 - nu * nu) / E : 1 / E;
    *across = model == UZ_PLANE_STRAIN ? -nu * (1 + nu) / E : -nu / E;
}

/* Planes of symmetry hold it sideways; along y only the floor does. */
static uz_scene block_on_floor(const body_kind *kind)
{
    uz_scene s = body_scene(kind->model, kind->element, SIZE, CELLS);
    if (kind->model != UZ_AXISYMMETRIC)
        body_hold(&s, "left", 0, NAN, NAN);
    if (kind->model == UZ_SOLID)
        body_hold(&s, "back", NAN, NAN, 0);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    return s;
}

/* ------------------------------------------------------------------- contact */

/* A uniform pressure on top: uniform stress, and on the floor each node's share of it. */
static void check_uniform_pressure(const body_kind *kind, body_map map, uz_formulation formulation)
{
    const double q = 12;
    uz_scene s = block_on_floor(kind);
    s.formulation = formulation;
    double along, across;
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -q, 0);
    if (map) {
        body_give_mesh(&s, map);
        body_straighten(&s);
    }
    uniaxial(&along, &across, kind->model);
    uz_result *x = body_solve(&s, 1e-9);
    const int dim = x->summary.dim;
    const double top = 2 * q * along;
    double sum = 0;
    for (int64_t a = 0; a < x->n_nodes; a++) {
        const double *at = x->mesh.xyz + a * dim, *u = x->u + a * dim;
        CHECK_MSG(fabs(u[1] + q * along * at[1]) < 1e-7 * top, "%s node %lld: %g", kind->element, (long long)a, u[1]);
        CHECK(fabs(u[0] + q * across * at[0]) < 1e-7 * top);
        if (dim == 3)
            CHECK(fabs(u[2] + q * across * at[2]) < 1e-7 * top);
    }
    for (int64_t i = 0; i < x->m; i++) {
        CHECK(fabs(x->r[i] + q * x->mesh.contact_area[i]) < 1e-6 * q * 1.5);
        CHECK_INT(x->mesh.contact_of[i], 0);
        CHECK_INT(x->mesh.contact_face[2 * i], -1);
        sum += x->mesh.contact_area[i];
    }
    CHECK_REL(sum, kind->model == UZ_SOLID ? 4.5 : kind->model == UZ_AXISYMMETRIC ? acos(-1) * 9 : 3, 1e-12);
    CHECK_INT(x->summary.semicoercive.free_modes, 1);
    uz_result_free(x);
    uz_scene_clear(&s);
}

TEST(uniform_pressure_on_an_obstacle)
{
    for (int k = 0; k < N_KINDS; k++)
        check_uniform_pressure(&KINDS[k], NULL, UZ_FORMULATION_AUTO);
}

/* Moves inner nodes; the sides stay flat. */
static void distort(double x[3])
{
    const double pi = acos(-1), bump = sin(pi * x[0] / SIZE[0]) * sin(pi * x[1] / SIZE[1]);
    x[0] += 0.15 * bump;
    x[1] -= 0.1 * bump * (1 + x[2]);
    x[2] += 0.1 * bump * sin(pi * x[2] / SIZE[2]);
}

/* The patch test, with contact: edges are straight, as the Gauss rules of solids and rings ask for. */
TEST(uniform_pressure_on_distorted_meshes)
{
    for (int f = 0; f < UZ_FORMULATIONS; f++)
        for (int k = 0; k < N_KINDS; k++) {
            const bool has_others = strcmp(KINDS[k].element, "quad4") == 0 || strcmp(KINDS[k].element, "hex8") == 0;
            if (f <= UZ_FORMULATION_STANDARD || has_others)
                check_uniform_pressure(&KINDS[k], distort, (uz_formulation)f);
        }
}

/* ------------------------------------------------------------------ models */

/* A slice of one hex8 between planes of symmetry is in plane strain. */
TEST(plane_strain_is_a_held_slice)
{
    const int64_t cells[3] = {8, 4, 1};
    uz_result *x[2];
    for (int k = 0; k < 2; k++) {
        uz_scene s = body_scene(k ? UZ_SOLID : UZ_PLANE_STRAIN, k ? "hex8" : "quad4", (double[3]){6, 2, 0.7}, cells);
        s.thickness = 0.7;
        body_hold(&s, "left", 0, 0, NAN);
        if (k) {
            body_hold(&s, "back", NAN, NAN, 0);
            body_hold(&s, "front", NAN, NAN, 0);
        }
        body_load(&s, UZ_LOAD_TRACTION, "top", 0.3, -5, 0);
        body_load(&s, UZ_LOAD_TRACTION, "right", 20, 0, 0);
        body_plane(&s, "bottom", (double[3]){0, -1e-5, 0}, (double[3]){5e-4, 1, 0});
        x[k] = body_solve(&s, 1e-10);
        uz_scene_clear(&s);
    }
    const int64_t n = x[0]->n_nodes;
    const double most = body_most(x[0]->u, 2 * n);
    CHECK_INT(x[1]->n_nodes, 2 * n);
    CHECK(x[0]->summary.active > 0 && x[0]->summary.active < x[0]->m);
    CHECK_REL(x[1]->summary.force[1], x[0]->summary.force[1], 1e-8);
    for (int64_t a = 0; a < 2 * n; a++)
        for (int c = 0; c < 3; c++)
            CHECK(fabs(x[1]->u[3 * a + c] - (c < 2 ? x[0]->u[2 * (a % n) + c] : 0)) < 1e-8 * most);
    uz_result_free(x[0]);
    uz_result_free(x[1]);
}

/* mm, N, MPa against m, N, Pa: the same digits. */
TEST(units_leave_the_digits)
{
    for (int k = 0; k < N_KINDS; k++) {
        uz_result *x[2];
        for (int si = 0; si < 2; si++) {
            uz_scene s = block_on_floor(&KINDS[k]);
            const double unit = si ? 1e-3 : 1, force = si ? 1e6 : 1;
            for (int c = 0; c < 3; c++)
                s.box.size[c] *= unit;
            s.thickness *= unit;
            s.materials[0].young *= force;
            body_load(&s, UZ_LOAD_TRACTION, "top", 0, -7 * force, 0);
            body_load(&s, UZ_LOAD_TRACTION, "right", 2 * force, 3 * force, 0);
            x[si] = body_solve(&s, 1e-10);
            uz_scene_clear(&s);
        }
        const int64_t n = x[0]->n_nodes * x[0]->summary.dim;
        const double most = body_most(x[0]->u, n);
        CHECK_INT(x[1]->summary.active, x[0]->summary.active);
        for (int64_t i = 0; i < n; i++)
            CHECK(fabs(1e3 * x[1]->u[i] - x[0]->u[i]) < 1e-8 * most);
        uz_result_free(x[0]);
        uz_result_free(x[1]);
    }
}

/* -------------------------------------------------------------- rigid motions */

static void expect_free(const uz_scene *s, const char *where, const char *says)
{
    uz_error err = {0};
    CHECK_INT(uz_scene_check(s, &err), UZ_ERR_FREE_BODY);
    CHECK_STR(err.where, where);
    CHECK_MSG(strstr(err.message, says) != NULL, "\"%s\" lacks \"%s\"", err.message, says);
}

TEST(motions_in_space_are_named)
{
    const body_kind brick = {UZ_SOLID, "hex8"};
    uz_scene s = block_on_floor(&brick);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -1, 0);
    s.n_supports = 0;
    expect_free(
        &s, "/supports",
        "leave translation along x, translation along z, rotation about the axis through (1.5, 1, 0.75) along y");
    body_hold(&s, "left", 0, NAN, NAN);
    expect_free(&s, "/supports", "obstacles leave translation along z free");
    body_hold(&s, "back", NAN, NAN, 0);
    s.loads[0].v[1] = 1;
    expect_free(&s, "/loads",
                "push the body away: translation along +y; no obstacle or support stands in its way. Hold");
    s.loads[0].v[1] = 0;
    expect_free(&s, "/loads", "translation along +y costs nothing");
    s.n_contacts = 0;
    s.n_supports = 0;
    expect_free(&s, "/supports", "translation along x, translation along y, translation along z, rotation");
    uz_scene_clear(&s);
}

/* A brick that only its floor holds upright: a translation and two rotations. Soft springs keep it from sliding. */
TEST(a_brick_stands_on_its_floor)
{
    uz_scene s = body_scene(UZ_SOLID, "hex8", (double[3]){2, 1, 1.5}, (int64_t[3]){2, 1, 2});
    s.materials[0].poisson = 0;
    body_spring(&s, "bottom", 1, 0, 1);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    body_load(&s, UZ_LOAD_FORCE, "top", 0, -6, 0);
    uz_result *x = body_solve(&s, 1e-9);
    CHECK_INT(x->summary.semicoercive.free_modes, 3);
    CHECK_REL(x->summary.force[1], 6.0, 1e-7);
    for (int64_t a = 0; a < x->n_nodes; a++)
        CHECK(fabs(x->u[3 * a + 1] + 2 * x->mesh.xyz[3 * a + 1] / 200e3) < 1e-6 * 2 / 200e3);
    uz_result_free(x);
    /* Pulled up on top and down at its side: the sum of both acts beyond the edge of the floor. */
    s.loads[0].v[1] = 0.4;
    body_load(&s, UZ_LOAD_FORCE, "right", 0, -1, 0);
    expect_free(&s, "/loads", "push the body away: rotation about the axis through (");
    expect_free(&s, "/loads", "along -z");
    uz_scene_clear(&s);
}

TEST(a_ring_can_only_move_along_its_axis)
{
    const body_kind ring = {UZ_AXISYMMETRIC, "quad4"};
    uz_scene s = block_on_floor(&ring);
    s.n_contacts = 0;
    body_load(&s, UZ_LOAD_TRACTION, "right", 5, 0, 0);
    expect_free(&s, "/supports", "leave translation along y free");
    body_hold(&s, "bottom", NAN, 0, NAN);
    uz_result *x = body_solve(&s, 1e-10); /* uniform tension in the plane of r and hoop */
    for (int64_t a = 0; a < x->n_nodes; a++) {
        CHECK(fabs(x->u[2 * a] - 5 * 0.7 / 200e3 * x->mesh.xyz[2 * a]) < 1e-8 * 1e-4);
        CHECK(fabs(x->u[2 * a + 1] + 5 * 0.6 / 200e3 * x->mesh.xyz[2 * a + 1]) < 1e-8 * 1e-4);
    }
    uz_result_free(x);
    uz_scene_clear(&s);
}

/* Nodes on the axis of revolution stay there whatever a support says. */
TEST(the_axis_of_revolution_is_held)
{
    const body_kind ring = {UZ_AXISYMMETRIC, "quad4"};
    uz_scene s = block_on_floor(&ring);
    uz_error err = {0};
    body_hold(&s, "left", 0, NAN, NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -1, 0);
    CHECK_INT(uz_scene_check(&s, &err), UZ_OK);
    s.supports[0].u[0] = 0.1;
    CHECK_INT(uz_scene_check(&s, &err), UZ_ERR_SCENE);
    CHECK_MSG(strstr(err.message, "on the axis of rotation"), "%s", err.message);
    uz_scene_clear(&s);
}

/* ------------------------------------------------------------ mesh error, forces */

/* Linear fields have no mesh error, whatever the element; a bent beam has one that gets less, if slowly, as its held
 * edges are singular. */
TEST(mesh_error_of_every_element)
{
    static const int64_t coarse[3] = {6, 2, 1}, fine[3] = {12, 4, 2};
    for (int k = 0; k < N_KINDS; k++) {
        double estimate[2];
        for (int f = 0; f < 2; f++) {
            uz_scene s = body_scene(KINDS[k].model, KINDS[k].element, (double[3]){6, 2, 1}, f ? fine : coarse);
            body_hold(&s, "bottom", 0, 0, 0);
            body_load(&s, UZ_LOAD_TRACTION, "top", 1, -1, 0);
            uz_body_model model = body_model(&s);
            uz_result *x = body_solve(&s, 1e-10);
            double *linear = body_room(x->n_nodes * model.mesh.dim, sizeof *linear);
            for (int64_t a = 0; a < x->n_nodes; a++)
                for (int c = 0; c < model.mesh.dim; c++)
                    linear[a * model.mesh.dim + c] = 1e-3 * (c + 1) * x->mesh.xyz[a * model.mesh.dim + c];
            if (KINDS[k].model == UZ_AXISYMMETRIC) /* hoop and radial strain equal: the stress is uniform */
                CHECK(uz_estimate_mesh_error(NULL, NULL, &model, NULL, linear) < 1e-12);
            CHECK(uz_estimate_mesh_error(NULL, NULL, &model, NULL, linear) < 1e-12);
            estimate[f] = uz_estimate_mesh_error(NULL, NULL, &model, NULL, x->u);
            free(linear);
            uz_result_free(x);
            uz_body_model_clear(&model);
            uz_scene_clear(&s);
        }
        CHECK_MSG(estimate[0] > 0.01 && estimate[1] < 0.87 * estimate[0], "%s: %g, then %g", KINDS[k].element,
                  estimate[0], estimate[1]);
    }
}

/* Internal forces less loads act on supported dofs and contact nodes only, and balance the loads. */
TEST(internal_forces_balance)
{
    for (int k = 0; k < N_KINDS; k++) {
        uz_scene s = block_on_floor(&KINDS[k]);
        body_load(&s, UZ_LOAD_TRACTION, "top", 0, -7, 0);
        body_load(&s, UZ_LOAD_TRACTION, "right", 2, 3, 0);
        uz_body_model model = body_model(&s);
        uz_result *x = body_solve(&s, 1e-11);
        const int dim = model.mesh.dim;
        double *inner = body_room(x->n_nodes * dim, sizeof *inner), *outer = body_room(x->n_nodes * dim, sizeof *outer);
        CHECK(internal_forces(inner, &model, x->u));
        CHECK(uz_nodal_loads(outer, &model, &s, NULL) == UZ_OK);
        double *force = body_room(x->m, sizeof *force);
        uz_row_forces(force, &model, x->r);
        for (int64_t i = 0; i < x->m; i++)
            for (int c = 0; c < dim; c++)
                outer[x->mesh.contact_node[i] * dim + c] -= force[i] * x->mesh.contact_normal[i * dim + c];
        free(force);
        const double most = body_most(outer, x->n_nodes * dim);
        for (int64_t i = 0; i < x->n_nodes * dim; i++)
            if (model.dof[i] >= 0)
                CHECK_MSG(fabs(inner[i] - outer[i]) < 1e-7 * most, "%s", KINDS[k].element);
        free(inner);
        free(outer);
        uz_result_free(x);
        uz_body_model_clear(&model);
        uz_scene_clear(&s);
    }
}
