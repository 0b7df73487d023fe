/* Parts of the core together: load cases, starts, operator forms, verification and bodies that share a factor in one
 * cache. Whatever is combined, no claim of any answer may be false. */
#include "harness.h"
#include "qp_fixture.h"

#include "generated.h"

#include <stdint.h>

enum { MOST_CASES = 19 };

/* The loads of one body, each with its truth. */
typedef struct {
    uz_problem problem;
    truth truths[MOST_CASES];
    uz_qp single[MOST_CASES]; /* borrows */
} loaded_body;

/* Row i of the body's rows (m x d, by rows) as it is, or scaled, doubled, or with its entries moved to other dofs. */
static uz_csc other_rows(qp_random *rng, const uz_csc *N)
{
    int64_t m = N->rows, d = N->cols;
    double *dense = vector(m * d);
    for (int64_t j = 0; j < d; j++) {
        int64_t to = random_chance(rng, 0.3) ? random_int(rng, 0, d) : j;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            dense[N->idx[k] * d + to] += N->val[k];
    }
    if (m > 1 && random_chance(rng, 0.3))
        memcpy(dense, dense + (m - 1) * d, (size_t)d * sizeof *dense);
    uz_csc rows = csc_from_dense(dense, m, d, false);
    free(dense);
    return rows;
}

/* Its own load; none; the opposite one; others. */
static double *other_load(qp_random *rng, const uz_qp *qp, int64_t i)
{
    double *p = vector(qp->K.cols), factor = i == 1 ? 0 : i == 2 ? -1 : 1 + random_signed(rng);
    for (int64_t j = 0; j < qp->K.cols; j++)
        p[j] = factor * qp->p[j] * (i < 3 ? 1 : 1 + random_signed(rng));
    return p;
}

static double *other_gaps(qp_random *rng, const uz_qp *qp)
{
    double *h = vector(qp->N.rows);
    for (int64_t i = 0; i < qp->N.rows; i++)
        h[i] = qp->h[i] * (1 + (random_chance(rng, 0.2) ? 2 : 0.1) * random_signed(rng));
    return h;
}

static loaded_body load_body(qp_random *rng, const uz_qp *from, bool change_rows, int64_t n, const bool *active)
{
    loaded_body body = {.problem = {.kind = UZ_PROBLEM_MATRICES, .n_cases = n}};
    uz_qp *qp = &body.problem.qp;
    uz_error err = {0};
    if (uz_csc_copy(&qp->K, &from->K, &err) != UZ_OK)
        abort();
    if (change_rows)
        qp->N = other_rows(rng, &from->N);
    else if (uz_csc_copy(&qp->N, &from->N, &err) != UZ_OK)
        abort();
    qp->p = vector(from->K.cols);
    qp->h = vector(from->N.rows);
    memcpy(qp->p, from->p, (size_t)from->K.cols * sizeof *qp->p);
    memcpy(qp->h, from->h, (size_t)from->N.rows * sizeof *qp->h);
    body.problem.cases = calloc((size_t)n, sizeof *body.problem.cases);
    for (int64_t i = 0; i < n; i++) {
        uz_load_case *c = &body.problem.cases[i];
        snprintf(c->name, sizeof c->name, "%lld", (long long)i);
        c->p = i > 0 ? other_load(rng, qp, i) : NULL;
        c->h = random_chance(rng, 0.4) && i > 0 ? other_gaps(rng, qp) : NULL;
        body.single[i] = *qp;
        body.single[i].p = c->p ? c->p : qp->p;
        body.single[i].h = c->h ? c->h : qp->h;
        body.truths[i] = find_truth(&body.single[i], active);
    }
    return body;
}

static void unload_body(loaded_body *body)
{
    for (int64_t i = 0; i < body->problem.n_cases; i++)
        truth_clear(&body->truths[i]);
    uz_problem_clear(&body->problem);
}

static uz_settings random_settings(qp_random *rng)
{
    static const double errors[] = {1e-8, 0, 1e-2, 1e-12};
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART,
                                        UZ_METHOD_ACTIVE_SET, UZ_METHOD_ACCELERATED};
    static const uz_operator ops[] = {UZ_OPERATOR_AUTO, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED,
                                      UZ_OPERATOR_MATRIX_FREE};
    uz_settings s = uz_settings_default();
    s.max_iterations = random_chance(rng, 0.3) ? random_int(rng, 0, 60) : 1000;
    s.relative_error = errors[random_int(rng, 0, 4)];
    s.method = methods[random_int(rng, 0, 5)];
    s.op = ops[random_int(rng, 0, 4)];
    s.ordering = (uz_ordering)random_int(rng, 0, 4);
    if (random_chance(rng, 0.2))
        s.memory_limit = (size_t)random_int(rng, 10000, 3000000);
    return s;
}

typedef struct {
    uz_cache *cache;
    uz_result **earlier; /* whose states are starts */
    int64_t n_earlier, judged, refused, converged, verified, uncertain;
} interplay;

static void judge_result(interplay *all, const loaded_body *body, int64_t i, const uz_result *x, const char *what,
                         uint64_t seed)
{
    judgement j = judge(&body->truths[i], &body->single[i], x, x->u);
    const uz_summary *s = &x->summary;
    all->judged++;
    all->converged += s->outcome == UZ_CONVERGED;
    all->verified += s->outcome == UZ_VERIFIED;
    all->uncertain += j.verdict == JUDGED_UNCERTAIN;
    CHECK_MSG(j.verdict != JUDGED_WRONG, "%s, seed %llu, case %lld, %s by %s: %s", what, (unsigned long long)seed,
              (long long)i, uz_choice_name(UZ_CHOICE_OUTCOME, s->outcome), uz_choice_name(UZ_CHOICE_OPERATOR, s->op),
              j.why);
}

static void verify_result(interplay *all, qp_random *rng, const loaded_body *body, int64_t i, const uz_result *x,
                          uint64_t seed)
{
    uz_problem one = {.kind = UZ_PROBLEM_MATRICES, .qp = body->single[i]};
    uz_settings settings = random_settings(rng);
    uz_result *verified = NULL;
    uz_error err = {0};
    if (x->ray)
        return;
    if (uz_verify(&verified, &one, x->u, x->r, &settings, all->cache, NULL, &err) == UZ_OK)
        judge_result(all, body, i, verified, "verify", seed);
    else
        all->refused++;
    uz_result_free(verified);
}

/* Half of the starts are those of other forms, bodies and loads, as far as they have as many rows. */
static void solve_body(interplay *all, qp_random *rng, const loaded_body *body, uint64_t seed)
{
    const uz_state *starts[MOST_CASES] = {0};
    int64_t n = body->problem.n_cases;
    for (int64_t i = 0; i < n && i < all->n_earlier; i++)
        if (all->earlier[i]->state && all->earlier[i]->m == body->problem.qp.N.rows && random_chance(rng, 0.5))
            starts[i] = all->earlier[i]->state;
    uz_settings settings = random_settings(rng);
    uz_result **results = NULL;
    uz_error err = {0};
    if (uz_solve_cases(&results, &body->problem, &settings, starts, all->cache, NULL, &err) != UZ_OK) {
        all->refused++;
        return;
    }
    for (int64_t i = 0; i < n; i++) {
        judge_result(all, body, i, results[i], "cases", seed);
        if (random_chance(rng, 0.2))
            verify_result(all, rng, body, i, results[i], seed);
    }
    uz_results_free(all->earlier, all->n_earlier);
    all->earlier = results;
    all->n_earlier = n;
}

static void play(interplay *all, uint64_t seed)
{
    bool active[GENERATED_MOST];
    qp_random rng = {seed * 0x9E3779B97F4A7C15u + 12345};
    uz_qp qp = generated_qp(seed, active);
    for (int k = 0; k < 2; k++) {
        int64_t n = random_chance(&rng, 0.3) ? random_int(&rng, 9, MOST_CASES + 1) : random_int(&rng, 1, 5);
        loaded_body body = load_body(&rng, &qp, k > 0, n, active);
        for (int times = 0; times < 3; times++)
            solve_body(all, &rng, &body, seed);
        unload_body(&body);
    }
    uz_qp_clear(&qp);
}

TEST(no_combination_makes_a_false_claim)
{
    const char *from = getenv("FIRST_SEED"), *count = getenv("SEEDS");
    uint64_t first = from ? strtoull(from, NULL, 10) : 0, seeds = count ? strtoull(count, NULL, 10) : 12;
    interplay all = {.cache = uz_cache_new((size_t)1 << 18)};
    for (uint64_t seed = first; seed < first + seeds; seed++)
        play(&all, seed);
    printf("# %lld answers judged: %lld converged, %lld verified, %lld uncertain; %lld calls refused\n",
           (long long)all.judged, (long long)all.converged, (long long)all.verified, (long long)all.uncertain,
           (long long)all.refused);
    CHECK(4 * all.converged > all.judged && all.verified > 0 && 4 * all.refused < all.judged);
    uz_results_free(all.earlier, all.n_earlier);
    uz_cache_free(all.cache);
}

/* One dof without stiffness, pressed onto its row. A start is checked there as on any other body. */
TEST(a_start_that_fits_no_run_is_refused_on_a_body_without_supports)
{
    double one = 1, zero = 0, two[2] = {-1, -1}, bad = NAN;
    uz_problem problem = problem_of((uz_qp){
        .K = csc_from_dense(&one, 1, 1, true), .N = csc_from_dense(&one, 1, 1, false), .p = vector(1), .h = vector(1)});
    uz_state states[] = {{.m = 2, .r = two}, {.m = 1, .r = &bad}, {.m = 1, .r = &zero}};
    static const uz_status expected[] = {UZ_ERR_SIZE, UZ_ERR_NOT_FINITE, UZ_OK};
    uz_settings settings = uz_settings_default();
    settings.semidefinite = true;
    problem.qp.K.val[0] = 0;
    problem.qp.p[0] = problem.qp.h[0] = 1;
    for (int k = 0; k < 3; k++) {
        const uz_state *start = &states[k];
        uz_result **results = NULL;
        uz_error err = {0};
        CHECK_INT(uz_solve_cases(&results, &problem, &settings, &start, NULL, NULL, &err), expected[k]);
        CHECK_INT(err.status, expected[k]);
        CHECK_STR(err.where, expected[k] == UZ_OK ? "" : "start");
        uz_results_free(results, 1);
    }
    uz_problem_clear(&problem);
}
