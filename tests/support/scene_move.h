/* scene_move.h: the same scene said otherwise: turned, in other units, with its nodes in another order. */
#ifndef TESTS_SCENE_MOVE_H
#define TESTS_SCENE_MOVE_H

#include "random_scene.h"

/* How the same scene is said otherwise. */
typedef struct {
    double turn[3][3]; /* x becomes length * turn x */
    double length, force;
    bool reorder;
    int64_t *place; /* made by move_scene where nodes are reordered: node i is now place[i]; the caller frees it */
} scene_move;

static inline void turn_vector(double v[3], const scene_move *how, double factor)
{
    double old[3] = {v[0], v[1], v[2]};
    for (int i = 0; i < 3; i++)
        v[i] = factor * (how->turn[i][0] * old[0] + how->turn[i][1] * old[1] + how->turn[i][2] * old[2]);
}

static inline void move_loads(uz_scene *s, const scene_move *how)
{
    const double L = how->length, F = how->force;
    const double factor[UZ_LOAD_KINDS] = {[UZ_LOAD_TRACTION] = F / (L * L),
                                          [UZ_LOAD_PRESSURE] = F / (L * L),
                                          [UZ_LOAD_FORCE] = F,
                                          [UZ_LOAD_BODY_FORCE] = F / (L * L * L),
                                          [UZ_LOAD_GRAVITY] = F / (L * L * L),
                                          [UZ_LOAD_NODE_FORCE] = F,
                                          [UZ_LOAD_TEMPERATURE] = 1};
    for (int64_t k = 0; k < s->n_loads; k++) {
        uz_load *x = &s->loads[k];
        turn_vector(x->v, how, factor[x->kind]);
        x->value *= factor[x->kind];
        x->node = how->place ? how->place[x->node] : x->node;
    }
}

static inline bool is_rotated(const scene_move *how)
{
    return how->turn[0][0] != 1 || how->turn[1][1] != 1 || how->turn[2][2] != 1;
}

/* Components along axes that are turned are supports along their new directions. */
static inline void move_supports(uz_scene *s, const scene_move *how)
{
    const int64_t given = s->n_supports;
    for (int64_t k = 0; k < given; k++) {
        uz_support *x = &s->supports[k];
        turn_vector(x->normal, how, 1);
        x->value *= how->length;
        for (int c = 0; c < 3; c++) {
            x->spring[c] *= how->force / how->length;
            x->u[c] *= how->length;
        }
        if (x->kind != UZ_SUPPORT_COMPONENTS || !is_rotated(how))
            continue;
        const uz_support old = *x;
        bool used = false;
        for (int c = 0; c < 3; c++) {
            if (isnan(old.u[c]))
                continue;
            uz_support *to = used ? &s->supports[s->n_supports++] : x;
            used = true;
            *to = old;
            to->kind = UZ_SUPPORT_NORMAL;
            to->value = old.u[c];
            for (int i = 0; i < 3; i++)
                to->normal[i] = how->turn[i][c];
        }
    }
}

static inline void move_contacts(uz_scene *s, const scene_move *how)
{
    for (int64_t k = 0; k < s->n_contacts; k++) {
        uz_contact *x = &s->contacts[k];
        turn_vector(x->point, how, how->length);
        turn_vector(x->normal, how, 1);
        x->radius *= how->length;
        for (int64_t i = 0; i < x->n_x; i++) {
            double at[3] = {x->x[i], x->y && x->n_y == 0 ? x->y[i] : 0, 0};
            turn_vector(at, how, how->length);
            x->x[i] = at[0];
            if (x->kind == UZ_OBSTACLE_POLYLINE)
                x->y[i] = at[1];
        }
        for (int64_t j = 0; j < x->n_y; j++)
            x->y[j] *= how->length;
        for (int64_t i = 0; x->z && i < x->n_x * (x->n_y > 0 ? x->n_y : 1); i++)
            x->z[i] *= how->length;
    }
}

static inline void reorder_nodes(uz_given_mesh *g, qp_random *rng, scene_move *how)
{
    double *xyz = scene_room(g->n_nodes * g->dim, sizeof *xyz);
    how->place = scene_room(g->n_nodes, sizeof *how->place);
    for (int64_t i = 0; i < g->n_nodes; i++)
        how->place[i] = i;
    for (int64_t i = g->n_nodes - 1; i > 0; i--) {
        const int64_t j = random_int(rng, 0, i + 1), t = how->place[i];
        how->place[i] = how->place[j];
        how->place[j] = t;
    }
    for (int64_t i = 0; i < g->n_nodes; i++)
        memcpy(xyz + how->place[i] * g->dim, g->xyz + i * g->dim, (size_t)g->dim * sizeof *xyz);
    free(g->xyz);
    g->xyz = xyz;
    for (int64_t q = 0; q < g->first[g->n_elements]; q++)
        g->node[q] = how->place[g->node[q]];
    for (int64_t k = 0; k < g->n_groups; k++) {
        uz_given_group *group = &g->groups[k];
        for (int64_t i = 0; i < group->n_nodes; i++)
            group->node[i] = how->place[group->node[i]];
        for (int64_t i = 0; group->n_faces > 0 && i < group->face_first[group->n_faces]; i++)
            group->face_node[i] = how->place[group->face_node[i]];
    }
}

/* In place. */
static inline void move_scene(random_scene *x, scene_move *how)
{
    uz_scene *s = &x->scene;
    const double L = how->length, F = how->force;
    for (int64_t i = 0; i < s->given.n_nodes; i++) {
        double at[3] = {0};
        memcpy(at, s->given.xyz + i * s->given.dim, (size_t)s->given.dim * sizeof *at);
        turn_vector(at, how, L);
        memcpy(s->given.xyz + i * s->given.dim, at, (size_t)s->given.dim * sizeof *at);
    }
    if (how->reorder)
        reorder_nodes(&s->given, &x->rng, how);
    for (int64_t k = 0; k < s->n_materials; k++)
        s->materials[k].young *= F / (L * L);
    s->thickness *= L;
    move_loads(s, how);
    move_supports(s, how);
    move_contacts(s, how);
}

#endif
