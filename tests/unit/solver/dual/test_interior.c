/* Which rows touch, by an interior point: those of the exact answer, where rows are independent and where they are not;
 * and when it is not asked. */
#include "dual/interior.h"
#include "factor_fixture.h"
#include "floor.h"
#include "harness.h"
#include "judge.h"
#include "qp_fixture.h"

/* A load of a problem in matrices on the factored operator. */
typedef struct {
    uz_factor *factor;
    uz_dual *dual;
    uz_dual_load *load;
} body;

static bool begin(body *b, const uz_qp *qp)
{
    uz_error err = {0};
    *b = (body){0};
    bool ok = factor_by(&b->factor, &qp->K, NULL, 0, UZ_ORDERING_AMD, 0, &err) == UZ_OK;
    const uz_dual_source source = {.op = UZ_OPERATOR_FACTORED, .N = &qp->N, .factor = b->factor};
    ok = ok && uz_dual_create(&b->dual, &source, NULL, &err) == UZ_OK &&
         uz_dual_load_create(&b->load, b->dual, &qp->K, qp->p, qp->h, &err) == UZ_OK;
    CHECK_MSG(ok, "%s", err.message);
    return ok;
}

static void end(body *b)
{
    uz_dual_load_free(b->load);
    uz_dual_free(b->dual);
    uz_factor_free(b->factor);
}

TEST(rows_are_those_of_the_exact_answer)
{
    qp_random rng = {51};
    for (int k = 0; k < 60; k++) {
        const int64_t d = 5 + k % 20, m = 2 + k % (d - 2);
        const qp_kind kind = {.d = d, .m = m, .condition = k % 2 == 1 ? 1e2 : 1e6};
        uz_qp qp = random_qp(&rng, &kind);
        bool can = false, active[32] = {false};
        body b;
        if (begin(&b, &qp)) {
            CHECK_INT(uz_dual_load_interior(b.load, &can, active, INFINITY, NULL), UZ_OK);
            CHECK(can);
            truth t = find_truth(&qp, NULL);
            for (int64_t i = 0; t.feasible && i < m; i++)
                CHECK_MSG(active[i] == (t.best.r[i] < 0), "problem %d, row %d: %g", k, (int)i, (double)t.best.r[i]);
            truth_clear(&t);
        }
        end(&b);
        uz_qp_clear(&qp);
    }
}

/* Twice the same row, and the same row twice as large: forces may be anywhere among them, gaps not. */
TEST(rows_may_depend_on_each_other)
{
    uz_qp qp = {.p = vector(40), .h = vector(117)};
    int64_t row[351], column[351], at = 0;
    double value[351];
    for (int64_t j = 0; j < 40; j++) {
        row[j] = column[j] = j;
        value[j] = 1;
        qp.p[j] = (double)((j * 17) % 23) - 11;
    }
    CHECK_INT(uz_csc_from_triplets(&qp.K, 40, 40, 40, row, column, value, NULL), UZ_OK);
    for (int64_t i = 0; i < 117; i++)
        for (int64_t k = 0; k < 2; k++, at++) {
            row[at] = i;
            column[at] = i / 3 + k;
            value[at] = (k ? -1 : 1) * (i % 3 == 2 ? 2 : 1);
        }
    CHECK_INT(uz_csc_from_triplets(&qp.N, 117, 40, at, row, column, value, NULL), UZ_OK);
    bool can = false, active[117] = {false};
    body b;
    if (begin(&b, &qp)) {
        CHECK_INT(uz_dual_load_interior(b.load, &can, active, INFINITY, NULL), UZ_OK);
        CHECK(can);
        truth t = find_truth(&qp, NULL);
        for (int64_t i = 0; i < 39; i++) {
            const bool pressed = t.best.r[3 * i] + t.best.r[3 * i + 1] + t.best.r[3 * i + 2] < 0;
            CHECK_MSG((active[3 * i] || active[3 * i + 1] || active[3 * i + 2]) == pressed, "rows from %d on", (int)i);
        }
        truth_clear(&t);
    }
    end(&b);
    uz_qp_clear(&qp);
}

static bool always(void *ctx)
{
    (void)ctx;
    return true;
}

/* It comes back without an answer where it would cost too much, was told to stop, or has no factor to begin with. */
TEST(it_is_not_always_asked)
{
    const uz_hooks hooks = {.cancelled = always};
    const uz_stop stop = {&hooks, INFINITY};
    uz_qp qp;
    bool can = true, *active = calloc(400, sizeof *active);
    body b;
    CHECK_INT(floor_qp(&qp, 20, false, 2.0, 0.0, NULL), UZ_OK);
    if (begin(&b, &qp)) {
        CHECK_INT(uz_dual_load_interior(b.load, &can, active, 1e3, NULL), UZ_OK);
        CHECK(!can);
        CHECK_INT(uz_dual_load_aim(b.load, NAN, &stop, NULL), UZ_OK);
        CHECK_INT(uz_dual_load_interior(b.load, &can, active, INFINITY, NULL), UZ_OK);
        CHECK(!can);
        CHECK_INT(uz_dual_load_aim(b.load, NAN, NULL, NULL), UZ_OK);
        CHECK_INT(uz_dual_load_interior(b.load, &can, active, INFINITY, NULL), UZ_OK);
        CHECK(can);
    }
    end(&b);
    uz_qp_clear(&qp);
    free(active);
}
