/* patches.c: obstacles of solids near the body, as grey surfaces. */
#include "picture/scenery.h"

#include <math.h>
#include <string.h>

enum { CELLS = 40 };
static const double REACH = 0.75; /* beyond the middle of the body, in sizes of it */
static const double PI = 3.14159265358979;

/* A piece of an obstacle's surface over s, t in [-1, 1]. */
typedef struct {
    const uz_contact *contact;
    double middle[3];        /* of the body */
    double size;             /* of the body */
    double foot[3];          /* plane: its point next to the middle; sphere: centre; cylinder: on the axis */
    double n[3], a[3], b[3]; /* from the foot to the body, and across */
    double most;             /* round ones: half the angle that is drawn */
} patch;

static double dot(const double x[3], const double y[3])
{
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

static void add(double out[3], double times, const double x[3])
{
    for (int c = 0; c < 3; c++)
        out[c] += times * x[c];
}

/* Length 1; what has none becomes `otherwise`. */
static void make_unit(double x[3], const double otherwise[3])
{
    const double length = hypot(hypot(x[0], x[1]), x[2]);
    for (int c = 0; c < 3; c++)
        x[c] = length > 0 ? x[c] / length : otherwise[c];
}

static void cross(double out[3], const double x[3], const double y[3])
{
    for (int c = 0; c < 3; c++)
        out[c] = x[(c + 1) % 3] * y[(c + 2) % 3] - x[(c + 2) % 3] * y[(c + 1) % 3];
}

/* a across n, b across both. */
static void turn_frame(patch *p)
{
    const double start[2][3] = {{0, 1, 0}, {1, 0, 0}};
    cross(p->a, start[fabs(p->n[1]) < 0.9 ? 0 : 1], p->n);
    make_unit(p->a, start[1]);
    cross(p->b, p->n, p->a);
}

static void place_plane(patch *p)
{
    double away[3];
    memcpy(p->n, p->contact->normal, sizeof p->n);
    make_unit(p->n, (const double[3]){0, 1, 0});
    for (int c = 0; c < 3; c++)
        away[c] = p->contact->point[c] - p->middle[c];
    memcpy(p->foot, p->middle, sizeof p->foot);
    add(p->foot, dot(away, p->n), p->n);
    turn_frame(p);
}

static void place_sphere(patch *p)
{
    memcpy(p->foot, p->contact->point, sizeof p->foot);
    for (int c = 0; c < 3; c++)
        p->n[c] = p->middle[c] - p->foot[c];
    make_unit(p->n, (const double[3]){0, -1, 0});
    turn_frame(p);
}

/* b is the axis. */
static void place_cylinder(patch *p)
{
    double away[3];
    memcpy(p->b, p->contact->normal, sizeof p->b);
    make_unit(p->b, (const double[3]){0, 0, 1});
    for (int c = 0; c < 3; c++)
        away[c] = p->middle[c] - p->contact->point[c];
    memcpy(p->foot, p->contact->point, sizeof p->foot);
    add(p->foot, dot(away, p->b), p->b);
    for (int c = 0; c < 3; c++)
        p->n[c] = p->middle[c] - p->foot[c];
    make_unit(p->n, (const double[3]){fabs(p->b[0]) < 0.9, fabs(p->b[0]) >= 0.9, 0});
    cross(p->a, p->b, p->n);
    make_unit(p->a, (const double[3]){0, 1, 0});
}

/* Where a value lies in an ascending list, which goes on flat: between i and i + 1, at *t of the way. */
static int64_t find_place(double *t, const double *list, int64_t n, double value)
{
    int64_t low = 0, high = n - 1;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (list[middle] <= value)
            low = middle;
        else
            high = middle;
    }
    *t = fmin(fmax((value - list[low]) / (list[low + 1] - list[low]), 0), 1);
    return low;
}

static double height_at(const uz_contact *c, double x, double y)
{
    double s, t;
    const int64_t i = find_place(&s, c->x, c->n_x, x), j = find_place(&t, c->y, c->n_y, y);
    const double *z = c->z + j * c->n_x + i;
    return (1 - t) * ((1 - s) * z[0] + s * z[1]) + t * ((1 - s) * z[c->n_x] + s * z[c->n_x + 1]);
}

static void place(patch *p)
{
    if (p->contact->kind == UZ_OBSTACLE_PLANE)
        place_plane(p);
    else if (p->contact->kind == UZ_OBSTACLE_ROUND)
        place_sphere(p);
    else if (p->contact->kind == UZ_OBSTACLE_CYLINDER)
        place_cylinder(p);
    p->most = fmin(PI, 1.5 * REACH * p->size / p->contact->radius);
}

static void patch_point(double x[3], const patch *p, double s, double t)
{
    const double reach = REACH * p->size, r = p->contact->radius;
    const double polar = p->contact->kind == UZ_OBSTACLE_ROUND ? 0.5 * (s + 1) * p->most : s * p->most;
    memcpy(x, p->foot, 3 * sizeof *x);
    if (p->contact->kind == UZ_OBSTACLE_PLANE) {
        add(x, s * reach, p->a);
        add(x, t * reach, p->b);
    } else if (p->contact->kind == UZ_OBSTACLE_ROUND) {
        add(x, r * cos(polar), p->n);
        add(x, r * sin(polar) * cos(PI * t), p->a);
        add(x, r * sin(polar) * sin(PI * t), p->b);
    } else if (p->contact->kind == UZ_OBSTACLE_CYLINDER) {
        add(x, r * cos(polar), p->n);
        add(x, r * sin(polar), p->a);
        add(x, t * reach, p->b);
    } else {
        x[0] = p->middle[0] + s * reach;
        x[1] = p->middle[1] + t * reach;
        x[2] = height_at(p->contact, x[0], x[1]);
    }
}

/* Full light where it faces the eye. */
static double light_on(const uz_raster_point p[3])
{
    const double a[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z},
                 b[3] = {p[2].x - p[0].x, p[2].y - p[0].y, p[2].z - p[0].z};
    double n[3];
    cross(n, a, b);
    make_unit(n, (const double[3]){0, 0, 1});
    return 0.75 + 0.25 * fabs(n[2]);
}

static void paint_patch(uz_raster *raster, const uz_scenery *scenery, const patch *p)
{
    for (int j = 0; j < CELLS; j++)
        for (int i = 0; i < CELLS; i++) {
            static const int CORNER[2][3] = {{0, 1, 3}, {0, 3, 2}};
            uz_raster_point at[4];
            for (int k = 0; k < 4; k++) {
                double x[3];
                const int to_the_right = k % 2, above = k / 2;
                patch_point(x, p, 2.0 * (i + to_the_right) / CELLS - 1, 2.0 * (j + above) / CELLS - 1);
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
    patch p;
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
        if (p.contact->kind == UZ_OBSTACLE_BODY)
            continue;
        place(&p);
        paint_patch(raster, scenery, &p);
        painted = true;
    }
    return painted;
}
