#include "certificate/bound.h"

#include "certificate/double_double.h"
#include "certificate/one_sided.h"

#include <float.h>
#include <math.h>

typedef double four __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t bits __attribute__((vector_size(32), aligned(8), may_alias));

double uz_bound_norm(const double *x, int64_t n)
{
    four lanes = {0.0}, other = {0.0};
    double rest = 0.0, scale = 0.0, sum;
    int64_t i = 0;
    for (; i + 8 <= n; i += 8) {
        lanes += *(const four *)(x + i) * *(const four *)(x + i);
        other += *(const four *)(x + i + 4) * *(const four *)(x + i + 4);
    }
    for (; i < n; i++)
        rest += x[i] * x[i];
    lanes += other;
    sum = ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + rest;
    if (sum > 0x1p-800 && sum < 0x1p800)
        return sqrt(sum);
    /* squares that left the range of double, or may have */
    for (i = 0; i < n; i++) {
        if (x[i] != x[i]) /* comparisons pass over it */
            return NAN;
        scale = fabs(x[i]) > scale ? fabs(x[i]) : scale;
    }
    sum = 0.0;
    for (i = 0; scale > 0.0 && i < n; i++)
        sum += (x[i] / scale) * (x[i] / scale);
    return scale * sqrt(sum);
}

double uz_bound_largest(const double *x, int64_t n)
{
    enum { APART = 4 }; /* that a comparison need not wait for the one before */
    four most[APART] = {{0.0}};
    double largest = 0.0;
    int64_t i = 0;
    for (; i + 4 * APART <= n; i += 4 * APART)
        for (int k = 0; k < APART; k++) { /* lane by lane; passes over what is not a number */
            const four here = *(const four *)(x + i + 4 * k);
            const bits magnitude = (bits)here & INT64_MAX, more = (four)magnitude > most[k];
            most[k] = (four)((magnitude & more) | ((bits)most[k] & ~more));
        }
    for (; i < n; i++)
        largest = fabs(x[i]) > largest ? fabs(x[i]) : largest;
    for (int k = 0; k < 4 * APART; k++)
        largest = most[k / 4][k % 4] > largest ? most[k / 4][k % 4] : largest;
    return largest;
}

static double ratio(double value, double scale)
{
    if (value == 0.0)
        return 0.0;
    return scale > 0.0 ? value / scale : INFINITY;
}

double uz_bound_doubt(double inverse, int64_t d)
{
    return DBL_EPSILON * sqrt((double)d) * 8.0 * inverse;
}

/* Of the magnitudes that a double-double sum of so many terms adds up. */
static double hidden(int64_t terms)
{
    const double n = (double)terms + 2.0;
    return 0x1p-104 * n * n;
}

double uz_bound_rounding(const uz_energy_sums *s, int64_t d)
{
    const double n = (double)s->terms;
    return DBL_EPSILON * n * (n + (double)d + 8.0) * s->correction;
}

/* Beyond it too little is left of the factor to say anything. */
#define MOST_DOUBT 0.9

double uz_bound_enlarge(double square, double doubt, double inverse, double weighted, const uz_energy_sums *s)
{
    /* what rounding may hide of e, in the norm of K^-1: that of its double-double sums, of K c and of e to doubles */
    const double n = (double)s->terms;
    const double noise = (1.0 + 0x1p-20) * sqrt(1.0 + inverse) *
                         (2.0 * (n + 1.0) * hidden(s->terms) * sqrt(s->noise + s->rows + s->correction) +
                          DBL_EPSILON * (sqrt(weighted) + n * n * sqrt(s->correction)));
    const double norm = doubt < MOST_DOUBT ? (sqrt(square) + noise) / sqrt(1.0 - doubt) : INFINITY;
    return norm * norm;
}

bool uz_bound_blames_distance(const uz_certificate *out, double square, double requested)
{
    return out->relative_error > requested && out->absolute_error - sqrt(square) <= requested * out->energy_norm;
}

/* Of free_norm: the rounding of K alone strains a body that is only carried by so much; and an error that iterations
 * left is no rounding, so that what is small beside the motion, but not beside the strains, is not taken for it. */
#define RIGID    1e-10
#define ROUNDING 1e-12

double uz_bound_reference(double whole_norm, double free_norm, double error, uz_acting acting)
{
    const bool apart = acting == UZ_ACTING_NOTHING ||
                       (acting == UZ_ACTING_ROWS && whole_norm + error <= UZ_TOUCHING * free_norm),
               rigid = apart && whole_norm <= RIGID * free_norm && error <= ROUNDING * free_norm;
    return rigid ? free_norm : whole_norm;
}

/* Below this energy the squares of its rounding errors leave the range of double, and a bound would be zero for
 * nothing. Above it they keep all of the digits that matter. */
#define ENERGY_LEAST 0x1p-850

/* What the rounding of sums may hide of terms that do not cancel, relative. */
#define SUMS 0x1p-40

void uz_bound_energy(uz_bound_terms *t, const uz_energy_sums *s, const double *r, const double *g, const double *h,
                     int64_t d, int64_t m)
{
    const double n = (double)(d + m + 8), terms = n * DBL_EPSILON, /* of n rounded additions, relative */
        magnitudes = ((double)s->terms + 1.0) * (s->noise + s->correction) + s->pressed;
    double_double sum = {0.0, 0.0};
    double of_rows = 0.0, by_rows = 0.0;
    for (int64_t i = 0; i < m; i++) {
        if (r[i] == 0.0) /* and h may be any size */
            continue;
        dd_add_product(&sum.hi, &sum.lo, r[i], h[i], 0);
        dd_add_product(&sum.hi, &sum.lo, -r[i], g[i], 0);
        of_rows += fabs(r[i]) * (fabs(h[i]) + fabs(g[i]));
        by_rows += DBL_EPSILON * fabs(r[i]) * fabs(g[i]);
    }
    dd_add(&sum, s->work);
    dd_add(&sum, -s->load);
    dd_add(&sum, -s->load_low);
    t->energy = 0.5 * (sum.hi + sum.lo);
    /* squares that underflow hide nothing that has not been rounded up to DBL_MIN elsewhere, times n */
    t->margin = (1.0 + 0x1p-20) * (DBL_EPSILON * fabs(t->energy) + terms * terms * (s->load_size + of_rows) + by_rows +
                                   2.0 * terms * (s->work_size + s->change_size) + hidden(s->terms) * magnitudes +
                                   uz_bound_rounding(s, d) + n * DBL_MIN);
}

/* pi(v) = pi(u) + c'(K u - p) + 1/2 c'K c: that of the feasible v, so that it is an upper bound on the minimum. */
void uz_bound_conclude(uz_certificate *out, const uz_bound_terms *t, bool feasible, const double *r, const double *g,
                       const double *h, int64_t m)
{
    double correction_norm = INFINITY;
    if (feasible && !isnan(t->correction_energy))
        correction_norm = sqrt(fmax(0.0, t->correction_energy)) + t->settled;
    out->energy_norm = sqrt(fmax(0.0, t->stiffness));
    /* (K v - p)'delta = (e + N'r)'delta with the e of v, and r'N delta = r'g(v) - r'g(v + delta) */
    const double farther = t->settled > 0.0 ? (sqrt(t->square) + 0.5 * t->settled) * t->settled : 0.0;
    const double unsure = t->settled > 0.0 ? farther + t->pressed + t->complementarity : 0.0;
    out->energy_primal = t->energy + t->change;
    const double margin = t->margin + DBL_EPSILON * (fabs(t->energy) + fabs(t->change));
    const bool underflown =
        t->anything && fmax(out->energy_norm * out->energy_norm, 0x1p106 * t->square) < ENERGY_LEAST;
    out->gap = feasible && !underflown ? 0.5 * t->square + farther + t->complementarity + t->pressed : INFINITY;
    bool number = !isnan(t->stiffness) && !isnan(t->energy) && !isnan(t->change) && !isnan(t->square);
    if (isnan(out->gap) || !number) /* overflow on the way; fmax would make 0 of it */
        out->gap = INFINITY;
    if (t->anything) /* whatever squares and products lose by underflow */
        out->gap = fmax(out->gap, DBL_MIN);
    const double off = (1.0 + SUMS) * (unsure + margin);
    out->energy_dual = nextafter(out->energy_primal - (off + (1.0 + SUMS) * out->gap), -INFINITY);
    out->energy_primal = nextafter(out->energy_primal + off, INFINITY);
    out->absolute_error = sqrt(2.0 * out->gap) + correction_norm;
    if (t->anything)
        out->absolute_error = (1.0 + SUMS) * out->absolute_error + sqrt(DBL_MIN);
    if (t->moved)
        out->energy_norm = uz_bound_reference(t->whole_norm, out->energy_norm, out->absolute_error, t->acting);
    /* over ||u*||_K, which is at least ||v||_K minus the error */
    const double least = out->energy_norm - out->absolute_error;
    out->relative_error = out->absolute_error == 0.0               ? 0.0
                          : out->energy_norm > out->absolute_error ? out->absolute_error / least
                                                                   : INFINITY;
    /* residuals: paper, section 4; relative: force by ||p|| (by the reactions where there is no load), length by the
     * size of h and N u = h - g, or of what u could move a row by: where all rows touch and h = 0, N u is rounding.
     * Energy by |psi|.
     */
    const double force = t->force > 0.0 ? t->force : uz_bound_norm(r, m);
    double scale = 0.0, sum = 0.0;
    uz_residual *a = &out->residual, *b = &out->relative_residual;
    for (int64_t i = 0; i < m; i++)
        scale = fmax(scale, fabs(h[i] - g[i]));
    for (int64_t i = 0; scale > 0.0 && i < m; i++)
        sum += ((h[i] - g[i]) / scale) * ((h[i] - g[i]) / scale);
    a->e1 = t->e1;
    a->e2 = uz_penetration_norm(g, m);
    a->e3 = t->positive_part;
    a->e4 = uz_complementarity_norm(r, g, m);
    a->total = hypot(hypot(a->e1, a->e2), hypot(a->e3, a->e4));
    b->e1 = ratio(a->e1, force);
    b->e2 = ratio(a->e2, fmax(t->span, fmax(uz_bound_norm(h, m), scale * sqrt(sum))));
    b->e3 = ratio(a->e3, force);
    b->e4 = ratio(a->e4, fabs(out->energy_dual));
    b->total = hypot(hypot(b->e1, b->e2), hypot(b->e3, b->e4));
}
