/* random_scene.h: small scenes of everything at once, each from its seed. All are given meshes, so that every part of
 * them can be moved. */
#ifndef TESTS_RANDOM_SCENE_H
#define TESTS_RANDOM_SCENE_H

#include "generated.h"
#include "scene/mesh.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SCENE_MOST_ITEMS = 24, SCENE_MOST_GROUPS = 16 };

/* What may be asked of the scene. */
typedef struct {
    uz_scene scene;
    qp_random rng;
    int bodies;
    bool turnable;  /* it may be turned: nothing in it is along the axes by its kind */
    bool hot;       /* a load is a temperature */
    double stiffer; /* of the second body, over the first */
} random_scene;

static inline void *scene_room(int64_t count, size_t size)
{
    void *room = calloc((size_t)count + 1, size);
    if (!room)
        abort();
    return room;
}

/* ------------------------------------------------------------------ mesh */

static inline void *grow(void *old, int64_t count, size_t size)
{
    void *room = realloc(old, ((size_t)count + 1) * size);
    if (!room)
        abort();
    return room;
}

static inline void append_element(uz_given_mesh *g, uz_element_kind kind, const int64_t *node, int count, int64_t shift)
{
    const int64_t e = g->n_elements++, at = g->first[e];
    g->kind = grow(g->kind, g->n_elements, sizeof *g->kind);
    g->first = grow(g->first, g->n_elements + 1, sizeof *g->first);
    g->node = grow(g->node, at + count, sizeof *g->node);
    g->kind[e] = (unsigned char)kind;
    for (int a = 0; a < count; a++)
        g->node[at + a] = node[a] + shift;
    g->first[e + 1] = at + count;
}

static inline uz_given_group *new_group(uz_given_mesh *g, const char *body, const char *name)
{
    uz_given_group *group = &g->groups[g->n_groups++];
    snprintf(group->name, sizeof group->name, "%s%s", body, name);
    return group;
}

static inline void append_faces(uz_given_mesh *g, const uz_mesh *box, const uz_group *side, const char *body,
                                int64_t shift)
{
    uz_given_group *group = new_group(g, body, side->name);
    int64_t entries = 0, node[UZ_FACE_NODES];
    group->n_faces = side->n_faces;
    group->face_first = scene_room(side->n_faces + 1, sizeof *group->face_first);
    group->face_node = scene_room(side->n_faces * UZ_FACE_NODES, sizeof *group->face_node);
    for (int64_t i = 0; i < side->n_faces; i++) {
        const int count = uz_mesh_face(node, box, side->face[i]);
        for (int a = 0; a < count; a++)
            group->face_node[entries++] = node[a] + shift;
        group->face_first[i + 1] = entries;
    }
}

static inline void append_nodes(uz_given_mesh *g, const uz_group *side, const char *body, int64_t shift)
{
    uz_given_group *group = new_group(g, body, "points");
    group->n_nodes = side->n_nodes;
    group->node = scene_room(side->n_nodes, sizeof *group->node);
    for (int64_t i = 0; i < side->n_nodes; i++)
        group->node[i] = side->node[i] + shift;
}

/* A box with its groups, called "a..." or "b...", its cells perhaps cut in two, perhaps bent by `bend` of its size. */
static inline void append_box(random_scene *s, const uz_box *box, const char *body, double bend, double cut)
{
    uz_given_mesh *g = &s->scene.given;
    uz_mesh mesh;
    uz_error err = {0};
    if (uz_mesh_from_box(&mesh, box, &err) != UZ_OK)
        abort();
    const int64_t shift = g->n_nodes, before = g->n_elements;
    g->dim = box->dim;
    g->n_nodes += mesh.n_nodes;
    g->xyz = grow(g->xyz, g->n_nodes * g->dim, sizeof *g->xyz);
    for (int64_t i = 0; i < mesh.n_nodes; i++)
        for (int c = 0; c < g->dim; c++) {
            const int other = (c + 1) % g->dim;
            const double t = (mesh.xyz[i * g->dim + other] - box->origin[other]) / box->size[other];
            const double x = mesh.xyz[i * g->dim + c];
            g->xyz[(shift + i) * g->dim + c] = x == 0 ? 0 : x + bend * box->size[c] * t * (1 - t);
        }
    for (int64_t e = 0; e < mesh.n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(&mesh, e, &count);
        if (mesh.kind[e] == UZ_QUAD4 && random_chance(&s->rng, cut)) {
            append_element(g, UZ_TRI3, (int64_t[]){node[0], node[1], node[2]}, 3, shift);
            append_element(g, UZ_TRI3, (int64_t[]){node[0], node[2], node[3]}, 3, shift);
        } else {
            append_element(g, (uz_element_kind)mesh.kind[e], node, count, shift);
        }
    }
    uz_given_group *all = new_group(g, body, "");
    all->n_elements = g->n_elements - before;
    all->element = scene_room(all->n_elements, sizeof *all->element);
    for (int64_t e = before; e < g->n_elements; e++)
        all->element[e - before] = e;
    for (int64_t k = 0; k < mesh.n_groups; k++)
        if (mesh.groups[k].kind == UZ_GROUP_FACES && strcmp(mesh.groups[k].name, "boundary") != 0)
            append_faces(g, &mesh, &mesh.groups[k], body, shift);
    append_nodes(g, uz_mesh_group(&mesh, "bottom", "", NULL), body, shift);
    uz_mesh_clear(&mesh);
}

/* ----------------------------------------------------------------- pieces */

static inline uz_support *new_support(random_scene *s, uz_support_kind kind, const char *on)
{
    uz_support *x = &s->scene.supports[s->scene.n_supports++];
    *x = (uz_support){.kind = kind, .u = {NAN, NAN, NAN}};
    snprintf(x->on, sizeof x->on, "%s", on);
    return x;
}

static inline uz_load *new_load(random_scene *s, uz_load_kind kind, const char *on)
{
    uz_load *x = &s->scene.loads[s->scene.n_loads++];
    *x = (uz_load){.kind = kind};
    snprintf(x->on, sizeof x->on, "%s", on);
    return x;
}

static inline uz_contact *new_contact(random_scene *s, uz_obstacle_kind kind, const char *on)
{
    uz_contact *x = &s->scene.contacts[s->scene.n_contacts++];
    *x = (uz_contact){.kind = kind};
    snprintf(x->on, sizeof x->on, "%s", on);
    return x;
}

static inline void hold(random_scene *s, const char *on, int c, double u)
{
    new_support(s, UZ_SUPPORT_COMPONENTS, on)->u[c] = u;
}

static inline void hold_all(random_scene *s, const char *on, double size)
{
    uz_support *x = new_support(s, UZ_SUPPORT_COMPONENTS, on);
    for (int c = 0; c < s->scene.given.dim; c++)
        x->u[c] = random_chance(&s->rng, 0.2) && s->scene.model != UZ_AXISYMMETRIC ? size * random_signed(&s->rng) : 0;
}

/* Held along the other axes, and along an inclined normal of its own: several supports at the nodes of one face. */
static inline void hold_inclined(random_scene *s, const char *on, double size)
{
    const int dim = s->scene.given.dim;
    for (int k = 0; k < dim; k++) {
        uz_support *x = new_support(s, UZ_SUPPORT_NORMAL, on);
        for (int c = 0; c < dim; c++)
            x->normal[c] = (c == k ? 2 : 0) + random_signed(&s->rng);
        x->value = random_chance(&s->rng, 0.3) ? 0.1 * size * random_signed(&s->rng) : 0;
    }
}

static inline void hold_springs(random_scene *s, const char *on, double stiffness)
{
    uz_support *x = new_support(s, UZ_SUPPORT_SPRING, on);
    const bool same = random_chance(&s->rng, 0.5);
    for (int c = 0; c < s->scene.given.dim; c++)
        x->spring[c] = stiffness * (same ? 1 : 0.1 + random_unit(&s->rng));
    s->turnable = s->turnable && same;
}

static inline void support_body(random_scene *s, double height)
{
    qp_random *rng = &s->rng;
    const bool ring = s->scene.model == UZ_AXISYMMETRIC;
    const double motion = 1e-3 * height, E = s->scene.materials[0].young;
    const int64_t how = random_int(rng, 0, 6);
    if (how <= 1)
        hold_all(s, how == 0 ? "atop" : "aleft", motion);
    else if (how == 2 && !ring)
        hold_inclined(s, "atop", motion);
    else if (how == 3 && !ring)
        hold_springs(s, "atop", E * height * random_unit(rng));
    else if (how == 4 && !ring) {
        hold(s, "aleft", 0, 0); /* obstacles must do the rest */
        if (s->scene.given.dim == 3)
            hold(s, "aback", 2, 0);
    } else {
        hold(s, "atop", 1, random_chance(rng, 0.5) ? 0 : -motion * random_unit(rng));
        if (!ring)
            hold(s, "aleft", 0, 0);
        if (s->scene.given.dim == 3)
            hold(s, "aback", 2, 0);
    }
}

static inline void load_body(random_scene *s, const double size[3], double stress)
{
    qp_random *rng = &s->rng;
    const int dim = s->scene.given.dim;
    static const char *const sides[] = {"atop", "aright", "abottom"};
    const int64_t n = random_int(rng, 1, 4);
    double area = dim == 2 ? size[0] * s->scene.thickness : size[0] * size[2], v[3] = {0};
    for (int64_t k = 0; k <= n; k++) {
        const uz_load_kind kind = k == 0 ? UZ_LOAD_TRACTION : (uz_load_kind)random_int(rng, 0, UZ_LOAD_KINDS);
        const bool whole = kind == UZ_LOAD_BODY_FORCE || kind == UZ_LOAD_GRAVITY || kind == UZ_LOAD_TEMPERATURE;
        uz_load *x = new_load(s, kind,
                              k == 0                                             ? "atop"
                              : whole                                            ? "a"
                              : kind == UZ_LOAD_FORCE && random_chance(rng, 0.3) ? "apoints"
                                                                                 : sides[random_int(rng, 0, 3)]);
        for (int c = 0; c < dim; c++)
            v[c] = (c == 1 ? -0.5 - random_unit(rng) : 0.3 * random_signed(rng)) * stress;
        const double factor = kind == UZ_LOAD_FORCE        ? area
                              : kind == UZ_LOAD_NODE_FORCE ? 0.1 * area
                              : kind == UZ_LOAD_BODY_FORCE ? 1 / size[1]
                              : kind == UZ_LOAD_GRAVITY    ? 1 / (size[1] * s->scene.materials[0].density)
                                                           : 1;
        for (int c = 0; c < dim; c++)
            x->v[c] = factor * v[c];
        x->value = kind == UZ_LOAD_TEMPERATURE ? 100 * random_signed(rng) : stress * random_signed(rng);
        x->node = random_int(rng, 0, s->scene.given.n_nodes);
        s->hot = s->hot || kind == UZ_LOAD_TEMPERATURE;
    }
}

/* An obstacle below the bottom of the first body. */
static inline void obstruct(random_scene *s, const char *on, const double origin[3], const double size[3], double gap)
{
    qp_random *rng = &s->rng;
    const int dim = s->scene.given.dim;
    const bool ring = s->scene.model == UZ_AXISYMMETRIC;
    const double low = origin[1] - gap,
                 middle[3] = {ring ? 0 : origin[0] + 0.5 * size[0], low, origin[2] + 0.5 * size[2]};
    const int64_t pick = random_int(rng, 0, ring ? 3 : 6);
    uz_contact *x = new_contact(s, UZ_OBSTACLE_PLANE, on);
    memcpy(x->point, middle, sizeof middle);
    x->radius = size[0] * (1 + 3 * random_unit(rng));
    if (pick == 1 || pick == 2) {
        x->kind = dim == 3 && random_chance(rng, 0.5) ? UZ_OBSTACLE_CYLINDER : UZ_OBSTACLE_ROUND;
        x->inside = pick == 2;
        x->radius *= x->inside ? 4 : 1;
        x->point[1] += x->inside ? x->radius : -x->radius;
        x->normal[2] = x->kind == UZ_OBSTACLE_CYLINDER;
        x->normal[0] = 0.2 * x->normal[2];
        return;
    }
    if (pick < 3 || dim == 3) {
        x->normal[0] = ring ? 0 : 0.2 * random_signed(rng);
        x->normal[1] = 1;
        x->normal[2] = dim == 3 ? 0.2 * random_signed(rng) : 0;
        return;
    }
    x->kind = pick == 4 ? UZ_OBSTACLE_HEIGHT : UZ_OBSTACLE_POLYLINE;
    s->turnable = s->turnable && x->kind == UZ_OBSTACLE_POLYLINE;
    x->n_x = random_int(rng, 2, 7);
    x->x = scene_room(x->n_x, sizeof *x->x);
    const double last = (double)(x->n_x - 1);
    for (int64_t i = 0; i < x->n_x; i++) /* the obstacle is on the right: from right to left */
        x->x[i] = origin[0] + size[0] * (-0.2 + 1.4 * (double)(pick == 5 ? x->n_x - 1 - i : i) / last);
    double *heights = scene_room(x->n_x, sizeof *heights);
    for (int64_t i = 0; i < x->n_x; i++)
        heights[i] = low - 0.1 * size[1] * random_unit(rng);
    if (x->kind == UZ_OBSTACLE_HEIGHT)
        x->z = heights;
    else
        x->y = heights;
}

/* Under the front of a solid: the one side that heights can meet from below is the lowest z. */
static inline void obstruct_by_table(random_scene *s, const double origin[3], const double size[3], double gap)
{
    uz_contact *x = new_contact(s, UZ_OBSTACLE_HEIGHT, "aback");
    s->turnable = false;
    x->n_x = random_int(&s->rng, 2, 5);
    x->n_y = random_int(&s->rng, 2, 5);
    x->x = scene_room(x->n_x, sizeof *x->x);
    x->y = scene_room(x->n_y, sizeof *x->y);
    x->z = scene_room(x->n_x * x->n_y, sizeof *x->z);
    for (int64_t i = 0; i < x->n_x; i++)
        x->x[i] = origin[0] + size[0] * (-0.1 + 1.2 * (double)i / (double)(x->n_x - 1));
    for (int64_t j = 0; j < x->n_y; j++)
        x->y[j] = origin[1] + size[1] * (-0.1 + 1.2 * (double)j / (double)(x->n_y - 1));
    for (int64_t i = 0; i < x->n_x * x->n_y; i++)
        x->z[i] = origin[2] - gap - 0.05 * size[2] * random_unit(&s->rng);
}

/* ------------------------------------------------------------------ whole */

static inline void fill_material(random_scene *s, const char *on)
{
    uz_material *m = &s->scene.materials[s->scene.n_materials++];
    const double young = s->scene.n_materials == 1 ? 1000 : 1000 * s->stiffer;
    *m = (uz_material){.on = "", .young = young, .density = 2, .expansion = 1e-5};
    m->poisson = random_chance(&s->rng, 0.2) ? 0.4999 : 0.45 * random_unit(&s->rng);
    snprintf(m->on, sizeof m->on, "%s", on);
}

static inline uz_box random_box(random_scene *s, int dim)
{
    static const char *const plane[] = {"tri3", "quad4", "tri6", "quad8", "quad4"}, *const solid[] = {"tet4", "hex8",
                                                                                                      "tet10"};
    qp_random *rng = &s->rng;
    uz_box box = {.dim = dim};
    const char *kind = dim == 2 ? plane[random_int(rng, 0, 5)] : solid[random_int(rng, 0, 3)];
    const bool quadratic = kind[3] == '6' || kind[4] == '8' || kind[3] == '1';
    for (int c = 0; c < 3; c++) {
        box.origin[c] = c == 0 && s->scene.model == UZ_AXISYMMETRIC ? (random_chance(rng, 0.5) ? 0 : 2) : 1 + c;
        box.size[c] = (c == 0 ? 3 : 1) * (1 + random_unit(rng));
        box.cells[c] = c < dim ? random_int(rng, 1, (c == 0 ? 4 : 2) - (quadratic ? 1 : 0) + 1) : 0;
        box.grading[c] = random_chance(rng, 0.5) ? 1 : 0.5 + 2 * random_unit(rng);
    }
    if (dim == 3)
        box.cells[2] = 1;
    snprintf(box.element, sizeof box.element, "%s", kind);
    return box;
}

/* The second body lies below the first and carries it, or is what the first is pressed on. */
static inline void add_second_body(random_scene *s, const uz_box *first, double gap)
{
    uz_box box = random_box(s, first->dim);
    memcpy(box.origin, first->origin, sizeof box.origin);
    memcpy(box.size, first->size, sizeof box.size);
    for (int c = 0; c < 3; c += 2) { /* a little wider, so that all of the first faces it */
        box.origin[c] -= s->scene.model == UZ_AXISYMMETRIC ? 0 : 0.1 * box.size[c];
        box.size[c] *= 1.2;
    }
    box.origin[1] -= box.size[1] + gap;
    append_box(s, &box, "b", 0, 0.3);
    s->bodies = 2;
}

static inline bool has_formulations(const uz_given_mesh *g)
{
    for (int64_t e = 0; e < g->n_elements; e++)
        if (g->kind[e] == UZ_QUAD4 || g->kind[e] == UZ_HEX8)
            return true;
    return false;
}

/* Room for SCENE_MOST_ITEMS of everything. */
static inline void scene_make_room(uz_scene *scene, uz_model model)
{
    scene->model = model;
    scene->thickness = scene->model == UZ_PLANE_STRESS || scene->model == UZ_PLANE_STRAIN ? 0.5 : 1;
    scene->source = UZ_MESH_GIVEN;
    scene->materials = scene_room(SCENE_MOST_ITEMS, sizeof *scene->materials);
    scene->supports = scene_room(SCENE_MOST_ITEMS, sizeof *scene->supports);
    scene->loads = scene_room(SCENE_MOST_ITEMS, sizeof *scene->loads);
    scene->contacts = scene_room(SCENE_MOST_ITEMS, sizeof *scene->contacts);
    scene->given.first = scene_room(1, sizeof *scene->given.first);
    scene->given.groups = scene_room(SCENE_MOST_GROUPS + 4, sizeof *scene->given.groups);
}

static inline random_scene make_random_scene(uint64_t seed)
{
    random_scene s = {.rng = {seed * 0x9E3779B97F4A7C15u + 77}, .bodies = 1};
    qp_random *rng = &s.rng;
    uz_scene *scene = &s.scene;
    random_unit(rng);
    scene_make_room(scene, (uz_model)random_int(rng, 0, 4));
    scene->all_candidates = random_chance(rng, 0.5);
    s.turnable = scene->model != UZ_AXISYMMETRIC;
    s.stiffer = pow(10, 6 * random_signed(rng));
    const bool two = random_chance(rng, 0.4);
    const double gap = random_chance(rng, 0.3) ? 0 : 1e-3 * random_unit(rng);
    uz_box box = random_box(&s, scene->model == UZ_SOLID ? 3 : 2);
    const double bend = !two && random_chance(rng, 0.3) && box.origin[0] != 0 ? 0.1 * random_signed(rng) : 0;
    append_box(&s, &box, "a", bend, 0.3);
    if (two)
        add_second_body(&s, &box, gap);
    scene->formulation = (uz_formulation)random_int(rng, 0, has_formulations(&scene->given) ? UZ_FORMULATIONS : 2);
    fill_material(&s, two ? "a" : "all");
    if (two)
        fill_material(&s, "b");
    support_body(&s, box.size[1]);
    load_body(&s, box.size, 3);
    if (two) {
        uz_contact *x = new_contact(&s, UZ_OBSTACLE_BODY, "abottom");
        snprintf(x->with, sizeof x->with, "btop");
        x->between = random_chance(rng, 0.5) ? UZ_CONTACT_NODES : UZ_CONTACT_SURFACES;
        if (random_chance(rng, 0.7)) {
            hold_all(&s, "bbottom", 0);
        } else { /* it lies on a plane */
            uz_contact *floor = new_contact(&s, UZ_OBSTACLE_PLANE, "bbottom");
            floor->normal[1] = 1;
            floor->point[1] = box.origin[1] - box.size[1] - gap;
            if (scene->model != UZ_AXISYMMETRIC)
                hold(&s, "bleft", 0, 0);
            if (box.dim == 3)
                hold(&s, "bback", 2, 0);
        }
    } else {
        obstruct(&s, "abottom", box.origin, box.size, gap);
    }
    if (random_chance(rng, 0.2) && scene->model != UZ_AXISYMMETRIC) {
        uz_contact *wall = new_contact(&s, UZ_OBSTACLE_PLANE, "aright");
        wall->normal[0] = -1;
        wall->normal[1] = 0.1 * random_signed(rng);
        wall->point[0] = box.origin[0] + box.size[0] * 1.02 + 1e-3;
        wall->point[1] = box.origin[1];
    }
    if (box.dim == 3 && !two && random_chance(rng, 0.2))
        obstruct_by_table(&s, box.origin, box.size, gap);
    return s;
}

#endif
