/* shape.h: one kind of rigid obstacle: all that is particular to it. How to add one: docs/architecture/obstacle.md.
 *
 * Coordinates of a uz_obstacle are the caller's times a power of two that brings the obstacle's numbers near 1, so that
 * squares neither overflow nor vanish; those of uz_contact are the caller's. */
#ifndef UZ_OBSTACLE_SHAPE_H
#define UZ_OBSTACLE_SHAPE_H

#include "obstacle/along.h"

typedef struct uz_obstacle_shape uz_obstacle_shape;

struct uz_obstacle {
    const uz_obstacle_shape *shape;
    int dim;
    int64_t index;
    bool inside;
    double scale, point[3], direction[3], radius; /* scaled; direction: unit */
    void *own;                                    /* of the shape, for init, gap and clear */
};

/* What is checked. */
typedef struct {
    const uz_obstacle_shape *shape;
    const uz_contact *contact;
    int64_t index;
    int dim;
    uz_error *err;
} uz_obstacle_subject;

/* A piece of the surface over s, t in [-1, 1], near a body of this middle and size. */
typedef struct {
    const uz_contact *contact;
    double middle[3], size;
    double foot[3];          /* the shape's: a point of reference ... */
    double n[3], a[3], b[3]; /* ... and a frame there */
    double most;             /* round ones: half the angle that is drawn */
} uz_obstacle_patch;
#define UZ_PATCH_REACH 0.75 /* beyond the middle of the body, in sizes of it */

struct uz_obstacle_shape {
    const char *name[2];    /* in requests: of plane models, of solids */
    const char *refused[2]; /* why it is no obstacle of these; NULL: it is */
    bool has_direction;     /* the contact's `normal` is one */
    bool has_edges;         /* its normal jumps */
    uz_status (*check)(const uz_obstacle_subject *s);
    /* own from the contact, coordinates times o->scale; clear: frees what it holds, also after a failure. NULL: none.
     */
    uz_status (*init)(uz_obstacle *o, const uz_contact *contact, uz_error *err);
    void (*clear)(uz_obstacle *o);
    /* All of out, which is zero. */
    uz_status (*gap)(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err);
    /* Appends what is before the way from a to b, in scaled coordinates, to out (uz_obstacle_piece_add). NULL: of
     * bodies before it no whole error is proved. */
    uz_status (*along)(uz_obstacle_pieces *out, const uz_obstacle *o, const double a[2], const double b[2],
                       uz_error *err);
    /* How many numbers of x, y and z belong to it, for its scale and the body's key; NULL: none. */
    void (*lists)(int64_t n[3], const uz_contact *contact);
    /* The border in the plane, the obstacle on its right: its i-th point, and the way (any length) in which it goes on
     * beyond the first and the last one, zero where it does not. Returns how many points; 1: a line. NULL: in space. */
    int64_t (*outline)(double x[2], double way[2], const uz_contact *contact, int64_t i);
    /* The surface in space: fills the shape's part of a patch (NULL: it has none); a point of it (NULL: in the plane,
     * and of triangles, which are in the lists). */
    void (*place)(uz_obstacle_patch *p);
    void (*surface)(double x[3], const uz_obstacle_patch *p, double s, double t);
};

/* NULL: UZ_OBSTACLE_BODY, which is none, and numbers that are no kind. */
const uz_obstacle_shape *uz_obstacle_shape_of(uz_obstacle_kind kind);

extern const uz_obstacle_shape uz_shape_plane, uz_shape_round, uz_shape_cylinder, uz_shape_polyline, uz_shape_height,
    uz_shape_surface;

#endif
