/* row_walk.c: full rows of a symmetric matrix from the columns of its lower triangle, without a second copy of it. */
#include "amg/multigrid_private.h"

#include "core/alloc.h"

#include <stdlib.h>
#include <string.h>

bool uz_row_walk_init(uz_row_walk *walk, const uz_csc *A)
{
    memset(walk, 0, sizeof *walk);
    walk->A = A;
    walk->first = uz_alloc(A->cols, sizeof *walk->first);
    walk->next = uz_alloc(A->cols, sizeof *walk->next);
    walk->at = uz_alloc(A->cols, sizeof *walk->at);
    if (!walk->first || !walk->next || !walk->at)
        return false;
    int32_t *count = walk->first; /* entries of each row, for now */
    int64_t longest = 1;
    memset(count, 0, (size_t)A->cols * sizeof *count);
    for (int64_t j = 0; j < A->cols; j++) {
        count[j] += (int32_t)(A->ptr[j + 1] - A->ptr[j]);
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++)
            if (A->idx[k] != j)
                count[A->idx[k]]++;
    }
    for (int64_t j = 0; j < A->cols; j++)
        longest = count[j] > longest ? count[j] : longest;
    walk->column = uz_alloc(longest, sizeof *walk->column);
    walk->value = uz_alloc(longest, sizeof *walk->value);
    for (int64_t i = 0; i < A->cols; i++)
        walk->first[i] = -1;
    return walk->column && walk->value;
}

void uz_row_walk_clear(uz_row_walk *walk)
{
    free(walk->first);
    free(walk->next);
    free(walk->at);
    free(walk->column);
    free(walk->value);
    memset(walk, 0, sizeof *walk);
}

/* Column j waits for the row of its next entry. */
static void wait_for_row(uz_row_walk *walk, int64_t j)
{
    if (walk->at[j] >= walk->A->ptr[j + 1])
        return;
    int64_t row = walk->A->idx[walk->at[j]];
    walk->next[j] = walk->first[row];
    walk->first[row] = (int32_t)j;
}

void uz_row_walk_read(uz_row_walk *walk, int64_t i)
{
    const uz_csc *A = walk->A;
    int64_t count = 0;
    for (int32_t j = walk->first[i], next; j >= 0; j = next) {
        next = walk->next[j];
        walk->column[count] = j;
        walk->value[count++] = A->val[walk->at[j]++];
        wait_for_row(walk, j);
    }
    for (int64_t k = A->ptr[i]; k < A->ptr[i + 1]; k++) {
        walk->column[count] = (int32_t)A->idx[k];
        walk->value[count++] = A->val[k];
    }
    walk->count = count;
    walk->at[i] = A->ptr[i] + 1; /* the diagonal comes first */
    wait_for_row(walk, i);
}
