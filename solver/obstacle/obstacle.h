/* obstacle.h: how far a point is from a rigid obstacle, and which way is out.
 *
 * The gap of a point x is its signed distance: positive outside the obstacle, negative within. The normal is the
 * gradient of the gap, a unit vector out of the obstacle, towards the body. A node at x with displacement u has
 *
 *     g(u) = gap(x) + normal(x) . u + curvature |u_t|^2 / 2 + ...      u_t: the part of u across the normal
 *
 * and a contact row keeps the first two terms: h = gap, N = -normal. `curvature` says what the row leaves out.
 *
 * Plane models (2D) and axisymmetric ones (x is the radius) see the obstacle in their plane: in the latter a circle
 * centred on the axis is a sphere, elsewhere a ring of round section, and a plane is a cone, a disc or a cylinder.
 *
 * What each obstacle is:
 *   plane     the half space behind `point`, seen along `normal` (any length)
 *   round     the disc or ball, or with `inside` everything but it
 *   cylinder  endless along its axis (any length), or with `inside` everything but it
 *   polyline  the region on the right of the line as it goes on. Beyond an open end the last segment goes on as a half
 *             line. A line that ends where it began is closed: the obstacle is the polygon when it goes round
 *             clockwise, all but the polygon otherwise
 *   height    everything below the table: straight (2D) or bilinear (3D) between its values; beyond the table the
 *             values at its edge go on flat
 *   surface   what is behind the triangles (3D): what a closed surface encloses, or with `inside` everything but it;
 *             behind an open one as far as it is closest, and beyond its rim nothing
 * The gap of the last three is the distance of the closest point, its foot. From a corner that juts out to x the normal
 * is the direction from corner to x, turning from one side's normal to the other's; of several closest points (at a
 * concave corner) the one on the first segment, or the cell lowest in y and then in x, is taken. On a corner itself the
 * normal is the mean of those that meet there. */
#ifndef UZ_OBSTACLE_OBSTACLE_H
#define UZ_OBSTACLE_OBSTACLE_H

#include "uzawa.h"

/* An obstacle made ready for many points. Only read by uz_obstacle_gap: threads may share it. */
typedef struct uz_obstacle uz_obstacle;

/* What surrounds a point. */
typedef struct {
    double gap;       /* a length; < 0: within the obstacle */
    double normal[3]; /* unit; the third is 0 in 2D */
    double curvature; /* 1 / length: the second derivative of the gap at the point along that tangent where it is
                       * largest in size. > 0: the obstacle bulges towards the point, and the gap is wider than its row
                       * says; < 0: it closes in, and sliding may lead into it unseen. INFINITY: a corner itself */
    double along[3];  /* solids: a unit tangent along which there is no curvature, of a cylinder its axis; 0: none */
    double foot[3];   /* the closest point of the obstacle's surface */
    double facets;    /* a length: how far the facet there may be from the curve that it stands for; 0: it is none */
} uz_gap;

/* Refuses what is not an obstacle for this model, lines that cross or touch themselves too (they have no right side);
 * `index` is the contact's place in the scene, for pointers such as "/contacts/2/obstacle/circle/radius". Groups are
 * not looked at. Keeps copies: *contact may go. O(n log n) for n points of a line or a table. UZ_OBSTACLE_BODY is
 * UZ_ERR_ARGUMENT: see projection.h. Errors: UZ_ERR_SCENE, _NOT_FINITE, _MEMORY, _ARGUMENT. The caller frees *out. */
uz_status uz_obstacle_new(uz_obstacle **out, const uz_contact *contact, int64_t index, uz_model model, uz_error *err);
void uz_obstacle_free(uz_obstacle *obstacle);

/* x: dim coordinates. Allocates nothing. O(log n) for points within a few pieces of the surface; further away as many
 * pieces are looked at as are nearly as close, of the order of the root of their number. UZ_ERR_SCENE where there is no
 * normal: x is at the centre of a circle or sphere or on the axis of a cylinder; err->where names the obstacle.
 * UZ_ERR_NOT_FINITE: x, or the gap overflows. */
uz_status uz_obstacle_gap(uz_gap *out, const uz_obstacle *obstacle, const double *x, uz_error *err);

/* The same of a point on the surface of a body, for its row. Within a ridge, and on it, the closest point says nothing
 * of the way out: amid its flanks it is on either of them by rounding, and a row along one pushes the body aside that
 * the crest should hold. So where an obstacle has edges, a point that is not `clear` of it is taken back into its body,
 * until it is as far out as it was in and `clear` at least, and has the tangent plane of the point that is closest
 * there: a flank's, or at the crest, up to `before` aside of it, the body's own, as a crest presses on a face along the
 * face's normal, and from there on one that turns to the flank's.
 *   outward  dim; the body's unit normal at x; zero, or a way that does not lead out soon: as uz_obstacle_gap
 *   clear    a length: edges are as if rounded with this radius
 *   before   a length; farther aside, a point outside has the plane of what is closest to itself, from twice that on
 *   at       dim; out: where x was taken back to (NULL: not wanted) */
uz_status uz_obstacle_row_gap(uz_gap *out, double *at, const uz_obstacle *obstacle, const double *x,
                              const double *outward, double clear, double before, uz_error *err);

/* In a groove a point is held by more than the flank that is closest: what is free about it is where all of them let
 * it, and on the bisector the closest one is either by rounding. Adds to the `count` planes at `out` (room: `most`)
 * those of the obstacle beside x, as gaps of x from them: the ones that are closest to places on both sides of `at`, up
 * to `way` from it, where they make a groove with `first` and with those found before: of each two planes either rises
 * above the other. Grooves shallower than 0.1 (rad) count only where `at` is as close to both flanks.
 *   first, at   of x, from uz_obstacle_row_gap
 * Returns how many planes there are. Allocates nothing. */
int uz_obstacle_flanks(uz_gap *out, int count, int most, const uz_obstacle *obstacle, const double *x, const double *at,
                       const uz_gap *first, const double *way);
/* Are there any, of whatever point? */
bool uz_obstacle_has_edges(const uz_obstacle *obstacle);

#endif
