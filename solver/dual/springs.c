#include "dual/springs.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <string.h>

/* Entries of S, counted with repetitions, over those of K and N: beyond it S is no sparse matrix any more. */
enum { MOST_FILL = 16 };

/* of_rows in a matrix, lower triangle, columns sorted; false: it does not have all of them. */
static bool place_rows(uz_springs *a, const uz_csc *S)
{
    const uz_csc *Nt = &a->dual->Nt;
    int64_t *at = a->of_rows;
    for (int64_t i = 0; i < a->dual->m; i++)
        for (int64_t k = Nt->ptr[i]; (!a->rows || a->rows[i]) && k < Nt->ptr[i + 1]; k++)
            for (int64_t l = Nt->ptr[i]; l <= k; l++) { /* dofs of a row ascend */
                *at = uz_csc_find(S, Nt->idx[k], Nt->idx[l]);
                if (*at++ < 0)
                    return false;
            }
    return true;
}

/* S with the entries of K and of the pairs of dofs that are in a row together, and their places. */
static uz_status unite_patterns(uz_springs *a, uz_error *err)
{
    const uz_csc *Nt = &a->dual->Nt, *K = a->K;
    const int64_t d = a->dual->d;
    uz_entries all = {.n = 0};
    a->of_K = uz_alloc(K->ptr[d], sizeof *a->of_K);
    if (!a->of_K)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)a->dual->m);
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            uz_entries_add(&all, K->idx[k], j, 0);
    for (int64_t i = 0; i < a->dual->m; i++)
        for (int64_t k = Nt->ptr[i]; (!a->rows || a->rows[i]) && k < Nt->ptr[i + 1]; k++)
            for (int64_t l = Nt->ptr[i]; l <= k; l++)
                uz_entries_add(&all, Nt->idx[k], Nt->idx[l], 0);
    const uz_status status = uz_csc_from_entries(&a->S, d, d, &all, err);
    for (int64_t j = 0; status == UZ_OK && j < d; j++) /* both are sorted */
        for (int64_t k = K->ptr[j], s = a->S.ptr[j]; k < K->ptr[j + 1]; k++) {
            while (a->S.idx[s] < K->idx[k])
                s++;
            a->of_K[k] = s;
        }
    if (status == UZ_OK)
        (void)place_rows(a, &a->S);
    return status;
}

uz_status uz_springs_create(uz_springs *a, const uz_csc *K, const uz_dual *dual, const bool *rows, uz_error *err)
{
    const uz_csc *Nt = &dual->Nt;
    int64_t pairs = 0;
    *a = (uz_springs){.K = K, .dual = dual, .rows = rows};
    for (int64_t i = 0; i < dual->m; i++)
        pairs += !rows || rows[i] ? (Nt->ptr[i + 1] - Nt->ptr[i]) * (Nt->ptr[i + 1] - Nt->ptr[i] + 1) / 2 : 0;
    if (K->ptr[dual->d] + pairs > MOST_FILL * (K->ptr[dual->d] + dual->d + Nt->ptr[dual->m]))
        return UZ_OK;
    a->of_rows = uz_alloc(pairs, sizeof *a->of_rows);
    if (!a->of_rows)
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for %lld rows as equations", (long long)dual->m);
    const uz_factor_info info = uz_factor_describe(dual->factor);
    const bool within = place_rows(a, K);
    uz_status status = within ? uz_csc_copy(&a->S, K, err) : unite_patterns(a, err);
    if (status == UZ_OK && within && !info.contact_last)
        a->analysis = uz_factor_analysis(dual->factor);
    else if (status == UZ_OK)
        status = uz_analysis_create(&a->analysis, &a->S, NULL, 0, 0, info.ordering, NULL, err);
    return status;
}

void uz_springs_fill(uz_springs *a, const double *sigma)
{
    const uz_csc *Nt = &a->dual->Nt, *K = a->K;
    const int64_t *at = a->of_rows;
    memset(a->S.val, 0, (size_t)a->S.ptr[a->S.cols] * sizeof *a->S.val);
    for (int64_t k = 0; k < K->ptr[K->cols]; k++)
        a->S.val[a->of_K ? a->of_K[k] : k] = K->val[k];
    for (int64_t i = 0; i < a->dual->m; i++)
        for (int64_t k = Nt->ptr[i]; (!a->rows || a->rows[i]) && k < Nt->ptr[i + 1]; k++)
            for (int64_t l = Nt->ptr[i]; l <= k; l++)
                a->S.val[*at++] += sigma[i] * Nt->val[k] * Nt->val[l];
}

void uz_springs_clear(uz_springs *a)
{
    uz_csc_clear(&a->S);
    uz_analysis_free(a->analysis);
    uz_free_all(a->of_K, a->of_rows);
    a->of_K = a->of_rows = NULL;
    a->analysis = NULL;
}
