/* lanczos.c: the largest eigenvalue of the dual operator. */
#include "dual/lanczos.h"

#include "core/alloc.h"
#include "linalg/blas.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_STEPS = 120, CHECK_EVERY = 4 };

typedef struct {
    double *basis;           /* m x (steps + 1) */
    double *alpha, *beta;    /* diagonal, subdiagonal of the tridiagonal matrix */
    double *d, *e, *vectors; /* its eigenproblem, steps x steps */
} lanczos;

/* Largest Ritz value of the first k + 1 steps and its residual norm beta |s_last|. */
static bool ritz(lanczos *z, int64_t k, double *value, double *residual)
{
    int64_t n = k + 1;
    memcpy(z->d, z->alpha, (size_t)n * sizeof(double));
    memcpy(z->e, z->beta, (size_t)n * sizeof(double));
    if (!uz_stev(n, z->d, z->e, z->vectors))
        return false;
    *value = z->d[n - 1];
    *residual = z->beta[k] * fabs(z->vectors[(n - 1) * n + n - 1]);
    return true;
}

uz_status uz_lanczos_max(double *lambda, int64_t m, uz_apply apply, void *ctx, double tolerance, uz_error *err)
{
    int64_t steps = m < MAX_STEPS ? m : MAX_STEPS;
    lanczos z = {.basis = uz_alloc(m * (steps + 1), sizeof(double)),
                 .alpha = uz_alloc(steps, sizeof(double)),
                 .beta = uz_alloc(steps + 1, sizeof(double)),
                 .d = uz_alloc(steps, sizeof(double)),
                 .e = uz_alloc(steps + 1, sizeof(double)),
                 .vectors = uz_alloc(steps * steps, sizeof(double))};
    double value = 0.0, residual = 0.0;
    uz_status status = UZ_OK;
    *lambda = 0.0;
    if (!z.basis || !z.alpha || !z.beta || !z.d || !z.e || !z.vectors)
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld Lanczos vectors", (long long)steps);
    else if (m > 0) {
        /* a fixed pseudo-random start: no direction of a structured problem is orthogonal to it, and runs repeat */
        uint64_t state = 0x9E3779B97F4A7C15u;
        for (int64_t i = 0; i < m; i++) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            z.basis[i] = 0.5 + (double)(state >> 11) * 0x1p-53;
        }
        double norm = uz_norm(m, z.basis);
        for (int64_t i = 0; i < m; i++)
            z.basis[i] /= norm;
    }
    for (int64_t k = 0; status == UZ_OK && k < steps; k++) {
        double *v = z.basis + k * m, *w = v + m;
        status = apply(ctx, w, v, err);
        if (status != UZ_OK)
            break;
        z.alpha[k] = uz_dot(m, v, w);
        /* Two passes of Gram-Schmidt against all earlier vectors ("twice is enough", Parlett 1980). */
        for (int pass = 0; pass < 2; pass++)
            for (int64_t j = 0; j <= k; j++)
                uz_axpy(m, -uz_dot(m, z.basis + j * m, w), z.basis + j * m, w);
        z.beta[k] = uz_norm(m, w);
        bool last = k + 1 == steps || z.beta[k] <= 1e-14 * fabs(z.alpha[0]);
        if (last || k % CHECK_EVERY == CHECK_EVERY - 1) {
            if (!ritz(&z, k, &value, &residual))
                status = uz_fail(err, UZ_ERR_INTERNAL, "N", "the tridiagonal eigenproblem did not converge");
            if (last || residual <= tolerance * value)
                break;
        }
        for (int64_t i = 0; i < m; i++)
            w[i] /= z.beta[k];
    }
    if (status == UZ_OK)
        *lambda = fmax(0.0, value + residual);
    free(z.basis);
    free(z.alpha);
    free(z.beta);
    free(z.d);
    free(z.e);
    free(z.vectors);
    return status;
}
