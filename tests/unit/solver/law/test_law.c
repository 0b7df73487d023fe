/* Every law of the table by the properties that a law must have, and every method of the table on exact answers. */
#include "harness.h"
#include "law/law.h"
#include "methods/method.h"
#include "qp_fixture.h"
#include "quad_exact.h"
#include "scene_fixture.h"

#include <float.h>

enum { BLOCKS = 4, MOST = 3 * BLOCKS, ROUNDS = 2000 };

static const double coefficient[BLOCKS] = {0.0, 0.1, 0.5, 2.0};

static void random_vector(double *x, int64_t n, qp_random *rng)
{
    for (int64_t i = 0; i < n; i++)
        x[i] = random_int(rng, 0, 4) == 0 ? 0.0 : 2 * random_signed(rng);
}

static double distance(const double *x, const double *y, int64_t n)
{
    double square = 0.0;
    for (int64_t i = 0; i < n; i++)
        square += (x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(square);
}

static double dot(const double *x, const double *y, int64_t n)
{
    double sum = 0.0;
    for (int64_t i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static void check_projection(const uz_law *law, int64_t n, qp_random *rng)
{
    double x[MOST], y[MOST], Px[MOST], Py[MOST], PPx[MOST], toward[MOST], from[MOST];
    random_vector(x, n, rng);
    random_vector(y, n, rng);
    memcpy(Px, x, sizeof x);
    memcpy(Py, y, sizeof y);
    law->kind->project(law, Px, n);
    law->kind->project(law, Py, n);
    memcpy(PPx, Px, sizeof Px);
    law->kind->project(law, PPx, n);
    CHECK(distance(Px, PPx, n) <= 4 * DBL_EPSILON);
    CHECK(distance(Px, Py, n) <= distance(x, y, n) * (1 + 4 * DBL_EPSILON));
    CHECK(law->kind->admissible(law, Px, n));
    CHECK(!law->kind->admissible(law, x, n) || distance(x, Px, n) <= 4 * DBL_EPSILON);
    for (int64_t i = 0; i < n; i++) { /* the closest point: (x - Px)'(s - Px) <= 0 for all s of the set */
        toward[i] = Py[i] - Px[i];
        from[i] = x[i] - Px[i];
    }
    CHECK(dot(from, toward, n) <= 16 * DBL_EPSILON);
}

/* A solution from a projection: r = P(x), g = x - P(x). */
static void check_solutions(const uz_law *law, int64_t n, qp_random *rng)
{
    double x[MOST], r[MOST], g[MOST], s[MOST], moved[MOST], one[MOST], quarter[MOST];
    for (int64_t i = 0; i < MOST; i++) {
        one[i] = 1.0;
        quarter[i] = 0.25;
    }
    random_vector(x, n, rng);
    memcpy(r, x, sizeof x);
    law->kind->project(law, r, n);
    for (int64_t i = 0; i < n; i++)
        g[i] = x[i] - r[i];
    CHECK(law->kind->residual(law, r, g, one, NULL, n) <= 8 * DBL_EPSILON);
    CHECK(law->kind->residual(law, r, g, quarter, NULL, n) <= 8 * DBL_EPSILON);
    CHECK(law->kind->gap_bound(law, r, g, n) <= 16 * DBL_EPSILON);
    memcpy(s, x, sizeof x);
    random_vector(s, n, rng);
    law->kind->project(law, s, n);
    /* Another admissible reaction: what it adds to the duality gap is no less than what r would gain on it. */
    CHECK(law->kind->gap_bound(law, s, g, n) >= dot(g, r, n) - dot(g, s, n) - 16 * DBL_EPSILON);
    memcpy(moved, s, sizeof s);
    for (int64_t i = 0; i < n; i++)
        moved[i] += g[i];
    law->kind->project(law, moved, n);
    CHECK_REL(law->kind->residual(law, s, g, one, NULL, n), distance(s, moved, n), 1e-14);
    const bool solves = law->kind->gap_bound(law, s, g, n) == 0;
    CHECK(solves == (law->kind->residual(law, s, g, one, NULL, n) <= 8 * DBL_EPSILON));
}

/* Every law there is. */
static const uz_law *const LAWS[] = {&uz_law_frictionless};

TEST(laws_are_what_they_say)
{
    for (size_t k = 0; k < sizeof LAWS / sizeof LAWS[0]; k++) {
        const uz_law law = {LAWS[k]->kind, coefficient};
        const int64_t n = (int64_t)law.kind->rows * BLOCKS;
        qp_random rng = {17};
        CHECK(n <= MOST);
        for (int round = 0; round < ROUNDS; round++) {
            check_projection(&law, n, &rng);
            check_solutions(&law, n, &rng);
        }
    }
}

TEST(one_sided_laws_tell_rows_apart)
{
    for (size_t k = 0; k < sizeof LAWS / sizeof LAWS[0]; k++) {
        const uz_law law = {LAWS[k]->kind, coefficient};
        const double r[4] = {-1, 0, 2, -3}, g[4] = {0, 1, -2, 0.5}, d[4] = {2, -1, 1, -1}, step[4] = {8, 8, 8, 5};
        const bool guess[4] = {true, false, true, true};
        bool in[4], wrong[4];
        double out[4];
        if (!law.kind->one_sided)
            continue;
        CHECK_INT(law.kind->active(&law, in, r, 4), 2);
        CHECK(in[0] && !in[1] && !in[2] && in[3]);
        CHECK_INT(law.kind->refute(&law, wrong, guess, r, g, 4), 1);
        CHECK(!wrong[0] && !wrong[1] && wrong[2] && !wrong[3]);
        law.kind->penetration(&law, out, g, 4);
        CHECK(out[0] == 0 && out[1] == 0 && out[2] == 2 && out[3] == 0);
        law.kind->reach(&law, out, r, d, 4);
        CHECK(out[0] == 0.5 && isinf(out[1]) && out[2] == 0 && isinf(out[3]));
        law.kind->predict(&law, in, r, g, step, 4);
        CHECK(in[0] && !in[1] && in[2] && in[3]); /* the last would not after a step of 8 */
    }
}

TEST(methods_of_the_table_on_exact_answers)
{
    for (uint64_t seed = 0; seed < 6; seed++) {
        qp_random rng = {seed};
        uz_problem problem = problem_of(random_obstacle(&rng, random_int(&rng, 5, 20), 1 + (int64_t)(seed % 3)));
        quad_exact exact;
        CHECK(quad_exact_solve(&exact, &problem.qp, NULL));
        for (int k = UZ_METHOD_AUTO; k < UZ_METHOD_GIVEN; k++) {
            const uz_method_kind *kind = uz_method_kind_of((uz_method)k);
            uz_settings settings = uz_settings_default();
            uz_method parsed;
            CHECK(kind->method == (uz_method)k);
            CHECK(uz_method_parse(&parsed, kind->name) && parsed == kind->method);
            settings.method = kind->method;
            settings.relative_error = 1e-6;
            settings.max_iterations = 200000;
            uz_result *result = solve_problem(&problem, &settings);
            if (!result)
                continue;
            CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", kind->name);
            CHECK(quad_error(&exact, result->u) <= 1e-6 * sqrt((double)exact.norm2) * (1 + 1e-9));
            uz_result_free(result);
        }
        quad_exact_free(&exact);
        uz_problem_clear(&problem);
    }
}

/* Without a name, what follows the table, and what only results can have. */
TEST(names_that_are_no_methods)
{
    uz_method parsed = UZ_METHOD_CONJUGATE;
    CHECK(!uz_method_parse(&parsed, "given") && !uz_method_parse(&parsed, "linear") && !uz_method_parse(&parsed, ""));
    CHECK(parsed == UZ_METHOD_CONJUGATE);
    CHECK_STR(uz_method_name(UZ_METHOD_GIVEN), "given");
    CHECK_STR(uz_method_name(UZ_METHOD_LINEAR), "linear");
    CHECK_STR(uz_method_name((uz_method)99), "unknown");
}
