/* cg_steps.h: steps of conjugate gradients in single precision against the same from the definition. Tests include it
 * once. */
#ifndef TESTS_SUPPORT_CG_STEPS_H
#define TESTS_SUPPORT_CG_STEPS_H

#include "amg/amg.h"
#include "core/alloc.h"
#include "harness.h"

#include <stdlib.h>
#include <string.h>

enum { TOLD_MOST = 12 };
typedef struct {
    double along[TOLD_MOST], ratio[TOLD_MOST], first;
    int count;
} told;

static inline bool listen_to_step(void *ctx, double along, double before, double after)
{
    told *t = ctx;
    t->first = t->count == 0 ? before : t->first;
    t->along[t->count] = along;
    t->ratio[t->count++] = after / before;
    return t->count < TOLD_MOST;
}

static inline double product_of(const double *x, const double *y, int64_t n)
{
    double sum = 0.0;
    for (int64_t j = 0; j < n; j++)
        sum += x[j] * y[j];
    return sum;
}

/* From the residual `start`. */
static inline void step_along(told *t, const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room,
                              const double *start)
{
    const int64_t n = mg->n;
    double *r = calloc((size_t)n, sizeof *r), *z = calloc((size_t)n, sizeof *z), *along = calloc((size_t)n, sizeof *z),
           *q = calloc((size_t)n, sizeof *q);
    uz_error err = {0};
    CHECK(r && z && along && q);
    memcpy(r, start, (size_t)n * sizeof *r);
    CHECK(uz_multigrid_apply(mg, K, room, z, r, &err) == UZ_OK);
    memcpy(along, z, (size_t)n * sizeof *z);
    double square = product_of(r, z, n);
    for (bool go_on = true; go_on;) {
        mg->kind->multiply(mg, K, room, q, along);
        const double alpha = square / product_of(along, q, n), last = square;
        for (int64_t j = 0; j < n; j++)
            r[j] -= alpha * q[j];
        CHECK(uz_multigrid_apply(mg, K, room, z, r, &err) == UZ_OK);
        square = product_of(r, z, n);
        for (int64_t j = 0; j < n; j++)
            along[j] = z[j] + square / last * along[j];
        go_on = listen_to_step(t, alpha, last, square);
    }
    uz_free_all(r, z, along, q);
}

/* kind->step_roughly from the residual r. */
static inline void check_steps(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, const double *r)
{
    told single = {.count = 0}, twice = {.count = 0};
    uz_error err = {0};
    CHECK(mg->kind->step_roughly(mg, room, r, listen_to_step, &single, &err) == UZ_OK);
    step_along(&twice, mg, K, room, r);
    CHECK_INT(single.count, TOLD_MOST);
    CHECK_REL(single.first, twice.first, 1e-5);
    for (int k = 0; k < TOLD_MOST; k++) {
        CHECK_REL(single.along[k], twice.along[k], 1e-3);
        CHECK_REL(single.ratio[k], twice.ratio[k], 1e-3);
    }
}

#endif
