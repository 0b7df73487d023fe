/* A multigrid of any mesh that threads share is that of one thread, to the last bit: the numbers of its levels show in
 * a cycle, and so do sweeps and products. */
#include "amg/multigrid_private.h"
#include "brick.h"
#include "core/aside.h"
#include "harness.h"
#include "sanitized.h"

#include <math.h>
#include <string.h>

enum { THREADS = 3 };

/* M^-1 x and K x by so many threads, s, K^-1 x roughly, and w, M^-1 x where some dofs are held, more and more of them.
 */
static void make_and_apply(double *z, double *y, double *s, double *w, const brick *b, const double *x, int threads)
{
    const uz_cg_stop stop = {.relative = 1e-2, .max_iterations = 100, .deadline = INFINITY, .unchecked = true};
    uz_cg_info info;
    uz_multigrid *mg;
    uz_modes modes;
    uz_cg cg;
    uz_error err = {0};
    uz_aside_allow(threads);
    (void)uz_aside_used();
    CHECK_INT(uz_modes_of_body(&modes, b->xyz, b->dof, b->n_nodes, 3, b->d, &err), UZ_OK);
    CHECK_INT(uz_multigrid_create(&mg, &b->K, &modes, NULL, 0, NULL, &err), UZ_OK);
    CHECK_INT(uz_aside_used(), threads);
    CHECK(mg->levels > 2);
    CHECK(((uz_aggregates *)mg)->level[0].A.seams > 2);
    CHECK(((uz_aggregates *)mg)->level[1].A.seams > 2);
    CHECK_INT(uz_cg_init(&cg, mg, &err), UZ_OK);
    CHECK_INT(uz_multigrid_apply(mg, &b->K, cg.room, z, x, &err), UZ_OK);
    mg->kind->multiply(mg, &b->K, cg.room, y, x);
    bool *held = calloc((size_t)b->d, sizeof *held);
    CHECK(held != NULL);
    for (int64_t j = 0; j < b->d; j++)
        held[j] = j * 7907 % 1000 < 200 + j * 300 / b->d;
    const uz_stop never = {NULL, INFINITY};
    CHECK_INT(uz_cg_hold(&cg, &b->K, held, &never, &err), UZ_OK);
    CHECK_INT(uz_multigrid_apply(mg, &b->K, cg.room, w, x, &err), UZ_OK);
    CHECK_INT(uz_cg_hold(&cg, &b->K, NULL, &never, &err), UZ_OK);
    free(held);
    mg->drift = 1e-6;
    memset(s, 0, (size_t)b->d * sizeof *s);
    CHECK_INT(uz_cg_solve(&info, s, &cg, &b->K, x, &stop, &err), UZ_OK);
    CHECK(info.met && info.iterations > 1);
    uz_cg_clear(&cg);
    uz_multigrid_free(mg);
    uz_modes_clear(&modes);
    uz_aside_allow(1);
}

TEST(threads_give_the_same_bits)
{
    brick b = brick_make((int64_t[3]){20, 20, 60}, (double[3]){1, 1, 1}, 0.3, true);
    const size_t bytes = (size_t)b.d * sizeof(double);
    double *x = malloc(bytes), *z[2] = {malloc(bytes), malloc(bytes)}, *y[2] = {malloc(bytes), malloc(bytes)},
           *s[2] = {malloc(bytes), malloc(bytes)}, *w[2] = {malloc(bytes), malloc(bytes)};
    CHECK(x && z[0] && z[1] && y[0] && y[1] && s[0] && s[1]);
    CHECK_INT(uz_aside_begin(THREADS), THREADS);
    for (int64_t j = 0; j < b.d; j++)
        x[j] = (double)(j * 7919 % 1000 - 500);
    make_and_apply(z[0], y[0], s[0], w[0], &b, x, 1);
    for (int threads = more_threads(1, THREADS); threads <= THREADS; threads++) {
        make_and_apply(z[1], y[1], s[1], w[1], &b, x, threads);
        CHECK(memcmp(z[0], z[1], bytes) == 0 && memcmp(y[0], y[1], bytes) == 0 && memcmp(s[0], s[1], bytes) == 0);
        CHECK(memcmp(w[0], w[1], bytes) == 0);
    }
    for (int k = 0; k < 2; k++) {
        free(z[k]);
        free(y[k]);
        free(s[k]);
        free(w[k]);
    }
    free(x);
    brick_free(&b);
}
