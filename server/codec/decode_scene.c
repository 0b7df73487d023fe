/* decode_scene.c: a scene: model, box, materials, supports, loads, obstacles. */
#include "codec/decode.h"
#include "codec/problem.h"
#include "codec/room.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double MAX_CELLS = 1e7; /* keeps a tiny request from asking for a mesh that fills the machine */

/* ---- mesh */

static bool decode_box(uz_scene *out, decoding *d, const json_value *box)
{
    const json_value *given = json_get(box, "cells");
    const int dim = uz_scene_dim(out);
    const bool automatic = json_is(given, JSON_IS_STRING);
    double cells[3] = {0}, count = 1;
    if (!decode_components(out->box.origin, d, box, "origin", 0, dim, NULL) ||
        !decode_components(out->box.size, d, box, "size", 0, dim, NULL) ||
        (!automatic && !decode_components(cells, d, box, "cells", 0, dim, NULL)) ||
        !decode_components(out->box.grading, d, box, "grading", 1, dim, NULL))
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
        if (!decode_group(to->on, d, json_get(item, "on"),
                          json_get(item, "traction") || json_get(item, "pressure") ? GROUP_OF_SIDES : GROUP_OF_ANY))
            return false;
        for (size_t k = 0; k < sizeof LOADS / sizeof LOADS[0]; k++) {
            if (!json_get(item, LOADS[k].key))
                continue;
            to->kind = LOADS[k].kind;
            to->value = LOADS[k].vector ? 0 : json_number(json_get(item, LOADS[k].key), 0);
            if (LOADS[k].vector && !decode_components(to->v, d, item, LOADS[k].key, 0, dim, NULL))
                return false;
        }
        to->has_point = json_get(item, "at") != NULL;
        if (to->has_point && !decode_components(to->point, d, item, "at", 0, dim, NULL))
            return false;
        if (json_get(item, "moment") &&
            !decode_components(to->moment + (dim == 2 ? 2 : 0), d, item, "moment", 0, dim == 2 ? 1 : 3, NULL))
            return false;
        if (node) {
            to->kind = UZ_LOAD_NODE_FORCE;
            to->node = node->number < 1e15 ? (int64_t)node->number : INT64_MAX; /* no mesh has that one */
        }
    }
    return loads != NULL;
}

/* ---- obstacles */

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

/* The file of a surface, its units and its place. */
static bool read_surface(const obstacle *o)
{
    static const char *const FORMATS[] = {"stl", "obj"}; /* names of readers (solver/io/triangles.h) */
    const double scale = json_number(json_get(o->shape, "scale"), 1);
    const bool flip = json_truth(json_get(o->shape, "flip"));
    double offset[3] = {0};
    uz_triangles read = {.n = 0};
    uz_error err = {.status = UZ_OK};
    decode_source file;
    if (o->dim == 3 && !decode_components(offset, o->d, o->shape, "offset", 0, 3, NULL))
        return false;
    size_t k = 0;
    while (k + 1 < sizeof FORMATS / sizeof FORMATS[0] && !json_get(o->shape, FORMATS[k]))
        k++;
    const json_value *value = json_get(o->shape, FORMATS[k]);
    if (!decode_source_open(&file, o->d, value))
        return false;
    const bool good =
        uz_triangles_read(&read, FORMATS[k], file.data, file.len, o->d->bound + 32 * file.len, &err) == UZ_OK;
    decode_source_close(&file);
    if (!good) {
        snprintf(err.where, sizeof err.where, "/surface/%s", FORMATS[k]);
        codec_problem_from_error(o->d->problem, &err, UZ_PROBLEM_SCENE);
        json_pointer(o->d->problem->pointer, sizeof o->d->problem->pointer, value);
        return false;
    }
    double *const x[3] = {read.x, read.y, read.z};
    for (int c = 0; c < 3; c++)
        for (int64_t i = 0; i < 3 * read.n; i++)
            x[c][i] = x[c][i] * scale + offset[c];
    for (int c = 0; c < 3 && flip; c++)
        for (int64_t i = 0; i < 3 * read.n; i += 3) {
            const double second = x[c][i + 1];
            x[c][i + 1] = x[c][i + 2];
            x[c][i + 2] = second;
        }
    o->to->n_x = 3 * read.n;
    o->to->x = read.x;
    o->to->y = read.y;
    o->to->z = read.z;
    if (uz_triangles_check(&read, json_truth(json_get(o->shape, "inside")), &err) == UZ_OK)
        return true;
    codec_problem_from_error(o->d->problem, &err, UZ_PROBLEM_SCENE);
    json_pointer(o->d->problem->pointer, sizeof o->d->problem->pointer, o->shape);
    return false;
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
    {"surface", UZ_OBSTACLE_SURFACE, NULL, NULL, NULL, read_surface},
};

/* A group, or several by which a surface is named. */
static bool decode_groups(char name[64], uz_names *groups, decoding *d, const json_value *item, const char *key)
{
    const json_value *value = json_get(item, key);
    if (!json_is(value, JSON_IS_ARRAY))
        return decode_group(name, d, value, GROUP_OF_SIDES);
    groups->name = decode_room(d, value, sizeof *groups->name, &groups->n);
    for (int64_t i = 0; groups->name && i < groups->n; i++)
        if (!decode_group(groups->name[i], d, &value->items[i], GROUP_OF_SIDES))
            return false;
    if (groups->name)
        uz_name_together(name, groups);
    return groups->name != NULL;
}

static bool decode_contacts(uz_scene *out, decoding *d, const json_value *list)
{
    bool finite = out->kinematics == UZ_KINEMATICS_FINITE; /* or may become so */
    for (int64_t i = 0; i < out->n_materials && out->kinematics == UZ_KINEMATICS_AUTO; i++)
        finite = finite || out->materials[i].law != UZ_ELASTIC_LINEAR;
    out->contacts = decode_room(d, list, sizeof *out->contacts, &out->n_contacts);
    for (int64_t i = 0; i < out->n_contacts; i++) {
        const json_value *item = &list->items[i], *given = json_get(item, "obstacle");
        uz_contact *to = &out->contacts[i];
        if (!decode_groups(to->on, &to->on_groups, d, item, "on") ||
            !decode_groups(to->with, &to->with_groups, d, item, "with"))
            return false;
        to->kind = UZ_OBSTACLE_BODY;
        to->between = json_text_is(json_get(item, "discretization"), "nodes") ? UZ_CONTACT_NODES : UZ_CONTACT_SURFACES;
        const json_value *smooth = json_get(item, "smooth");
        to->faceted = json_is(smooth, JSON_IS_BOOLEAN) ? !json_truth(smooth) : finite && !given;
        to->feature_angle = json_number(json_get(item, "feature_angle"), 0);
        for (size_t k = 0; k < sizeof SHAPES / sizeof SHAPES[0]; k++) {
            const obstacle o = {to, d, json_get(given, SHAPES[k].key), uz_scene_dim(out)};
            if (!o.shape)
                continue;
            to->kind = SHAPES[k].kind;
            to->radius = json_number(json_get(o.shape, "radius"), 0);
            to->inside = json_truth(json_get(o.shape, "inside"));
            if ((SHAPES[k].point && !decode_components(to->point, d, o.shape, SHAPES[k].point, 0, o.dim, NULL)) ||
                (SHAPES[k].direction &&
                 !decode_components(to->normal, d, o.shape, SHAPES[k].direction, 0, o.dim, SHAPES[k].what)) ||
                (SHAPES[k].read && !SHAPES[k].read(&o)))
                return false;
        }
    }
    return out->contacts != NULL;
}

static bool decode_ties(uz_scene *out, decoding *d, const json_value *list)
{
    if (!list)
        return true;
    out->ties = decode_room(d, list, sizeof *out->ties, &out->n_ties);
    for (int64_t i = 0; i < out->n_ties; i++) {
        uz_tie *to = &out->ties[i];
        const json_value *item = &list->items[i];
        if (!decode_group(to->on, d, json_get(item, "on"), GROUP_OF_SIDES) ||
            !decode_group(to->to, d, json_get(item, "to"), GROUP_OF_SIDES))
            return false;
        to->tolerance = json_number(json_get(item, "tolerance"), 0);
    }
    return out->ties != NULL;
}

/* ---- materials and supports */

enum { WORDS_MOST = 4 };
_Static_assert(UZ_ELASTICITIES == (int)WORDS_MOST, "each law has a word");

/* Which of the words it is, that are in the order of the library's enum; the first is the default. */
static int word_of(const json_value *value, const char *const words[WORDS_MOST])
{
    for (int i = 0; i < WORDS_MOST && words[i]; i++)
        if (json_text_is(value, words[i]))
            return i;
    return 0;
}

#define PER_DEGREE (3.14159265358979323846 / 180)

static bool decode_orthotropic(uz_orthotropic *to, decoding *d, const json_value *given)
{
    const json_value *axes = json_get(given, "axes"), *angle = json_get(given, "angle");
    if (!decode_components(to->young, d, given, "young", 0, 3, NULL) ||
        !decode_components(to->poisson, d, given, "poisson", 0, 3, NULL) ||
        !decode_components(to->shear, d, given, "shear", 0, 3, NULL) ||
        !decode_components(to->expansion, d, given, "expansion", 0, 3, NULL))
        return false;
    if (axes)
        return decode_components(to->axes[0], d, axes, "x", 0, 3, "it must be the direction of the material's x") &&
               decode_components(to->axes[1], d, axes, "y", 0, 3, "it must be the direction of the material's y");
    if (angle) {
        const double turn = PER_DEGREE * json_number(angle, 0), c = cos(turn), s = sin(turn);
        memcpy(to->axes, (double[2][3]){{c, s, 0}, {-s, c, 0}}, sizeof to->axes);
    }
    return true;
}

static bool decode_materials(uz_scene *out, decoding *d, const json_value *list)
{
    static const char *const LAWS[WORDS_MOST] = {"linear", "st_venant_kirchhoff", "neo_hooke", "neo_hooke_isochoric"};
    out->materials = decode_room(d, list, sizeof *out->materials, &out->n_materials);
    for (int64_t i = 0; i < out->n_materials; i++) {
        const json_value *item = &list->items[i], *orthotropic = json_get(item, "orthotropic");
        uz_material *to = &out->materials[i];
        if (!decode_group(to->on, d, json_get(item, "on"), GROUP_OF_ELEMENTS))
            return false;
        to->law = (uz_elasticity)word_of(json_get(item, "law"), LAWS);
        to->young = json_number(json_get(item, "young"), 0);
        to->poisson = json_number(json_get(item, "poisson"), 0);
        to->density = json_number(json_get(item, "density"), 0);
        to->expansion = json_number(json_get(item, "expansion"), 0);
        to->yield = json_number(json_get(item, "yield"), 0);
        to->is_orthotropic = orthotropic != NULL;
        if (orthotropic && !decode_orthotropic(&to->orthotropic, d, orthotropic))
            return false;
    }
    return out->materials != NULL;
}

/* Where no component is given all are held. */
static bool decode_rotation(uz_support *to, decoding *d, const json_value *given, int dim)
{
    const double angle = PER_DEGREE * json_number(json_get(given, "angle"), 0);
    const json_value *axis = json_get(given, "axis");
    double along[3] = {0, 0, 1}, length = 0;
    if (!decode_components(to->about, d, given, "about", 0, dim, NULL))
        return false;
    if (axis && !decode_components(along, d, given, "axis", 0, 3, "it must be the direction of the axis"))
        return false;
    for (int c = 0; c < 3; c++)
        length = hypot(length, along[c]);
    for (int c = 0; c < 3; c++)
        to->turn[c] = angle * (along[c] / length);
    bool any = false;
    for (int c = 0; c < dim; c++)
        any = any || !isnan(to->u[c]);
    for (int c = 0; c < dim && !any; c++)
        to->u[c] = 0;
    return true;
}

static bool decode_rigid(uz_support *to, decoding *d, const json_value *given, int dim)
{
    static const char *const MOTIONS[] = {"ux", "uy", "uz", "rx", "ry", "rz"};
    to->kind = UZ_SUPPORT_RIGID;
    for (int c = 0; c < 3; c++) {
        to->u[c] = json_number(json_get(given, MOTIONS[c]), (double)NAN);
        to->turn[c] = PER_DEGREE * json_number(json_get(given, MOTIONS[3 + c]), (double)NAN);
    }
    return decode_components(to->about, d, given, "point", 0, dim, NULL);
}

static bool decode_supports(uz_scene *out, decoding *d, const json_value *list)
{
    static const char *const COMPONENTS[] = {"ux", "uy", "uz"};
    const int dim = uz_scene_dim(out);
    out->supports = decode_room(d, list, sizeof *out->supports, &out->n_supports);
    for (int64_t i = 0; i < out->n_supports; i++) {
        const json_value *item = &list->items[i], *rotation = json_get(item, "rotation");
        uz_support *to = &out->supports[i];
        if (!decode_group(to->on, d, json_get(item, "on"), GROUP_OF_ANY))
            return false;
        for (int c = 0; c < 3; c++)
            to->u[c] = json_number(json_get(item, COMPONENTS[c]), (double)NAN);
        to->kind = UZ_SUPPORT_COMPONENTS;
        if (rotation && !decode_rotation(to, d, rotation, dim))
            return false;
        if (json_get(item, "rigid") && !decode_rigid(to, d, json_get(item, "rigid"), dim))
            return false;
        if (json_get(item, "normal")) {
            to->kind = UZ_SUPPORT_NORMAL;
            to->value = json_number(json_get(item, "u"), 0);
            if (!decode_components(to->normal, d, item, "normal", 0, dim, "it must be the direction that is held"))
                return false;
        } else if (json_get(item, "spring")) {
            to->kind = UZ_SUPPORT_SPRING;
            if (!decode_components(to->spring, d, item, "spring", 0, dim, NULL))
                return false;
        }
    }
    return out->supports != NULL;
}

/* The largest of the body's lengths along the axes. */
static double extent_of(const uz_scene *scene)
{
    const int dim = uz_scene_dim(scene);
    double most = 0;
    for (int c = 0; c < dim; c++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int64_t a = 0; a < scene->given.n_nodes && scene->source == UZ_MESH_GIVEN; a++) {
            low = fmin(low, scene->given.xyz[a * dim + c]);
            high = fmax(high, scene->given.xyz[a * dim + c]);
        }
        most = fmax(most, scene->source == UZ_MESH_GIVEN ? high - low : scene->box.size[c]);
    }
    return most;
}

/* Springs on all outer sides, along each axis a millionth as stiff as a bar of the body's material and size. */
static bool decode_stabilize(uz_scene *out, decoding *d, const json_value *value)
{
    const bool solid = out->model == UZ_SOLID, ring = out->model == UZ_AXISYMMETRIC;
    double young = 0;
    if (!json_truth(value))
        return true;
    uz_support *grown = room_grow(out->supports, (size_t)out->n_supports + 1, sizeof *grown);
    if (!grown) {
        problem_no_memory(d->problem);
        return false;
    }
    out->supports = grown;
    uz_support *to = memset(&grown[out->n_supports], 0, sizeof *grown);
    for (int64_t i = 0; i < out->n_materials; i++)
        for (int c = 0; c < 3; c++) {
            const uz_material *m = &out->materials[i];
            young = fmax(young, m->is_orthotropic ? m->orthotropic.young[c] : m->young);
        }
    out->stabilizer = 1e-6 * young * (solid || ring ? extent_of(out) : out->thickness);
    to->kind = UZ_SUPPORT_SPRING;
    for (int c = ring ? 1 : 0; c < (solid ? 3 : 2); c++)
        to->spring[c] = out->stabilizer;
    if (!decode_everywhere(to->on, d, value))
        return false;
    out->n_supports++;
    return true;
}

/* ---- the whole */

/* That of a stress follows from the others: a word that did not agree with them would be wrong beside every number. */
static bool decode_units(uz_units *out, decoding *d, const json_value *object)
{
    static const struct {
        const char *force, *length, *stress;
    } KNOWN[] = {{"N", "mm", "MPa"}, {"N", "m", "Pa"},    {"kN", "m", "kPa"},
                 {"MN", "m", "MPa"}, {"kN", "mm", "GPa"}, {"lbf", "in", "psi"}};
    const struct {
        const char *key;
        char *to;
        size_t room;
    } WORDS[] = {{"length", out->length, sizeof out->length}, {"force", out->force, sizeof out->force}};
    char word[64];
    if (!object)
        return true;
    for (size_t i = 0; i < sizeof WORDS / sizeof WORDS[0]; i++) {
        const json_value *value = json_get(object, WORDS[i].key);
        if (!decode_label(word, d, value, value->text, value->count, "The name of a unit"))
            return false;
        if (strlen(word) >= WORDS[i].room)
            return decode_refuse(d, "out_of_range", value, "is too long for the name of a unit: 31 bytes at most.");
        memcpy(WORDS[i].to, word, strlen(word) + 1);
    }
    snprintf(out->stress, sizeof out->stress, "%s/%s\u00b2", out->force, out->length);
    for (size_t i = 0; i < sizeof KNOWN / sizeof KNOWN[0]; i++)
        if (strcmp(KNOWN[i].force, out->force) == 0 && strcmp(KNOWN[i].length, out->length) == 0)
            snprintf(out->stress, sizeof out->stress, "%s", KNOWN[i].stress);
    return true;
}

bool decode_scene(uz_scene *out, decoding *d, const json_value *object)
{
    static const char *const MODELS[WORDS_MOST] = {"plane_stress", "plane_strain", "axisymmetric", "solid"};
    static const char *const FORMULATIONS[WORDS_MOST] = {"auto", "standard", "bbar", "incompatible_modes"};
    static const char *const KINEMATICS[WORDS_MOST] = {"auto", "fixed", "moving", "finite"};
    const json_value *mesh = json_get(object, "mesh"), *box = json_get(mesh, "box");
    out->model = (uz_model)word_of(json_get(object, "model"), MODELS);
    out->formulation = (uz_formulation)word_of(json_get(object, "formulation"), FORMULATIONS);
    /* small is another word for fixed, which is more than that: contact does not move either */
    out->kinematics = json_text_is(json_get(object, "kinematics"), "small")
                          ? UZ_KINEMATICS_FIXED
                          : (uz_kinematics)word_of(json_get(object, "kinematics"), KINEMATICS);
    out->thickness = json_number(json_get(object, "thickness"), 1);
    out->all_candidates = json_text_is(json_get(object, "candidates"), "all");
    if (!decode_units(&out->units, d, json_get(object, "units")))
        return false;
    if (box ? !decode_box(out, d, box) : !decode_mesh(out, d, mesh))
        return false;
    out->refine = json_get(mesh, "refine") != NULL; /* "auto" is all that it can be */
    d->scene = out;
    if (!decode_selections(out, d, json_get(object, "groups")))
        return false;
    return decode_materials(out, d, json_get(object, "materials")) &&
           decode_supports(out, d, json_get(object, "supports")) &&
           decode_stabilize(out, d, json_get(object, "stabilize")) &&
           decode_loads(&out->loads, &out->n_loads, d, json_get(object, "loads"), uz_scene_dim(out)) &&
           decode_ties(out, d, json_get(object, "ties")) && decode_contacts(out, d, json_get(object, "contacts"));
}
