/* reference.h: what the descriptors of element types share: shape functions, rules and recoveries of simplices, of
 * boxes
 * [-1, 1]^dim, and of the lines that wedges are made with. */
#ifndef UZ_ELEMENT_REFERENCE_H
#define UZ_ELEMENT_REFERENCE_H

#include "element/element_type.h"

#define UZ_GAUSS2 0.57735026918962576451 /* 1 / sqrt(3): two points, weights 1 */
#define UZ_GAUSS3 0.77459666924148337704 /* sqrt(3 / 5): three points, weights 5/9, 8/9, 5/9: */
#define UZ_OUTER3 (5. / 9)
#define UZ_INNER3 (8. / 9)

/* What to do about a plane element whose nodes run clockwise. */
#define UZ_ADVICE_PLANE "its nodes must run counterclockwise: give them in the opposite order"

/* Barycentric coordinates of a local point, dim + 1 of them; the derivative of the a-th along axis i. */
void uz_barycentric(double L[4], int dim, const double point[3]);
double uz_barycentric_slope(int a, int i);
/* `shape` of simplices. Of the linear ones: L_a. Of those with middles of the edges: L_a (2 L_a - 1) at corners,
 * 4 L_a L_b between a and b. */
void uz_simplex_shape(const uz_element_type *type, double *N, double (*slope)[3], const double point[3]);

/* Interior rules of triangles, of degree 2 and 4. */
extern const uz_gauss_point uz_gauss_triangle3[3], uz_gauss_triangle6[6];

/* One point in the centre; the dim + 1 Gauss points of a simplex; the 2^dim of a box. */
int uz_recover_centre(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind);
int uz_recover_simplex(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind);
int uz_recover_box(double point[][3], double share[][UZ_ELEMENT_SAMPLES], uz_element_kind kind);

#endif
