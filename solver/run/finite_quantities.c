/* finite_quantities.c: quantities of an answer of large deformation.
 *
 * The tangent K at the answer, with what curved obstacles, rows between bodies and pressures add to it, takes the place
 * of the stiffness in run/quantities.c: adjoints are solved on it, and strains of Green and Lagrange are compared with
 * their means (finite/mesh_error.h). Rows in contact are held as equations by the method of multipliers (M. Hestenes,
 * "Multiplier and gradient methods", J. Optim. Theory Appl. 4 (1969) 303-320; M. Powell, same year): with stiffness
 * `hold` along them, in K for all adjoints, each solve takes y += hold (gap - N w). What of K is skew, as of pressures
 * that follow the body, is added at the last w, transposed. */
#include "run/finite.h"

#include "core/alloc.h"
#include "core/error.h"
#include "finite/mesh_error.h"
#include "linalg/blas.h"
#include "post/evaluate.h"
#include "run/quantities.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Solves of an adjoint, and the change, in parts of it, at which they end. */
enum { MOST_SOLVES = 30 };
#define SOLVED 1e-8
/* Stiffness along rows in contact, in that of the stiffest dof: as the certificate has it. */
static const double ALONG[] = {1e2, 1e5};
/* The second derivative of the energy is taken over such a part of the body's size. */
#define STEP 1e-6

typedef struct {
    uz_finite_run *run;
    double hold;
    double *w, *last, *nodal; /* d, d, 2 n */
    double *t, *g;            /* m */
} tangent;

/* w = K^-1 p. UZ_ERR_NOT_SPD and *solved false: K is not positive definite. */
static uz_status solve_once(bool *solved, tangent *x, double *w, uz_error *err)
{
    uz_finite_run *run = x->run;
    const uz_qp linear = {.K = *run->K, .p = run->p};
    uz_result *result = NULL;
    uz_error own = {0};
    uz_status status = uz_finite_solve(&result, run, &linear, run->r, run->n_r, &own);
    *solved = status == UZ_OK && uz_finite_is_solved(result);
    if (*solved)
        memcpy(w, result->u, (size_t)run->d * sizeof *w);
    uz_result_free(result);
    if (status == UZ_ERR_NOT_SPD || status == UZ_ERR_FREE_BODY)
        return UZ_OK;
    if (status != UZ_OK && err)
        *err = own;
    return status;
}

static uz_status solve(void *of, bool *solved, double *w, double *y, const bool *pressing,
                       const uz_functional *functional, uz_error *err)
{
    tangent *x = of;
    uz_finite_run *run = x->run;
    const uz_body_model *rows = &run->at.rows;
    const int64_t d = run->d, m = rows->m;
    uz_status status = UZ_OK;
    bool settled = false, known = true;
    memset(y, 0, (size_t)m * sizeof *y);
    memset(x->last, 0, (size_t)d * sizeof *x->last);
    for (int k = 0; k < MOST_SOLVES && status == UZ_OK && known && !settled; k++) {
        double change = 0;
        uz_gather_nodal(run->p, rows, functional->load);
        uz_csc_gaxpy(run->p, &run->tangent.K_fixed, -1, functional->held);
        for (int64_t i = 0; i < m; i++)
            x->t[i] = pressing[i] ? y[i] + x->hold * functional->gap[i] : 0;
        uz_csc_gaxpy_t(run->p, &rows->N, 1, x->t);
        if (k > 0) /* transposed */
            uz_finite_add_skew(run, -1, x->last, x->nodal);
        status = solve_once(&known, x, w, err);
        if (status != UZ_OK || !known)
            break;
        memcpy(x->g, functional->gap, (size_t)m * sizeof *x->g);
        uz_csc_gaxpy(x->g, &rows->N, -1, w);
        for (int64_t i = 0; i < m; i++)
            y[i] += pressing[i] ? x->hold * x->g[i] : 0;
        for (int64_t j = 0; j < d; j++) {
            change = hypot(change, w[j] - x->last[j]);
            x->last[j] = w[j];
        }
        settled = (m == 0 && !run->skew.ptr) || change <= SOLVED * uz_norm(d, w);
    }
    *solved = settled;
    return status;
}

static uz_status energy_of(void *of, double *energy, const double *v, uz_error *err)
{
    const tangent *x = of;
    const uz_finite_run *run = x->run;
    const uz_body_model *base = &run->base;
    double most = 0, sum = 0;
    double *room = uz_alloc(2 * run->n, sizeof *room);
    *energy = 0;
    if (!room)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces on %lld nodes", (long long)base->mesh.n_nodes);
    for (int64_t i = 0; i < run->n; i++)
        most = fmax(most, fabs(v[i]));
    const double step = most > 0 ? STEP * base->mesh.extent / most : 0;
    for (int k = 0; k < 2 && step > 0; k++) {
        uz_finite_measure body;
        for (int64_t i = 0; i < run->n; i++)
            room[i] = run->at.u[i] + (k == 0 ? step : -step) * v[i];
        uz_finite_body(&body, room + run->n, NULL, base, run->free_strain, room, NULL);
        const double work = uz_dot(run->n, room + run->n, v);
        sum += (k == 0 ? work : -work) / (2 * step);
    }
    free(room);
    *energy = isfinite(sum) ? 0.5 * fabs(sum) : 0;
    return UZ_OK;
}

static uz_status errors_of(void *of, double *energy, double *eta2, const double *z, double own, double times,
                           uz_error *err)
{
    const tangent *x = of;
    const uz_finite_run *run = x->run;
    return uz_finite_error_energy(energy, eta2, &run->base, run->free_strain, run->at.u, z, own, times, err);
}

/* K, with the least hold that it is positive definite with. *known: there is one. */
static uz_status prepare(bool *known, tangent *x, uz_error *err)
{
    uz_finite_run *run = x->run;
    uz_status status = UZ_OK;
    bool pressed = false;
    *known = false;
    for (int64_t i = 0; i < run->n_r && run->n_r == run->at.rows.m; i++)
        pressed = pressed || run->r[i] < 0;
    for (size_t k = 0; k < (pressed ? sizeof ALONG / sizeof ALONG[0] : 1) && status == UZ_OK && !*known; k++) {
        x->hold = pressed ? ALONG[k] * run->stiffest : 0;
        status = uz_finite_hold_tangent(run, x->hold, err);
        memset(run->p, 0, (size_t)run->d * sizeof *run->p);
        run->p[0] = 1;
        if (status == UZ_OK)
            status = solve_once(known, x, x->w, err);
    }
    return status;
}

/* What the loads and reactions at the answer leave of the internal forces on free dofs. */
static double forces_left(tangent *x)
{
    uz_finite_run *run = x->run;
    const uz_finite_place *at = &run->at;
    for (int64_t i = 0; i < run->n; i++)
        x->nodal[i] = at->loads[i] - at->force[i];
    uz_gather_nodal(run->p, &at->rows, x->nodal);
    if (run->n_r == at->rows.m)
        uz_csc_gaxpy_t(run->p, &at->rows.N, 1, run->r);
    return uz_norm(run->d, run->p);
}

uz_status uz_finite_quantities(uz_result *answer, uz_finite_run *run, uz_error *err)
{
    const uz_finite_place *at = &run->at;
    const bool whole = run->found.load >= 1;
    const uz_stop stop = {&run->hooks, run->deadline};
    tangent x = {.run = run};
    uz_body_model displaced = {.mesh.xyz = NULL};
    const bool compared = run->scene.compared;
    const bool cut = answer->summary.outcome == UZ_MESH_LIMIT; /* or that is the answer under a part */
    bool known = false;
    if (run->problem->n_quantities == 0)
        return UZ_OK;
    x.w = uz_alloc(run->d, sizeof *x.w);
    x.last = uz_alloc(run->d, sizeof *x.last);
    x.nodal = uz_alloc(2 * run->n, sizeof *x.nodal);
    x.t = uz_alloc(at->rows.m, sizeof *x.t);
    x.g = uz_alloc(at->rows.m, sizeof *x.g);
    uz_status status = UZ_OK;
    if (!x.w || !x.last || !x.nodal || !x.t || !x.g)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the quantities of %lld nodes",
                         (long long)run->base.mesh.n_nodes);
    if (status == UZ_OK)
        status = uz_displaced(&displaced, &at->rows, at->u, err);
    displaced.place = NULL;
    if (status == UZ_OK && whole && !compared)
        status = prepare(&known, &x, err);
    const uz_quantity_large place = {.of = &x,
                                     .place = {&displaced, at->loads},
                                     .why = compared ? "its value is compared"
                                            : !whole ? "this is the answer under a part of the load"
                                            : cut    ? "an obstacle, or another body, stands in it between rows"
                                            : !known ? "its tangent has no factor"
                                                     : NULL,
                                     .left = run->certificate.residual * sqrt(2 * at->body.energy),
                                     .forces = whole && status == UZ_OK ? forces_left(&x) : 0,
                                     .solve = solve,
                                     .energy = energy_of,
                                     .errors = errors_of};
    if (status == UZ_OK)
        status = uz_find_quantities(answer,
                                    &(uz_quantity_work){.problem = run->problem,
                                                        .settings = &run->settings,
                                                        .scene = &run->scene,
                                                        .model = &at->rows,
                                                        .place = &place,
                                                        .prescribed = run->prescribed,
                                                        .stop = &stop},
                                    err);
    uz_free_all(displaced.mesh.xyz, x.w, x.last, x.nodal, x.t, x.g);
    return status;
}
