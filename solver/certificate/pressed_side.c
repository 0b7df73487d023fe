/* pressed_side.c: at a point of the rule of sides the area vector is t_1 x t_2, t_k the derivatives of x along the
 * reference coordinates; in the plane (t_y, -t_x) times the thickness, of rings 2 pi r. With delta x = N_b e the
 * derivative is (N_b,1 e) x t_2 + t_1 x (N_b,2 e), and likewise in the plane. */
#include "certificate/pressed_side.h"

#include <string.h>

enum { SIDE_DOFS = 3 * UZ_SIDE_NODES };

static void cross(long double out[3], const long double a[3], const long double b[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* A point: shape functions, their slopes, and what follows from where the nodes are. */
typedef struct {
    double N[UZ_SIDE_NODES], slope[UZ_SIDE_NODES][3];
    long double t[2][3], depth; /* depth: thickness, or 2 pi r */
} point_at;

/* The area vector; along NULL: there. Else its derivative as node b moves along an axis, `along`. */
static void area(long double out[3], const point_at *at, const uz_side *side, int b, const long double *along)
{
    const bool ring = side->model == UZ_AXISYMMETRIC;
    memset(out, 0, 3 * sizeof *out);
    if (side->dim == 2) {
        const long double more = ring && along ? 2 * 3.14159265358979323846264338327950288L * at->N[b] * along[0] : 0;
        const long double *t = at->t[0];
        const long double x = along ? at->slope[b][0] * along[0] : t[0], y = along ? at->slope[b][0] * along[1] : t[1];
        out[0] = at->depth * y + more * t[1];
        out[1] = -at->depth * x - more * t[0];
        return;
    }
    if (!along) {
        cross(out, at->t[0], at->t[1]);
        return;
    }
    long double way[2][3], second[3];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
            way[k][i] = at->slope[b][k] * along[i];
    cross(out, way[0], at->t[1]);
    cross(second, at->t[0], way[1]);
    for (int i = 0; i < 3; i++)
        out[i] += second[i];
}

void uz_pressed_side(long double *force, double *ke, const uz_side *side, const long double *x, double pressure)
{
    const int dim = side->dim, n = dim * side->nodes;
    long double full[SIDE_DOFS * SIDE_DOFS] = {0};
    memset(force, 0, (size_t)n * sizeof *force);
    for (int g = 0; g < uz_side_gauss_count(side); g++) {
        point_at at;
        double point[2];
        long double vector[3], radius = 0;
        const long double weight = (long double)uz_side_gauss(point, side, g) * pressure;
        uz_side_gradients(at.N, at.slope, side, point);
        memset(at.t, 0, sizeof at.t);
        for (int a = 0; a < side->nodes; a++) {
            radius += at.N[a] * x[dim * a];
            for (int k = 0; k < dim - 1; k++)
                for (int i = 0; i < dim; i++)
                    at.t[k][i] += at.slope[a][k] * (x[dim * a + i] - x[i]);
        }
        at.depth =
            side->model == UZ_AXISYMMETRIC ? 2 * 3.14159265358979323846264338327950288L * radius : side->thickness;
        area(vector, &at, side, 0, NULL);
        for (int p = 0; p < n; p++)
            force[p] -= weight * at.N[p / dim] * vector[p % dim];
        for (int q = 0; q < n; q++) {
            long double along[3] = {0};
            along[q % dim] = 1;
            area(vector, &at, side, q / dim, along);
            for (int p = 0; p < n; p++)
                full[p * n + q] += weight * at.N[p / dim] * vector[p % dim];
        }
    }
    for (int p = 0; p < n; p++)
        for (int q = 0; q < n; q++)
            ke[p * n + q] = (double)((full[p * n + q] + full[q * n + p]) / 2);
}
