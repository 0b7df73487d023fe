/* path.c: displacement and stress along a line through a body.
 *
 * A point of the line is looked for in the elements whose boxes the line crosses there, by Newton's iteration on their
 * shape functions; between nodes displacement and stress go as these do. The stress is that of the nodes (uz_fields),
 * continuous from element to element, and von Mises' is that of the tensor there and not a mean of those of nodes. */
#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "post/parts.h"

#include <math.h>
#include <string.h>

/* How far outside of an element, in its local coordinates, a point still counts as its own: rounding, and the sagitta
 * between a body's true border and its mesh has no place here. */
#define OUTSIDE 1e-8

/* The shape functions of an element at a place x; xyz: of its nodes. False: it is not in there. */
static bool find_within(double N[UZ_ELEMENT_NODES], const uz_element_type *type, const double *xyz, double extent,
                        const double x[3])
{
    double point[3];
    if (!uz_element_find(point, type, xyz, extent, x) || uz_element_depth(type, point) < -OUTSIDE)
        return false;
    type->shape(type, N, NULL, point);
    return true;
}

/* What is known at a place in an element. */
static void take_values(uz_path *out, int64_t sample, const double *N, const int64_t *node, int count, const double *u,
                        const double *stress)
{
    double *to_u = out->u + sample * out->dim, *to_s = out->stress + sample * out->components;
    memset(to_u, 0, (size_t)out->dim * sizeof *to_u);
    memset(to_s, 0, (size_t)out->components * sizeof *to_s);
    for (int a = 0; a < count; a++) {
        for (int c = 0; c < out->dim; c++)
            to_u[c] += N[a] * u[node[a] * out->dim + c];
        for (int c = 0; c < out->components; c++)
            to_s[c] += N[a] * stress[node[a] * out->components + c];
    }
    out->von_mises[sample] = uz_von_mises(to_s, out->components);
}

/* The samples that lie in the box of an element: first to before last. */
static void samples_in_box(int64_t *first, int64_t *last, const uz_path *out, const double *xyz, int count)
{
    double from = 0, to = 1;
    for (int c = 0; c < out->dim; c++) {
        double low = INFINITY, high = -INFINITY;
        for (int a = 0; a < count; a++) {
            low = fmin(low, xyz[a * out->dim + c]);
            high = fmax(high, xyz[a * out->dim + c]);
        }
        /* Quadratic sides may bulge out of the box of their nodes, by an eighth of it at most where they are valid. */
        const double room = 0.25 * (high - low), begin = out->point[c];
        const double way = out->point[(out->count - 1) * out->dim + c] - begin;
        const double a = (low - room - begin) / way, b = (high + room - begin) / way;
        if (way > 0 || way < 0) {
            from = fmax(from, fmin(a, b));
            to = fmin(to, fmax(a, b));
        } else if (begin < low - room || begin > high + room) {
            to = -1;
        }
    }
    *first = to < from ? 0 : (int64_t)ceil(from * (double)(out->count - 1) - 1e-6);
    *last = to < from ? 0 : (int64_t)floor(to * (double)(out->count - 1) + 1e-6) + 1;
    *first = *first < 0 ? 0 : *first;
    *last = *last > out->count ? out->count : *last;
}

static uz_status fill(uz_path *out, const uz_field_body *body, const uz_field_source *answer, const uz_hooks *hooks,
                      uz_error *err)
{
    const uz_body_model *model = body->model;
    uz_fields fields;
    uz_status status = uz_fields_of_body(&fields, body, answer, UZ_FIELD_STRESS, hooks, err);
    for (int64_t e = 0; status == UZ_OK && e < model->mesh.n_elements; e++) {
        double xyz[3 * UZ_ELEMENT_NODES], N[UZ_ELEMENT_NODES];
        int64_t first, last;
        int count;
        const int64_t *node = uz_mesh_element(&model->mesh, e, &count);
        if (e % 4096 == 0 && uz_cancelled(hooks))
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the path was followed");
        for (int k = 0; k < count * out->dim; k++) /* of the mesh: uz_body_element moves equal boxes */
            xyz[k] = model->mesh.xyz[node[k / out->dim] * out->dim + k % out->dim];
        samples_in_box(&first, &last, out, xyz, count);
        for (int64_t i = first; i < last; i++)
            if (isnan(out->von_mises[i]) && find_within(N, uz_element_type_of((uz_element_kind)model->mesh.kind[e]),
                                                        xyz, model->mesh.extent, out->point + i * out->dim))
                take_values(out, i, N, node, count, answer->u, fields.stress);
    }
    uz_fields_clear(&fields);
    return status;
}

uz_status uz_path_compute(uz_path *out, const uz_scene *scene, const uz_field_source *answer, const uz_path_line *line,
                          const uz_hooks *hooks, uz_error *err)
{
    uz_body_model model;
    uz_field_body body = {.scene = scene};
    uz_error_reset(err);
    *out = (uz_path){.dim = uz_scene_dim(scene), .count = line->count};
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    if (status == UZ_OK && (!answer->u || answer->n_u != model.mesh.n_nodes * out->dim))
        status = uz_fail(err, UZ_ERR_SIZE, "u", "a path needs the displacements of all nodes");
    out->components = body.components;
    if (status == UZ_OK) {
        out->point = uz_alloc(line->count * out->dim, sizeof *out->point);
        out->u = uz_alloc(line->count * out->dim, sizeof *out->u);
        out->stress = uz_alloc(line->count * out->components, sizeof *out->stress);
        out->von_mises = uz_alloc(line->count, sizeof *out->von_mises);
        if (!out->point || !out->u || !out->stress || !out->von_mises)
            status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a path of %lld points", (long long)line->count);
    }
    for (int64_t i = 0; status == UZ_OK && i < line->count; i++) {
        const double t = (double)i / (double)(line->count - 1);
        out->von_mises[i] = NAN;
        for (int c = 0; c < out->dim; c++) {
            out->point[i * out->dim + c] = (1 - t) * line->from[c] + t * line->to[c];
            out->u[i * out->dim + c] = NAN;
        }
        for (int c = 0; c < out->components; c++)
            out->stress[i * out->components + c] = NAN;
    }
    if (status == UZ_OK)
        status = fill(out, &body, answer, hooks, err);
    if (status != UZ_OK)
        uz_path_clear(out);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    return status;
}

void uz_path_clear(uz_path *path)
{
    uz_free_all(path->point, path->u, path->stress, path->von_mises);
    *path = (uz_path){.point = NULL};
}
