/* trend.c: Richardson's extrapolation of a number, with a range that grows where the grids do not bear it out.
 *
 * Of the last grids q(h) = q0 + c h^p is fitted by least squares: linear in q0 and c, p is tried (Eca and Hoekstra, "A
 * procedure for the estimation of the numerical uncertainty of CFD calculations based on grid refinement studies",
 * Journal of Computational Physics 262, 2014). Where p is one that a converging number can have and the fit says most
 * of what changed, the range is 1.25 times the way that is left, and what the fit misses; else, as there, three times
 * what the last grids differ by. Nothing is proved: it is an estimate, and called so. */
#include "post/trend.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LAST = 5 }; /* grids that are looked at: coarser ones have not seen the contact yet */

#define LEAST_ORDER 0.4 /* that of a square root at the end of a contact is 0.5 */
#define MOST_ORDER  4.0
#define ORDER_STEP  0.02
#define ALIKE       0.01 /* sizes that differ by less are one */
#define SAFE        1.25
#define UNSAFE      3.0
#define MISFIT      0.3 /* of what the grids differ by, which the fit may leave */

typedef struct {
    double q0, c, order, misfit; /* misfit: root of the mean square */
} fit;

/* q0 and c of this order. */
static fit fit_of(const uz_trend_point *p, int n, double order)
{
    double x = 0, y = 0, xx = 0, xy = 0, left = 0;
    for (int i = 0; i < n; i++) {
        x += pow(p[i].size, order) / n;
        y += p[i].value / n;
    }
    for (int i = 0; i < n; i++) {
        const double dx = pow(p[i].size, order) - x;
        xx += dx * dx;
        xy += dx * (p[i].value - y);
    }
    fit out = {.order = order, .c = xx > 0 ? xy / xx : 0.0};
    out.q0 = y - out.c * x;
    for (int i = 0; i < n; i++) {
        const double off = p[i].value - out.q0 - out.c * pow(p[i].size, order);
        left += off * off;
    }
    out.misfit = sqrt(left / n);
    return out;
}

/* The points of the smallest elements, these last, and of like ones the last point; sizes in parts of the largest. */
static int choose(uz_trend_point out[LAST], const uz_trend_point *point, int count)
{
    double taken = 0.0; /* all sizes up to here */
    int n = 0, best = 0;
    while (best >= 0 && n < LAST) {
        best = -1;
        for (int i = 0; i < count; i++) {
            const bool some = isfinite(point[i].value) && point[i].size > taken * (1 + ALIKE);
            if (some && (best < 0 || point[i].size <= point[best].size * (1 + ALIKE)))
                best = i;
        }
        if (best >= 0) {
            memmove(out + 1, out, (size_t)n * sizeof *out);
            out[0] = point[best];
            taken = fmax(taken, point[best].size);
            n++;
        }
    }
    for (int i = n - 1; i >= 0; i--)
        out[i].size /= out[0].size;
    return n;
}

/* Of an order that a number which converges can have, and most of what the grids differ by. */
static bool is_believed(const fit *f, const uz_trend_point *p, int n, double differ)
{
    return f->order >= LEAST_ORDER && f->order <= MOST_ORDER && f->misfit <= MISFIT * differ &&
           fabs(f->q0 - p[n - 1].value) <= 2 * differ;
}

/* Is each more than all those of elements at least twice as large? Those between are of another shape where triangles
 * are halved once, and what stress they see is another part of what there is. */
static bool does_grow(const uz_trend_point *p, int n)
{
    bool grows = true;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < i; k++)
            grows = grows && (p[k].size < 2 * (1 - ALIKE) * p[i].size || p[i].value > p[k].value);
    return grows && p[n - 1].value > p[0].value;
}

void uz_trend_fit(uz_trend *out, const uz_trend_point *point, int count, double here, double grain)
{
    uz_trend_point p[LAST];
    const int n = choose(p, point, count);
    double least = INFINITY, most = -INFINITY;
    fit best = {.misfit = INFINITY};
    *out = (uz_trend){.value = here, .low = NAN, .high = NAN, .order = NAN, .grids = n};
    if (n < 3) {
        snprintf(out->why, sizeof out->why,
                 count < 2 ? "one grid shows neither error nor order: \"refine\": \"auto\" in the mesh makes more"
                 : n == 1  ? "elements at the contact have the same size on all grids: an order needs three sizes"
                           : "elements at the contact have two sizes on all grids: an order needs three");
        return;
    }
    for (int i = 0; i < n; i++) {
        least = fmin(least, p[i].value);
        most = fmax(most, p[i].value);
    }
    for (double order = LEAST_ORDER / 2; order < MOST_ORDER + ORDER_STEP; order += ORDER_STEP) {
        const fit one = fit_of(p, n, order);
        best = one.misfit < best.misfit ? one : best;
    }
    const double differ = most - least;
    const bool grows = does_grow(p, n);
    double half = 0;
    for (int i = n - 3; i < n; i++) /* coarser ones may hardly have seen the contact */
        for (int k = n - 3; k < i; k++)
            half = fmax(half, UNSAFE * fabs(p[i].value - p[k].value));
    out->value = p[n - 1].value;
    if (!(differ > 0)) {
        snprintf(out->why, sizeof out->why, "it is the same on all grids, which shows no order");
    } else if (is_believed(&best, p, n, differ)) {
        out->order = best.order;
        out->value = best.q0;
        half = SAFE * fabs(best.q0 - p[n - 1].value) + 2 * best.misfit;
    } else if (grows && best.order < LEAST_ORDER) {
        snprintf(out->why, sizeof out->why, "it grows as elements get smaller, and shows no limit, as at a corner");
    } else {
        snprintf(out->why, sizeof out->why, "no order is seen: three times what the last grids differ by");
    }
    half += grain;
    out->low = out->value - half;
    out->high = out->value + half;
    if (isnan(out->order) && grows && best.order < LEAST_ORDER) {
        out->low = fmin(p[n - 2].value, p[n - 1].value);
        out->high = INFINITY;
    }
    if (!(least < 0)) /* what is of one sign stays so */
        out->low = fmax(out->low, 0.0);
}
