#include "codec/decode.h"
#include "codec/problem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double MAX_CELLS = 1e7; /* keeps a tiny request from asking for a mesh that fills the machine */

/* Fills out[0..3) from a pair, 0 beyond it; an absent value leaves `otherwise` everywhere. */
static void get_vector(double out[3], const json_t *value, double otherwise)
{
    for (size_t i = 0; i < 3; i++)
        out[i] = value ? json_real_value(json_array_get(value, i)) : otherwise;
}

static void get_name(char *out, size_t size, const json_t *object, const char *key, const char *otherwise)
{
    const char *text = json_string_value(json_object_get(object, key));
    snprintf(out, size, "%s", text ? text : otherwise);
}

static bool decode_box(uz_box *out, const json_t *box, problem_details *problem)
{
    double cells[3];
    get_vector(out->origin, json_object_get(box, "origin"), 0);
    get_vector(out->size, json_object_get(box, "size"), 0);
    get_vector(cells, json_object_get(box, "cells"), 0);
    get_name(out->element, sizeof out->element, box, "element", "quad4");
    out->dim = 2;
    for (int i = 0; i < 3; i++)
        out->cells[i] = (int64_t)cells[i];
    if (cells[0] * cells[1] <= MAX_CELLS)
        return true;
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, here = {&mesh, "box", 3, 0};
    json_path path = {&here, "cells", 5, 0};
    problem_set(problem, 422, "out_of_range", &path,
                "/problem/mesh/box/cells makes %.15g cells; at most %.0f are allowed.", cells[0] * cells[1], MAX_CELLS);
    return false;
}

/* Room for the items of a list that may be absent. */
static void *make_room(const json_t *list, size_t size, int64_t *count, problem_details *problem)
{
    void *room = calloc(json_array_size(list) + 1, size);
    *count = room ? (int64_t)json_array_size(list) : 0;
    if (!room)
        problem_set(problem, 503, "out_of_memory", NULL, "There is not enough memory for this request now.");
    return room;
}

static bool decode_materials(uz_scene *out, const json_t *list, problem_details *problem)
{
    out->materials = make_room(list, sizeof *out->materials, &out->n_materials, problem);
    for (int64_t i = 0; i < out->n_materials; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        uz_material *to = &out->materials[i];
        get_name(to->on, sizeof to->on, item, "on", "");
        to->young = json_real_value(json_object_get(item, "young"));
        to->poisson = json_real_value(json_object_get(item, "poisson"));
    }
    return out->materials != NULL;
}

static bool decode_supports(uz_scene *out, const json_t *list, problem_details *problem)
{
    static const char *const KEYS[3] = {"ux", "uy", "uz"};
    out->supports = make_room(list, sizeof *out->supports, &out->n_supports, problem);
    for (int64_t i = 0; i < out->n_supports; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        uz_support *to = &out->supports[i];
        get_name(to->on, sizeof to->on, item, "on", "");
        for (int c = 0; c < 3; c++) {
            const json_t *u = json_object_get(item, KEYS[c]);
            to->u[c] = u ? json_real_value(u) : (double)NAN;
        }
    }
    return out->supports != NULL;
}

bool decode_loads(uz_load **out, int64_t *n, const json_t *list, problem_details *problem)
{
    uz_load *loads = make_room(list, sizeof *loads, n, problem);
    for (int64_t i = 0; i < *n; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        get_name(loads[i].on, sizeof loads[i].on, item, "on", "");
        get_vector(loads[i].v, json_object_get(item, "traction"), 0);
    }
    *out = loads;
    return loads != NULL;
}

static bool refuse_normal(size_t i, problem_details *problem)
{
    json_path top = {NULL, "problem", 7, 0}, list = {&top, "contacts", 8, 0}, item = {&list, NULL, 0, i};
    json_path obstacle = {&item, "obstacle", 8, 0}, plane = {&obstacle, "plane", 5, 0};
    json_path path = {&plane, "normal", 6, 0};
    problem_set(problem, 422, "out_of_range", &path,
                "/problem/contacts/%zu/obstacle/plane/normal is zero; it must point out of the obstacle.", i);
    return false;
}

static bool decode_contacts(uz_scene *out, const json_t *list, problem_details *problem)
{
    out->contacts = make_room(list, sizeof *out->contacts, &out->n_contacts, problem);
    for (int64_t i = 0; i < out->n_contacts; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        const json_t *plane = json_object_get(json_object_get(item, "obstacle"), "plane");
        uz_contact *to = &out->contacts[i];
        get_name(to->on, sizeof to->on, item, "on", "");
        get_vector(to->point, json_object_get(plane, "point"), 0);
        get_vector(to->normal, json_object_get(plane, "normal"), 0);
        if (to->normal[0] == 0 && to->normal[1] == 0)
            return refuse_normal((size_t)i, problem);
    }
    return out->contacts != NULL;
}

bool decode_scene(uz_scene *out, const json_t *object, problem_details *problem)
{
    const char *model = json_string_value(json_object_get(object, "model"));
    const json_t *thickness = json_object_get(object, "thickness");
    out->model = strcmp(model, "plane_strain") == 0 ? UZ_PLANE_STRAIN : UZ_PLANE_STRESS;
    out->thickness = thickness ? json_real_value(thickness) : 1;
    return decode_box(&out->box, json_object_get(json_object_get(object, "mesh"), "box"), problem) &&
           decode_materials(out, json_object_get(object, "materials"), problem) &&
           decode_supports(out, json_object_get(object, "supports"), problem) &&
           decode_loads(&out->loads, &out->n_loads, json_object_get(object, "loads"), problem) &&
           decode_contacts(out, json_object_get(object, "contacts"), problem);
}
