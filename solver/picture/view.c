/* view.c: from the body's coordinates to pixels. */
#include "picture/scenery.h"

#include "core/error.h"

#include <math.h>
#include <string.h>

enum { MARGIN = 50, LEAST_HEIGHT = 160, MOST_HEIGHT = 1600 };

uz_raster_point uz_scenery_point(const uz_scenery *scenery, const double *x)
{
    double seen[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < scenery->model->mesh.dim; c++)
            seen[i] += scenery->axes[i][c] * x[c];
    return (uz_raster_point){.x = scenery->offset[0] + scenery->scale * seen[0],
                             .y = scenery->offset[1] - scenery->scale * seen[1],
                             .z = scenery->scale * seen[2]};
}

uz_raster_point uz_scenery_node(const uz_scenery *scenery, int64_t node, double factor)
{
    const int dim = scenery->model->mesh.dim;
    double x[3] = {0, 0, 0};
    for (int c = 0; c < dim; c++)
        x[c] = scenery->model->mesh.xyz[node * dim + c] + factor * scenery->answer->u[node * dim + c];
    uz_raster_point point = uz_scenery_point(scenery, x);
    const double range = scenery->high - scenery->low;
    point.value = range > 0 ? (scenery->value[node] - scenery->low) / range : 0.5;
    return point;
}

/* Adds where the nodes are, drawn with this factor, to the box low..high in lengths. */
static void extend_box(double low[2], double high[2], const uz_scenery *scenery, double factor)
{
    for (int64_t a = 0; a < scenery->model->mesh.n_nodes; a++) {
        const uz_raster_point p = uz_scenery_node(scenery, a, factor);
        const double at[2] = {p.x, -p.y};
        for (int i = 0; i < 2; i++) {
            low[i] = fmin(low[i], at[i]);
            high[i] = fmax(high[i], at[i]);
        }
    }
}

/* A power of ten times 1, 2 or 5: a factor that reads well. */
static double round_factor(double x)
{
    const double power = pow(10, floor(log10(x))), rest = x / power;
    return power * (rest < 2 ? 1 : rest < 5 ? 2 : 5);
}

double uz_show_factor(const uz_mesh *mesh, const double *u)
{
    double largest = 0;
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++)
        largest = fmax(largest, fabs(u[i]));
    const double ideal = 0.06 * mesh->extent / largest;
    return largest > 0 && isfinite(ideal) ? fmax(round_factor(ideal), 1) : 1;
}

uz_status uz_scenery_fit(uz_scenery *scenery, uz_error *err)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    /* The plane as it is; a solid from a corner, 30 degrees from the right and 25 from above. */
    static const double PLANE[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double a = 30 * 3.14159265358979 / 180, b = 25 * 3.14159265358979 / 180;
    const double solid[3][3] = {
        {cos(a), 0, -sin(a)}, {-sin(a) * sin(b), cos(b), -cos(a) * sin(b)}, {sin(a) * cos(b), sin(b), cos(a) * cos(b)}};
    memcpy(scenery->axes, scenery->model->mesh.dim == 2 ? PLANE : solid, sizeof scenery->axes);
    scenery->extent = scenery->model->mesh.extent;
    if (!(scenery->factor > 0))
        scenery->factor = uz_show_factor(&scenery->model->mesh, scenery->answer->u);
    scenery->scale = 1;
    scenery->offset[0] = scenery->offset[1] = 0;
    extend_box(low, high, scenery, 0);
    extend_box(low, high, scenery, scenery->factor);
    const double wide = high[0] - low[0], tall = high[1] - low[1];
    if (!(isfinite(wide) && isfinite(tall) && wide + tall > 0))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "u", "the displacements cannot be drawn: they are not finite");
    scenery->scale = fmin((scenery->width - 2 * MARGIN) / fmax(wide, 1e-9 * tall),
                          (MOST_HEIGHT - 2 * MARGIN) / fmax(tall, 1e-9 * wide));
    scenery->height = (int)fmax(ceil(scenery->scale * tall) + 2 * MARGIN, LEAST_HEIGHT);
    scenery->offset[0] = 0.5 * scenery->width - 0.5 * scenery->scale * (low[0] + high[0]);
    scenery->offset[1] = 0.5 * scenery->height + 0.5 * scenery->scale * (low[1] + high[1]);
    return UZ_OK;
}
