#include "semicoercive/augment.h"

#include "certificate/row_move.h"
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/linalg.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static double diagonal(const uz_csc *K, int64_t j)
{
    int64_t first = K->ptr[j];
    return first < K->ptr[j + 1] && K->idx[first] == j ? K->val[first] : 0.0;
}

void uz_row_stiffness(double *stiffness, double *inverse, const uz_csc *K, const uz_csc *Nt)
{
    double largest = 0.0;
    for (int64_t j = 0; j < K->cols; j++)
        largest = fmax(largest, diagonal(K, j));
    if (!(largest > 0.0))
        largest = 1.0;
    for (int64_t j = 0; j < K->cols; j++) {
        double value = diagonal(K, j);
        inverse[j] = 1.0 / (value > 0.0 ? value : largest);
    }
    for (int64_t i = 0; i < Nt->cols; i++) {
        double value = 1.0 / uz_row_compliance(Nt, i, inverse);
        stiffness[i] = isnormal(value) ? ldexp(1.0, ilogb(value)) : 0.0;
    }
}

uz_status uz_augment(uz_problem *out, const uz_singular *of, const uz_csc *Nt, const double *weight,
                     const double *target, uz_error *err)
{
    const int64_t d = of->K->cols;
    memset(out, 0, sizeof *out);
    out->kind = UZ_PROBLEM_MATRICES;
    double *p = uz_alloc(d, sizeof *p);
    if (!p)
        return uz_fail(err, UZ_ERR_MEMORY, "p", "no memory for a load on %lld dofs", (long long)d);
    const uz_csc *K = of->K;
    uz_entries all = {.n = 0}; /* of the lower triangle of K + N'R N */
    for (int64_t j = 0; j < d; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            uz_entries_add(&all, K->idx[q], j, K->val[q]);
    for (int64_t i = 0; i < Nt->cols; i++)
        for (int64_t a = Nt->ptr[i]; weight[i] > 0.0 && a < Nt->ptr[i + 1]; a++)
            for (int64_t b = Nt->ptr[i]; b <= a; b++) /* rows ascend */
                uz_entries_add(&all, Nt->idx[a], Nt->idx[b], weight[i] * Nt->val[a] * Nt->val[b]);
    const uz_status status = uz_csc_from_entries(&out->qp.K, d, d, &all, err);
    memcpy(p, of->p, (size_t)d * sizeof *p);
    for (int64_t i = 0; i < Nt->cols; i++)
        for (int64_t a = Nt->ptr[i]; weight[i] > 0.0 && a < Nt->ptr[i + 1]; a++)
            p[Nt->idx[a]] += weight[i] * target[i] * Nt->val[a];
    out->qp.p = p;
    out->qp.N = *of->N;
    out->qp.h = (double *)of->h; /* only read */
    if (status != UZ_OK)
        uz_augmented_clear(out);
    return status;
}

void uz_augmented_clear(uz_problem *augmented)
{
    uz_csc_clear(&augmented->qp.K);
    free(augmented->qp.p);
    memset(augmented, 0, sizeof *augmented);
}

void uz_augmented_noise(double *noise, const uz_problem *augmented, const uz_csc *Nt, const double *weight,
                        const double *target, const double *u)
{
    const uz_qp *qp = &augmented->qp;
    memset(noise, 0, (size_t)qp->K.cols * sizeof *noise);
    /* Per row: two roundings of each product and one of each sum, in K and in p. Sums that other rows changed later are
     * at most the final entry plus what was added: counted with every row that touches the entry. */
    for (int64_t i = 0; i < Nt->cols; i++)
        for (int64_t a = Nt->ptr[i]; weight[i] > 0.0 && a < Nt->ptr[i + 1]; a++) {
            const int64_t j = Nt->idx[a];
            double force = fabs(qp->p[j]) + weight[i] * fabs(target[i] * Nt->val[a]);
            for (int64_t b = Nt->ptr[i]; b < Nt->ptr[i + 1]; b++) {
                const int64_t k = Nt->idx[b], at = uz_csc_find(&qp->K, j > k ? j : k, j > k ? k : j);
                const double entry = at < 0 ? 0.0 : fabs(qp->K.val[at]);
                force += (entry + weight[i] * fabs(Nt->val[a] * Nt->val[b])) * fabs(u[k]);
            }
            noise[j] += 4.0 * DBL_EPSILON * force;
        }
}
