/* The problem in matrices: freeing it, and checking all that can be known without a factorization. */
#include "uzawa.h"

#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <math.h>
#include <string.h>

void uz_qp_clear(uz_qp *qp)
{
    if (!qp)
        return;
    uz_csc_clear(&qp->K);
    uz_csc_clear(&qp->N);
    uz_free_all(qp->p, qp->h);
    memset(qp, 0, sizeof *qp);
}

/* Column starts in order; in a column rows that ascend within the stored part, and finite values. */
static uz_status check_matrix(const uz_csc *A, bool lower, const char *name, uz_error *err)
{
    if (!A->ptr || A->ptr[0] != 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, name, "%s has no column starts", name);
    for (int64_t j = 0; j < A->cols; j++) {
        int64_t above = lower ? j - 1 : -1;
        if (A->ptr[j + 1] < A->ptr[j])
            return uz_fail(err, UZ_ERR_ARGUMENT, name, "the column starts of %s do not ascend", name);
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            if (A->idx[k] <= above || A->idx[k] >= A->rows)
                return uz_fail(err, UZ_ERR_ARGUMENT, name,
                               "%s, column %lld: row indices must ascend and stay within the stored part", name,
                               (long long)j + 1);
            above = A->idx[k];
            if (!isfinite(A->val[k]))
                return uz_fail(err, UZ_ERR_NOT_FINITE, name, "%s(%lld, %lld) is not a finite number (counted from 1)",
                               name, (long long)above + 1, (long long)j + 1);
        }
    }
    return UZ_OK;
}

uz_status uz_check_finite(const double *x, int64_t n, const char *name, uz_error *err)
{
    for (int64_t i = 0; x && i < n; i++)
        if (!isfinite(x[i]))
            return uz_fail(err, UZ_ERR_NOT_FINITE, name, "%s(%lld) is not a finite number (counted from 1)", name,
                           (long long)i + 1);
    return UZ_OK;
}

/* Below it the errors of products with it leave the range of normal numbers, and its own digits are gone soon after. */
#define STIFFNESS_LEAST 0x1p-960

/* N may be a zeroed struct when there are no contacts. */
uz_status uz_qp_check(const uz_qp *qp, uz_error *err)
{
    const uz_csc *K = &qp->K, *N = &qp->N;
    uz_error_reset(err);
    if (K->rows != K->cols)
        return uz_fail(err, UZ_ERR_SIZE, "K", "K is %lld x %lld; a stiffness matrix is square", (long long)K->rows,
                       (long long)K->cols);
    if (K->rows <= 0)
        return uz_fail(err, UZ_ERR_SIZE, "K", "K is empty; a problem needs at least one unknown");
    if (N->rows < 0 || (N->cols != K->cols && (N->rows != 0 || N->cols != 0)))
        return uz_fail(err, UZ_ERR_SIZE, "N", "N is %lld x %lld but K is %lld x %lld; N needs %lld columns",
                       (long long)N->rows, (long long)N->cols, (long long)K->rows, (long long)K->cols,
                       (long long)K->cols);
    uz_status status = check_matrix(K, true, "K", err);
    for (int64_t j = 0; j < K->cols && status == UZ_OK; j++) {
        const int64_t k = K->ptr[j];
        if (k < K->ptr[j + 1] && K->idx[k] == j && K->val[k] > 0.0 && K->val[k] < STIFFNESS_LEAST)
            return uz_fail(err, UZ_ERR_RANGE, "K",
                           "K(%lld, %lld) = %.3g (counted from 1) is too small to calculate with in double precision: "
                           "choose other units of force or length",
                           (long long)j + 1, (long long)j + 1, K->val[k]);
    }
    if (status == UZ_OK && N->cols > 0)
        status = check_matrix(N, false, "N", err);
    const struct {
        const double *x;
        int64_t n;
        const char *name;
    } vectors[] = {{qp->h, N->rows, "h"}, {qp->p, K->cols, "p"}};
    for (int i = 0; i < 2 && status == UZ_OK; i++) {
        if (vectors[i].n > 0 && !vectors[i].x)
            return uz_fail(err, UZ_ERR_SIZE, vectors[i].name, "%s is missing; it must have %lld numbers",
                           vectors[i].name, (long long)vectors[i].n);
        status = uz_check_finite(vectors[i].x, vectors[i].n, vectors[i].name, err);
    }
    return status;
}
