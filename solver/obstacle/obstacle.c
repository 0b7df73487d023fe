/* obstacle.c: the kinds of obstacles, and what they share: scaling, and refusing what overflows. */
#include "obstacle/check.h"

#include "core/alloc.h"
#include "core/error.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A way out that is longer than this many depths leads along the obstacle. */
#define MOST_BACK 4

/* Grooves (rad): what is deeper than the first is no curve, below the second there is none. */
#define DEEP_GROOVE 0.1
#define NO_GROOVE   1e-5
/* In lengths of the way on which flanks are looked for: as close to both. */
#define AS_CLOSE 1e-6

static const uz_obstacle_shape *const shapes[] = {
    [UZ_OBSTACLE_PLANE] = &uz_shape_plane,       [UZ_OBSTACLE_ROUND] = &uz_shape_round,
    [UZ_OBSTACLE_CYLINDER] = &uz_shape_cylinder, [UZ_OBSTACLE_POLYLINE] = &uz_shape_polyline,
    [UZ_OBSTACLE_HEIGHT] = &uz_shape_height,     [UZ_OBSTACLE_SURFACE] = &uz_shape_surface};

const uz_obstacle_shape *uz_obstacle_shape_of(uz_obstacle_kind kind)
{
    return (size_t)kind < sizeof shapes / sizeof shapes[0] ? shapes[kind] : NULL;
}

/* The largest magnitude of n numbers (v NULL: none) and `most`. */
static double largest(double most, const double *v, int64_t n)
{
    for (int64_t i = 0; v && i < n; i++)
        most = fmax(most, fabs(v[i]));
    return most;
}

uz_status uz_obstacle_new(uz_obstacle **out, const uz_contact *contact, int64_t index, uz_model model, uz_error *err)
{
    const uz_obstacle_shape *shape = uz_obstacle_shape_of(contact->kind);
    const uz_obstacle_subject s = {shape, contact, index, model == UZ_SOLID ? 3 : 2, err};
    *out = NULL;
    if (contact->kind == UZ_OBSTACLE_BODY)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "a body of the mesh is no rigid obstacle");
    if (!shape) {
        return uz_fail(err, UZ_ERR_ARGUMENT, UZ_PLACE("contacts", index, "obstacle"), "unknown kind of obstacle");
    }
    if (shape->refused[s.dim - 2])
        return uz_fail(err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(&s, "", -1), "%s", shape->refused[s.dim - 2]);
    uz_status status = shape->check(&s);
    if (status != UZ_OK)
        return status;
    uz_obstacle *o = uz_alloc_zero(1, sizeof *o);
    if (!o)
        return uz_no_memory(err, "an obstacle");
    o->shape = shape;
    o->dim = s.dim;
    o->index = index;
    o->inside = contact->inside;
    /* The power of two that brings numbers up to `most` to 1/2..1. */
    int64_t n[3] = {0};
    int exponent;
    if (o->shape->lists)
        o->shape->lists(n, contact);
    double most = largest(fabs(contact->radius), contact->point, o->dim);
    most = largest(largest(largest(most, contact->x, n[0]), contact->y, n[1]), contact->z, n[2]);
    frexp(most > 0 ? most : 1, &exponent);
    o->scale = ldexp(1, exponent < -1000 ? 1000 : exponent > 1000 ? -1000 : -exponent);
    o->radius = contact->radius * o->scale;
    for (int c = 0; c < o->dim; c++)
        o->point[c] = contact->point[c] * o->scale;
    if (o->shape->has_direction)
        uz_unit_normal(o->direction, contact->normal, o->dim);
    if (o->shape->init)
        status = o->shape->init(o, contact, err);
    if (status == UZ_OK)
        *out = o;
    else
        uz_obstacle_free(o);
    return status;
}

void uz_obstacle_free(uz_obstacle *obstacle)
{
    if (!obstacle)
        return;
    if (obstacle->shape->clear)
        obstacle->shape->clear(obstacle);
    free(obstacle);
}

uz_status uz_obstacle_gap(uz_gap *out, const uz_obstacle *obstacle, const double *x, uz_error *err)
{
    const uz_obstacle *o = obstacle;
    double at[3] = {0};
    uz_gap scaled = {0};
    bool finite = true;
    memset(out, 0, sizeof *out);
    for (int c = 0; c < o->dim; c++) {
        at[c] = x[c] * o->scale;
        finite = finite && isfinite(at[c]);
    }
    const uz_status status = finite ? o->shape->gap(&scaled, o, at, err) : UZ_OK;
    if (status != UZ_OK)
        return status;
    scaled.gap /= o->scale; /* back to the caller's units */
    scaled.curvature *= o->scale;
    scaled.facets /= o->scale;
    for (int c = 0; c < 3; c++)
        scaled.foot[c] /= o->scale;
    const double sum = scaled.gap + scaled.normal[0] + scaled.normal[1] + scaled.normal[2];
    if (!finite || !isfinite(sum) || isnan(scaled.curvature)) {
        return uz_fail(err, UZ_ERR_NOT_FINITE, UZ_PLACE("contacts", o->index, "obstacle"),
                       "the gap to this obstacle overflows");
    }
    *out = scaled;
    return UZ_OK;
}

uz_status uz_obstacle_row_gap(uz_gap *out, double *at, const uz_obstacle *obstacle, const double *x,
                              const double *outward, double clear, double before, uz_error *err)
{
    enum { STEPS = 40 };
    const int dim = obstacle->dim;
    uz_gap there, own;
    double back = 0, own_part = 0, taken[3] = {x[0], x[1], dim == 3 ? x[2] : 0};
    if (at)
        memcpy(at, x, (size_t)dim * sizeof *at);
    const uz_status status = uz_obstacle_gap(out, obstacle, x, err);
    if (status != UZ_OK || !obstacle->shape->has_edges || out->gap >= clear)
        return status;
    const double enough = fmax(clear, -out->gap), most = 1.01 * enough + MOST_BACK * fmax(0, -out->gap);
    there = own = *out;
    /* a distance grows by no more than the way: no step leads past where it is enough */
    for (int k = 0; k < STEPS && there.gap < 0.999 * enough && back <= most; k++) {
        back += enough - there.gap;
        for (int c = 0; c < dim; c++)
            taken[c] = x[c] - back * outward[c];
        if (uz_obstacle_gap(&there, obstacle, taken, NULL) != UZ_OK)
            return UZ_OK;
    }
    if (there.gap < 0.999 * enough || back > most)
        return UZ_OK;
    *out = there;
    /* An edge that is hardly aside, and juts out that way, is as good as before the point: along the
     * direction from it to the point the normal would tilt as the point slides, and push it down a flank. */
    if (fabs(there.curvature * there.gap) >= 0.5) {
        double high = 0, aside = 0, length = 0, at_edge[3] = {0};
        uz_gap edge;
        for (int c = 0; c < dim; c++)
            high -= (taken[c] - there.foot[c]) * outward[c];
        for (int c = 0; c < dim; c++)
            aside = hypot(aside, taken[c] - there.foot[c] + high * outward[c]);
        const double left = high > 0 ? fmax(0, 1 - before / aside) : 1;
        for (int c = 0; c < dim; c++) {
            const double off = left * (taken[c] - there.foot[c]) - (1 - left) * high * outward[c];
            at_edge[c] = there.foot[c] + off;
            length = hypot(length, off);
        }
        if (uz_obstacle_gap(&edge, obstacle, at_edge, NULL) == UZ_OK && edge.gap >= (1 - 1e-9) * length)
            memcpy(out->normal, edge.normal, sizeof out->normal);
        /* A point outside of the obstacle is held by nothing but what is closest, unless it is before the edge: the
         * edge's plane would hold it where it is free, and push it aside. */
        own_part = own.gap > 0 ? fmin(fmax(aside / before - 1, 0), 1) : 0;
    }
    out->gap = 0;
    for (int c = 0; c < dim; c++)
        out->gap += (x[c] - there.foot[c]) * out->normal[c];
    if (own_part > 0) {
        double size = 0;
        for (int c = 0; c < dim; c++) {
            out->normal[c] = (1 - own_part) * out->normal[c] + own_part * own.normal[c];
            size = hypot(size, out->normal[c]);
        }
        for (int c = 0; c < dim; c++)
            out->normal[c] /= size;
        out->gap = ((1 - own_part) * out->gap + own_part * own.gap) / size;
    }
    if (at)
        memcpy(at, taken, (size_t)dim * sizeof *at);
    return UZ_OK;
}

bool uz_obstacle_has_edges(const uz_obstacle *obstacle)
{
    return obstacle->shape->has_edges;
}

/* Do two planes turn by more than `least` (rad), and does either rise above the other? */
static bool is_groove(const uz_gap *a, const uz_gap *b, double least, double rounding)
{
    double turn = 0, rises[2] = {0};
    for (int c = 0; c < 3; c++) {
        turn = hypot(turn, a->normal[c] - b->normal[c]);
        rises[0] += a->normal[c] * (b->foot[c] - a->foot[c]);
        rises[1] += b->normal[c] * (a->foot[c] - b->foot[c]);
    }
    return turn > least && fmin(rises[0], rises[1]) >= -rounding && fmax(rises[0], rises[1]) > 0;
}

int uz_obstacle_flanks(uz_gap *out, int count, int most, const uz_obstacle *obstacle, const double *x, const double *at,
                       const uz_gap *first, const double *way)
{
    static const double STEP[] = {1, 0.5, 0.25, AS_CLOSE};
    uz_gap pair[2];
    const double rounding = 1e-9 * sqrt(way[0] * way[0] + way[1] * way[1] + (obstacle->dim == 3 ? way[2] * way[2] : 0));
    for (int k = 0; k < 4; k++) {
        bool seen[2];
        for (int j = 0; j < 2; j++) {
            double beside[3] = {0};
            for (int c = 0; c < obstacle->dim; c++)
                beside[c] = at[c] + (j ? -STEP[k] : STEP[k]) * way[c];
            /* an edge that juts out has no plane */
            seen[j] = uz_obstacle_gap(&pair[j], obstacle, beside, NULL) == UZ_OK &&
                      fabs(pair[j].curvature * pair[j].gap) < 0.5;
            for (int c = 0; c < obstacle->dim && seen[j]; c++)
                pair[j].gap += (x[c] - beside[c]) * pair[j].normal[c];
        }
        /* a shallow one is told from a curve by a leap at the point */
        const bool leaps = STEP[k] == AS_CLOSE && seen[0] && seen[1] && is_groove(&pair[0], &pair[1], NO_GROOVE, 0);
        for (int j = 0; j < 2; j++) {
            bool groove = seen[j] && count < most && (leaps || STEP[k] > AS_CLOSE);
            for (int i = -1; i < count && groove; i++)
                groove = is_groove(&pair[j], i < 0 ? first : &out[i], leaps ? NO_GROOVE : DEEP_GROOVE, rounding);
            if (groove)
                out[count++] = pair[j];
        }
    }
    return count;
}
