/* lanczos.c: the largest eigenvalue of the dual operator. */
#include "dual/lanczos.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "dual/form.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_STEPS = 120, CHECK_EVERY = 4 };

uz_status uz_lanczos_max(double *lambda, uz_dual_load *load, const double *weight, double tolerance, uz_error *err)
{
    const int64_t m = load->dual->m, steps = m < MAX_STEPS ? m : MAX_STEPS;
    double *weighted = uz_alloc(weight ? m : 0, sizeof *weighted); /* W v */
    double *basis = uz_alloc(m * (steps + 1), sizeof *basis);      /* m x (steps + 1) */
    /* diagonal, subdiagonal of the tridiagonal matrix; room for its eigenproblem, and its vectors */
    double *alpha = uz_alloc(steps, sizeof *alpha), *beta = uz_alloc(steps + 1, sizeof *beta);
    double *d = uz_alloc(steps, sizeof *d), *e = uz_alloc(steps + 1, sizeof *e);
    double *vectors = uz_alloc(steps * steps, sizeof *vectors), value = 0.0, residual = 0.0;
    uz_status status = UZ_OK;
    *lambda = 0.0;
    if (!weighted || !basis || !alpha || !beta || !d || !e || !vectors)
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld Lanczos vectors", (long long)steps);
    else if (m > 0) {
        /* a fixed pseudo-random start: no direction of a structured problem is orthogonal to it, and runs repeat */
        uint64_t state = 0x9E3779B97F4A7C15u;
        for (int64_t i = 0; i < m; i++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            basis[i] = 0.5 + (double)(state >> 11) * 0x1p-53;
        }
        double norm = uz_norm(m, basis);
        for (int64_t i = 0; i < m; i++)
            basis[i] /= norm;
    }
    for (int64_t k = 0; status == UZ_OK && k < steps; k++) {
        double *v = basis + k * m, *w = v + m;
        for (int64_t i = 0; weight && i < m; i++)
            weighted[i] = weight[i] * v[i];
        status = UZ_ERR_CANCELLED;
        if (uz_stop_is_due(&load->stop))
            break;
        load->applications++;
        status = load->dual->form->apply(load, w, weight ? weighted : v, err);
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
        const bool last = k + 1 == steps || beta[k] <= 1e-14 * fabs(alpha[0]);
        if (last || k % CHECK_EVERY == CHECK_EVERY - 1) {
            /* the largest Ritz value so far, and its residual norm beta |s_last| */
            memcpy(d, alpha, (size_t)(k + 1) * sizeof *d);
            memcpy(e, beta, (size_t)(k + 1) * sizeof *e);
            if (uz_stev(k + 1, d, e, vectors)) {
                value = d[k];
                residual = beta[k] * fabs(vectors[k * (k + 1) + k]);
            } else {
                status = uz_fail(err, UZ_ERR_INTERNAL, "N", "the tridiagonal eigenproblem did not converge");
            }
            if (last || residual <= tolerance * value)
                break;
        }
        for (int64_t i = 0; i < m; i++)
            w[i] /= beta[k];
    }
    if (status == UZ_OK)
        *lambda = fmax(0.0, value + residual);
    free(weighted);
    free(basis);
    free(alpha);
    free(beta);
    free(d);
    free(e);
    free(vectors);
    return status;
}
