/* judge.h: is what a solve claims true?  Answers, bounds and proofs are compared with the exact solution, in quadruple
 * precision, of the problem in exactly these doubles. */
#ifndef TESTS_JUDGE_H
#define TESTS_JUDGE_H

#include "quad_exact.h"
#include "rational.h"
#include "uzawa.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

typedef enum {
    JUDGED_OK,
    JUDGED_WRONG,    /* a claim is false: an error above the bound or above the request, a proof that proves nothing */
    JUDGED_UNCERTAIN /* the reference itself is not exact enough to say */
} verdict;

/* The problem's own truth. Free with truth_clear. */
typedef struct {
    bool definite;   /* K is positive definite; without that nothing else is known */
    bool feasible;   /* some displacement meets all rows, as far as quadruple precision can tell */
    bool far;        /* not so, but one does in rational numbers */
    quad_exact best; /* where both hold */
    quad norm;       /* ||u*||_K */
    quad noise;      /* of the reference: about ||error||_K, from the optimality conditions in the original data */
} truth;

typedef struct {
    verdict verdict;
    double certified; /* relative error claimed; NaN: nothing claimed */
    double error;     /* relative error of u, in truth */
    double floor;     /* relative error of u* rounded to doubles: no answer in doubles can be expected to be better */
    double ratio;     /* certified / error; NaN where the answer is exact or nothing is bounded */
    char why[160];
} judgement;

static inline bool is_definite(const uz_csc *K)
{
    int64_t d = K->cols, stop;
    quad *L = quad_zeros(d * d);
    for (int64_t j = 0; j < d; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            L[K->idx[k] * d + j] = K->val[k];
    bool definite = quad_cholesky(L, d, NULL, 0, &stop);
    free(L);
    return definite;
}

/* K u - p - N'r and h - N u from the doubles of the problem. */
static inline void measure_residuals(quad *force, quad *gap, const quad_exact *x)
{
    const uz_csc *K = &x->qp->K, *N = &x->qp->N;
    for (int64_t j = 0; j < x->d; j++)
        force[j] -= x->qp->p[j];
    for (int64_t i = 0; i < x->m; i++)
        gap[i] = x->qp->h[i];
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            force[K->idx[k]] += K->val[k] * x->u[j];
            if (K->idx[k] != j)
                force[j] += K->val[k] * x->u[K->idx[k]];
        }
    for (int64_t j = 0; j < N->cols; j++)
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++) {
            force[j] -= N->val[k] * x->r[N->idx[k]];
            gap[N->idx[k]] -= N->val[k] * x->u[j];
        }
}

/* ||motion||_K that closes the gaps of the active rows, sqrt(g' D_AA^-1 g): far more than g where rows nearly depend on
 * each other. INFINITY where they do. */
static inline quad closing_motion(const quad_exact *x, const quad *gap)
{
    quad *D = quad_zeros(x->m * x->m), *g = quad_zeros(x->m), square = 0;
    int64_t n = 0, stop;
    for (int64_t i = 0; i < x->m; i++)
        n += x->active[i];
    for (int64_t i = 0, a = 0; i < x->m; i++) {
        if (!x->active[i])
            continue;
        g[a] = gap[i];
        for (int64_t j = 0, b = 0; j <= i; j++)
            if (x->active[j])
                D[a * n + b++] = x->D[i * x->m + j];
        a++;
    }
    const bool independent = quad_cholesky(D, n, NULL, 0, &stop);
    if (independent)
        quad_forward(g, D, n, NULL);
    for (int64_t a = 0; a < n; a++)
        square += g[a] * g[a];
    free(D);
    free(g);
    return independent ? quad_sqrt(square) : (quad)INFINITY;
}

/* A bound on ||error||_K of the reference up to a small factor. The residual force, the gaps of its active rows and the
 * pulls are mended by a motion of about their own size, or by the one that closes the gaps. Lifting other rows that
 * penetrate, by a motion of size `lift`, may open the active ones by as much, and then what their reactions do there
 * enters under a root. */
static inline quad measure_noise(const quad_exact *x)
{
    quad *force = quad_zeros(x->d), *gap = quad_zeros(x->m), square = 0, mend = 0, lift = 0, push = 0;
    int64_t several = 0;
    measure_residuals(force, gap, x);
    quad_forward(force, x->L, x->d, x->first);
    for (int64_t j = 0; j < x->d; j++)
        square += force[j] * force[j];
    for (int64_t i = 0; i < x->m; i++) {
        quad size = quad_sqrt(x->D[i * x->m + i]);
        if (!(size > 0))
            continue;
        mend += (x->active[i] ? quad_abs(gap[i]) / size : 0) + (x->r[i] > 0 ? x->r[i] * size : 0);
        several += x->active[i];
        lift += !x->active[i] && gap[i] < 0 ? -gap[i] / size : 0;
        push += quad_abs(x->r[i]) * size;
    }
    const quad closing = several > 1 ? closing_motion(x, gap) : 0;
    if (closing > mend && closing < (quad)INFINITY)
        mend = closing;
    free(force);
    free(gap);
    return mend + quad_sqrt(square) + lift + quad_sqrt(2 * push * lift);
}

/* start (m, may be NULL): rows that are likely to touch. */
static inline truth find_truth(const uz_qp *qp, const bool *start)
{
    truth t = {.definite = is_definite(&qp->K)};
    if (!t.definite)
        return t;
    t.feasible = quad_exact_solve(&t.best, qp, start);
    for (int64_t i = 0; i < t.best.m; i++) /* a row without coefficients says 0 <= h */
        t.feasible = t.feasible && (t.best.D[i * t.best.m + i] > 0 || qp->h[i] >= 0);
    t.far = !t.feasible && is_feasible_exactly(&qp->N, qp->h);
    if (t.feasible) {
        t.norm = quad_sqrt(t.best.norm2);
        t.noise = measure_noise(&t.best) + (quad)0x1p-108 * t.norm;
    }
    return t;
}

static inline void truth_clear(truth *t)
{
    quad_exact_free(&t->best);
}

static inline judgement condemn(judgement j, const char *why)
{
    j.verdict = JUDGED_WRONG;
    snprintf(j.why, sizeof j.why, "%s", why);
    return j;
}

/* y <= 0 with h'y > radius ||N'y||_1: then h - N u >= 0 can't hold where all |u_j| < radius. An exact ray, radius
 * INFINITY, was rounded to doubles. */
static inline bool bounds_feasible(const double *y, double radius, const uz_qp *qp)
{
    quad work = 0, slack = 0, terms = 0;
    for (int64_t i = 0; i < qp->N.rows; i++) {
        if (!(y[i] <= 0))
            return false;
        work += (quad)qp->h[i] * y[i];
    }
    for (int64_t j = 0; j < qp->N.cols; j++) {
        quad sum = 0;
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            sum += (quad)qp->N.val[k] * y[qp->N.idx[k]];
        for (int64_t k = qp->N.ptr[j]; k < qp->N.ptr[j + 1]; k++)
            terms += quad_abs((quad)qp->N.val[k] * y[qp->N.idx[k]]);
        slack += quad_abs(sum);
    }
    return isinf(radius) ? slack <= (quad)1e-15 * terms : work > 0 && work * (1 + (quad)1e-12) >= slack * radius;
}

static inline judgement judge_no_answer(judgement j, const truth *t, const uz_qp *qp, const uz_result *result)
{
    double radius = result->summary.infeasible_radius;
    if (isinf(radius) != (result->summary.outcome == UZ_INFEASIBLE))
        return condemn(j, "the radius is not that of the outcome");
    if (!result->ray || !bounds_feasible(result->ray, radius, qp))
        return condemn(j, "no answer, without a proof");
    for (int64_t k = 0; t->feasible && k < t->best.d; k++)
        if (quad_abs(t->best.u[k]) >= radius)
            return j;
    return t->feasible || (t->far && isinf(radius)) ? condemn(j, "infeasible, but a displacement exists") : j;
}

static inline quad relative(quad error, quad norm)
{
    return error > 0 ? (norm > 0 ? error / norm : (quad)INFINITY) : 0;
}

static inline double rounding_floor(const truth *t)
{
    double *u = calloc((size_t)t->best.d + 1, sizeof *u);
    if (!u)
        abort();
    for (int64_t j = 0; j < t->best.d; j++)
        u[j] = (double)t->best.u[j];
    quad error = quad_error(&t->best, u);
    free(u);
    return (double)relative(error, t->norm);
}

static inline judgement judge_bounds(judgement j, const truth *t, const uz_result *result, const double *u)
{
    const uz_summary *s = &result->summary;
    const uz_certificate *c = &s->certificate;
    quad error = quad_error(&t->best, u), error_r = quad_error_of_reactions(&t->best, result->r);
    quad known = error - t->noise, known_r = error_r - t->noise; /* at least this much, in truth */
    for (int64_t i = 0; i < t->best.m; i++) /* a bound may be that of reactions in twice the digits */
        known_r -= (quad)(0.5 * DBL_EPSILON) * quad_abs(result->r[i]) * quad_sqrt(t->best.D[i * t->best.m + i]);
    j.certified = c->relative_error;
    j.error = (double)relative(error, t->norm);
    j.floor = rounding_floor(t);
    if (error > 2 * t->noise && isfinite(c->relative_error))
        j.ratio = c->relative_error / j.error;
    if (isnan(c->relative_error) || isnan(c->absolute_error) || !(c->gap >= 0))
        return condemn(j, "the certificate is not a number");
    if (s->outcome == UZ_CONVERGED && !(c->relative_error <= s->requested_error))
        return condemn(j, "converged, but the certificate misses the request");
    if (s->outcome == UZ_CONVERGED && relative(known, t->norm) > s->requested_error)
        return condemn(j, "converged, but the true error is above the request");
    if (relative(known, t->norm) > c->relative_error)
        return condemn(j, "the relative bound is below the true error");
    if (known > c->absolute_error)
        return condemn(j, "the absolute bound is below the true error");
    if (known_r > c->absolute_error)
        return condemn(j, "the absolute bound is below the error of the reactions' displacement");
    for (int64_t i = 0; i < t->best.m; i++)
        if (!(result->r[i] <= 0))
            return condemn(j, "a reaction pulls");
    return j;
}

/* The reference is exact enough to contradict the claim, if it is false by a quarter. */
static inline bool is_sharp(const truth *t, const judgement *j)
{
    return t->noise <= (quad)1e-27 * t->norm || isinf(j->certified) || t->noise <= (quad)0.25 * j->certified * t->norm;
}

/* u (d): the answer, by dof. */
static inline judgement judge(const truth *t, const uz_qp *qp, const uz_result *result, const double *u)
{
    judgement j = {.verdict = JUDGED_OK, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN};
    bool claims = result->summary.outcome == UZ_CONVERGED || isfinite(result->summary.certificate.relative_error);
    if (result->summary.outcome == UZ_INFEASIBLE || result->summary.outcome == UZ_OUT_OF_REACH)
        return judge_no_answer(j, t, qp, result);
    if (!t->definite)
        return claims ? condemn(j, "an answer was certified although K is not positive definite") : j;
    if (t->far) { /* there is no reference */
        j.verdict = claims ? JUDGED_UNCERTAIN : JUDGED_OK;
        snprintf(j.why, sizeof j.why, "the rows are too near to a contradiction for the reference");
        return j;
    }
    if (!t->feasible)
        return claims ? condemn(j, "an answer was certified although the rows contradict") : j;
    j = judge_bounds(j, t, result, u);
    if (j.verdict == JUDGED_OK && !is_sharp(t, &j)) {
        j.verdict = JUDGED_UNCERTAIN;
        snprintf(j.why, sizeof j.why, "the reference is only exact to %.1e", (double)relative(t->noise, t->norm));
    }
    return j;
}

#endif
