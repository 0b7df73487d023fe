/* brick_product.h: K times a vector in double-double precision where K is what equal cells do. */
#ifndef UZ_BRICK_PRODUCT_H
#define UZ_BRICK_PRODUCT_H

#include "brick/cells.h"

/* hi + lo (d) = K x, cell by cell and entry by entry of ke; what they had counts for nothing. y (d) = K c in double
 * precision, for a c that is zero at most dofs. */
uz_status uz_brick_precise_product(double *hi, double *lo, double *y, const uz_brick *brick, const double *x,
                                   const double *c, uz_error *err);

#endif
