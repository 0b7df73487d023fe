/* decode_contacts.c: obstacles of a scene. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <stdlib.h>
#include <string.h>

/* One contact on its way; shape: the obstacle's. */
typedef struct {
    uz_contact *to;
    decoding *d;
    const json_value *shape;
    int dim;
} obstacle;

static bool read_polyline(const obstacle *o)
{
    const json_value *value = json_get(o->shape, "points");
    double *points = NULL;
    int64_t n = 0;
    int columns = 0;
    uz_contact *to = o->to;
    bool good = decode_points(&points, &n, &columns, o->d, value);
    if (good && columns != 2)
        good = decode_refuse(o->d, "size_mismatch", value, "must have points of 2 numbers.");
    if (good) {
        to->x = room_for((size_t)n, sizeof *to->x);
        to->y = room_for((size_t)n, sizeof *to->y);
        good = (to->x && to->y) || problem_no_memory(o->d->problem);
    }
    to->n_x = good ? n / 2 : 0;
    for (int64_t i = 0; i < to->n_x; i++) {
        to->x[i] = points[2 * i];
        to->y[i] = points[2 * i + 1];
    }
    free(points);
    return good;
}

/* z over x, or over x and y: then as many rows as y, of as many numbers as x. */
static bool read_height(const obstacle *o)
{
    const json_value *z = json_get(o->shape, "z"), *y = json_get(o->shape, "y");
    const char *wrong = NULL;
    uz_contact *to = o->to;
    int64_t n = 0;
    int columns = 0;
    if (!decode_vector(&to->x, &to->n_x, o->d, json_get(o->shape, "x")))
        return false;
    if (!y) {
        if (!decode_points(&to->z, &n, &columns, o->d, z))
            return false;
        if (columns != 0 || n != to->n_x)
            wrong = "must have one height for each x.";
        return !wrong || decode_refuse(o->d, "size_mismatch", z, "%s", wrong);
    }
    if (!decode_vector(&to->y, &to->n_y, o->d, y))
        return false;
    json_value room;
    if (json_item(z, 0, &room)->kind == JSON_IS_NUMBER)
        wrong = "must have rows of heights, one for each y.";
    else if ((int64_t)z->count != to->n_y)
        wrong = "must have as many rows as there are y.";
    else if (z->kind != JSON_IS_NUMBERS ||
             z->columns != to->n_x) /* in an array of anything the rows are not of one size */
        wrong = "must have rows of as many heights as there are x.";
    if (wrong)
        return decode_refuse(o->d, "size_mismatch", z, "%s", wrong);
    to->z = json_take_numbers(z);
    return to->z || problem_no_memory(o->d->problem);
}

/* A shape has a point, a direction (what: that is not zero) and a radius, or a reader of its own. */
static const struct {
    const char *key;
    uz_obstacle_kind kind;
    const char *point, *direction, *what;
    bool (*read)(const obstacle *o);
} SHAPES[] = {
    {"plane", UZ_OBSTACLE_PLANE, "point", "normal", "it must point out of the obstacle", NULL},
    {"circle", UZ_OBSTACLE_ROUND, "center", NULL, NULL, NULL},
    {"sphere", UZ_OBSTACLE_ROUND, "center", NULL, NULL, NULL},
    {"cylinder", UZ_OBSTACLE_CYLINDER, "point", "axis", "it must be the direction of the axis", NULL},
    {"polyline", UZ_OBSTACLE_POLYLINE, NULL, NULL, NULL, read_polyline},
    {"height", UZ_OBSTACLE_HEIGHT, NULL, NULL, NULL, read_height},
};

bool decode_contacts(uz_scene *out, decoding *d, const json_value *list)
{
    out->contacts = decode_room(d, list, sizeof *out->contacts, &out->n_contacts);
    for (int64_t i = 0; i < out->n_contacts; i++) {
        const json_value *item = &list->items[i], *given = json_get(item, "obstacle");
        uz_contact *to = &out->contacts[i];
        decode_name(to->on, sizeof to->on, item, "on", "");
        decode_name(to->with, sizeof to->with, item, "with", "");
        to->kind = UZ_OBSTACLE_BODY;
        to->between =
            json_text_is(json_get(item, "discretization"), "surfaces") ? UZ_CONTACT_SURFACES : UZ_CONTACT_NODES;
        to->faceted = json_is(json_get(item, "smooth"), JSON_IS_BOOLEAN) && !json_truth(json_get(item, "smooth"));
        to->feature_angle = decode_number(item, "feature_angle", 0);
        for (size_t k = 0; k < sizeof SHAPES / sizeof SHAPES[0]; k++) {
            const obstacle o = {to, d, json_get(given, SHAPES[k].key), uz_scene_dim(out)};
            if (!o.shape)
                continue;
            to->kind = SHAPES[k].kind;
            to->radius = decode_number(o.shape, "radius", 0);
            to->inside = json_truth(json_get(o.shape, "inside"));
            if ((SHAPES[k].point && !decode_components(to->point, d, o.shape, SHAPES[k].point, 0, o.dim)) ||
                (SHAPES[k].direction &&
                 !decode_direction(to->normal, d, o.shape, SHAPES[k].direction, o.dim, SHAPES[k].what)) ||
                (SHAPES[k].read && !SHAPES[k].read(&o)))
                return false;
        }
    }
    return out->contacts != NULL;
}
