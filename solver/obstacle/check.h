/* check.h: parts of the checks of shapes. Each refuses with a pointer into the scene. */
#ifndef UZ_OBSTACLE_CHECK_H
#define UZ_OBSTACLE_CHECK_H

#include "obstacle/shape.h"

#include <float.h>

/* Coordinates that differ by less than this part of their size have no direction between them. */
#define UZ_TOLD_APART (64 * DBL_EPSILON)

enum { UZ_OBSTACLE_POINTER = 96 };

/* "/contacts/0/obstacle/circle/radius"; i >= 0: "/contacts/0/obstacle/polyline/points/7". Returns where. */
const char *uz_obstacle_pointer(char where[UZ_OBSTACLE_POINTER], const uz_obstacle_subject *s, const char *key,
                                int64_t i);
/* In memory of the block that it stands in. */
#define UZ_OBSTACLE_PLACE(s, key, i) uz_obstacle_pointer((char[UZ_OBSTACLE_POINTER]){""}, s, key, i)
uz_status uz_obstacle_not_finite(const uz_obstacle_subject *s, const char *key, int64_t i);
uz_status uz_obstacle_check_finite(const uz_obstacle_subject *s, const char *key, const double *v, int64_t n);
/* The contact's normal; remedy: what is said of one without a direction. */
uz_status uz_obstacle_check_direction(const uz_obstacle_subject *s, const char *key, const char *remedy);
/* Are there two numbers at least in each list, and the lists themselves? */
uz_status uz_obstacle_check_lists(const uz_obstacle_subject *s, const char *key, const char *what);

#endif
