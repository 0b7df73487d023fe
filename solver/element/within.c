/* within.c: where a place is in an element. */
#include "element/element.h"

#include <math.h>
#include <string.h>

enum { MOST_STEPS = 30 };

/* The sides are plane in local coordinates, and the centre lies within all. */
double uz_element_depth(const uz_element_type *type, const double point[3])
{
    double least = INFINITY;
    for (int s = 0; s < type->sides; s++) {
        const int *node = type->side[s].node;
        const double *o = type->local[node[0]], *a = type->local[node[1]];
        double n[3] = {0}, to_point = 0, to_centre = 0, size = 0;
        if (type->dim == 2) {
            n[0] = a[1] - o[1];
            n[1] = o[0] - a[0];
        } else {
            const double *b = type->local[node[2]];
            for (int c = 0; c < 3; c++)
                n[c] = (a[(c + 1) % 3] - o[(c + 1) % 3]) * (b[(c + 2) % 3] - o[(c + 2) % 3]) -
                       (a[(c + 2) % 3] - o[(c + 2) % 3]) * (b[(c + 1) % 3] - o[(c + 1) % 3]);
        }
        for (int c = 0; c < type->dim; c++) {
            to_point += n[c] * (point[c] - o[c]);
            to_centre += n[c] * (type->centre[c] - o[c]);
            size = hypot(size, n[c]);
        }
        least = fmin(least, (to_centre > 0 ? to_point : -to_point) / size);
    }
    return least;
}

bool uz_element_find(double point[3], const uz_element_type *type, const double *xyz, double extent, const double x[3])
{
    double N[UZ_ELEMENT_NODES], slope[UZ_ELEMENT_NODES][3];
    memcpy(point, type->centre, 3 * sizeof *point);
    for (int k = 0; k < MOST_STEPS; k++) {
        double J[3][3] = {{0}}, inverse[3][3], rest[3] = {0}, off = 0, moved = 0;
        type->shape(type, N, slope, point);
        for (int c = 0; c < type->dim; c++) {
            rest[c] = x[c];
            for (int a = 0; a < type->nodes; a++) {
                rest[c] -= N[a] * xyz[a * type->dim + c];
                for (int axis = 0; axis < type->dim; axis++)
                    J[c][axis] += slope[a][axis] * xyz[a * type->dim + c];
            }
            off = fmax(off, fabs(rest[c]));
        }
        uz_invert_small(inverse, J, type->dim);
        for (int c = 0; c < type->dim; c++) {
            double step = 0;
            for (int i = 0; i < type->dim; i++)
                step += inverse[c][i] * rest[i];
            if (!(fabs(step) <= 1e3)) /* far outside, where the map may fold; or the element has no size there */
                return false;
            point[c] += step;
            moved = fmax(moved, fabs(step));
        }
        if (moved < 1e-12 || off < 1e-15 * extent)
            break;
    }
    return true;
}
