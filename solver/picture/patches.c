/* patches.c: obstacles of solids near the body, as grey surfaces. */
#include "picture/scenery.h"

#include "obstacle/vectors.h"

#include <math.h>
#include <string.h>

enum { CELLS = 40 };

/* Full light where it faces the eye. */
static double light_on(const uz_raster_point p[3])
{
    const double a[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z},
                 b[3] = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    double n[3];
    uz_cross3(n, a, b);
    uz_make_unit3(n, (const double[3]){0, 0, 1});
    return 0.75 + 0.25 * fabs(n[2]);
}

static void paint_patch(uz_raster *raster, const uz_scenery *scenery, const uz_obstacle_patch *p)
{
    const uz_obstacle_shape *shape = uz_obstacle_shape_of(p->contact->kind);
    for (int j = 0; j < CELLS; j++)
        for (int i = 0; i < CELLS; i++) {
            static const int CORNER[2][3] = {{0, 1, 3}, {0, 3, 2}};
            uz_raster_point at[4];
            for (int k = 0; k < 4; k++) {
                double x[3];
                const int to_the_right = k % 2, above = k / 2;
                shape->surface(x, p, 2.0 * (i + to_the_right) / CELLS - 1, 2.0 * (j + above) / CELLS - 1);
                at[k] = uz_scenery_point(scenery, x);
                at[k].value = NAN;
            }
            for (int k = 0; k < 2; k++) {
                const uz_raster_point triangle[3] = {at[CORNER[k][0]], at[CORNER[k][1]], at[CORNER[k][2]]};
                uz_raster_triangle(raster, triangle, light_on(triangle));
            }
        }
}

bool uz_scenery_paint_obstacles(uz_raster *raster, const uz_scenery *scenery)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    bool painted = false;
    uz_obstacle_patch p;
    memset(&p, 0, sizeof p);
    if (mesh->dim == 3) {
        double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        for (int64_t i = 0; i < 3 * mesh->n_nodes; i++) {
            low[i % 3] = fmin(low[i % 3], mesh->xyz[i]);
            high[i % 3] = fmax(high[i % 3], mesh->xyz[i]);
        }
        for (int c = 0; c < 3; c++)
            p.middle[c] = 0.5 * low[c] + 0.5 * high[c];
        p.size = mesh->extent;
    }
    for (int64_t k = 0; mesh->dim == 3 && k < scenery->scene->n_contacts; k++) {
        p.contact = &scenery->scene->contacts[k];
        const uz_obstacle_shape *shape = uz_obstacle_shape_of(p.contact->kind);
        if (!shape)
            continue;
        memset(p.foot, 0, sizeof p.foot);
        shape->place(&p);
        paint_patch(raster, scenery, &p);
        painted = true;
    }
    return painted;
}
