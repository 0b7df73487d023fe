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

static bool read_plane(const obstacle *o)
{
    o->to->kind = UZ_OBSTACLE_PLANE;
    return decode_components(o->to->point, o->d, o->shape, "point", 0, o->dim) &&
           decode_direction(o->to->normal, o->d, o->shape, "normal", o->dim, "it must point out of the obstacle");
}

static bool read_round(const obstacle *o)
{
    o->to->kind = UZ_OBSTACLE_ROUND;
    o->to->radius = decode_number(o->shape, "radius", 0);
    o->to->inside = json_truth(json_get(o->shape, "inside"));
    return decode_components(o->to->point, o->d, o->shape, "center", 0, o->dim);
}

static bool read_cylinder(const obstacle *o)
{
    o->to->kind = UZ_OBSTACLE_CYLINDER;
    o->to->radius = decode_number(o->shape, "radius", 0);
    o->to->inside = json_truth(json_get(o->shape, "inside"));
    return decode_components(o->to->point, o->d, o->shape, "point", 0, o->dim) &&
           decode_direction(o->to->normal, o->d, o->shape, "axis", o->dim, "it must be the direction of the axis");
}

static bool read_polyline(const obstacle *o)
{
    const json_value *value = json_get(o->shape, "points");
    double *points = NULL;
    int64_t n = 0;
    int columns = 0;
    uz_contact *to = o->to;
    to->kind = UZ_OBSTACLE_POLYLINE;
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
    to->kind = UZ_OBSTACLE_HEIGHT;
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

static const struct {
    const char *key;
    bool (*read)(const obstacle *o);
} SHAPES[] = {{"plane", read_plane},       {"circle", read_round},      {"sphere", read_round},
              {"cylinder", read_cylinder}, {"polyline", read_polyline}, {"height", read_height}};

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
            if (o.shape && !SHAPES[k].read(&o))
                return false;
        }
    }
    return out->contacts != NULL;
}
