/* finite.c: the certificate of a nonlinear answer: equilibrium, stability, gaps, signs, orientation. */
#include "certificate/finite.h"

#include "assembly/parts.h"
#include "assembly/row_turn.h"
#include "certificate/envelope.h"
#include "certificate/mean_piola.h"
#include "certificate/pair_gaps.h"
#include "certificate/piola.h"
#include "certificate/point_force.h"
#include "certificate/pressed_side.h"
#include "certificate/rigid_groups.h"
#include "certificate/swallowed.h"
#include "core/alloc.h"
#include "core/cpu.h"
#include "core/error.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "obstacle/obstacle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Points of each side, between its ends, at which gaps are looked at. */
enum { SAMPLES = 7 }; /* in space along both of its directions */
/* Looks around the closest of them, each as far or half as far as the one before. */
enum { CLOSER = 10 };

/* Steps to the stretch across a plane. */
enum { MOST_HALVINGS = 200 };

/* The caller is asked whether to go on after so many elements. */
enum { ELEMENTS_BETWEEN = 64 };

/* A row is pressed where its reaction is more than this part of the largest, and more than what rounding makes: that
 * part of what the stiffest dof takes to go as far as the body is large. */
#define PRESSED  1e-12
#define NO_FORCE 1e-15
/* Pivots that are less than this part of the stiffness of their dof may be zero. */
#define LEAST_PIVOT 1e-11
/* Stiffness along pressed rows, in those of the stiffest dof: only where motions that leave the rows closed are stable
 * is H positive definite, however large it is, and where they are it is from some size on. */
static const double ALONG[] = {1e2, 1e5};
/* A strain that is rounding: F is about 1, and known to its last digits. */
#define ROUNDING 2e-14
#define TINY     1e-7
/* The same of one element alone, where solves leave more of the way than elsewhere. */
#define OF_ELEMENT 1e-12

typedef struct {
    const uz_finite_answer *of;
    const uz_stop *stop;
    uz_body_model tangent;           /* borrows all but K's and K_fixed's values */
    uz_csc wide;                     /* K with entries of rows between bodies, where there are any: it is tangent's */
    long double *force;              /* n_nodes x dim: internal */
    double *f, *room, *size;         /* d */
    double pressed;                  /* rows are, whose reaction is more */
    long double energy, small, unit; /* small: of small strain; unit: of a strain of 1 */
} work;

/* ---- elements */

/* A point of an element: around is N / r of rings, else 0. */
typedef struct {
    double grad[UZ_ELEMENT_NODES][3], around[UZ_ELEMENT_NODES];
    long double F[9]; /* by rows; in the plane the last is the stretch across it */
    int nodes, dim;
    bool ring;
} point_at;

/* What is added for four nodes at a time. */
typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
enum { LANES = 4 };

/* Forces in extended precision; of the tangent, whose entries are doubles, the half up to the diagonal, as
 * rows[p][k][b]: of dof p, axis k and node b, with others beyond it. Inlined where dim is a constant. */
UZ_INLINE void add_point_of(long double *force, double *rows, long double weight, const point_at *x, const uz_piola *at,
                            int dim, bool ring)
{
    static const int PLANE[] = {0, 1, 3, 4, 8}, SPACE[] = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    const int *entry = dim == 2 ? PLANE : SPACE, count = dim * dim + ring, nodes = x->nodes; /* those of F */
    double A[9][9], grad[4][UZ_ELEMENT_NODES] = {{0}};
    long double P[9] = {0};
    for (int i = 0; i < count; i++) {
        P[i] = weight * at->P[entry[i]];
        for (int k = 0; k < count; k++)
            A[i][k] = (double)weight * at->A[entry[i]][entry[k]];
    }
    for (int a = 0; a < nodes; a++)
        for (int J = 0; J <= dim; J++)
            grad[J][a] = J < dim ? x->grad[a][J] : x->around[a];
    for (int p = 0; p < dim * nodes; p++) {
        const int a = p / dim, i = p % dim, reach = dim + (ring && i == 0); /* moves what is around the axis, too */
        long double pulled = force[p];
        double by[9] = {0};
        for (int J = 0; J < reach; J++) {
            const int own = J < dim ? dim * i + J : count - 1;
            pulled += P[own] * grad[J][a];
            for (int k = 0; k < count; k++)
                by[k] += A[own][k] * grad[J][a];
        }
        force[p] = pulled;
        for (int k = 0; k < dim; k++) {
            double *row = rows + (p * dim + k) * UZ_ELEMENT_NODES;
            const double around = ring && k == 0 ? by[count - 1] : 0;
            for (int b = 0; b <= a; b += LANES) {
                four sum = {0};
                if (ring)
                    sum = around * *(const four *)(grad[dim] + b);
                for (int L = 0; L < dim; L++)
                    sum += by[dim * k + L] * *(const four *)(grad[L] + b);
                *(four *)(row + b) += sum;
            }
        }
    }
}

UZ_INLINE void add_point(long double *force, double *rows, long double weight, const point_at *x, const uz_piola *at)
{
    if (x->dim == 3)
        add_point_of(force, rows, weight, x, at, 3, false);
    else if (x->ring)
        add_point_of(force, rows, weight, x, at, 2, true);
    else
        add_point_of(force, rows, weight, x, at, 2, false);
}

UZ_AVX2 static void add_point_wide(long double *force, double *rows, long double weight, const point_at *x,
                                   const uz_piola *at)
{
    add_point(force, rows, weight, x, at);
}

static void add_point_plain(long double *force, double *rows, long double weight, const point_at *x, const uz_piola *at)
{
    add_point(force, rows, weight, x, at);
}

/* Returns what must be positive: det F, which in the plane is not where the stretch across it is not. */
static long double deform(point_at *x, double *measure, const uz_element *element, const double *u,
                          const double local[3])
{
    const uz_element_type *type = uz_element_type_of(element->kind);
    const int dim = x->dim = type->dim;
    long double *F = x->F;
    x->nodes = type->nodes;
    x->ring = element->model == UZ_AXISYMMETRIC;
    *measure = uz_element_gradients(x->grad, element, local);
    *measure *= uz_element_around(x->around, element, x->grad, local);
    memset(F, 0, sizeof x->F);
    F[8] = 1 + element->across;
    for (int i = 0; i < dim; i++) {
        long double along = i == 0, across = i == 1, out = i == 2 ? F[8] : 0;
        for (int a = 0; a < x->nodes; a++) {
            const long double way = (long double)u[dim * a + i] - u[i];
            along += way * x->grad[a][0];
            across += way * x->grad[a][1];
            if (dim == 3)
                out += way * x->grad[a][2];
        }
        F[3 * i] = along;
        F[3 * i + 1] = across;
        F[3 * i + 2] = dim == 3 ? out : F[3 * i + 2];
    }
    for (int a = 0; a < x->nodes && x->ring; a++)
        F[8] += (long double)u[2 * a] * x->around[a];
    const long double plane = F[0] * F[4] - F[1] * F[3];
    if (dim == 2)
        return F[8] > 0 ? plane * F[8] : -fabsl(plane * F[8]);
    return plane * F[8] + F[2] * (F[3] * F[7] - F[4] * F[6]) - F[5] * (F[0] * F[7] - F[1] * F[6]);
}

/* In plane stress F has the stretch across the plane at which there is no stress across it: S = P / F there grows with
 * F, and its root is between two that are divided in halves where Newton's step leaves them; A is then condensed, with
 * no such stress. False: there is no root. */
static bool thin(uz_piola *at, long double F[9], uz_elasticity law, const uz_lame *lame)
{
    long double low = 1e-4L, high = 1e4L;
    F[8] = 1;
    for (int k = 0; k < MOST_HALVINGS; k++) {
        uz_piola_at(at, law, lame->lambda, lame->mu, F, true);
        const long double S = at->P[8] / F[8], slope = (at->A[8][8] - S) / F[8];
        *(S > 0 ? &high : &low) = F[8];
        const long double newton = F[8] - S / slope;
        const long double next = slope > 0 && newton > low && newton < high ? newton : sqrtl(low * high);
        const bool settled = fabsl(next - F[8]) < 1e-18L * F[8] || high - low < 1e-18L * high;
        F[8] = next;
        if (settled)
            break;
    }
    uz_piola_at(at, law, lame->lambda, lame->mu, F, true);
    if (!(F[8] > 1.01e-4L && F[8] < 0.99e4L && at->A[8][8] > 0))
        return false;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 8; k++)
            at->A[i][k] -= at->A[i][8] * at->A[8][k] / at->A[8][8];
    for (int i = 0; i < 9; i++)
        at->A[i][8] = at->A[8][i] = 0;
    at->P[8] = 0;
    return true;
}

/* The law at a point, which may change what F is across the plane, and with it *det. */
static bool law_at(uz_piola *at, long double *det, point_at *x, const uz_element *element, const uz_lame *lame,
                   uz_elasticity law)
{
    if (element->model != UZ_PLANE_STRESS) {
        uz_piola_at(at, law, lame->lambda, lame->mu, x->F, x->dim == 2);
        return true;
    }
    const bool found = thin(at, x->F, law, lame);
    *det = found ? *det * x->F[8] : -INFINITY;
    return found;
}

/* What the energy is compared with: that of a strain of 1, where displacements and F are as large as they are; and the
 * energy of small strain, rotations apart, as that of the law is lost in its own terms where strains are tiny. */
static void add_unit(work *w, long double weight, const uz_lame *lame, const point_at *x, const double *u)
{
    const int dim = x->dim;
    const double zero[3] = {0};
    double H[9], size = 0, trace = 0, squares = 0, turn = 0;
    for (int i = 0; i < 9; i++) {
        H[i] = (double)(x->F[i] - (i % 4 == 0));
        size += i < 8 || dim == 3 || x->ring ? (double)(x->F[i] * x->F[i]) : 0;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const double E =
                (H[3 * i + j] + H[3 * j + i] + H[i] * H[j] + H[3 + i] * H[3 + j] + H[6 + i] * H[6 + j]) / 2;
            trace += i == j ? E : 0;
            squares += E * E;
        }
    for (int a = 0; a < x->nodes; a++)
        turn = fmax(turn, uz_distance2(u + dim * a, zero, dim) * uz_distance2(x->grad[a], zero, dim));
    w->unit += weight * (lame->lambda + 2 * lame->mu) * (size / 2 + turn);
    w->small += weight * (lame->lambda * trace * trace / 2 + lame->mu * squares);
}

/* The law's F is what is left of F beside the free expansion, which is that of the body at rest that has expanded
 * freely: where its nodes would be, and as much less of u. Radii grow from the axis on. */
static void expand(uz_element *element, double *xyz, double *u, int n, int dim, double free_strain)
{
    for (int i = n; i-- > 0;) {
        const bool radius = element->model == UZ_AXISYMMETRIC && i % dim == 0;
        const double by = free_strain * (radius ? xyz[i] : xyz[i] - xyz[i % dim]);
        u[i] -= by;
        xyz[i] += by;
    }
    element->thickness += free_strain * element->thickness;
    if (element->model == UZ_PLANE_STRAIN)
        element->across = 1 / (1 + free_strain) - 1;
}

/* det F at a point, where the law has a stretch across a plane. */
static double det_at(const uz_element *element, const double *u, const uz_lame *lame, uz_elasticity law,
                     const double point[3])
{
    point_at x;
    uz_piola at = {0};
    double measure;
    long double det = deform(&x, &measure, element, u, point);
    if (det > 0 && element->model == UZ_PLANE_STRESS)
        (void)law_at(&at, &det, &x, element, lame, law);
    return (double)det;
}

/* The least det F on the edge between two corners, where it is first and last: of points between them, and from the
 * least of these on where they differ much. Both ends may be upright where it is not, as edges of quadratic elements
 * bend. */
static double least_on_edge(const uz_element *element, const double *u, const uz_lame *lame, uz_elasticity law,
                            const double from[3], const double to[3], double first, double last)
{
    enum { PARTS = 4, HALVINGS = 6 };
    double least = INFINITY, most = -INFINITY, at = 0, way = 1.0 / PARTS;
    for (int k = 0; k <= PARTS + 2 * HALVINGS; k++) {
        const int closer = k - PARTS - 1;
        if (closer >= 0 && (least > 0.5 * most || least <= 0))
            break;
        way = closer >= 0 && closer % 2 == 0 ? way / 2 : way;
        const double part = closer < 0 ? k * way : fmin(1, fmax(0, at + (closer % 2 == 0 ? way : -way)));
        double point[3] = {0};
        for (int c = 0; c < uz_element_type_of(element->kind)->dim; c++)
            point[c] = from[c] + part * (to[c] - from[c]);
        const double det = k == 0 ? first : k == PARTS ? last : det_at(element, u, lame, law, point);
        at = det < least ? part : at;
        least = fmin(least, det);
        most = fmax(most, det);
    }
    return least;
}

/* The least det F on the edges; at their ends alone where it changes evenly along each. */
static double least_on_edges(const uz_element *element, const double *u, const uz_lame *lame, uz_elasticity law)
{
    const uz_element_type *type = uz_element_type_of(element->kind), *linear = uz_element_type_of(type->linear);
    const bool even = type->nodes == type->corners && (type->dim == 2 || type->jacobian == UZ_JACOBIAN_CONSTANT);
    double least = INFINITY, det[UZ_ELEMENT_NODES];
    for (int a = 0; a < type->corners; a++) {
        det[a] = det_at(element, u, lame, law, type->local[a]);
        least = fmin(least, det[a]);
    }
    for (int a = 0; a < type->corners && !even; a++)
        for (int k = 0; k < type->dim; k++) {
            const int b = linear->next[a][k];
            if (b > a)
                least =
                    fmin(least, least_on_edge(element, u, lame, law, type->local[a], type->local[b], det[a], det[b]));
        }
    return least;
}

/* Of an element of mean dilatation, none of whose points is inverted: the mean of det F, that of dW / dtheta, and its
 * derivative; and by nodes the derivatives of theta by the volume, and of pressure by the volume at the same theta. */
typedef struct {
    long double volume, theta, pressure, slope, along[UZ_ELEMENT_DOFS], cross[UZ_ELEMENT_DOFS];
} mean_of;

/* out (dim nodes) += what P does there. */
static void pull_along(long double *out, long double weight, const point_at *x, const long double P[9])
{
    for (int p = 0; p < x->dim * x->nodes; p++) {
        const int a = p / x->dim, i = p % x->dim;
        for (int J = 0; J < x->dim; J++)
            out[p] += weight * P[3 * i + J] * x->grad[a][J];
        if (x->ring && i == 0)
            out[p] += weight * P[8] * x->around[a];
    }
}

/* False: a point is inverted. */
static bool find_mean(mean_of *mean, const uz_element *element, const double *u, const uz_lame *lame, uz_elasticity law)
{
    const uz_gauss_rule *rule = uz_element_rule(element->kind, element->model);
    *mean = (mean_of){.volume = 0};
    for (int pass = 0; pass < 2; pass++) {
        for (int g = 0; g < rule->count; g++) {
            point_at x;
            uz_mean_piola at;
            long double cross[9];
            double measure;
            const long double det = deform(&x, &measure, element, u, rule->point[g].at);
            const long double weight = (long double)rule->point[g].weight * measure;
            if (!(det > 0))
                return false;
            if (pass == 0) {
                mean->volume += weight;
                mean->theta += weight * det;
                continue;
            }
            uz_mean_piola_at(&at, law, lame->lambda, lame->mu, x.F, det, mean->theta, x.dim == 3, x.ring);
            mean->pressure += weight * at.pressure / mean->volume;
            mean->slope += weight * at.slope;
            for (int i = 0; i < 9; i++)
                cross[i] = at.cross[i];
            pull_along(mean->along, weight / mean->volume, &x, at.along);
            pull_along(mean->cross, weight, &x, cross);
        }
        mean->theta /= pass == 0 ? mean->volume : 1;
    }
    return true;
}

/* Energy, forces and tangent of a point whose dilatation is the mean. */
static void add_mean_point(work *w, long double *force, double *rows, long double weight, const point_at *x,
                           const mean_of *mean, long double det, const uz_lame *lame, uz_elasticity law,
                           const double *u)
{
    uz_mean_piola own;
    point_at with = *x;
    uz_mean_piola_at(&own, law, lame->lambda, lame->mu, x->F, det, mean->theta, x->dim == 3, x->ring);
    uz_mean_piola_press(&own, mean->pressure, det, x->dim == 3, x->ring);
    memcpy(with.F, own.F, sizeof with.F);
    w->energy += weight * own.at.W;
    add_unit(w, weight, lame, &with, u);
    (UZ_CPU_HAS("avx2") ? add_point_wide : add_point_plain)(force, rows, weight, x, &own.at);
}

/* What theta, which all nodes change, adds to the second derivative. */
static double of_mean(const mean_of *mean, int i, int k)
{
    return (double)(mean->along[i] * mean->cross[k] + mean->cross[i] * mean->along[k] +
                    mean->slope * mean->along[i] * mean->along[k]);
}

static void add_element(uz_finite_certificate *out, work *w, int64_t e)
{
    const uz_body_model *model = w->of->model;
    const int dim = model->mesh.dim;
    double xyz[3 * UZ_ELEMENT_NODES], u[UZ_ELEMENT_DOFS], measure;
    double rows[UZ_ELEMENT_DOFS * 3 * UZ_ELEMENT_NODES], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS];
    long double force[UZ_ELEMENT_DOFS] = {0};
    uz_element element;
    point_at x;
    uz_piola at = {0};
    int nodes;
    const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
    uz_body_element(&element, xyz, model, e);
    const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
    const uz_lame lame = uz_lame_in_space(element.model, element.lame);
    const uz_elasticity law = uz_element_material(model, e)->law;
    const int n = dim * nodes;
    const bool wide = UZ_CPU_HAS("avx2"), averaged = element.formulation == UZ_FORMULATION_BBAR;
    mean_of mean;
    bool unstrained = model->n_rigid > 0; /* of a rigid group */
    for (int a = 0; a < nodes && unstrained; a++)
        unstrained =
            uz_is_rigid(model, node[a]) && uz_rigid_group_of(model, node[a]) == uz_rigid_group_of(model, node[0]);
    memset(rows, 0, (size_t)(n * dim * UZ_ELEMENT_NODES) * sizeof *rows);
    for (int i = 0; i < n; i++)
        u[i] = w->of->u[dim * node[i / dim] + i % dim];
    if (w->of->free_strain)
        expand(&element, xyz, u, n, dim, w->of->free_strain[e]);
    out->least_det = fmin(out->least_det, least_on_edges(&element, u, &lame, law));
    const bool upright = !averaged || find_mean(&mean, &element, u, &lame, law);
    const long double small = w->small, unit = w->unit; /* of the elements before */
    w->small = w->unit = 0;
    for (int g = 0; g < rule->count; g++) {
        long double det = deform(&x, &measure, &element, u, rule->point[g].at);
        const long double weight = (long double)rule->point[g].weight * measure;
        const bool known = det > 0 && upright && (averaged || law_at(&at, &det, &x, &element, &lame, law));
        out->least_det = isnan(det) ? -INFINITY : fmin(out->least_det, (double)det);
        if (!known || unstrained)
            continue;
        if (averaged) {
            add_mean_point(w, force, rows, weight, &x, &mean, det, &lame, law, u);
            continue;
        }
        w->energy += weight * at.W;
        add_unit(w, weight, &lame, &x, u);
        (wide ? add_point_wide : add_point_plain)(force, rows, weight, &x, &at);
    }
    out->unstrained = out->unstrained && 2 * w->small <= OF_ELEMENT * OF_ELEMENT * w->unit;
    w->small += small;
    w->unit += unit;
    for (int i = 0; i < n && !unstrained; i++) {
        w->force[dim * node[i / dim] + i % dim] += force[i];
        for (int k = 0; k <= i; k++)
            ke[k * n + i] = ke[i * n + k] = rows[(i * dim + k % dim) * UZ_ELEMENT_NODES + k / dim] +
                                            (averaged && upright ? of_mean(&mean, i, k) : 0);
    }
    if (!unstrained)
        uz_add_stiffness(&w->tangent, ke, node, nodes);
}

/* Elastic ground, by its energy k u^2 / 2 along each axis. */
static void add_springs(work *w)
{
    const uz_body_model *model = w->of->model;
    const int dim = model->mesh.dim;
    for (int64_t a = 0; a < model->mesh.n_nodes && model->spring; a++) {
        double ke[9] = {0};
        for (int c = 0; c < dim; c++) {
            const long double k = model->spring[dim * a + c], u = w->of->u[dim * a + c];
            w->energy += k * u * u / 2;
            w->small += k * u * u / 2;
            w->force[dim * a + c] += k * u;
            ke[c * dim + c] = (double)k;
        }
        uz_add_stiffness(&w->tangent, ke, &a, 1);
    }
}

/* Pressures, where the sides are that they act on: what they do is taken off the internal forces. */
static uz_status add_pressures(work *w, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const uz_scene *scene = w->of->scene;
    const int dim = model->mesh.dim;
    for (int64_t i = 0; i < scene->n_loads; i++) {
        const uz_load *load = &scene->loads[i];
        if (load->kind != UZ_LOAD_PRESSURE)
            continue;
        const uz_group *group = uz_mesh_group(&model->mesh, load->on, "/loads", err);
        for (int64_t k = 0; group && k < group->n_faces; k++) {
            uz_side side;
            double xyz[3 * UZ_FACE_NODES], ke[9 * UZ_FACE_NODES * UZ_FACE_NODES];
            long double x[3 * UZ_FACE_NODES], force[3 * UZ_FACE_NODES];
            int64_t node[UZ_FACE_NODES];
            uz_body_side(&side, xyz, node, model, group->face[k]);
            for (int c = 0; c < dim * side.nodes; c++)
                x[c] = (long double)xyz[c] + w->of->u[dim * node[c / dim] + c % dim];
            uz_pressed_side(force, ke, &side, x, load->value);
            for (int c = 0; c < dim * side.nodes; c++)
                w->force[dim * node[c / dim] + c % dim] -= force[c];
            uz_add_stiffness(&w->tangent, ke, node, side.nodes);
        }
        if (!group)
            return UZ_ERR_SCENE;
    }
    return UZ_OK;
}

/* ---- contact */

/* Where a row stands: shares of nodes. */
static int row_nodes(const int64_t **node, const double **share, const uz_body_model *model, int64_t row)
{
    static const double ONE = 1;
    const uz_inner_place *inner = uz_row_inner(model, row);
    *node = inner ? inner->node : &model->info.contact_node[row];
    *share = inner ? inner->share : &ONE;
    return inner ? inner->nodes : 1;
}

/* Where the row stands (3) on the deformed body; *node and *share (the number of them is returned): of which nodes. */
static int row_place(double x[3], const int64_t **node, const double **share, const uz_finite_answer *of, int64_t row)
{
    const uz_mesh *mesh = &of->model->mesh;
    const int n = row_nodes(node, share, of->model, row);
    memset(x, 0, 3 * sizeof *x);
    for (int a = 0; a < n; a++)
        for (int c = 0; c < mesh->dim; c++)
            x[c] += (*share)[a] * (mesh->xyz[mesh->dim * (*node)[a] + c] + of->u[mesh->dim * (*node)[a] + c]);
    return n;
}

/* `force` times the second derivatives of the gap of a place of the material, whose shares of nodes stay: they are
 * k N_a N_b T, k the curvature along the obstacle, T the sum of t t' over its tangents t that are curved. */
static void place_curvature(double *ke, double force, const double *n, const uz_gap *at, const double *share, int nodes,
                            int dim)
{
    for (int p = 0; p < dim * nodes; p++)
        for (int q = 0; q < dim * nodes; q++) {
            const int i = p % dim, j = q % dim;
            const double T = (i == j) - n[i] * n[j] - at->along[i] * at->along[j];
            ke[p * dim * nodes + q] = force * at->curvature * share[p / dim] * share[q / dim] * T;
        }
}

/* What the obstacle's curvature does to the stiffness: the Lagrangian has r g. The edges of lines and tables are none:
 * rows take them as rounded. A row of the middle of an eight-node face is one of several nodes: it has r'g by node. */
static uz_status add_curvature(work *w, uz_obstacle *const *obstacle, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const int dim = model->mesh.dim;
    uz_status status = UZ_OK;
    double *force = uz_alloc(model->m, sizeof *force);
    if (!force)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)model->m);
    uz_row_forces(force, model, w->of->r);
    for (int64_t row = 0; row < model->m && status == UZ_OK; row++) {
        const double *share, *normal = model->info.contact_normal + dim * row;
        const int64_t *node;
        double x[3], ke[9 * UZ_FACE_NODES * UZ_FACE_NODES];
        uz_gap at;
        if (!(fabs(force[row]) > w->pressed) || !obstacle[model->info.contact_of[row]] ||
            model->sites[model->info.contact_of[row]].n == 0)
            continue;
        const int n = row_place(x, &node, &share, w->of, row);
        status = uz_obstacle_gap(&at, obstacle[model->info.contact_of[row]], x, err);
        if (status != UZ_OK || uz_obstacle_has_edges(obstacle[model->info.contact_of[row]]))
            continue;
        place_curvature(ke, force[row], normal, &at, share, n, dim);
        uz_add_stiffness(&w->tangent, ke, node, n);
    }
    free(force);
    return status;
}

/* Stiffness along the pressed rows, times `factor` more than there is already. */
static uz_status add_along(work *w, double factor, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    uz_csc *K = &w->tangent.K, rows = {0};
    const uz_status status = uz_csc_transpose(&rows, &model->N, err);
    for (int64_t row = 0; row < model->m && status == UZ_OK; row++)
        for (int64_t p = rows.ptr[row]; p < rows.ptr[row + 1] && w->of->r[row] < -w->pressed; p++)
            for (int64_t q = rows.ptr[row]; q <= p; q++) {
                const int64_t at = uz_csc_find(K, rows.idx[p], rows.idx[q]);
                if (at >= 0)
                    K->val[at] += factor * rows.val[p] * rows.val[q];
            }
    uz_csc_clear(&rows);
    return status;
}

/* The gap of a point of a side whose nodes have gone to xyz. */
static uz_status gap_at(double *gap, const uz_side *side, const double *xyz, const uz_obstacle *obstacle,
                        const double point[2], uz_error *err)
{
    double N[UZ_FACE_NODES], x[3] = {0};
    uz_gap at;
    uz_side_shape(N, side, point);
    for (int a = 0; a < side->nodes; a++)
        for (int c = 0; c < side->dim; c++)
            x[c] += N[a] * xyz[side->dim * a + c];
    const uz_status status = uz_obstacle_gap(&at, obstacle, x, err);
    *gap = at.gap;
    return status;
}

/* One side: its ends and points between them, and from the closest of these on to where it is closest: an obstacle
 * that is narrower than the points are apart may be deep between them. apart: of nodes, how far the closest of the
 * sides around each is from the obstacle, over the length of that side. */
static uz_status look_at_side(uz_finite_certificate *out, double *apart, const uz_finite_answer *of, uz_face face,
                              const uz_obstacle *obstacle, uz_error *err)
{
    enum { STEPS = SAMPLES + 1 };
    uz_side side;
    double xyz[3 * UZ_FACE_NODES], length = 0, least = INFINITY, gap, at[2] = {0};
    int64_t node[UZ_FACE_NODES];
    uz_status status = UZ_OK;
    uz_body_side(&side, xyz, node, of->model, face);
    const int dim = side.dim;
    const bool triangle = dim == 3 && side.nodes % 3 == 0;
    const double first = triangle ? 0 : -1, step = (triangle ? 1.0 : 2.0) / STEPS;
    for (int a = 0; a < side.nodes; a++) {
        for (int c = 0; c < dim; c++)
            xyz[dim * a + c] += of->u[dim * node[a] + c];
        for (int b = 0; b < a; b++)
            length = fmax(length, sqrt(uz_distance2(xyz + dim * a, xyz + dim * b, dim)));
    }
    for (int k = 0; k <= STEPS; k++)
        for (int l = 0; l <= (dim == 2 ? 0 : triangle ? STEPS - k : STEPS) && status == UZ_OK; l++) {
            const double point[2] = {first + step * k, first + step * l};
            status = gap_at(&gap, &side, xyz, obstacle, point, err);
            if (status == UZ_OK && gap < least) {
                least = gap;
                memcpy(at, point, sizeof at);
            }
        }
    double way = step / 2;
    for (int k = 0; k < CLOSER && status == UZ_OK && least < length / STEPS; k++) {
        const double from[2] = {at[0], at[1]};
        const double before = least;
        for (int j = 0; j < (dim == 2 ? 3 : 9) && status == UZ_OK; j++) {
            const int along = j % 3 - 1, across = j / 3 - 1;
            const double point[2] = {from[0] + way * along, dim == 2 ? from[1] : from[1] + way * across};
            if (fmin(point[0], dim == 2 ? 0 : point[1]) < first || point[0] + (triangle ? point[1] : 0) > 1 ||
                (dim == 3 && point[1] > 1))
                continue;
            status = gap_at(&gap, &side, xyz, obstacle, point, err);
            if (status == UZ_OK && gap < least) {
                least = gap;
                memcpy(at, point, sizeof at);
            }
        }
        way = least < before ? way : way / 2;
    }
    out->least_gap = fmin(out->least_gap, least);
    const double part = length > 0 ? least / length : -(double)INFINITY;
    out->least_part = fmin(out->least_part, part);
    for (int a = 0; a < side.nodes; a++)
        apart[node[a]] = fmin(apart[node[a]], part);
    return status;
}

/* Does a row press where no side around its node comes near the obstacle? Those of middles, which have a share of
 * their ends' gaps, do where sides are long against a curved obstacle. */
static void look_for_pressed_apart(uz_finite_certificate *out, const uz_finite_answer *of, const double *apart,
                                   int64_t contact, double pressed)
{
    const uz_body_model *model = of->model;
    double nearest = INFINITY;
    for (int64_t i = 0; i < model->m; i++) {
        if (model->info.contact_of[i] != contact || !(of->r[i] < -pressed))
            continue;
        const double here = apart[model->info.contact_node[i]];
        const bool shares = model->row_ends && model->row_ends[2 * i] >= 0;
        nearest = fmin(nearest, shares && isfinite(here) ? here : 0);
        if (!uz_row_inner(model, i) && isfinite(here))
            out->pressed_apart = fmax(out->pressed_apart, here);
    }
    if (isfinite(nearest))
        out->touches_nowhere = fmax(out->touches_nowhere, nearest);
}

/* Nodes that have rows, from the obstacles themselves: what g says of them is checked by what it should be. A middle's
 * row has a share of its ends' (uz_blend_rows), edges of lines and tables are rounded for rows. */
static uz_status look_at_rows(uz_finite_certificate *out, const uz_finite_answer *of, uz_obstacle *const *obstacle,
                              uz_error *err)
{
    const uz_body_model *model = of->model;
    uz_status status = UZ_OK;
    for (int64_t i = 0; i < model->m && status == UZ_OK; i++) {
        const uz_obstacle *own = obstacle[model->info.contact_of[i]];
        const double *share;
        const int64_t *node;
        double x[3];
        uz_gap at = {.gap = of->g[i]};
        if (own && row_place(x, &node, &share, of, i) == 1 && !(model->row_ends && model->row_ends[2 * i] >= 0) &&
            !uz_obstacle_has_edges(own))
            status = uz_obstacle_gap(&at, own, x, err);
        out->least_at_rows = fmin(out->least_at_rows, of->g[i]);
        out->least_at_nodes = fmin(out->least_at_nodes, at.gap);
    }
    return status;
}

/* Reactions, gaps at rows and between them, and what curvature adds to the tangent. */
static uz_status look_at_contacts(uz_finite_certificate *out, work *w, uz_error *err)
{
    const uz_finite_answer *of = w->of;
    const int64_t n = of->scene->n_contacts;
    uz_obstacle **obstacle = uz_alloc_zero(n, sizeof *obstacle);
    double *apart = uz_alloc(of->model->mesh.n_nodes, sizeof *apart);
    uz_status status = obstacle && apart ? UZ_OK : uz_no_memory(err, "the obstacles");
    for (int64_t k = 0; k < n && status == UZ_OK; k++) {
        if (of->scene->contacts[k].kind == UZ_OBSTACLE_BODY) {
            status = uz_pair_gaps(&out->least_gap, &out->least_part, of->model, of->scene, k, of->u, SAMPLES + 1, err);
            continue;
        }
        const uz_group *group = uz_mesh_group(&of->model->mesh, of->scene->contacts[k].on, "/contacts", err);
        status =
            group ? uz_obstacle_new(&obstacle[k], &of->scene->contacts[k], k, of->scene->model, err) : UZ_ERR_SCENE;
        for (int64_t a = 0; a < of->model->mesh.n_nodes; a++)
            apart[a] = INFINITY;
        for (int64_t i = 0; status == UZ_OK && i < group->n_faces; i++)
            status = look_at_side(out, apart, of, group->face[i], obstacle[k], err);
        if (status == UZ_OK && group->n_faces > 0)
            look_for_pressed_apart(out, of, apart, k, w->pressed);
        bool inside = false;
        if (status == UZ_OK)
            status = uz_swallows(&inside, of->model, of->scene, k, of->u, err);
        out->swallows = out->swallows || inside;
    }
    if (status == UZ_OK)
        status = add_curvature(w, obstacle, err);
    if (status == UZ_OK)
        status = look_at_rows(out, of, obstacle, err);
    for (int64_t k = 0; k < n && obstacle; k++)
        uz_obstacle_free(obstacle[k]);
    uz_free_all(obstacle, apart);
    return status;
}

/* ---- the whole */

static bool begin(work *w)
{
    const uz_body_model *model = w->of->model;
    const uz_csc *K = &model->K, *fixed = &model->K_fixed;
    w->tangent = *model;
    w->tangent.K.val = uz_alloc_zero(K->ptr[K->cols], sizeof(double));
    w->tangent.K_fixed.val = uz_alloc_zero(fixed->ptr[fixed->cols], sizeof(double));
    w->force = uz_alloc_zero(model->mesh.dim * model->mesh.n_nodes, sizeof *w->force);
    w->f = uz_alloc_zero(model->d, sizeof *w->f);
    w->room = uz_alloc(model->d, sizeof *w->room);
    w->size = uz_alloc(model->d, sizeof *w->size);
    return w->tangent.K.val && w->tangent.K_fixed.val && w->force && w->f && w->room && w->size;
}

/* f: loads less internal forces, along free dofs, with the reactions of the rows. */
static uz_status leave_over(work *w, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const int64_t n = model->mesh.dim * model->mesh.n_nodes;
    double *nodal = uz_alloc(n, sizeof *nodal);
    if (!nodal)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces on %lld nodes",
                       (long long)model->mesh.n_nodes);
    uz_status status = uz_nodal_loads(nodal, model, w->of->scene, err);
    for (int64_t i = 0; i < n && status == UZ_OK; i++)
        nodal[i] = (double)(nodal[i] - w->force[i]);
    if (status == UZ_OK)
        status = uz_point_forces(nodal, &w->tangent, w->of, err);
    if (status == UZ_OK) {
        uz_gather_nodal(w->f, model, nodal);
        uz_csc_gaxpy_t(w->f, &model->N, 1, w->of->r);
        status = model->n_rigid > 0 ? uz_rigid_groups_bend(&w->tangent, nodal, w->of, err) : UZ_OK;
    }
    free(nodal);
    return status;
}

/* Of rows between bodies the tangent has how they turn, and room for stiffness along them. *known: it could be found.
 */
static uz_status add_turn(bool *known, work *w, uz_error *err)
{
    const uz_finite_answer *of = w->of;
    uz_row_turn turn = {.known = true};
    uz_csc wide = {0};
    *known = true;
    if (!uz_has_pairs(of->scene))
        return UZ_OK;
    uz_status status = uz_row_turn_find(&turn, of->rest, of->model, of->scene, of->r, w->pressed, w->stop, err);
    *known = turn.known;
    if (status == UZ_OK)
        status = uz_widen_by_rows(&wide, &w->tangent.K, &of->model->N, of->r, w->pressed, &turn, err);
    uz_row_turn_clear(&turn);
    if (status != UZ_OK) {
        uz_csc_clear(&wide);
        return status;
    }
    free(w->tangent.K.val);
    w->tangent.K = w->wide = wide;
    return UZ_OK;
}

double uz_finite_certificate_bytes(const uz_body_model *model, const uz_csc *K)
{
    const double nodal = (double)(model->mesh.dim * model->mesh.n_nodes);
    return 8.0 * (double)(K->ptr[K->cols] + model->K_fixed.ptr[model->K_fixed.cols]) + 24.0 * nodal +
           24.0 * (double)model->d;
}

/* What is prescribed of the displacement of node a along its dof c, or follows from others'. */
static double off_support(const uz_finite_answer *of, int64_t a, int c)
{
    const uz_body_model *model = of->model;
    const int dim = model->mesh.dim;
    const int64_t dof = model->dof[dim * a + c];
    if (uz_mesh_hangs(&model->mesh, a)) /* those that it lies amid have it */
        return of->u[dim * a + c] - uz_mesh_value_amid(&model->mesh, a, of->u + c, dim);
    if (uz_is_rigid(model, a))
        return 0; /* uz_rigid_groups_off */
    if (dof == UZ_NO_DOF)
        return uz_is_tied(model, a) ? uz_along_dof(model, a, c, of->u + dim * a) - uz_tied_along(model, a, c, of->u)
                                    : 0;
    return dof < 0 ? uz_along_dof(model, a, c, of->u + dim * a) - of->prescribed[-1 - dof] : 0;
}

/* Gaps are known to the last digits of places, whose last one is so many times larger than it is of a body that stands
 * where coordinates begin. */
static double find_distance(const uz_body_model *model)
{
    const uz_mesh *mesh = &model->mesh;
    double farthest = 0;
    for (int64_t i = 0; i < mesh->dim * mesh->n_nodes && model->m > 0; i++)
        farthest = fmax(farthest, fabs(mesh->xyz[i]));
    return fmax(1, farthest / mesh->extent);
}

/* The factor of H, and with it the residual. */
static uz_status judge(uz_finite_certificate *out, work *w, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const uz_csc *K = &w->tangent.K;
    bool known;
    double stiffest = 0, work_left = 0, square = 0, there = 0;
    uz_status status = add_turn(&known, w, err);
    for (int64_t j = 0; j < model->d && status == UZ_OK; j++) {
        w->size[j] = fabs(K->val[K->ptr[j]]);
        stiffest = fmax(stiffest, w->size[j]);
    }
    for (size_t k = 0; k < sizeof ALONG / sizeof ALONG[0] && status == UZ_OK && !out->definite && known; k++) {
        uz_envelope factor = {0};
        status = add_along(w, ALONG[k] * stiffest - there, err);
        there = ALONG[k] * stiffest;
        if (status == UZ_OK)
            status = uz_envelope_factor(&factor, &out->definite, K, w->size, LEAST_PIVOT, w->stop, err);
        if (status == UZ_OK && out->definite) {
            for (int64_t j = 0; j < model->d; j++) /* the step also closes the pressed rows */
                for (int64_t q = model->N.ptr[j]; q < model->N.ptr[j + 1]; q++)
                    if (w->of->r[model->N.idx[q]] < -w->pressed)
                        w->f[j] += there * model->N.val[q] * w->of->g[model->N.idx[q]];
            uz_envelope_forward(w->f, &factor, w->room);
        }
        out->bytes = uz_envelope_bytes(&factor) + uz_finite_certificate_bytes(model, K);
        uz_envelope_clear(&factor);
    }
    out->stopped = status == UZ_OK && !out->definite && uz_stop_is_due(w->stop); /* and so not definite */
    for (int64_t j = 0; j < model->d; j++)
        square += w->f[j] * w->f[j];
    for (int64_t i = 0; i < model->m; i++)
        work_left += w->of->r[i] < -w->pressed ? 0 : fabs(w->of->r[i] * w->of->g[i]);
    const double tiny = TINY * TINY * (double)w->unit, energy = out->energy > tiny ? out->energy : (double)w->small;
    const double left = sqrt(square + 2 * work_left), norm = sqrt(2 * energy);
    out->distance = find_distance(model);
    const double rounding = ROUNDING * out->distance * sqrt((double)w->unit);
    out->rounding = norm > 0 ? rounding / norm : (double)INFINITY;
    if (out->definite) /* what is not strained is exact to rounding */
        out->residual = left <= rounding && norm <= rounding ? 0 : norm > 0 ? left / norm : (double)INFINITY;
    return status;
}

uz_status uz_certify_finite(uz_finite_certificate *out, const uz_finite_answer *answer, const uz_stop *stop,
                            uz_error *err)
{
    const uz_body_model *model = answer->model;
    const int dim = model->mesh.dim;
    work w = {.of = answer, .stop = stop};
    double most = 0, stiffest = 0;
    *out = (uz_finite_certificate){.least_det = INFINITY,
                                   .residual = INFINITY,
                                   .unstrained = true,
                                   .least_gap = INFINITY,
                                   .least_part = INFINITY,
                                   .least_at_rows = INFINITY,
                                   .least_at_nodes = INFINITY};
    uz_status status =
        begin(&w) ? UZ_OK
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the tangent of %lld dofs", (long long)model->d);
    for (int64_t i = 0; i < model->m; i++)
        most = fmax(most, fabs(answer->r[i]));
    for (int64_t i = 0; i < model->m; i++)
        out->worst_reaction = fmax(out->worst_reaction, most > 0 ? answer->r[i] / most : answer->r[i]);
    for (int64_t i = 0; i < dim * model->mesh.n_nodes && status == UZ_OK; i++)
        out->worst_support = fmax(out->worst_support, fabs(off_support(answer, i / dim, (int)(i % dim))));
    out->worst_support = fmax(out->worst_support, uz_rigid_groups_off(answer));
    for (int64_t e = 0; e < model->mesh.n_elements && status == UZ_OK && !out->stopped; e++) {
        out->stopped = e % ELEMENTS_BETWEEN == 0 && uz_stop_is_due(stop);
        add_element(out, &w, e);
    }
    if (status == UZ_OK && !out->stopped)
        add_springs(&w);
    for (int64_t j = 0; j < model->d && status == UZ_OK; j++)
        stiffest = fmax(stiffest, w.tangent.K.val[w.tangent.K.ptr[j]]);
    w.pressed = fmax(PRESSED * most, NO_FORCE * stiffest * model->mesh.extent);
    out->energy = (double)w.energy;
    if (status == UZ_OK && !out->stopped)
        status = add_pressures(&w, err);
    if (status == UZ_OK && !out->stopped)
        status = look_at_contacts(out, &w, err);
    if (status == UZ_OK && !out->stopped && out->least_det > 0)
        status = leave_over(&w, err);
    if (status == UZ_OK && !out->stopped && out->least_det > 0)
        status = judge(out, &w, err);
    if (w.wide.ptr)
        uz_csc_clear(&w.wide);
    else
        free(w.tangent.K.val);
    uz_free_all(w.tangent.K_fixed.val, w.force, w.f, w.room, w.size);
    return status;
}
