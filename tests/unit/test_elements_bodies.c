/* Known bodies: Cook's membrane, a nearly incompressible tube, beams of one layer. */
#include "element_mesh.h"
#include "harness.h"

/* A body on a mesh of the unit square or cube, before and after it takes its shape. */
typedef struct {
    small_mesh mesh;
    int n;
    double *u, *f;
    bool *fixed, *loaded; /* per dof; per node */
    double value;         /* of the load */
} body;

static body body_of(uz_element element, int nx, int ny, int nz)
{
    body b = {.mesh = small_grid(element, nx, ny, nz)};
    b.n = b.mesh.n_nodes * b.mesh.dim;
    b.u = zeros((size_t)b.n, sizeof *b.u);
    b.f = zeros((size_t)b.n, sizeof *b.f);
    b.fixed = zeros((size_t)b.n, sizeof *b.fixed);
    b.loaded = zeros((size_t)b.n, sizeof *b.loaded);
    return b;
}

static void body_free(body *b)
{
    small_mesh_free(&b->mesh);
    free(b->u);
    free(b->f);
    free(b->fixed);
    free(b->loaded);
}

/* Holds component c where coordinate `axis` of the unit square or cube is `at`. */
static void hold(body *b, int axis, double at, int c)
{
    for (int a = 0; a < b->mesh.n_nodes; a++)
        if (b->mesh.xyz[a * b->mesh.dim + axis] == at)
            b->fixed[a * b->mesh.dim + c] = true;
}

static void mark(body *b, int axis, double at)
{
    for (int a = 0; a < b->mesh.n_nodes; a++)
        b->loaded[a] = b->mesh.xyz[a * b->mesh.dim + axis] == at;
}

static int node_at(const body *b, double x, double y, double z)
{
    const double at[3] = {x, y, z};
    for (int a = 0; a < b->mesh.n_nodes; a++) {
        double far = 0;
        for (int c = 0; c < b->mesh.dim; c++)
            far = fmax(far, fabs(b->mesh.xyz[a * b->mesh.dim + c] - at[c]));
        if (far < 1e-9)
            return a;
    }
    CHECK_MSG(false, "no node at %g, %g, %g", x, y, z);
    return 0;
}

static void scatter(body *b, const uz_side *side, const int *node, const double *f)
{
    for (int k = 0; k < side->nodes * side->dim; k++)
        b->f[node[k / side->dim] * side->dim + k % side->dim] += f[k];
}

static void press(void *ctx, const uz_side *side, const int *node)
{
    body *b = ctx;
    double f[18] = {0}, pressure[6];
    for (int a = 0; a < side->nodes; a++)
        pressure[a] = b->value;
    uz_side_add_pressure(f, side, pressure);
    scatter(b, side, node, f);
}

/* `value` force per area along y. */
static void lift(void *ctx, const uz_side *side, const int *node)
{
    body *b = ctx;
    double f[18] = {0};
    uz_side_add_traction(f, side, (const double[3]){0, b->value, 0});
    scatter(b, side, node, f);
}

/* Force per area along x, `value` times the distance from the height 1/2. */
static void bend(void *ctx, const uz_side *side, const int *node)
{
    body *b = ctx;
    double f[18] = {0}, t[18] = {0};
    for (int a = 0; a < side->nodes; a++)
        t[a * side->dim] = b->value * (side->xyz[a * side->dim + 1] - 0.5);
    uz_side_add_nodal_traction(f, side, t);
    scatter(b, side, node, f);
}

/* ------------------------------------------------------------ Cook's membrane
 * A clamped tapered panel, 48 long, sheared by a force of 1 at its free side; E = 1, nu = 1/3, plane stress, thickness
 * 1. The deflection of the middle of that side is 23.96 (Cook, Malkus, Plesha, Witt, "Concepts and Applications of
 * Finite Element Analysis", section on membrane elements). */
static double cook(uz_element_kind kind, uz_formulation way, uz_model model, double poisson, int cells)
{
    const uz_element element = {kind, model, way, uz_lame_of(model, 1, poisson), 1, NULL};
    body b = body_of(element, cells, cells, 1);
    hold(&b, 0, 0, 0);
    hold(&b, 0, 0, 1);
    mark(&b, 0, 1);
    for (int a = 0; a < b.mesh.n_nodes; a++) {
        double *x = b.mesh.xyz + 2 * a, s = x[0], t = x[1];
        x[0] = 48 * s;
        x[1] = 44 * s + t * (44 - 28 * s);
    }
    b.value = 1.0 / 16;
    each_side(&b.mesh, b.loaded, &b, lift);
    solve_small(b.u, &b.mesh, b.f, b.fixed);
    const double deflection = b.u[2 * node_at(&b, 48, 52, 0) + 1];
    body_free(&b);
    return deflection;
}

TEST(cooks_membrane)
{
    const uz_formulation s = UZ_FORMULATION_STANDARD;
    CHECK_REL(cook(UZ_QUAD4, s, UZ_PLANE_STRESS, 1. / 3, 64), 23.96, 2e-3);
    CHECK_REL(cook(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, UZ_PLANE_STRESS, 1. / 3, 32), 23.96, 2e-3);
    CHECK_REL(cook(UZ_QUAD8, s, UZ_PLANE_STRESS, 1. / 3, 16), 23.96, 2e-3);
    CHECK_REL(cook(UZ_TRI6, s, UZ_PLANE_STRESS, 1. / 3, 16), 23.96, 2e-3);
    CHECK_REL(cook(UZ_TRI3, s, UZ_PLANE_STRESS, 1. / 3, 64), 23.96, 1e-2);
    /* On a coarse mesh incompatible modes do what they are for. */
    CHECK(cook(UZ_QUAD4, s, UZ_PLANE_STRESS, 1. / 3, 4) < 0.80 * 23.96);
    CHECK(cook(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, UZ_PLANE_STRESS, 1. / 3, 4) > 0.95 * 23.96);
}

/* ------------------------------------------ a nearly incompressible tube
 * Inner radius 3, outer 9, pressure 1 inside, held along its length; E = 1000, nu = 0.4999. The inner wall moves by
 * (1 + nu) p a / (E (b^2 - a^2)) ((1 - 2 nu) a^2 + b^2) (Lame; MacNeal and Harder, Finite Elements in Analysis and
 * Design 1 (1985), the thick-walled cylinder). A quarter in plane strain or in space, or a ring. */
static double tube(uz_element_kind kind, uz_model model, uz_formulation way, double poisson)
{
    const uz_element element = {kind, model, way, uz_lame_of(model, 1000, poisson), 1, NULL};
    const bool ring = model == UZ_AXISYMMETRIC;
    body b = body_of(element, 10, ring ? 2 : 8, 1);
    hold(&b, 1, 0, 1);
    hold(&b, 1, 1, ring ? 1 : 0);
    if (b.mesh.dim == 3) {
        hold(&b, 2, 0, 2);
        hold(&b, 2, 1, 2);
    }
    mark(&b, 0, 0);
    for (int a = 0; a < b.mesh.n_nodes; a++) {
        double *x = b.mesh.xyz + b.mesh.dim * a, r = 3 + 6 * x[0], angle = asin(1) * x[1];
        x[0] = ring || x[1] == 0 ? r : x[1] == 1 ? 0 : r * cos(angle);
        x[1] = ring ? x[1] : r * sin(angle);
    }
    b.value = 1;
    each_side(&b.mesh, b.loaded, &b, press);
    solve_small(b.u, &b.mesh, b.f, b.fixed);
    const double wall = b.u[b.mesh.dim * node_at(&b, 3, 0, 0)];
    const double exact = (1 + poisson) * 3 / (1000 * (81 - 9)) * ((1 - 2 * poisson) * 9 + 81);
    body_free(&b);
    return wall / exact;
}

TEST(rubber_tube_does_not_lock_with_mean_dilatation)
{
    CHECK_REL(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_QUAD4, UZ_AXISYMMETRIC, UZ_FORMULATION_BBAR, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_INCOMPATIBLE, 0.4999), 1.0, 1e-2);
    CHECK_REL(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_INCOMPATIBLE, 0.4999), 1.0, 1e-2);
    CHECK(tube(UZ_QUAD4, UZ_PLANE_STRAIN, UZ_FORMULATION_STANDARD, 0.4999) < 0.5);
    CHECK(tube(UZ_HEX8, UZ_SOLID, UZ_FORMULATION_STANDARD, 0.4999) < 0.5);
}

/* Curved sides and faces, pressed: the body is the tube itself but for the third order. */
TEST(quadratic_elements_follow_the_tube)
{
    const uz_formulation s = UZ_FORMULATION_STANDARD;
    CHECK_REL(tube(UZ_QUAD8, UZ_PLANE_STRAIN, s, 0.3), 1.0, 1e-4);
    CHECK_REL(tube(UZ_TRI6, UZ_PLANE_STRAIN, s, 0.3), 1.0, 1e-3);
    CHECK_REL(tube(UZ_TET10, UZ_SOLID, s, 0.3), 1.0, 2e-3);
    CHECK_REL(tube(UZ_QUAD8, UZ_AXISYMMETRIC, s, 0.3), 1.0, 1e-4);
    CHECK_REL(tube(UZ_TRI6, UZ_AXISYMMETRIC, s, 0.3), 1.0, 1e-3);
    CHECK_REL(tube(UZ_TRI3, UZ_AXISYMMETRIC, s, 0.3), 1.0, 2e-2);
}

/* ------------------------------------------------- beams of one layer
 * 12 x 1 (x 1), E = 1e4, nu = 0.3. Bent by end moments: curvature M / (E I), exact for incompatible modes on
 * rectangles. By a force at the end: F L^3 / (3 E I) + F L / (5/6 G A) (Timoshenko). */
enum { LENGTH = 12 };

static double beam(uz_element_kind kind, uz_formulation way, bool by_moment)
{
    const uz_model model = uz_element_dim(kind) == 3 ? UZ_SOLID : UZ_PLANE_STRESS;
    const uz_element element = {kind, model, way, uz_lame_of(model, 1e4, 0.3), 1, NULL};
    body b = body_of(element, LENGTH, 1, 1);
    const int dim = b.mesh.dim;
    hold(&b, 0, 0, 0);
    mark(&b, 0, 1);
    b.fixed[node_at(&b, 0, 0, 0) * dim + 1] = true;
    if (dim == 3) {
        b.fixed[node_at(&b, 0, 0, 0) * dim + 2] = true;
        b.fixed[node_at(&b, 0, 0, 1) * dim + 1] = true;
    }
    stretch(&b.mesh, (const double[3]){0, 0, 0}, (const double[3]){LENGTH, 1, 1});
    b.value = by_moment ? 12 : 1; /* stress 12 y: M = 1, E I = 1e4 / 12 */
    each_side(&b.mesh, b.loaded, &b, by_moment ? bend : lift);
    solve_small(b.u, &b.mesh, b.f, b.fixed);
    const double deflection = b.u[node_at(&b, LENGTH, 0, 0) * dim + 1];
    body_free(&b);
    const double bending = 1e4 / 12, shear = 5. / 6 * 1e4 / 2.6;
    return deflection /
           (by_moment ? -LENGTH * LENGTH / (2 * bending) : pow(LENGTH, 3) / (3 * bending) + LENGTH / shear);
}

TEST(one_layer_bends_with_incompatible_modes)
{
    CHECK_REL(beam(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_HEX8, UZ_FORMULATION_INCOMPATIBLE, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_QUAD4, UZ_FORMULATION_INCOMPATIBLE, false), 1.0, 1e-2);
    CHECK_REL(beam(UZ_HEX8, UZ_FORMULATION_INCOMPATIBLE, false), 1.0, 1e-2);
    CHECK_REL(beam(UZ_QUAD8, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_TRI6, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK_REL(beam(UZ_TET10, UZ_FORMULATION_STANDARD, true), 1.0, 1e-10);
    CHECK(beam(UZ_QUAD4, UZ_FORMULATION_STANDARD, true) < 0.8);
    CHECK(beam(UZ_HEX8, UZ_FORMULATION_STANDARD, true) < 0.8);
}
