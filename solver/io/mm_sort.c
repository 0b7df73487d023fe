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

/* ptr[1 + j] counts column j at entry; at exit ptr[j] is the start of column j. */
static void fill_buckets(place *places, uz_csc *A, const int64_t *col, int64_t count)
{
    int64_t start = 0;
    for (int64_t j = 1; j <= A->cols; j++) {
        int64_t size = A->ptr[j];
        A->ptr[j] = start;
        start += size;
    }
    for (int64_t k = 0; k < count; k++)
        places[A->ptr[1 + col[k]]++] = (place){A->idx[k], k};
}

static bool rows_ascend(const place *places, int64_t count)
{
    for (int64_t k = 1; k < count; k++) {
        if (places[k].row < places[k - 1].row)
            return false;
    }
    return true;
}

static void insertion_sort(place *places, int64_t count)
{
    for (int64_t k = 1; k < count; k++) {
        place moving = places[k];
        int64_t at = k;
        for (; at > 0 && places[at - 1].row > moving.row; at--)
            places[at] = places[at - 1];
        places[at] = moving;
    }
}

/* Stable merge of two sorted neighbours; an empty right half is legal. */
static void merge(place *to, const place *left, int64_t n_left, const place *right, int64_t n_right)
{
    int64_t i = 0, j = 0;
    while (i < n_left && j < n_right)
        *to++ = right[j].row < left[i].row ? right[j++] : left[i++];
    if (i < n_left)
        memcpy(to, left + i, (size_t)(n_left - i) * sizeof *to);
    else if (j < n_right)
        memcpy(to, right + j, (size_t)(n_right - j) * sizeof *to);
}

static int64_t smaller(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Stable, by row. work: count places. */
static void merge_sort(place *places, place *work, int64_t count)
{
    place *from = places, *to = work;
    for (int64_t k = 0; k < count; k += SHORT_RUN)
        insertion_sort(places + k, smaller(SHORT_RUN, count - k));
    for (int64_t run = SHORT_RUN; run < count; run *= 2) {
        for (int64_t k = 0; k < count; k += 2 * run) {
            int64_t n_left = smaller(run, count - k), n_right = smaller(run, count - k - n_left);
            merge(to + k, from + k, n_left, from + k + n_left, n_right);
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
        if (rows_ascend(column, length))
            continue;
        if (!work && !(work = uz_alloc(longest, sizeof *work)))
            return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to sort a column");
        merge_sort(column, work, length);
    }
    free(work);
    return UZ_OK;
}

static int64_t first_repeated(const place *places, const uz_csc *A)
{
    int64_t first = -1;
    for (int64_t j = 0; j < A->cols; j++) {
        for (int64_t at = A->ptr[j] + 1; at < A->ptr[j + 1]; at++) {
            if (places[at].row == places[at - 1].row && (first < 0 || places[at].k < first))
                first = places[at].k;
        }
    }
    return first;
}

uz_status mm_sort_columns(uz_csc *A, int64_t **col, int64_t count, int64_t *repeated, uz_error *err)
{
    uz_status status = UZ_OK;
    double *val = NULL;
    place *places = uz_alloc(count, sizeof *places);
    *repeated = -1;
    if (places)
        fill_buckets(places, A, *col, count);
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
    *repeated = first_repeated(places, A);
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
