/* peak_stress.c: where the body is stressed most: von Mises' stress of the nodes, inside the body as on its surface,
 * and its part of the yield stress. It takes as long as the field, so that only scenes which ask pay for it. */
#include "post/parts.h"
#include "post/trend.h"

#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <stdlib.h>

/* Of the elements around each node. */
typedef struct {
    double volume, yield; /* sum; the least, INFINITY: none has any */
    int64_t count;
} around;

static void look_around(around *of, const uz_body_model *model, const uz_scene *scene)
{
    const uz_mesh *mesh = &model->mesh;
    for (int64_t a = 0; a < mesh->n_nodes; a++)
        of[a] = (around){.yield = INFINITY};
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        uz_element element;
        double xyz[3 * UZ_ELEMENT_NODES];
        int count;
        const int64_t *node = uz_mesh_element(mesh, e, &count);
        const double yield = scene->materials[model->material_of ? model->material_of[e] : 0].yield;
        uz_body_element(&element, xyz, model, e);
        const double volume = uz_element_volume(&element);
        for (int a = 0; a < count; a++) {
            of[node[a]].volume += volume;
            of[node[a]].count++;
            if (yield > 0)
                of[node[a]].yield = fmin(of[node[a]].yield, yield);
        }
    }
}

static void take(uz_peak *peak, double value, int64_t node)
{
    if (value > peak->value || (peak->node < 0 && value >= 0)) {
        peak->value = value;
        peak->node = node;
    }
}

static void locate(uz_peak *peak, const uz_body_model *model, const around *of)
{
    const int dim = model->mesh.dim;
    if (peak->node < 0) {
        peak->value = NAN;
    } else {
        for (int axis = 0; axis < dim; axis++)
            peak->at[axis] = model->mesh.xyz[peak->node * dim + axis];
        peak->size = pow(of[peak->node].volume / (double)of[peak->node].count, 1.0 / dim);
    }
    uz_trend_fit(&peak->trend, &(uz_trend_point){peak->size, peak->value}, 1, peak->value, 0.0);
}

uz_status uz_find_peak_stress(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                              uz_error *err)
{
    uz_field_body body = {.scene = scene};
    uz_fields fields = {0};
    out->von_mises = out->used = (uz_peak){.node = -1};
    out->stressed = scene->peak_stress;
    for (int64_t i = 0; i < scene->n_materials; i++)
        out->stressed = out->stressed || scene->materials[i].yield > 0;
    if (!out->stressed)
        return UZ_OK;
    around *of = uz_alloc(model->mesh.n_nodes, sizeof *of);
    uz_status status = of ? uz_field_body_init(&body, scene, model, err) : uz_no_memory(err, "the largest stress");
    const uz_field_source answer = {.u = u, .n_u = model->mesh.n_nodes * model->mesh.dim};
    if (status == UZ_OK)
        status = uz_fields_of_body(&fields, &body, &answer, UZ_FIELD_VON_MISES, NULL, err);
    if (status == UZ_OK) {
        look_around(of, model, scene);
        for (int64_t a = 0; a < model->mesh.n_nodes; a++) {
            take(&out->von_mises, fields.von_mises[a], a);
            if (isfinite(of[a].yield))
                take(&out->used, fields.von_mises[a] / of[a].yield, a);
        }
        locate(&out->von_mises, model, of);
        locate(&out->used, model, of);
    }
    uz_fields_clear(&fields);
    uz_field_body_clear(&body);
    free(of);
    return status;
}
