/* lanczos.c: the largest eigenvalue of the dual operator. */
#include "dual/form.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/lock.h"
#include "linalg/blas.h"

#include <math.h>
#include <string.h>

enum { MAX_STEPS = 120, CHECK_EVERY = 4 };

/* alpha = 1 / lambda_max must not be too long a step; 1e-4 too short costs nothing. */
#define TOLERANCE 1e-4

/* The largest eigenvalue of the tridiagonal matrix of n steps and the norm beta |s_last| of its residual. room: for
 * its eigenproblem, 2 n + n n. */
static bool find_ritz(double *value, double *residual, const double *alpha, const double *beta, int64_t n, double *room)
{
    double *vectors = room + 2 * n;
    memcpy(room, alpha, (size_t)n * sizeof *room);
    memcpy(room + n, beta, (size_t)n * sizeof *room);
    if (!uz_stev(n, room, room + n, vectors))
        return false;
    *value = room[n - 1];
    *residual = beta[n - 1] * fabs(vectors[(n - 1) * n + n - 1]);
    return true;
}

/* Lanczos with full reorthogonalisation. */
uz_status uz_dual_load_lambda_max(uz_dual_load *load, double *lambda_max, bool weighted, uz_error *err)
{
    const uz_dual *dual = load->dual;
    const uz_dual_form *form = dual->form;
    const double *weight = weighted ? dual->row_weight : NULL;
    const int64_t m = dual->m, steps = m < MAX_STEPS ? m : MAX_STEPS;
    double *known = &dual->lazy->lambda_max[weight != NULL], value = 0.0, residual = 0.0;
    *lambda_max = 0.0;
    load->asked_lambda_max = true;
    if (!uz_lock_while(&dual->lazy->making, &load->stop))
        return UZ_OK;
    if (!isnan(*known)) {
        *lambda_max = *known;
        pthread_mutex_unlock(&dual->lazy->making);
        return UZ_OK;
    }
    uz_status status = UZ_OK;
    double *basis = uz_alloc(m * (steps + 2), sizeof *basis); /* m x (steps + 1), and W v */
    double *alpha = uz_alloc(steps * (4 + steps), sizeof *alpha), *beta = alpha ? alpha + steps : NULL, norm = 0.0;
    if (!basis || !alpha)
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld Lanczos vectors", (long long)steps);
    /* a fixed pseudo-random start: no direction of a structured problem is orthogonal to it, and runs repeat */
    uint64_t state = 0x9E3779B97F4A7C15u;
    for (int64_t i = 0; status == UZ_OK && i < m; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        basis[i] = 0.5 + (double)(state >> 11) * 0x1p-53;
    }
    if (status == UZ_OK)
        norm = uz_norm(m, basis);
    for (int64_t i = 0; status == UZ_OK && i < m; i++)
        basis[i] /= norm;
    if (form->probe)
        form->probe(load, true, 0.1 * TOLERANCE);
    for (int64_t k = 0; status == UZ_OK && k < steps; k++) {
        double *v = basis + k * m, *w = v + m, *Wv = basis + m * (steps + 1);
        for (int64_t i = 0; weight && i < m; i++)
            Wv[i] = weight[i] * v[i];
        status = UZ_ERR_CANCELLED;
        if (uz_stop_is_due(&load->stop))
            break;
        load->applications++;
        status = form->apply(load, w, weight ? Wv : v, err);
        if (status != UZ_OK)
            break;
        for (int64_t i = 0; weight && i < m; i++)
            w[i] *= weight[i];
        alpha[k] = uz_dot(m, v, w);
        /* Two passes of Gram-Schmidt against all earlier vectors ("twice is enough", Parlett 1980). */
        for (int pass = 0; pass < 2; pass++)
            for (int64_t j = 0; j <= k; j++)
                uz_axpy(m, -uz_dot(m, basis + j * m, w), basis + j * m, w);
        beta[k] = uz_norm(m, w);
        const bool last = k + 1 == steps || beta[k] <= 1e-14 * fabs(alpha[0]),
                   due = last || k % CHECK_EVERY == CHECK_EVERY - 1;
        if (due && !find_ritz(&value, &residual, alpha, beta, k + 1, beta + steps))
            status = uz_fail(err, UZ_ERR_INTERNAL, "N", "the tridiagonal eigenproblem did not converge");
        if (due && (last || residual <= TOLERANCE * value))
            break;
        for (int64_t i = 0; i < m; i++)
            w[i] /= beta[k];
    }
    if (form->probe)
        form->probe(load, false, 0.0);
    uz_free_all(basis, alpha);
    if (status == UZ_OK && !uz_stop_is_due(&load->stop)) { /* else applications may have been cut short */
        *lambda_max = fmax(0.0, value + residual);
        pthread_mutex_lock(&dual->lazy->known); /* kept for the body's other runs */
        *known = *lambda_max;
        pthread_mutex_unlock(&dual->lazy->known);
    }
    pthread_mutex_unlock(&dual->lazy->making);
    return status == UZ_ERR_CANCELLED ? UZ_OK : status;
}
