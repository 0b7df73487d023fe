/* decode_scene.c: model, box, materials, supports and loads of a scene. */
#include "codec/decode.h"
#include "codec/problem.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double MAX_CELLS = 1e7; /* keeps a tiny request from asking for a mesh that fills the machine */

/* ---- pieces */

void decode_name(char *out, size_t size, const json_t *object, const char *key, const char *otherwise)
{
    const json_t *value = json_object_get(object, key);
    const char *text = value ? json_string_value(value) : otherwise;
    const size_t len = text ? strlen(text) : size;
    const bool whole = len < size && (!value || json_string_length(value) == len);
    memcpy(out, whole ? text : "", whole ? len + 1 : 1);
}

void *decode_room(const json_t *list, size_t size, int64_t *count, problem_details *problem)
{
    void *room = calloc(json_array_size(list) + 1, size);
    *count = room ? (int64_t)json_array_size(list) : 0;
    if (!room)
        decode_no_memory(problem);
    return room;
}

static bool refuse_length(const json_path *at, size_t have, int dim, problem_details *problem)
{
    problem_set(problem, 422, "out_of_range", at, "A vector must have %d numbers here, not %zu: the model is %s.", dim,
                have, dim == 3 ? "solid" : "one in the plane");
    return false;
}

bool decode_components(double out[3], const json_t *object, const char *key, double otherwise, int dim,
                       const json_path *object_at, problem_details *problem)
{
    const json_t *value = json_object_get(object, key);
    json_path at = {object_at, key, strlen(key), 0};
    if (value && json_array_size(value) != (size_t)dim)
        return refuse_length(&at, json_array_size(value), dim, problem);
    for (int i = 0; i < 3; i++) {
        const double given = value ? json_real_value(json_array_get(value, (size_t)i)) : otherwise;
        out[i] = i < dim ? given : 0;
    }
    return true;
}

bool decode_direction(double out[3], const json_t *object, const char *key, int dim, const json_path *object_at,
                      const char *what, problem_details *problem)
{
    json_path at = {object_at, key, strlen(key), 0};
    char pointer[128];
    if (!decode_components(out, object, key, 0, dim, object_at, problem))
        return false;
    if (out[0] != 0 || out[1] != 0 || out[2] != 0)
        return true;
    json_path_write(pointer, sizeof pointer, &at);
    problem_set(problem, 422, "out_of_range", &at, "%s is zero; %s.", pointer, what);
    return false;
}

static double get_number(const json_t *object, const char *key, double otherwise)
{
    const json_t *value = json_object_get(object, key);
    return value ? json_real_value(value) : otherwise;
}

/* ---- mesh */

static bool decode_box(uz_scene *out, const json_t *box, problem_details *problem)
{
    json_path top = {NULL, "problem", 7, 0}, mesh = {&top, "mesh", 4, 0}, here = {&mesh, "box", 3, 0};
    json_path path = {&here, "cells", 5, 0};
    const int dim = uz_scene_dim(out);
    const bool automatic = json_is_string(json_object_get(box, "cells"));
    double cells[3] = {0}, count = 1;
    if (!decode_components(out->box.origin, box, "origin", 0, dim, &here, problem) ||
        !decode_components(out->box.size, box, "size", 0, dim, &here, problem) ||
        (!automatic && !decode_components(cells, box, "cells", 0, dim, &here, problem)) ||
        !decode_components(out->box.grading, box, "grading", 1, dim, &here, problem))
        return false;
    decode_name(out->box.element, sizeof out->box.element, box, "element", dim == 3 ? "hex8" : "quad4");
    out->source = UZ_MESH_BOX;
    out->box.dim = dim;
    out->box.automatic = automatic;
    for (int i = 0; i < 3; i++) {
        out->box.cells[i] = (int64_t)cells[i];
        count *= i < dim ? cells[i] : 1;
    }
    if (count <= MAX_CELLS)
        return true;
    problem_set(problem, 422, "out_of_range", &path,
                "/problem/mesh/box/cells makes %.15g cells; at most %.0f are allowed.", count, MAX_CELLS);
    return false;
}

/* ---- lists */

static bool decode_materials(uz_scene *out, const json_t *list, problem_details *problem)
{
    out->materials = decode_room(list, sizeof *out->materials, &out->n_materials, problem);
    for (int64_t i = 0; i < out->n_materials; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        uz_material *to = &out->materials[i];
        decode_name(to->on, sizeof to->on, item, "on", "");
        to->young = get_number(item, "young", 0);
        to->poisson = get_number(item, "poisson", 0);
        to->density = get_number(item, "density", 0);
        to->expansion = get_number(item, "expansion", 0);
    }
    return out->materials != NULL;
}

static bool decode_support(uz_support *to, const json_t *item, int dim, const json_path *at, problem_details *problem)
{
    static const char *const KEYS[3] = {"ux", "uy", "uz"};
    decode_name(to->on, sizeof to->on, item, "on", "");
    for (int c = 0; c < 3; c++)
        to->u[c] = get_number(item, KEYS[c], (double)NAN);
    if (json_object_get(item, "normal")) {
        to->kind = UZ_SUPPORT_NORMAL;
        to->value = get_number(item, "u", 0);
        return decode_direction(to->normal, item, "normal", dim, at, "it must be the direction that is held", problem);
    }
    if (json_object_get(item, "spring")) {
        to->kind = UZ_SUPPORT_SPRING;
        return decode_components(to->spring, item, "spring", 0, dim, at, problem);
    }
    to->kind = UZ_SUPPORT_COMPONENTS;
    return true;
}

static bool decode_supports(uz_scene *out, const json_t *list, problem_details *problem)
{
    json_path top = {NULL, "problem", 7, 0}, here = {&top, "supports", 8, 0};
    out->supports = decode_room(list, sizeof *out->supports, &out->n_supports, problem);
    for (int64_t i = 0; i < out->n_supports; i++) {
        json_path at = {&here, NULL, 0, (size_t)i};
        if (!decode_support(&out->supports[i], json_array_get(list, (size_t)i), uz_scene_dim(out), &at, problem))
            return false;
    }
    return out->supports != NULL;
}

/* ---- loads */

static const struct {
    const char *key;
    uz_load_kind kind;
    bool vector;
} LOADS[] = {{"traction", UZ_LOAD_TRACTION, true}, {"pressure", UZ_LOAD_PRESSURE, false},
             {"force", UZ_LOAD_FORCE, true},       {"body_force", UZ_LOAD_BODY_FORCE, true},
             {"gravity", UZ_LOAD_GRAVITY, true},   {"temperature", UZ_LOAD_TEMPERATURE, false}};

static bool decode_load(uz_load *to, const json_t *item, int dim, const json_path *at, problem_details *problem)
{
    const json_t *node = json_object_get(item, "node");
    decode_name(to->on, sizeof to->on, item, "on", "");
    for (size_t k = 0; k < sizeof LOADS / sizeof LOADS[0]; k++) {
        if (!json_object_get(item, LOADS[k].key))
            continue;
        to->kind = LOADS[k].kind;
        to->value = LOADS[k].vector ? 0 : get_number(item, LOADS[k].key, 0);
        if (LOADS[k].vector && !decode_components(to->v, item, LOADS[k].key, 0, dim, at, problem))
            return false;
    }
    if (node) {
        const double number = json_real_value(node);
        to->kind = UZ_LOAD_NODE_FORCE;
        to->node = number < 1e15 ? (int64_t)number : INT64_MAX; /* no mesh has that one */
    }
    return true;
}

bool decode_loads(uz_load **out, int64_t *n, const json_t *list, int dim, const json_path *list_at,
                  problem_details *problem)
{
    bool good = true;
    uz_load *loads = decode_room(list, sizeof *loads, n, problem);
    for (int64_t i = 0; i < *n && good; i++) {
        json_path at = {list_at, NULL, 0, (size_t)i};
        good = decode_load(&loads[i], json_array_get(list, (size_t)i), dim, &at, problem);
    }
    *out = loads;
    return loads != NULL && good;
}

/* ---- the whole */

static uz_model model_of(const char *name)
{
    static const char *const NAMES[] = {"plane_stress", "plane_strain", "axisymmetric", "solid"};
    for (size_t i = 0; i < sizeof NAMES / sizeof NAMES[0]; i++)
        if (strcmp(name, NAMES[i]) == 0)
            return (uz_model)i;
    return UZ_PLANE_STRESS;
}

static uz_formulation formulation_of(const json_t *object)
{
    static const char *const NAMES[] = {"auto", "standard", "bbar", "incompatible_modes"};
    const char *name = json_string_value(json_object_get(object, "formulation"));
    for (size_t i = 0; name && i < sizeof NAMES / sizeof NAMES[0]; i++)
        if (strcmp(name, NAMES[i]) == 0)
            return (uz_formulation)i;
    return UZ_FORMULATION_AUTO;
}

bool decode_scene(uz_scene *out, json_doc *doc, const json_t *object, size_t body_len, problem_details *problem)
{
    const json_t *mesh = json_object_get(object, "mesh"), *box = json_object_get(mesh, "box");
    const char *candidates = json_string_value(json_object_get(object, "candidates"));
    json_path top = {NULL, "problem", 7, 0}, loads = {&top, "loads", 5, 0};
    out->model = model_of(json_string_value(json_object_get(object, "model")));
    out->formulation = formulation_of(object);
    out->thickness = get_number(object, "thickness", 1);
    out->all_candidates = candidates && strcmp(candidates, "all") == 0;
    return (box ? decode_box(out, box, problem) : decode_mesh(out, doc, mesh, body_len, problem)) &&
           decode_materials(out, json_object_get(object, "materials"), problem) &&
           decode_supports(out, json_object_get(object, "supports"), problem) &&
           decode_loads(&out->loads, &out->n_loads, json_object_get(object, "loads"), uz_scene_dim(out), &loads,
                        problem) &&
           decode_contacts(out, doc, json_object_get(object, "contacts"), body_len, problem);
}
