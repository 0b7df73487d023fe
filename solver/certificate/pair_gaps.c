/* pair_gaps.c: points of either surface against the other one as a line of chords; in space pair_gaps_space.c.
 *
 * A side of two nodes is a chord, one of three, a parabola, a line of CHORDS, which are off it by less than a
 * hundredth of its sagitta. The gap of a point is its distance from the nearest chord, negative behind it; where the
 * nearest is a corner the chords that meet there decide together (Baerentzen and Aanaes, "Signed distance computation
 * using the angle weighted pseudonormal", IEEE TVCG 11 (2005) 243-253: in the plane the sum of both normals will do),
 * and where it is the end of the surface, beyond which it does not go on, the point faces nothing.
 *
 * Of a body that touches itself a point is held against sides that have no node of its own: against those that look at
 * it, and, where it is within an element, against those that do not look the same way. What it is behind without being
 * within an element is the back of what it is on. */
#include "certificate/pair_gaps.h"

#include "certificate/own_elements.h"
#include "core/alloc.h"
#include "core/error.h"
#include "core/vector3.h"

#include <math.h>

enum { CHORDS = 16 };

/* Distances that differ by less, in parts of a chord, are those of one corner. */
#define SAME 1e-9

typedef struct {
    double at[CHORDS + 1][2]; /* ends of its chords, along which the body is on the left */
    int chords;
    double x[UZ_FACE_NODES][2];
    int64_t node[UZ_FACE_NODES];
    int nodes;
    double middle[2], reach, length; /* all of it is within `reach` of `middle` */
} curve;

static void curve_at(double out[2], const curve *c, double s)
{
    const double N[3] = {c->nodes == 2 ? 0.5 * (1 - s) : -0.5 * s * (1 - s),
                         c->nodes == 2 ? 0.5 * (1 + s) : 0.5 * s * (1 + s), (1 - s) * (1 + s)};
    for (int i = 0; i < 2; i++) {
        out[i] = 0;
        for (int a = 0; a < c->nodes; a++)
            out[i] += N[a] * c->x[a][i];
    }
}

static void make_curve(curve *c, const uz_body_model *model, uz_face face, const double *u)
{
    c->nodes = uz_mesh_face(c->node, &model->mesh, face);
    for (int a = 0; a < c->nodes; a++)
        for (int i = 0; i < 2; i++)
            c->x[a][i] = model->mesh.xyz[2 * c->node[a] + i] + u[2 * c->node[a] + i];
    c->chords = c->nodes == 2 ? 1 : CHORDS;
    c->length = c->reach = 0;
    curve_at(c->middle, c, 0);
    for (int q = 0; q <= c->chords; q++) {
        curve_at(c->at[q], c, -1 + 2.0 * q / c->chords);
        c->reach = fmax(c->reach, sqrt(uz_distance2(c->at[q], c->middle, 2)));
        c->length += q > 0 ? sqrt(uz_distance2(c->at[q], c->at[q - 1], 2)) : 0;
    }
}

static curve *make_curves(const uz_body_model *model, const uz_group *group, const double *u)
{
    curve *out = uz_alloc(group->n_faces, sizeof *out);
    for (int64_t i = 0; i < group->n_faces && out; i++)
        make_curve(&out[i], model, group->face[i], u);
    return out;
}

/* The nearest places so far. */
typedef struct {
    double distance, normal[2], off[2], length; /* normal: the sum of those that are as near */
    int meet;                                   /* chords that have the place for an end, or 2 for one amid a chord */
} nearest;

/* looks: where the point is; NULL: on another body. */
static void look_at_chord(nearest *to, const double x[2], const uz_own_look *looks, const double a[2],
                          const double b[2], double length)
{
    const double along[2] = {b[0] - a[0], b[1] - a[1]}, from[2] = {x[0] - a[0], x[1] - a[1]};
    const double size = hypot(along[0], along[1]);
    const double normal[3] = {along[1], -along[0], 0};
    if (!(size > 0) || (looks && !uz_own_may_meet(looks, normal)))
        return;
    const double t = uz_dot2(from, along) / (size * size), s = fmin(1, fmax(0, t));
    const double off[2] = {from[0] - s * along[0], from[1] - s * along[1]};
    const double distance = hypot(off[0], off[1]);
    if (distance > to->distance + SAME * size)
        return;
    if (distance < to->distance - SAME * size)
        *to = (nearest){.distance = distance, .length = length};
    to->distance = fmin(to->distance, distance);
    to->off[0] = off[0];
    to->off[1] = off[1];
    to->normal[0] += along[1] / size;
    to->normal[1] -= along[0] / size;
    to->length = fmax(to->length, length);
    to->meet += t > -SAME && t < 1 + SAME ? 2 : 1;
}

/* The outward normal of a side at s, of any length; normal: 3. */
static void normal_at(double normal[3], const curve *c, double s)
{
    const double slope[3] = {c->nodes == 2 ? -0.5 : s - 0.5, c->nodes == 2 ? 0.5 : s + 0.5, -2 * s};
    normal[0] = normal[1] = normal[2] = 0;
    for (int a = 0; a < c->nodes; a++) {
        normal[0] += slope[a] * c->x[a][1];
        normal[1] -= slope[a] * c->x[a][0];
    }
}

/* From the point at s; elements without xyz: the two surfaces are of two bodies. */
static void look_from(double *least, double *part, const curve *own, double s, const curve *other, int64_t n,
                      const uz_own_elements *elements)
{
    nearest at = {.distance = INFINITY};
    const bool itself = elements->xyz;
    double x[2];
    curve_at(x, own, s);
    uz_own_look looks = {.held = itself && uz_own_elements_hold(elements, x)};
    if (itself)
        normal_at(looks.normal, own, s);
    for (int64_t i = 0; i < n; i++) {
        const curve *c = &other[i];
        const double from = sqrt(uz_distance2(x, c->middle, 2)) - c->reach;
        if (from > at.distance + SAME * c->length ||
            (itself && uz_own_adjoin(own->node, own->nodes, c->node, c->nodes)))
            continue;
        for (int q = 0; q < c->chords; q++)
            look_at_chord(&at, x, itself ? &looks : NULL, c->at[q], c->at[q + 1], c->length);
    }
    if (at.meet < (looks.held ? 1 : 2))
        return;
    const double gap = looks.held || uz_dot2(at.normal, at.off) < 0 ? -at.distance : at.distance;
    if (itself && !looks.held && gap < -UZ_OWN_TOUCHES * at.length)
        return;
    *least = fmin(*least, gap);
    *part = fmin(*part, gap / fmax(own->length, at.length));
}

uz_status uz_pair_gaps(double *least, double *part, const uz_body_model *model, const uz_scene *scene, int64_t k,
                       const double *u, int steps, uz_error *err)
{
    const uz_contact *contact = &scene->contacts[k];
    const uz_group *group[2] = {uz_mesh_group(&model->mesh, contact->on, "/contacts", err),
                                uz_mesh_group(&model->mesh, contact->with, "/contacts", err)};
    curve *curves[2] = {NULL, NULL};
    uz_own_elements own;
    if (!group[0] || !group[1])
        return UZ_ERR_SCENE;
    uz_status status = uz_own_elements_init(&own, model, group, u, err);
    if (status == UZ_OK && model->mesh.dim == 3) {
        status = uz_pair_gaps_space(least, part, model, group, u, steps, &own, err);
        uz_own_elements_clear(&own);
        return status;
    }
    for (int j = 0; j < 2 && status == UZ_OK; j++)
        if (!(curves[j] = make_curves(model, group[j], u)))
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the surfaces of contact %lld", (long long)k);
    for (int j = 0; j < (group[0] == group[1] ? 1 : 2) && status == UZ_OK; j++)
        for (int64_t i = 0; i < group[j]->n_faces; i++) {
            const curve *c = &curves[j][i];
            if (own.xyz)
                uz_own_elements_near(&own, c->middle, c->reach);
            for (int q = 0; q <= steps; q++)
                look_from(least, part, c, -1 + 2.0 * q / steps, curves[!j], group[!j]->n_faces, &own);
        }
    uz_own_elements_clear(&own);
    uz_free_all(curves[0], curves[1]);
    return status;
}
