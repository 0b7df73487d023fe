#include "io/mm_sort.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* Entry k of the text, in this row. */
typedef struct {
    int64_t row, k;
} place;

enum { SHORT_RUN = 16 };

static int64_t smaller(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Stable, by row. work: count places. */
static void merge_sort(place *places, place *work, int64_t count)
{
    place *from = places, *to = work;
    for (int64_t first = 0; first < count; first += SHORT_RUN)
        for (int64_t k = first + 1; k < first + smaller(SHORT_RUN, count - first); k++) {
            const place moving = places[k];
            int64_t at = k;
            for (; at > first && places[at - 1].row > moving.row; at--)
                places[at] = places[at - 1];
            places[at] = moving;
        }
    for (int64_t run = SHORT_RUN; run < count; run *= 2) {
        for (int64_t k = 0; k < count; k += 2 * run) {
            /* A merge of two neighbours; the right half may be empty. */
            const int64_t n_left = smaller(run, count - k), n_right = smaller(run, count - k - n_left);
            const place *left = from + k, *right = left + n_left;
            place *out = to + k;
            int64_t i = 0, j = 0;
            while (i < n_left && j < n_right)
                *out++ = right[j].row < left[i].row ? right[j++] : left[i++];
            memcpy(out, i < n_left ? left + i : right + j, (size_t)(n_left - i + n_right - j) * sizeof *out);
        }
        place *swap = from;
        from = to;
        to = swap;
    }
    if (from != places)
        memcpy(places, from, (size_t)count * sizeof *places);
}

static uz_status sort_rows(place *places, const uz_csc *A, uz_error *err)
{
    place *work = NULL;
    int64_t longest = 0;
    for (int64_t j = 0; j < A->cols; j++)
        longest = A->ptr[j + 1] - A->ptr[j] > longest ? A->ptr[j + 1] - A->ptr[j] : longest;
    for (int64_t j = 0; j < A->cols; j++) {
        int64_t length = A->ptr[j + 1] - A->ptr[j];
        place *column = places + A->ptr[j];
        int64_t k = 1;
        while (k < length && column[k].row >= column[k - 1].row)
            k++;
        if (k >= length)
            continue;
        if (!work && !(work = uz_alloc(longest, sizeof *work)))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to sort a column");
        merge_sort(column, work, length);
    }
    free(work);
    return UZ_OK;
}

uz_status mm_sort_columns(uz_csc *A, int64_t **col, int64_t count, int64_t *repeated, uz_error *err)
{
    uz_status status = UZ_OK;
    double *val = NULL;
    place *places = uz_alloc(count, sizeof *places);
    *repeated = -1;
    if (places) {
        int64_t start = 0;
        for (int64_t j = 1; j <= A->cols; j++) {
            const int64_t size = A->ptr[j];
            A->ptr[j] = start;
            start += size;
        }
        for (int64_t k = 0; k < count; k++) /* which leaves the start of column j at ptr[j] */
            places[A->ptr[1 + (*col)[k]]++] = (place){A->idx[k], k};
    }
    free(*col); /* its room is needed for the values */
    *col = NULL;
    val = places ? uz_alloc(count, sizeof *val) : NULL;
    if (!val) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to sort %lld entries", (long long)count);
        goto done;
    }
    status = sort_rows(places, A, err);
    if (status != UZ_OK)
        goto done;
    for (int64_t j = 0; j < A->cols; j++)
        for (int64_t at = A->ptr[j] + 1; at < A->ptr[j + 1]; at++)
            if (places[at].row == places[at - 1].row && (*repeated < 0 || places[at].k < *repeated))
                *repeated = places[at].k;
    for (int64_t at = 0; at < count; at++) {
        A->idx[at] = places[at].row;
        val[at] = A->val[places[at].k];
    }
    free(A->val);
    A->val = val;
    val = NULL;
done:
    free(places);
    free(val);
    return status;
}
