#include "certificate/certificate.h"

#include "certificate/bound.h"
#include "certificate/feasible.h"
#include "certificate/residual.h"
#include "certificate/twofold.h"
#include "core/alloc.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uz_certify_input *in;
    const double *u;      /* d: the answer */
    uz_csc Nt;            /* d x m */
    double *weight;       /* d: W = diag(K)^-1 */
    uz_feasible feasible; /* v = u + c */
    uz_residuals res;     /* d each */
    int64_t d, m;
} certifier;

static uz_status prepare(certifier *c, const uz_certify_input *in, uz_error *err)
{
    memset(c, 0, sizeof *c);
    c->in = in;
    c->d = in->K->rows;
    c->m = in->N->rows;
    c->weight = uz_alloc(c->d, sizeof(double));
    double **room[] = {&c->res.e, &c->res.e_u, &c->res.Ku, &c->res.Kc};
    bool ok = c->weight != NULL;
    for (int k = 0; k < 4; k++)
        ok = (*room[k] = uz_alloc(c->d, sizeof(double))) && ok;
    uz_status status = uz_csc_transpose(&c->Nt, in->N, err);
    if (status != UZ_OK)
        return status;
    if (!ok || !uz_feasible_init(&c->feasible, &c->Nt, c->weight))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)c->d);
    uz_certify_weights(c->weight, in->K);
    return UZ_OK;
}

void uz_certify_weights(double *weight, const uz_csc *K)
{
    for (int64_t j = 0; j < K->cols; j++) {
        int64_t first = K->ptr[j];
        bool diagonal = first < K->ptr[j + 1] && K->idx[first] == j && K->val[first] > 0.0;
        weight[j] = diagonal ? 1.0 / K->val[first] : 1.0;
    }
}

static void release(certifier *c)
{
    uz_csc_clear(&c->Nt);
    free(c->weight);
    uz_feasible_clear(&c->feasible);
    free(c->res.e);
    free(c->res.e_u);
    free(c->res.Ku);
    free(c->res.Kc);
}

/* e'K^-1 e from the norm of K^-1 where that is good enough. */
static bool bound_cheaply(const certifier *c, double *square, const double *u)
{
    double weighted = 0.0, energy = 0.0;
    if (!isfinite(c->in->inverse_bound))
        return false;
    for (int64_t j = 0; j < c->d; j++) {
        weighted += c->res.e[j] * c->weight[j] * c->res.e[j];
        energy += u[j] * c->res.Ku[j];
    }
    *square = c->in->inverse_bound * weighted;
    if (c->in->moved)
        energy = c->in->whole_norm * c->in->whole_norm;
    return *square <= c->in->sharp * c->in->sharp * energy;
}

static double doubt(const certifier *c, double spread)
{
    return uz_bound_doubt(spread, c->in->rcond, c->d);
}

/* The spread is at most the largest eigenvalue of diag(K)^1/2 K^-1 diag(K)^1/2, for which the factor's diagonal gives 1
 * / rcond: short by up to 3e5 where it was measured. Good enough wherever the doubt that follows is harmless, which
 * saves half a solve. */
#define HARMLESS 1e-2

static double assumed_spread(const certifier *c)
{
    return 1e6 / fmax(c->in->rcond, DBL_MIN);
}

/* From w = K^-1 e, which took the place of e. */
static double spread_of_solution(const certifier *c, double square)
{
    double weighted = 0.0;
    for (int64_t j = 0; j < c->d; j++)
        weighted += c->res.e[j] / c->weight[j] * c->res.e[j];
    return square > 0.0 ? weighted / square : 0.0;
}

static double twofold_noise(const certifier *c, const double *u, double spread)
{
    double sum = 0.0;
    for (int64_t j = 0; j < c->d; j++) {
        double force = fabs(c->res.Ku[j]) + fabs(c->in->p[j]);
        sum += u[j] / c->weight[j] * u[j] + force * c->weight[j] * force;
    }
    return uz_bound_noise(spread, sum);
}

/* ||v - u_r||_K^2 = e'K^-1 e, enlarged by what rounding may hide. e is lost. */
static uz_status distance(certifier *c, double *square, const double *u, uz_error *err)
{
    double spread = c->in->inverse_bound;
    bool measured = !bound_cheaply(c, square, u), exact = doubt(c, assumed_spread(c)) > HARMLESS;
    uz_status status = UZ_OK;
    if (measured) {
        status = c->in->inverse_norm(c->in->ctx, square, c->res.e, exact, err);
        spread = exact ? spread_of_solution(c, *square) : assumed_spread(c);
    }
    *square = uz_bound_enlarge(*square, doubt(c, spread), twofold_noise(c, u, spread));
    return status;
}

/* The terms that are sums over the dofs. */
static void add_up(const certifier *c, uz_bound_terms *t, const double *u)
{
    const uz_residuals *res = &c->res;
    const double *p = c->in->p, *correction = c->feasible.correction;
    for (int64_t j = 0; j < c->d; j++) {
        t->stiffness += u[j] * res->Ku[j];
        t->load += u[j] * p[j];
        t->change += correction[j] * (res->Ku[j] - p[j] + 0.5 * res->Kc[j]);
        t->correction_energy += correction[j] * res->Kc[j];
        t->anything = t->anything || u[j] != 0.0 || correction[j] != 0.0 || res->e_u[j] != 0.0;
    }
    t->e1 = uz_bound_norm(res->e_u, c->d);
    t->force = uz_bound_norm(p, c->d);
    t->span = uz_bound_largest(c->Nt.val, c->Nt.ptr[c->m]) * uz_bound_largest(u, c->d);
}

static void add_dot(twofold *sum, double factor, const double *x, const double *y, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        twofold_add_product(&sum->hi, &sum->lo, factor * x[i], y[i], 0);
}

/* u'Ku = u'e_u + u'p + r'N u with e_u = K u - p - N'r, which is known in twofold precision, and N u = h - g. */
static void sharpen_energies(const certifier *c, uz_bound_terms *t, const double *u, const double *r, const double *g)
{
    twofold load = {0.0, 0.0};
    add_dot(&load, 1.0, u, c->in->p, c->d);
    twofold stiffness = load;
    add_dot(&stiffness, 1.0, u, c->res.e_u, c->d);
    add_dot(&stiffness, 1.0, r, c->in->h, c->m);
    add_dot(&stiffness, -1.0, r, g, c->m);
    t->load = load.hi + load.lo;
    t->stiffness = stiffness.hi + stiffness.lo;
}

static uz_status measure(certifier *c, uz_certificate *out, const double *u, const double *r, double *g,
                         double positive_part, uz_error *err)
{
    uz_bound_terms terms = {
        .square = INFINITY, .positive_part = positive_part, .moved = c->in->moved, .whole_norm = c->in->whole_norm};
    for (int64_t i = 0; i < c->m; i++)
        g[i] = uz_gap_of_row(&c->Nt, i, c->in->h, u, NULL);
    c->feasible.u = u;
    c->feasible.h = c->in->h;
    bool feasible = uz_make_feasible(&c->feasible, r);
    uz_status status =
        uz_equilibrium_residual(&c->res, c->in->K, c->in->N, c->in->p, u, c->feasible.correction, r, err);
    if (status != UZ_OK)
        return status;
    add_up(c, &terms, u);
    if (c->in->twofold_energies && isfinite(terms.stiffness) && isfinite(terms.load))
        sharpen_energies(c, &terms, u, r, g);
    if (feasible)
        status = distance(c, &terms.square, u, err);
    for (int64_t i = 0; i < c->m; i++)
        terms.complementarity -= r[i] * fabs(uz_feasible_gap(&c->feasible, i));
    uz_bound_conclude(out, &terms, feasible, r, g, c->in->h, c->m);
    return status;
}

double uz_certify_cut(double *r, int64_t m)
{
    double positive_part = 0.0;
    for (int64_t i = 0; i < m; i++) {
        if (r[i] > 0.0)
            positive_part = hypot(positive_part, r[i]);
        r[i] = fmin(r[i], 0.0);
    }
    return positive_part;
}

uz_status uz_certify(uz_certificate *out, double *r, double *g, const double *u, const uz_certify_input *input,
                     uz_error *err)
{
    certifier c;
    memset(out, 0, sizeof *out);
    uz_status status = prepare(&c, input, err);
    if (status == UZ_OK)
        status = measure(&c, out, u, r, g, uz_certify_cut(r, c.m), err);
    release(&c);
    return status;
}
