/* along.h: what of an obstacle is before a straight way in the plane: the closest point of each of its points, which is
 * on one part of the obstacle after the other. */
#ifndef UZ_OBSTACLE_ALONG_H
#define UZ_OBSTACLE_ALONG_H

#include "obstacle/obstacle.h"

/* A line, before which gap and normal are those of a plane, or an arc: a circle, or a corner of lines, which has the
 * radius 0. Seen from the side on which it juts out the gap is |x - centre| - radius, from the other, `inside`, radius
 * less that. */
typedef struct {
    double end; /* it is before the way up to this part of it; that of the last one is 1 */
    bool round, inside;
    double centre[2], radius;
    double normal[2], gap[2]; /* of a line: unit, into the obstacle; of its plane at the ends of the whole way */
} uz_obstacle_piece;

typedef struct {
    int64_t n, room;
    uz_obstacle_piece *at;
    const char *why; /* what stands before a way that has none, a clause; NULL */
} uz_obstacle_pieces;

/* Appends the pieces before the way from a to b (2 each), ascending; arcs are cut so that none is longer along the way
 * than its centre is away, but for those whose centre is on the way, which are lines. Of points that are as close to
 * parts of the obstacle that are apart, no way with more than some: out->why. UZ_ERR_MEMORY. The caller frees out->at.
 */
uz_status uz_obstacle_along(uz_obstacle_pieces *out, const uz_obstacle *obstacle, const double *a, const double *b,
                            uz_error *err);

/* For shapes. UZ_ERR_MEMORY. */
uz_status uz_obstacle_piece_add(uz_obstacle_pieces *out, const uz_obstacle_piece *piece, uz_error *err);

#endif
