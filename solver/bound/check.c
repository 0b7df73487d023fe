/* check.c: what an answer and a stress prove, whatever they were made by.
 *
 * The stress is looked at as nodal values of polynomials on triangles. Where it lacks equilibrium, its virtual work
 * misses that of the loads by R(w) = sum over the edges of (what is missing) . w, and the gap between displacement and
 * stress,
 *
 *     G = int 1/2 |sigma_h - C eps(u_h)|^2 + int r_h s_h,   |tau|^2 = tau : C^-1 : tau,
 *
 * is J(u_h) - D(sigma_h) + R(u_h): both are evaluated, by different sums, and have to agree. The stress's work on
 * eps(u_h) is that of its tractions on the sides of each element and of the force within.
 *
 * Where u_h enters the obstacle (quadratic elements do between nodes), let a displacement w, zero at supports, take it
 * out: s_h + w_n >= 0. The pressure r of the solution has int r s_h >= -int r w_n, and that is int r_h w_n +
 * int (sigma_h - sigma) : eps(w) - R(w), so that with 1/2 |e_u|^2 + 1/2 |e_sigma|^2 = G - int r s_h - int r_h s +
 * R(e_u)
 *
 *     1/2 |e_u|^2 <= G + int r_h w_n + |e_sigma| |w| - 1/2 |e_sigma|^2 + rho (|e_u| + |w|)
 *      |e_u|      <= rho + sqrt(2 (G + int r_h w_n) + (|w| + rho)^2),        rho = sup R(w) / |w|.
 *
 * Nothing of it is taken from the dual problem: a wrong K makes a larger bound, or one whose sums do not agree. */
#include "bound/check.h"

#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Relative to the energies and works of the elements: how far the two evaluations of G may differ; and residuals within
 * elements, relative to the stress. */
#define AGREE  1e-9
#define INSIDE 1e-9
/* An energy, below which parts of it are lost that are not to rounding. */
#define SMALLEST (DBL_MIN / DBL_EPSILON)

enum { STRESSES = UZ_BOUND_PARTS * UZ_BOUND_POINTS * 3 };

static uz_status examine_edges(examination *x, const double *u, const int64_t *dof, uz_error *err);
static void examine_edge(examination *x, const double *u, const int64_t *dof, int64_t i);
static void examine_springs(examination *x, const double *u, int64_t i, int k);
static bool holds_turning(const uz_bound_body *body, int64_t i);
static void settle_motions(examination *x, const double *u, const int64_t *dof);
static void lift_on(examination *x, const double *u);
static void look_at_lift(examination *x, const double *u, int64_t i);
static const uz_check_of *check_of(const examination *x);

/* -> farthest. Is u more than a translation? */
static bool look_at_displacement(examination *x, const double *u)
{
    bool strained = false;
    for (int64_t i = 0; i < 2 * x->mesh->n_nodes; i++) {
        x->farthest = fmax(x->farthest, fabs(u[i]));
        strained = strained || u[i] > u[i % 2] || u[i] < u[i % 2];
    }
    return strained;
}

/* The sums over elements, which are of u and the stress alone; clear_elements in any case. */
static uz_status examine_elements(examination *x, uz_bound_check_result *out, const double *u, const double *stress,
                                  uz_error *err)
{
    x->out = out;
    x->resultant = uz_alloc_zero(x->body->n_edges * x->moments * 2, sizeof *x->resultant);
    x->gap = uz_alloc_zero(x->mesh->n_elements, sizeof *x->gap);
    if (!x->resultant || !x->gap)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to check the stress of %lld elements",
                       (long long)x->mesh->n_elements);
    for (int64_t e = 0; e < x->mesh->n_elements; e++)
        uz_examine_element(x, u, stress + e * STRESSES, e);
    return UZ_OK;
}

static void clear_elements(examination *x)
{
    uz_free_all(x->resultant, x->gap);
}

static double *copy_of(const double *from, int64_t n)
{
    double *to = uz_alloc(n, sizeof *to);
    if (to)
        memcpy(to, from, (size_t)n * sizeof *to);
    return to;
}

/* Whether the sums say anything. apart: by how much two ways to the gap differ. */
static void look_at_sums(const examination *x, double scale, double apart, bool strained)
{
    uz_bound_check_result *out = x->out;
    if (!*out->fault && !(x->inside <= INSIDE))
        snprintf(out->fault, sizeof out->fault, "the stress is not in equilibrium within elements, by %.1e of it",
                 x->inside);
    if (!*out->fault && strained && !(scale > SMALLEST)) /* what underflows is in no margin */
        snprintf(out->fault, sizeof out->fault, "energies of %.1e are too small for double precision", scale);
    if (!*out->fault && !(out->gap >= -AGREE * scale && fabs(apart) <= AGREE * scale))
        snprintf(out->fault, sizeof out->fault, "two ways to evaluate the gap, %.9e, differ by %.1e", out->gap, apart);
}

/* What the elements' sums, all that there is of `elements`, and one lift prove. */
static uz_status conclude(uz_bound_check_result *out, const examination *elements, const uz_scene *scene,
                          const int64_t *dof, int64_t n_dofs, const double *u, const double *lift, uz_error *err)
{
    const uz_bound_body *body = elements->body;
    const uz_mesh *mesh = elements->mesh;
    examination x = *elements;
    uz_status status = UZ_OK;
    x.out = out;
    x.given = lift;
    *out = (uz_bound_check_result){.gap = 0};
    memcpy(out->fault, elements->out->fault, sizeof out->fault);
    out->residual = uz_alloc_zero(n_dofs, sizeof *out->residual);
    x.resultant = copy_of(elements->resultant, body->n_edges * x.moments * 2);
    x.pressure = uz_alloc_zero(body->n_edges * x.moments, sizeof *x.pressure);
    x.lift = uz_alloc_zero(2 * mesh->n_nodes, sizeof *x.lift);
    x.moved = uz_alloc_zero(2 * mesh->n_nodes, sizeof *x.moved);
    out->local = x.gap = copy_of(elements->gap, mesh->n_elements);
    out->lifted = uz_alloc(2 * mesh->n_nodes, sizeof *out->lifted);
    if (!out->residual || !x.resultant || !x.pressure || !x.lift || !x.moved || !x.gap || !out->lifted)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to check the stress of %lld elements",
                         (long long)mesh->n_elements);
    const bool strained = look_at_displacement(&x, u);
    double load = status == UZ_OK ? uz_work_of_loads(&x, scene, u, &status, err) : 0;
    if (status == UZ_OK) {
        out->primal = x.strain - load;
        out->dual = -x.complementary - x.own_margin;
        out->gap = x.margin + x.own_margin + UZ_SUM_ROUNDING * x.scale;
        const double rounding = out->gap;
        const uz_status pairs = examine_edges(&x, u, dof, err);
        uz_take_pairs_apart(&x, u);
        for (int64_t i = 0; i < 2 * mesh->n_nodes && lift; i++)
            x.lift[i] += lift[i];
        lift_on(&x, u);
        const double ground = uz_spring_energy(&x, u), scale = x.scale + fabs(load) + ground;
        x.sum += x.springs + ground;
        out->least = 2 * fmax(0, x.sum - rounding - 4 * UZ_SUM_ROUNDING * ground);
        x.strain += ground;
        out->primal += ground;
        const double apart = out->primal - out->dual + out->defect - (out->gap - rounding) - x.sum;
        out->gap += x.sum + 4 * UZ_SUM_ROUNDING * ground;
        for (int64_t i = 0; i < body->n_edges; i++)
            look_at_lift(&x, u, i);
        uz_look_at_pairs(&x, u);
        for (int64_t i = 0; i < 2 * mesh->n_nodes; i++)
            out->lifted[i] = u[i] + x.lift[i];
        double lifted = 0, margin = 0, strain = x.strain;
        for (int64_t e = 0; e < mesh->n_elements; e++) {
            const double own = uz_energy_of(&margin, &x, x.lift, false, e);
            lifted += 2 * own;
            out->local[e] += own;
        }
        lifted += 2 * uz_spring_energy(&x, x.lift);
        const double by_nodes = sqrt(lifted + 2 * margin);
        out->lift = by_nodes + sqrt(x.bulge);
        out->turning = sqrt(x.turning);
        out->norm = sqrt(2 * fmax(0, x.strain - x.margin));
        if (lifted > 0) { /* of u_h + w: an admissible one has the larger energy than the minimum */
            strain = x.margin = 0;
            for (int64_t e = 0; e < mesh->n_elements; e++)
                strain += uz_energy_of(&x.margin, &x, out->lifted, true, e);
            strain += uz_spring_energy(&x, out->lifted);
            load = uz_work_of_loads(&x, scene, out->lifted, &status, err);
        }
        out->primal = strain + x.margin - load + UZ_SUM_ROUNDING * (scale + strain + fabs(load));
        /* a(u_h + w, b) - f(b) of the bulges b: of the stress it is their work, and the rest is by Schwarz */
        out->primal += x.bulge_work + (sqrt(2 * x.bulged) + by_nodes) * sqrt(x.bulge) + x.bulge / 2;
        status = pairs != UZ_OK ? pairs : status;
        out->dual -= UZ_SUM_ROUNDING * scale;
        out->inside = 100 * x.inside * sqrt(2 * fabs(x.complementary));
        look_at_sums(&x, scale, apart, strained);
    }
    out->pressure = x.pressure;
    uz_free_all(x.resultant, x.lift, x.moved);
    if (status != UZ_OK)
        uz_bound_check_clear(out);
    return status;
}

uz_status uz_bound_check_lifts(uz_bound_check_result *out, const uz_bound_body *body, const uz_scene *scene,
                               const int64_t *dof, int64_t n_dofs, const double *u, const double *const *lifts, int n,
                               const double *stress, uz_error *err)
{
    uz_bound_check_result sums = {.gap = 0};
    examination elements = {.body = body, .mesh = &body->model->mesh, .moments = body->degree + 1};
    uz_status status = examine_elements(&elements, &sums, u, stress, err);
    *out = sums;
    for (int k = 0; k < n && status == UZ_OK; k++) {
        uz_bound_check_result with;
        status = conclude(&with, &elements, scene, dof, n_dofs, u, lifts[k], err);
        if (status == UZ_OK && (k == 0 || uz_bound_error(&with, 0) < uz_bound_error(out, 0))) {
            uz_bound_check_clear(out);
            *out = with;
        } else {
            uz_bound_check_clear(&with);
        }
    }
    clear_elements(&elements);
    if (status != UZ_OK)
        uz_bound_check_clear(out);
    return status;
}

uz_status uz_bound_check(uz_bound_check_result *out, const uz_bound_body *body, const uz_scene *scene,
                         const int64_t *dof, int64_t n_dofs, const double *u, const double *lift, const double *stress,
                         uz_error *err)
{
    return uz_bound_check_lifts(out, body, scene, dof, n_dofs, u, &lift, 1, stress, err);
}

uz_status uz_bound_potential(double *potential, double *strain, double *margin, const uz_bound_body *body,
                             const uz_scene *scene, const double *u, uz_error *err)
{
    examination x = {.body = body, .mesh = &body->model->mesh, .moments = body->degree + 1};
    uz_status status = UZ_OK;
    *strain = uz_spring_energy(&x, u);
    *margin = 0;
    for (int64_t e = 0; e < x.mesh->n_elements; e++)
        *strain += uz_energy_of(margin, &x, u, true, e);
    const double load = uz_work_of_loads(&x, scene, u, &status, err);
    *potential = *strain - load;
    *margin += 4 * UZ_SUM_ROUNDING * (*strain + fabs(load));
    return status;
}

void uz_bound_check_clear(uz_bound_check_result *result)
{
    uz_free_all(result->residual, result->lifted, result->pressure, result->local);
    result->residual = result->lifted = result->pressure = result->local = NULL;
}

double uz_bound_lacking(const uz_bound_check_result *c, double residual_norm)
{
    return residual_norm + c->inside + c->turning;
}

double uz_bound_error(const uz_bound_check_result *c, double residual_norm)
{
    const double rho = uz_bound_lacking(c, residual_norm), square = 2 * c->gap + (c->lift + rho) * (c->lift + rho);
    return *c->fault || !(square >= 0) ? (double)INFINITY : rho + sqrt(square);
}

/* ---- along an edge */

/* Means of a quadratic polynomial over an edge with the Bernstein polynomials of `moments` - 1 as weights. */
void uz_edge_means(double m[UZ_BOUND_MOMENTS], const double b[3], int moments)
{
    static const double LINEAR[2][3] = {{3, 2, 1}, {1, 2, 3}};               /* sixths */
    static const double QUADRATIC[3][3] = {{6, 3, 1}, {3, 4, 3}, {1, 3, 6}}; /* tenths */
    for (int a = 0; a < moments; a++)
        m[a] = moments == 2 ? (LINEAR[a][0] * b[0] + LINEAR[a][1] * b[1] + LINEAR[a][2] * b[2]) / 6
                            : (QUADRATIC[a][0] * b[0] + QUADRATIC[a][1] * b[1] + QUADRATIC[a][2] * b[2]) / 10;
}

void uz_along_edge(double b[3], const double *u, const int64_t node[3], const double n[2])
{
    double at[3] = {0};
    for (int a = 0; a < 3; a++)
        at[a] = node[a] < 0 ? 0 : n[0] * u[2 * node[a]] + n[1] * u[2 * node[a] + 1];
    b[0] = at[0];
    b[2] = at[1];
    b[1] = node[2] < 0 ? (at[0] + at[1]) / 2 : 2 * at[2] - (at[0] + at[1]) / 2;
}

/* s: the gap that u_h leaves, as uz_along_edge; lift: by how much w widens it. */
static void gap_along(double s[3], double lift[3], const examination *x, const double *u, const uz_bound_edge *edge)
{
    const uz_obstacle_piece *line = uz_bound_line(x->body, edge);
    uz_along_edge(s, u, edge->node, line->normal);
    uz_along_edge(lift, x->lift, edge->node, line->normal);
    for (int a = 0; a < 3; a++) {
        s[a] = (a == 0 ? line->gap[0] : a == 2 ? line->gap[1] : (line->gap[0] + line->gap[1]) / 2) - s[a];
        lift[a] = -lift[a];
    }
}

bool uz_way_along(double way[2], const uz_body_model *model, int64_t node, const double normal[2])
{
    static const double AXIS[2][2] = {{1, 0}, {0, 1}};
    double share = 0; /* of the normal along free dofs, its square */
    way[0] = way[1] = 0;
    for (int k = 0; k < 2; k++) {
        const double part = model->dof[2 * node + k] < 0 ? 0 : uz_along_dof(model, node, k, normal);
        for (int c = 0; c < 2; c++)
            way[c] += part * uz_along_dof(model, node, k, AXIS[c]);
        share += part * part;
    }
    for (int c = 0; c < 2; c++)
        way[c] /= fmax(share, 1e-6);
    return share > 1e-6;
}

void uz_lift_node(examination *x, int64_t node, const double normal[2], double by)
{
    double way[2];
    if (node < 0 || !(by > 0) || !uz_way_along(way, x->body->model, node, normal))
        return;
    for (int c = 0; c < 2; c++)
        if (fabs(by * way[c]) > fabs(x->lift[2 * node + c]))
            x->lift[2 * node + c] = -by * way[c];
}

bool uz_lift_more(examination *x, int64_t node, const double normal[2], double by)
{
    double way[2];
    if (node < 0 || !(by > 0) || !uz_way_along(way, x->body->model, node, normal))
        return false;
    for (int c = 0; c < 2; c++)
        x->lift[2 * node + c] -= by * way[c];
    return true;
}

void uz_add_given(double b[3], const examination *x, const uz_bound_edge *edge, const double n[2])
{
    double more[3];
    if (!x->given)
        return;
    uz_along_edge(more, x->given, edge->node, n);
    for (int a = 0; a < 3; a++)
        b[a] += more[a];
}

/* By how much the nodes have to be taken out, the middle one as far as makes the middle coefficient -sqrt(s_0 s_2),
 * from where on the polynomial has no negative value. */
static void needed_lift(double nodal[3], const double s[3])
{
    double up[3];
    for (int a = 0; a < 3; a++)
        up[a] = fmax(0, -s[a] - (a == 1 ? sqrt(fmax(0, s[0]) * fmax(0, s[2])) : 0));
    nodal[0] = up[0];
    nodal[1] = up[2];
    nodal[2] = (up[0] + 2 * fmax(up[1], (up[0] + up[2]) / 2) + up[2]) / 4;
}

void uz_add_contact_gap(examination *x, const uz_bound_edge *edge, double work)
{
    x->out->gap += work;
    if (x->out->local)
        x->out->local[edge->element[0]] += fmax(0, work);
}

/* The work of the gap that u_h leaves, and w where it is not >= 0 all along. */
static void examine_contact(examination *x, const double *u, const uz_bound_edge *edge, const double *pressure)
{
    double s[3], m[UZ_BOUND_MOMENTS], nodal[3], none[3], more[3] = {0};
    gap_along(s, none, x, u, edge);
    uz_edge_means(m, s, x->moments);
    for (int a = 0; a < x->moments; a++)
        uz_add_contact_gap(x, edge, pressure[a] * m[a]);
    uz_add_given(more, x, edge, uz_bound_line(x->body, edge)->normal); /* what was given to take it out */
    for (int a = 0; a < 3; a++)
        s[a] -= more[a];
    needed_lift(nodal, s);
    for (int a = 0; a < 3; a++)
        uz_lift_node(x, edge->node[a], uz_bound_line(x->body, edge)->normal, nodal[a]);
}

/* Where normals leap from edge to edge, what takes a node out of one's obstacle may leave it in the other's: it goes on
 * from there, until it is out of both. */
static void lift_on(examination *x, const double *u)
{
    enum { PASSES = 20 };
    bool lifted = x->body->corners;
    for (int pass = 0; pass < PASSES && lifted; pass++) {
        lifted = false;
        for (int64_t i = 0; i < x->body->n_edges; i++) {
            const uz_bound_edge *edge = &x->body->edge[i];
            double s[3], more[3], nodal[3], size = 0;
            if (edge->turns)
                lifted = uz_lift_turning(x, u, i) || lifted;
            if (edge->turns || edge->contact < 0)
                continue;
            gap_along(s, more, x, u, edge);
            for (int a = 0; a < 3; a++) {
                size = fmax(size, fabs(s[a]));
                s[a] += more[a];
            }
            needed_lift(nodal, s);
            for (int a = 0; a < 3; a++)
                if (nodal[a] > uz_place_rounding(x) && nodal[a] > 1e-13 * size)
                    lifted = uz_lift_more(x, edge->node[a], uz_bound_line(x->body, edge)->normal, nodal[a]) || lifted;
        }
    }
}

double uz_place_rounding(const examination *x)
{
    return fmin(1e-12 * x->mesh->extent, 1e-8 * x->farthest);
}

/* w has to be what it is meant to be, but for rounding of places, as far as that is nothing to the displacements: zero
 * at supports, and out of the obstacle. */
static void look_at_lift(examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double s[3], lift[3], m[UZ_BOUND_MOMENTS], size = 0, tolerance = uz_place_rounding(x);
    bool held = true;
    for (int a = 0; a < 6; a++)
        size = edge->node[a / 2] < 0 ? size : fmax(size, fabs(x->lift[2 * edge->node[a / 2] + a % 2]));
    for (int k = 0; k < 2; k++) {
        uz_along_edge(lift, x->lift, edge->node, edge->axis[k]);
        for (int a = 0; a < 3 && edge->held[k]; a++)
            held = held && fabs(lift[a]) <= 1e-12 * size;
    }
    if (!*x->out->fault && !held)
        snprintf(x->out->fault, sizeof x->out->fault, "what takes the answer out of the obstacle moves a support");
    if (edge->turns)
        uz_look_at_turning(x, u, i);
    if (edge->contact < 0 || edge->turns)
        return;
    const uz_obstacle_piece *line = uz_bound_line(x->body, edge);
    gap_along(s, lift, x, u, edge);
    uz_edge_means(m, lift, x->moments);
    for (int a = 0; a < x->moments; a++)
        x->out->gap += x->pressure[i * x->moments + a] * m[a];
    for (int a = 0; a < 3; a++)
        tolerance = fmax(tolerance, 1e-12 * (fabs(s[a]) + fabs(line->gap[0]) + fabs(line->gap[1])));
    for (int a = 0; a < 3; a++)
        s[a] += lift[a] + tolerance;
    const bool out_of_it = s[0] >= 0 && s[2] >= 0 && s[1] >= -sqrt(s[0] * s[2]) - tolerance;
    if (!*x->out->fault && !out_of_it)
        snprintf(x->out->fault, sizeof x->out->fault, "the answer is in the obstacle where supports keep it there");
}

/* 1/2 int k |u|^2 of the springs along the edges. */
double uz_spring_energy(const examination *x, const double *u)
{
    double sum = 0, b[3], at[3], weight[3];
    uz_gauss(at, weight, 3);
    for (int64_t i = 0; i < x->body->n_edges; i++)
        for (int c = 0; c < 2; c++) {
            const uz_bound_edge *edge = &x->body->edge[i];
            if (!(edge->spring[c] > 0))
                continue;
            uz_along_edge(b, u, edge->node, (const double[2]){c == 0, c == 1});
            for (int g = 0; g < 3; g++) {
                const double q = (1 + at[g]) / 2, v = b[0] * (1 - q) * (1 - q) + 2 * b[1] * q * (1 - q) + b[2] * q * q;
                sum += weight[g] / 4 * uz_bound_measure(x->body, i) *
                       (edge->weight[0] + q * (edge->weight[1] - edge->weight[0])) * edge->spring[c] * v * v;
            }
        }
    return sum;
}

/* The stress's traction along an axis is the springs' there. */
static void examine_springs(examination *x, const double *u, int64_t i, int k)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    const double area = uz_bound_measure(x->body, i);
    double b[3], m[UZ_BOUND_MOMENTS], own = 0, work = 0, q, share;
    if (!(edge->spring[k] > 0))
        return;
    uz_along_edge(b, u, edge->node, (const double[2]){k == 0, k == 1});
    uz_edge_means(m, b, x->moments);
    for (uz_line_walk walk = uz_line_begin(edge->weight[0], edge->weight[1]); uz_line_next(&walk, &q, &share);) {
        double phi[UZ_BOUND_MOMENTS], traction = 0;
        uz_bound_bernstein(phi, x->moments, q);
        for (int a = 0; a < x->moments; a++)
            traction += x->resultant[(i * x->moments + a) * 2 + k] * x->moments / area * phi[a];
        own += share * area * traction * traction /
               (2 * edge->spring[k] * (edge->weight[0] + q * (edge->weight[1] - edge->weight[0])));
    }
    for (int a = 0; a < x->moments; a++)
        work += x->resultant[(i * x->moments + a) * 2 + k] * m[a];
    x->out->dual -= own;
    x->springs += own + work; /* with 1/2 int k |u_h|^2 for the square */
    x->scale += own + fabs(work);
}

double uz_admit_pressure(const examination *x, int64_t moment, double pressure)
{
    return x->limit ? fmax(-x->limit[moment], fmin(x->limit[moment], pressure)) : fmax(0, pressure);
}

void uz_less_load(double *resultant, const examination *x, const uz_bound_edge *edge, int64_t i)
{
    const double each = uz_bound_measure(x->body, i) / x->moments;
    for (int a = 0; a < 2 * x->moments; a++)
        resultant[2 * i * x->moments + a] -= each * uz_bound_weight(x->body, i, a / 2) * edge->traction[a % 2];
}

/* A pressure that may not be is none: it is what is missing. */
void uz_examine_tractions(double missing[UZ_BOUND_MOMENTS][2], examination *x, const double *u, int64_t i)
{
    const uz_bound_edge *edge = &x->body->edge[i];
    double *pressure = x->pressure + i * x->moments, share[2], turned[UZ_BOUND_MOMENTS][2] = {{0}};
    if (edge->turns)
        uz_examine_turning(turned, x, u, i);
    for (int a = 0; a < x->moments; a++) {
        double acts[2], axis[2][2], normal[2]; /* acts: of the stress, along the axes of these moments */
        uz_bound_axes(axis, x->body, i, a);
        uz_bound_normal(normal, x->body, i, a);
        for (int k = 0; k < 2; k++) {
            acts[k] = axis[k][0] * x->resultant[(i * x->moments + a) * 2] +
                      axis[k][1] * x->resultant[(i * x->moments + a) * 2 + 1];
            share[k] = normal[0] * axis[k][0] + normal[1] * axis[k][1];
        }
        const bool pressed = !edge->turns && uz_bound_pressed(x->body, i, a) >= 0;
        if (pressed)
            pressure[a] = -acts[0];
        else if ((edge->contact >= 0 || edge->facing == UZ_BOUND_SLAVE) && !edge->held[0] &&
                 !edge->turns) /* nothing held: share[0] is 1 and share[1] is 0, but for rounding */
            pressure[a] = uz_admit_pressure(x, i * x->moments + a, -(acts[0] * share[0] + acts[1] * share[1]));
        else if (edge->contact >= 0 && !edge->held[1] && !edge->turns && fabs(share[1]) > 1e-9)
            pressure[a] = uz_admit_pressure(x, i * x->moments + a, -acts[1] / share[1]);
        for (int k = 0; k < 2; k++) /* of what is pressed until settle_motions nothing: the pressure is what acts */
            missing[a][k] =
                (k == 0 && pressed) || edge->spring[k] > 0
                    ? 0
                    : -pressure[a] * share[k] - acts[k] + turned[a][0] * axis[k][0] + turned[a][1] * axis[k][1];
    }
}

/* What the edge lacks of equilibrium, and what supports and obstacle do there. */
static void examine_edge(examination *x, const double *u, const int64_t *dof, int64_t i)
{
    uz_bound_check_result *out = x->out;
    const uz_bound_edge *edge = &x->body->edge[i];
    const double *pressure = x->pressure + i * x->moments;
    double b[3], m[UZ_BOUND_MOMENTS], missing[UZ_BOUND_MOMENTS][2];
    uz_examine_tractions(missing, x, u, i);
    for (int a = 0; a < x->moments; a++) {
        double axis[2][2];
        uz_bound_axes(axis, x->body, i, a);
        for (int k = 0; k < 2; k++) {
            const int64_t at = dof[(i * x->moments + a) * 2 + k];
            if (edge->held[k]) {
                out->dual -= missing[a][k] * edge->value[k];
                x->scale += fabs(missing[a][k] * edge->value[k]);
            } else if (at >= 0 || (k == 0 && uz_bound_pressed(x->body, i, a) >= 0)) {
                uz_along_edge(b, u, edge->node, axis[k]);
                uz_edge_means(m, b, x->moments);
                out->defect += missing[a][k] * m[a];
                if (at >= 0)
                    out->residual[at] = missing[a][k];
            }
        }
        if (edge->contact >= 0 && !edge->turns) {
            const double *gap = uz_bound_line(x->body, edge)->gap;
            out->dual -= pressure[a] * (gap[0] + (gap[1] - gap[0]) * (a + 1) / (x->moments + 1));
        }
    }
    for (int k = 0; k < 2; k++)
        examine_springs(x, u, i, k);
    double size = 0;
    for (int a = 0; a < 6; a++)
        size = edge->node[a / 2] < 0 ? size : fmax(size, fabs(u[2 * edge->node[a / 2] + a % 2]));
    for (int k = 0; k < 2; k++) { /* the bound is about displacements that keep to the supports */
        uz_along_edge(b, u, edge->node, edge->axis[k]);
        for (int a = 0; a < 3 && edge->held[k] && !*out->fault; a++)
            if (!(fabs(b[a] - edge->value[k]) <= 1e-12 * size))
                snprintf(out->fault, sizeof out->fault, "at a support the displacement is %.9e in place of %.9e", b[a],
                         edge->value[k]);
    }
    if (edge->contact >= 0 && !edge->turns)
        examine_contact(x, u, edge, pressure);
}

/* Before a round obstacle, or corners, what is not along the normal depends on what presses: such edges come after it
 * is settled. */
static bool holds_turning(const uz_bound_body *body, int64_t i)
{
    bool holds = false;
    for (int a = 0; a <= body->degree && body->edge[i].turns; a++)
        holds = holds || uz_bound_pressed(body, i, a) >= 0;
    return holds;
}

/* Rows of A by motions: what presses at the moments that hold them does on them, by columns, and last what is missing
 * of that. */
static void find_missing(double A[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE + 1], examination *x, const int64_t *dof)
{
    const uz_bound_body *body = x->body;
    for (int64_t i = 0; i < body->n_edges; i++)
        for (int a = 0; a < x->moments; a++) {
            double axis[2][2];
            uz_bound_axes(axis, body, i, a);
            for (int c = 0; c < 2; c++) {
                const int64_t at = dof[(i * x->moments + a) * 2 + c];
                for (int k = 0; k < body->n_loose && at >= 0; k++)
                    A[k][body->n_loose] -= x->out->residual[at] * uz_bound_moved(body, k, i, a, axis[c]);
            }
        }
    for (int64_t i = 0; i < body->n_edges; i++) {
        double missing[UZ_BOUND_MOMENTS][2];
        if (!holds_turning(body, i))
            continue;
        uz_missing_before(missing, x, i);
        for (int k = 0; k < body->n_loose; k++)
            A[k][body->n_loose] -= uz_bound_work_on(body, k, i, missing);
    }
    for (int held = 0; held < body->n_pressed; held++) {
        const int64_t i = body->pressed[held] / x->moments;
        double acts[UZ_BOUND_MOMENTS][2], one[UZ_BOUND_MOMENTS] = {0};
        one[body->pressed[held] % x->moments] = 1;
        uz_bound_acts(acts, body, i, one);
        for (int k = 0; k < body->n_loose; k++)
            A[k][held] = uz_bound_work_on(body, k, i, acts);
    }
}

/* A of n rows by its last column, by Gauss's elimination: out, n. */
static void solve_small(double out[UZ_BOUND_LOOSE], double A[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE + 1], int n)
{
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            best = fabs(A[i][k]) > fabs(A[best][k]) ? i : best;
        for (int j = 0; j <= n; j++) {
            const double swapped = A[k][j];
            A[k][j] = A[best][j];
            A[best][j] = swapped;
        }
        for (int i = 0; i < n; i++)
            for (int j = n; j >= k && i != k; j--)
                A[i][j] -= A[i][k] / A[k][k] * A[k][j];
    }
    for (int k = 0; k < n; k++)
        out[k] = A[k][n] / A[k][k];
}

static uz_status examine_edges(examination *x, const double *u, const int64_t *dof, uz_error *err)
{
    const uz_bound_body *body = x->body;
    for (int64_t i = 0; i < body->n_edges; i++)
        uz_less_load(x->resultant, x, &body->edge[i], i);
    for (int64_t i = 0; i < body->n_edges; i++)
        if (!holds_turning(body, i))
            examine_edge(x, u, dof, i);
    const uz_status status = uz_press_masters(x, u, dof, err);
    settle_motions(x, u, dof);
    for (int64_t i = 0; i < body->n_edges; i++)
        if (holds_turning(body, i))
            examine_edge(x, u, dof, i);
    return status;
}

/* What is missing of equilibrium does no work on motions that nothing but the obstacle holds: the pressures that hold
 * them are what they have to be for that, exactly. A displacement less the motion that it has at these moments has none
 * there, so that the norm of K^-1, with these held, is one over all displacements. */
static void settle_motions(examination *x, const double *u, const int64_t *dof)
{
    const uz_bound_body *body = x->body;
    double A[UZ_BOUND_LOOSE][UZ_BOUND_LOOSE + 1] = {{0}};
    if (body->n_loose == 0)
        return;
    find_missing(A, x, dof);
    solve_small(x->settled, A, body->n_loose);
    for (int k = 0; k < body->n_loose; k++) {
        const int64_t i = body->pressed[k] / x->moments;
        const int a = (int)(body->pressed[k] % x->moments);
        const uz_bound_edge *edge = &body->edge[i];
        const double missing = x->settled[k];
        double b[3], moved[UZ_BOUND_MOMENTS], none[2], *pressure = &x->pressure[body->pressed[k]];
        if (edge->turns)
            continue;
        const double gap = uz_bound_gap(none, body, i, (a + 1.) / (x->moments + 1));
        uz_along_edge(b, u, edge->node, uz_bound_line(body, edge)->normal);
        uz_edge_means(moved, b, x->moments);
        *pressure -= missing;
        x->out->dual += missing * gap;
        x->out->defect += missing * moved[a];
        x->out->gap -= missing * (gap - moved[a]);
        uz_look_at_holding(x, *pressure);
    }
}

void uz_look_at_holding(examination *x, double pressure)
{
    x->out->pulls = x->out->pulls || !(pressure >= 0);
    if (!*x->out->fault && x->out->pulls)
        snprintf(x->out->fault, sizeof x->out->fault, "the obstacle would have to pull at an edge that it holds");
}

/* ---- in an element */

/* With its own coordinates: those of equal boxes are one box's. */
void uz_take_element(uz_element *element, double xyz[3 * UZ_ELEMENT_NODES], const examination *x, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(x->mesh, e, &count);
    uz_body_element(element, xyz, x->body->model, e);
    for (int i = 0; i < count; i++)
        uz_bound_place(xyz + 2 * i, x->body, node[i]);
}

/* u less the rigid motion of the element's first node and of its middle, which no stress in equilibrium works on. */
static void less_motion(double v[2 * UZ_ELEMENT_NODES], const uz_element *element, int nodes)
{
    const double *xyz = element->xyz;
    double first[2] = {v[0], v[1]}, turn = 0, size = 0;
    for (int i = 0; i < 2 * nodes; i++)
        v[i] -= first[i % 2];
    for (int a = 1; a < nodes; a++) {
        const double dx = xyz[2 * a] - xyz[0], dy = xyz[2 * a + 1] - xyz[1];
        turn += dx * v[2 * a + 1] - dy * v[2 * a];
        size += dx * dx + dy * dy;
    }
    for (int a = 1; a < nodes; a++) {
        v[2 * a] += turn / size * (xyz[2 * a + 1] - xyz[1]);
        v[2 * a + 1] -= turn / size * (xyz[2 * a] - xyz[0]);
    }
}

static double expand_part(const examination *x, double corner[3][2], const double *s, double free_strain, int64_t e)
{
    const uz_lame lame = uz_element_material(x->body->model, e)->lame;
    const int points = x->moments == 2 ? 3 : 6;
    double sum = 0, expansion[3];
    uz_thermal_strain(expansion, x->body->model->kind, lame, free_strain);
    for (int i = points == 3 ? 0 : 3; i < points; i++)
        sum += uz_twice_area(corner) / 6 * x->body->depth * (s[3 * i] * expansion[0] + s[3 * i + 1] * expansion[1]);
    return sum;
}

double uz_twice_area(double corner[3][2])
{
    return (corner[1][0] - corner[0][0]) * (corner[2][1] - corner[0][1]) -
           (corner[1][1] - corner[0][1]) * (corner[2][0] - corner[0][0]);
}

void uz_triangle_slopes(double slope[3][2], double corner[3][2])
{
    for (int i = 0; i < 3; i++) {
        const double *p = corner[(i + 1) % 3], *q = corner[(i + 2) % 3];
        slope[i][0] = (p[1] - q[1]) / uz_twice_area(corner);
        slope[i][1] = (q[0] - p[0]) / uz_twice_area(corner);
    }
}

static double examine_part(double lacks[3][2], double *margin, const examination *x, double corner[3][2],
                           const double *s, int64_t e)
{
    static const double SIXTH[6][6] = {{6, -1, -1, 0, -4, 0},  {-1, 6, -1, 0, 0, -4},  {-1, -1, 6, -4, 0, 0},
                                       {0, 0, -4, 32, 16, 16}, {-4, 0, 0, 16, 32, 16}, {0, -4, 0, 16, 16, 32}};
    const uz_lame lame = uz_element_material(x->body->model, e)->lame;
    const int points = x->moments == 2 ? 3 : 6;
    const double volume = uz_twice_area(corner) / 2 * x->body->depth;
    double sum = 0, slope[3][2];
    (void)margin; /* it is exact */
    for (int i = 0; i < points; i++)
        for (int j = 0; j < points; j++) {
            const double *a = s + 3 * i, *b = s + 3 * j; /* a : C^-1 : b */
            const double product = ((a[0] - a[1]) * (b[0] - b[1]) / 2 + 2 * a[2] * b[2]) / (2 * lame.mu) +
                                   (a[0] + a[1]) * (b[0] + b[1]) / (4 * (lame.lambda + lame.mu));
            sum += volume / 2 * (points == 3 ? (i == j ? 2. : 1.) / 12 : SIXTH[i][j] / 180) * product;
        }
    uz_triangle_slopes(slope, corner);
    for (int at = 0; at < 3; at++) {
        lacks[at][0] = x->body->force[2 * e];
        lacks[at][1] = x->body->force[2 * e + 1];
        for (int i = 0; i < points; i++) {
            double grad[2] = {0};
            for (int c = 0; c < 2; c++)
                grad[c] =
                    points == 3 ? slope[i][c]
                    : i < 3
                        ? (i == at ? 3 : -1) * slope[i][c]
                        : 4 * ((at == i - 3 ? slope[(i + 1) % 3][c] : 0) + (at == (i + 1) % 3 ? slope[i - 3][c] : 0));
            lacks[at][0] += grad[0] * s[3 * i] + grad[1] * s[3 * i + 2];
            lacks[at][1] += grad[0] * s[3 * i + 2] + grad[1] * s[3 * i + 1];
        }
    }
    return sum;
}

/* Bernstein coefficients of the traction along a straight side of a part, times the side's length over the number of
 * moments: from its corner `from` to the next. */
static void tractions(double t[UZ_BOUND_MOMENTS][2], const examination *x, double corner[3][2], const double *s,
                      int from)
{
    const int to = (from + 1) % 3;
    const double way[2] = {corner[to][0] - corner[from][0], corner[to][1] - corner[from][1]};
    const double times = x->body->depth / x->moments;
    for (int c = 0; c < 2; c++) {
        double at[3];
        for (int a = 0; a < 3; a++) {
            const double *here = s + 3 * (a == 0 ? from : a == 1 ? to : 3 + from);
            at[a] = times * (c == 0 ? here[0] * way[1] - here[2] * way[0] : here[2] * way[1] - here[1] * way[0]);
        }
        t[0][c] = at[0];
        t[x->moments - 1][c] = at[1];
        if (x->moments == 3)
            t[1][c] = 2 * at[2] - (at[0] + at[1]) / 2;
    }
}

/* The force's work on a displacement of the nodes: polynomials that all rules integrate. */
static double force_work(const examination *x, const uz_element *element, const double *v, int64_t e)
{
    const uz_gauss_rule *rule = uz_element_rule(element->kind, element->model);
    const int nodes = uz_element_type_of(element->kind)->nodes;
    double work = 0;
    for (int g = 0; g < rule->count; g++) {
        double grad[UZ_ELEMENT_NODES][3], N[UZ_ELEMENT_NODES], radius = x->body->rings ? 0 : 1;
        const double *point = rule->point[g].at;
        uz_element_shape(N, element->kind, point);
        for (int i = 0; i < nodes; i++)
            radius += x->body->rings ? N[i] * element->xyz[2 * i] : 0;
        const double volume =
            rule->point[g].weight * uz_element_gradients(grad, element, point) * x->body->depth * radius;
        for (int i = 0; i < 2 * nodes; i++)
            work += volume * N[i / 2] * v[i] * x->body->force[2 * e + i % 2];
    }
    return work;
}

void uz_examine_element(examination *x, const double *u, const double *stress, int64_t e)
{
    uz_element element;
    int count;
    const int64_t *node = uz_mesh_element(x->mesh, e, &count);
    const uz_check_of *of = check_of(x);
    double xyz[3 * UZ_ELEMENT_NODES], v[2 * UZ_ELEMENT_NODES] = {0}, centre[2], size = 0, widest = 1;
    double work = 0, complementary = 0, margin = 0, own_margin = 0, inner[UZ_BOUND_PARTS][2][UZ_BOUND_MOMENTS][2];
    double corner[UZ_BOUND_PARTS][3][2];
    uz_take_element(&element, xyz, x, e);
    const int parts = uz_element_type_of(element.kind)->corners;
    for (int i = 0; i < 2 * count; i++)
        v[i] = u[2 * node[i / 2] + i % 2];
    of->less_motion(v, &element, count);
    uz_bound_centre(centre, x->body, e);
    for (int k = 0; k < parts; k++) {
        memcpy(corner[k][0], xyz + 2 * k, sizeof corner[k][0]);
        memcpy(corner[k][1], xyz + 2 * ((k + 1) % parts), sizeof corner[k][1]);
        memcpy(corner[k][2], centre, sizeof corner[k][2]);
        size += uz_twice_area(corner[k]) / 2;
        widest = x->body->rings ? fmax(k == 0 ? 0 : widest, xyz[2 * k]) : 1;
    }
    size = sqrt(size);
    double largest = size * widest * hypot(x->body->force[2 * e], x->body->force[2 * e + 1]);
    for (int i = 0; i < STRESSES; i++)
        largest = fmax(largest, fabs(stress[i]));
    if (x->body->rings && !*x->out->fault && !uz_is_finite_at_axis(x, u, stress, e))
        snprintf(x->out->fault, sizeof x->out->fault, "on the axis there is a stress without a finite energy");
    for (int k = 0; k < parts; k++) {
        const int next = (k + 1) % parts;
        double lacks[3][2];
        const double *s = stress + k * UZ_BOUND_POINTS * 3;
        const int64_t local[3] = {k, next, count > parts ? parts + k : -1}, at = x->body->edge_of[4 * e + k];
        const bool reversed = x->body->edge[at].node[0] != node[k];
        double t[UZ_BOUND_MOMENTS][2], b[3], m[UZ_BOUND_MOMENTS];
        complementary += of->part(lacks, &own_margin, x, corner[k], s, e);
        if (x->body->free_strain)
            complementary += of->expansion(x, corner[k], s, x->body->free_strain[e], e);
        for (int a = 0; a < 3; a++) {
            const double off = size * hypot(lacks[a][0], lacks[a][1]);
            x->inside = off > 0 ? fmax(x->inside, off / fmax(largest, DBL_MIN)) : x->inside;
        }
        tractions(t, x, corner[k], s, 0);
        tractions(inner[next][0], x, corner[k], s, 1);
        tractions(inner[k][1], x, corner[k], s, 2);
        for (int c = 0; c < 2; c++) {
            uz_along_edge(b, v, local, (const double[2]){c == 0, c == 1});
            uz_edge_means(m, b, x->moments);
            for (int a = 0; a < x->moments; a++) {
                work += t[a][c] * m[a];
                x->resultant[(at * x->moments + (reversed ? x->moments - 1 - a : a)) * 2 + c] += t[a][c];
            }
        }
    }
    for (int k = 0; k < parts; k++) /* across the edges between the parts, in both directions */
        for (int a = 0; a < x->moments; a++)
            for (int c = 0; c < 2; c++) {
                const double jump = fabs(inner[k][0][a][c] + inner[k][1][x->moments - 1 - a][c]);
                x->inside =
                    jump > 0 ? fmax(x->inside, jump / fmax(largest * size * x->body->depth, DBL_MIN)) : x->inside;
            }
    work += force_work(x, &element, v, e);
    const double strain = uz_energy_of(&margin, x, u, true, e);
    x->gap[e] = margin + own_margin + fmax(0, strain + complementary - work) +
                UZ_SUM_ROUNDING * (strain + fabs(complementary) + fabs(work));
    x->sum += strain + complementary - work;
    x->margin += margin;
    x->own_margin += own_margin;
    x->scale += strain + fabs(complementary) + fabs(work);
    x->strain += strain;
    x->complementary += complementary;
}

/* Strain energy of the displacement between its nodes, whatever the formulation of the answer. On quadrilaterals that
 * are no parallelograms the integrand has det J below the line: analytic in each coordinate but for a pole at z > 1, so
 * that n points are off by some q^2n, q = 1 / (z + sqrt(z^2 - 1)), a bound on which is the margin. */
static double energy_of(double *margin, const examination *x, const double *u, double free_strain, int64_t e)
{
    const uz_body_model *model = x->body->model;
    uz_element element;
    int count;
    const int64_t *node = uz_mesh_element(x->mesh, e, &count);
    double xyz[3 * UZ_ELEMENT_NODES], expansion[3], at[UZ_GAUSS_MOST], weight[UZ_GAUSS_MOST], sum = 0, off = 0;
    uz_take_element(&element, xyz, x, e);
    uz_thermal_strain(expansion, model->kind, element.lame, free_strain);
    const uz_gauss_rule own = uz_element_type_of(UZ_TRI6)->rule;
    const bool triangle = uz_element_type_of(element.kind)->corners == 3;
    int n = count > 4 ? 3 : 2;
    if (!triangle) { /* det J = a + b xi + c eta: its pole in one coordinate, at worst in the other */
        const double *p = xyz, a[2] = {p[2] + p[4] - p[0] - p[6], p[3] + p[5] - p[1] - p[7]};
        const double b[2] = {p[4] + p[6] - p[0] - p[2], p[5] + p[7] - p[1] - p[3]};
        const double c[2] = {p[0] + p[4] - p[2] - p[6], p[1] + p[5] - p[3] - p[7]};
        const double middle = a[0] * b[1] - a[1] * b[0], by_xi = fabs(a[0] * c[1] - a[1] * c[0]),
                     by_eta = fabs(c[0] * b[1] - c[1] * b[0]), steepest = fmax(by_xi, by_eta);
        if (steepest > 1e-14 * middle) {
            const double z = (middle - fmin(by_xi, by_eta)) / steepest, q = 1 / (z + sqrt(fmax(0, z * z - 1)));
            n = uz_gauss_points(n, 1, q, 1e-15);
            off = 16 * pow(q, 2 * n - 6);
        }
        uz_gauss(at, weight, n);
    }
    for (int g = 0; g < (triangle ? own.count : n * n); g++) {
        double point[3] = {0}, grad[UZ_ELEMENT_NODES][3], strain[3] = {-expansion[0], -expansion[1], 0}, w;
        if (triangle) {
            memcpy(point, own.point[g].at, sizeof point);
            w = own.point[g].weight;
        } else {
            point[0] = at[g % n];
            point[1] = at[g / n];
            w = weight[g % n] * weight[g / n];
        }
        w *= uz_element_gradients(grad, &element, point) * x->body->depth;
        for (int a = 0; a < count; a++) {
            const double ux = u[2 * node[a]] - u[2 * node[0]], uy = u[2 * node[a] + 1] - u[2 * node[0] + 1];
            strain[0] += grad[a][0] * ux;
            strain[1] += grad[a][1] * uy;
            strain[2] += grad[a][1] * ux + grad[a][0] * uy;
        }
        const double trace = strain[0] + strain[1], half = strain[0] - strain[1];
        sum += w *
               ((element.lame.lambda + element.lame.mu) * trace * trace +
                element.lame.mu * (half * half + strain[2] * strain[2])) /
               2;
    }
    *margin += off * sum;
    return sum;
}

static const uz_check_of check_of_planes = {examine_part, expand_part, energy_of, less_motion};

static const uz_check_of *check_of(const examination *x)
{
    return x->body->rings ? &uz_check_of_rings : &check_of_planes;
}

double uz_energy_of(double *margin, const examination *x, const double *u, bool with_expansion, int64_t e)
{
    int count;
    const int64_t *node = uz_mesh_element(x->mesh, e, &count);
    const double free_strain = x->body->free_strain && with_expansion ? x->body->free_strain[e] : 0;
    bool zero = !(fabs(free_strain) > 0);
    for (int i = 0; i < 2 * count && zero; i++)
        zero = !(fabs(u[2 * node[i / 2] + i % 2]) > 0);
    return zero ? 0 : check_of(x)->energy(margin, x, u, free_strain, e);
}

double uz_expansion_work(const examination *x, double corner[3][2], const double *s, double free_strain, int64_t e)
{
    return check_of(x)->expansion(x, corner, s, free_strain, e);
}

/* Of the loads but temperature, as the discrete problem has them: the edges have to agree with that. */
double uz_work_of_loads(const examination *x, const uz_scene *scene, const double *u, uz_status *status, uz_error *err)
{
    double work = 0, *f = uz_alloc(2 * x->mesh->n_nodes, sizeof *f);
    *status = f ? uz_bound_loads(f, x->body->model, scene, err)
                : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the loads of %lld nodes", (long long)x->mesh->n_nodes);
    for (int64_t i = 0; i < 2 * x->mesh->n_nodes && *status == UZ_OK; i++)
        work += f[i] * u[i];
    free(f);
    return work;
}

uz_status uz_bound_loads(double *f, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_scene loaded = *scene;
    loaded.loads = uz_alloc(scene->n_loads, sizeof *loaded.loads);
    loaded.n_loads = 0;
    if (!loaded.loads)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld loads", (long long)scene->n_loads);
    for (int64_t i = 0; i < scene->n_loads; i++)
        if (scene->loads[i].kind != UZ_LOAD_TEMPERATURE)
            loaded.loads[loaded.n_loads++] = scene->loads[i];
    const uz_status status = uz_nodal_loads(f, model, &loaded, err);
    free(loaded.loads);
    return status;
}
