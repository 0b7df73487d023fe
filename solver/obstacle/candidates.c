#include "obstacle/candidates.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_candidates_first(uz_candidates *out, const double *h, int64_t m, double reach, uz_error *err)
{
    double least = INFINITY;
    *out = (uz_candidates){.m = m, .in = uz_alloc_zero(m, 1)};
    if (!out->in) {
        out->m = 0;
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contact candidates", (long long)m);
    }
    for (int64_t i = 0; i < m; i++)
        least = fmin(least, h[i]);
    const double most = fmax(least, 0) + reach;
    for (int64_t i = 0; i < m; i++) {
        out->in[i] = !(h[i] > most);
        out->count += out->in[i];
    }
    return UZ_OK;
}

void uz_candidates_clear(uz_candidates *candidates)
{
    free(candidates->in);
    memset(candidates, 0, sizeof *candidates);
}

void uz_gap_sizes(double *size, const double *h, const uz_csc *N, const double *u)
{
    for (int64_t i = 0; i < N->rows; i++)
        size[i] = fabs(h[i]);
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            size[N->idx[q]] += fabs(N->val[q] * u[j]);
}

int64_t uz_candidates_extend(uz_candidates *candidates, const uz_law *law, const double *g, const double *size,
                             double rounding)
{
    uz_candidates *c = candidates;
    const int64_t before = c->count;
    double deepest = 0, own; /* penetration of the rows left out: INFINITY where a gap is no number */
    for (int64_t i = 0; i < c->m; i++) {
        if (c->in[i])
            continue;
        law->kind->penetration(law, &own, &g[i], 1);
        if (isnan(g[i]))
            deepest = INFINITY;
        else if (!(own <= rounding * size[i]))
            deepest = fmax(deepest, own);
    }
    for (int64_t i = 0; i < c->m && deepest > 0; i++)
        if (!c->in[i] && !(g[i] > deepest)) {
            c->in[i] = 1;
            c->count++;
        }
    return c->count - before;
}

uz_status uz_candidates_reduce(uz_csc *out, const uz_csc *N, const uz_candidates *candidates, uz_error *err)
{
    int64_t nnz = 0, row = 0;
    int64_t *number = uz_alloc(candidates->m, sizeof *number);
    memset(out, 0, sizeof *out);
    if (!number)
        return uz_no_memory(err, "contact candidates");
    for (int64_t i = 0; i < candidates->m; i++)
        number[i] = candidates->in[i] ? row++ : -1;
    for (int64_t q = 0; q < N->ptr[N->cols]; q++)
        nnz += candidates->in[N->idx[q]];
    const uz_status status = uz_csc_init(out, candidates->count, N->cols, nnz, err);
    nnz = 0;
    for (int64_t j = 0; j < N->cols && status == UZ_OK; j++) {
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++)
            if (candidates->in[N->idx[q]]) {
                out->idx[nnz] = (int32_t)number[N->idx[q]];
                out->val[nnz++] = N->val[q];
            }
        out->ptr[j + 1] = nnz;
    }
    free(number);
    return status;
}

void uz_candidates_gather(double *out, const double *all, const uz_candidates *candidates)
{
    for (int64_t i = 0, k = 0; i < candidates->m; i++)
        if (candidates->in[i])
            out[k++] = all[i];
}

void uz_candidates_scatter(double *all, const double *part, const uz_candidates *candidates)
{
    for (int64_t i = 0, k = 0; i < candidates->m; i++)
        all[i] = candidates->in[i] ? part[k++] : 0;
}
