/* pieces.h: the obstacles that are made of many pieces. Their coordinates are the caller's times a power of two that
 * brings them near 1, so that squares neither overflow nor vanish. */
#ifndef UZ_OBSTACLE_PIECES_H
#define UZ_OBSTACLE_PIECES_H

#include "obstacle/box_tree.h"
#include "obstacle/along.h"

/* Two directions closer than this are one: a corner of less is rounding. */
#define UZ_SAME_DIRECTION 1e-12

/* A polyline. Piece 0 is the half line that ends at the first point, piece i leads from point i - 1 to point i, piece
 * n begins at the last point. A closed line has neither of the half lines, and its last point is its first. */
typedef struct {
    int64_t n;
    bool closed;
    double *point;   /* n x 2 */
    double *tangent; /* (n + 1) x 2, unit */
    uz_box_tree tree;
} uz_line;

/* Where piece i begins and ends, in lengths along its tangent from `origin`. */
typedef struct {
    const double *origin, *tangent;
    double first, last;
} uz_line_piece;
uz_line_piece uz_line_piece_of(const uz_line *line, int64_t i);
/* The pieces that meet at a point of the line. */
void uz_line_meet(int64_t meet[2], const uz_line *line, int64_t corner);
/* ctx: the line. An item of its tree is piece item + closed: a closed line has no half line at its beginning. */
double uz_line_distance(const void *ctx, int64_t item, const double *x, double best);

/* ends: unit directions of the half lines before and beyond; NULL: those of the first and last segment, or closed if
 * the last point is the first. scale: of the coordinates. Error: UZ_ERR_MEMORY. */
uz_status uz_line_init(uz_line *out, int64_t n, const double *x, const double *y, const double *ends, double scale,
                       uz_error *err);
void uz_line_clear(uz_line *line);
/* `gap` of an obstacle whose own is a uz_line. The gap is NaN where squares of distances overflow. */
uz_status uz_line_gap(uz_gap *out, const uz_obstacle *o, const double x[3], uz_error *err);
/* `along` of such an obstacle (line_along.c). */
uz_status uz_line_along(uz_obstacle_pieces *out, const uz_obstacle *o, const double a[2], const double b[2],
                        uz_error *err);
/* `outline` of a polyline, which goes on straight beyond its ends, and of heights over x, which go on flat. */
int64_t uz_line_outline(double x[2], double way[2], const uz_contact *contact, int64_t i);
/* A pair of pieces that cross, touch, or fold back on one another; false: there is none. Looks at no more pairs than
 * UZ_LINE_PAIRS per point: long segments side by side may all be near one another. */
#define UZ_LINE_PAIRS 1000
bool uz_line_crosses(int64_t pair[2], const uz_line *line);

/* A table of heights over a grid, n_x and n_y >= 2. */
typedef struct {
    int64_t n_x, n_y;
    double *x, *y, *z; /* z: n_y x n_x */
    uz_box_tree tree;  /* of (n_x + 1) x (n_y + 1) cells: the first and last of each row and column are endless */
} uz_table;
uz_status uz_table_init(uz_table *out, const uz_contact *contact, double scale, uz_error *err);
void uz_table_clear(uz_table *table);
void uz_table_gap(uz_gap *out, const uz_table *table, const double x[3]);

/* `clear` of an obstacle whose own is a uz_line in the plane and a uz_table in space, or NULL. */
void uz_pieces_clear(uz_obstacle *o);

#endif
