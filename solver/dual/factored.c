/* factored.c: the dual operator by one sparse solve per application, the form of Kanno's algorithm. Where each row
 * bounds a single dof, the contact problem with given rows as equations holds the dofs that touch at their bounds,
 * solves K u = p on the others, and the reactions are what holds them; other rows become equations by multipliers. */
#include "dual/multipliers.h"
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/error.h"
#include "law/sign.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    uz_sparse_load sparse;
    uz_factor_workspace *ws;
    uz_principal *part; /* of the last guess; NULL: none yet */
    /* made when a column of D^-1 is first wanted */
    uz_principal *held; /* K with every bounded dof held */
    uz_factor_workspace *held_ws;
    double *unit, *force; /* d */
} factored_load;

static uz_status make_load(uz_dual_load *load, const double *p, uz_error *err)
{
    factored_load *x = (factored_load *)load;
    uz_status status = uz_sparse_load_begin(&x->sparse, err);
    x->ws = uz_factor_workspace_new();
    if (status == UZ_OK && !x->ws)
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)load->dual->d);
    if (status != UZ_OK)
        return status;
    status = uz_factor_solve(load->dual->factor, x->ws, x->sparse.base, p, x->sparse.work2, err);
    return status == UZ_OK ? uz_sparse_load_end(&x->sparse, p, true, err) : status;
}

static void unload(uz_dual_load *load)
{
    factored_load *x = (factored_load *)load;
    uz_principal_free(x->part);
    uz_principal_free(x->held);
    uz_factor_workspace_free(x->held_ws);
    uz_free_all(x->unit, x->force);
    uz_factor_workspace_free(x->ws);
    uz_sparse_unload(&x->sparse);
}

static uz_status apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    factored_load *x = (factored_load *)load;
    const uz_dual *dual = load->dual;
    double *response = x->sparse.response;
    memset(response, 0, (size_t)dual->d * sizeof *response);
    memset(Dr, 0, (size_t)dual->m * sizeof *Dr);
    int64_t first = 0;
    while (first < dual->m && r[first] == 0.0)
        first++;
    if (first == dual->m) /* r = 0 */
        return UZ_OK;
    uz_csc_gaxpy_t(response, &dual->N, 1.0, r);
    uz_status status = uz_factor_solve(dual->factor, x->ws, response, response, x->sparse.work2, err);
    if (status == UZ_OK)
        uz_csc_gaxpy(Dr, &dual->N, 1.0, response);
    return status;
}

enum { PASSES = 2 }; /* solve, and once more for the residual */

/* Signs beyond this, relative to the terms of a sum, are wrong after one pass as after two, if K is not conditioned
 * worse than that. */
#define CLEARLY_WRONG 1e-7
#define LEAST_RCOND   1e-7

/* From the displacement of the last guess, where there was one: of a guess that is as clearly wrong as that, one pass
 * tells. */
static uz_status solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active, uz_error *err)
{
    factored_load *x = (factored_load *)load;
    uz_bounded *box = x->sparse.box;
    const int64_t d = load->dual->d, m = load->dual->m;
    bool solved = true, wrong = false;
    if (!box)
        return uz_multipliers_solve(&x->sparse, x->ws, end, r, g, active, err);
    const bool again = x->sparse.known_u != NULL,
               one_tells = again && uz_factor_describe(load->dual->factor).rcond > LEAST_RCOND;
    if (!uz_bounded_hold(&x->sparse, active, again)) {
        *end = uz_bounded_crossed(&x->sparse, r) ? UZ_ACTIVE_RAY : UZ_ACTIVE_UNSOLVED;
        return UZ_OK;
    }
    size_t most = uz_principal_bytes(x->part) + uz_principal_bytes(x->held) + box->swept_bytes;
    load->most = most > load->most ? most : load->most;
    /* The displacement of the dofs that are not held. */
    uz_status status =
        x->part ? uz_principal_hold(&solved, x->part, load->K, box->fixed, &load->stop, err)
                : uz_principal_create(&x->part, load->K, box->fixed, load->dual->factor, x->ws, &load->stop, err);
    solved = solved && x->part;
    most = uz_principal_bytes(x->part) + uz_principal_bytes(x->held);
    load->most = most > load->most ? most : load->most;
    uz_bounded_balance(&x->sparse, false);
    for (int pass = 0; status == UZ_OK && solved && !wrong && pass < PASSES; pass++) {
        if ((solved = !uz_stop_is_due(&load->stop)))
            status = uz_principal_solve(box->force, x->part, err);
        for (int64_t j = 0; status == UZ_OK && solved && j < d; j++)
            box->u[j] -= box->fixed[j] ? 0.0 : box->force[j];
        uz_bounded_balance(&x->sparse, false);
        if (one_tells && solved && pass + 1 < PASSES) {
            uz_bounded_react(&x->sparse, g, active);
            for (int64_t i = 0; !wrong && i < m; i++) {
                const double scale = fabs(box->bounds->scale[i]), u = box->u[box->bounds->dof[i]];
                wrong = active[i]
                            ? uz_reaction_pulls(box->r[i]) &&
                                  scale * fabs(box->r[i]) > CLEARLY_WRONG * box->size[box->bounds->dof[i]]
                            : uz_gap_penetrates(g[i]) && -g[i] > CLEARLY_WRONG * (fabs(load->h[i]) + scale * fabs(u));
            }
        }
    }
    if (status != UZ_OK || !solved || uz_stop_is_due(&load->stop))
        return status;
    uz_bounded_react(&x->sparse, g, active);
    memcpy(r, box->r, (size_t)m * sizeof *r);
    x->sparse.known_u = box->u;
    x->sparse.known_r = box->r;
    *end = UZ_ACTIVE_SOLVED;
    return UZ_OK;
}

/* With dof j moved by 1 and the other bounded ones held, the free ones follow by -K_FF^-1 K_Fj; what holds the bounded
 * ones are the reactions. The factor of the free ones is made first: none where several rows bound a dof, or it had to
 * stop. */
static uz_status inverse_column(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err)
{
    factored_load *x = (factored_load *)load;
    const int64_t d = load->dual->d, m = load->dual->m;
    const uz_bounds *bounds = x->sparse.box ? x->sparse.box->bounds : NULL;
    uz_status status = UZ_OK;
    if (!x->unit) {
        bool *fixed = uz_alloc_zero(d, sizeof *fixed), single = bounds != NULL;
        for (int64_t k = 0; fixed && single && k < m; k++) {
            single = !fixed[bounds->dof[k]];
            fixed[bounds->dof[k]] = true;
        }
        if (fixed && single) {
            x->held_ws = uz_factor_workspace_new();
            x->unit = uz_alloc_zero(d, sizeof *x->unit);
            x->force = uz_alloc_zero(d, sizeof *x->force);
        }
        if (!fixed || (single && (!x->held_ws || !x->unit || !x->force)))
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)d);
        else if (single)
            status = uz_principal_create(&x->held, load->K, fixed, load->dual->factor, x->held_ws, &load->stop, err);
        free(fixed);
    }
    *can = x->held != NULL;
    if (status != UZ_OK || !*can)
        return status;
    memset(x->unit, 0, (size_t)d * sizeof *x->unit);
    memset(x->force, 0, (size_t)d * sizeof *x->force);
    x->unit[bounds->dof[i]] = 1.0 / bounds->scale[i];
    uz_csc_symv(x->force, load->K, 1.0, x->unit);
    status = uz_principal_solve(x->force, x->held, err);
    /* the solve leaves held dofs as they are: unit is what moves */
    for (int64_t k = 0; k < m; k++)
        x->force[bounds->dof[k]] = 0.0;
    for (int64_t j = 0; j < d; j++)
        x->unit[j] -= x->force[j];
    memset(x->force, 0, (size_t)d * sizeof *x->force);
    uz_csc_symv(x->force, load->K, 1.0, x->unit);
    for (int64_t k = 0; k < m; k++)
        column[k] = x->force[bounds->dof[k]] / bounds->scale[k];
    return status;
}

static bool suits(const uz_dual_shape *shape)
{
    (void)shape;
    return true;
}

/* Steps of the active set, those that refactor, each analysed anew: passes of K. */
#define STEPS           4.0
#define ANALYSIS_PASSES 60.0

static void add_cost(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                     const uz_cost_rates *rates)
{
    double entries = (double)factor->nnz, one_solve = 2.0 * UZ_COST_SOLVE_PASSES * entries * rates->entry_s;
    double share = 1.0 - 0.5 * (double)size->n_b / (double)size->d; /* of the dofs that are free, about */
    cost->bytes += 8.0 * UZ_COST_VECTORS * (double)size->d;
    if (!size->bounds) {
        cost->case_s += UZ_COST_ITERATIONS * one_solve;
        cost->flops += 4.0 * UZ_COST_ITERATIONS * entries;
        return;
    }
    double again =
        share * share * UZ_COST_FACTOR_FLOPS * factor->flops * rates->flop_s +
        (share * UZ_COST_FACTOR_PASSES * entries + ANALYSIS_PASSES * (double)size->k_entries) * rates->entry_s;
    cost->case_s += 2.0 * one_solve + STEPS * (again + 2.0 * share * one_solve);
    cost->flops += STEPS * share * share * factor->flops + 8.0 * (1.0 + STEPS) * entries;
    cost->bytes +=
        share * (double)factor->bytes + 16.0 * (double)size->k_entries; /* the factor and the matrix of the free dofs */
}

const uz_dual_form uz_dual_factored = {
    .can = {.op = UZ_OPERATOR_FACTORED, .needs_factor = true, .exact = true},
    .dual_size = sizeof(uz_sparse),
    .load_size = sizeof(factored_load),
    .suits = suits,
    .add_cost = add_cost,
    .create = uz_sparse_create,
    .clear = uz_sparse_clear,
    .load = make_load,
    .unload = unload,
    .apply = apply,
    .inverse_column = inverse_column,
    .correct = uz_sparse_correct,
    .recover = uz_sparse_recover,
    .solve_active = solve_active,
    .guess_active = uz_sparse_guess_active,
};
