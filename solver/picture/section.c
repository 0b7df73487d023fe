/* section.c: where a plane cuts a solid, with what is there, as arrays for a viewer: uz_section_compute.
 *
 * Each side of an element is divided into triangles around its centre, the plane cuts these in pieces of line, and the
 * piece of the section that lies in the element is the triangles between those and a point in their middle. That is all
 * there is to a type of element: none is asked for. Places, displacements and stresses of the points that a side is
 * divided at, and of the one in the middle, are those of the shape functions. A point on the plane counts as before it,
 * so that of two elements whose common side lies in the plane only one is cut, along that side. Cost: one evaluation of
 * the stress, and work by the number of elements. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "picture/arrays.h"
#include "picture/scenery.h"
#include "post/parts.h"

#include <math.h>
#include <string.h>

enum { MOST_CUTS = UZ_ELEMENT_SIDES * UZ_SIDE_NODES };

/* A point of an element with all that is interpolated there; HEIGHT is that above the plane. */
enum { LOCAL, PLACE = 3, MOVED = 6, HEIGHT = 9, STRESS = 10, NUMBERS = STRESS + UZ_FIELD_COMPONENTS };
typedef struct {
    double at[NUMBERS];
} point;

typedef struct {
    const uz_body_model *model;
    const double *u, *stress; /* n_nodes x 3 and x 6; stress NULL: not asked for */
    double base[3], normal[3];
    uz_surface *out;
    double *vertex, *mises; /* 6 numbers a vertex: place, displacement; mises NULL: not asked for */
    int64_t vertex_room, mises_room, triangle_room, line_room;
} section;

static void evaluate(point *p, const section *w, const uz_element_type *type, const int64_t *node)
{
    double N[UZ_ELEMENT_NODES];
    type->shape(type, N, NULL, p->at + LOCAL);
    memset(p->at + PLACE, 0, (NUMBERS - PLACE) * sizeof *p->at);
    for (int a = 0; a < type->nodes; a++) {
        for (int c = 0; c < 3; c++) {
            p->at[PLACE + c] += N[a] * w->model->mesh.xyz[3 * node[a] + c];
            p->at[MOVED + c] += N[a] * w->u[3 * node[a] + c];
        }
        for (int c = 0; w->stress && c < UZ_FIELD_COMPONENTS; c++)
            p->at[STRESS + c] += N[a] * w->stress[UZ_FIELD_COMPONENTS * node[a] + c];
    }
    for (int c = 0; c < 3; c++)
        p->at[HEIGHT] += w->normal[c] * (p->at[PLACE + c] - w->base[c]);
}

/* Where the plane cuts a triangle: false where it does not. */
static bool cut_triangle(point cut[2], const point *const corner[3])
{
    int found = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = corner[k]->at, *b = corner[(k + 1) % 3]->at;
        if ((a[HEIGHT] < 0) == (b[HEIGHT] < 0))
            continue;
        const double t = a[HEIGHT] / (a[HEIGHT] - b[HEIGHT]);
        for (int i = 0; i < NUMBERS; i++)
            cut[found].at[i] = (1 - t) * a[i] + t * b[i];
        found++;
    }
    return found == 2;
}

/* The pieces of line that the plane leaves on the sides of an element. */
static int cut_sides(point (*cut)[2], const section *w, const uz_element_type *type, const int64_t *node)
{
    int count = 0;
    for (int s = 0; s < type->sides; s++) {
        const uz_element_side *side = &type->side[s];
        const int rim = side->nodes;
        point centre = {{0}}, around[UZ_SIDE_NODES] = {{{0}}};
        for (int k = 0; k < rim; k++) { /* corners and middles in turn */
            const bool middles = rim > side->corners;
            const int at = !middles ? k : k % 2 == 0 ? k / 2 : side->corners + k / 2;
            memcpy(around[k].at + LOCAL, type->local[side->node[at]], 3 * sizeof *around[k].at);
            evaluate(&around[k], w, type, node);
        }
        for (int k = 0; k < side->corners; k++)
            for (int c = 0; c < 3; c++)
                centre.at[LOCAL + c] += type->local[side->node[k]][c] / side->corners;
        evaluate(&centre, w, type, node);
        for (int k = 0; k < rim; k++)
            count += cut_triangle(cut[count], (const point *const[3]){&centre, &around[k], &around[(k + 1) % rim]});
    }
    return count;
}

static bool put_vertex(section *w, const point *p)
{
    uz_surface *s = w->out;
    if (!uz_grow(&w->vertex, 6 * s->n_vertices, 6, &w->vertex_room, sizeof *w->vertex) ||
        (w->stress && !uz_grow(&w->mises, s->n_vertices, 1, &w->mises_room, sizeof *w->mises)))
        return false;
    memcpy(w->vertex + 6 * s->n_vertices, p->at + PLACE, 6 * sizeof *p->at);
    if (w->stress)
        w->mises[s->n_vertices] = uz_von_mises(p->at + STRESS, UZ_FIELD_COMPONENTS);
    s->n_vertices++;
    return true;
}

/* One element's part of the section. False: no memory. */
static bool cut_element(section *w, const uz_element_type *type, const int64_t *node)
{
    uz_surface *s = w->out;
    point cut[MOST_CUTS][2], middle = {{0}};
    const int count = cut_sides(cut, w, type, node);
    if (count == 0)
        return true;
    double x[3] = {0};
    for (int k = 0; k < 2 * count; k++)
        for (int c = 0; c < 3; c++) {
            middle.at[LOCAL + c] += cut[k / 2][k % 2].at[LOCAL + c] / (2 * count);
            x[c] += cut[k / 2][k % 2].at[PLACE + c] / (2 * count);
        }
    evaluate(&middle, w, type, node);
    memcpy(middle.at + PLACE, x, sizeof x); /* on the plane, also where the element is curved */
    const unsigned centre = (unsigned)s->n_vertices;
    if (!put_vertex(w, &middle) ||
        !uz_grow(&s->triangle, 3 * s->n_triangles, 3 * (int64_t)count, &w->triangle_room, sizeof *s->triangle) ||
        !uz_grow(&s->line, 2 * s->n_lines, 2 * (int64_t)count, &w->line_room, sizeof *s->line))
        return false;
    for (int k = 0; k < count; k++) {
        const double *a = cut[k][0].at + PLACE, *b = cut[k][1].at + PLACE;
        double turn = 0;
        for (int c = 0; c < 3; c++)
            turn += w->normal[c] * ((a[(c + 1) % 3] - x[(c + 1) % 3]) * (b[(c + 2) % 3] - x[(c + 2) % 3]) -
                                    (a[(c + 2) % 3] - x[(c + 2) % 3]) * (b[(c + 1) % 3] - x[(c + 1) % 3]));
        const unsigned first = (unsigned)s->n_vertices;
        if (!put_vertex(w, &cut[k][turn < 0]) || !put_vertex(w, &cut[k][turn >= 0]))
            return false;
        const unsigned triangle[] = {centre, first, first + 1};
        memcpy(s->triangle + 3 * s->n_triangles++, triangle, sizeof triangle);
        memcpy(s->line + 2 * s->n_lines++, triangle + 1, 2 * sizeof *triangle);
    }
    return true;
}

/* Is the whole element on one side? Quadratic sides bulge out of the box of their nodes by an eighth of it at most. */
static bool is_missed(const section *w, const int64_t *node, int count)
{
    double low = INFINITY, high = -INFINITY;
    for (int a = 0; a < count; a++) {
        double height = 0;
        for (int c = 0; c < 3; c++)
            height += w->normal[c] * (w->model->mesh.xyz[3 * node[a] + c] - w->base[c]);
        low = fmin(low, height);
        high = fmax(high, height);
    }
    return low - 0.25 * (high - low) > 0 || high + 0.25 * (high - low) < 0;
}

static uz_status cut_all(section *w, size_t most_bytes, const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &w->model->mesh;
    uz_surface *s = w->out;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        if (e % 4096 == 0 && uz_cancelled(hooks))
            return uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the body was cut");
        if (is_missed(w, node, count))
            continue;
        if (!cut_element(w, uz_element_type_of((uz_element_kind)mesh->kind[e]), node))
            return uz_no_memory(err, "a section");
        const double bytes = 4 * (7 * (double)s->n_vertices + 5 * (double)s->n_triangles);
        if (s->n_vertices >= INT32_MAX || (most_bytes > 0 && bytes > (double)most_bytes))
            return uz_fail(err, UZ_ERR_LIMIT, "", "the section would take more than the %.0f MB that may be",
                           (double)most_bytes / 1e6);
    }
    if (s->n_triangles == 0)
        return uz_fail(err, UZ_ERR_SCENE, "", "the plane does not cut the body: there is no section");
    return UZ_OK;
}

static uz_status build(section *w, const uz_field_body *body, const uz_field_source *answer, unsigned which,
                       size_t most_bytes, const uz_hooks *hooks, uz_error *err)
{
    uz_surface *s = w->out;
    uz_fields fields = {.stress = NULL};
    uz_status status = UZ_OK;
    if (which & UZ_FIELD_VON_MISES)
        status = uz_fields_of_body(&fields, body, answer, UZ_FIELD_STRESS, hooks, err);
    w->stress = fields.stress;
    if (status == UZ_OK)
        status = cut_all(w, most_bytes, hooks, err);
    if (status == UZ_OK) {
        s->position = uz_alloc(3 * s->n_vertices, sizeof *s->position);
        s->displacement = uz_alloc(3 * s->n_vertices, sizeof *s->displacement);
        if (!s->position || !s->displacement)
            status = uz_no_memory(err, "a section");
    }
    uz_surface_frame(s, &w->model->mesh);
    for (int64_t i = 0; status == UZ_OK && i < s->n_vertices; i++)
        uz_surface_put(s, i, w->vertex + 6 * i, w->vertex + 6 * i + 3);
    if (status == UZ_OK)
        status = uz_surface_scale(s, body->scene, w->model, answer, err);
    if (status == UZ_OK && w->mises)
        status = uz_draw_values(&s->von_mises, w->mises, NULL, s->n_vertices, err);
    uz_fields_clear(&fields);
    return status;
}

uz_status uz_section_compute(uz_surface *out, const uz_scene *scene, const uz_field_source *answer,
                             const uz_plane *plane, unsigned which, size_t most_bytes, const uz_hooks *hooks,
                             uz_error *err)
{
    uz_body_model model;
    uz_field_body body = {.scene = scene};
    section w = {.model = &model, .u = answer->u, .out = out};
    const double *n = plane->normal, length = hypot(hypot(n[0], n[1]), n[2]);
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK && model.mesh.dim != 3)
        status = uz_fail(err, UZ_ERR_SCENE, "", "a section is of a solid, and this model is one in the plane");
    if (status == UZ_OK && !(length > 0 && isfinite(length)))
        status = uz_fail(err, UZ_ERR_SCENE, "", "the normal of the plane has no direction");
    if (status == UZ_OK)
        status = uz_scenery_check_answer(answer, &model, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    for (int c = 0; status == UZ_OK && c < 3; c++) {
        w.base[c] = plane->point[c];
        w.normal[c] = n[c] / length;
    }
    if (status == UZ_OK) {
        *out = (uz_surface){.dim = 3, .n_nodes = model.mesh.n_nodes, .n_elements = model.mesh.n_elements};
        status = build(&w, &body, answer, which, most_bytes, hooks, err);
    }
    uz_free_all(w.vertex, w.mises);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    if (status != UZ_OK)
        uz_surface_clear(out);
    return status;
}
