#include "run/nearby.h"

#include "core/alloc.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Vectors of the basis. What is beyond them counts as a coordinate of its own. */
enum { BASIS = 8 };

/* size: of the load; z, beyond: of the load of that direction whose size is 1. */
typedef struct {
    bool placed, answered;
    double z[BASIS], beyond, size;
} place;

struct uz_nearby {
    int64_t n, d, m;
    place *of; /* n */
    int count;
    double *basis[BASIS]; /* d + m each */
    double *room;         /* d + m */
    double unit[2];       /* of p and h: the sizes of the first of each that is not 0; 0: none was */
};

/* Directions that differ by less are the same. */
#define SAME 1e-9
/* Distances are told apart down to this. */
#define CLOSEST 1e-3

uz_nearby *uz_nearby_new(int64_t n, int64_t d, int64_t m)
{
    uz_nearby *x = uz_alloc_zero(1, sizeof *x);
    if (!x)
        return NULL;
    *x = (uz_nearby){.n = n, .d = d, .m = m};
    x->of = uz_alloc_zero(n, sizeof *x->of);
    x->room = uz_alloc(d + m, sizeof *x->room);
    if (x->of && x->room)
        return x;
    uz_nearby_free(x);
    return NULL;
}

void uz_nearby_free(uz_nearby *x)
{
    if (!x)
        return;
    for (int k = 0; k < BASIS; k++)
        free(x->basis[k]);
    uz_free_all(x->of, x->room, x);
}

/* The load in units in which neither forces nor gaps are all that counts. */
static void take_in_units(uz_nearby *x, const double *p, const double *h)
{
    const double *const from[] = {p, h};
    const int64_t count[] = {x->d, x->m};
    double *to = x->room;
    for (int part = 0; part < 2; to += count[part++]) {
        if (x->unit[part] == 0.0)
            x->unit[part] = uz_norm(count[part], from[part]);
        const double scale = x->unit[part] > 0.0 ? 1.0 / x->unit[part] : 0.0;
        for (int64_t j = 0; j < count[part]; j++)
            to[j] = scale * from[part][j];
    }
}

void uz_nearby_place(uz_nearby *x, int64_t i, const double *p, const double *h)
{
    const int64_t n = x->d + x->m;
    place *at = &x->of[i];
    double *v = x->room;
    take_in_units(x, p, h);
    at->size = uz_norm(n, v);
    memset(at->z, 0, sizeof at->z);
    for (int pass = 0; pass < 2; pass++) /* twice: orthogonal to rounding */
        for (int k = 0; k < x->count; k++) {
            const double along = uz_dot(n, x->basis[k], v);
            at->z[k] += along;
            uz_axpy(n, -along, x->basis[k], v);
        }
    at->beyond = uz_norm(n, v);
    at->placed = isfinite(at->size) && isfinite(at->beyond) && at->size > 0.0;
    if (!at->placed)
        return;
    if (at->beyond > SAME * at->size && x->count < BASIS && (x->basis[x->count] = uz_alloc(n, sizeof *v))) {
        for (int64_t j = 0; j < n; j++)
            x->basis[x->count][j] = v[j] / at->beyond;
        at->z[x->count++] = at->beyond;
        at->beyond = 0.0;
    }
    for (int k = 0; k < BASIS; k++)
        at->z[k] /= at->size;
    at->beyond /= at->size;
}

void uz_nearby_answered(uz_nearby *x, int64_t i)
{
    x->of[i].answered = x->of[i].placed;
}

static double distance(const place *a, const place *b)
{
    double sum = a->beyond * a->beyond + b->beyond * b->beyond;
    for (int k = 0; k < BASIS; k++)
        sum += (a->z[k] - b->z[k]) * (a->z[k] - b->z[k]);
    return sqrt(sum);
}

/* The nearest cases, by their distances. */
static void list_nearest(uz_nearby_sum *out, double far[UZ_NEARBY_MOST], const uz_nearby *x, int64_t i)
{
    for (int64_t j = 0; j < x->n; j++) {
        if (!x->of[j].answered)
            continue;
        const double here = distance(&x->of[i], &x->of[j]);
        int at = out->count < UZ_NEARBY_MOST ? out->count++ : UZ_NEARBY_MOST;
        for (; at > 0 && here < far[at - 1]; at--)
            if (at < UZ_NEARBY_MOST) {
                far[at] = far[at - 1];
                out->of[at] = out->of[at - 1];
            }
        if (at < UZ_NEARBY_MOST) {
            far[at] = here;
            out->of[at] = j;
        }
    }
}

/* Shares s, of loads of size 1, of which the sum of (s_k far_k)^2 is least among those with the load's coordinates. */
bool uz_nearby_find(uz_nearby_sum *out, const uz_nearby *x, int64_t i, double near)
{
    const place *at = &x->of[i];
    const int n = x->count;
    double far[UZ_NEARBY_MOST], A[BASIS * BASIS] = {0}, y[BASIS], off = 0.0, missed = at->beyond * at->beyond,
                                          trace = 0.0;
    out->count = 0;
    if (!at->placed)
        return false;
    list_nearest(out, far, x, i);
    for (int k = 0; k < out->count; k++) {
        const double *z = x->of[out->of[k]].z, weight = 1.0 / fmax(far[k], CLOSEST);
        for (int a = 0; a < n; a++)
            for (int b = 0; b <= a; b++)
                A[b * n + a] += weight * weight * z[a] * z[b];
    }
    for (int a = 0; a < n; a++)
        trace += A[a * n + a];
    for (int a = 0; a < n; a++)
        A[a * n + a] += SAME * CLOSEST * CLOSEST * trace; /* coordinates that none of them has */
    memcpy(y, at->z, sizeof y);
    if (out->count == 0 || !uz_potrf_lower_while(n, A, NULL))
        return false;
    uz_potrs_lower(n, A, n, y);
    for (int k = 0; k < out->count; k++) {
        const double *z = x->of[out->of[k]].z, weight = 1.0 / fmax(far[k], CLOSEST);
        out->share[k] = 0.0;
        for (int a = 0; a < n; a++)
            out->share[k] += weight * weight * z[a] * y[a];
        off += fabs(out->share[k]) * far[k] * far[k];
    }
    for (int a = 0; a < n; a++) {
        double rest = at->z[a];
        for (int k = 0; k < out->count; k++)
            rest -= out->share[k] * x->of[out->of[k]].z[a];
        missed += rest * rest;
    }
    for (int k = 0; k < out->count; k++)
        out->share[k] *= at->size / x->of[out->of[k]].size;
    return sqrt(missed) + off <= near;
}
