/* A general square matrix that should be symmetric, checked and cut to its lower triangle. */
#include "uzawa.h"

#include "core/error.h"
#include "linalg/linalg.h"

#include <math.h>
#include <string.h>

/* A stiffness matrix that a program assembled twice, once per half, differs by rounding; 1e-12 leaves room for that. */
static const double SYMMETRY_TOLERANCE = 1e-12;

/* The two halves of one off-diagonal place, or twice the diagonal: a = K(i,j), b = K(j,i), 0 where not stored. */
typedef struct {
    int64_t i, j;
    double a, b;
} pair;

/* Walks column j of K and of its transpose T together, rows >= j ascending. */
typedef struct {
    const uz_csc *K, *T;
    int64_t j, at_k, at_t;
} pair_walk;

static bool walk_next(pair_walk *walk, pair *out)
{
    const uz_csc *K = walk->K, *T = walk->T;
    int64_t row_k = walk->at_k < K->ptr[walk->j + 1] ? K->idx[walk->at_k] : INT64_MAX;
    int64_t row_t = walk->at_t < T->ptr[walk->j + 1] ? T->idx[walk->at_t] : INT64_MAX;
    *out = (pair){row_k < row_t ? row_k : row_t, walk->j, 0.0, 0.0};
    if (row_k == out->i && row_k != INT64_MAX)
        out->a = K->val[walk->at_k++];
    if (row_t == out->i && row_t != INT64_MAX)
        out->b = T->val[walk->at_t++];
    return out->i != INT64_MAX;
}

/* Counts the places of the lower triangle that either half fills, and finds the worst pair: by |a - b| over the larger
 * of the two diagonal entries, infinite where those are zero and a, b differ. */
static int64_t inspect(const uz_csc *K, const uz_csc *T, pair *worst, double *worst_asymmetry)
{
    int64_t count = 0;
    *worst_asymmetry = 0.0;
    for (int64_t j = 0; j < K->cols; j++) {
        pair_walk walk = {K, T, j, uz_csc_seek(K, j, j), uz_csc_seek(T, j, j)};
        for (pair p; walk_next(&walk, &p); count++) {
            const double difference = fabs(p.a - p.b);
            if (difference == 0.0)
                continue;
            const int64_t ii = uz_csc_find(K, p.i, p.i), jj = uz_csc_find(K, j, j);
            const double scale = fmax(ii < 0 ? 0.0 : fabs(K->val[ii]), jj < 0 ? 0.0 : fabs(K->val[jj]));
            const double ratio = scale > 0.0 ? difference / scale : INFINITY;
            if (ratio > *worst_asymmetry) {
                *worst_asymmetry = ratio;
                *worst = p;
            }
        }
    }
    return count;
}

uz_status uz_symmetric_lower(uz_csc *K, uz_error *err)
{
    uz_csc T = {0}, lower = {0};
    pair worst = {0};
    double ratio = 0.0;
    uz_error_reset(err);
    if (K->rows != K->cols)
        return uz_fail(err, UZ_ERR_SIZE, "K", "K is %lld x %lld; a stiffness matrix is square", (long long)K->rows,
                       (long long)K->cols);
    for (int64_t k = 0; K->ptr && k < K->ptr[K->cols]; k++)
        if (!isfinite(K->val[k]))
            return uz_fail(err, UZ_ERR_NOT_FINITE, "K", "K has an entry in row %lld that is not a finite number",
                           (long long)K->idx[k] + 1);
    uz_status status = uz_csc_transpose(&T, K, err);
    if (status != UZ_OK)
        goto done;
    int64_t count = K->ptr ? inspect(K, &T, &worst, &ratio) : 0;
    if (ratio > SYMMETRY_TOLERANCE) {
        status = uz_fail(err, UZ_ERR_NOT_SYMMETRIC, "K",
                         "K is not symmetric: entry (%lld, %lld) is %.17g and (%lld, %lld) is %.17g (counted from 1); "
                         "send both halves equal, or a symmetric file with the lower triangle only",
                         (long long)worst.i + 1, (long long)worst.j + 1, worst.a, (long long)worst.j + 1,
                         (long long)worst.i + 1, worst.b);
        goto done;
    }
    status = uz_csc_init(&lower, K->rows, K->cols, count, err);
    if (status != UZ_OK)
        goto done;
    if (K->ptr) {
        int64_t at = 0;
        for (int64_t j = 0; j < K->cols; j++) {
            pair_walk walk = {K, &T, j, uz_csc_seek(K, j, j), uz_csc_seek(&T, j, j)};
            for (pair p; walk_next(&walk, &p); at++) {
                lower.idx[at] = (int32_t)p.i;
                lower.val[at] = p.a + 0.5 * (p.b - p.a); /* exactly a where a = b */
            }
            lower.ptr[j + 1] = at;
        }
    }
    uz_csc_clear(K);
    *K = lower;
    memset(&lower, 0, sizeof lower);
done:
    uz_csc_clear(&T);
    uz_csc_clear(&lower);
    return status;
}
