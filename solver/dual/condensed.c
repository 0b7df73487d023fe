/* condensed.c: the dual operator as a dense matrix on the contact.
 *
 * With the contact dofs B last, the trailing block L_bb of the factor is the Cholesky factor of the Schur complement S
 * of K on B, and N touches B only:  D = N K^-1 N' = N_b S^-1 N_b' = Z'Z,  Z = L_bb^-1 N_b'.
 * With B anywhere Z = L^-1 P N' is sparse: it lives on the reach of B, and so does all that the contact asks for. */
#include "dual/condensed.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Is there one nonzero in each row and each column? Rigid obstacles along an axis, bounds on single dofs. */
static bool find_scaled(uz_condensed *dense, int64_t m)
{
    if (m != dense->n_b)
        return false;
    bool *seen = uz_alloc_zero(m, sizeof *seen);
    bool scaled = seen != NULL;
    for (int64_t k = 0; scaled && k < dense->n_b; k++) {
        int64_t e = dense->N_b.ptr[k];
        scaled = dense->N_b.ptr[k + 1] == e + 1 && dense->N_b.val[e] != 0.0 && !seen[dense->N_b.idx[e]];
        if (scaled) {
            seen[dense->N_b.idx[e]] = true;
            dense->row_of[k] = dense->N_b.idx[e];
            dense->scale[k] = dense->N_b.val[e];
        }
    }
    free(seen);
    return scaled;
}

/* Where N_b is a scaled permutation, and the contact last, D waits until somebody iterates; otherwise every bound needs
 * it. */
static uz_status make_operator(uz_condensed *dense, const uz_stop *stop, uz_error *err)
{
    int64_t m = dense->dual.m, size;
    dense->scaled = !dense->reach && find_scaled(dense, m);
    if (dense->scaled)
        return UZ_OK;
    bool fits = !__builtin_mul_overflow(m, m, &size);
    double *D = dense->made->D = fits ? uz_alloc_zero(size, sizeof(double)) : NULL;
    if (!D)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)m);
    uz_status status = UZ_OK;
    if (dense->reach) {
        status = uz_reach_gram(D, dense->reach, &dense->dual.N, err);
    } else {
        const int64_t n_b = dense->n_b;
        double *Z = uz_alloc_zero(n_b * m, sizeof *Z);
        if (!Z)
            return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense %lld x %lld block", (long long)n_b,
                           (long long)m);
        for (int64_t k = 0; k < n_b; k++)
            for (int64_t e = dense->N_b.ptr[k]; e < dense->N_b.ptr[k + 1]; e++)
                Z[k + dense->N_b.idx[e] * n_b] = dense->N_b.val[e];
        if (!uz_trsm_lower_while(n_b, m, dense->L_bb, Z, stop) || !uz_syrk_lower_t_while(m, n_b, Z, D, stop))
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
        free(Z);
    }
    /* D_chol stays NULL where D is singular to working precision (dependent rows of N) */
    double *chol = status == UZ_OK ? malloc((size_t)size * sizeof *chol + 1) : NULL;
    double least = INFINITY, largest = 0.0;
    if (chol) {
        memcpy(chol, D, (size_t)size * sizeof *chol);
        if (uz_potrf_lower_while(m, chol, stop))
            dense->D_chol = chol;
        else
            free(chol);
    }
    for (int64_t i = 0; dense->D_chol && i < m; i++) {
        least = fmin(least, chol[i + i * m]);
        largest = fmax(largest, chol[i + i * m]);
    }
    if (dense->D_chol && !(least * least > UZ_PIVOT_LEAST * largest * largest)) {
        free(chol);
        dense->D_chol = NULL;
    }
    if (status == UZ_OK && uz_stop_is_due(stop))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    return status;
}

/* order: the dofs at the end of the factor where they include all that N touches: more of them when another body's
 * factor is used. Otherwise those that N touches. */
static uz_status list_contact(int64_t **order, int64_t *n_b, bool *last, const uz_dual *dual, uz_error *err)
{
    uz_status status = uz_dual_contact_dofs(order, n_b, &dual->N, err);
    if (status != UZ_OK)
        return status;
    const uz_factor_info factor = uz_factor_describe(dual->factor);
    const int64_t count = factor.n_last;
    *last = uz_factor_ends_with(dual->factor, *order, *n_b);
    if (!*last)
        return UZ_OK;
    free(*order);
    *n_b = count;
    *order = uz_alloc(count, sizeof **order);
    if (!*order)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld contact dofs", (long long)count);
    if (count > 0)
        memcpy(*order, factor.last, (size_t)count * sizeof **order);
    return UZ_OK;
}

static uz_status create(uz_dual *dual, const uz_stop *stop, uz_error *err)
{
    uz_condensed *dense = (uz_condensed *)dual;
    const uz_csc *N = &dual->N;
    int64_t m = dual->m, n_b = 0, *order = NULL, size;
    bool last = false;
    uz_status status = list_contact(&order, &n_b, &last, dual, err);
    if (status == UZ_OK) {
        const bool fits = !__builtin_mul_overflow(n_b, n_b, &size);
        dense->n_b = n_b;
        dense->made = uz_alloc_zero(1, sizeof *dense->made);
        dense->position = uz_alloc(n_b, sizeof(int64_t));
        dense->L_bb = last && fits ? uz_alloc(size, sizeof(double)) : NULL;
        dense->row_of = uz_alloc(n_b, sizeof(int64_t));
        dense->scale = uz_alloc(n_b, sizeof(double));
        if (!fits || !dense->made || !dense->position || (last && !dense->L_bb) || !dense->row_of || !dense->scale)
            status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense block of order %lld", (long long)n_b);
    }
    /* The trailing block of the factor, which puts the dofs in its own order, or the paths that take its place. */
    if (status == UZ_OK && dense->L_bb) {
        status = uz_factor_last_block(dual->factor, dense->L_bb, order, dense->position, err);
    } else if (status == UZ_OK) {
        const int64_t *position = uz_factor_describe(dual->factor).position;
        for (int64_t k = 0; k < n_b; k++)
            dense->position[k] = position[order[k]];
        status = uz_reach_create(&dense->reach, dual->factor, order, n_b, err);
    }
    if (status == UZ_OK)
        status = uz_csc_init(&dense->N_b, m, n_b, N->ptr[N->cols], err);
    for (int64_t k = 0, at = 0; status == UZ_OK && k < n_b; k++) { /* columns `order` of N */
        for (int64_t e = N->ptr[order[k]]; e < N->ptr[order[k] + 1]; e++, at++) {
            dense->N_b.idx[at] = N->idx[e];
            dense->N_b.val[at] = N->val[e];
        }
        dense->N_b.ptr[k + 1] = at;
    }
    if (status == UZ_OK)
        status = make_operator(dense, stop, err);
    dual->bytes += 8 * (size_t)((last ? n_b * n_b : 0) + 2 * m * m);
    dual->rows_may_depend = !dense->scaled;
    dual->touched = &dense->N_b;
    free(order);
    return status;
}

static void clear(uz_dual *dual)
{
    uz_condensed *dense = (uz_condensed *)dual;
    uz_csc_clear(&dense->N_b);
    uz_free_all(dense->position, dense->L_bb);
    uz_reach_free(dense->reach);
    uz_free_all(dense->D_chol, dense->row_of, dense->scale);
    if (dense->made)
        uz_free_all(dense->made->D, dense->made->D_inverse);
    free(dense->made);
}

/* whole: with room for vectors of d; a load in a block takes them from the block. */
static uz_status allocate_load(uz_condensed_load *x, bool whole, uz_error *err)
{
    const uz_dual *dual = x->load.dual;
    x->dense = (const uz_condensed *)dual;
    int64_t d = dual->d, n_b = x->dense->n_b, contact = dual->m > n_b ? dual->m : n_b;
    x->ws = uz_factor_workspace_new();
    x->base = whole ? uz_alloc(d, sizeof(double)) : NULL;
    x->apply_room = uz_alloc_zero(n_b, sizeof(double));
    x->work = uz_alloc(contact, sizeof(double));
    x->work2 = uz_alloc(whole && d > contact ? d : contact, sizeof(double));
    x->load.correction = uz_alloc_zero(contact, sizeof(double));
    x->load.kept = uz_alloc_zero(contact, sizeof(double));
    x->load.bytes = 8 * (5 * (size_t)d + 2 * (size_t)dual->m);
    if (x->ws && (x->base || !whole) && x->apply_room && x->work && x->work2 && x->load.correction && x->load.kept)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)d);
}

/* g0 from y = L^-1 P p, whose entry k stands at y[k stride]. room (d) is used where the contact is not last. */
static uz_status find_gaps(uz_condensed_load *x, const double *y, int64_t stride, double *room, uz_error *err)
{
    const uz_condensed *dense = x->dense;
    double *u_b = x->work; /* displacements of the contact without reactions */
    uz_status status = UZ_OK;
    x->D = dense->scaled ? NULL : dense->made->D;
    for (int64_t k = 0; dense->reach && k < dense->dual.d; k++)
        room[k] = y[k * stride];
    if (dense->reach)
        status = uz_reach_backward(dense->reach, x->ws, room, err);
    for (int64_t k = 0; k < dense->n_b; k++)
        u_b[k] = dense->reach ? room[dense->position[k]] : y[dense->position[k] * stride];
    if (!dense->reach)
        uz_trsv_lower(dense->n_b, dense->L_bb, dense->n_b, u_b, true);
    memcpy(x->load.g0, x->load.h, (size_t)dense->dual.m * sizeof *x->load.g0);
    uz_csc_gaxpy(x->load.g0, &dense->N_b, -1.0, u_b);
    return status;
}

/* y = L^-1 P p is half a linear solve; the other half waits until the reactions are known. */
static uz_status load_whole(uz_dual_load *load, const double *p, uz_error *err)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    const uz_factor *factor = load->dual->factor;
    uz_status status = allocate_load(x, true, err);
    if (status != UZ_OK)
        return status;
    uz_factor_permute(factor, x->base, p);
    status = uz_factor_solve_one(factor, x->ws, x->base, true, err);
    if (status != UZ_OK)
        return status;
    load->psi0 = -0.5 * uz_dot(load->dual->d, x->base, x->base);
    return find_gaps(x, x->base, 1, x->work2, err);
}

static uz_status load_lane(uz_dual_load *load, const double *y, int64_t stride, double *room, uz_error *err)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    uz_status status = allocate_load(x, false, err);
    if (status != UZ_OK)
        return status;
    x->lane = y;
    double square = 0.0;
    for (int64_t k = 0; k < load->dual->d; k++)
        square += y[k * stride] * y[k * stride];
    load->psi0 = -0.5 * square;
    return find_gaps(x, y, stride, room, err);
}

static void unload(uz_dual_load *load)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    uz_factor_workspace_free(x->ws);
    uz_free_all(x->base, x->apply_room, x->work, x->work2);
}

void uz_condensed_response(double *z, const uz_condensed *dense, const double *w)
{
    memset(z, 0, (size_t)dense->n_b * sizeof *z);
    uz_csc_gaxpy_t(z, &dense->N_b, 1.0, w);
    uz_trsv_lower(dense->n_b, dense->L_bb, dense->n_b, z, false);
}

/* Without D two triangular solves do: slower each, but there is nothing to form. */
void uz_condensed_apply_factor(double *Dr, const uz_condensed_load *x, const double *r)
{
    const uz_condensed *dense = x->dense;
    uz_condensed_response(x->apply_room, dense, r);
    uz_trsv_lower(dense->n_b, dense->L_bb, dense->n_b, x->apply_room, true);
    memset(Dr, 0, (size_t)dense->dual.m * sizeof *Dr);
    uz_csc_gaxpy(Dr, &dense->N_b, 1.0, x->apply_room);
}

uz_status uz_condensed_apply(uz_dual_load *load, double *Dr, const double *r, uz_error *err)
{
    const uz_condensed_load *x = (const uz_condensed_load *)load;
    int64_t m = x->dense->dual.m;
    (void)err;
    if (x->D)
        uz_symv_lower(m, x->D, r, Dr);
    else
        uz_condensed_apply_factor(Dr, x, r);
    return UZ_OK;
}

static bool column(uz_dual_load *load, double *out, int64_t i)
{
    const double *D = ((const uz_condensed_load *)load)->D;
    int64_t m = load->dual->m;
    if (!D)
        return false;
    for (int64_t k = 0; k < i; k++)
        out[k] = D[i + k * m];
    memcpy(out + i, D + i + i * m, (size_t)(m - i) * sizeof *out);
    return true;
}

static uz_status add_reactions(uz_dual_load *load, double *y, int64_t stride, double *room, const double *r,
                               bool corrected, uz_error *err)
{
    const uz_condensed_load *x = (const uz_condensed_load *)load;
    const uz_condensed *dense = x->dense;
    if (!dense->reach) {
        double *z = x->work;
        uz_condensed_response(z, dense, r);
        for (int64_t k = 0; k < dense->n_b; k++)
            y[dense->position[k] * stride] += z[k] + (corrected ? load->kept[k] : 0.0);
        return UZ_OK;
    }
    /* room = L^-1 P N'(r + w) by the paths, w the kept correction or nothing. */
    double *force = x->apply_room;
    memset(force, 0, (size_t)dense->n_b * sizeof *force);
    uz_csc_gaxpy_t(force, &dense->N_b, 1.0, r);
    if (corrected)
        uz_csc_gaxpy_t(force, &dense->N_b, 1.0, load->kept);
    memset(room, 0, (size_t)load->dual->d * sizeof *room);
    for (int64_t k = 0; k < dense->n_b; k++)
        room[dense->position[k]] = force[k];
    uz_status status = uz_reach_forward(dense->reach, x->ws, room, err);
    for (int64_t k = 0; k < load->dual->d; k++)
        y[k * stride] += room[k];
    return status;
}

static uz_status recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    const uz_condensed_load *x = (const uz_condensed_load *)load;
    const uz_dual *dual = load->dual;
    int64_t d = dual->d;
    double *own = x->base ? NULL : uz_alloc(d, sizeof *own), *y = x->base ? x->work2 : own;
    if (!y)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacements of %lld dofs", (long long)d);
    for (int64_t k = 0; k < d; k++)
        y[k] = x->base ? x->base[k] : x->lane[k * UZ_LANES];
    uz_status status = add_reactions(load, y, 1, u, r, corrected, err); /* u is room */
    if (status == UZ_OK)
        status = uz_factor_solve_one(dual->factor, x->ws, y, false, err);
    if (status == UZ_OK)
        uz_factor_unpermute(dual->factor, u, y);
    free(own);
    return status;
}

/* Dense work is about 2 n^3 flops once, at a rate some 30 times that of sparse substitutions; the factored form pays a
 * sparse solve of about 60 d flops for each of some 300 iterations. In between the choice matters little. Where rows
 * bound single dofs, a few sparse factorizations take the place of the iterations, at about the price of as many solves
 * as they are; they get cheaper the more dofs are held. Measured, bounds on both sides of all of 900 dofs: 1.5 ms and
 * 320 ms; on one side of 450 of them: 11 and 12 ms; 1,000 contacts of a slender body of 10,000 dofs: 20 and 40 times
 * the time of a linear solve. */
static bool suits(const uz_dual_shape *shape)
{
    const int64_t small = 1024;
    double n = (double)shape->m;
    bool cheap = 2.0 * n * n * n / 30.0 <= (shape->bounds ? 20.0 : 300.0) * 60.0 * (double)shape->d;
    return shape->bounds ? cheap && 2 * shape->n_b <= shape->d : shape->m <= small || cheap;
}

/* What substitutions of a load read of L, in passes as those of a sparse matrix: supernodes are read in order, and of
 * those that the load does not touch nothing forwards. Plane and solid bodies of 14,000 to 240,000 dofs. */
#define LOAD_PASSES 0.65
/* Steps of the active set, as if each had the whole block anew. */
#define STEPS 0.5
/* The part of a load's time that load cases take which pass a factor together: 0.3 to 0.45 of it, 50 cases on hex8 and
 * tet4 of 45,000 and 105,000 dofs. */
#define NEXT_CASE 0.4

static void add_cost(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                     const uz_cost_rates *rates)
{
    double n_b = (double)size->n_b, m = (double)size->m, entries = (double)factor->nnz;
    double order = fmax(n_b, m), dense = order * order * order, step = m * m * m / 3.0;
    cost->flops += dense + STEPS * step + 8.0 * entries;
    cost->setup_s += dense * rates->flop_s;
    cost->case_s += STEPS * step * rates->flop_s + LOAD_PASSES * entries * rates->entry_s;
    cost->next_s = NEXT_CASE * cost->case_s;
    cost->bytes += 8.0 * UZ_COST_VECTORS * (double)size->d;
    cost->bytes += 8.0 * (n_b * n_b + 2.0 * m * m + n_b * m);
}

const uz_dual_form uz_dual_condensed = {
    .can = {.op = UZ_OPERATOR_CONDENSED,
            .needs_factor = true,
            .contact_last = true,
            .exact = true,
            .cheap_steps = true,
            .lanes = true},
    .dual_size = sizeof(uz_condensed),
    .load_size = sizeof(uz_condensed_load),
    .suits = suits,
    .add_cost = add_cost,
    .create = create,
    .clear = clear,
    .load = load_whole,
    .unload = unload,
    .prepare = uz_condensed_prepare,
    .apply = uz_condensed_apply,
    .column = column,
    .inverse_column = uz_condensed_inverse_column,
    .correct = uz_condensed_correct,
    .recover = recover,
    .solve_active = uz_condensed_solve_active,
    .load_lane = load_lane,
    .add_reactions = add_reactions,
};
