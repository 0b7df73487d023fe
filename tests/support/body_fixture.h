/* body_fixture.h: scenes of every element, model, support and load for the tests of whole bodies. */
#ifndef TESTS_BODY_FIXTURE_H
#define TESTS_BODY_FIXTURE_H

#include "assembly/assembly.h"
#include "core/alloc.h"
#include "harness.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

__attribute__((constructor)) static void settle_bodies(void)
{
    uz_process_init(2);
    uz_thread_init();
}

static inline void *body_room(int64_t count, size_t size)
{
    void *room = uz_alloc_zero(count, size);
    if (!room)
        abort();
    return room;
}

enum { BODY_ITEMS = 16 };

/* A box at the origin with one material on all (E = 200e3, nu = 0.3), thickness 1. */
static inline uz_scene body_scene(uz_model model, const char *element, const double size[3], const int64_t cells[3])
{
    uz_scene s = {.model = model, .thickness = 1};
    s.box = (uz_box){.dim = model == UZ_SOLID ? 3 : 2};
    snprintf(s.box.element, sizeof s.box.element, "%s", element);
    for (int c = 0; c < s.box.dim; c++) {
        s.box.size[c] = size[c];
        s.box.cells[c] = cells[c];
        s.box.grading[c] = 1;
    }
    s.materials = body_room(BODY_ITEMS, sizeof *s.materials);
    s.supports = body_room(BODY_ITEMS, sizeof *s.supports);
    s.loads = body_room(BODY_ITEMS, sizeof *s.loads);
    s.contacts = body_room(BODY_ITEMS, sizeof *s.contacts);
    s.materials[s.n_materials++] = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3};
    return s;
}

static inline uz_support *body_hold(uz_scene *s, const char *on, double ux, double uy, double uz)
{
    uz_support *x = &s->supports[s->n_supports++];
    *x = (uz_support){.kind = UZ_SUPPORT_COMPONENTS, .u = {ux, uy, uz}};
    snprintf(x->on, sizeof x->on, "%s", on);
    return x;
}

static inline uz_support *body_hold_normal(uz_scene *s, const char *on, const double n[3], double value)
{
    uz_support *x = body_hold(s, on, NAN, NAN, NAN);
    x->kind = UZ_SUPPORT_NORMAL;
    memcpy(x->normal, n, sizeof x->normal);
    x->value = value;
    return x;
}

static inline uz_support *body_spring(uz_scene *s, const char *on, double kx, double ky, double kz)
{
    uz_support *x = body_hold(s, on, NAN, NAN, NAN);
    x->kind = UZ_SUPPORT_SPRING;
    x->spring[0] = kx;
    x->spring[1] = ky;
    x->spring[2] = kz;
    return x;
}

static inline uz_load *body_load(uz_scene *s, uz_load_kind kind, const char *on, double x, double y, double z)
{
    uz_load *load = &s->loads[s->n_loads++];
    *load = (uz_load){.kind = kind, .v = {x, y, z}, .value = x};
    snprintf(load->on, sizeof load->on, "%s", on);
    return load;
}

static inline uz_contact *body_plane(uz_scene *s, const char *on, const double point[3], const double normal[3])
{
    uz_contact *x = &s->contacts[s->n_contacts++];
    *x = (uz_contact){.kind = UZ_OBSTACLE_PLANE};
    memcpy(x->point, point, sizeof x->point);
    memcpy(x->normal, normal, sizeof x->normal);
    snprintf(x->on, sizeof x->on, "%s", on);
    return x;
}

static inline uz_body_model body_model(const uz_scene *scene)
{
    uz_body_model model;
    uz_error err = {0};
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_HELD, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return model;
}

/* An answer, or the end of the program. */
static inline uz_result *body_solve_to(const uz_scene *scene, double accuracy)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *scene};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = accuracy;
    CHECK_MSG(uz_solve(&result, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s: %s", err.where, err.message);
    if (!result)
        exit(1);
    return result;
}

/* A certified one. */
static inline uz_result *body_solve(const uz_scene *scene, double accuracy)
{
    uz_result *result = body_solve_to(scene, accuracy);
    CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s %s",
              uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), result->summary.message);
    return result;
}

static inline double body_most(const double *a, int64_t n)
{
    double most = 0;
    for (int64_t i = 0; i < n; i++)
        most = fmax(most, fabs(a[i]));
    return most;
}

/* The box's mesh in numbers, its nodes moved. */
typedef void (*body_map)(double x[3]);

static inline void body_copy_group(uz_given_group *to, const uz_group *from, const uz_mesh *mesh)
{
    memcpy(to->name, from->name, sizeof to->name);
    if (from->kind == UZ_GROUP_FACES) {
        to->n_faces = from->n_faces;
        to->face_first = body_room(from->n_faces + 1, sizeof *to->face_first);
        to->face_node = body_room(from->n_faces * UZ_FACE_NODES, sizeof *to->face_node);
        for (int64_t i = 0; i < from->n_faces; i++) {
            int64_t node[UZ_FACE_NODES];
            const int count = uz_mesh_face(node, mesh, from->face[i]);
            memcpy(to->face_node + to->face_first[i], node, (size_t)count * sizeof *node);
            to->face_first[i + 1] = to->face_first[i] + count;
        }
    } else {
        to->n_elements = uz_group_element_count(mesh, from);
        to->element = body_room(to->n_elements, sizeof *to->element);
        for (int64_t i = 0; i < to->n_elements; i++)
            to->element[i] = uz_group_element_at(from, i);
    }
}

static inline void body_give_mesh(uz_scene *scene, body_map map)
{
    uz_mesh mesh;
    uz_error err = {0};
    uz_given_mesh *g = &scene->given;
    CHECK_MSG(uz_mesh_from_box(&mesh, &scene->box, &err) == UZ_OK, "%s", err.message);
    const int64_t total = mesh.first[mesh.n_elements];
    *g = (uz_given_mesh){.dim = mesh.dim, .n_nodes = mesh.n_nodes, .n_elements = mesh.n_elements};
    g->xyz = body_room(mesh.n_nodes * mesh.dim, sizeof *g->xyz);
    g->kind = body_room(mesh.n_elements, 1);
    g->first = body_room(mesh.n_elements + 1, sizeof *g->first);
    g->node = body_room(total, sizeof *g->node);
    memcpy(g->kind, mesh.kind, (size_t)mesh.n_elements);
    memcpy(g->first, mesh.first, (size_t)(mesh.n_elements + 1) * sizeof *g->first);
    memcpy(g->node, mesh.node, (size_t)total * sizeof *g->node);
    for (int64_t a = 0; a < mesh.n_nodes; a++) {
        double x[3] = {0};
        memcpy(x, mesh.xyz + a * mesh.dim, (size_t)mesh.dim * sizeof *x);
        if (map)
            map(x);
        memcpy(g->xyz + a * mesh.dim, x, (size_t)mesh.dim * sizeof *x);
    }
    g->groups = body_room(mesh.n_groups + 4, sizeof *g->groups);
    g->n_groups = mesh.n_groups;
    for (int64_t i = 0; i < mesh.n_groups; i++)
        body_copy_group(&g->groups[i], &mesh.groups[i], &mesh);
    scene->source = UZ_MESH_GIVEN;
    uz_mesh_clear(&mesh);
}

/* Puts the nodes between two corners of quadratic elements in their middles, where a map has bent the edges. */
static inline void body_straighten(uz_scene *scene)
{
    uz_given_mesh *g = &scene->given;
    for (int64_t e = 0; e < g->n_elements; e++) {
        const uz_element_kind kind = (uz_element_kind)g->kind[e];
        const int64_t *node = g->node + g->first[e];
        const uz_element_type *type = uz_element_type_of(kind);
        const int corners = type->corners;
        const int middles = type->nodes - corners;
        for (int i = 0; i < middles * g->dim; i++) {
            const int k = i / g->dim, c = i % g->dim;
            const int from = type->edge[k][0], to = type->edge[k][1];
            g->xyz[node[corners + k] * g->dim + c] =
                0.5 * (g->xyz[node[from] * g->dim + c] + g->xyz[node[to] * g->dim + c]);
        }
    }
}

#endif
