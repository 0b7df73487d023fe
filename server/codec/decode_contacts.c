/* decode_contacts.c: obstacles of a scene. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One contact on its way. */
typedef struct {
    uz_contact *to;
    json_doc *doc;
    int dim;
    size_t bound;
    const json_path *at; /* of the obstacle's shape */
    problem_details *problem;
} obstacle_reading;

static const char *pointer_of(char pointer[128], const obstacle_reading *r, const char *key)
{
    json_path at = {r->at, key, strlen(key), 0};
    json_path_write(pointer, 128, &at);
    return pointer;
}

static bool read_plane(const obstacle_reading *r, const json_t *shape)
{
    r->to->kind = UZ_OBSTACLE_PLANE;
    return decode_components(r->to->point, shape, "point", 0, r->dim, r->at, r->problem) &&
           decode_direction(r->to->normal, shape, "normal", r->dim, r->at, "it must point out of the obstacle",
                            r->problem);
}

static void read_radius(const obstacle_reading *r, const json_t *shape)
{
    r->to->radius = json_real_value(json_object_get(shape, "radius"));
    r->to->inside = json_is_true(json_object_get(shape, "inside"));
}

static bool read_round(const obstacle_reading *r, const json_t *shape)
{
    r->to->kind = UZ_OBSTACLE_ROUND;
    read_radius(r, shape);
    return decode_components(r->to->point, shape, "center", 0, r->dim, r->at, r->problem);
}

static bool read_cylinder(const obstacle_reading *r, const json_t *shape)
{
    r->to->kind = UZ_OBSTACLE_CYLINDER;
    read_radius(r, shape);
    return decode_components(r->to->point, shape, "point", 0, r->dim, r->at, r->problem) &&
           decode_direction(r->to->normal, shape, "axis", r->dim, r->at, "it must be the direction of the axis",
                            r->problem);
}

static bool refuse_rows(const obstacle_reading *r, const char *key, const char *what)
{
    char pointer[128];
    problem_set(r->problem, 422, "size_mismatch", NULL, "%s %s.", pointer_of(pointer, r, key), what);
    snprintf(r->problem->pointer, sizeof r->problem->pointer, "%s", pointer);
    return false;
}

static bool read_polyline(const obstacle_reading *r, const json_t *shape)
{
    char pointer[128];
    double *points = NULL;
    int64_t n = 0;
    int columns = 0;
    uz_contact *to = r->to;
    to->kind = UZ_OBSTACLE_POLYLINE;
    if (!decode_points(&points, &n, &columns, r->doc, json_object_get(shape, "points"), r->bound,
                       pointer_of(pointer, r, "points"), r->problem)) {
        free(points);
        return false;
    }
    to->x = room_for((size_t)n, sizeof *to->x);
    to->y = room_for((size_t)n, sizeof *to->y);
    const bool good = columns == 2 && to->x && to->y;
    to->n_x = good ? n / 2 : 0;
    for (int64_t i = 0; i < to->n_x; i++) {
        to->x[i] = points[2 * i];
        to->y[i] = points[2 * i + 1];
    }
    free(points);
    if (columns != 2)
        return refuse_rows(r, "points", "must have points of 2 numbers");
    return good || decode_no_memory(r->problem);
}

/* Heights in rows that are too long to be a table: each is an array of its own. */
static bool read_height_rows(const obstacle_reading *r, const json_t *rows)
{
    char pointer[128];
    uz_contact *to = r->to;
    size_t i;
    json_t *row;
    to->z = room_for((size_t)to->n_y, (size_t)to->n_x * sizeof *to->z);
    if (!to->z)
        return decode_no_memory(r->problem);
    json_array_foreach(rows, i, row)
    {
        double *values = NULL;
        int64_t n = 0;
        bool good = decode_vector(&values, &n, r->doc, row, r->bound, pointer_of(pointer, r, "z"), r->problem);
        if (good && n == to->n_x)
            memcpy(to->z + (int64_t)i * n, values, (size_t)n * sizeof *values);
        free(values);
        if (!good)
            return false;
        if (n != to->n_x)
            return refuse_rows(r, "z", "must have rows of as many heights as there are x");
    }
    return true;
}

/* z over x and y: as many rows as y, of as many numbers as x. */
static bool read_heights(const obstacle_reading *r, const json_t *z)
{
    uz_contact *to = r->to;
    json_lifted *lifted = json_doc_lifted(r->doc, z);
    const int64_t rows = lifted ? lifted->count : (int64_t)json_array_size(z);
    if ((lifted && lifted->columns == 0) || (!lifted && json_is_real(json_array_get(z, 0))))
        return refuse_rows(r, "z", "must have rows of heights, one for each y");
    if (rows != to->n_y)
        return refuse_rows(r, "z", "must have as many rows as there are y");
    if (!lifted)
        return read_height_rows(r, z);
    if (lifted->columns != to->n_x)
        return refuse_rows(r, "z", "must have rows of as many heights as there are x");
    to->z = lifted->numbers;
    lifted->numbers = NULL;
    return true;
}

static bool read_height(const obstacle_reading *r, const json_t *shape)
{
    char pointer[128];
    uz_contact *to = r->to;
    int64_t n = 0;
    int columns = 0;
    const json_t *z = json_object_get(shape, "z"), *y = json_object_get(shape, "y");
    to->kind = UZ_OBSTACLE_HEIGHT;
    if (!decode_vector(&to->x, &to->n_x, r->doc, json_object_get(shape, "x"), r->bound, pointer_of(pointer, r, "x"),
                       r->problem))
        return false;
    if (y)
        return decode_vector(&to->y, &to->n_y, r->doc, y, r->bound, pointer_of(pointer, r, "y"), r->problem) &&
               read_heights(r, z);
    if (!decode_points(&to->z, &n, &columns, r->doc, z, r->bound, pointer_of(pointer, r, "z"), r->problem))
        return false;
    return (columns == 0 && n == to->n_x) || refuse_rows(r, "z", "must have one height for each x");
}

static const struct {
    const char *key;
    bool (*read)(const obstacle_reading *r, const json_t *shape);
} SHAPES[] = {{"plane", read_plane},       {"circle", read_round},      {"sphere", read_round},
              {"cylinder", read_cylinder}, {"polyline", read_polyline}, {"height", read_height}};

static bool decode_contact(const obstacle_reading *r, const json_t *item, const json_path *item_at)
{
    const json_t *obstacle = json_object_get(item, "obstacle");
    json_path at = {item_at, "obstacle", 8, 0};
    decode_name(r->to->on, sizeof r->to->on, item, "on", "");
    decode_name(r->to->with, sizeof r->to->with, item, "with", "");
    r->to->kind = UZ_OBSTACLE_BODY;
    for (size_t k = 0; k < sizeof SHAPES / sizeof SHAPES[0]; k++) {
        const json_t *shape = json_object_get(obstacle, SHAPES[k].key);
        json_path shape_at = {&at, SHAPES[k].key, strlen(SHAPES[k].key), 0};
        obstacle_reading here = *r;
        here.at = &shape_at;
        if (shape)
            return SHAPES[k].read(&here, shape);
    }
    return true;
}

bool decode_contacts(uz_scene *out, json_doc *doc, const json_t *list, size_t body_len, problem_details *problem)
{
    json_path top = {NULL, "problem", 7, 0}, here = {&top, "contacts", 8, 0};
    obstacle_reading r = {NULL, doc, uz_scene_dim(out), decode_memory_bound(body_len), NULL, problem};
    out->contacts = decode_room(list, sizeof *out->contacts, &out->n_contacts, problem);
    for (int64_t i = 0; i < out->n_contacts; i++) {
        json_path at = {&here, NULL, 0, (size_t)i};
        r.to = &out->contacts[i];
        if (!decode_contact(&r, json_array_get(list, (size_t)i), &at))
            return false;
    }
    return out->contacts != NULL;
}
