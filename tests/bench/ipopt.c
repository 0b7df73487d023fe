/* ipopt.c: what an obstacle problem is compared with: Ipopt (Waechter and Biegler, Math. Program. 106 (2006)) with
 * bounds on the variables, the exact constant Hessian K and its default tolerance, 1e-8. Optional: bench only, and only
 * where it is installed (Debian: coinor-libipopt-dev). */
#include "bench/bench.h"

#include <math.h>

#if __has_include(<IpStdCInterface.h>)

#include "core/clock.h"

#include <IpStdCInterface.h>
#include <string.h>

typedef struct {
    const uz_csc *K;
    const double *p;
} quadratic;

/* Ipopt's strings are not const, though it only reads them. */
static void set_text(IpoptProblem nlp, const char *name, const char *value)
{
    char key[64], text[64];
    snprintf(key, sizeof key, "%s", name);
    snprintf(text, sizeof text, "%s", value);
    AddIpoptStrOption(nlp, key, text);
}

static void stiffness_times(double *y, const quadratic *q, const double *x)
{
    memset(y, 0, (size_t)q->K->cols * sizeof *y);
    uz_csc_symv(y, q->K, 1.0, x);
}

static Bool gradient(Index n, Number *x, Bool new_x, Number *out, UserDataPtr data)
{
    const quadratic *q = data;
    (void)new_x;
    stiffness_times(out, q, x);
    for (Index j = 0; j < n; j++)
        out[j] -= q->p[j];
    return TRUE;
}

/* 1/2 u'Ku - p'u, column by column. */
static Bool objective(Index n, Number *x, Bool new_x, Number *out, UserDataPtr data)
{
    const quadratic *q = data;
    const uz_csc *K = q->K;
    double sum = 0.0;
    (void)new_x;
    for (Index j = 0; j < n; j++) {
        double force = 0.5 * K->val[K->ptr[j]] * x[j] - q->p[j];
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++)
            force += K->val[k] * x[K->idx[k]];
        sum += x[j] * force;
    }
    *out = sum;
    return TRUE;
}

static Bool no_constraints(Index n, Number *x, Bool new_x, Index m, Number *g, UserDataPtr data)
{
    (void)n, (void)x, (void)new_x, (void)m, (void)g, (void)data;
    return TRUE;
}

static Bool no_jacobian(Index n, Number *x, Bool new_x, Index m, Index count, Index *row, Index *col, Number *values,
                        UserDataPtr data)
{
    (void)n, (void)x, (void)new_x, (void)m, (void)count, (void)row, (void)col, (void)values, (void)data;
    return TRUE;
}

static Bool hessian(Index n, Number *x, Bool new_x, Number factor, Index m, Number *lambda, Bool new_lambda,
                    Index count, Index *row, Index *col, Number *values, UserDataPtr data)
{
    const uz_csc *K = ((const quadratic *)data)->K;
    (void)x, (void)new_x, (void)m, (void)lambda, (void)new_lambda, (void)count;
    for (Index j = 0; j < n; j++)
        for (int64_t k = K->ptr[j]; k < K->ptr[j + 1]; k++) {
            if (values) {
                values[k] = factor * K->val[k];
            } else {
                row[k] = (Index)K->idx[k];
                col[k] = j;
            }
        }
    return TRUE;
}

double bench_ipopt(double *u, double *value, const uz_csc *K, const double *p, double *lower, double *upper)
{
    quadratic q = {K, p};
    double start = uz_seconds();
    IpoptProblem nlp = CreateIpoptProblem((Index)K->cols, lower, upper, 0, NULL, NULL, 0, (Index)K->ptr[K->cols], 0,
                                          objective, no_constraints, gradient, no_jacobian, hessian);
    AddIpoptIntOption(nlp, (char[]){"print_level"}, 0);
    set_text(nlp, "sb", "yes");
    set_text(nlp, "hessian_constant", "yes");
    enum ApplicationReturnStatus status = IpoptSolve(nlp, u, NULL, value, NULL, NULL, NULL, &q);
    FreeIpoptProblem(nlp);
    return status == Solve_Succeeded ? uz_seconds() - start : NAN;
}

#else

double bench_ipopt(double *u, double *value, const uz_csc *K, const double *p, double *lower, double *upper)
{
    (void)u, (void)K, (void)p, (void)lower, (void)upper;
    *value = NAN;
    return NAN;
}

#endif
