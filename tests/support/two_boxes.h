/* two_boxes.h: scenes of two bodies, each a box, which may be bent. Groups are those of the boxes, with an
 * a of the first and a b of the second before their names. */
#ifndef TESTS_TWO_BOXES_H
#define TESTS_TWO_BOXES_H

#include "body_fixture.h"

typedef struct {
    double origin[3], size[3];
    int64_t cells[3]; /* the last of each: of solids */
    const char *element;
} box_part;

static inline int64_t *copy_numbers(const int64_t *from, int64_t n, int64_t add)
{
    int64_t *out = body_room(n + 1, sizeof *out);
    for (int64_t i = 0; i < n; i++)
        out[i] = from[i] + add;
    return out;
}

/* The second of two meshes in numbers joins the first, its groups behind those. */
static inline void join(uz_given_mesh *to, const uz_given_mesh *more)
{
    const int64_t nodes = to->n_nodes, elements = to->n_elements, entries = to->first[elements], dim = to->dim;
    uz_given_mesh out = {.dim = to->dim, .n_nodes = nodes + more->n_nodes, .n_elements = elements + more->n_elements};
    out.xyz = body_room(dim * out.n_nodes, sizeof *out.xyz);
    out.kind = body_room(out.n_elements, 1);
    out.first = body_room(out.n_elements + 1, sizeof *out.first);
    out.node = body_room(entries + more->first[more->n_elements], sizeof *out.node);
    memcpy(out.xyz, to->xyz, (size_t)(dim * nodes) * sizeof *out.xyz);
    memcpy(out.xyz + dim * nodes, more->xyz, (size_t)(dim * more->n_nodes) * sizeof *out.xyz);
    memcpy(out.kind, to->kind, (size_t)elements);
    memcpy(out.kind + elements, more->kind, (size_t)more->n_elements);
    memcpy(out.node, to->node, (size_t)entries * sizeof *out.node);
    for (int64_t i = 0; i <= elements; i++)
        out.first[i] = to->first[i];
    for (int64_t i = 0; i <= more->n_elements; i++)
        out.first[elements + i] = entries + more->first[i];
    for (int64_t i = 0; i < more->first[more->n_elements]; i++)
        out.node[entries + i] = nodes + more->node[i];
    out.groups = body_room(to->n_groups + more->n_groups + 4, sizeof *out.groups);
    for (int64_t g = 0; g < to->n_groups + more->n_groups; g++) {
        const bool second = g >= to->n_groups;
        const uz_given_group *from = second ? &more->groups[g - to->n_groups] : &to->groups[g];
        uz_given_group *group = &out.groups[out.n_groups];
        if (strcmp(from->name, "all") == 0)
            continue;
        out.n_groups++;
        snprintf(group->name, sizeof group->name, "%s%.32s", second ? "b" : "a", from->name);
        group->n_faces = from->n_faces;
        if (from->n_faces > 0) {
            group->face_first = copy_numbers(from->face_first, from->n_faces + 1, 0);
            group->face_node = copy_numbers(from->face_node, from->face_first[from->n_faces], second ? nodes : 0);
        }
        group->n_elements = from->n_elements;
        if (from->n_elements > 0)
            group->element = copy_numbers(from->element, from->n_elements, second ? elements : 0);
    }
    *to = out;
}

/* Two boxes, moved by `map`. */
static inline uz_scene two(uz_model model, uz_elasticity law, const box_part *a, const box_part *b, body_map map)
{
    uz_scene s[2];
    for (int k = 0; k < 2; k++) {
        const box_part *p = k ? b : a;
        s[k] = body_scene(model, p->element, p->size, p->cells);
        memcpy(s[k].box.origin, p->origin, sizeof s[k].box.origin);
        body_give_mesh(&s[k], map);
    }
    const uz_given_mesh first = s[0].given;
    join(&s[0].given, &s[1].given);
    uz_scene left = s[0]; /* what the joined mesh was copied from */
    left.given = first;
    left.materials = NULL;
    left.supports = NULL;
    left.loads = NULL;
    left.contacts = NULL;
    left.n_materials = left.n_supports = left.n_loads = left.n_contacts = 0;
    uz_scene_clear(&left);
    uz_scene_clear(&s[1]);
    s[0].materials[0].young = 1;
    s[0].materials[0].law = law;
    s[0].kinematics = UZ_KINEMATICS_FINITE;
    return s[0];
}

static inline void touch(uz_scene *s, const char *on, const char *with)
{
    uz_contact *c = &s->contacts[s->n_contacts++];
    *c = (uz_contact){.kind = UZ_OBSTACLE_BODY, .faceted = true};
    snprintf(c->on, sizeof c->on, "%s", on);
    snprintf(c->with, sizeof c->with, "%s", with);
}

#endif
