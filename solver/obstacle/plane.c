/* plane.c: a half space. Where it stands is the load's matter: the gap of a contact row is made from its point then. */
#include "obstacle/check.h"
#include "obstacle/vectors.h"

#include <string.h>

static uz_status check(const uz_obstacle_subject *s)
{
    const uz_status status = uz_obstacle_check_direction(
        s, "normal", "the normal is zero; it must point out of the obstacle, towards the body");
    return status == UZ_OK ? uz_obstacle_check_finite(s, "point", s->contact->point, s->dim) : status;
}

static uz_status gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err)
{
    (void)err;
    out->gap = 0;
    for (int c = 0; c < o->dim; c++)
        out->gap += (x[c] - o->point[c]) * o->direction[c];
    for (int c = 0; c < 3; c++) {
        out->normal[c] = o->direction[c];
        out->foot[c] = c < o->dim ? x[c] - out->gap * o->direction[c] : 0;
    }
    out->curvature = 0;
    return UZ_OK;
}

static uz_status along(uz_obstacle_pieces *out, const uz_obstacle *o, const double a[2], const double b[2],
                       uz_error *err)
{
    uz_obstacle_piece piece = {.end = 1};
    for (int c = 0; c < 2; c++) {
        piece.normal[c] = -o->direction[c];
        piece.gap[0] += (a[c] - o->point[c]) * o->direction[c];
        piece.gap[1] += (b[c] - o->point[c]) * o->direction[c];
    }
    return uz_obstacle_piece_add(out, &piece, err);
}

static int64_t outline(double x[2], double way[2], const uz_contact *contact, int64_t i)
{
    (void)i;
    memcpy(x, contact->point, 2 * sizeof *x);
    way[0] = contact->normal[1];
    way[1] = -contact->normal[0];
    return 1;
}

static void place(uz_obstacle_patch *p)
{
    double away[3];
    memcpy(p->n, p->contact->normal, sizeof p->n);
    uz_make_unit3(p->n, (const double[3]){0, 1, 0});
    for (int c = 0; c < 3; c++)
        away[c] = p->contact->point[c] - p->middle[c];
    memcpy(p->foot, p->middle, sizeof p->foot);
    uz_add3(p->foot, uz_dot3(away, p->n), p->n);
    uz_patch_frame(p);
}

static void surface(double x[3], const uz_obstacle_patch *p, double s, double t)
{
    const double reach = UZ_PATCH_REACH * p->size;
    memcpy(x, p->foot, 3 * sizeof *x);
    uz_add3(x, s * reach, p->a);
    uz_add3(x, t * reach, p->b);
}

const uz_obstacle_shape uz_shape_plane = {.name = {"plane", "plane"},
                                          .has_direction = true,
                                          .check = check,
                                          .gap = gap,
                                          .along = along,
                                          .outline = outline,
                                          .place = place,
                                          .surface = surface};
