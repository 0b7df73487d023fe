/* arrays.c: the surface of a deformed body as arrays for a viewer: uz_surface_compute. */
#include "core/alloc.h"
#include "core/error.h"
#include "picture/arc.h"
#include "picture/arrays.h"
#include "picture/scenery.h"
#include "picture/skin.h"
#include "post/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Displacements of so many times the body's size are none of an elastic body, and no float's. */
static const double FAR = 1e30;

/* What the arrays are made from. */
typedef struct {
    const uz_scene *scene;
    const uz_body_model *model;
    const uz_field_source *answer;
    uz_fields fields;
    uz_skin skin;
    uz_skin_edges edges;
    int64_t *vertex_of; /* n_nodes: -1 where a node is not drawn */
    int64_t *drawn;     /* n_rows: rows whose nodes are */
    double *arc;        /* m; plane models */
    unsigned *part;     /* m; plane models */
} surface_work;

/* The least power of two that is not below a number >= 0; 1 for zero. */
static double unit_of(double largest)
{
    int exponent = 0;
    if (!(largest > 0))
        return 1;
    return frexp(largest, &exponent) == 0.5 ? largest : ldexp(1, exponent < 1024 ? exponent : 1023);
}

/* --------------------------------------------------------------- triangles */

static unsigned *as_vertices(const surface_work *w, const int64_t *node, int64_t count)
{
    unsigned *out = uz_alloc(count, sizeof *out);
    for (int64_t i = 0; out && i < count; i++)
        out[i] = (unsigned)w->vertex_of[node[i]];
    return out;
}

/* ---------------------------------------------------------------- vertices */

void uz_surface_frame(uz_surface *s, const uz_mesh *mesh)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int64_t i = 0; i < mesh->n_nodes * mesh->dim; i++) {
        low[i % mesh->dim] = fmin(low[i % mesh->dim], mesh->xyz[i]);
        high[i % mesh->dim] = fmax(high[i % mesh->dim], mesh->xyz[i]);
    }
    for (int c = 0; c < mesh->dim; c++)
        s->origin[c] = 0.5 * low[c] + 0.5 * high[c];
    s->unit = unit_of(mesh->extent);
    for (int c = 0; c < 3; c++) {
        s->low[c] = s->least[c] = c < s->dim ? INFINITY : 0;
        s->high[c] = s->most[c] = c < s->dim ? -INFINITY : 0;
    }
}

void uz_surface_put(uz_surface *s, int64_t vertex, const double *x, const double *u)
{
    double length = 0;
    for (int c = 0; c < s->dim; c++) {
        const float at = (float)((x[c] - s->origin[c]) / s->unit), by = (float)(u[c] / s->unit);
        s->position[3 * vertex + c] = at;
        s->displacement[3 * vertex + c] = by;
        s->low[c] = fminf(s->low[c], at);
        s->high[c] = fmaxf(s->high[c], at);
        s->least[c] = fminf(s->least[c], by);
        s->most[c] = fmaxf(s->most[c], by);
        length = hypot(length, u[c]);
    }
    s->largest = fmax(s->largest, length);
}

uz_status uz_surface_scale(uz_surface *s, const uz_scene *scene, const uz_body_model *model,
                           const uz_field_source *answer, uz_error *err)
{
    if (!(s->largest / s->unit < FAR))
        return uz_fail(err, UZ_ERR_NOT_FINITE, "u", "the displacements are %g times the body's size: cannot be drawn",
                       s->largest / s->unit);
    s->factor = uz_show_factor(scene, model, answer);
    return UZ_OK;
}

static uz_status fill_vertices(uz_surface *s, const surface_work *w, uz_error *err)
{
    const uz_mesh *mesh = &w->model->mesh;
    const bool renumbered = s->n_vertices < s->n_nodes;
    s->position = uz_alloc_zero(3 * s->n_vertices, sizeof *s->position);
    s->displacement = uz_alloc_zero(3 * s->n_vertices, sizeof *s->displacement);
    s->node = renumbered ? uz_alloc(s->n_vertices, sizeof *s->node) : NULL;
    if (!s->position || !s->displacement || (renumbered && !s->node))
        return uz_no_memory(err, UZ_OF_SKIN);
    uz_surface_frame(s, mesh);
    for (int64_t a = 0; a < s->n_nodes; a++) {
        const int64_t vertex = w->vertex_of[a];
        if (vertex < 0)
            continue;
        uz_surface_put(s, vertex, mesh->xyz + a * s->dim, w->answer->u + a * s->dim);
        if (renumbered)
            s->node[vertex] = (float)a;
    }
    return uz_surface_scale(s, w->scene, w->model, w->answer, err);
}

uz_status uz_draw_values(uz_drawn *out, const double *value, const int64_t *place, int64_t count, uz_error *err)
{
    out->x = uz_alloc(count, sizeof *out->x);
    if (!out->x)
        return uz_no_memory(err, UZ_OF_SKIN);
    double low = INFINITY, high = -INFINITY;
    for (int64_t i = 0; i < count; i++) {
        low = fmin(low, value[place ? place[i] : i]); /* of two numbers of which one is NaN: the other */
        high = fmax(high, value[place ? place[i] : i]);
    }
    out->low = isfinite(low) ? low : 0;
    out->high = isfinite(high) ? high : 0;
    out->unit = unit_of(fmax(fabs(out->low), fabs(out->high)));
    for (int64_t i = 0; i < count; i++) {
        const double x = value[place ? place[i] : i] / out->unit;
        out->x[i] = isnan(x) ? -1 : (float)x;
    }
    return UZ_OK;
}

/* ----------------------------------------------------------------- contact */

static uz_status fill_rows(uz_surface *s, surface_work *w, uz_error *err)
{
    const uz_mesh_info *info = &w->model->info;
    const int64_t m = w->model->m;
    /* A group between two elements has nodes within the body: their rows are left out. */
    w->drawn = uz_alloc(m, sizeof *w->drawn);
    if (!w->drawn)
        return uz_no_memory(err, UZ_OF_SKIN);
    for (int64_t i = 0; i < m; i++)
        if (w->vertex_of[info->contact_node[i]] >= 0)
            w->drawn[s->n_rows++] = i;
    s->row_vertex = uz_alloc(s->n_rows, sizeof *s->row_vertex);
    s->row_contact = uz_alloc(s->n_rows, sizeof *s->row_contact);
    s->row_normal = uz_alloc_zero(3 * s->n_rows, sizeof *s->row_normal);
    if (!s->row_vertex || !s->row_contact || !s->row_normal)
        return uz_no_memory(err, UZ_OF_SKIN);
    for (int64_t i = 0; i < s->n_rows; i++) {
        const int64_t row = w->drawn[i];
        s->row_vertex[i] = (unsigned)w->vertex_of[info->contact_node[row]];
        s->row_contact[i] = (unsigned)info->contact_of[row];
        for (int c = 0; c < s->dim; c++)
            s->row_normal[3 * i + c] = (float)info->contact_normal[row * s->dim + c];
    }
    uz_status status = uz_draw_values(&s->reaction, w->answer->r, w->drawn, s->n_rows, err);
    if (status == UZ_OK && w->answer->g)
        status = uz_draw_values(&s->gap, w->answer->g, w->drawn, s->n_rows, err);
    if (status == UZ_OK && w->fields.pressure)
        status = uz_draw_values(&s->pressure, w->fields.pressure, w->drawn, s->n_rows, err);
    if (status != UZ_OK || s->dim != 2)
        return status;
    w->arc = uz_alloc(m, sizeof *w->arc);
    w->part = uz_alloc(m, sizeof *w->part);
    s->row_part = uz_alloc(s->n_rows, sizeof *s->row_part);
    if (!w->arc || !w->part || !s->row_part)
        return uz_no_memory(err, UZ_OF_SKIN);
    status = uz_contact_arc(w->arc, w->part, w->model, w->scene, err);
    for (int64_t i = 0; status == UZ_OK && i < s->n_rows; i++)
        s->row_part[i] = w->part[w->drawn[i]];
    return status == UZ_OK ? uz_draw_values(&s->arc, w->arc, w->drawn, s->n_rows, err) : status;
}

/* ------------------------------------------------------------------- whole */

static uz_status check_size(const uz_surface *s, const surface_work *w, size_t most_bytes, uz_error *err)
{
    const double vertices = (double)s->n_vertices, triangles = (double)s->n_triangles;
    const double bytes = 4 * (9 * vertices + 3 * triangles + 2 * (double)(w->edges.n_lines + w->edges.n_outline) +
                              10 * (double)w->model->m);
    if (s->n_vertices >= INT32_MAX || s->n_triangles >= INT32_MAX || (most_bytes > 0 && bytes > (double)most_bytes))
        return uz_fail(err, UZ_ERR_LIMIT, "",
                       "the surface has %.0f triangles and would take more than %.0f MB; %.0f MB may be", triangles,
                       floor(bytes / 1e6), (double)most_bytes / 1e6);
    return UZ_OK;
}

static uz_status build(uz_surface *s, surface_work *w, const uz_field_body *body, unsigned which, size_t most_bytes,
                       const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &w->model->mesh;
    const uz_skin *skin = &w->skin;
    const int(*triangle)[3];
    *s = (uz_surface){.dim = mesh->dim, .n_nodes = mesh->n_nodes, .n_elements = mesh->n_elements};
    uz_status status = uz_skin_build(&w->skin, mesh, hooks, err);
    if (status != UZ_OK)
        return status;
    /* The nodes that are drawn are numbered. */
    w->vertex_of = uz_alloc_zero(s->n_nodes, sizeof *w->vertex_of);
    if (!w->vertex_of)
        return uz_no_memory(err, UZ_OF_SKIN);
    for (int64_t i = 0; i < skin->first[skin->n_cells]; i++)
        w->vertex_of[skin->point[i]] = 1;
    for (int64_t a = 0; a < s->n_nodes; a++)
        w->vertex_of[a] = w->vertex_of[a] ? s->n_vertices++ : -1;
    if (s->n_vertices == 0)
        return uz_fail(err, UZ_ERR_SCENE, "/mesh", "every side lies between two elements: there is no surface");
    for (int64_t i = 0; i < skin->n_cells; i++)
        s->n_triangles += uz_cell_triangles(&triangle, (int)(skin->first[i + 1] - skin->first[i]));
    status = check_size(s, w, most_bytes, err); /* edges take several times as much while they are found */
    if (status == UZ_OK)
        status = uz_skin_edges_build(&w->edges, skin, mesh, err);
    if (status == UZ_OK)
        status = check_size(s, w, most_bytes, err);
    if (status == UZ_OK)
        status = uz_fields_of_body(&w->fields, body, w->answer, which & (UZ_FIELD_VON_MISES | UZ_FIELD_PRESSURE), hooks,
                                   err);
    if (status != UZ_OK)
        return status;
    s->n_lines = w->edges.n_lines;
    s->n_outline = w->edges.n_outline;
    s->line = as_vertices(w, w->edges.line, 2 * s->n_lines);
    s->outline = as_vertices(w, w->edges.outline, 2 * s->n_outline);
    s->triangle = uz_alloc(3 * s->n_triangles, sizeof *s->triangle);
    if (!s->line || !s->outline || !s->triangle)
        return uz_no_memory(err, UZ_OF_SKIN);
    for (int64_t i = 0, n = 0; i < skin->n_cells; i++) {
        const int64_t *point = skin->point + skin->first[i];
        const int count = uz_cell_triangles(&triangle, (int)(skin->first[i + 1] - skin->first[i]));
        for (int k = 0; k < 3 * count; k++)
            s->triangle[n++] = (unsigned)w->vertex_of[point[triangle[k / 3][k % 3]]];
    }
    status = fill_vertices(s, w, err);
    double *stress = w->fields.von_mises;
    for (int64_t a = 0; status == UZ_OK && stress && a < s->n_nodes; a++)
        if (w->vertex_of[a] >= 0) /* moves only to the front: vertices are numbered like nodes */
            stress[w->vertex_of[a]] = stress[a];
    if (status == UZ_OK && stress)
        status = uz_draw_values(&s->von_mises, stress, NULL, s->n_vertices, err);
    bool pair = false; /* else rows say it all */
    for (int64_t k = 0; k < w->scene->n_contacts; k++)
        pair = pair || w->scene->contacts[k].kind == UZ_OBSTACLE_BODY;
    if (status == UZ_OK && w->fields.pressure && pair) {
        double *touch = uz_alloc(s->n_nodes, sizeof *touch);
        status = touch ? uz_nodal_pressure(touch, w->model, w->scene, w->fields.pressure, err)
                       : uz_no_memory(err, UZ_OF_SKIN);
        for (int64_t a = 0; status == UZ_OK && a < s->n_nodes; a++)
            if (w->vertex_of[a] >= 0)
                touch[w->vertex_of[a]] = touch[a];
        if (status == UZ_OK)
            status = uz_draw_values(&s->touch, touch, NULL, s->n_vertices, err);
        free(touch);
    }
    return status == UZ_OK ? fill_rows(s, w, err) : status;
}

uz_status uz_surface_compute(uz_surface *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                             size_t most_bytes, const uz_hooks *hooks, uz_error *err)
{
    uz_body_model model;
    uz_field_body body = {.scene = scene};
    surface_work w = {.scene = scene, .model = &model, .answer = answer};
    uz_error_reset(err);
    memset(out, 0, sizeof *out);
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK)
        status = uz_scenery_check_answer(answer, &model, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    if (status == UZ_OK)
        status = build(out, &w, &body, which, most_bytes, hooks, err);
    uz_fields_clear(&w.fields);
    uz_skin_clear(&w.skin);
    uz_skin_edges_clear(&w.edges);
    uz_free_all(w.vertex_of, w.drawn, w.arc, w.part);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    if (status != UZ_OK)
        uz_surface_clear(out);
    return status;
}

void uz_surface_clear(uz_surface *s)
{
    if (!s)
        return;
    uz_free_all(s->position, s->displacement, s->node, s->von_mises.x, s->triangle, s->line, s->outline, s->row_vertex,
                s->row_contact, s->row_normal, s->reaction.x, s->gap.x, s->pressure.x, s->arc.x, s->row_part,
                s->touch.x);
    memset(s, 0, sizeof *s);
}
