/* process.c: what BLAS and OpenMP must be told once. */
#include "uzawa.h"

#include "core/alloc.h"
#include "core/aside.h"
#include "core/reserve.h"
#include "factor/factor.h"
#include "linalg/blas.h"
#include "run/cost.h"

#include <signal.h>

/* Declared here rather than by the vendors' headers, which differ between compilers and packages. */
extern int openblas_get_num_threads(void);
extern int openblas_get_num_procs(void);
extern void openblas_set_num_threads(int threads);
extern void omp_set_max_active_levels(int levels);

/* OpenBLAS's own threads under several workers oversubscribe the cores (13 times slower was measured); under one they
 * spin between the small calls of iterations and substitutions. Only a large factorization is worth them. */
void uz_process_init(int workers)
{
    uz_factor_use_huge_pages();
    if (workers == 1)
        uz_factor_use_threads(openblas_get_num_threads());
    openblas_set_num_threads(1);
}

void uz_process_threads(int threads)
{
    uz_factor_use_threads(threads);
    uz_aside_allow(threads);
}

void uz_process_threads_now(int threads)
{
    uz_aside_allow(threads);
}

/* Also the threads that compute aside: a process that is confined later can start none. */
void uz_process_warm(void)
{
    enum { N = 512, K = 128 };
    const int threads = openblas_get_num_procs();
    double *Z = uz_alloc_zero(N * K, sizeof *Z), *C = uz_alloc_zero(N * N, sizeof *C);
    openblas_set_num_threads(threads > 2 ? threads : 1); /* of two one is the thread aside */
    if (Z && C)
        uz_block_syrk_t(N, K, Z, K, C);
    openblas_set_num_threads(1);
    uz_aside_begin(threads);
    uz_free_all(Z, C);
}

void uz_process_measure(void)
{
    uz_cost_measure();
}

void uz_process_reserve(uz_reserve *reserve)
{
    uz_factor_use_reserve(reserve);
    uz_reserve_start(reserve);
}

/* Debian's CHOLMOD asks for a team of 4 threads whatever the machine has. No active parallel level means a team of one.
 * METIS, called by CHOLMOD, swaps the handlers of SIGTERM and SIGABRT: a thread that blocks them is never inside its
 * longjmp. */
void uz_thread_init(void)
{
    sigset_t taken;
    omp_set_max_active_levels(0);
    sigemptyset(&taken);
    sigaddset(&taken, SIGTERM);
    sigaddset(&taken, SIGABRT);
    pthread_sigmask(SIG_BLOCK, &taken, NULL);
}
