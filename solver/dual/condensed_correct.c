/* condensed_correct.c: feasible displacements near u(r), on the contact. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { GATHERED = 1 << 17 }; /* entries between questions whether to go on: a megabyte of a new block */

bool uz_gather_lower(double *D_AA, const double *D, const int64_t *rows, int64_t count, int64_t m, const uz_stop *stop)
{
    int64_t since = GATHERED;
    for (int64_t l = 0; l < count; l++) {
        if (since >= GATHERED && uz_stop_is_due(stop))
            return false;
        since = since >= GATHERED ? count : since + count; /* a column's upper part may be made with its page */
        for (int64_t k = l; k < count; k++)
            D_AA[k + l * count] = D[rows[k] + rows[l] * m];
    }
    return true;
}

enum { CORRECTION_ROUNDS = 6 };

/* What may be left of a penetration, relative to the largest gap moved: the certificate sees to the rest. */
#define CORRECTION_TOLERANCE 1e-9

enum { REFINEMENTS = 2 };

/* w (m) with D w = target on the listed rows as far as they are independent, zero elsewhere; refined, as D_AA is the
 * inverse of a stiffness and as badly conditioned. Dw (m) is D w, also where it had to stop before w was right. D_AA is
 * room for count^2. */
static bool solve_rows(double *w, double *Dw, double *D_AA, uz_dual_load *load, const double *target,
                       const int64_t *rows, int64_t count)
{
    int64_t m = load->dual->info.m, *pivot = uz_alloc(count, sizeof *pivot);
    double *x = uz_alloc(count, sizeof *x);
    bool ok = pivot && x;
    memset(w, 0, (size_t)m * sizeof *w);
    memset(Dw, 0, (size_t)m * sizeof *Dw);
    if (ok) {
        bool gathered = uz_gather_lower(D_AA, load->D, rows, count, m, &load->stop);
        int64_t rank = gathered ? uz_pstrf_lower_while(count, D_AA, pivot, UZ_PIVOT_LEAST, &load->stop) : 0;
        ok = rank >= 0;
        for (int pass = 0; ok && pass <= REFINEMENTS && !uz_stop_is_due(&load->stop); pass++) {
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
static bool correct_rows(uz_dual_load *load, double *w, double *target, const double *g, const bool *close)
{
    int64_t m = load->dual->info.m, *rows = uz_alloc(m, sizeof *rows);
    const double *D = load->D;
    bool *in = uz_alloc(m, sizeof *in), feasible = false, ok = rows && in;
    double *D_AA = ok ? uz_alloc(m * m, sizeof *D_AA) : NULL, scale = 0.0;
    for (int64_t i = 0; D_AA && i < m; i++) {
        in[i] = close[i] || g[i] < 0.0;
        scale = in[i] ? fmax(scale, fabs(g[i])) : scale;
    }
    for (int round = 0; D_AA && ok && !feasible && round < CORRECTION_ROUNDS && !uz_stop_is_due(&load->stop); round++) {
        ok = solve_rows(w, target, D_AA, load, g, rows, uz_list_rows(rows, in, true, m));
        double noise = 8.0 * DBL_EPSILON * rounding_sum(D, w, m);
        feasible = ok;
        for (int64_t i = 0; i < m; i++) {
            bool wrong = g[i] - target[i] < -CORRECTION_TOLERANCE * scale - sqrt(D[i + i * m]) * noise;
            feasible = feasible && !wrong;
            in[i] = in[i] || wrong;
        }
    }
    free(rows);
    free(in);
    free(D_AA);
    return feasible;
}

/* The correction K^-1 N'w as it is kept, and its square in the energy norm. target (m): D w. */
static double keep_weights(uz_dual_load *load, const double *w, const double *target)
{
    const uz_condensed *dense = &load->dual->dense;
    if (dense->reach) {
        memcpy(load->correction, w, (size_t)load->dual->info.m * sizeof *w);
        return fmax(0.0, uz_dot(load->dual->info.m, w, target));
    }
    uz_condensed_response(load->correction, dense, w);
    return uz_dot(dense->n_b, load->correction, load->correction);
}

uz_status uz_condensed_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close)
{
    const uz_condensed *dense = &load->dual->dense;
    int64_t m = load->dual->info.m;
    double *target = load->work, *z = load->correction, square = 0.0, complementarity = 0.0;
    for (int64_t i = 0; i < m; i++)
        target[i] = close[i] ? g[i] : fmin(g[i], 0.0);
    if (dense->scaled) {
        for (int64_t k = 0; k < m; k++)
            z[k] = target[dense->row_of[k]] / dense->scale[k];
        uz_trmv_lower_t(m, dense->L_bb, z);
        square = uz_dot(m, z, z);
    } else if (dense->D_chol) {
        memcpy(load->work2, target, (size_t)m * sizeof *target);
        uz_potrs_lower(m, dense->D_chol, load->work2);
        square = keep_weights(load, load->work2, target);
    } else if (correct_rows(load, load->work2, target, g, close)) {
        square = keep_weights(load, load->work2, target);
    } else {
        return UZ_OK;
    }
    for (int64_t i = 0; i < m; i++)
        complementarity -= r[i] * fmax(0.0, g[i] - target[i]);
    *bound2 = square + 2.0 * complementarity;
    return UZ_OK;
}
