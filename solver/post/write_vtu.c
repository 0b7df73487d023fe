/* write_vtu.c: an answer as a file for ParaView and whatever else reads VTK's formats. */
#include "post/parts.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/hooks.h"
#include "io/vtu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is written, and from what. */
typedef struct {
    uz_buffer vtu;
    const uz_field_body *body;
    const uz_fields *fields;
    double *room;     /* 6 x n_nodes: for one array at a time */
    bool *has_row;    /* n_nodes */
    double *pressure; /* n_nodes, on both sides of a contact; 0 elsewhere */
} writing;

static void put_nodal(writing *w, uz_field field, const double *data, int components, const char *const *labels)
{
    uz_vtu_array(&w->vtu, uz_field_name(field), UZ_VTU_DOUBLE, data, w->fields->n_nodes, components, labels);
}

static void put_tensor(writing *w, uz_field field, const double *data)
{
    const int components = w->fields->components;
    if (!data)
        return;
    memset(w->room, 0, (size_t)(6 * w->fields->n_nodes) * sizeof *w->room);
    for (int64_t a = 0; a < w->fields->n_nodes; a++)
        memcpy(w->room + 6 * a, data + components * a, (size_t)components * sizeof *data);
    put_nodal(w, field, w->room, 6, uz_field_components(3));
}

/* What rows have, at their nodes: of several the largest, or the smallest. */
static void put_rows(writing *w, uz_field field, const double *data, double elsewhere, bool largest)
{
    const uz_body_model *model = w->body->model;
    bool *has_row = w->has_row;
    if (!data)
        return;
    memset(has_row, 0, (size_t)w->fields->n_nodes);
    for (int64_t a = 0; a < w->fields->n_nodes; a++)
        w->room[a] = elsewhere;
    for (int64_t i = 0; i < model->m; i++) {
        const int64_t a = model->info.contact_node[i];
        if (!has_row[a] || (largest ? data[i] > w->room[a] : data[i] < w->room[a]))
            w->room[a] = data[i];
        has_row[a] = true;
    }
    put_nodal(w, field, w->room, 1, NULL);
}

static void write_all(writing *w, const uz_field_source *answer, unsigned which)
{
    const uz_fields *f = w->fields;
    uz_vtu_begin(&w->vtu, &w->body->model->mesh);
    uz_buffer_print(&w->vtu, "      <PointData>\n");
    /* Vectors and tensors have all their components there, also in the plane. */
    if (which & UZ_FIELD_DISPLACEMENTS && answer->u) {
        memset(w->room, 0, (size_t)(3 * f->n_nodes) * sizeof *w->room);
        for (int64_t a = 0; a < f->n_nodes; a++)
            memcpy(w->room + 3 * a, answer->u + f->dim * a, (size_t)f->dim * sizeof *answer->u);
        put_nodal(w, UZ_FIELD_DISPLACEMENTS, w->room, 3, (const char *const[]){"x", "y", "z"});
    }
    put_tensor(w, UZ_FIELD_STRESS, f->stress);
    if (f->principal)
        put_nodal(w, UZ_FIELD_PRINCIPAL, f->principal, 3, NULL);
    if (f->von_mises)
        put_nodal(w, UZ_FIELD_VON_MISES, f->von_mises, 1, NULL);
    put_tensor(w, UZ_FIELD_STRAIN, f->strain);
    if (f->pressure)
        put_nodal(w, UZ_FIELD_PRESSURE, w->pressure, 1, NULL);
    put_rows(w, UZ_FIELD_CONTACT_STATUS, f->contact_status, -1, true);
    put_rows(w, UZ_FIELD_REACTIONS, which & UZ_FIELD_REACTIONS ? answer->r : NULL, 0, false);
    put_rows(w, UZ_FIELD_GAPS, which & UZ_FIELD_GAPS ? answer->g : NULL, NAN, false);
    uz_buffer_print(&w->vtu, "      </PointData>\n");
    int64_t *material = which & UZ_FIELD_MATERIALS ? uz_alloc(f->n_elements, sizeof *material) : NULL;
    if (which & UZ_FIELD_MATERIALS && !material)
        w->vtu.failed = true;
    for (int64_t e = 0; material && e < f->n_elements; e++)
        material[e] = w->body->model->material_of ? w->body->model->material_of[e] : 0;
    if (material) {
        uz_buffer_print(&w->vtu, "      <CellData>\n");
        uz_vtu_array(&w->vtu, uz_field_name(UZ_FIELD_MATERIALS), UZ_VTU_INT64, material, f->n_elements, 1, NULL);
        uz_buffer_print(&w->vtu, "      </CellData>\n");
    }
    free(material);
}

uz_status uz_vtu_write(char **text, size_t *len, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                       const uz_hooks *hooks, uz_error *err)
{
    uz_body_model model;
    uz_fields fields;
    uz_field_body body = {.scene = scene};
    uz_error_reset(err);
    *text = NULL;
    *len = 0;
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    if (status == UZ_OK)
        status = uz_fields_of_body(&fields, &body, answer, which & ~(unsigned)UZ_FIELD_STRESS_GAUSS, hooks, err);
    if (status == UZ_OK) {
        writing w = {.body = &body,
                     .fields = &fields,
                     .room = uz_alloc(6 * fields.n_nodes, sizeof *w.room),
                     .has_row = uz_alloc(fields.n_nodes, sizeof *w.has_row),
                     .pressure = fields.pressure ? uz_alloc(fields.n_nodes, sizeof *w.pressure) : NULL};
        if (!w.room || !w.has_row || (fields.pressure && !w.pressure))
            status = uz_no_memory(err, "a vtu file");
        else if (uz_cancelled(hooks))
            status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the file was written");
        if (status == UZ_OK && w.pressure)
            status = uz_nodal_pressure(w.pressure, &model, scene, fields.pressure, err);
        for (int64_t a = 0; status == UZ_OK && w.pressure && a < fields.n_nodes; a++)
            w.pressure[a] = isnan(w.pressure[a]) ? 0 : w.pressure[a];
        if (status == UZ_OK) {
            write_all(&w, answer, which);
            status = uz_vtu_finish(text, len, &w.vtu, err);
        }
        uz_free_all(w.room, w.has_row, w.pressure);
        uz_fields_clear(&fields);
    }
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    return status;
}
