#include "semicoercive/contact_proof.h"

#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/row_move.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>

/* N z may miss e_i by this much before z is no use. */
static const double WITNESS_ROUNDING = 1e-10;

typedef struct {
    const uz_contact_claim *claim;
    int64_t d, m;
    bool *open;        /* m: surely */
    double *z, *image; /* d, m: z and N z; zero but for the dofs and rows that are listed */
    double *Kz;        /* d */
    int64_t *dof, n_dof, *row, n_row;
    double *force; /* d: K u - p - N'r in double-double precision */
    uz_row_move move;
} prover;

/* Whatever z does to row k, it does no harm to a proof for row i: it is open, or says no more than row i, or points the
 * other way. false: it may, as far as doubles can tell. */
static bool is_harmless(const prover *x, int64_t k, int64_t i)
{
    const uz_csc *Nt = x->claim->Nt;
    const double *h = x->claim->of->h;
    const int64_t a = Nt->ptr[k], b = Nt->ptr[i], n = Nt->ptr[i + 1] - b;
    if (k == i || x->open[k])
        return k != i;
    if (Nt->ptr[k + 1] - a != n || n == 0)
        return false;
    const double ratio = Nt->val[a] / Nt->val[b];
    for (int64_t q = 0; q < n; q++)
        if (Nt->idx[a + q] != Nt->idx[b + q] || (n > 1 && Nt->val[a + q] != ratio * Nt->val[b + q]))
            return false;
    const double margin = ratio == 1.0 ? 0.0 : 4.0 * DBL_EPSILON * ratio * fabs(h[i]);
    return ratio < 0.0 || (ratio > 0.0 && h[k] - ratio * h[i] >= margin);
}

static uz_status prepare(prover *x, const uz_contact_claim *claim, uz_error *err)
{
    const uz_csc *N = claim->of->N;
    *x = (prover){.claim = claim, .d = N->cols, .m = N->rows};
    x->open = uz_alloc_zero(x->m, sizeof(bool));
    x->dof = uz_alloc_zero(x->d, sizeof(int64_t));
    x->row = uz_alloc_zero(x->m, sizeof(int64_t));
    x->z = uz_alloc_zero(x->d, sizeof(double));
    x->Kz = uz_alloc_zero(x->d, sizeof(double));
    x->image = uz_alloc_zero(x->m, sizeof(double));
    x->force = uz_alloc_zero(x->d, sizeof(double));
    double *zero = uz_alloc_zero(x->d, sizeof(double)), *spare = uz_alloc_zero(3 * x->d, sizeof(double));
    bool ok = x->open && x->dof && x->row && x->z && x->Kz && x->image && x->force && zero && spare;
    uz_status status = UZ_OK;
    if (!uz_row_move_init(&x->move, x->d, x->m) || !ok) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to prove contact on %lld dofs", (long long)x->d);
    } else {
        uz_residuals res = {.e = spare, .e_u = x->force, .Ku = spare + x->d, .Kc = spare + 2 * x->d};
        status = uz_equilibrium_residual(&res, claim->of->K, N, claim->of->p, claim->u, zero, claim->r, err);
        for (int64_t i = 0; i < x->m && isfinite(claim->inverse_bound); i++) {
            const double gap = uz_gap_of_row(claim->Nt, i, claim->of->h, claim->u, NULL);
            const double reach =
                claim->error * sqrt(claim->inverse_bound * uz_row_compliance(claim->Nt, i, claim->inverse));
            x->open[i] = gap > 2.0 * reach;
        }
    }
    uz_free_all(zero, spare);
    return status;
}

/* z on the dofs that row i need not share: moving them is no matter of other rows. A row that is moved the other way
 * does no harm but may spoil the proof by its reaction. */
static bool witness_by_own_dofs(prover *x, int64_t i)
{
    const uz_csc *Nt = x->claim->Nt, *N = x->claim->of->N;
    double sum = 0.0;
    for (int64_t q = Nt->ptr[i]; q < Nt->ptr[i + 1]; q++) {
        const int64_t j = Nt->idx[q];
        bool own = Nt->val[q] != 0.0;
        for (int64_t e = N->ptr[j]; e < N->ptr[j + 1] && own; e++) {
            const int64_t k = N->idx[e];
            const bool away = N->val[e] * Nt->val[q] <= 0.0 && !uz_row_presses(x->claim->r[k]);
            own = k == i || away || is_harmless(x, k, i);
        }
        if (!own)
            continue;
        x->dof[x->n_dof++] = j;
        x->z[j] = x->claim->inverse[j] * Nt->val[q];
        sum += x->z[j] * Nt->val[q];
    }
    for (int64_t k = 0; k < x->n_dof; k++)
        x->z[x->dof[k]] /= sum;
    return x->n_dof > 0 && isnormal(sum);
}

/* How far z is from what row k wants of it. */
static double miss_of(const prover *x, int64_t k, int64_t i)
{
    double image = x->image[k];
    if (k == i)
        return isnan(image) ? INFINITY : fabs(image - 1.0);
    if (isnan(image))
        return INFINITY;
    bool away = image <= 0.0 && !uz_row_presses(x->claim->r[k]);
    return away || is_harmless(x, k, i) ? 0.0 : fabs(image);
}

static uz_contact_verdict judge(prover *x, int64_t i)
{
    const uz_contact_claim *claim = x->claim;
    const uz_csc *K = claim->of->K;
    double value = 0.0, slack = 0.0, energy = 0.0; /* z'K z + sum of R (N z)^2 */
    for (int64_t k = 0; k < x->n_dof; k++) {
        const int64_t j = x->dof[k];
        const double share = x->z[j] * x->force[j];
        value += share;
        slack += fabs(share);
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++)
            energy += (K->idx[q] == j ? 1.0 : 2.0) * K->val[q] * x->z[j] * x->z[K->idx[q]];
    }
    for (int64_t k = 0; k < x->n_row; k++)
        energy += claim->weight[x->row[k]] * x->image[x->row[k]] * x->image[x->row[k]];
    const double size = sqrt(fmax(energy, 0.0));
    for (int64_t k = 0; k < x->n_row; k++) {
        const int64_t j = x->row[k];
        double gap = claim->weight[j] > 0.0 ? uz_gap_of_row(claim->Nt, j, claim->of->h, claim->u, NULL) : 0.0;
        double push = claim->r[j] - claim->weight[j] * gap;
        value += x->image[j] * push;
        slack += fabs(x->image[j] * push) + 1e16 * miss_of(x, j, i) * fabs(push);
    }
    if (!(value < 0.0))
        return UZ_CONTACT_DENIED;
    slack *= 16.0 * DBL_EPSILON;
    return value + size * (1.0 + 1e-9) * claim->error + slack < 0.0 ? UZ_CONTACT_PROVED : UZ_CONTACT_TOO_COARSE;
}

/* Leaves z and image zero again. */
static uz_contact_verdict prove_row(prover *x, bool *provable, int64_t i)
{
    const uz_csc *N = x->claim->of->N;
    double miss = 0.0;
    x->n_dof = x->n_row = 0;
    if (!witness_by_own_dofs(x, i)) {
        /* N z = e_i on all rows that count, z of least W^-1 norm */
        for (int64_t k = 0; k < x->n_dof; k++)
            x->z[x->dof[k]] = 0.0;
        for (int64_t k = 0; k < x->m; k++) {
            x->move.in[k] = x->claim->Nt->ptr[k + 1] > x->claim->Nt->ptr[k] && !is_harmless(x, k, i);
            x->move.target[k] = k == i;
        }
        uz_row_move_solve(&x->move, x->z, x->claim->Nt, x->claim->inverse);
        x->n_dof = 0;
        for (int64_t j = 0; j < x->d; j++)
            if (x->z[j] != 0.0)
                x->dof[x->n_dof++] = j;
    }
    for (int64_t k = 0; k < x->n_dof; k++) /* image = N z, and the rows where it is not zero */
        for (int64_t q = N->ptr[x->dof[k]]; q < N->ptr[x->dof[k] + 1]; q++) {
            double *image = &x->image[N->idx[q]];
            if (*image == 0.0)
                x->row[x->n_row++] = N->idx[q];
            *image += N->val[q] * x->z[x->dof[k]];
            if (*image == 0.0)
                *image = DBL_MIN; /* stays listed, once */
        }
    for (int64_t k = 0; k < x->n_row; k++)
        miss = fmax(miss, miss_of(x, x->row[k], i));
    *provable = x->image[i] != 0.0 && miss <= WITNESS_ROUNDING;
    uz_contact_verdict verdict = *provable ? judge(x, i) : UZ_CONTACT_NO_WITNESS;
    for (int64_t k = 0; k < x->n_dof; k++)
        x->z[x->dof[k]] = 0.0;
    for (int64_t k = 0; k < x->n_row; k++)
        x->image[x->row[k]] = 0.0;
    return verdict;
}

uz_status uz_prove_contact(uz_contact_verdict *verdict, bool *provable, const uz_contact_claim *claim, uz_error *err)
{
    prover x;
    *verdict = UZ_CONTACT_PROVED;
    uz_status status = prepare(&x, claim, err);
    for (int64_t i = 0; i < x.m && status == UZ_OK; i++) {
        if (!(claim->weight[i] > 0.0))
            continue;
        uz_contact_verdict of_row = prove_row(&x, &provable[i], i);
        *verdict = of_row > *verdict ? of_row : *verdict;
    }
    uz_free_all(x.open, x.dof, x.row, x.z, x.Kz, x.image, x.force);
    uz_row_move_clear(&x.move);
    return status;
}
