#include "certificate/one_sided.h"

#include <math.h>

bool uz_is_ray_direction(const double *y, int64_t m)
{
    for (int64_t i = 0; i < m; i++)
        if (!(y[i] <= 0.0))
            return false;
    return true;
}

double uz_cut_reactions(double *r, int64_t m)
{
    double positive_part = 0.0;
    for (int64_t i = 0; i < m; i++) {
        if (r[i] > 0.0)
            positive_part = hypot(positive_part, r[i]);
        r[i] = fmin(r[i], 0.0);
    }
    return positive_part;
}

double uz_penetration_norm(const double *g, int64_t m)
{
    double norm = 0.0;
    for (int64_t i = 0; i < m; i++)
        if (uz_row_penetrates(g[i]))
            norm = hypot(norm, g[i]);
    return norm;
}

double uz_complementarity_norm(const double *r, const double *g, int64_t m)
{
    double norm = 0.0;
    for (int64_t i = 0; i < m; i++)
        if (g[i] * r[i] != 0.0)
            norm = hypot(norm, g[i] * r[i]);
    return norm;
}
