/* surface.c: the deformed body as coloured triangles: the elements of a plane, the outer faces of a solid. */
#include "core/error.h"
#include "core/hooks.h"
#include "picture/scenery.h"
#include "scene/corner_table.h"

#include <math.h>

/* Grids of more elements than this would hide their colours behind the lines. */
enum { MOST_LINED = 4000 };

/* A convex polygon of corners with the middles of its edges, as a fan about its mean: `count` points in order. */
static void paint_polygon(uz_raster *raster, const uz_raster_point *p, int count, double light)
{
    uz_raster_point mean = {0, 0, 0, 0};
    for (int i = 0; i < count; i++) {
        mean.x += p[i].x / count;
        mean.y += p[i].y / count;
        mean.z += p[i].z / count;
        mean.value += p[i].value / count;
    }
    for (int i = 0; i < count; i++) {
        const uz_raster_point triangle[3] = {p[i], p[(i + 1) % count], mean};
        uz_raster_triangle(raster, triangle, light);
    }
}

/* The nodes of a polygon, which come corners first, in the order around it. Returns how many. */
static int walk_around(int64_t *out, const int64_t *node, int corners, int count)
{
    const bool quadratic = count > corners;
    for (int i = 0; i < corners; i++) {
        out[quadratic ? 2 * i : i] = node[i];
        if (quadratic)
            out[2 * i + 1] = node[corners + i];
    }
    return quadratic ? 2 * corners : corners;
}

static void paint_cell(uz_raster *raster, const uz_scenery *scenery, const int64_t *node, int corners, int count,
                       bool lined)
{
    int64_t around[UZ_FACE_NODES];
    uz_raster_point p[UZ_FACE_NODES];
    const int n = walk_around(around, node, corners, count);
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
    paint_polygon(raster, p, n, light);
    for (int i = 0; lined && i < n; i++)
        uz_raster_line(raster, &p[i], &p[(i + 1) % n], 0.5);
}

static uz_status paint_plane(uz_raster *raster, const uz_scenery *scenery, const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        if (e % 4096 == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the picture was drawn");
        paint_cell(raster, scenery, node, uz_element_corner_count((uz_element_kind)mesh->kind[e]), count,
                   mesh->n_elements <= MOST_LINED);
    }
    return UZ_OK;
}

static uz_status paint_solid(uz_raster *raster, const uz_scenery *scenery, const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    uz_corner_table sides;
    uz_status status = uz_corner_table_build(&sides, mesh, true, err);
    for (int64_t i = 0; status == UZ_OK && i < sides.count; i++) {
        int64_t node[UZ_FACE_NODES];
        if (i % 4096 == 0 && uz_cancelled(hooks))
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the picture was drawn");
        if (sides.same[i] || uz_corner_table_shared(&sides, i))
            continue;
        const int count = uz_mesh_face(node, mesh, sides.item[i]);
        paint_cell(raster, scenery, node, uz_face_corner_count((uz_element_kind)mesh->kind[sides.item[i].element]),
                   count, mesh->n_elements <= 4 * MOST_LINED);
    }
    uz_corner_table_clear(&sides);
    return status;
}

uz_status uz_scenery_paint(uz_raster *raster, const uz_scenery *scenery, const uz_hooks *hooks, uz_error *err)
{
    return scenery->model->mesh.dim == 2 ? paint_plane(raster, scenery, hooks, err)
                                         : paint_solid(raster, scenery, hooks, err);
}
