/* ordering.c: fill-reducing orderings of the graph of nodes with those of the contact last (Amestoy, Davis, Duff, SIAM
 * J. Matrix Anal. Appl. 17 (1996)). */
#include "factor/factor_private.h"

#include "core/alloc.h"
#include "core/error.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

enum { TINY = 4 };

uz_status uz_move_last(int64_t *perm, int64_t n, const int64_t *last, int64_t n_last, uz_error *err)
{
    bool *is_last = uz_alloc_zero(n, sizeof *is_last);
    int64_t *tail = uz_alloc(n_last, sizeof *tail);
    bool ok = is_last && tail;
    int64_t kept = 0, moved = 0;
    for (int64_t k = 0; ok && k < n_last; k++)
        is_last[last[k]] = true;
    for (int64_t k = 0; ok && k < n; k++) {
        if (is_last[perm[k]])
            tail[moved++] = perm[k];
        else
            perm[kept++] = perm[k];
    }
    for (int64_t k = 0; k < moved; k++)
        perm[kept + k] = tail[k];
    uz_free_all(is_last, tail);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld nodes", (long long)n);
}

uz_status uz_order(int64_t *perm, cholmod_sparse *graph, const int64_t *last, int64_t n_last, uz_ordering ordering,
                   cholmod_common *common, uz_error *err)
{
    static pthread_mutex_t metis_mutex = PTHREAD_MUTEX_INITIALIZER;
    static const int taken[2] = {SIGTERM, SIGABRT};
    int64_t n = (int64_t)graph->nrow;
    bool ok = true;
    if (n < TINY) { /* nothing to reduce, and CAMD reads past the end at n = 1 */
        for (int64_t k = 0; k < n; k++)
            perm[k] = k;
    } else if (ordering == UZ_ORDERING_CAMD) { /* with the contact as a constraint set */
        SuiteSparse_long *member = uz_alloc_zero(n, sizeof *member);
        for (int64_t k = 0; member && k < n_last; k++)
            member[last[k]] = 1;
        ok = member && cholmod_l_camd(graph, NULL, 0, member, (SuiteSparse_long *)perm, common);
        free(member);
    } else if (ordering == UZ_ORDERING_AMD) {
        ok = cholmod_l_amd(graph, NULL, 0, (SuiteSparse_long *)perm, common);
    } else {
        /* METIS installs its own handlers for SIGTERM and SIGABRT while it runs and uses the process's rand(): calls
         * are serialised for the whole process and the dispositions put back. The mutex guards METIS's process-wide
         * state, it holds none of ours. Callers block these signals in their threads (see uz_thread_init). */
        struct sigaction before[2];
        pthread_mutex_lock(&metis_mutex);
        for (int i = 0; i < 2; i++)
            sigaction(taken[i], NULL, &before[i]);
        ok = cholmod_l_metis(graph, NULL, 0, 1, (SuiteSparse_long *)perm, common);
        for (int i = 0; i < 2; i++)
            sigaction(taken[i], &before[i], NULL);
        pthread_mutex_unlock(&metis_mutex);
    }
    if (ok && common->status >= CHOLMOD_OK)
        return uz_move_last(perm, n, last, n_last, err);
    if (common->status == CHOLMOD_OUT_OF_MEMORY || common->status == CHOLMOD_OK)
        return uz_fail(err, UZ_ERR_MEMORY, "K", "no memory to order a matrix of %lld nodes", (long long)n);
    return uz_fail(err, UZ_ERR_INTERNAL, "K", "ordering failed (CHOLMOD status %d)", common->status);
}
