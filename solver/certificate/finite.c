/* finite.c: the certificate of a nonlinear answer: equilibrium, stability, gaps, signs, orientation. */
#include "certificate/finite.h"

#include "assembly/parts.h"
#include "certificate/envelope.h"
#include "certificate/piola.h"
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"
#include "obstacle/obstacle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Points of each side, between its ends, at which gaps are looked at. */
enum { SAMPLES = 7 };

/* A row is pressed where its reaction is more than this part of the largest. */
#define PRESSED 1e-12
/* Pivots that are less than this part of the stiffness of their dof may be zero. */
#define LEAST_PIVOT 1e-11
/* Stiffness along pressed rows, in those of the stiffest dof: only where motions that leave the rows closed are stable
 * is H positive definite, however large it is, and where they are it is from some size on. */
static const double ALONG[] = {1e2, 1e5};
/* A strain that is rounding: F is about 1, and known to its last digits. */
#define ROUNDING 2e-14
#define TINY     1e-7

typedef struct {
    const uz_finite_answer *of;
    uz_body_model tangent;           /* borrows all but K's and K_fixed's values */
    long double *force;              /* n_nodes x 2: internal */
    double *f, *room, *size;         /* d */
    long double energy, small, unit; /* small: of small strain; unit: of a strain of 1 */
} work;

/* ---- elements */

/* A point of an element: around is N / r of rings, else 0. */
typedef struct {
    double grad[UZ_ELEMENT_NODES][3], around[UZ_ELEMENT_NODES];
    long double F[5]; /* in the plane by rows, then across it */
    int nodes;
    bool ring;
} point_at;

static void add_point(long double *force, double *ke, long double weight, const point_at *x, const uz_piola *at)
{
    for (int a = 0; a < x->nodes; a++)
        for (int i = 0; i < 2; i++) {
            force[2 * a + i] += weight * (at->P[2 * i] * x->grad[a][0] + at->P[2 * i + 1] * x->grad[a][1]);
            for (int b = 0; b < x->nodes; b++)
                for (int k = 0; k < 2; k++) {
                    long double sum = 0;
                    for (int J = 0; J < 2; J++)
                        for (int L = 0; L < 2; L++)
                            sum += at->A[2 * i + J][2 * k + L] * x->grad[a][J] * x->grad[b][L];
                    ke[(2 * a + i) * 2 * x->nodes + 2 * b + k] += (double)(weight * sum);
                }
        }
}

/* What the stretch around a ring adds: to forces along the radius, and to the tangent with all others. */
static void add_hoop(long double *force, double *ke, long double weight, const point_at *x, const uz_piola *at)
{
    const int n = 2 * x->nodes;
    for (int a = 0; a < x->nodes; a++) {
        force[2 * a] += weight * at->P[4] * x->around[a];
        for (int b = 0; b < x->nodes; b++) {
            ke[2 * a * n + 2 * b] += (double)(weight * at->A[4][4] * x->around[a] * x->around[b]);
            for (int k = 0; k < 2; k++) {
                const double with = (double)(weight * x->around[a] *
                                             (at->A[4][2 * k] * x->grad[b][0] + at->A[4][2 * k + 1] * x->grad[b][1]));
                ke[2 * a * n + 2 * b + k] += with;
                ke[(2 * b + k) * n + 2 * a] += with;
            }
        }
    }
}

/* Returns the least of what must be positive: the determinant in the plane, and the stretch across it. */
static long double deform(point_at *x, double *measure, const uz_element *element, const double *u,
                          const double local[3])
{
    x->nodes = uz_element_node_count(element->kind);
    x->ring = element->model == UZ_AXISYMMETRIC;
    *measure = uz_element_gradients(x->grad, element, local);
    *measure *= uz_element_around(x->around, element, x->grad, local);
    for (int i = 0; i < 4; i++) {
        x->F[i] = i % 3 == 0;
        for (int a = 0; a < x->nodes; a++)
            x->F[i] += ((long double)u[2 * a + i / 2] - u[i / 2]) * x->grad[a][i % 2];
    }
    x->F[4] = 1;
    for (int a = 0; a < x->nodes && x->ring; a++)
        x->F[4] += (long double)u[2 * a] * x->around[a];
    const long double plane = x->F[0] * x->F[3] - x->F[1] * x->F[2];
    return x->F[4] > 0 ? plane * x->F[4] : -fabsl(plane * x->F[4]);
}

/* What the energy is compared with: that of a strain of 1, where displacements and F are as large as they are; and the
 * energy of small strain, rotations apart, as that of the law is lost in its own terms where strains are tiny. */
static void add_unit(work *w, long double weight, const uz_lame *lame, const point_at *x, const double *u)
{
    const long double *F = x->F, H[4] = {F[0] - 1, F[1], F[2], F[3] - 1}, z = F[4] - 1;
    const long double E[4] = {H[0] + (H[0] * H[0] + H[2] * H[2]) / 2, H[3] + (H[1] * H[1] + H[3] * H[3]) / 2,
                              (H[1] + H[2] + H[0] * H[1] + H[2] * H[3]) / 2, z + z * z / 2};
    const long double trace = E[0] + E[1] + E[3];
    double turn = 0;
    for (int a = 0; a < x->nodes; a++)
        turn = fmax(turn, hypot(u[2 * a], u[2 * a + 1]) * hypot(x->grad[a][0], x->grad[a][1]));
    w->unit += weight * (lame->lambda + 2 * lame->mu) *
               ((F[0] * F[0] + F[1] * F[1] + F[2] * F[2] + F[3] * F[3] + (x->ring ? F[4] * F[4] : 0)) / 2 +
                (long double)turn * turn);
    w->small += weight * (lame->lambda * trace * trace / 2 +
                          lame->mu * (E[0] * E[0] + E[1] * E[1] + 2 * E[2] * E[2] + E[3] * E[3]));
}

static void add_element(uz_finite_certificate *out, work *w, int64_t e)
{
    const uz_body_model *model = w->of->model;
    double xyz[3 * UZ_ELEMENT_NODES], u[2 * UZ_ELEMENT_NODES], ke[UZ_ELEMENT_DOFS * UZ_ELEMENT_DOFS] = {0}, measure;
    long double force[2 * UZ_ELEMENT_NODES] = {0};
    uz_element element;
    point_at x;
    uz_piola at;
    int nodes;
    const int64_t *node = uz_mesh_element(&model->mesh, e, &nodes);
    uz_body_element(&element, xyz, model, e);
    const uz_element_type *type = uz_element_type_of(element.kind);
    const uz_gauss_rule *rule = uz_element_rule(element.kind, element.model);
    for (int i = 0; i < 2 * nodes; i++)
        u[i] = w->of->u[2 * node[i / 2] + i % 2];
    for (int a = 0; a < type->corners; a++)
        out->least_det = fmin(out->least_det, (double)deform(&x, &measure, &element, u, type->local[a]));
    for (int g = 0; g < rule->count; g++) {
        const long double det = deform(&x, &measure, &element, u, rule->point[g].at);
        const long double weight = (long double)rule->point[g].weight * measure;
        out->least_det = isnan(det) ? -INFINITY : fmin(out->least_det, (double)det);
        if (!(det > 0))
            continue;
        uz_piola_at(&at, uz_element_material(model, e)->law, element.lame.lambda, element.lame.mu, x.F);
        w->energy += weight * at.W;
        add_unit(w, weight, &element.lame, &x, u);
        add_point(force, ke, weight, &x, &at);
        if (x.ring)
            add_hoop(force, ke, weight, &x, &at);
    }
    for (int i = 0; i < 2 * nodes; i++)
        w->force[2 * node[i / 2] + i % 2] += force[i];
    uz_add_stiffness(&w->tangent, ke, node, nodes);
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

/* Second derivatives of the gap of a place of the material, whose shares of nodes stay: with t along the obstacle and k
 * its curvature they are k N_a N_b t t'. */
static void place_curvature(double ke[], const double n[2], double k, const double *share, int nodes)
{
    const double t[2] = {-n[1], n[0]};
    for (int p = 0; p < 2 * nodes; p++)
        for (int q = 0; q < 2 * nodes; q++)
            ke[p * 2 * nodes + q] = k * share[p / 2] * t[p % 2] * share[q / 2] * t[q % 2];
}

/* What the obstacle's curvature does to the stiffness: the Lagrangian has r g. The edges of lines and tables are none:
 * rows take them as rounded. */
static uz_status add_curvature(work *w, uz_obstacle *const *obstacle, double most, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    uz_status status = UZ_OK;
    for (int64_t row = 0; row < model->m && status == UZ_OK; row++) {
        const double *share, *normal = model->info.contact_normal + 2 * row;
        const int64_t *node;
        double x[2] = {0}, ke[4 * UZ_FACE_NODES * UZ_FACE_NODES];
        uz_gap at;
        if (!(w->of->r[row] < -PRESSED * most) || model->sites[model->info.contact_of[row]].n == 0)
            continue;
        const int n = row_nodes(&node, &share, model, row);
        for (int a = 0; a < n; a++)
            for (int c = 0; c < 2; c++)
                x[c] += share[a] * (model->mesh.xyz[2 * node[a] + c] + w->of->u[2 * node[a] + c]);
        status = uz_obstacle_gap(&at, obstacle[model->info.contact_of[row]], x, err);
        if (status != UZ_OK || uz_obstacle_has_edges(obstacle[model->info.contact_of[row]]))
            continue;
        place_curvature(ke, normal, at.curvature, share, n);
        for (int p = 0; p < 4 * n * n; p++)
            ke[p] *= w->of->r[row];
        uz_add_stiffness(&w->tangent, ke, node, n);
    }
    return status;
}

/* Stiffness along the pressed rows, times `factor` more than there is already. */
static uz_status add_along(work *w, double factor, double most, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    uz_csc *K = &w->tangent.K, rows = {0};
    const uz_status status = uz_csc_transpose(&rows, &model->N, err);
    for (int64_t row = 0; row < model->m && status == UZ_OK; row++)
        for (int64_t p = rows.ptr[row]; p < rows.ptr[row + 1] && w->of->r[row] < -PRESSED * most; p++)
            for (int64_t q = rows.ptr[row]; q <= p; q++) {
                const int64_t at = uz_csc_find(K, rows.idx[p], rows.idx[q]);
                if (at >= 0)
                    K->val[at] += factor * rows.val[p] * rows.val[q];
            }
    uz_csc_clear(&rows);
    return status;
}

/* One side: its ends and points between them. */
static uz_status look_at_side(uz_finite_certificate *out, const uz_finite_answer *of, uz_face face,
                              const uz_obstacle *obstacle, uz_error *err)
{
    uz_side side;
    double xyz[3 * UZ_FACE_NODES], N[UZ_FACE_NODES];
    int64_t node[UZ_FACE_NODES];
    uz_status status = UZ_OK;
    uz_body_side(&side, xyz, node, of->model, face);
    for (int a = 0; a < side.nodes; a++)
        for (int c = 0; c < 2; c++)
            xyz[2 * a + c] += of->u[2 * node[a] + c];
    const double length = hypot(xyz[2] - xyz[0], xyz[3] - xyz[1]);
    for (int k = 0; k <= SAMPLES + 1 && status == UZ_OK; k++) {
        const double point[2] = {-1 + 2.0 * k / (SAMPLES + 1), 0};
        double x[2] = {0};
        uz_gap at;
        uz_side_shape(N, &side, point);
        for (int a = 0; a < side.nodes; a++)
            for (int c = 0; c < 2; c++)
                x[c] += N[a] * xyz[2 * a + c];
        status = uz_obstacle_gap(&at, obstacle, x, err);
        if (status != UZ_OK)
            continue;
        out->least_gap = fmin(out->least_gap, at.gap);
        out->least_part = fmin(out->least_part, length > 0 ? at.gap / length : -(double)INFINITY);
    }
    return status;
}

/* Reactions, gaps at rows and between them, and what curvature adds to the tangent. */
static uz_status look_at_contacts(uz_finite_certificate *out, work *w, double most, uz_error *err)
{
    const uz_finite_answer *of = w->of;
    const int64_t n = of->scene->n_contacts;
    uz_obstacle **obstacle = uz_alloc_zero(n, sizeof *obstacle);
    uz_status status = obstacle ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the obstacles");
    for (int64_t k = 0; k < n && status == UZ_OK; k++) {
        const uz_group *group = uz_mesh_group(&of->model->mesh, of->scene->contacts[k].on, "/contacts", err);
        status =
            group ? uz_obstacle_new(&obstacle[k], &of->scene->contacts[k], k, of->scene->model, err) : UZ_ERR_SCENE;
        for (int64_t i = 0; status == UZ_OK && i < group->n_faces; i++)
            status = look_at_side(out, of, group->face[i], obstacle[k], err);
    }
    if (status == UZ_OK)
        status = add_curvature(w, obstacle, most, err);
    for (int64_t k = 0; k < n && obstacle; k++)
        uz_obstacle_free(obstacle[k]);
    free(obstacle);
    for (int64_t i = 0; i < of->model->m; i++) {
        out->least_at_rows = fmin(out->least_at_rows, of->g[i]);
        out->worst_reaction = fmax(out->worst_reaction, most > 0 ? of->r[i] / most : of->r[i]);
    }
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
    w->force = uz_alloc_zero(2 * model->mesh.n_nodes, sizeof *w->force);
    w->f = uz_alloc_zero(model->d, sizeof *w->f);
    w->room = uz_alloc(model->d, sizeof *w->room);
    w->size = uz_alloc(model->d, sizeof *w->size);
    return w->tangent.K.val && w->tangent.K_fixed.val && w->force && w->f && w->room && w->size;
}

/* f: loads less internal forces, along free dofs, with the reactions of the rows. */
static uz_status leave_over(work *w, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const int64_t n = 2 * model->mesh.n_nodes;
    double *nodal = uz_alloc(n, sizeof *nodal);
    if (!nodal)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces on %lld nodes", (long long)(n / 2));
    const uz_status status = uz_nodal_loads(nodal, model, w->of->scene, err);
    for (int64_t i = 0; i < n && status == UZ_OK; i++)
        nodal[i] = (double)(nodal[i] - w->force[i]);
    if (status == UZ_OK) {
        uz_gather_nodal(w->f, model, nodal);
        uz_csc_gaxpy_t(w->f, &model->N, 1, w->of->r);
    }
    free(nodal);
    return status;
}

/* The factor of H, and with it the residual. */
static uz_status judge(uz_finite_certificate *out, work *w, double most, uz_error *err)
{
    const uz_body_model *model = w->of->model;
    const uz_csc *K = &w->tangent.K;
    uz_status status = UZ_OK;
    double stiffest = 0, work_left = 0, square = 0, there = 0;
    for (int64_t j = 0; j < model->d; j++) {
        w->size[j] = fabs(K->val[K->ptr[j]]);
        stiffest = fmax(stiffest, w->size[j]);
    }
    for (size_t k = 0; k < sizeof ALONG / sizeof ALONG[0] && status == UZ_OK && !out->definite; k++) {
        uz_envelope factor = {0};
        status = add_along(w, ALONG[k] * stiffest - there, most, err);
        there = ALONG[k] * stiffest;
        if (status == UZ_OK)
            status = uz_envelope_factor(&factor, &out->definite, K, w->size, LEAST_PIVOT, err);
        if (status == UZ_OK && out->definite) {
            for (int64_t j = 0; j < model->d; j++) /* the step also closes the pressed rows */
                for (int64_t q = model->N.ptr[j]; q < model->N.ptr[j + 1]; q++)
                    if (w->of->r[model->N.idx[q]] < -PRESSED * most)
                        w->f[j] += there * model->N.val[q] * w->of->g[model->N.idx[q]];
            uz_envelope_forward(w->f, &factor, w->room);
        }
        uz_envelope_clear(&factor);
    }
    for (int64_t j = 0; j < model->d; j++)
        square += w->f[j] * w->f[j];
    for (int64_t i = 0; i < model->m; i++)
        work_left += w->of->r[i] < -PRESSED * most ? 0 : fabs(w->of->r[i] * w->of->g[i]);
    const double tiny = TINY * TINY * (double)w->unit, energy = out->energy > tiny ? out->energy : (double)w->small;
    const double left = sqrt(square + 2 * work_left), norm = sqrt(2 * energy);
    const double rounding = ROUNDING * sqrt((double)w->unit);
    out->rounding = norm > 0 ? rounding / norm : (double)INFINITY;
    if (out->definite) /* what is not strained is exact to rounding */
        out->residual = left <= rounding && norm <= rounding ? 0 : norm > 0 ? left / norm : (double)INFINITY;
    return status;
}

uz_status uz_certify_finite(uz_finite_certificate *out, const uz_finite_answer *answer, uz_error *err)
{
    const uz_body_model *model = answer->model;
    work w = {.of = answer};
    double most = 0;
    *out = (uz_finite_certificate){.least_det = INFINITY,
                                   .residual = INFINITY,
                                   .least_gap = INFINITY,
                                   .least_part = INFINITY,
                                   .least_at_rows = INFINITY};
    uz_status status =
        begin(&w) ? UZ_OK
                  : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the tangent of %lld dofs", (long long)model->d);
    for (int64_t i = 0; i < model->m; i++)
        most = fmax(most, fabs(answer->r[i]));
    for (int64_t i = 0; i < 2 * model->mesh.n_nodes && status == UZ_OK; i++) {
        const double *u = answer->u + 2 * (i / 2);
        if (model->dof[i] < 0)
            out->worst_support = fmax(out->worst_support, fabs(uz_along_dof(model, i / 2, (int)(i % 2), u) -
                                                               answer->prescribed[-1 - model->dof[i]]));
    }
    for (int64_t e = 0; e < model->mesh.n_elements && status == UZ_OK; e++)
        add_element(out, &w, e);
    out->energy = (double)w.energy;
    if (status == UZ_OK)
        status = look_at_contacts(out, &w, most, err);
    if (status == UZ_OK && out->least_det > 0)
        status = leave_over(&w, err);
    if (status == UZ_OK && out->least_det > 0)
        status = judge(out, &w, most, err);
    free(w.tangent.K.val);
    free(w.tangent.K_fixed.val);
    free(w.force);
    free(w.f);
    free(w.room);
    free(w.size);
    return status;
}
