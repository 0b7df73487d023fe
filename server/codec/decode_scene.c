/* decode_scene.c: model, box, materials, supports and loads of a scene. */
#include "codec/decode.h"
#include "codec/problem.h"

#include <math.h>
#include <string.h>

static const double MAX_CELLS = 1e7; /* keeps a tiny request from asking for a mesh that fills the machine */

/* The place of a word among names; 0, the default, where there is none. */
static int word_of(const json_value *object, const char *key, const char *const *names, int count)
{
    const json_value *word = json_get(object, key);
    for (int i = 0; i < count; i++)
        if (json_text_is(word, names[i]))
            return i;
    return 0;
}

/* ---- mesh */

static bool decode_box(uz_scene *out, decoding *d, const json_value *box)
{
    const json_value *given = json_get(box, "cells");
    const int dim = uz_scene_dim(out);
    const bool automatic = json_is(given, JSON_IS_STRING);
    double cells[3] = {0}, count = 1;
    if (!decode_components(out->box.origin, d, box, "origin", 0, dim) ||
        !decode_components(out->box.size, d, box, "size", 0, dim) ||
        (!automatic && !decode_components(cells, d, box, "cells", 0, dim)) ||
        !decode_components(out->box.grading, d, box, "grading", 1, dim))
        return false;
    decode_name(out->box.element, sizeof out->box.element, box, "element", dim == 3 ? "hex8" : "quad4");
    out->source = UZ_MESH_BOX;
    out->box.dim = dim;
    out->box.automatic = automatic;
    for (int i = 0; i < 3; i++) {
        out->box.cells[i] = (int64_t)cells[i];
        count *= i < dim ? cells[i] : 1;
    }
    return count <= MAX_CELLS ||
           decode_refuse(d, "out_of_range", given, "makes %.15g cells; at most %.0f are allowed.", count, MAX_CELLS);
}

/* ---- lists */

static bool decode_supports(uz_scene *out, decoding *d, const json_value *list)
{
    static const char *const KEYS[3] = {"ux", "uy", "uz"};
    const int dim = uz_scene_dim(out);
    bool good = true;
    out->supports = decode_room(d, list, sizeof *out->supports, &out->n_supports);
    for (int64_t i = 0; i < out->n_supports && good; i++) {
        const json_value *item = &list->items[i];
        uz_support *to = &out->supports[i];
        decode_name(to->on, sizeof to->on, item, "on", "");
        for (int c = 0; c < 3; c++)
            to->u[c] = decode_number(item, KEYS[c], (double)NAN);
        to->kind = UZ_SUPPORT_COMPONENTS;
        if (json_get(item, "normal")) {
            to->kind = UZ_SUPPORT_NORMAL;
            to->value = decode_number(item, "u", 0);
            good = decode_direction(to->normal, d, item, "normal", dim, "it must be the direction that is held");
        } else if (json_get(item, "spring")) {
            to->kind = UZ_SUPPORT_SPRING;
            good = decode_components(to->spring, d, item, "spring", 0, dim);
        }
    }
    return out->supports && good;
}

bool decode_loads(uz_load **out, int64_t *n, decoding *d, const json_value *list, int dim)
{
    static const struct {
        const char *key;
        uz_load_kind kind;
        bool vector;
    } LOADS[] = {{"traction", UZ_LOAD_TRACTION, true}, {"pressure", UZ_LOAD_PRESSURE, false},
                 {"force", UZ_LOAD_FORCE, true},       {"body_force", UZ_LOAD_BODY_FORCE, true},
                 {"gravity", UZ_LOAD_GRAVITY, true},   {"temperature", UZ_LOAD_TEMPERATURE, false}};
    uz_load *loads = *out = decode_room(d, list, sizeof *loads, n);
    for (int64_t i = 0; i < *n; i++) {
        const json_value *item = &list->items[i], *node = json_get(item, "node");
        uz_load *to = &loads[i];
        decode_name(to->on, sizeof to->on, item, "on", "");
        for (size_t k = 0; k < sizeof LOADS / sizeof LOADS[0]; k++) {
            if (!json_get(item, LOADS[k].key))
                continue;
            to->kind = LOADS[k].kind;
            to->value = LOADS[k].vector ? 0 : decode_number(item, LOADS[k].key, 0);
            if (LOADS[k].vector && !decode_components(to->v, d, item, LOADS[k].key, 0, dim))
                return false;
        }
        if (node) {
            to->kind = UZ_LOAD_NODE_FORCE;
            to->node = node->number < 1e15 ? (int64_t)node->number : INT64_MAX; /* no mesh has that one */
        }
    }
    return loads != NULL;
}

/* ---- the whole */

bool decode_scene(uz_scene *out, decoding *d, const json_value *object)
{
    static const char *const MODELS[] = {"plane_stress", "plane_strain", "axisymmetric", "solid"};
    static const char *const FORMULATIONS[] = {"auto", "standard", "bbar", "incompatible_modes"};
    const json_value *mesh = json_get(object, "mesh"), *box = json_get(mesh, "box");
    const json_value *materials = json_get(object, "materials");
    out->model = (uz_model)word_of(object, "model", MODELS, 4);
    out->formulation = (uz_formulation)word_of(object, "formulation", FORMULATIONS, 4);
    out->thickness = decode_number(object, "thickness", 1);
    out->all_candidates = json_text_is(json_get(object, "candidates"), "all");
    if (box ? !decode_box(out, d, box) : !decode_mesh(out, d, mesh))
        return false;
    out->materials = decode_room(d, materials, sizeof *out->materials, &out->n_materials);
    for (int64_t i = 0; i < out->n_materials; i++) {
        const json_value *item = &materials->items[i];
        uz_material *to = &out->materials[i];
        decode_name(to->on, sizeof to->on, item, "on", "");
        to->young = decode_number(item, "young", 0);
        to->poisson = decode_number(item, "poisson", 0);
        to->density = decode_number(item, "density", 0);
        to->expansion = decode_number(item, "expansion", 0);
    }
    return out->materials && decode_supports(out, d, json_get(object, "supports")) &&
           decode_loads(&out->loads, &out->n_loads, d, json_get(object, "loads"), uz_scene_dim(out)) &&
           decode_contacts(out, d, json_get(object, "contacts"));
}
