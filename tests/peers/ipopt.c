/* ipopt.c: Ipopt (Waechter and Biegler, Math. Program. 106 (2006)) with the exact constant Hessian K and MUMPS. Rows of
 * one entry are bounds on the variables, others linear constraints. Bounds are not relaxed (bound_relax_factor 0: its
 * default of 1e-8 is a length in whatever units the problem has), and mehrotra_algorithm is what the manual offers for
 * convex QPs: methods "mehrotra" and "default". */
#include "core/alloc.h"
#include "peers/peer.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if __has_include(<IpStdCInterface.h>)
#include <IpStdCInterface.h>

typedef struct {
    const uz_qp *qp;
    bool bounds;
    int64_t iterations;
} quadratic;

static Bool gradient(Index n, Number *x, Bool new_x, Number *out, UserDataPtr data)
{
    const uz_qp *qp = ((const quadratic *)data)->qp;
    (void)new_x;
    for (Index j = 0; j < n; j++)
        out[j] = -qp->p[j];
    uz_csc_symv(out, &qp->K, 1.0, x);
    return TRUE;
}

/* 1/2 u'Ku - p'u, column by column. */
static Bool objective(Index n, Number *x, Bool new_x, Number *out, UserDataPtr data)
{
    const uz_qp *qp = ((const quadratic *)data)->qp;
    const uz_csc *K = &qp->K;
    (void)new_x;
    *out = 0.0;
    for (Index j = 0; j < n; j++) {
        double force = -qp->p[j];
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++)
            force += (K->idx[k] == j ? 0.5 : 1.0) * K->val[k] * x[K->idx[k]];
        *out += x[j] * force;
    }
    return TRUE;
}

static Bool constraints(Index n, Number *x, Bool new_x, Index m, Number *out, UserDataPtr data)
{
    (void)n, (void)new_x;
    memset(out, 0, (size_t)m * sizeof *out);
    uz_csc_gaxpy(out, &((const quadratic *)data)->qp->N, 1.0, x);
    return TRUE;
}

/* The entries of A times factor, or where they are. */
static void entries(const uz_csc *A, Index *row, Index *col, Number *values, double factor)
{
    for (int64_t j = 0; j < A->cols; j++)
        for (int64_t k = A->ptr[j]; k < A->ptr[j + 1]; k++) {
            if (values) {
                values[k] = factor * A->val[k];
            } else {
                row[k] = (Index)A->idx[k];
                col[k] = (Index)j;
            }
        }
}

static Bool jacobian(Index n, Number *x, Bool new_x, Index m, Index count, Index *row, Index *col, Number *values,
                     UserDataPtr data)
{
    (void)n, (void)x, (void)new_x, (void)m;
    if (count > 0)
        entries(&((const quadratic *)data)->qp->N, row, col, values, 1.0);
    return TRUE;
}

static Bool hessian(Index n, Number *x, Bool new_x, Number factor, Index m, Number *lambda, Bool new_lambda,
                    Index count, Index *row, Index *col, Number *values, UserDataPtr data)
{
    (void)n, (void)x, (void)new_x, (void)m, (void)lambda, (void)new_lambda, (void)count;
    entries(&((const quadratic *)data)->qp->K, row, col, values, factor);
    return TRUE;
}

static Bool count_iterations(Index mode, Index iteration, Number a, Number b, Number c, Number d, Number e, Number f,
                             Number g, Number h, Index i, UserDataPtr data)
{
    (void)mode, (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h, (void)i;
    ((quadratic *)data)->iterations = iteration;
    return TRUE;
}

/* Ipopt's strings are not const, though it only reads them. */
static void set_text(IpoptProblem nlp, const char *name, const char *value)
{
    char key[64], text[64];
    snprintf(key, sizeof key, "%s", name);
    snprintf(text, sizeof text, "%s", value);
    AddIpoptStrOption(nlp, key, text);
}

static void set_number(IpoptProblem nlp, const char *name, double value)
{
    char key[64];
    snprintf(key, sizeof key, "%s", name);
    AddIpoptNumOption(nlp, key, value);
}

static void set_options(IpoptProblem nlp, const char *method, double tolerance)
{
    static const char *const tolerances[] = {"tol", "dual_inf_tol", "constr_viol_tol", "compl_inf_tol"};
    for (int k = 0; k < 4; k++)
        set_number(nlp, tolerances[k], tolerance);
    set_number(nlp, "bound_relax_factor", 0.0);
    set_text(nlp, "sb", "yes");
    set_text(nlp, "hessian_constant", "yes");
    set_text(nlp, "jac_c_constant", "yes");
    set_text(nlp, "jac_d_constant", "yes");
    set_text(nlp, "linear_solver", "mumps");
    if (strcmp(method, "mehrotra") == 0)
        set_text(nlp, "mehrotra_algorithm", "yes");
    AddIpoptIntOption(nlp, (char[]){"print_level"}, 0);
    AddIpoptIntOption(nlp, (char[]){"acceptable_iter"}, 0);
    AddIpoptIntOption(nlp, (char[]){"max_iter"}, 200);
    SetIntermediateCallback(nlp, count_iterations);
}

/* Room of bounds and multipliers. With rows that are bounds there are no constraints. */
typedef struct {
    peer_bounds box;
    double *low, *multiplier, *pull, *push, *value; /* m, m, d, d, m */
} room;

static bool room_of(room *out, const uz_qp *qp, quadratic *q)
{
    int64_t d = qp->K.cols, m = qp->N.rows;
    memset(out, 0, sizeof *out);
    q->bounds = peer_bounds_of(&out->box, qp, 2e19);
    if (!q->bounds)
        out->box = (peer_bounds){.lower = uz_alloc(d, sizeof(double)), .upper = uz_alloc(d, sizeof(double))};
    out->low = uz_alloc(m, sizeof(double));
    out->multiplier = uz_alloc_zero(m, sizeof(double));
    out->value = uz_alloc_zero(m, sizeof(double));
    out->pull = uz_alloc_zero(d, sizeof(double));
    out->push = uz_alloc_zero(d, sizeof(double));
    if (!out->box.lower || !out->box.upper || !out->low || !out->multiplier || !out->value || !out->pull || !out->push)
        return false;
    for (int64_t j = 0; !q->bounds && j < d; j++)
        out->box.upper[j] = -(out->box.lower[j] = -2e19);
    for (int64_t i = 0; i < m; i++)
        out->low[i] = -2e19;
    return true;
}

static void room_clear(room *x)
{
    peer_bounds_clear(&x->box);
    free(x->low);
    free(x->multiplier);
    free(x->pull);
    free(x->push);
    free(x->value);
}

/* Ku - p + N'multiplier + push - pull = 0 */
static void take_reactions(double *r, room *x, const quadratic *q)
{
    for (int64_t j = 0; q->bounds && j < q->qp->K.cols; j++)
        x->pull[j] -= x->push[j];
    if (q->bounds)
        peer_bounds_reactions(r, &x->box, q->qp, x->pull);
    for (int64_t i = 0; !q->bounds && i < q->qp->N.rows; i++)
        r[i] = -x->multiplier[i];
}

static void run(peer_answer *answer, quadratic *q, room *x, const char *method, double tolerance)
{
    const uz_qp *qp = q->qp;
    Index m = q->bounds ? 0 : (Index)qp->N.rows;
    Number value;
    double start = peer_seconds();
    IpoptProblem nlp = CreateIpoptProblem((Index)qp->K.cols, x->box.lower, x->box.upper, m, x->low, qp->h,
                                          m ? (Index)qp->N.ptr[qp->N.cols] : 0, (Index)qp->K.ptr[qp->K.cols], 0,
                                          objective, constraints, gradient, jacobian, hessian);
    set_options(nlp, method, tolerance);
    enum ApplicationReturnStatus status =
        IpoptSolve(nlp, answer->u, x->value, &value, x->multiplier, x->pull, x->push, q);
    FreeIpoptProblem(nlp);
    answer->seconds = peer_seconds() - start;
    answer->iterations = q->iterations;
    take_reactions(answer->r, x, q);
    if (status != Solve_Succeeded && status != Solved_To_Acceptable_Level &&
        status != Search_Direction_Becomes_Too_Small)
        snprintf(answer->status, sizeof answer->status, "Ipopt status %d", (int)status);
}

static void solve(peer_answer *answer, void *ctx, const char *method, double tolerance, const char *file)
{
    quadratic q = {.qp = ctx};
    room x;
    (void)file;
    if (room_of(&x, q.qp, &q))
        run(answer, &q, &x, method, tolerance);
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
