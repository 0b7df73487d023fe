/* ray.h: from reactions that grow without end to the rows that contradict each other. */
#ifndef UZ_DUAL_RAY_H
#define UZ_DUAL_RAY_H

#include "uzawa.h"

/* y (m, of N m x d): in, a direction in which the reactions grow; out, scaled to max |y_i| about 1, its nearest vector
 * with N'y = 0 on the rows that take part, cut at 0. A candidate for uz_prove_ray. */
uz_status uz_ray_project(double *y, const uz_csc *N, uz_error *err);

#endif
