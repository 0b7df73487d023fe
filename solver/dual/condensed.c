/* condensed.c: the dual operator as a dense matrix on the contact.
 *
 * With the contact dofs B last, the trailing block L_bb of the factor is the Cholesky factor of the Schur complement S
 * of K on B, and N touches B only:  D = N K^-1 N' = N_b S^-1 N_b' = Z'Z,  Z = L_bb^-1 N_b'. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "core/blas.h"
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

static void symmetric_lower(double *D, int64_t row, int64_t column, int64_t m, double value)
{
    D[row >= column ? row + column * m : column + row * m] = value;
}

/* D = N_b S^-1 N_b' for a scaled permutation: the inverse from the factor, then signs and places. */
static uz_status invert_schur(uz_condensed *dense, int64_t m, uz_error *err)
{
    size_t bytes = (size_t)m * (size_t)m * sizeof(double);
    double *inverse = malloc(bytes + 1);
    if (!inverse)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)m);
    memcpy(inverse, dense->L_bb, bytes);
    if (!uz_potri_lower(m, inverse)) {
        free(inverse);
        return uz_fail(err, UZ_ERR_NOT_SPD, "K", "the Schur complement on the contact is singular");
    }
    for (int64_t l = 0; l < m; l++)
        for (int64_t k = l; k < m; k++)
            symmetric_lower(dense->D, dense->row_of[k], dense->row_of[l], m,
                            dense->scale[k] * dense->scale[l] * inverse[k + l * m]);
    free(inverse);
    return UZ_OK;
}

/* Below this, relative to the largest, a pivot of D is noise. */
#define PIVOT_LEAST 1e-11

/* D_chol, or NULL where D is singular to working precision (dependent rows of N). */
static void factor_operator(uz_condensed *dense, int64_t m)
{
    double *chol = malloc((size_t)m * (size_t)m * sizeof *chol + 1), least = INFINITY, largest = 0.0;
    bool ok = chol != NULL;
    if (ok) {
        memcpy(chol, dense->D, (size_t)m * (size_t)m * sizeof *chol);
        ok = uz_potrf_lower(m, chol);
    }
    for (int64_t i = 0; ok && i < m; i++) {
        least = fmin(least, chol[i + i * m]);
        largest = fmax(largest, chol[i + i * m]);
    }
    if (ok && least * least > PIVOT_LEAST * largest * largest) {
        dense->D_chol = chol;
        return;
    }
    free(chol);
}

static uz_status multiply_out(uz_condensed *dense, int64_t m, uz_error *err)
{
    int64_t n_b = dense->n_b;
    double *Z = uz_alloc_zero(n_b * m, sizeof *Z);
    if (!Z)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense %lld x %lld block", (long long)n_b,
                       (long long)m);
    for (int64_t k = 0; k < n_b; k++)
        for (int64_t e = dense->N_b.ptr[k]; e < dense->N_b.ptr[k + 1]; e++)
            Z[k + dense->N_b.idx[e] * n_b] = dense->N_b.val[e];
    uz_trsm_lower(n_b, m, dense->L_bb, Z);
    uz_syrk_lower_t(m, n_b, Z, dense->D);
    free(Z);
    factor_operator(dense, m);
    return UZ_OK;
}

static bool allocate(uz_condensed *dense, int64_t n_b, int64_t m)
{
    int64_t block, operator_size;
    if (__builtin_mul_overflow(n_b, n_b, &block) || __builtin_mul_overflow(m, m, &operator_size))
        return false;
    dense->n_b = n_b;
    dense->position = uz_alloc(n_b, sizeof(int64_t));
    dense->L_bb = uz_alloc(block, sizeof(double));
    dense->D = uz_alloc_zero(operator_size, sizeof(double));
    dense->row_of = uz_alloc(n_b, sizeof(int64_t));
    dense->scale = uz_alloc(n_b, sizeof(double));
    return dense->position && dense->L_bb && dense->D && dense->row_of && dense->scale;
}

uz_status uz_condensed_create(uz_dual *dual, uz_error *err)
{
    uz_condensed *dense = &dual->dense;
    int64_t m = dual->info.m, n_b = 0, *order = NULL;
    uz_status status = uz_dual_contact_dofs(&order, &n_b, &dual->N, err);
    if (status == UZ_OK && !allocate(dense, n_b, m))
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)m);
    if (status == UZ_OK)
        status = uz_factor_last_block(dual->factor, dense->L_bb, order, dense->position, err);
    if (status == UZ_OK)
        status = restrict_columns(&dense->N_b, &dual->N, order, n_b, err);
    if (status == UZ_OK) {
        dense->scaled = find_scaled(dense, m);
        status = dense->scaled ? invert_schur(dense, m, err) : multiply_out(dense, m, err);
    }
    dual->info.bytes += 8 * (size_t)(n_b * n_b + m * m * (dense->D_chol ? 2 : 1));
    free(order);
    return status;
}

void uz_condensed_clear(uz_condensed *dense)
{
    uz_csc_clear(&dense->N_b);
    free(dense->position);
    free(dense->L_bb);
    free(dense->D);
    free(dense->D_chol);
    free(dense->row_of);
    free(dense->scale);
}

/* y = L^-1 P p is half a linear solve; the other half waits until the reactions are known. */
uz_status uz_condensed_load(uz_case *load, const double *p, uz_error *err)
{
    const uz_dual *dual = load->dual;
    const uz_condensed *dense = &dual->dense;
    uz_factor_permute(dual->factor, load->base, p);
    uz_status status = uz_factor_forward(dual->factor, load->ws, load->base, 1, err);
    if (status != UZ_OK)
        return status;
    load->psi0 = -0.5 * uz_dot(dual->info.d, load->base, load->base);
    for (int64_t k = 0; k < dense->n_b; k++)
        load->work[k] = load->base[dense->position[k]];
    uz_trsv_lower_t(dense->n_b, dense->L_bb, load->work);
    memcpy(load->g0, load->h, (size_t)dual->info.m * sizeof *load->g0);
    uz_csc_gaxpy(load->g0, &dense->N_b, -1.0, load->work);
    return UZ_OK;
}

void uz_condensed_apply(const uz_case *load, double *Dr, const double *r)
{
    uz_symv_lower(load->dual->info.m, load->dual->dense.D, r, Dr);
}

/* z = L_bb^-1 N_b' w (n_b) */
static void response(double *z, const uz_condensed *dense, const double *w)
{
    memset(z, 0, (size_t)dense->n_b * sizeof *z);
    uz_csc_gaxpy_t(z, &dense->N_b, 1.0, w);
    uz_trsv_lower(dense->n_b, dense->L_bb, z);
}

/* D_AA, lower triangle, rows and columns in the order of `rows`. */
static void gather(double *D_AA, const double *D, const int64_t *rows, int64_t count, int64_t m)
{
    for (int64_t l = 0; l < count; l++)
        for (int64_t k = l; k < count; k++)
            D_AA[k + l * count] = D[rows[k] + rows[l] * m];
}

enum { PUSH_ROUNDS = 6 };

/* What may be left of a penetration, relative to the largest gap moved: the certificate sees to the rest. */
#define PUSH_TOLERANCE 1e-9

/* The rows of `in`, listed; their number. */
static int64_t list_rows(int64_t *rows, const bool *in, int64_t m)
{
    int64_t count = 0;
    for (int64_t i = 0; i < m; i++)
        if (in[i])
            rows[count++] = i;
    return count;
}

enum { REFINEMENTS = 2 };

/* w (m) with D w = target on the listed rows as far as they are independent, zero elsewhere; refined, as D_AA is the
 * inverse of a stiffness and as badly conditioned. Dw (m) in passing. D_AA is room for count^2. */
static bool solve_rows(double *w, double *Dw, double *D_AA, uz_case *load, const double *target, const int64_t *rows,
                       int64_t count)
{
    int64_t m = load->dual->info.m, *pivot = uz_alloc(count, sizeof *pivot);
    double *x = uz_alloc(count, sizeof *x);
    bool ok = pivot && x;
    memset(w, 0, (size_t)m * sizeof *w);
    memset(Dw, 0, (size_t)m * sizeof *Dw);
    if (ok) {
        gather(D_AA, load->dual->dense.D, rows, count, m);
        int64_t rank = uz_pstrf_lower(count, D_AA, pivot, PIVOT_LEAST);
        for (int pass = 0; pass <= REFINEMENTS; pass++) {
            for (int64_t k = 0; k < rank; k++)
                x[k] = target[rows[pivot[k]]] - Dw[rows[pivot[k]]];
            uz_potrs_leading(rank, count, D_AA, x);
            for (int64_t k = 0; k < rank; k++)
                w[rows[pivot[k]]] += x[k];
            uz_condensed_apply(load, Dw, w);
        }
    }
    free(pivot);
    free(x);
    return ok;
}

/* |D| |w| row by row is at most sqrt(D_ii) times this sum: what rounding leaves of D w is in proportion. */
static double rounding_sum(const double *D, const double *w, int64_t m)
{
    double sum = 0.0;
    for (int64_t j = 0; j < m; j++)
        sum += sqrt(D[j + j * m]) * fabs(w[j]);
    return sum;
}

/* Where D is singular: closes the rows to close and the penetrating ones as equations, then also those that penetrate
 * because of it, until none does. target (m) becomes what was reached, N c; the correction is K^-1 N'w. */
static bool push_rows(uz_case *load, double *w, double *target, const double *g, const bool *close)
{
    int64_t m = load->dual->info.m, *rows = uz_alloc(m, sizeof *rows);
    const double *D = load->dual->dense.D;
    bool *in = uz_alloc(m, sizeof *in), feasible = false, ok = rows && in;
    double *D_AA = ok ? uz_alloc(m * m, sizeof *D_AA) : NULL, scale = 0.0;
    for (int64_t i = 0; D_AA && i < m; i++) {
        in[i] = close[i] || g[i] < 0.0;
        scale = in[i] ? fmax(scale, fabs(g[i])) : scale;
    }
    for (int round = 0; D_AA && ok && !feasible && round < PUSH_ROUNDS; round++) {
        ok = solve_rows(w, target, D_AA, load, g, rows, list_rows(rows, in, m));
        double noise = 8.0 * DBL_EPSILON * rounding_sum(D, w, m);
        feasible = ok;
        for (int64_t i = 0; i < m; i++) {
            bool wrong = g[i] - target[i] < -PUSH_TOLERANCE * scale - sqrt(D[i + i * m]) * noise;
            feasible = feasible && !wrong;
            in[i] = in[i] || wrong;
        }
    }
    free(rows);
    free(in);
    free(D_AA);
    return feasible;
}

uz_status uz_condensed_push(uz_case *load, double *bound2, const double *r, const double *g, const bool *close)
{
    const uz_condensed *dense = &load->dual->dense;
    int64_t m = load->dual->info.m;
    double *target = load->work, *z = load->push, complementarity = 0.0;
    for (int64_t i = 0; i < m; i++)
        target[i] = close[i] ? g[i] : fmin(g[i], 0.0);
    if (dense->scaled) {
        for (int64_t k = 0; k < m; k++)
            z[k] = target[dense->row_of[k]] / dense->scale[k];
        uz_trmv_lower_t(m, dense->L_bb, z);
    } else if (dense->D_chol) {
        memcpy(load->work2, target, (size_t)m * sizeof *target);
        uz_potrs_lower(m, dense->D_chol, load->work2);
        response(z, dense, load->work2);
    } else if (push_rows(load, load->work2, target, g, close)) {
        response(z, dense, load->work2);
    } else {
        return UZ_OK;
    }
    for (int64_t i = 0; i < m; i++)
        complementarity -= r[i] * fmax(0.0, g[i] - target[i]);
    *bound2 = uz_dot(dense->n_b, z, z) + 2.0 * complementarity;
    return UZ_OK;
}

/* Solves, and once more for the residual: D_AA is the inverse of a stiffness and as badly conditioned. */
static void solve_refined(uz_case *load, double *r, const double *chol, const int64_t *rows, int64_t count)
{
    int64_t m = load->dual->info.m;
    double *x = load->work;
    memset(r, 0, (size_t)m * sizeof *r);
    for (int pass = 0; pass < 2; pass++) {
        uz_condensed_apply(load, load->work2, r);
        for (int64_t k = 0; k < count; k++)
            x[k] = load->g0[rows[k]] - load->work2[rows[k]];
        uz_potrs_lower(count, chol, x);
        for (int64_t k = 0; k < count; k++)
            r[rows[k]] += x[k];
    }
}

uz_status uz_condensed_solve_active(uz_case *load, double *r, bool *solved, const bool *active, uz_error *err)
{
    int64_t m = load->dual->info.m, count = 0, *rows = uz_alloc(m, sizeof *rows);
    for (int64_t i = 0; rows && i < m; i++)
        if (active[i])
            rows[count++] = i;
    double *D_AA = rows ? uz_alloc(count * count, sizeof *D_AA) : NULL;
    uz_status status = UZ_OK;
    if (D_AA) {
        gather(D_AA, load->dual->dense.D, rows, count, m);
        *solved = uz_potrf_lower(count, D_AA);
        if (*solved)
            solve_refined(load, r, D_AA, rows, count);
    } else {
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld active rows", (long long)count);
    }
    free(D_AA);
    free(rows);
    return status;
}

uz_status uz_condensed_recover(uz_case *load, double *u, const double *r, bool with_push, uz_error *err)
{
    const uz_dual *dual = load->dual;
    const uz_condensed *dense = &dual->dense;
    double *x = load->work2, *z = load->work;
    response(z, dense, r);
    memcpy(x, load->base, (size_t)dual->info.d * sizeof *x);
    for (int64_t k = 0; k < dense->n_b; k++)
        x[dense->position[k]] += z[k] + (with_push ? load->kept[k] : 0.0);
    uz_status status = uz_factor_backward(dual->factor, load->ws, x, 1, err);
    if (status == UZ_OK)
        uz_factor_unpermute(dual->factor, u, x);
    return status;
}
