/* degenerate.h: feasible contact problems whose rows depend on each other or form long chains, and what the solver
 * claims about them against the truth: order and convexity (isotonic and convex regression), a cycle that leaves no
 * room (after M. J. D. Powell, Math. Programming Study 25 (1985)), many rows through one point, and polytopes with
 * rows repeated or nearly parallel. A feasible displacement is known by construction. */
#ifndef TESTS_DEGENERATE_H
#define TESTS_DEGENERATE_H

#include "generated.h"

enum { DEGENERATE_KINDS = 5, DEGENERATE_MOST = 64 };

static const char *const DEGENERATE_NAMES[DEGENERATE_KINDS] = {"order", "convexity", "cycle", "vertex", "polytope"};

/* A diagonal K of weights, or one that couples. */
static inline uz_csc degenerate_stiffness(qp_random *rng, int64_t d)
{
    const bool couples = random_chance(rng, 0.5);
    double *K = couples ? random_spd(rng, d, random_power(rng, 0, 6), 1) : vector(d * d);
    for (int64_t j = 0; !couples && j < d; j++)
        K[j * d + j] = random_chance(rng, 0.5) ? 1 : random_power(rng, -2, 2);
    uz_csc out = csc_from_dense(K, d, d, true);
    free(K);
    return out;
}

/* u_i <= u_k for neighbours, and for some pairs that follow from these. */
static inline void order_rows(qp_random *rng, double *N, double *h, int64_t m, int64_t d)
{
    for (int64_t i = 0; i < m; i++) {
        int64_t first = i < d - 1 ? i : random_int(rng, 0, d - 1),
                last = i < d - 1 ? i + 1 : random_int(rng, first + 1, d);
        N[i * d + first] = 1;
        N[i * d + last] = -1;
        h[i] = 0;
    }
}

/* Second differences on knots that are not evenly spaced. */
static inline void convexity_rows(qp_random *rng, double *N, double *h, int64_t m, int64_t d)
{
    double before = 1;
    for (int64_t i = 0; i < m; i++) {
        double after = random_chance(rng, 0.5) ? before : ldexp(1, (int)random_int(rng, -3, 4));
        N[i * d + i] = -1 / before;
        N[i * d + i + 1] = 1 / before + 1 / after;
        N[i * d + i + 2] = -1 / after;
        h[i] = 0;
        before = after;
    }
    (void)d;
}

/* u_i - u_(i+1) <= h_i around a circle, with h that add up to nothing, exactly: each row must hold as an equation. */
static inline void cycle_rows(qp_random *rng, double *N, double *h, int64_t d)
{
    double sum = 0;
    for (int64_t i = 0; i < d; i++) {
        N[i * d + i] = 1;
        N[i * d + (i + 1) % d] = -1;
        h[i] = i + 1 < d ? floor(1000 * random_signed(rng)) / 2 : -sum;
        sum += h[i];
    }
}

/* Rows that some direction `inward` leaves at once, through one point, whose gaps are rounded: what p presses on is a
 * vertex of more rows than dofs. */
static inline void vertex_rows(qp_random *rng, double *N, double *h, double *p, int64_t m, int64_t d)
{
    double *point = vector(d), *inward = vector(d);
    bool whole = random_chance(rng, 0.5); /* whole numbers: the rows meet in one point exactly */
    for (int64_t j = 0; j < d; j++) {
        point[j] = whole ? floor(10 * random_signed(rng)) : random_signed(rng);
        inward[j] = random_signed(rng);
    }
    for (int64_t i = 0; i < m; i++) {
        double along = 0;
        for (int64_t j = 0; j < d; j++) {
            N[i * d + j] = whole ? floor(10 * random_signed(rng)) : random_signed(rng);
            along += N[i * d + j] * inward[j];
        }
        double push = random_unit(rng), at = 0;
        for (int64_t j = 0; j < d; j++) {
            N[i * d + j] *= along < 0 ? 1 : -1;
            at += N[i * d + j] * point[j];
            p[j] += push * N[i * d + j];
        }
        h[i] = at;
    }
    free(point);
    free(inward);
}

/* A polytope around `inside`; some rows are others once more, times a power of two, or turned by a little. */
static inline void polytope_rows(qp_random *rng, double *N, double *h, int64_t m, int64_t d)
{
    double *inside = vector(d);
    for (int64_t j = 0; j < d; j++)
        inside[j] = random_signed(rng);
    for (int64_t i = 0; i < m; i++) {
        int64_t other = random_int(rng, 0, i + 1);
        bool repeats = other < i && random_chance(rng, 0.5);
        double factor = ldexp(1, (int)random_int(rng, -4, 5)),
               turn = random_chance(rng, 0.5) ? 0 : random_power(rng, -15, -2);
        double at = 0, room = 0.05 + random_unit(rng);
        for (int64_t j = 0; j < d; j++) {
            N[i * d + j] = repeats ? factor * N[other * d + j] * (1 + turn * random_signed(rng)) : random_signed(rng);
            at += N[i * d + j] * inside[j];
        }
        h[i] = repeats ? factor * h[other] : at + room;
        while (!(h[i] > at + 1e-3 * fabs(factor))) /* `inside` stays inside */
            h[i] = at + room;
    }
    free(inside);
}

/* The same problem for the same seed. */
static inline uz_qp degenerate_qp(uint64_t seed)
{
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 5};
    int kind = (int)(seed % DEGENERATE_KINDS);
    int64_t d = random_int(&rng, 3, random_chance(&rng, 0.2) ? 31 : 13), m = kind == 0 ? d - 1 + random_int(&rng, 0, d)
                                                                             : kind == 1 ? d - 2
                                                                             : kind == 2
                                                                                 ? d
                                                                                 : random_int(&rng, d, 2 * d + 1);
    double *N = vector(m * d);
    uz_qp qp = {.K = degenerate_stiffness(&rng, d), .p = vector(d), .h = vector(m)};
    for (int64_t j = 0; j < d; j++)
        qp.p[j] = kind == 2 && random_chance(&rng, 0.5) ? 0 : random_signed(&rng) + (kind == 0 ? 0.1 * (double)j : 0);
    if (kind == 0)
        order_rows(&rng, N, qp.h, m, d);
    if (kind == 1)
        convexity_rows(&rng, N, qp.h, m, d);
    if (kind == 2)
        cycle_rows(&rng, N, qp.h, d);
    if (kind == 3)
        vertex_rows(&rng, N, qp.h, qp.p, m, d);
    if (kind == 4)
        polytope_rows(&rng, N, qp.h, m, d);
    for (int64_t j = 0; kind == 4 && j < d; j++)
        qp.p[j] *= 100;
    qp.N = csc_from_dense(N, m, d, false);
    free(N);
    return qp;
}

/* What became of many problems, by kind. */
typedef struct {
    int64_t problems[DEGENERATE_KINDS], certified[DEGENERATE_KINDS]; /* at 1e-8, as a user asks */
    int64_t wrong, uncertain;
    double least_ratio; /* certified / true error */
} degenerate_tally;

/* Solves and judges problem `seed` as a user asks. report: for what is wrong or was not certified. */
static inline void run_degenerate(degenerate_tally *all, uint64_t seed, generated_report report, void *ctx)
{
    uz_problem problem = problem_of(degenerate_qp(seed));
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    int kind = (int)(seed % DEGENERATE_KINDS);
    settings.relative_error = 1e-8;
    all->problems[kind]++;
    if (uz_solve(&result, &problem, &settings, NULL, NULL, &err) == UZ_OK) {
        bool *touch = calloc((size_t)problem.qp.N.rows + 1, sizeof *touch);
        if (!touch)
            abort();
        for (int64_t i = 0; i < problem.qp.N.rows; i++)
            touch[i] = result->r[i] < 0;
        truth t = find_truth(&problem.qp, touch);
        judgement j = judge(&t, &problem.qp, result, result->u);
        bool certified = result->summary.certificate.relative_error <= settings.relative_error;
        all->certified[kind] += certified;
        all->wrong += j.verdict == JUDGED_WRONG;
        all->uncertain += j.verdict == JUDGED_UNCERTAIN;
        if (j.verdict == JUDGED_OK && j.ratio < all->least_ratio)
            all->least_ratio = j.ratio;
        if (j.verdict == JUDGED_WRONG || !certified)
            report(ctx, seed, &problem.qp, &result->summary, &j);
        truth_clear(&t);
        free(touch);
    }
    uz_result_free(result);
    uz_problem_clear(&problem);
}

#endif
