/* overlay.c: what stands around the body: its outline before, obstacles, contact forces, the legend. */
#include "picture/scenery.h"

#include "obstacle/shape.h"

#include <math.h>
#include <string.h>

enum { MOST_OUTLINE = 20000, MOST_ARROWS = 80, ARROW = 55, TICK = 9 };

uz_status uz_scenery_put_outline(uz_buffer *svg, const uz_scenery *scenery, const uz_skin *skin, uz_error *err)
{
    uz_skin_edges edges;
    uz_status status = uz_skin_edges_build(&edges, skin, &scenery->model->mesh, err);
    if (status != UZ_OK)
        return status;
    uz_buffer_print(svg, "<path class=\"before\" d=\"");
    for (int64_t i = 0; i < edges.n_outline && i < MOST_OUTLINE; i++) {
        const uz_raster_point a = uz_scenery_node(scenery, edges.outline[2 * i], 0),
                              b = uz_scenery_node(scenery, edges.outline[2 * i + 1], 0);
        uz_buffer_print(svg, "M%.1f %.1fL%.1f %.1f", a.x, a.y, b.x, b.y);
    }
    uz_buffer_print(svg, "\"/>\n");
    uz_skin_edges_clear(&edges);
    return UZ_OK;
}

/* One stroke of an obstacle's border with the obstacle on its right, and ticks into it. */
typedef struct {
    uz_buffer *svg, ticks;
    uz_raster_point last;
    bool started;
    double travelled; /* since the last tick */
} border;

static void border_to(border *b, uz_raster_point p)
{
    const double reach = 1e4; /* far outside of every picture, and short enough to print */
    p.x = fmin(fmax(p.x, -reach), reach);
    p.y = fmin(fmax(p.y, -reach), reach);
    uz_buffer_print(b->svg, "%c%.1f %.1f", b->started ? 'L' : 'M', p.x, p.y);
    const double dx = p.x - b->last.x, dy = p.y - b->last.y, length = b->started ? hypot(dx, dy) : 0;
    if (length > 0) {
        double at = TICK - b->travelled;
        for (; at <= length; at += TICK) {
            const double x = b->last.x + at * dx / length, y = b->last.y + at * dy / length;
            /* Right of the way on the paper, where y points down, is (-dy, dx); the tick leans back. */
            uz_buffer_print(&b->ticks, "M%.1f %.1fl%.1f %.1f", x, y, (-dy - dx) / length * 0.7 * TICK,
                            (dx - dy) / length * 0.7 * TICK);
        }
        b->travelled = length - (at - TICK);
    }
    b->last = p;
    b->started = true;
}

/* The line through `point` along `way`, well beyond the picture. */
static void border_line(border *b, const uz_scenery *scenery, const double point[2], const double way[2])
{
    const uz_raster_point p = uz_scenery_point(scenery, point);
    const double length = hypot(way[0], way[1]), reach = 2.0 * (scenery->width + scenery->height);
    const double dx = way[0] / length, dy = -way[1] / length;
    /* The part of it that is nearest to the middle of the picture. */
    const double along = (0.5 * scenery->width - p.x) * dx + (0.5 * scenery->height - p.y) * dy;
    for (int side = -1; side <= 1; side += 2)
        border_to(b, (uz_raster_point){.x = p.x + (along + side * reach / 2) * dx,
                                       .y = p.y + (along + side * reach / 2) * dy});
}

/* The obstacle's outline, going on well beyond the picture at its ends. */
static void border_outline(border *b, const uz_scenery *scenery, const uz_contact *contact)
{
    const uz_obstacle_shape *shape = uz_obstacle_shape_of(contact->kind);
    const double far = 10 * scenery->extent;
    double at[2], way[2];
    const int64_t n = shape->outline(at, way, contact, 0);
    if (n == 1) {
        border_line(b, scenery, at, way);
        return;
    }
    for (int64_t i = -1; i <= n; i++) {
        const int64_t k = i < 0 ? 0 : i < n ? i : n - 1;
        shape->outline(at, way, contact, k);
        const double length = hypot(way[0], way[1]);
        if (k != i && !(length > 0))
            continue;
        for (int c = 0; k != i && c < 2; c++)
            at[c] += far * way[c] / length;
        border_to(b, uz_scenery_point(scenery, at));
    }
}

static void put_obstacle(uz_buffer *svg, const uz_scenery *scenery, const uz_contact *contact)
{
    border b = {.svg = svg};
    uz_buffer_print(svg, "<path class=\"obstacle\" d=\"");
    border_outline(&b, scenery, contact);
    uz_buffer_print(svg, "\"/><path class=\"ticks\" d=\"");
    uz_buffer_put(svg, b.ticks.data, b.ticks.len);
    svg->failed = svg->failed || b.ticks.failed;
    uz_buffer_drop(&b.ticks);
    uz_buffer_print(svg, "\"/>\n");
}

void uz_scenery_put_obstacles(uz_buffer *svg, const uz_scenery *scenery)
{
    for (int64_t k = 0; scenery->model->mesh.dim == 2 && k < scenery->scene->n_contacts; k++)
        if (uz_obstacle_shape_of(scenery->scene->contacts[k].kind))
            put_obstacle(svg, scenery, &scenery->scene->contacts[k]);
}

/* Arrows follow the pressure and not the mesh. */
static double push_of(const uz_scenery *scenery, int64_t row)
{
    return scenery->pressure[row] > 0 ? scenery->pressure[row] : 0;
}

static double largest_push(const uz_scenery *scenery)
{
    double largest = 0;
    for (int64_t i = 0; i < scenery->model->m; i++)
        largest = fmax(largest, push_of(scenery, i));
    return largest;
}

static void put_arrow(uz_buffer *svg, const uz_scenery *scenery, int64_t row, double length)
{
    const uz_mesh_info *info = &scenery->model->info;
    const double *n = info->contact_normal + row * info->dim;
    const uz_raster_point tip = uz_scenery_node(scenery, info->contact_node[row], scenery->factor);
    double dx = 0, dy = 0;
    for (int c = 0; c < info->dim; c++) {
        dx += scenery->axes[0][c] * n[c];
        dy -= scenery->axes[1][c] * n[c];
    }
    const double head = fmin(6, 0.4 * length);
    uz_buffer_print(svg, "M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1fL%.1f %.1f", tip.x - length * dx, tip.y - length * dy,
                    tip.x, tip.y, tip.x - head * (dx + 0.5 * dy), tip.y - head * (dy - 0.5 * dx), tip.x, tip.y,
                    tip.x - head * (dx - 0.5 * dy), tip.y - head * (dy + 0.5 * dx));
}

void uz_scenery_put_arrows(uz_buffer *svg, const uz_scenery *scenery)
{
    const int64_t m = scenery->model->m;
    const double largest = largest_push(scenery);
    int64_t pushing = 0, seen = 0;
    for (int64_t i = 0; i < m; i++)
        pushing += push_of(scenery, i) > 0;
    if (!(largest > 0))
        return;
    const int64_t every = (pushing + MOST_ARROWS - 1) / MOST_ARROWS;
    uz_buffer_print(svg, "<path class=\"push\" d=\"");
    for (int64_t i = 0; i < m; i++)
        if (push_of(scenery, i) > 0 && seen++ % every == 0)
            put_arrow(svg, scenery, i, ARROW * push_of(scenery, i) / largest);
    uz_buffer_print(svg, "\"/>\n");
}

void uz_scenery_put_legend(uz_buffer *svg, const uz_scenery *scenery, const char *title)
{
    /* The text on the left takes up to 160 pixels; below the bar three texts need 210. */
    enum { LEFT = 180, LEAST = 210, MOST = 300, STOPS = 8 };
    const int room = scenery->width - 20 - LEFT, bar = room < LEAST ? LEAST : room < MOST ? room : MOST;
    const int y = scenery->height + 12, x = scenery->width - bar - 20;
    uz_buffer_print(svg, "<defs><linearGradient id=\"scale\">");
    for (int i = 0; i <= STOPS; i++) {
        unsigned char rgb[3];
        uz_colour(rgb, (double)i / STOPS);
        uz_buffer_print(svg, "<stop offset=\"%g\" stop-color=\"#%02x%02x%02x\"/>", (double)i / STOPS, rgb[0], rgb[1],
                        rgb[2]);
    }
    uz_buffer_print(svg,
                    "</linearGradient></defs>\n<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"12\" "
                    "fill=\"url(#scale)\"/>\n",
                    x, y, bar);
    uz_buffer_print(svg, "<text x=\"%d\" y=\"%d\">%.3g</text><text x=\"%d\" y=\"%d\" text-anchor=\"end\">%.3g</text>",
                    x, y + 26, scenery->low, x + bar, y + 26, scenery->high);
    uz_buffer_print(svg, "<text x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n", x + bar / 2, y + 26,
                    scenery->what);
    uz_buffer_print(svg, "<text x=\"20\" y=\"%d\" class=\"title\">", y + 10);
    uz_buffer_put_escaped(svg, title ? title : "");
    uz_buffer_print(svg, "</text><text x=\"20\" y=\"%d\">displacements \u00d7 %.6g", y + 26, scenery->factor);
    if (largest_push(scenery) > 0)
        uz_buffer_print(svg, "</text><text x=\"20\" y=\"%d\">longest arrow: pressure %.3g", y + 42,
                        largest_push(scenery));
    uz_buffer_print(svg, "</text>\n");
}
