#include "certificate/certificate.h"

#include "certificate/bound.h"
#include "certificate/feasible.h"
#include "certificate/one_sided.h"
#include "certificate/residual.h"
#include "certificate/double_double.h"
#include "core/alloc.h"
#include "core/aside.h"
#include "core/cpu.h"
#include "core/error.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const uz_certify_input *in;
    const double *u;      /* d: the answer */
    uz_csc Nt;            /* n_b x m: N' on the dofs that N touches */
    int64_t *dof;         /* n_b: these */
    double *u_b;          /* n_b: u there */
    double *weight_b;     /* n_b */
    double *weight;       /* d: W = diag(K)^-1 */
    double *c;            /* d: correction, zero elsewhere */
    uz_feasible feasible; /* v = u + c, on n_b dofs */
    uz_residuals res;     /* d each */
    double energy;        /* u'Ku */
    double weighted;      /* e'W e */
    uz_energy_sums sums;
    int64_t d, m, n_b;
} certifier;

static uz_status prepare(certifier *c, const uz_certify_input *in, const double *u, uz_error *err)
{
    memset(c, 0, sizeof *c);
    c->in = in;
    c->u = u;
    c->d = in->K->rows;
    c->m = in->N->rows;
    uz_status status = uz_touched_dofs(&c->Nt, &c->dof, in->N, err);
    if (status != UZ_OK)
        return status;
    c->n_b = c->Nt.rows;
    double **of_d[] = {&c->res.e, &c->res.e_u, &c->res.Ku, &c->res.Kc, &c->weight};
    bool ok = true;
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = (*of_d[k] = uz_alloc(c->d, sizeof(double))) && ok;
    c->c = uz_alloc_zero(c->d, sizeof(double));
    c->u_b = uz_alloc(c->n_b, sizeof(double));
    c->weight_b = uz_alloc(c->n_b, sizeof(double));
    c->res.weight = c->weight;
    c->res.brick = in->brick;
    c->sums.terms = in->terms > 0 ? in->terms : uz_most_terms(in->K, in->brick, in->N);
    ok = ok && c->c && c->u_b && c->weight_b && c->sums.terms > 0;
    if (!ok || !uz_feasible_init(&c->feasible, &c->Nt, c->weight_b))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld dofs", (long long)c->d);
    for (int64_t b = 0; b < c->n_b; b++) {
        c->weight_b[b] = uz_dof_weight(in->K, c->dof[b]);
        c->u_b[b] = u[c->dof[b]];
    }
    return UZ_OK;
}

/* How far an estimate of the inverse's norm, from single vectors that rounding made, may be below it. */
#define SURELY 1e3

/* (1 - doubt) e'K^-1 e <= ||S^-1 e||^2 for any doubt below 1 (distrust.h), and the bound on the inverse from which it
 * follows holds whatever its size: a doubt of this much is as safe as a small one. It is only dearer, and the bound
 * that pays for it may be as sharp as was asked for nevertheless. */
#define AFFORDABLE 0.5

/* Times the square of half of what is asked for: half of its square. */
#define ENOUGH 2.0

uz_status uz_certify_distance(double *square, bool *spared, const uz_certify_input *in, double *e, int64_t d,
                              double weighted, double energy, const uz_energy_sums *energies, uz_error *err)
{
    const double harmless = in->sharp * in->sharp * (in->moved ? in->whole_norm * in->whole_norm : energy);
    double inverse = in->inverse_bound, doubt = uz_bound_doubt(inverse, d);
    uz_status status = UZ_OK;
    *square = inverse * weighted;
    *spared = in->spares && doubt <= UZ_BOUND_HARMLESS && *square <= harmless;
    if (!*spared) {
        status = in->inverse_norm(in->ctx, square, e, ENOUGH * harmless, err);
        if (!in->measure_doubt) {
            /* The solve is one of conjugate gradients, whose rounding is that of products with K. A residual is
             * rounding, in all directions alike: e'K^-1 e / e'W e is the mean of d eigenvalues. */
            const double seen =
                fmax(1.0 / fmax(in->rcond, DBL_MIN), weighted > 0.0 ? (double)d * (*square / weighted) : 0.0);
            inverse = SURELY * seen;
            doubt = uz_bound_doubt(seen, d);
        }
        const bool small = doubt <= UZ_BOUND_HARMLESS || (doubt <= AFFORDABLE && *square / (1.0 - doubt) <= harmless);
        if (status == UZ_OK && in->measure_doubt && !small)
            status = in->measure_doubt(in->ctx, &doubt, err);
    }
    *square = uz_bound_enlarge(*square, doubt, inverse, weighted, energies);
    return status;
}

/* ------------------------------------------------- sums over the dofs, four at a time */

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t bits __attribute__((vector_size(32), aligned(8), may_alias));

typedef struct {
    four stiffness, load, load_low, load_size, work, work_size, change, change_size, correction_energy, weighted, noise;
    four largest; /* not a sum: of |u|; what is not a number is passed over */
    bits anything;
} sums;

enum { VECTORS = 8 };

/* From entry j on of u, p, c, K u, K c, e, e_u and the weights. */
UZ_INLINE void add_four(sums *s, const double *const x[VECTORS], int64_t j, int fused)
{
    four v[VECTORS];
    for (int k = 0; k < VECTORS; k++)
        v[k] = *(const four *)(x[k] + j);
    const four u = v[0], p = v[1], c = v[2], Ku = v[3], Kc = v[4], e = v[5], e_u = v[6], weight = v[7];
    const four force = (four)((bits)Ku & INT64_MAX) + (four)((bits)p & INT64_MAX), load = u * p, work = u * e_u;
    const four sum = s->load + load, back = sum - s->load;
    four error = {0.0};
    for (int l = 0; l < 4; l++)
        error[l] = fused ? __builtin_fma(u[l], p[l], -load[l]) : product_error_split(u[l], p[l], load[l]);
    s->load_low += ((s->load - (sum - back)) + (load - back)) + error;
    s->load = sum;
    s->load_size += (four)((bits)load & INT64_MAX);
    s->stiffness += u * Ku;
    s->work += work;
    s->work_size += (four)((bits)work & INT64_MAX);
    s->change += c * (Ku - p + 0.5 * Kc);
    s->change_size += (four)((bits)c & INT64_MAX) * (force + (four)((bits)Kc & INT64_MAX));
    s->correction_energy += c * Kc;
    s->weighted += e * weight * e;
    s->noise += u / weight * u + force * weight * force;
    const bits size = (bits)u & INT64_MAX, more = (four)size > s->largest;
    s->largest = (four)((size & more) | ((bits)s->largest & ~more));
    s->anything |= ((bits)u | (bits)c | (bits)e_u) & INT64_MAX;
}

UZ_INLINE void add_all(sums *s, const double *const x[VECTORS], int64_t d, int fused)
{
    double rest[VECTORS][4] = {{0}};
    const double *last[VECTORS];
    int64_t j = 0;
    for (; j + 4 <= d; j += 4)
        add_four(s, x, j, fused);
    for (int k = 0; k < VECTORS; k++) {
        last[k] = rest[k];
        for (int l = 0; l < 4; l++)
            rest[k][l] = j + l < d ? x[k][j + l] : k == VECTORS - 1;
    }
    add_four(s, last, 0, fused);
}

UZ_AVX2_FMA static void add_all_fused(sums *s, const double *const x[VECTORS], int64_t d)
{
    add_all(s, x, d, 1);
}

/* Of how many dofs a part has the sums, at least, and how many parts there are at most: d alone decides. */
enum { PART_LEAST = 65536, PARTS_MOST = 16 };

/* The sums as the threads that share the dofs see them. */
typedef struct {
    const double *const *x;
    int64_t d;
    int parts;
    sums of[PARTS_MOST];
} adding;

static void add_part(void *ctx, int part)
{
    adding *a = ctx;
    const int64_t begin = a->d * part / a->parts, end = a->d * (part + 1) / a->parts;
    const double *x[VECTORS];
    for (int k = 0; k < VECTORS; k++)
        x[k] = a->x[k] + begin;
    memset(&a->of[part], 0, sizeof a->of[part]);
    if (uz_cpu_has_avx2_fma())
        add_all_fused(&a->of[part], x, end - begin);
    else
        add_all(&a->of[part], x, end - begin, 0);
}

static void add_sums(sums *s, const sums *more)
{
    const four sum = s->load + more->load, back = sum - s->load;
    s->load_low += ((s->load - (sum - back)) + (more->load - back)) + more->load_low;
    s->load = sum;
    s->load_size += more->load_size;
    s->stiffness += more->stiffness;
    s->work += more->work;
    s->work_size += more->work_size;
    s->change += more->change;
    s->change_size += more->change_size;
    s->correction_energy += more->correction_energy;
    s->weighted += more->weighted;
    s->noise += more->noise;
    const bits larger = more->largest > s->largest;
    s->largest = (four)(((bits)more->largest & larger) | ((bits)s->largest & ~larger));
    s->anything |= more->anything;
}

static double total(const four *x)
{
    return ((*x)[0] + (*x)[1]) + ((*x)[2] + (*x)[3]);
}

/* Two norms, one for each of two threads: they are sums in one order. */
typedef struct {
    const double *of[2];
    int64_t d;
    double norm[2];
} norms;

static void find_norm(void *ctx, int k)
{
    norms *x = ctx;
    x->norm[k] = uz_bound_norm(x->of[k], x->d);
}

/* The terms that are sums over the dofs. */
static void add_up(certifier *c, uz_bound_terms *t)
{
    const uz_residuals *res = &c->res;
    uz_energy_sums *energies = &c->sums;
    const double *const x[VECTORS] = {c->u, c->in->p, c->c, res->Ku, res->Kc, res->e, res->e_u, c->weight};
    const int64_t parts = c->d / PART_LEAST;
    adding all = {.x = x, .d = c->d, .parts = parts < 1 ? 1 : parts < PARTS_MOST ? (int)parts : PARTS_MOST};
    uz_aside_share(add_part, &all, all.parts);
    sums s = all.of[0];
    for (int part = 1; part < all.parts; part++)
        add_sums(&s, &all.of[part]);
    double_double load = {0.0, total(&s.load_low)};
    for (int l = 0; l < 4; l++)
        dd_add(&load, s.load[l]);
    t->stiffness = c->energy = total(&s.stiffness);
    energies->load = load.hi;
    energies->load_low = load.lo;
    energies->load_size = total(&s.load_size);
    energies->work = total(&s.work);
    energies->work_size = total(&s.work_size);
    energies->noise = total(&s.noise);
    energies->change_size = total(&s.change_size);
    t->change = total(&s.change);
    t->correction_energy = total(&s.correction_energy);
    t->anything = (s.anything[0] | s.anything[1] | s.anything[2] | s.anything[3]) != 0;
    c->weighted = total(&s.weighted);
    norms both = {.of = {res->e_u, c->in->p}, .d = c->d};
    uz_aside_share(find_norm, &both, 2);
    t->e1 = both.norm[0];
    t->force = both.norm[1];
    t->span = uz_bound_largest(c->Nt.val, c->Nt.ptr[c->m]) * uz_bound_largest((const double *)&s.largest, 4);
}

/* The bound that r gives, with the correction that there is. */
static uz_status conclude(certifier *c, uz_certificate *out, const double *r, const double *g, double positive_part,
                          bool feasible, uz_error *err)
{
    uz_bound_terms terms = {.square = INFINITY,
                            .positive_part = positive_part,
                            .moved = c->in->moved,
                            .acting = c->in->acting,
                            .whole_norm = c->in->whole_norm};
    uz_status status = uz_equilibrium_residual(&c->res, c->in->K, c->in->N, c->in->p, c->u, c->c, r, err);
    if (status != UZ_OK)
        return status;
    const uz_csc *N = c->in->N;
    uz_energy_sums *energies = &c->sums;
    energies->correction = energies->pressed = energies->rows = 0.0;
    for (int64_t b = 0; b < c->n_b; b++) {
        const int64_t j = c->dof[b];
        double force = 0.0;
        for (int64_t k = N->ptr[j]; k < N->ptr[j + 1]; k++)
            force += fabs(N->val[k] * r[N->idx[k]]);
        energies->rows += force * c->weight_b[b] * force;
        energies->correction += c->c[j] / c->weight_b[b] * c->c[j];
    }
    for (int64_t i = 0; i < c->m; i++)
        energies->pressed -= r[i] * c->feasible.size[i];
    add_up(c, &terms);
    terms.correction_energy += uz_bound_rounding(energies, c->d);
    uz_bound_energy(&terms, energies, r, g, c->in->h, c->d, c->m);
    terms.complementarity = uz_feasible_complementarity(&c->feasible, r, true);
    terms.settled = feasible ? c->feasible.exact.length : 0.0;
    terms.pressed = terms.settled > 0.0 ? uz_feasible_complementarity(&c->feasible, r, false) : 0.0;
    uz_certify_input in = *c->in;
    for (bool spared = true; status == UZ_OK && spared; in.spares = false) {
        spared = false;
        if (feasible)
            status =
                uz_certify_distance(&terms.square, &spared, &in, c->res.e, c->d, c->weighted, c->energy, energies, err);
        uz_bound_conclude(out, &terms, feasible, r, g, in.h, c->m);
        spared = spared && uz_bound_blames_distance(out, terms.square, 2.0 * in.sharp);
    }
    return status;
}

/* More of the bound than this comes from rows that r presses on and that are open. */
#define OPEN_SHARE 0.1

uz_status uz_certify(uz_certificate *out, double *r, double *g, const double *u, const uz_certify_input *input,
                     uz_error *err)
{
    certifier c;
    double positive_part = 0.0, *kept = NULL;
    bool feasible = false;
    memset(out, 0, sizeof *out);
    uz_status status = prepare(&c, input, u, err);
    if (status == UZ_OK) {
        positive_part = uz_cut_reactions(r, c.m);
        for (int64_t i = 0; i < c.m; i++)
            g[i] = uz_gap_of_row(&c.Nt, i, input->h, c.u_b, NULL);
        c.feasible.u = c.u_b;
        c.feasible.h = input->h;
        feasible = uz_make_feasible(&c.feasible, r);
        for (int64_t b = 0; b < c.n_b; b++)
            c.c[c.dof[b]] = c.feasible.correction[b];
        status = conclude(&c, out, r, g, positive_part, feasible, err);
    }
    if (status == UZ_OK && c.feasible.pushed &&
        uz_feasible_complementarity(&c.feasible, r, feasible) > OPEN_SHARE * out->gap) {
        /* Rows that depend on each other share their reactions in many ways. Some press on rows that others leave no
         * way to close: r takes the form that presses on closed rows only, where its bound is better. */
        const uz_certificate before = *out;
        kept = uz_alloc(c.m, sizeof *kept);
        if (!kept)
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory to certify %lld rows", (long long)c.m);
        for (int64_t i = 0; kept && i < c.m; i++) {
            kept[i] = r[i];
            r[i] = r[i] - c.feasible.push[i];
        }
        if (kept) {
            uz_cut_reactions(r, c.m);
            status = conclude(&c, out, r, g, positive_part, true, err);
        }
        if (kept && !(out->absolute_error < before.absolute_error)) {
            memcpy(r, kept, (size_t)c.m * sizeof *r);
            *out = before;
        }
    }
    uz_free_all(c.res.e, c.res.e_u, c.res.Ku, c.res.Kc, c.weight, c.weight_b, c.u_b, c.c, kept);
    uz_csc_clear(&c.Nt);
    free(c.dof);
    uz_feasible_clear(&c.feasible);
    return status;
}
