/* The entries of a coordinate text. Entries that come in column order are stored where they belong as they are read;
 * from the first one that does not, columns are remembered and everything is sorted at the end. */
#include "io/mm_text.h"

#include "core/alloc.h"
#include "core/error.h"

#include <stdlib.h>
#include <string.h>

/* ---- entries in any order become columns */

/* Entry k of the text, in this row. */
typedef struct {
    int64_t row, k;
} place;

enum { SHORT_RUN = 16 };

/* Stable, by row. work: count places. */
static void merge_sort(place *places, place *work, int64_t count)
{
    place *from = places, *to = work;
    for (int64_t first = 0; first < count; first += SHORT_RUN)
        for (int64_t k = first + 1; k < first + SHORT_RUN && k < count; k++) {
            const place moving = places[k];
            int64_t at = k;
            for (; at > first && places[at - 1].row > moving.row; at--)
                places[at] = places[at - 1];
            places[at] = moving;
        }
    for (int64_t run = SHORT_RUN; run < count; run *= 2) {
        for (int64_t k = 0; k < count; k += 2 * run) {
            /* A merge of two neighbours; the right half may be empty. */
            const int64_t left_over = count - k, n_left = run < left_over ? run : left_over;
            const int64_t n_right = run < left_over - n_left ? run : left_over - n_left;
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

/* In: A->idx[k], A->val[k], (*col)[k] are row, value and column of entry k < count; A->ptr[1 + j] counts column j.
 * Out: *A in compressed columns with ascending rows. *repeated is the smallest k that has the place of an earlier
 * entry, -1 if there is none; both then stand in A. Frees *col and makes it NULL. O(count log(column length)), and
 * O(count + columns) where the entries came row by row; takes no room by the number of rows. */
static uz_status sort_columns(uz_csc *A, int64_t **col, int64_t count, int64_t *repeated, uz_error *err)
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
        A->idx[at] = (int32_t)places[at].row;
        val[at] = A->val[places[at].k];
    }
    free(A->val);
    A->val = val;
    val = NULL;
done:
    uz_free_all(places, val);
    return status;
}

/* ---- the text */

typedef struct {
    int64_t row, col; /* 0-based */
    double value;
} entry;

/* While reading: A->idx and A->val in the order of the text, A->ptr[1 + j] the number of entries of column j. */
typedef struct {
    uz_csc *A;
    int64_t capacity, count;
    int64_t last_row, last_col;
    int64_t *col; /* column of each entry; NULL while the entries are in order */
} gather;

static uz_status read_index(mm_text *text, int64_t size, const char *what, int64_t *index)
{
    mm_skip_blanks(text);
    const char *start = text->at;
    *index = mm_count(text) - 1;
    if (*index >= 0 && *index < size && mm_word_ends(text))
        return UZ_OK;
    text->at = start;
    return mm_fail(text, what, "each line is ROW COLUMN VALUE, counted from 1 and within the announced sizes");
}

static uz_status read_entry(mm_text *text, const uz_mm_info *info, entry *e)
{
    uz_status status = read_index(text, info->rows, "a row number was expected", &e->row);
    if (status == UZ_OK)
        status = read_index(text, info->cols, "a column number was expected", &e->col);
    if (status != UZ_OK)
        return status;
    if (info->symmetry == UZ_MM_SYMMETRIC && e->row < e->col)
        return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line,
                            "entry (%lld, %lld) is above the diagonal; a symmetric text holds the lower triangle only",
                            (long long)e->row + 1, (long long)e->col + 1);
    mm_skip_blanks(text);
    return mm_read_value(text, info->integer, &e->value);
}

static uz_status fail_repeated(const mm_text *text, const entry *e)
{
    return uz_fail_line(text->err, UZ_ERR_FORMAT, text->line,
                        "entry (%lld, %lld) was given before; write each place once, with the sum if that is meant",
                        (long long)e->row + 1, (long long)e->col + 1);
}

static uz_status read_entries(gather *g, mm_text *text, const uz_mm_info *info)
{
    uz_status status = UZ_OK;
    uz_csc *A = g->A;
    while (status == UZ_OK && g->count < info->entries) {
        entry e;
        bool found;
        status = mm_next_line(text, &found);
        if (status == UZ_OK && !found)
            status = mm_fail_missing(text, info, g->count);
        if (status == UZ_OK)
            status = read_entry(text, info, &e);
        if (status != UZ_OK)
            return status;
        if (!g->col && e.col <= g->last_col && (e.col < g->last_col || e.row <= g->last_row)) {
            if (e.col == g->last_col && e.row == g->last_row)
                return fail_repeated(text, &e);
            /* Leaves the ordered way: the columns of the entries so far follow from their counts. */
            g->col = uz_alloc(g->capacity, sizeof *g->col);
            if (!g->col)
                return uz_fail(text->err, UZ_ERR_MEMORY, "", "no memory to sort %lld entries", (long long)g->capacity);
            for (int64_t j = 0, at = 0; j <= g->last_col; j++)
                for (int64_t k = 0; k < A->ptr[1 + j]; k++)
                    g->col[at++] = j;
        }
        if (g->count == g->capacity)
            return uz_fail(text->err, UZ_ERR_INTERNAL, "", "more entries than the text has room for");
        A->idx[g->count] = (int32_t)e.row;
        A->val[g->count] = e.value;
        A->ptr[1 + e.col]++;
        if (g->col)
            g->col[g->count] = e.col;
        g->count++;
        g->last_row = e.row;
        g->last_col = e.col;
        status = mm_end_line(text);
    }
    return status == UZ_OK ? mm_expect_end(text, info) : status;
}

uz_status mm_read_coordinate(uz_csc *A, mm_text *text, const uz_mm_info *info, int64_t room)
{
    gather g = {.A = A, .capacity = room, .last_row = -1, .last_col = -1};
    mm_text body = *text;
    uz_status status = read_entries(&g, text, info);
    int64_t repeated = -1;
    for (int64_t j = 0; status == UZ_OK && !g.col && j < A->cols; j++)
        A->ptr[j + 1] += A->ptr[j];
    if (status == UZ_OK && g.col)
        status = sort_columns(A, &g.col, g.count, &repeated, text->err);
    if (status == UZ_OK && repeated >= 0) {
        /* Reads again from the first data line, which was found correct, to name the line of the repeated entry. */
        entry e = {0};
        for (bool found; mm_next_line(&body, &found) == UZ_OK && found; repeated--)
            if (read_entry(&body, info, &e) != UZ_OK || repeated == 0 || mm_end_line(&body) != UZ_OK)
                break;
        status = fail_repeated(&body, &e);
    }
    free(g.col);
    return status;
}
