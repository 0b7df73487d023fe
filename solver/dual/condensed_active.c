/* condensed_active.c: the contact problem with given rows as equations, and the dense matrices made on demand. */
#include "dual/dual_private.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"
#include "core/lock.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACED = 64 }; /* columns between questions whether to go on: their entries go all over memory */

/* to = scale_k scale_l from_kl at the rows of k and l: from the factor's order to the order of the rows. */
static bool place_rows(double *to, const uz_condensed *dense, const double *from, bool invert_scale,
                       const uz_stop *stop)
{
    int64_t m = dense->n_b;
    for (int64_t l = 0; l < m; l++) {
        if (l % PLACED == 0 && uz_stop_is_due(stop))
            return false;
        double scale_l = invert_scale ? 1.0 / dense->scale[l] : dense->scale[l];
        for (int64_t k = l; k < m; k++) {
            double scale_k = invert_scale ? 1.0 / dense->scale[k] : dense->scale[k];
            int64_t row = dense->row_of[k], column = dense->row_of[l];
            to[row >= column ? row + column * m : column + row * m] = scale_k * scale_l * from[k + l * m];
        }
    }
    return true;
}

/* D = N_b S^-1 N_b': the inverse from the factor, then signs and places. */
static bool form_operator(double *D, double *room, const uz_condensed *dense, const uz_stop *stop)
{
    if (!uz_invert_llt_while(dense->n_b, dense->L_bb, room, D, stop))
        return false;
    return place_rows(D, dense, room, false, stop);
}

/* D^-1 = N_b^-T S N_b^-1 with S = L_bb L_bb'. */
static bool form_inverse(double *D_inverse, double *room, const uz_condensed *dense, const uz_stop *stop)
{
    if (!uz_multiply_llt_while(dense->n_b, dense->L_bb, room, D_inverse, stop))
        return false;
    if (!uz_clear_while(dense->n_b * dense->n_b, D_inverse, stop)) /* its pages, in order */
        return false;
    return place_rows(D_inverse, dense, room, true, stop);
}

typedef bool (*former)(double *out, double *room, const uz_condensed *dense, const uz_stop *stop);

/* *slot once and for all; *out is the load's own copy of the pointer, NULL where making it had to stop. */
static uz_status need(const double **out, double **slot, uz_dual_load *load, former form, uz_error *err)
{
    const uz_condensed *dense = &load->dual->dense;
    int64_t size = dense->n_b * dense->n_b;
    uz_status status = UZ_OK;
    if (*out)
        return UZ_OK;
    if (!uz_lock_while(&load->dual->lazy->making, &load->stop))
        return UZ_OK;
    if (!*slot) {
        double *made = uz_alloc(size, sizeof *made), *room = uz_alloc(size, sizeof *room);
        if (!made || !room)
            status =
                uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for a dense operator of order %lld", (long long)dense->n_b);
        else if (!form(made, room, dense, &load->stop) && !uz_stop_is_due(&load->stop))
            status = uz_fail(err, UZ_ERR_NOT_SPD, "K", "the Schur complement on the contact is singular");
        free(room);
        if (status == UZ_OK && !uz_stop_is_due(&load->stop))
            *slot = made;
        else
            free(made);
    }
    *out = *slot;
    pthread_mutex_unlock(&load->dual->lazy->making);
    return status;
}

uz_status uz_condensed_need_operator(uz_dual_load *load, uz_error *err)
{
    return need(&load->D, &load->dual->lazy->D, load, form_operator, err);
}

int64_t uz_list_rows(int64_t *rows, const bool *in, bool which, int64_t m)
{
    int64_t count = 0;
    for (int64_t i = 0; i < m; i++)
        if (in[i] == which)
            rows[count++] = i;
    return count;
}

enum { PASSES = 2 }; /* solve, and once more for the residual */

/* r_A from D_AA r_A = g0_A. false: it had to stop. */
static bool solve_by_operator(uz_dual_load *load, double *r, double *g, const double *chol, const int64_t *rows,
                              int64_t count)
{
    int64_t m = load->dual->info.m;
    double *x = load->work;
    memset(r, 0, (size_t)m * sizeof *r);
    memcpy(g, load->g0, (size_t)m * sizeof *g);
    for (int pass = 0; pass < PASSES; pass++) {
        for (int64_t k = 0; k < count; k++)
            x[k] = g[rows[k]];
        uz_potrs_lower(count, chol, x);
        if (uz_stop_is_due(&load->stop))
            return false;
        for (int64_t k = 0; k < count; k++)
            r[rows[k]] += x[k];
        uz_symv_lower(m, load->D, r, load->work2);
        for (int64_t i = 0; i < m; i++)
            g[i] = load->g0[i] - load->work2[i];
        if (uz_stop_is_due(&load->stop))
            return false;
    }
    return true;
}

/* x at the rows = -(block)^-1 x there. */
static void solve_block(double *x, double *room, const double *chol, const int64_t *rows, int64_t count)
{
    for (int64_t k = 0; k < count; k++)
        room[k] = x[rows[k]];
    uz_potrs_lower(count, chol, room);
    for (int64_t k = 0; k < count; k++)
        x[rows[k]] = -room[k];
}

/* With T = D^-1 and x = g0 - g: r = T x, and r_I = 0 gives T_II x_I = -T_IA g0_A: the rows that do not touch, mostly
 * the fewer, are solved for, and D is not needed. The second pass solves for what the first left of the gaps, computed
 * through the factor: T is badly conditioned, its answer is not yet that of the body. false: it had to stop. */
static bool solve_by_inverse(uz_dual_load *load, double *r, double *g, const double *chol, const int64_t *rows,
                             int64_t count)
{
    int64_t m = load->dual->info.m;
    double *x = load->work, *change = load->work2;
    memset(r, 0, (size_t)m * sizeof *r);
    memcpy(g, load->g0, (size_t)m * sizeof *g);
    for (int pass = 0; pass < PASSES; pass++) {
        memcpy(x, g, (size_t)m * sizeof *x);
        for (int64_t k = 0; k < count; k++)
            x[rows[k]] = 0.0;
        uz_symv_lower(m, load->D_inverse, x, change);
        for (int64_t k = 0; k < count; k++)
            x[rows[k]] = change[rows[k]];
        if (uz_stop_is_due(&load->stop))
            return false;
        solve_block(x, change, chol, rows, count);
        if (uz_stop_is_due(&load->stop))
            return false;
        uz_symv_lower(m, load->D_inverse, x, change);
        for (int64_t k = 0; k < count; k++)
            change[rows[k]] = 0.0;
        for (int64_t i = 0; i < m; i++)
            r[i] += change[i];
        if (uz_stop_is_due(&load->stop))
            return false;
        uz_condensed_apply(load, change, r);
        for (int64_t i = 0; i < m; i++)
            g[i] = load->g0[i] - change[i];
        if (uz_stop_is_due(&load->stop))
            return false;
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

static void forgive_rounding(double *r, double *g, const uz_dual_load *load, const bool *active)
{
    int64_t m = load->dual->info.m;
    double r_noise = NOISE * largest(r, m), g_noise = NOISE * largest(load->g0, m);
    for (int64_t i = 0; i < m; i++) {
        if (active[i] && r[i] > 0.0 && r[i] <= r_noise)
            r[i] = 0.0;
        if (!active[i] && g[i] < 0.0 && g[i] >= -g_noise)
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

uz_status uz_condensed_solve_active(uz_dual_load *load, double *r, double *g, bool *solved, const bool *active,
                                    uz_error *err)
{
    bool scaled = load->dual->dense.scaled;
    int64_t m = load->dual->info.m, count, *rows = uz_alloc(m, sizeof *rows);
    uz_status status = UZ_OK;
    if (!rows)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)m);
    count = uz_list_rows(rows, active, !scaled, m);
    if (scaled)
        status = need(&load->D_inverse, &load->dual->lazy->D_inverse, load, form_inverse, err);
    bool formed = scaled ? load->D_inverse != NULL : load->D != NULL;
    double *block = uz_alloc(count * count, sizeof *block);
    if (status == UZ_OK && !block)
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows", (long long)count);
    if (status == UZ_OK && formed) {
        *solved = uz_gather_lower(block, scaled ? load->D_inverse : load->D, rows, count, m, &load->stop) &&
                  uz_potrf_lower_while(count, block, &load->stop) &&
                  (scaled || are_independent(block, load->D, rows, count, m)) &&
                  (scaled ? solve_by_inverse : solve_by_operator)(load, r, g, block, rows, count);
        if (*solved)
            forgive_rounding(r, g, load, active);
    }
    free(block);
    free(rows);
    return status;
}
