/* contradictions.h: small problems whose rows contradict each other, or nearly, judged in rational numbers: slabs,
 * cones and corners far away, rows that depend on each other exactly or but for rounding, rows of any scale; half of
 * them meant to contradict by a margin of 1e-16 to 1. */
#ifndef TESTS_CONTRADICTIONS_H
#define TESTS_CONTRADICTIONS_H

#include "core/alloc.h"
#include "qp_fixture.h"
#include "rational.h"

typedef struct {
    int64_t problems, refused;
    int64_t feasible, solved, reached, limited, unchecked; /* reached: out_of_reach; limited: other named outcomes */
    int64_t infeasible, proved, undecided;
    int64_t above, proved_above; /* of the infeasible: by margins that doubles can hold */
    int64_t false_infeasible, false_answer, false_bound, false_radius, no_rows;
    double largest; /* entry of an answer that converged */
} contradiction_tally;

static inline int64_t contradiction_faults(const contradiction_tally *t)
{
    return t->false_infeasible + t->false_answer + t->false_bound + t->false_radius + t->no_rows;
}

/* A double of few bits, so that sums of a few products are exact. */
static inline double random_short(qp_random *rng)
{
    return ldexp((double)random_int(rng, -4096, 4097), -10);
}

/* *margin: by how much it is meant to contradict, relative to the size of its rows; negative: room. */
static inline uz_qp contradicting(qp_random *rng, double *margin)
{
    const int64_t d = random_int(rng, 1, 9), kind = random_int(rng, 0, 6), others = random_int(rng, 0, 28);
    const int64_t joined = 1 + random_int(rng, 0, d < 3 ? d : 3), m = others + joined + 1;
    const bool rounded = kind == 1 || kind == 2, scaled = random_unit(rng) < 0.3;
    double *N = vector(m * d), *G = vector(d * d), *K = vector(d * d), *inside = vector(d);
    uz_qp qp = {.p = vector(d), .h = vector(m)};
    for (int64_t i = 0; i < d * d; i++)
        G[i] = random_short(rng);
    for (int64_t i = 0; i < d; i++) {
        for (int64_t j = 0; j < d; j++) {
            for (int64_t k = 0; k < d; k++)
                K[i * d + j] += G[k * d + i] * G[k * d + j];
            K[i * d + j] += i == j;
        }
        qp.p[i] = random_unit(rng) < 0.3 ? 0 : 5 * random_signed(rng);
        inside[i] = random_short(rng);
    }
    for (int64_t i = 0; i < m; i++) {
        for (int64_t j = 0; j < d; j++)
            N[i * d + j] = random_unit(rng) < 0.3 ? 0 : random_short(rng);
        N[i * d + random_int(rng, 0, d)] += 1;
    }
    /* the last row takes back what the joined ones allow: minus a positive combination of them */
    double *last = N + (m - 1) * d, slack = 0, size = 0;
    for (int64_t j = 0; j < d; j++)
        last[j] = 0;
    for (int64_t i = 0; i < m; i++) {
        double at = 0;
        const double factor = rounded ? 0.1 + random_unit(rng) : (double)random_int(rng, 1, 4);
        for (int64_t j = 0; j < d; j++) {
            at += N[i * d + j] * inside[j];
            last[j] -= i < joined ? factor * N[i * d + j] : 0;
        }
        qp.h[i] = at + (i < joined ? 0 : 3 * random_unit(rng));
        slack += i < joined ? factor * at : 0;
        size += i < joined ? factor * (fabs(at) + 1) : 0;
    }
    *margin = (random_unit(rng) < 0.5 ? 1 : -1) * pow(10, -16 * random_unit(rng));
    if (random_unit(rng) < 0.05)
        *margin = 0;
    qp.h[m - 1] = -slack - *margin * size;
    if (kind >= 3) { /* nearly dependent: by a tilt, a power of ten or a power of two */
        const double tilt = kind == 3 ? pow(10, -16 * random_unit(rng)) : ldexp(1, -(int)random_int(rng, 1, 50));
        last[random_int(rng, 0, d)] += tilt * random_signed(rng);
    }
    for (int64_t i = 0; scaled && i < m; i++) {
        const double factor = kind % 2 ? pow(10, 24 * random_unit(rng) - 12) : ldexp(1, (int)random_int(rng, -40, 41));
        for (int64_t j = 0; j < d; j++)
            N[i * d + j] *= factor;
        qp.h[i] *= factor;
    }
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, m, d, false);
    uz_free_all(N, G, K, inside);
    return qp;
}

/* By the rows in contact the answer is exact in rationals; how far is u from it? */
static inline void check_contradiction_answer(contradiction_tally *t, const uz_qp *qp, const uz_result *result)
{
    const int64_t d = qp->K.cols, m = qp->N.rows;
    mpq_t *exact = rationals(d);
    bool *active = calloc((size_t)m + 1, sizeof *active);
    if (!active)
        abort();
    for (int64_t i = 0; i < m; i++)
        active[i] = result->r[i] < 0;
    if (!solve_exactly(exact, qp, active))
        t->unchecked++;
    else if (error_exactly(&qp->K, result->u, exact) > result->summary.certificate.relative_error * (1 + 1e-9))
        t->false_bound++;
    for (int64_t j = 0; j < d; j++)
        t->largest = fmax(t->largest, fabs(result->u[j]));
    rationals_free(exact, d);
    free(active);
}

static inline void judge_contradiction(contradiction_tally *t, const uz_qp *qp, double margin, const uz_result *result)
{
    const bool feasible = is_feasible_exactly(&qp->N, qp->h),
               bounded = isfinite(result->summary.certificate.absolute_error);
    const uz_outcome outcome = result->summary.outcome;
    int64_t named = 0;
    for (int64_t i = 0; result->ray && i < qp->N.rows; i++)
        named += result->ray[i] < 0;
    t->no_rows += (outcome == UZ_INFEASIBLE || outcome == UZ_OUT_OF_REACH) && named == 0;
    if (feasible) {
        t->feasible++;
        t->solved += outcome == UZ_CONVERGED;
        t->reached += outcome == UZ_OUT_OF_REACH;
        t->false_infeasible += outcome == UZ_INFEASIBLE;
        t->limited += outcome != UZ_CONVERGED && outcome != UZ_OUT_OF_REACH && outcome != UZ_INFEASIBLE;
        if (bounded)
            check_contradiction_answer(t, qp, result);
    } else {
        const bool proved = outcome == UZ_INFEASIBLE;
        t->infeasible++;
        t->proved += proved;
        t->undecided += !proved;
        t->above += margin > 1e-14;
        t->proved_above += proved && margin > 1e-14;
        t->false_answer += bounded || outcome == UZ_CONVERGED;
    }
}

static inline void run_contradiction(contradiction_tally *t, uint64_t seed)
{
    qp_random rng = {seed * 7919 + 5};
    double margin;
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = contradicting(&rng, &margin)};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    static const double asked[] = {1e-4, 1e-6, 1e-8};
    settings.relative_error = asked[random_int(&rng, 0, 3)];
    settings.op = random_unit(&rng) < 0.2   ? UZ_OPERATOR_FACTORED
                  : random_unit(&rng) < 0.2 ? UZ_OPERATOR_MATRIX_FREE
                                            : UZ_OPERATOR_AUTO;
    settings.max_iterations = 20000;
    settings.time_limit_s = 20;
    t->problems++;
    if (uz_solve(&result, &problem, &settings, NULL, NULL, &err) == UZ_OK)
        judge_contradiction(t, &problem.qp, margin, result);
    else
        t->refused++;
    uz_result_free(result);
    uz_problem_clear(&problem);
}

#endif
