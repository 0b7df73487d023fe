/* macro.h: a macro element of the dual problem (dual_problem.c), and the stresses that it may have. */
#ifndef UZ_BOUND_MACRO_H
#define UZ_BOUND_MACRO_H

#include "bound/bound.h"

enum {
    UZ_MACRO_FUNCTIONS = 15,                                /* most of a part: of degree 2, of rings */
    UZ_MACRO_OUTER = UZ_BOUND_PARTS * UZ_BOUND_MOMENTS * 2, /* moments of an element's sides */
    UZ_MACRO_KEY = 33
};

typedef struct uz_macro uz_macro;

/* What is in equilibrium within a part, by columns: `functions` of them, and last what balances the element's force.
 * Components xx, yy, xy and of rings, where these are times the radius, the hoop stress itself. */
typedef struct {
    int functions[2], components; /* functions by degree - 1 */
    void (*stresses)(double S[4][UZ_MACRO_FUNCTIONS + 1], const uz_macro *m, const double at[2]);
    /* The strain e whose work on a stress s, s . e, is that per area and depth: of the stress itself by Hooke's law,
     * and of free expansion. radius: of the place, rings. */
    void (*strain)(double e[4], const double s[4], uz_lame lame, double free_strain, uz_model model, double radius);
} uz_macro_stresses;

extern const uz_macro_stresses uz_plane_stresses, uz_ring_stresses; /* plane_element.c, ring_element.c */

struct uz_macro {
    const uz_bound_body *body;
    const uz_macro_stresses *of;
    int64_t element;
    int parts, degree, functions, all, outer, kept; /* functions of a part, of all; moments; columns of Z */
    double corner[UZ_BOUND_PARTS][2], centre[2];
    double local[2][2];               /* derivatives of local coordinates */
    double times[UZ_MACRO_FUNCTIONS]; /* scales the functions to stresses of about 1 */
    double Z[UZ_BOUND_PARTS * UZ_MACRO_FUNCTIONS * UZ_BOUND_PARTS * UZ_MACRO_FUNCTIONS]; /* all x kept */
    /* kept + outer rows: [L; B] */
    double A[(UZ_BOUND_PARTS * UZ_MACRO_FUNCTIONS + UZ_MACRO_OUTER) * UZ_BOUND_PARTS * UZ_MACRO_FUNCTIONS];
    double y[UZ_BOUND_PARTS * UZ_MACRO_FUNCTIONS], rest[UZ_MACRO_OUTER]; /* L^-1 Z'f; D_0 */
    double key[UZ_MACRO_KEY]; /* what these follow from: its first 6 numbers are the shape */
    /* of it by the axes of edges: the condensed stiffness, lower triangle, and what the balancing stress makes of p;
     * weighed false: not yet */
    double K[UZ_MACRO_OUTER * UZ_MACRO_OUTER], p[UZ_MACRO_OUTER];
    bool made, weighed;
    int64_t last; /* when it was used: the count of calls of that */
    int64_t map;  /* uz_bound_keep_maps: where its own is; -1: none yet */
};

/* The stresses of Airy's functions, of degree 2 to degree + 2, at a point: columns from 0. Polynomials in coordinates
 * that the element's shape is about a square in, however thin it is. Returns how many they are. */
int uz_airy_stresses(double S[4][UZ_MACRO_FUNCTIONS + 1], const uz_macro *m, const double at[2]);

/* A part: its corners k, k + 1, and the centre. */
void uz_macro_part(double corner[3][2], const uz_macro *m, int part);

#endif
