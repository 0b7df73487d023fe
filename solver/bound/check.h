/* check.h: what the files of the check have in common. */
#ifndef UZ_BOUND_CHECK_H
#define UZ_BOUND_CHECK_H

#include "bound/bound.h"

typedef struct {
    uz_bound_check_result *out;
    const uz_bound_body *body;
    const uz_mesh *mesh;
    int moments;
    double *resultant; /* n_edges x moments x 2: of the stress's tractions on the elements beside the edge */
    double *pressure;  /* n_edges x moments: r_h, as resultants */
    double *moved;     /* n_nodes x 2: room */
    double *lift;      /* n_nodes x 2: w, as far as it is of the nodes */
    double *gap;       /* n_elements: int 1/2 |sigma_h - C eps(u_h)|^2, from above */
    double sum, scale; /* of elements: int 1/2 |sigma_h - C eps(u_h)|^2; of the sizes of what it is made of */
    double margin;     /* of the strain energy: what its integration may be off by */
    double springs;    /* of the gap: int 1/2 |t + k u_h|^2 / k, t the traction where springs hold */
    double strain, complementary, inside, farthest; /* farthest: the largest displacement along an axis */
    double turning;                                 /* square of the result's */
    /* Of bulges, the part of w that is zero at all nodes: square of their norm, the gap of their elements, and the work
     * that the tractions do on them. */
    double bulge, bulged, bulge_work;
} examination;

/* Means of a quadratic polynomial over an edge with the Bernstein polynomials of degree `moments` - 1 as weights. */
void uz_edge_means(double m[UZ_BOUND_MOMENTS], const double b[3], int moments);
/* A displacement (n_nodes x 2) along n on an edge: the Bernstein coefficients of a quadratic polynomial, from its
 * values at the ends and, where there is a node, in the middle. */
void uz_along_edge(double b[3], const double *u, const int64_t node[3], const double n[2]);
/* Gauss's rule of n points on [-1, 1]. */
void uz_gauss(double *at, double *weight, int n);

/* What rounding of places may be, as far as that is nothing to the displacements: a length. */
double uz_place_rounding(const examination *x);
/* Makes w at a node (-1: none) at least `by` against the normal into the obstacle, along what supports leave to it. */
void uz_lift_node(examination *x, int64_t node, const double normal[2], double by);

/* Edges before round obstacles, check_round.c. The first looks at the stress's tractions and where u_h leaves its
 * nodes: pressure, gap, w at the nodes and what is not along the normal, of which turned (moments x 2) are the
 * resultants that are missing. The second, once w is known at all nodes, bulges what is still in the obstacle out of
 * it. */
void uz_examine_round(double turned[UZ_BOUND_MOMENTS][2], examination *x, const double *u, int64_t edge);
void uz_look_at_round(examination *x, const double *u, int64_t edge);

#endif
