/* surface.c: the deformed body as coloured triangles: the elements of a plane, the outer faces of a solid. */
#include "core/error.h"
#include "core/hooks.h"
#include "picture/scenery.h"

#include <math.h>

/* Grids of more elements than this would hide their colours behind the lines. */
enum { MOST_LINED = 4000 };

static void paint_cell(uz_raster *raster, const uz_scenery *scenery, const int64_t *around, int n, bool lined)
{
    uz_raster_point p[UZ_CELL_POINTS];
    double area = 0, light = 1;
    for (int i = 0; i < n; i++)
        p[i] = uz_scenery_node(scenery, around[i], scenery->factor);
    for (int i = 0; i < n; i++)
        area += p[i].x * p[(i + 1) % n].y - p[i].y * p[(i + 1) % n].x;
    if (scenery->model->mesh.dim == 3) {
        /* Faces that look away are hidden; those that look aside are darker. The pixels' y points down. */
        double size = 0;
        for (int i = 0; i < n; i++) {
            const uz_raster_point *a = &p[i], *b = &p[(i + 1) % n];
            size = fmax(size, hypot(hypot(b->x - a->x, b->y - a->y), b->z - a->z));
        }
        if (area >= 0)
            return;
        light = 0.55 + 0.45 * fmin(1, -area / (2 * size * size));
    }
    /* A convex polygon of corners with the middles of its edges, as a fan about its mean: `count` points in order. */
    uz_raster_point mean = {0, 0, 0, 0};
    for (int i = 0; i < n; i++) {
        mean.x += p[i].x / n;
        mean.y += p[i].y / n;
        mean.z += p[i].z / n;
        mean.value += p[i].value / n;
    }
    for (int i = 0; i < n; i++) {
        const uz_raster_point triangle[3] = {p[i], p[(i + 1) % n], mean};
        uz_raster_triangle(raster, triangle, light);
    }
    for (int i = 0; lined && i < n; i++)
        uz_raster_line(raster, &p[i], &p[(i + 1) % n], 0.5);
}

uz_status uz_scenery_paint(uz_raster *raster, const uz_scenery *scenery, const uz_skin *skin, const uz_hooks *hooks,
                           uz_error *err)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    const bool lined = mesh->n_elements <= (mesh->dim == 2 ? 1 : 4) * MOST_LINED;
    for (int64_t i = 0; i < skin->n_cells; i++) {
        if (i % 4096 == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the picture was drawn");
        paint_cell(raster, scenery, skin->point + skin->first[i], (int)(skin->first[i + 1] - skin->first[i]), lined);
    }
    return UZ_OK;
}
