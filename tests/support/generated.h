/* generated.h: contact problems built backwards from a chosen solution, of random shape, conditioning, scale and row
 * structure, and what the solver claims about them against the truth.
 *
 * K, N, an active set, u* and r* <= 0 are chosen; p = K u* - N'r* and h = N u* + gap follow. p and h are rounded to
 * doubles, so the exact solution of the rounded problem is computed afterwards, from that active set. */
#ifndef TESTS_GENERATED_H
#define TESTS_GENERATED_H

#include "core/alloc.h"
#include "judge.h"
#include "qp_fixture.h"

static inline double random_power(qp_random *rng, double low, double high)
{
    return pow(10, low + (high - low) * random_unit(rng));
}

static inline bool random_chance(qp_random *rng, double probability)
{
    return random_unit(rng) < probability;
}

/* A chain of springs of stiffness 1 / condition to 1, one end held. */
static inline double *random_chain(qp_random *rng, int64_t d, double condition, double scale)
{
    double *K = vector(d * d);
    for (int64_t j = 0; j < d; j++) {
        double spring = scale / random_power(rng, 0, log10(condition));
        K[j * d + j] += spring;
        if (j == 0)
            continue;
        K[(j - 1) * d + j - 1] += spring;
        K[j * d + j - 1] = K[(j - 1) * d + j] = -spring;
    }
    return K;
}

/* S K S with a diagonal S: dofs of different units. */
static inline void grade(qp_random *rng, double *K, int64_t d, double decades)
{
    double *s = vector(d);
    for (int64_t j = 0; j < d; j++)
        s[j] = random_power(rng, -decades, decades);
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j <= i; j++)
            K[i * d + j] = K[j * d + i] = K[i * d + j] * (s[i] * s[j]);
    free(s);
}

static inline double *generated_stiffness(qp_random *rng, int64_t d)
{
    double condition = random_power(rng, 0, 14), scale = random_chance(rng, 0.5) ? 1 : random_power(rng, -12, 12);
    int shape = (int)random_int(rng, 0, 3);
    if (shape == 0)
        return random_chain(rng, d, condition, scale);
    double *K = random_spd(rng, d, shape == 1 ? condition : sqrt(condition), scale);
    if (shape == 2)
        grade(rng, K, d, log10(condition) / 8);
    return K;
}

/* One row of N: a bound on a dof, a few dofs, or half of them; sometimes an earlier row again. */
static inline void generated_row(qp_random *rng, double *N, int64_t i, int64_t d, int pattern, double repeats)
{
    static const double factors[] = {1, -1, 4, 0.3, 1e3};
    double *row = N + i * d;
    if (i > 0 && random_chance(rng, repeats)) {
        const double *other = N + random_int(rng, 0, i) * d;
        double factor = factors[random_int(rng, 0, 5)];
        for (int64_t j = 0; j < d; j++)
            row[j] = factor * other[j];
        return;
    }
    for (int64_t j = 0; pattern == 2 && j < d; j++)
        row[j] = random_chance(rng, 0.5) ? random_signed(rng) : 0;
    for (int k = 0; pattern == 1 && k < 2; k++)
        row[random_int(rng, 0, d)] = random_signed(rng);
    row[random_int(rng, 0, d)] = pattern == 0 ? -1 : 1 + random_unit(rng);
}

static inline double *generated_rows(qp_random *rng, int64_t d, int64_t m)
{
    double *N = vector(m * d), repeats = random_chance(rng, 0.3) ? 0.4 : 0;
    double decades = random_chance(rng, 0.4) ? 8 : 0;
    int pattern = (int)random_int(rng, 0, 3);
    for (int64_t i = 0; i < m; i++)
        generated_row(rng, N, i, d, pattern, repeats);
    for (int64_t i = 0; decades > 0 && i < m; i++) {
        double factor = random_power(rng, -decades, decades);
        for (int64_t j = 0; j < d; j++)
            N[i * d + j] *= factor;
    }
    return N;
}

/* p and h from a solution; active (m) is its active set. */
static inline void generated_load(qp_random *rng, uz_qp *qp, bool *active)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    double *u = vector(d), *Ku = vector(d), *r = vector(m), *Nu = vector(m), *column = vector(m), force = 0;
    double size = random_chance(rng, 0.5) ? 1 : random_power(rng, -6, 6), share = random_unit(rng);
    double pull = random_power(rng, -2, 2);
    for (int64_t j = 0; j < d; j++)
        u[j] = size * random_signed(rng);
    uz_csc_symv(Ku, &qp->K, 1, u);
    uz_csc_gaxpy(Nu, &qp->N, 1, u);
    for (int64_t j = 0; j < d; j++)
        force = fmax(force, fabs(Ku[j]));
    for (int64_t k = 0; k < qp->N.ptr[d]; k++)
        column[qp->N.idx[k]] = fmax(column[qp->N.idx[k]], fabs(qp->N.val[k]));
    for (int64_t i = 0; i < m; i++) {
        active[i] = random_chance(rng, share);
        bool weak = random_chance(rng, 0.05);
        r[i] = active[i] && !weak ? -pull * force / column[i] * (0.1 + random_unit(rng)) : 0;
        qp->h[i] = Nu[i] + (active[i] || weak ? 0 : size * column[i] * (0.1 + random_unit(rng)));
    }
    memcpy(qp->p, Ku, (size_t)d * sizeof *Ku);
    uz_csc_gaxpy_t(qp->p, &qp->N, -1, r);
    uz_free_all(u, Ku, r, Nu, column);
}

/* The same problem for the same seed. active: room for GENERATED_MOST rows. */
enum { GENERATED_MOST = 48 };
static inline uz_qp generated_qp(uint64_t seed, bool *active)
{
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 1};
    int64_t d = random_int(&rng, 1, random_chance(&rng, 0.2) ? 41 : 21), m = random_int(&rng, 0, 2 * d + 1);
    m = m > GENERATED_MOST ? GENERATED_MOST : m;
    double *K = generated_stiffness(&rng, d), *N = generated_rows(&rng, d, m);
    uz_qp qp = {.K = csc_from_dense(K, d, d, true), .N = csc_from_dense(N, m, d, false), vector(d), vector(m)};
    generated_load(&rng, &qp, active);
    free(K);
    free(N);
    return qp;
}

/* Half of the problems are asked as a user would; the others try every method, operator and accuracy. */
static inline uz_settings generated_settings(uint64_t seed)
{
    static const double errors[] = {1e-8, 0, 1e-2, 1e-12};
    static const uz_method methods[] = {UZ_METHOD_AUTO,       UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_ACTIVE_SET, UZ_METHOD_ACCELERATED,
                                        UZ_METHOD_UZAWA,      UZ_METHOD_CONJUGATE};
    qp_random rng = {seed + 77};
    uz_settings s = uz_settings_default();
    s.max_iterations = 2000;
    if (seed % 2 == 0)
        return s;
    s.relative_error = errors[random_int(&rng, 0, 4)];
    s.method = methods[random_int(&rng, 0, 6)];
    if (s.method != UZ_METHOD_ACTIVE_SET && random_chance(&rng, 0.3))
        s.op = UZ_OPERATOR_FACTORED;
    return s;
}

/* What became of many problems. */
typedef struct {
    int64_t problems, outcome[UZ_DISMISSED + 1], refused, wrong, uncertain;
    int64_t asked, answered; /* definite, as a user would ask; of these converged */
    double *ratio;           /* certified / true error of the converged ones that are not exact */
    int64_t n_ratio, capacity;
    double least_ratio, worst_error; /* of the converged ones */
} generated_tally;

static inline void tally_ratio(generated_tally *all, double ratio)
{
    if (all->n_ratio == all->capacity) {
        all->capacity = all->capacity ? 2 * all->capacity : 256;
        all->ratio = realloc(all->ratio, (size_t)all->capacity * sizeof *all->ratio);
        if (!all->ratio)
            abort();
    }
    all->ratio[all->n_ratio++] = ratio;
    all->least_ratio = all->n_ratio == 1 ? ratio : fmin(all->least_ratio, ratio);
}

static inline int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static inline double tally_median(generated_tally *all)
{
    qsort(all->ratio, (size_t)all->n_ratio, sizeof *all->ratio, compare_doubles);
    return all->n_ratio ? all->ratio[all->n_ratio / 2] : NAN;
}

static inline void tally_add(generated_tally *all, const judgement *j, const uz_summary *s)
{
    all->outcome[s->outcome]++;
    all->wrong += j->verdict == JUDGED_WRONG;
    all->uncertain += j->verdict == JUDGED_UNCERTAIN;
    if (s->outcome != UZ_CONVERGED)
        return;
    all->worst_error = fmax(all->worst_error, isnan(j->error) ? 0 : j->error / s->requested_error);
    if (!isnan(j->ratio))
        tally_ratio(all, j->ratio);
}

/* Called for each problem that was judged wrong or uncertain. */
typedef void (*generated_report)(void *ctx, uint64_t seed, const uz_qp *qp, const uz_summary *s, const judgement *j);

/* Solves and judges problem `seed`; every fourth is solved a second time, with its factor from a cache. */
static inline void run_generated(generated_tally *all, uint64_t seed, generated_report report, void *ctx)
{
    bool active[GENERATED_MOST];
    uz_problem problem = problem_of(generated_qp(seed, active));
    uz_settings settings = generated_settings(seed);
    uz_cache *cache = seed % 4 == 2 ? uz_cache_new((size_t)1 << 24) : NULL;
    truth t = find_truth(&problem.qp, active);
    for (int pass = 0; pass < (cache ? 2 : 1); pass++) {
        uz_result *result = NULL;
        uz_error err = {0};
        all->problems++;
        all->asked += seed % 2 == 0 && t.definite;
        if (uz_solve(&result, &problem, &settings, cache, NULL, &err) != UZ_OK) {
            all->refused++;
            continue;
        }
        judgement j = judge(&t, &problem.qp, result, result->u);
        all->answered += seed % 2 == 0 && t.definite && result->summary.outcome == UZ_CONVERGED;
        tally_add(all, &j, &result->summary);
        if (j.verdict != JUDGED_OK)
            report(ctx, seed, &problem.qp, &result->summary, &j);
        uz_result_free(result);
    }
    uz_cache_free(cache);
    truth_clear(&t);
    uz_problem_clear(&problem);
}

#endif
