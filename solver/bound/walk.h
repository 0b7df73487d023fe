/* walk.h: integrals over triangles, of polynomials, and of rings over the radius. */
#ifndef UZ_BOUND_WALK_H
#define UZ_BOUND_WALK_H

#include "bound/bound.h"

enum { UZ_WALK_POINTS = 16, UZ_GAUSS_MOST = 24 };

/* Of integrals of r^-1 times polynomials that are nowhere negative: what the sum may be off by, as a part of it. */
#define UZ_WALK_MARGIN 1e-15

/* The points of a rule over 0 to 1 along a line on which the radius is linear: sums are exact for polynomials of
 * degree 5, and off by no more than UZ_WALK_MARGIN for those over the radius, if these have no pole: at the axis they
 * have to vanish where the radius does. */
typedef struct {
    double radius[2], from, to; /* ascending; the piece at hand */
    bool turned;                /* the line runs to the smaller one */
    double at[UZ_WALK_POINTS], weight[UZ_WALK_POINTS];
    int n, i;
} uz_line_walk;
uz_line_walk uz_line_begin(double radius, double to_radius);
bool uz_line_next(uz_line_walk *walk, double *part, double *weight);

/* The same over a triangle, weights are areas: of polynomials of degree 4, and of rings over the radius. */
typedef struct {
    double corner[3][2]; /* of rings by their radius, ascending */
    uz_gauss_rule rule;  /* plane */
    bool rings;
    int half, i, along; /* of rings: before the middle corner, or behind it; points of a chord; plane: the next point */
    uz_line_walk line;
    double radius, low, high, weight, at[3], share[3]; /* the chord at hand */
} uz_walk;
/* degree: of stresses, of which squares are integrated. Of rings polynomials of degree 3 along the axis, if it is 1,
 * and 5, if it is 2. */
uz_walk uz_walk_begin(double corner[3][2], bool rings, int degree);
bool uz_walk_next(uz_walk *walk, double at[2], double *weight);

/* Gauss's rule of n points on [-1, 1], 1 to UZ_GAUSS_MOST. */
void uz_gauss(double *at, double *weight, int n);
/* The least n from `least` on for which times q^(2n - 6) is at most `most`; UZ_GAUSS_MOST: there is none. */
int uz_gauss_points(int least, double times, double q, double most);

#endif
