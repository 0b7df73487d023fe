/* element_bodies.h: bodies of small meshes whose answer is known: Cook's membrane, a thick tube; and how they are held
 * and loaded. */
#ifndef TESTS_ELEMENT_BODIES_H
#define TESTS_ELEMENT_BODIES_H

#include "core/alloc.h"
#include "element_mesh.h"

/* A body on a mesh of the unit square or cube, before and after it takes its shape. */
typedef struct {
    small_mesh mesh;
    int n;
    double *u, *f;
    bool *fixed, *loaded; /* per dof; per node */
    double value;         /* of the load */
} small_body;

static inline small_body body_of(uz_element element, int nx, int ny, int nz)
{
    small_body b = {.mesh = small_grid(element, nx, ny, nz)};
    b.n = b.mesh.n_nodes * b.mesh.dim;
    b.u = zeros((size_t)b.n, sizeof *b.u);
    b.f = zeros((size_t)b.n, sizeof *b.f);
    b.fixed = zeros((size_t)b.n, sizeof *b.fixed);
    b.loaded = zeros((size_t)b.n, sizeof *b.loaded);
    return b;
}

static inline void body_free(small_body *b)
{
    small_mesh_free(&b->mesh);
    uz_free_all(b->u, b->f, b->fixed, b->loaded);
}

/* Holds component c where coordinate `axis` of the unit square or cube is `at`. */
static inline void hold(small_body *b, int axis, double at, int c)
{
    for (int a = 0; a < b->mesh.n_nodes; a++)
        if (b->mesh.xyz[a * b->mesh.dim + axis] == at)
            b->fixed[a * b->mesh.dim + c] = true;
}

static inline void mark(small_body *b, int axis, double at)
{
    for (int a = 0; a < b->mesh.n_nodes; a++)
        b->loaded[a] = b->mesh.xyz[a * b->mesh.dim + axis] == at;
}

static inline int node_at(const small_body *b, double x, double y, double z)
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

static inline void scatter(small_body *b, const uz_side *side, const int *node, const double *f)
{
    for (int k = 0; k < side->nodes * side->dim; k++)
        b->f[node[k / side->dim] * side->dim + k % side->dim] += f[k];
}

static inline void press(void *ctx, const uz_side *side, const int *node)
{
    small_body *b = ctx;
    double f[3 * UZ_SIDE_NODES] = {0}, pressure[UZ_SIDE_NODES];
    for (int a = 0; a < side->nodes; a++)
        pressure[a] = b->value;
    uz_side_add_pressure(f, side, pressure);
    scatter(b, side, node, f);
}

/* `value` force per area along y. */
static inline void lift(void *ctx, const uz_side *side, const int *node)
{
    small_body *b = ctx;
    double f[3 * UZ_SIDE_NODES] = {0};
    uz_side_add_traction(f, side, (const double[3]){0, b->value, 0});
    scatter(b, side, node, f);
}

/* Force per area along x, `value` times the distance from the height 1/2. */
static inline void bend(void *ctx, const uz_side *side, const int *node)
{
    small_body *b = ctx;
    double f[3 * UZ_SIDE_NODES] = {0}, M[UZ_SIDE_NODES * UZ_SIDE_NODES];
    side_mass(M, side);
    for (int a = 0; a < side->nodes; a++)
        for (int k = 0; k < side->nodes; k++)
            f[a * side->dim] += M[side->nodes * a + k] * b->value * (side->xyz[k * side->dim + 1] - 0.5);
    scatter(b, side, node, f);
}

/* ------------------------------------------------------------ Cook's membrane
 * A clamped tapered panel, 48 long, sheared by a force of 1 at its free side; E = 1, nu = 1/3, plane stress, thickness
 * 1. The deflection of the middle of that side is 23.96 (Cook, Malkus, Plesha, Witt, "Concepts and Applications of
 * Finite Element Analysis", section on membrane elements). */
static inline double cook(uz_element_kind kind, uz_formulation way, uz_model model, double poisson, int cells)
{
    const uz_element element = {kind, model, way, uz_lame_of(model, 1, poisson), .thickness = 1, .xyz = NULL};
    small_body b = body_of(element, cells, cells, 1);
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

/* ------------------------------------------ a nearly incompressible tube
 * Inner radius 3, outer 9, pressure 1 inside, held along its length; E = 1000, nu = 0.4999. The inner wall moves by
 * (1 + nu) p a / (E (b^2 - a^2)) ((1 - 2 nu) a^2 + b^2) (Lame; MacNeal and Harder, Finite Elements in Analysis and
 * Design 1 (1985), the thick-walled cylinder). A quarter in plane strain or in space, or a ring. */
static inline double tube(uz_element_kind kind, uz_model model, uz_formulation way, double poisson)
{
    const uz_element element = {kind, model, way, uz_lame_of(model, 1000, poisson), .thickness = 1, .xyz = NULL};
    const bool ring = model == UZ_AXISYMMETRIC;
    small_body b = body_of(element, 10, ring ? 2 : 8, 1);
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

#endif
