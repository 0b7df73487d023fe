/* scenery.c: the parts of a picture of a deformed body, from the projection to the legend. */
#include "picture/scenery.h"

#include "assembly/discretization.h"
#include "core/error.h"
#include "core/hooks.h"
#include "obstacle/shape.h"
#include "obstacle/vectors.h"
#include "scene/scene.h"
#include "text/axis.h"

#include <math.h>
#include <string.h>

/* ---- from the body's coordinates to pixels */

#define UNSEEN 0.005 /* of the size of the body */
enum { MARGIN = 50, LEAST_HEIGHT = 160, MOST_HEIGHT = 1600 };

/* Where a point (dim coordinates) is. */
static uz_raster_point place_point(const uz_scenery *scenery, const double *x)
{
    double seen[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++)
        for (int c = 0; c < scenery->model->mesh.dim; c++)
            seen[i] += scenery->axes[i][c] * x[c];
    return (uz_raster_point){.x = scenery->offset[0] + scenery->scale * seen[0],
                             .y = scenery->offset[1] - scenery->scale * seen[1],
                             .z = scenery->scale * seen[2]};
}

/* Where a node is; its place is that before the deformation plus `factor` times the displacement. */
static uz_raster_point place_node(const uz_scenery *scenery, int64_t node, double factor)
{
    const int dim = scenery->model->mesh.dim;
    double x[3] = {0, 0, 0};
    for (int c = 0; c < dim; c++)
        x[c] = scenery->model->mesh.xyz[node * dim + c] + factor * scenery->answer->u[node * dim + c];
    uz_raster_point point = place_point(scenery, x);
    const double range = scenery->high - scenery->low;
    point.value = range > 0 ? (scenery->value[node] - scenery->low) / range : 0.5;
    return point;
}

/* The largest distance that displacements closed, or opened, between what touches now. */
static double largest_closed_gap(const uz_body_model *model, const uz_field_source *answer)
{
    const int dim = model->mesh.dim;
    double largest = 0;
    for (int64_t i = 0; answer->r && i < model->m; i++) {
        if (!(answer->r[i] < 0))
            continue;
        const uz_contact_sites *sites = &model->sites[model->info.contact_of[i]];
        double gap = 0;
        if (sites->n > 0 && !model->place) {
            gap = sites->gap[model->row_place[i]];
        } else { /* before a plane; or the gap of the sites is not that before anything moved */
            const double *u = answer->u + model->info.contact_node[i] * dim;
            for (int c = 0; c < dim; c++)
                gap += model->info.contact_normal[i * dim + c] * u[c];
        }
        largest = fmax(largest, fabs(gap));
    }
    return largest;
}

double uz_show_factor(const uz_scene *scene, const uz_body_model *model, const uz_field_source *answer)
{
    const uz_mesh *mesh = &model->mesh;
    double largest = 0;
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++)
        largest = fmax(largest, fabs(answer->u[i]));
    if (!(largest > 0 && isfinite(0.06 * mesh->extent / largest)) || uz_is_finite_answer(scene))
        return 1; /* larger rotations are not small rotations times a number */
    /* What closed a gap would be drawn into the obstacle by the gap times the factor less one, what gave way to an
     * overlap away from it: up to what a line's width hides. */
    const double ideal =
        fmin(0.06 * mesh->extent / largest, 1 + UNSEEN * mesh->extent / largest_closed_gap(model, answer));
    /* A power of ten times 1, 2 or 5: a factor that reads well. */
    const double power = pow(10, floor(log10(ideal))), rest = ideal / power;
    return fmax(power * (rest < 2 ? 1 : rest < 5 ? 2 : 5), 1);
}

/* The eye's turn to the right and upwards, in degrees. */
static const struct {
    const char *name;
    double right, up;
} VIEWS[UZ_VIEWS] = {
    [UZ_VIEW_CORNER] = {"corner", 30, 25}, [UZ_VIEW_BELOW] = {"below", 30, -25}, [UZ_VIEW_FRONT] = {"front", 0, 0},
    [UZ_VIEW_BACK] = {"back", 180, 0},     [UZ_VIEW_LEFT] = {"left", -90, 0},    [UZ_VIEW_RIGHT] = {"right", 90, 0},
    [UZ_VIEW_TOP] = {"top", 0, 90},        [UZ_VIEW_BOTTOM] = {"bottom", 0, -90}};

bool uz_view_parse(uz_view *view, const char *name)
{
    for (int v = 0; v < UZ_VIEWS; v++)
        if (strcmp(VIEWS[v].name, name) == 0) {
            *view = (uz_view)v;
            return true;
        }
    return false;
}

/* The plane as it is. Of a solid the rows are of the frame with y upwards, in which z upwards has x, z, -y. */
static void set_axes(uz_scenery *scenery)
{
    static const double PLANE[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double a = VIEWS[scenery->view].right * 3.14159265358979 / 180;
    const double b = VIEWS[scenery->view].up * 3.14159265358979 / 180;
    const double solid[3][3] = {
        {cos(a), 0, -sin(a)}, {-sin(a) * sin(b), cos(b), -cos(a) * sin(b)}, {sin(a) * cos(b), sin(b), cos(a) * cos(b)}};
    memcpy(scenery->axes, scenery->model->mesh.dim == 2 ? PLANE : solid, sizeof scenery->axes);
    for (int i = 0; i < 3 && scenery->z_up && scenery->model->mesh.dim == 3; i++) {
        scenery->axes[i][1] = -solid[i][2];
        scenery->axes[i][2] = solid[i][1];
    }
}

uz_status uz_scenery_fit(uz_scenery *scenery, uz_error *err)
{
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    set_axes(scenery);
    scenery->extent = scenery->model->mesh.extent;
    if (!(scenery->factor > 0))
        scenery->factor = uz_show_factor(scenery->scene, scenery->model, scenery->answer);
    scenery->scale = 1;
    scenery->offset[0] = scenery->offset[1] = 0;
    /* where the nodes are before and after, in lengths */
    for (int64_t i = 0; i < 2 * scenery->model->mesh.n_nodes; i++) {
        const uz_raster_point p = place_node(scenery, i / 2, i % 2 ? scenery->factor : 0);
        const double at[2] = {p.x, -p.y};
        for (int c = 0; c < 2; c++) {
            low[c] = fmin(low[c], at[c]);
            high[c] = fmax(high[c], at[c]);
        }
    }
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

/* ---- the body as coloured triangles: the elements of a plane, the outer faces of a solid */

/* A convex polygon of corners with the middles of its edges, as a fan about its mean. */
static void paint_polygon(uz_raster *raster, const uz_raster_point *p, int n, double light)
{
    uz_raster_point mean = {0, 0, 0, 0};
    for (int k = 0; k < n; k++) {
        mean.x += p[k].x / n;
        mean.y += p[k].y / n;
        mean.z += p[k].z / n;
        mean.value += p[k].value / n;
    }
    for (int k = 0; k < n; k++) {
        const uz_raster_point triangle[3] = {p[k], p[(k + 1) % n], mean};
        uz_raster_triangle(raster, triangle, light);
    }
}

uz_status uz_scenery_paint(uz_raster *raster, const uz_scenery *scenery, const uz_skin *skin, const uz_hooks *hooks,
                           uz_error *err)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    if (mesh->dim == 3 && scenery->contacts_only)
        return UZ_OK;
    for (int64_t i = 0; i < skin->n_cells; i++) {
        if (i % 4096 == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the picture was drawn");
        const int64_t *around = skin->point + skin->first[i];
        const int n = (int)(skin->first[i + 1] - skin->first[i]);
        uz_raster_point p[UZ_CELL_POINTS];
        double area = 0, light = 1;
        for (int k = 0; k < n; k++)
            p[k] = place_node(scenery, around[k], scenery->factor);
        for (int k = 0; k < n; k++)
            area += p[k].x * p[(k + 1) % n].y - p[k].y * p[(k + 1) % n].x;
        if (mesh->dim == 3) {
            /* Faces that look away are hidden; those that look aside are darker. The pixels' y points down. */
            double size = 0;
            for (int k = 0; k < n; k++) {
                const uz_raster_point *a = &p[k], *b = &p[(k + 1) % n];
                size = fmax(size, hypot(hypot(b->x - a->x, b->y - a->y), b->z - a->z));
            }
            if (area >= 0)
                continue;
            light = 0.55 + 0.45 * fmin(1, -area / (2 * size * size));
        }
        paint_polygon(raster, p, n, light);
    }
    return UZ_OK;
}

uz_status uz_scenery_paint_contacts(uz_raster *raster, const uz_scenery *scenery, uz_error *err)
{
    enum { BAND = 7 }; /* pixels */
    const uz_body_model *model = scenery->model;
    for (int64_t k = 0; k < scenery->scene->n_contacts; k++) {
        uz_contact_input in;
        const uz_status status = uz_contact_input_of(&in, model, scenery->scene, k, err);
        if (status != UZ_OK)
            return status;
        for (int64_t f = 0; f < in.on->n_faces + (in.with ? in.with->n_faces : 0); f++) {
            uz_side side;
            uz_raster_point p[UZ_FACE_NODES];
            double xyz[3 * UZ_FACE_NODES], sum = 0;
            int64_t node[UZ_FACE_NODES];
            int known = 0;
            const uz_face face = f < in.on->n_faces ? in.on->face[f] : in.with->face[f - in.on->n_faces];
            uz_body_side(&side, xyz, node, model, face);
            /* Around the side: each middle follows the corner before it. A plane's side is a line. */
            const int n = side.nodes, corners = side.dim == 2 ? 2 : n % 4 == 0 ? 4 : 3;
            for (int j = 0; j < n; j++) {
                const int place = n == corners || j % 2 == 0 ? j / (n == corners ? 1 : 2) : corners + j / 2;
                p[j] = place_node(scenery, node[place], scenery->factor);
                sum += isnan(p[j].value) ? 0 : p[j].value;
                known += !isnan(p[j].value);
            }
            /* A node without a row, as one that a support holds, has what the others have. */
            for (int j = 0; j < n && known > 0; j++)
                if (isnan(p[j].value))
                    p[j].value = sum / known;
            if (known > 0 && side.dim == 3)
                paint_polygon(raster, p, n, 1);
            for (int j = 0; known > 0 && side.dim == 2 && j + 1 < n; j++) {
                /* The body is on the left of its side; the pixels' y points down. */
                const double dx = p[j + 1].x - p[j].x, dy = p[j + 1].y - p[j].y, length = hypot(dx, dy);
                uz_raster_point band[4] = {p[j], p[j + 1], p[j + 1], p[j]};
                for (int i = 0; i < 4; i++) {
                    band[i].x += i < 2 ? 0 : BAND * dy / length;
                    band[i].y -= i < 2 ? 0 : BAND * dx / length;
                    band[i].z += 1;
                }
                paint_polygon(raster, band, 4, 1);
            }
        }
    }
    return UZ_OK;
}

/* ---- obstacles of solids near the body, as grey surfaces */

enum { CELLS = 40 };

static void paint_triangle(uz_raster *raster, const uz_raster_point triangle[3])
{
    const uz_raster_point *o = &triangle[0], *p1 = &triangle[1], *p2 = &triangle[2];
    const double a[3] = {p1->x - o->x, p1->y - o->y, p1->z - o->z};
    const double b[3] = {p2->x - o->x, p2->y - o->y, p2->z - o->z};
    double n[3];
    uz_cross3(n, a, b);
    uz_make_unit3(n, (const double[3]){0, 0, 1});
    uz_raster_triangle(raster, triangle, 0.75 + 0.25 * fabs(n[2])); /* full where it faces the eye */
}

static void paint_triangles(uz_raster *raster, const uz_scenery *scenery, const uz_contact *contact)
{
    for (int64_t i = 0; i + 2 < contact->n_x; i += 3) {
        uz_raster_point at[3];
        for (int k = 0; k < 3; k++) {
            const double x[3] = {contact->x[i + k], contact->y[i + k], contact->z[i + k]};
            at[k] = place_point(scenery, x);
            at[k].value = NAN;
        }
        paint_triangle(raster, at);
    }
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
                at[k] = place_point(scenery, x);
                at[k].value = NAN;
            }
            for (int k = 0; k < 2; k++) {
                const uz_raster_point triangle[3] = {at[CORNER[k][0]], at[CORNER[k][1]], at[CORNER[k][2]]};
                paint_triangle(raster, triangle);
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
        if (shape->place)
            shape->place(&p);
        if (shape->surface)
            paint_patch(raster, scenery, &p);
        else
            paint_triangles(raster, scenery, p.contact);
        painted = true;
    }
    return painted;
}

/* ---- around the body: its outline before, obstacles of a plane, contact forces, the legend */

/* Grids of more elements than MOST_LINED, of solids four times as many, would hide their colours behind the lines. */
enum { MOST_LINED = 4000, MOST_OUTLINE = 20000, MOST_ARROWS = 80, ARROW = 55, TICK = 9 };

void uz_scenery_put_outline(uz_buffer *svg, const uz_scenery *scenery, const uz_skin_edges *edges)
{
    uz_buffer_print(svg, "<path class=\"before\" d=\"");
    for (int64_t i = 0; i < edges->n_outline && i < MOST_OUTLINE; i++) {
        const uz_raster_point a = place_node(scenery, edges->outline[2 * i], 0),
                              b = place_node(scenery, edges->outline[2 * i + 1], 0);
        uz_buffer_print(svg, "M%.1f %.1fL%.1f %.1f", a.x, a.y, b.x, b.y);
    }
    uz_buffer_print(svg, "\"/>\n");
}

/* Tenths of a pixel, in as few bytes as they need: there are thousands of them. */
static double tenths(double x)
{
    return round(10 * x) / 10 + 0.0;
}

static void put_line(uz_buffer *svg, const uz_raster_point *a, const uz_raster_point *b)
{
    const double x = tenths(a->x), y = tenths(a->y), along = tenths(b->x - x), down = tenths(b->y - y);
    if (fabs(along) + fabs(down) > 0.05) /* not the end alone of a line that is hidden */
        uz_buffer_print(svg, "M%.7g%s%.7gl%.7g%s%.7g", x, y < 0 ? "" : " ", y, along, down < 0 ? "" : " ", down);
}

/* What is seen of a line, tried every two pixels. */
static void put_seen(uz_buffer *svg, const uz_raster *body, const uz_raster_point *a, const uz_raster_point *b,
                     double lift)
{
    const double length = fmax(fabs(b->x - a->x), fabs(b->y - a->y));
    const int steps = length < 1e5 ? (int)ceil(length / 2) + 1 : 0;
    uz_raster_point from = *a, to = *a;
    bool seen = false;
    for (int i = 0; i <= steps && steps > 0; i++) {
        const double t = (double)i / steps;
        const uz_raster_point p = {a->x + t * (b->x - a->x), a->y + t * (b->y - a->y), a->z + t * (b->z - a->z), 0};
        const bool now = !uz_raster_hides_line(body, &p, lift);
        if (now && !seen)
            from = p;
        if (now)
            to = p;
        if (seen && (!now || i == steps))
            put_line(svg, &from, &to);
        seen = now;
    }
}

void uz_scenery_put_edges(uz_buffer *svg, const uz_scenery *scenery, const uz_skin_edges *edges, const uz_raster *body)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    const bool solid = mesh->dim == 3, some = solid && scenery->contacts_only;
    const double lift = solid ? 2 : 0.5; /* bands of contacts are 1 before a plane */
    uz_buffer_print(svg, "<path class=\"edge\" d=\"");
    for (int64_t i = 0; i < edges->n_lines && (some || mesh->n_elements <= (solid ? 4 : 1) * MOST_LINED); i++) {
        const int64_t *end = edges->line + 2 * i;
        const uz_raster_point a = place_node(scenery, end[0], scenery->factor),
                              b = place_node(scenery, end[1], scenery->factor);
        if (!some || !(isnan(a.value) || isnan(b.value)))
            put_seen(svg, body, &a, &b, lift);
    }
    for (int64_t i = 0; i < edges->n_outline && i < MOST_OUTLINE && some; i++) {
        const uz_raster_point a = place_node(scenery, edges->outline[2 * i], scenery->factor),
                              b = place_node(scenery, edges->outline[2 * i + 1], scenery->factor);
        put_seen(svg, body, &a, &b, lift);
    }
    uz_buffer_print(svg, "\"/>\n");
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

/* Each obstacle's outline, going on well beyond the picture at its ends. */
void uz_scenery_put_obstacles(uz_buffer *svg, const uz_scenery *scenery)
{
    const double far = 10 * scenery->extent;
    for (int64_t k = 0; scenery->model->mesh.dim == 2 && k < scenery->scene->n_contacts; k++) {
        const uz_contact *contact = &scenery->scene->contacts[k];
        const uz_obstacle_shape *shape = uz_obstacle_shape_of(contact->kind);
        border b = {.svg = svg};
        double at[2], way[2];
        if (!shape)
            continue;
        uz_buffer_print(svg, "<path class=\"obstacle\" d=\"");
        const int64_t n = shape->outline(at, way, contact, 0);
        if (n == 1) { /* a line: the part of it that is nearest to the middle of the picture */
            const uz_raster_point p = place_point(scenery, at);
            const double length = hypot(way[0], way[1]), reach = 2.0 * (scenery->width + scenery->height);
            const double dx = way[0] / length, dy = -way[1] / length;
            const double along = (0.5 * scenery->width - p.x) * dx + (0.5 * scenery->height - p.y) * dy;
            for (int side = -1; side <= 1; side += 2)
                border_to(&b, (uz_raster_point){.x = p.x + (along + side * reach / 2) * dx,
                                                .y = p.y + (along + side * reach / 2) * dy});
        }
        for (int64_t i = n == 1 ? n + 1 : -1; i <= n; i++) {
            const int64_t point = i < 0 ? 0 : i < n ? i : n - 1;
            shape->outline(at, way, contact, point);
            const double length = hypot(way[0], way[1]);
            if (point != i && !(length > 0))
                continue;
            for (int c = 0; point != i && c < 2; c++)
                at[c] += far * way[c] / length;
            border_to(&b, place_point(scenery, at));
        }
        uz_buffer_print(svg, "\"/><path class=\"ticks\" d=\"");
        uz_buffer_put(svg, b.ticks.data, b.ticks.len);
        svg->failed = svg->failed || b.ticks.failed;
        uz_buffer_drop(&b.ticks);
        uz_buffer_print(svg, "\"/>\n");
    }
}

/* As the scene calls it, behind this; nothing where it does not. */
static void put_unit(uz_buffer *svg, const char *before, const char *unit)
{
    if (!unit[0])
        return;
    uz_buffer_print(svg, "%s", before);
    uz_buffer_put_escaped(svg, unit);
}

/* Where the axes point, and how long a round length is, in the corner below: of a solid what stands across its view. */
void uz_scenery_put_axes(uz_buffer *svg, const uz_scenery *scenery)
{
    static const char *const NAMES[] = {"x", "y", "z"};
    enum { LENGTH = 22, LEAST_BAR = 48, LEFT = 30, BELOW = 14, DEPTH = 10 };
    const double x0 = LEFT, y0 = scenery->height - BELOW - (scenery->model->mesh.dim == 3 ? DEPTH : 0);
    const double length = uz_round_step(LEAST_BAR / scenery->scale);
    const double pixels = scenery->scale * length, from = x0 + 2 * LENGTH;
    for (int c = 0; c < scenery->model->mesh.dim; c++) {
        const double dx = LENGTH * scenery->axes[0][c], dy = -LENGTH * scenery->axes[1][c];
        uz_buffer_print(svg,
                        "<path class=\"axis\" d=\"M%.1f %.1fl%.1f %.1f\"/><text class=\"mark\" x=\"%.1f\" y=\"%.1f\" "
                        "text-anchor=\"middle\">%s</text>",
                        x0, y0, dx, dy, x0 + 1.45 * dx, y0 + 1.45 * dy + 4, NAMES[c]);
    }
    if (!(isfinite(length) && from + pixels < scenery->width))
        return;
    uz_buffer_print(svg,
                    "<path class=\"axis\" d=\"M%.1f %.1fv-6v3h%.1fv-3v6\"/><text class=\"mark\" x=\"%.1f\" y=\"%.1f\" "
                    "text-anchor=\"middle\">%.6g",
                    from, y0 + 3, pixels, from + 0.5 * pixels, y0 - 5, length);
    put_unit(svg, " ", scenery->scene->units.length);
    uz_buffer_print(svg, "</text>\n");
}

double uz_scenery_put_arrows(uz_buffer *svg, const uz_scenery *scenery, const uz_raster *body)
{
    const uz_mesh_info *info = &scenery->model->info;
    const int64_t m = scenery->model->m;
    const double largest = scenery->largest_push;
    int64_t pushing = 0, seen = 0;
    double longest = 0;
    for (int64_t i = 0; i < m; i++)
        pushing += scenery->pressure[i] > 0;
    if (!(largest > 0))
        return 0;
    const int64_t every = (pushing + MOST_ARROWS - 1) / MOST_ARROWS;
    uz_buffer_print(svg, "<path class=\"push\" d=\"");
    for (int64_t i = 0; i < m; i++) {
        if (!(scenery->pressure[i] > 0) || seen++ % every != 0)
            continue;
        /* Arrows follow the pressure and not the mesh. */
        const double length = ARROW * scenery->pressure[i] / largest, head = fmin(6, 0.4 * length);
        const double *n = info->contact_normal + i * info->dim;
        const uz_raster_point tip = place_node(scenery, info->contact_node[i], scenery->factor);
        double dx = 0, dy = 0, dz = 0;
        for (int c = 0; c < info->dim; c++) {
            dx += scenery->axes[0][c] * n[c];
            dy -= scenery->axes[1][c] * n[c];
            dz += scenery->axes[2][c] * n[c];
        }
        const uz_raster_point middle = {
            .x = tip.x - 0.5 * length * dx, .y = tip.y - 0.5 * length * dy, .z = tip.z - 0.5 * length * dz};
        if (body && uz_raster_hides(body, &middle, 2))
            continue;
        longest = fmax(longest, scenery->pressure[i]);
        uz_buffer_print(svg, "M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1fL%.1f %.1f", tip.x - length * dx,
                        tip.y - length * dy, tip.x, tip.y, tip.x - head * (dx + 0.5 * dy),
                        tip.y - head * (dy - 0.5 * dx), tip.x, tip.y, tip.x - head * (dx - 0.5 * dy),
                        tip.y - head * (dy + 0.5 * dx));
    }
    uz_buffer_print(svg, "\"/>\n");
    return longest;
}

/* Three digits, and all before the point. */
static void put_short(uz_buffer *svg, double x)
{
    uz_buffer_print(svg, fabs(x) >= 1000 && fabs(x) < 1e6 ? "%.0f" : "%.3g", x);
}

/* Round numbers below the colours, `bar` pixels from x on. */
static void put_ticks(uz_buffer *svg, const uz_scenery *scenery, int x, int y, int bar)
{
    enum { ROOM = 56, MOST = 8 }; /* pixels of a number */
    const double low = scenery->low, range = scenery->high - low;
    const double step = range > 0 ? uz_round_step(range * ROOM / bar) : 0, first = ceil(low / step - 1e-9);
    for (int i = 0; step > 0 && isfinite(first) && i < MOST && (first + i) * step <= scenery->high + 1e-9 * step; i++) {
        const double value = (first + i) * step, at = x + bar * fmin(1, fmax(0, (value - low) / range));
        uz_buffer_print(svg,
                        "<path class=\"axis\" d=\"M%.1f %dv4\"/><text x=\"%.1f\" y=\"%d\" "
                        "text-anchor=\"middle\">%.6g</text>",
                        at, y, at, y + 15, value);
    }
}

/* Too narrow for the words of the picture beside the bar: they stand below it. */
static bool is_narrow(const uz_scenery *scenery)
{
    return scenery->width < 420;
}

int uz_scenery_legend_height(const uz_scenery *scenery)
{
    return is_narrow(scenery) ? 112 : 64;
}

void uz_scenery_put_legend(uz_buffer *svg, const uz_scenery *scenery, const char *title)
{
    /* The words on the left take up to 160 pixels. */
    enum { LEFT = 180, MOST = 300, STOPS = 8, BAR = 12, BELOW = 48 };
    const bool narrow = is_narrow(scenery);
    const int room = scenery->width - 20 - (narrow ? 20 : LEFT), bar = room < MOST ? room : MOST;
    const int y = scenery->height + 12, x = scenery->width - bar - 20, words = y + (narrow ? BELOW : 0);
    const uz_units *units = &scenery->scene->units;
    uz_buffer_print(svg, "<defs><linearGradient id=\"scale\">");
    for (int i = 0; i <= STOPS; i++) {
        unsigned char rgb[3];
        uz_colour(rgb, (double)i / STOPS);
        uz_buffer_print(svg, "<stop offset=\"%g\" stop-color=\"#%02x%02x%02x\"/>", (double)i / STOPS, rgb[0], rgb[1],
                        rgb[2]);
    }
    uz_buffer_print(svg,
                    "</linearGradient></defs>\n<rect x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\" "
                    "fill=\"url(#scale)\"/>\n",
                    x, y, bar, BAR);
    put_ticks(svg, scenery, x, y + BAR, bar);
    uz_buffer_print(svg, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s", x + bar, y + 42, scenery->what);
    put_unit(svg, ", ", scenery->is_length ? units->length : units->stress);
    uz_buffer_print(svg, ": ");
    put_short(svg, scenery->low);
    uz_buffer_print(svg, " to ");
    put_short(svg, scenery->high);
    uz_buffer_print(svg, "</text>\n");
    uz_buffer_print(svg, "<text x=\"20\" y=\"%d\" class=\"title\">", words + 10);
    uz_buffer_put_escaped(svg, title ? title : "");
    uz_buffer_print(svg, "</text><text x=\"20\" y=\"%d\">displacements \u00d7 %.6g", words + 26, scenery->factor);
    if (scenery->longest_arrow > 0) {
        uz_buffer_print(svg, "</text><text x=\"20\" y=\"%d\">longest arrow: pressure ", words + 42);
        put_short(svg, scenery->longest_arrow);
        put_unit(svg, " ", units->stress);
    }
    uz_buffer_print(svg, "</text>\n");
}
