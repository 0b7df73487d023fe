#include "dual/springs.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Entries of S, counted with repetitions, over those of K and N: beyond it S is no sparse matrix any more. */
enum { MOST_FILL = 16 };

/* Where entry (row, column) of the lower triangle stands; columns are sorted. */
static int64_t find(const uz_csc *S, int64_t row, int64_t column)
{
    int64_t low = S->ptr[column], high = S->ptr[column + 1] - 1;
    while (low < high) {
        const int64_t middle = low + (high - low) / 2;
        if (S->idx[middle] < row)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

uz_status uz_springs_create(uz_springs *a, const uz_csc *K, const uz_dual *dual, const bool *rows, uz_error *err)
{
    const uz_csc *Nt = &dual->Nt;
    const int64_t m = dual->m, d = dual->d;
    int64_t pairs = 0;
    *a = (uz_springs){.K = K, .dual = dual, .rows = rows};
    for (int64_t i = 0; i < m; i++)
        pairs += !rows || rows[i] ? (Nt->ptr[i + 1] - Nt->ptr[i]) * (Nt->ptr[i + 1] - Nt->ptr[i] + 1) / 2 : 0;
    if (K->ptr[d] + pairs > MOST_FILL * (K->ptr[d] + d + Nt->ptr[m]))
        return UZ_OK;
    const int64_t count = K->ptr[d] + pairs;
    int64_t *row = uz_alloc(count, sizeof *row), *column = uz_alloc(count, sizeof *column);
    double *value = uz_alloc_zero(count, sizeof *value);
    a->of_K = uz_alloc(K->ptr[d], sizeof *a->of_K);
    a->of_rows = uz_alloc(pairs, sizeof *a->of_rows);
    uz_status status = UZ_OK;
    if (row && column && value && a->of_K && a->of_rows) {
        int64_t at = 0;
        for (int64_t j = 0; j < d; j++)
            for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++, at++) {
                row[at] = K->idx[k];
                column[at] = j;
            }
        for (int64_t i = 0; i < m; i++)
            for (int64_t k = Nt->ptr[i]; (!rows || rows[i]) && k < Nt->ptr[i + 1]; k++)
                for (int64_t l = Nt->ptr[i]; l <= k; l++, at++) { /* dofs of a row ascend */
                    row[at] = Nt->idx[k];
                    column[at] = Nt->idx[l];
                }
        status = uz_csc_from_triplets(&a->S, d, d, at, row, column, value, err);
        for (int64_t k = 0; status == UZ_OK && k < at; k++)
            *(k < K->ptr[d] ? &a->of_K[k] : &a->of_rows[k - K->ptr[d]]) = find(&a->S, row[k], column[k]);
    } else {
        status = uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)m);
    }
    free(row);
    free(column);
    free(value);
    return status;
}

void uz_springs_fill(uz_springs *a, const double *sigma)
{
    const uz_csc *Nt = &a->dual->Nt, *K = a->K;
    const int64_t *at = a->of_rows;
    memset(a->S.val, 0, (size_t)a->S.ptr[a->S.cols] * sizeof *a->S.val);
    for (int64_t k = 0; k < K->ptr[K->cols]; k++)
        a->S.val[a->of_K[k]] = K->val[k];
    for (int64_t i = 0; i < a->dual->m; i++)
        for (int64_t k = Nt->ptr[i]; (!a->rows || a->rows[i]) && k < Nt->ptr[i + 1]; k++)
            for (int64_t l = Nt->ptr[i]; l <= k; l++)
                a->S.val[*at++] += sigma[i] * Nt->val[k] * Nt->val[l];
}

void uz_springs_clear(uz_springs *a)
{
    uz_csc_clear(&a->S);
    free(a->of_K);
    free(a->of_rows);
    a->of_K = a->of_rows = NULL;
}
