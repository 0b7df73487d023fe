/* condensed_active.c: what takes dense work with some rows of the contact: the problem with these rows as equations,
 * and feasible displacements near u(r); and the dense matrices made on demand. */
#include "dual/condensed.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/lock.h"
#include "law/sign.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACED = 64 }; /* columns between questions whether to go on: their entries go all over memory */

/* D = N_b S^-1 N_b', the inverse from the factor, or D^-1 = N_b^-T S N_b^-1 with S = L_bb L_bb'; then signs and places.
 * Made once for all loads; the load's own copy of the pointer stays NULL where making it had to stop. */
static uz_status need(uz_condensed_load *x, bool inverse, uz_error *err)
{
    const uz_condensed *dense = x->dense;
    const double **out = inverse ? &x->D_inverse : &x->D, *L = dense->L_bb;
    double **slot = inverse ? &dense->made->D_inverse : &dense->made->D;
    const uz_stop *stop = &x->load.stop;
    const int64_t n = dense->n_b, size = n * n;
    uz_status status = UZ_OK;
    if (*out)
        return UZ_OK;
    if (!uz_lock_while(&dense->dual.lazy->making, stop))
        return UZ_OK;
    if (!*slot) {
        double *made = uz_alloc(size, sizeof *made), *room = uz_alloc(size, sizeof *room);
        bool ok = made && room;
        if (!ok)
            status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)n);
        else if (inverse) /* and the pages of what it goes to, in order */
            ok = uz_multiply_llt_while(n, L, room, made, stop) && uz_clear_while(size, made, stop);
        else
            ok = uz_invert_llt_while(n, L, room, made, stop);
        for (int64_t l = 0; ok && l < n; l++) { /* from the factor's order to that of the rows, scaled */
            const double scale_l = inverse ? 1.0 / dense->scale[l] : dense->scale[l];
            ok = l % PLACED != 0 || !uz_stop_is_due(stop);
            for (int64_t k = l; ok && k < n; k++) {
                const double scale_k = inverse ? 1.0 / dense->scale[k] : dense->scale[k];
                const int64_t row = dense->row_of[k], column = dense->row_of[l];
                made[row >= column ? row + column * n : column + row * n] = scale_k * scale_l * room[k + l * n];
            }
        }
        if (status == UZ_OK && !ok && !uz_stop_is_due(stop))
            status = uz_fail(err, UZ_ERR_NOT_SPD, "K", "the Schur complement on the contact is singular");
        free(room);
        if (status == UZ_OK && !uz_stop_is_due(stop))
            *slot = made;
        else
            free(made);
    }
    *out = *slot;
    pthread_mutex_unlock(&dense->dual.lazy->making);
    return status;
}

uz_status uz_condensed_prepare(uz_dual_load *load, uz_error *err)
{
    return need((uz_condensed_load *)load, false, err);
}

uz_status uz_condensed_inverse_column(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    const int64_t m = load->dual->m;
    *can = false;
    uz_status status = x->dense->scaled ? need(x, true, err) : UZ_OK;
    if (status != UZ_OK || !x->dense->scaled || !x->D_inverse)
        return status;
    *can = true;
    for (int64_t k = 0; k < i; k++)
        column[k] = x->D_inverse[i + k * m];
    memcpy(column + i, x->D_inverse + i + i * m, (size_t)(m - i) * sizeof *column);
    return UZ_OK;
}

/* Lists in `rows` the rows with in == which, ascending; their number. */
static int64_t list_rows(int64_t *rows, const bool *in, bool which, int64_t m)
{
    int64_t count = 0;
    for (int64_t i = 0; i < m; i++)
        if (in[i] == which)
            rows[count++] = i;
    return count;
}

enum { GATHERED = 1 << 17 }; /* entries between questions whether to go on: a megabyte of a new block */

/* D_AA (count x count, lower) = rows and columns `rows` of the symmetric m x m matrix D; false: it had to stop. */
static bool gather_lower(double *D_AA, const double *D, const int64_t *rows, int64_t count, int64_t m,
                         const uz_stop *stop)
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

/* Signs below this, relative to the largest of their kind, are rounding: weakly active rows must not make the steps
 * chatter. */
#define NOISE (64.0 * DBL_EPSILON)

static double largest(const double *x, int64_t n)
{
    double value = 0.0;
    for (int64_t i = 0; i < n; i++)
        value = fmax(value, fabs(x[i]));
    return value;
}

static void forgive_rounding(double *r, double *g, const uz_condensed_load *x, const bool *active)
{
    int64_t m = x->load.dual->m;
    double r_noise = NOISE * largest(r, m), g_noise = NOISE * largest(x->load.g0, m);
    for (int64_t i = 0; i < m; i++) {
        if (active[i] && uz_reaction_pulls(r[i]) && r[i] <= r_noise)
            r[i] = 0.0;
        if (!active[i] && uz_gap_penetrates(g[i]) && g[i] >= -g_noise)
            g[i] = 0.0;
    }
}

/* Rows are independent where the compliance that each keeps when those before it are held stands out from the rounding
 * of D: a pivot that is noise makes reactions that are noise, of the right signs often enough. Rows that come after two
 * that nearly depend on each other take over their rounding, divided by the share that these keep. */
static bool are_independent(const double *chol, const double *D, const int64_t *rows, int64_t count, int64_t m)
{
    double least = 1.0;
    for (int64_t k = 0; k < count; k++) {
        double kept = chol[k + k * count] * chol[k + k * count] / D[rows[k] + rows[k] * m];
        if (!(kept > fmax(UZ_DEPENDENT_ROW, 4.0 * DBL_EPSILON / least)))
            return false;
        least = fmin(least, kept);
    }
    return true;
}

enum { PASSES = 2 }; /* solve, and once more for the residual */

/* The Cholesky factor (count x count) of the rows to be solved for, which are listed: of D the active ones, or of T =
 * D^-1 the others. *block NULL: it is singular, or had to stop. */
static uz_status factor_rows(double **block, int64_t *rows, int64_t *count, uz_condensed_load *x, const bool *active,
                             bool others, uz_error *err)
{
    const uz_stop *stop = &x->load.stop;
    const int64_t m = x->load.dual->m;
    *count = list_rows(rows, active, !others, m);
    const uz_status status = others || x->dense->scaled ? need(x, others, err) : UZ_OK;
    const double *matrix = others ? x->D_inverse : x->D;
    double *made = status == UZ_OK ? uz_alloc(*count * *count, sizeof *made) : NULL;
    *block = made;
    if (status == UZ_OK && !made)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)*count);
    const bool ok = status == UZ_OK && matrix && gather_lower(made, matrix, rows, *count, m, stop) &&
                    uz_potrf_lower_while(*count, made, stop) &&
                    (x->dense->scaled || are_independent(made, x->D, rows, *count, m));
    if (!ok) {
        free(made);
        *block = NULL;
    }
    return status;
}

/* By D_AA r_A = g0_A, or in the scaled form by T = D^-1: with v = g0 - g, r = T v, and r_I = 0 gives T_II x_I =
 * -T_IA g0_A: the fewer of both are solved for. In that form the second pass solves for what the first left of the
 * gaps, computed through the factor: T is badly conditioned, as D is, and its answer not yet that of the body. */
uz_status uz_condensed_solve_active(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active,
                                    uz_error *err)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    const uz_stop *stop = &load->stop;
    const bool scaled = x->dense->scaled;
    int64_t m = load->dual->m, count, *rows = uz_alloc(m, sizeof *rows);
    double *v = x->work, *change = x->work2, *block = NULL;
    if (!rows)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)m);
    bool others = scaled && 2 * list_rows(rows, active, true, m) >= m;
    uz_status status = factor_rows(&block, rows, &count, x, active, others, err);
    if (status == UZ_OK && !block && scaled && !others && !uz_stop_is_due(stop)) {
        others = true;
        status = factor_rows(&block, rows, &count, x, active, true, err);
    }
    bool ok = status == UZ_OK && block;
    double *part = others ? change : v; /* at the rows, one after the other */
    if (ok) {
        memset(r, 0, (size_t)m * sizeof *r);
        memcpy(g, load->g0, (size_t)m * sizeof *g);
    }
    for (int pass = 0; ok && pass < PASSES; pass++) {
        if (others) {
            memcpy(v, g, (size_t)m * sizeof *v);
            for (int64_t k = 0; k < count; k++)
                v[rows[k]] = 0.0;
            uz_symv_lower(m, x->D_inverse, v, change);
            if (!(ok = !uz_stop_is_due(stop)))
                break;
        }
        for (int64_t k = 0; k < count; k++)
            part[k] = others ? change[rows[k]] : g[rows[k]]; /* rows ascend: none is written before it is read */
        uz_potrs_lower(count, block, count, part);
        if (!(ok = !uz_stop_is_due(stop)))
            break;
        for (int64_t k = 0; k < count; k++)
            if (others)
                v[rows[k]] = -part[k];
            else
                r[rows[k]] += part[k];
        if (others) {
            uz_symv_lower(m, x->D_inverse, v, change);
            if (!(ok = !uz_stop_is_due(stop)))
                break;
            for (int64_t k = 0; k < count; k++)
                change[rows[k]] = 0.0;
            for (int64_t i = 0; i < m; i++)
                r[i] += change[i];
        }
        if (scaled)
            uz_condensed_apply_factor(change, x, r);
        else
            uz_symv_lower(m, x->D, r, change);
        ok = !uz_stop_is_due(stop);
        for (int64_t i = 0; i < m; i++)
            g[i] = load->g0[i] - change[i];
    }
    if (ok) {
        *end = UZ_ACTIVE_SOLVED;
        forgive_rounding(r, g, x, active);
    }
    uz_free_all(block, rows);
    return status;
}

enum { CORRECTION_ROUNDS = 6 };

/* What may be left of a penetration, relative to the largest gap moved: the certificate sees to the rest. */
#define CORRECTION_TOLERANCE 1e-9

enum { REFINEMENTS = 2 };

/* Where D is singular: closes the rows to close and the penetrating ones as equations, then also those that penetrate
 * because of it, until none does. By w (m) with D w = g on these rows as far as they are independent, zero elsewhere;
 * refined, as D_AA is the inverse of a stiffness and as badly conditioned. target (m) becomes what was reached, N c =
 * D w, also where it had to stop before w was right; the correction is K^-1 N'w. */
static bool correct_rows(uz_condensed_load *x, double *w, double *target, const double *g, const bool *close)
{
    const uz_stop *stop = &x->load.stop;
    int64_t m = x->load.dual->m, *rows = uz_alloc(m, sizeof *rows), *pivot = uz_alloc(m, sizeof *pivot);
    const double *D = x->D;
    double *part = uz_alloc(m, sizeof *part);
    bool *in = uz_alloc(m, sizeof *in), feasible = false, ok = rows && in && pivot && part;
    double *D_AA = ok ? uz_alloc(m * m, sizeof *D_AA) : NULL, scale = 0.0;
    for (int64_t i = 0; D_AA && i < m; i++) {
        in[i] = close[i] || uz_gap_penetrates(g[i]);
        scale = in[i] ? fmax(scale, fabs(g[i])) : scale;
    }
    for (int round = 0; D_AA && ok && !feasible && round < CORRECTION_ROUNDS && !uz_stop_is_due(stop); round++) {
        const int64_t count = list_rows(rows, in, true, m);
        const bool gathered = gather_lower(D_AA, D, rows, count, m, stop);
        const int64_t rank = gathered ? uz_pstrf_lower_while(count, D_AA, pivot, UZ_PIVOT_LEAST, stop) : 0;
        memset(w, 0, (size_t)m * sizeof *w);
        memset(target, 0, (size_t)m * sizeof *target);
        ok = rank >= 0;
        for (int pass = 0; ok && pass <= REFINEMENTS && !uz_stop_is_due(stop); pass++) {
            for (int64_t k = 0; k < rank; k++)
                part[k] = g[rows[pivot[k]]] - target[rows[pivot[k]]];
            uz_potrs_lower(rank, D_AA, count, part);
            for (int64_t k = 0; k < rank; k++)
                w[rows[pivot[k]]] += part[k];
            (void)uz_condensed_apply(&x->load, target, w, NULL);
        }
        /* |D| |w| row by row is at most sqrt(D_ii) times this sum: what rounding leaves of D w is in proportion. */
        double sum = 0.0;
        for (int64_t j = 0; j < m; j++)
            sum += sqrt(D[j + j * m]) * fabs(w[j]);
        double noise = 8.0 * DBL_EPSILON * sum;
        feasible = ok;
        for (int64_t i = 0; i < m; i++) {
            bool wrong =
                uz_gap_penetration(g[i] - target[i]) > CORRECTION_TOLERANCE * scale + sqrt(D[i + i * m]) * noise;
            feasible = feasible && !wrong;
            in[i] = in[i] || wrong;
        }
    }
    uz_free_all(rows, pivot, part, in, D_AA);
    return feasible;
}

/* The correction K^-1 N'w as it is kept, and its square in the energy norm. target (m): D w. */
static double keep_weights(const uz_condensed_load *x, const double *w, const double *target)
{
    const uz_condensed *dense = x->dense;
    if (dense->reach) {
        memcpy(x->load.correction, w, (size_t)x->load.dual->m * sizeof *w);
        return fmax(0.0, uz_dot(x->load.dual->m, w, target));
    }
    uz_condensed_response(x->load.correction, dense, w);
    return uz_dot(dense->n_b, x->load.correction, x->load.correction);
}

uz_status uz_condensed_correct(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close)
{
    uz_condensed_load *x = (uz_condensed_load *)load;
    const uz_condensed *dense = x->dense;
    int64_t m = x->load.dual->m;
    double *target = x->work, *z = x->load.correction, square = 0.0, complementarity = 0.0;
    for (int64_t i = 0; i < m; i++)
        target[i] = close[i] ? g[i] : uz_gap_to_lift(g[i]);
    if (dense->scaled) {
        for (int64_t k = 0; k < m; k++)
            z[k] = target[dense->row_of[k]] / dense->scale[k];
        uz_trmv_lower_t(m, dense->L_bb, z);
        square = uz_dot(m, z, z);
    } else if (dense->D_chol) {
        memcpy(x->work2, target, (size_t)m * sizeof *target);
        uz_potrs_lower(m, dense->D_chol, m, x->work2);
        square = keep_weights(x, x->work2, target);
    } else if (correct_rows(x, x->work2, target, g, close)) {
        square = keep_weights(x, x->work2, target);
    } else {
        return UZ_OK;
    }
    for (int64_t i = 0; i < m; i++)
        complementarity -= r[i] * fmax(0.0, g[i] - target[i]);
    *bound2 = square + 2.0 * complementarity;
    return UZ_OK;
}
