/* check.c: what is no obstacle: what the shapes' own checks have in common. */
#include "obstacle/check.h"

#include "core/error.h"
#include "scene/scene.h"

#include <math.h>
#include <stdio.h>

/* "/contacts/0/obstacle/circle/radius"; i >= 0: "/contacts/0/obstacle/polyline/points/7". */
const char *uz_obstacle_pointer(char where[UZ_OBSTACLE_POINTER], const uz_obstacle_subject *s, const char *key,
                                int64_t i)
{
    const int n = snprintf(where, UZ_OBSTACLE_POINTER, "/contacts/%lld/obstacle/%s%s%s", (long long)s->index,
                           s->shape->name[s->dim - 2], *key ? "/" : "", key);
    if (i >= 0 && n > 0 && n < UZ_OBSTACLE_POINTER)
        snprintf(where + n, UZ_OBSTACLE_POINTER - (size_t)n, "/%lld", (long long)i);
    return where;
}

uz_status uz_obstacle_not_finite(const uz_obstacle_subject *s, const char *key, int64_t i)
{
    return uz_fail(s->err, UZ_ERR_NOT_FINITE, UZ_OBSTACLE_PLACE(s, key, i), "not a finite number");
}

uz_status uz_obstacle_check_finite(const uz_obstacle_subject *s, const char *key, const double *v, int64_t n)
{
    for (int64_t i = 0; i < n; i++)
        if (!isfinite(v[i]))
            return uz_obstacle_not_finite(s, key, i);
    return UZ_OK;
}

uz_status uz_obstacle_check_direction(const uz_obstacle_subject *s, const char *key, const char *remedy)
{
    double unit[3];
    const uz_status status = uz_obstacle_check_finite(s, key, s->contact->normal, s->dim);
    if (status == UZ_OK && !uz_unit_normal(unit, s->contact->normal, s->dim))
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, key, -1), "%s", remedy);
    return status;
}

uz_status uz_obstacle_check_lists(const uz_obstacle_subject *s, const char *key, const char *what)
{
    const uz_contact *c = s->contact;
    const bool heights = c->kind == UZ_OBSTACLE_HEIGHT, two = heights && s->dim == 3;
    if (c->n_x < 2 || (two && c->n_y < 2))
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, key, -1), "%s", what);
    if (!c->x || ((two || !heights) && !c->y) || (heights && !c->z))
        return uz_fail(s->err, UZ_ERR_ARGUMENT, UZ_OBSTACLE_PLACE(s, "", -1), "the obstacle's numbers are missing");
    if (c->n_x > INT32_MAX || c->n_y > INT32_MAX)
        return uz_fail(s->err, UZ_ERR_SCENE, UZ_OBSTACLE_PLACE(s, key, -1), "too many numbers");
    return UZ_OK;
}
