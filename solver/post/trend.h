/* trend.h: where a number of an answer goes with finer grids, by those that were solved. Pure. */
#ifndef UZ_POST_TREND_H
#define UZ_POST_TREND_H

#include "uzawa.h"

/* What one grid has of a number. */
typedef struct {
    double size;  /* of its elements where the number comes from, up to a factor that all grids share */
    double value; /* NaN: the grid has none */
} uz_trend_point;

/* point: count >= 1, in the order of the grids. here: the number of the answer, on one of these grids. grain: what
 * elements of their size cannot tell apart in any case, as half of one at each end of a contact; 0: nothing. */
void uz_trend_fit(uz_trend *out, const uz_trend_point *point, int count, double here, double grain);

#endif
