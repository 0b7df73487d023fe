/* condensed.c: the dual operator as a dense matrix on the contact.
 *
 * With the contact dofs B last, the trailing block L_bb of the factor is the Cholesky factor of the Schur complement S
 * of K on B, and N touches B only:  D = N K^-1 N' = N_b S^-1 N_b' = Z'Z,  Z = L_bb^-1 N_b'.
 * With B anywhere Z = L^-1 P N' is sparse: it lives on the reach of B, and so does all that the contact asks for. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Columns `order` of N, as an m x n_b matrix. */
static uz_status restrict_columns(uz_csc *N_b, const uz_csc *N, const int64_t *order, int64_t n_b, uz_error *err)
{
    int64_t nnz = N->ptr[N->cols], at = 0;
    uz_status status = uz_csc_init(N_b, N->rows, n_b, nnz, err);
    if (status != UZ_OK)
        return status;
    for (int64_t k = 0; k < n_b; k++) {
        for (int64_t e = N->ptr[order[k]]; e < N->ptr[order[k] + 1]; e++, at++) {
            N_b->idx[at] = N->idx[e];
            N_b->val[at] = N->val[e];
        }
        N_b->ptr[k + 1] = at;
    }
    return UZ_OK;
}

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

/* D_chol, or NULL where D is singular to working precision (dependent rows of N). */
static void factor_operator(uz_condensed *dense, const double *D, int64_t m, const uz_stop *stop)
{
    double *chol = malloc((size_t)m * (size_t)m * sizeof *chol + 1), least = INFINITY, largest = 0.0;
    bool ok = chol != NULL;
    if (ok) {
        memcpy(chol, D, (size_t)m * (size_t)m * sizeof *chol);
        ok = uz_potrf_lower_while(m, chol, stop);
    }
    for (int64_t i = 0; ok && i < m; i++) {
        least = fmin(least, chol[i + i * m]);
        largest = fmax(largest, chol[i + i * m]);
    }
    if (ok && least * least > UZ_PIVOT_LEAST * largest * largest) {
        dense->D_chol = chol;
        return;
    }
    free(chol);
}

static uz_status multiply_out(const uz_condensed *dense, double *D, int64_t m, const uz_stop *stop, uz_error *err)
{
    int64_t n_b = dense->n_b;
    double *Z = uz_alloc_zero(n_b * m, sizeof *Z);
    if (!Z)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense %lld x %lld block", (long long)n_b,
                       (long long)m);
    for (int64_t k = 0; k < n_b; k++)
        for (int64_t e = dense->N_b.ptr[k]; e < dense->N_b.ptr[k + 1]; e++)
            Z[k + dense->N_b.idx[e] * n_b] = dense->N_b.val[e];
    bool done = uz_trsm_lower_while(n_b, m, dense->L_bb, Z, stop) && uz_syrk_lower_t_while(m, n_b, Z, D, stop);
    free(Z);
    if (!done)
        return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    return UZ_OK;
}

static bool allocate(uz_condensed *dense, int64_t n_b, bool contact_last)
{
    int64_t block;
    if (__builtin_mul_overflow(n_b, n_b, &block))
        return false;
    dense->n_b = n_b;
    dense->position = uz_alloc(n_b, sizeof(int64_t));
    dense->L_bb = contact_last ? uz_alloc(block, sizeof(double)) : NULL;
    dense->row_of = uz_alloc(n_b, sizeof(int64_t));
    dense->scale = uz_alloc(n_b, sizeof(double));
    return dense->position && (dense->L_bb || !contact_last) && dense->row_of && dense->scale;
}

/* Where N_b is a scaled permutation, and the contact last, D waits until somebody iterates; otherwise every bound needs
 * it. */
static uz_status make_operator(uz_dual *dual, const uz_stop *stop, uz_error *err)
{
    uz_condensed *dense = &dual->dense;
    int64_t m = dual->info.m, size;
    dense->scaled = !dense->reach && find_scaled(dense, m);
    if (dense->scaled)
        return UZ_OK;
    bool fits = !__builtin_mul_overflow(m, m, &size);
    dual->lazy->D = fits ? uz_alloc_zero(size, sizeof(double)) : NULL;
    if (!dual->lazy->D)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)m);
    uz_status status = dense->reach ? uz_reach_gram(dual->lazy->D, dense->reach, &dual->N, err)
                                    : multiply_out(dense, dual->lazy->D, m, stop, err);
    if (status == UZ_OK)
        factor_operator(dense, dual->lazy->D, m, stop);
    if (status == UZ_OK && uz_stop_is_due(stop))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the first iteration");
    return status;
}

/* The trailing block of the factor, or the paths that take its place. order (n_b): the contact dofs, in the factor's
 * order on return where they are last. */
static uz_status find_contact(uz_condensed *dense, const uz_factor *factor, int64_t *order, uz_error *err)
{
    if (dense->L_bb)
        return uz_factor_last_block(factor, dense->L_bb, order, dense->position, err);
    for (int64_t k = 0; k < dense->n_b; k++)
        dense->position[k] = uz_factor_position(factor)[order[k]];
    return uz_reach_create(&dense->reach, factor, order, dense->n_b, err);
}

/* order: the dofs at the end of the factor where they include all that N touches: more of them when another body's
 * factor is used. Otherwise those that N touches. */
static uz_status list_contact(int64_t **order, int64_t *n_b, bool *last, const uz_dual *dual, uz_error *err)
{
    uz_status status = uz_dual_contact_dofs(order, n_b, &dual->N, err);
    if (status != UZ_OK)
        return status;
    int64_t count;
    const int64_t *dofs = uz_factor_last_dofs(dual->factor, &count);
    *last = uz_factor_ends_with(dual->factor, *order, *n_b);
    if (!*last)
        return UZ_OK;
    free(*order);
    *n_b = count;
    *order = uz_alloc(count, sizeof **order);
    if (!*order)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld contact dofs", (long long)count);
    if (count > 0)
        memcpy(*order, dofs, (size_t)count * sizeof **order);
    return UZ_OK;
}

uz_status uz_condensed_create(uz_dual *dual, const uz_stop *stop, uz_error *err)
{
    uz_condensed *dense = &dual->dense;
    int64_t m = dual->info.m, n_b = 0, *order = NULL;
    bool last = false;
    uz_status status = list_contact(&order, &n_b, &last, dual, err);
    if (status == UZ_OK && !allocate(dense, n_b, last))
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense block of order %lld", (long long)n_b);
    if (status == UZ_OK)
        status = find_contact(dense, dual->factor, order, err);
    if (status == UZ_OK)
        status = restrict_columns(&dense->N_b, &dual->N, order, n_b, err);
    if (status == UZ_OK)
        status = make_operator(dual, stop, err);
    dual->info.bytes += 8 * (size_t)((last ? n_b * n_b : 0) + 2 * m * m);
    free(order);
    return status;
}

void uz_condensed_clear(uz_condensed *dense)
{
    uz_csc_clear(&dense->N_b);
    free(dense->position);
    free(dense->L_bb);
    uz_reach_free(dense->reach);
    free(dense->D_chol);
    free(dense->row_of);
    free(dense->scale);
}

/* g0 from y = L^-1 P p, whose entry k stands at y[k stride]. x (d) is room where the contact is not last. */
uz_status uz_condensed_begin(uz_dual_load *load, const double *y, int64_t stride, double *x, uz_error *err)
{
    const uz_dual *dual = load->dual;
    const uz_condensed *dense = &dual->dense;
    double *u_b = load->work; /* displacements of the contact without reactions */
    uz_status status = UZ_OK;
    load->D = dense->scaled ? NULL : dual->lazy->D;
    for (int64_t k = 0; dense->reach && k < dual->info.d; k++)
        x[k] = y[k * stride];
    if (dense->reach)
        status = uz_reach_backward(dense->reach, load->ws, x, err);
    for (int64_t k = 0; k < dense->n_b; k++)
        u_b[k] = dense->reach ? x[dense->position[k]] : y[dense->position[k] * stride];
    if (!dense->reach)
        uz_trsv_lower_t(dense->n_b, dense->L_bb, u_b);
    memcpy(load->g0, load->h, (size_t)dual->info.m * sizeof *load->g0);
    uz_csc_gaxpy(load->g0, &dense->N_b, -1.0, u_b);
    return status;
}

/* y = L^-1 P p is half a linear solve; the other half waits until the reactions are known. */
uz_status uz_condensed_load(uz_dual_load *load, const double *p, uz_error *err)
{
    const uz_factor *factor = load->dual->factor;
    uz_factor_permute(factor, load->base, p);
    uz_status status = uz_factor_forward(factor, load->ws, load->base, 1, err);
    if (status != UZ_OK)
        return status;
    load->psi0 = -0.5 * uz_dot(load->dual->info.d, load->base, load->base);
    return uz_condensed_begin(load, load->base, 1, load->work2, err);
}

void uz_condensed_response(double *z, const uz_condensed *dense, const double *w)
{
    memset(z, 0, (size_t)dense->n_b * sizeof *z);
    uz_csc_gaxpy_t(z, &dense->N_b, 1.0, w);
    uz_trsv_lower(dense->n_b, dense->L_bb, z);
}

/* Without D two triangular solves do: slower each, but there is nothing to form. */
void uz_condensed_apply(const uz_dual_load *load, double *Dr, const double *r)
{
    const uz_condensed *dense = &load->dual->dense;
    int64_t m = load->dual->info.m;
    if (load->D) {
        uz_symv_lower(m, load->D, r, Dr);
        return;
    }
    uz_condensed_response(load->apply_room, dense, r);
    uz_trsv_lower_t(dense->n_b, dense->L_bb, load->apply_room);
    memset(Dr, 0, (size_t)m * sizeof *Dr);
    uz_csc_gaxpy(Dr, &dense->N_b, 1.0, load->apply_room);
}

/* x (d) = L^-1 P N'(r + w) by the paths, w the kept correction or nothing. */
static uz_status spread_along_reach(double *x, const uz_dual_load *load, const double *r, bool corrected, uz_error *err)
{
    const uz_condensed *dense = &load->dual->dense;
    double *force = load->apply_room; /* n_b */
    memset(force, 0, (size_t)dense->n_b * sizeof *force);
    uz_csc_gaxpy_t(force, &dense->N_b, 1.0, r);
    if (corrected)
        uz_csc_gaxpy_t(force, &dense->N_b, 1.0, load->kept);
    memset(x, 0, (size_t)load->dual->info.d * sizeof *x);
    for (int64_t k = 0; k < dense->n_b; k++)
        x[dense->position[k]] = force[k];
    return uz_reach_forward(dense->reach, load->ws, x, err);
}

uz_status uz_condensed_add_reactions(double *y, int64_t stride, double *x, uz_dual_load *load, const double *r,
                                     bool corrected, uz_error *err)
{
    const uz_condensed *dense = &load->dual->dense;
    double *z = load->work;
    if (dense->reach) {
        uz_status status = spread_along_reach(x, load, r, corrected, err);
        for (int64_t k = 0; k < load->dual->info.d; k++)
            y[k * stride] += x[k];
        return status;
    }
    uz_condensed_response(z, dense, r);
    for (int64_t k = 0; k < dense->n_b; k++)
        y[dense->position[k] * stride] += z[k] + (corrected ? load->kept[k] : 0.0);
    return UZ_OK;
}

uz_status uz_condensed_recover(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err)
{
    const uz_dual *dual = load->dual;
    int64_t d = dual->info.d;
    double *own = load->base ? NULL : uz_alloc(d, sizeof *own), *x = load->base ? load->work2 : own;
    if (!x)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the displacements of %lld dofs", (long long)d);
    for (int64_t k = 0; k < d; k++)
        x[k] = load->base ? load->base[k] : load->lane[k * UZ_LANES];
    uz_status status = uz_condensed_add_reactions(x, 1, u, load, r, corrected, err); /* u is room */
    if (status == UZ_OK)
        status = uz_factor_backward(dual->factor, load->ws, x, 1, err);
    if (status == UZ_OK)
        uz_factor_unpermute(dual->factor, u, x);
    free(own);
    return status;
}
