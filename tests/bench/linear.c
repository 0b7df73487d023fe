/* linear.c: what a contact solve is compared with: CHOLMOD's own solve of the same K, as a user of CHOLMOD would
 * call it, with its supernodal LL' and one CHOLMOD thread (see solver/run/process.c). */
#include "bench.h"
#include "cholmod_copy.h"
#include "core/clock.h"

#include <math.h>
#include <string.h>
#include <time.h>

bench_linear bench_cholmod(const uz_csc *K, const double *p, bench_ordering ordering)
{
    cholmod_common common;
    bench_linear t;
    cholmod_l_start(&common);
    common.nmethods = 1;
    common.method[0].ordering = ordering == BENCH_AMD ? CHOLMOD_AMD : CHOLMOD_METIS;
    cholmod_sparse *A = cholmod_copy_of(K, &common);
    cholmod_dense *b = cholmod_l_allocate_dense((size_t)K->cols, 1, (size_t)K->cols, CHOLMOD_REAL, &common);
    memcpy(b->x, p, (size_t)K->cols * sizeof *p);
    double start = uz_seconds();
    cholmod_factor *L = cholmod_l_analyze(A, &common);
    t.analyze = uz_seconds() - start;
    start = uz_seconds();
    cholmod_l_factorize(A, L, &common);
    t.factorize = uz_seconds() - start;
    start = uz_seconds();
    cholmod_dense *x = cholmod_l_solve(CHOLMOD_A, L, b, &common);
    t.solve = uz_seconds() - start;
    cholmod_l_free_sparse(&A, &common);
    cholmod_l_free_dense(&x, &common);
    cholmod_l_free_dense(&b, &common);
    cholmod_l_free_factor(&L, &common);
    cholmod_l_finish(&common);
    return t;
}

bench_ordering bench_better_ordering(const uz_csc *K, const double *p)
{
    double best[2] = {INFINITY, INFINITY};
    for (int run = 0; run < 6; run++) { /* by turns: the first one may pay for memory that the others find */
        struct timespec from, to;       /* of the processor's time, which others on the machine change least */
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &from);
        bench_cholmod(K, p, run % 2 ? BENCH_METIS : BENCH_AMD);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &to);
        best[run % 2] =
            fmin(best[run % 2], (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec));
    }
    return best[0] <= best[1] ? BENCH_AMD : BENCH_METIS;
}
