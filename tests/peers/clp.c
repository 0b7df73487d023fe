/* clp.c: the barrier of COIN-OR's CLP through its C interface. Rows of one entry are bounds on the columns. Methods:
 * "barrier", which stops there, and "crossover", which goes on to an active set with the simplex method for QPs. */
#include "core/alloc.h"
#include "peers/peer.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if __has_include(<coin/Clp_C_Interface.h>)
#include <coin/Clp_C_Interface.h>

/* CLP counts in int. */
typedef struct {
    int *start, *index;
} small;

static bool small_of(small *out, const uz_csc *A)
{
    int64_t nnz = A->ptr[A->cols];
    *out = (small){uz_alloc(A->cols + 1, sizeof(int)), uz_alloc(nnz, sizeof(int))};
    if (!out->start || !out->index)
        return false;
    for (int64_t j = 0; j <= A->cols; j++)
        out->start[j] = (int)A->ptr[j];
    for (int64_t k = 0; k < nnz; k++)
        out->index[k] = (int)A->idx[k];
    return true;
}

static void small_clear(small *x)
{
    free(x->start);
    free(x->index);
}

typedef struct {
    peer_bounds box;
    bool bounds;
    small K, N;
    double *cost, *low; /* d, m */
} room;

static bool room_of(room *out, const uz_qp *qp)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    memset(out, 0, sizeof *out);
    out->bounds = peer_bounds_of(&out->box, qp, DBL_MAX);
    if (!out->bounds)
        out->box = (peer_bounds){.lower = uz_alloc(d, sizeof(double)), .upper = uz_alloc(d, sizeof(double))};
    out->cost = uz_alloc(d, sizeof(double));
    out->low = uz_alloc(m, sizeof(double));
    if (!small_of(&out->K, &qp->K) || !small_of(&out->N, &qp->N) || !out->cost || !out->low || !out->box.lower ||
        !out->box.upper)
        return false;
    for (int64_t j = 0; j < d; j++) {
        out->cost[j] = -qp->p[j];
        if (!out->bounds)
            out->box.upper[j] = -(out->box.lower[j] = -DBL_MAX);
    }
    for (int64_t i = 0; i < m; i++)
        out->low[i] = -DBL_MAX;
    return true;
}

static void room_clear(room *x)
{
    peer_bounds_clear(&x->box);
    small_clear(&x->K);
    small_clear(&x->N);
    free(x->cost);
    free(x->low);
}

static void take_answer(peer_answer *answer, Clp_Simplex *model, const uz_qp *qp, const room *x)
{
    memcpy(answer->u, Clp_primalColumnSolution(model), (size_t)qp->K.cols * sizeof(double));
    if (x->bounds)
        peer_bounds_reactions(answer->r, &x->box, qp, Clp_dualColumnSolution(model));
    else if (qp->N.rows > 0)
        memcpy(answer->r, Clp_dualRowSolution(model), (size_t)qp->N.rows * sizeof(double));
    answer->iterations = Clp_numberIterations(model);
    if (Clp_status(model) != 0)
        snprintf(answer->status, sizeof answer->status, "CLP status %d", Clp_status(model));
}

static void run(peer_answer *answer, const uz_qp *qp, const room *x, const char *method, double tolerance)
{
    int d = (int)qp->K.cols, m = x->bounds ? 0 : (int)qp->N.rows;
    int *none = uz_alloc_zero(d + 1, sizeof *none);
    double start = peer_seconds();
    Clp_Simplex *model = Clp_newModel();
    Clp_setLogLevel(model, 0);
    Clp_loadProblem(model, d, m, m ? x->N.start : none, x->N.index, qp->N.val, x->box.lower, x->box.upper, x->cost,
                    x->low, qp->h);
    Clp_loadQuadraticObjective(model, d, x->K.start, x->K.index, qp->K.val);
    Clp_setPrimalTolerance(model, tolerance);
    Clp_setDualTolerance(model, tolerance);
    if (strcmp(method, "crossover") == 0)
        Clp_initialBarrierSolve(model);
    else
        Clp_initialBarrierNoCrossSolve(model);
    answer->seconds = peer_seconds() - start;
    take_answer(answer, model, qp, x);
    Clp_deleteModel(model);
    free(none);
}

static void solve(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file)
{
    room x;
    (void)file;
    if (room_of(&x, ctx))
        run(answer, ctx, &x, method, tolerance);
    else
        peer_fail(answer, "no memory");
    room_clear(&x);
}

#else

static const peer_method solve = peer_not_installed;

#endif

int main(int argc, char **argv)
{
    return peer_main(argc, argv, solve);
}
