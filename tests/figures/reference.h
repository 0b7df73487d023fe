/* reference.h: exact solutions of large contact problems whose rows bound one dof each, to some 30 digits.
 *
 * Once it is known which rows touch, u is prescribed at their dofs, and the rest is a linear system: K_FF u_F = p_F -
 * K_FA u_A. It is solved by iterative refinement with a factor in double precision and the residual in __float128
 * (Moler, "Iterative refinement in floating point", J. ACM 14 (1967); Higham, "Accuracy and stability of numerical
 * algorithms", 2002, theorem 12.1), and the reactions are what is left of K u - p at the touching dofs. Then the
 * optimality conditions are checked in __float128: they are sufficient, so how the set was found need not be trusted.
 */
#ifndef TESTS_FIGURES_REFERENCE_H
#define TESTS_FIGURES_REFERENCE_H

#include "factor/factor.h"
#include "quad_exact.h"

#include <math.h>

typedef struct {
    const uz_qp *qp;
    int64_t d, m, active;
    int64_t *dof;                 /* m: the dof that row i bounds ... */
    double *slope;                /* m: ... and its entry: row i is slope[i] u_dof[i] <= h_i */
    bool *touching;               /* m */
    quad *u, *r, *g;              /* d, m, m */
    double energy, norm, largest; /* pi(u*), ||u*||_K, max |r*| */
    double change;                /* ||last correction||_K / ||u*||_K */
    double margin; /* least of |r_i| / max |r*| over the touching rows: a set may be off by a row that hardly touches */
    int rounds;    /* sets that were tried */
} reference;

static inline void reference_free(reference *x)
{
    free(x->dof);
    free(x->slope);
    free(x->touching);
    free(x->u);
    free(x->r);
    free(x->g);
    memset(x, 0, sizeof *x);
}

/* out (d) = K v, K the lower triangle. */
static inline void reference_multiply(quad *out, const uz_csc *K, const quad *v)
{
    for (int64_t j = 0; j < K->cols; j++)
        out[j] = 0;
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++) {
            const int64_t i = K->idx[q];
            out[i] += K->val[q] * v[j];
            if (i != j)
                out[j] += K->val[q] * v[i];
        }
}

/* ||e||_K in x87's 64 bits, whose rounding is that of doubles over 2000. */
static inline double reference_norm(const uz_csc *K, const double *e)
{
    long double sum = 0;
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t q = K->ptr[j]; q < K->ptr[j + 1]; q++) {
            const long double term = (long double)K->val[q] * e[j] * e[K->idx[q]];
            sum += K->idx[q] == j ? term : 2 * term;
        }
    return sqrt((double)sum);
}

/* false: a row has not exactly one entry. */
static inline bool reference_read_rows(reference *x)
{
    const uz_csc *N = &x->qp->N;
    bool ok = N->ptr[N->cols] == x->m;
    for (int64_t i = 0; i < x->m; i++)
        x->dof[i] = -1;
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t q = N->ptr[j]; q < N->ptr[j + 1]; q++) {
            ok = ok && x->dof[N->idx[q]] < 0 && N->val[q] != 0;
            x->dof[N->idx[q]] = j;
            x->slope[N->idx[q]] = N->val[q];
        }
    return ok;
}

/* u with the touching rows as equations, by corrections until they no longer get smaller. */
static inline bool reference_refine(reference *x, uz_principal *part, const bool *fixed)
{
    const int64_t d = x->d;
    quad *Ku = quad_zeros(d);
    double *e = calloc((size_t)d, sizeof *e), before = INFINITY;
    uz_error err = {0};
    bool ok = e != NULL;
    for (int64_t j = 0; j < d; j++)
        x->u[j] = 0;
    for (int64_t i = 0; i < x->m; i++)
        if (x->touching[i])
            x->u[x->dof[i]] = (quad)x->qp->h[i] / x->slope[i];
    for (int step = 0; ok && step < 60; step++) {
        reference_multiply(Ku, &x->qp->K, x->u);
        for (int64_t j = 0; j < d; j++)
            e[j] = (double)(x->qp->p[j] - Ku[j]);
        ok = uz_principal_solve(e, part, &err) == UZ_OK;
        for (int64_t j = 0; j < d; j++) {
            e[j] = fixed[j] ? 0 : e[j];
            x->u[j] += e[j];
        }
        x->change = reference_norm(&x->qp->K, e);
        if (!(x->change < 0.5 * before))
            break;
        before = x->change;
    }
    free(Ku);
    free(e);
    return ok;
}

/* r, g, energy and norms that follow from u. */
static inline void reference_measure(reference *x)
{
    const uz_qp *qp = x->qp;
    quad *Ku = quad_zeros(x->d), square = 0, work = 0;
    reference_multiply(Ku, &qp->K, x->u);
    x->largest = 0;
    x->active = 0;
    for (int64_t i = 0; i < x->m; i++) {
        const int64_t j = x->dof[i];
        x->r[i] = x->touching[i] ? (Ku[j] - qp->p[j]) / x->slope[i] : 0;
        x->g[i] = x->touching[i] ? 0 : qp->h[i] - x->slope[i] * x->u[j];
        x->largest = fmax(x->largest, fabs((double)x->r[i]));
        x->active += x->touching[i];
    }
    for (int64_t j = 0; j < x->d; j++) {
        square += x->u[j] * Ku[j];
        work += qp->p[j] * x->u[j];
    }
    x->norm = sqrt((double)square);
    x->energy = (double)(square / 2 - work);
    x->change /= x->norm;
    x->margin = INFINITY;
    for (int64_t i = 0; i < x->m; i++)
        if (x->touching[i])
            x->margin = fmin(x->margin, fabs((double)x->r[i]) / x->largest);
    free(Ku);
}

/* Rows that pull leave, rows that penetrate come in (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2003)).
 * Returns how many changed: none, and the conditions hold. */
static inline int64_t reference_exchange(reference *x)
{
    int64_t changed = 0;
    for (int64_t i = 0; i < x->m; i++) {
        const bool wrong = x->touching[i] ? x->r[i] > 0 : x->g[i] < 0;
        x->touching[i] = x->touching[i] != wrong;
        changed += wrong;
    }
    return changed;
}

static inline bool reference_round(reference *x, const uz_factor *factor, uz_factor_workspace *ws)
{
    bool *fixed = calloc((size_t)x->d + 1, sizeof *fixed), ok = fixed != NULL;
    uz_principal *part = NULL;
    uz_error err = {0};
    for (int64_t i = 0; ok && i < x->m; i++)
        if (x->touching[i])
            fixed[x->dof[i]] = true;
    ok = ok && uz_principal_create(&part, &x->qp->K, fixed, factor, ws, NULL, &err) == UZ_OK && part;
    ok = ok && reference_refine(x, part, fixed);
    if (ok)
        reference_measure(x);
    uz_principal_free(part);
    free(fixed);
    return ok;
}

/* A factor of K (lower triangle) with nothing that has to come last. */
static inline bool reference_factor(uz_factor **out, const uz_csc *K)
{
    uz_analysis *analysis = NULL;
    uz_error err = {0};
    const bool ok = uz_analysis_create(&analysis, K, NULL, 0, 0, UZ_ORDERING_AMD, NULL, &err) == UZ_OK &&
                    uz_factor_create(out, K, analysis, 0, NULL, &err) == UZ_OK;
    uz_analysis_free(analysis);
    return ok;
}

enum { REFERENCE_ROUNDS = 40 };

/* Solves, from the rows that `start` (m) says touch. qp is borrowed. false: a row bounds more than one dof, or the
 * conditions could not be met; *x is to be freed all the same. */
static inline bool reference_solve(reference *x, const uz_qp *qp, const bool *start)
{
    const int64_t d = qp->K.cols, m = qp->N.rows;
    uz_factor *factor = NULL;
    uz_factor_workspace *ws = uz_factor_workspace_new();
    *x = (reference){.qp = qp, .d = d, .m = m};
    x->dof = calloc((size_t)m + 1, sizeof *x->dof);
    x->slope = calloc((size_t)m + 1, sizeof *x->slope);
    x->touching = calloc((size_t)m + 1, sizeof *x->touching);
    x->u = quad_zeros(d);
    x->r = quad_zeros(m);
    x->g = quad_zeros(m);
    bool ok = ws && x->dof && x->slope && x->touching && reference_read_rows(x);
    if (ok)
        memcpy(x->touching, start, (size_t)m * sizeof *start);
    ok = ok && reference_factor(&factor, &qp->K);
    for (bool done = false; ok && !done;) {
        ok = x->rounds++ < REFERENCE_ROUNDS && reference_round(x, factor, ws);
        done = ok && reference_exchange(x) == 0;
    }
    uz_factor_free(factor);
    uz_factor_workspace_free(ws);
    return ok;
}

/* How far an answer u (d), r (m) is from the solution. */
typedef struct {
    double energy;      /* ||u - u*||_K / ||u*||_K */
    double reaction;    /* max |r_i - r*_i| / max |r*_i| */
    int64_t mismatches; /* rows with a reaction in one of them only */
} reference_error;

static inline reference_error reference_compare(const reference *x, const double *u, const double *r)
{
    reference_error error = {0};
    double *e = calloc((size_t)x->d + 1, sizeof *e);
    if (!e)
        abort();
    for (int64_t j = 0; j < x->d; j++)
        e[j] = (double)((quad)u[j] - x->u[j]);
    error.energy = reference_norm(&x->qp->K, e) / x->norm;
    for (int64_t i = 0; i < x->m; i++) {
        error.reaction = fmax(error.reaction, fabs((double)((quad)r[i] - x->r[i])) / x->largest);
        error.mismatches += (r[i] < 0) != x->touching[i];
    }
    free(e);
    return error;
}

#endif
