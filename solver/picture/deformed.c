/* deformed.c: a picture of an answer. */
#include "core/alloc.h"
#include "core/error.h"
#include "picture/scenery.h"

#include <math.h>

enum { WIDTH = 900 };

static const char STYLE[] =
    "<style>text{font:12px system-ui,sans-serif;fill:#333}.title{font-weight:600}path{fill:none}"
    ".edge{stroke:#28282f;stroke-width:.6}.before{stroke:#9aa0a8;stroke-dasharray:4 "
    "3}.obstacle{stroke:#555;stroke-width:2}.ticks{stroke:#888}"
    ".push{stroke:#c2255c;stroke-width:1.5}.axis{stroke:#333}"
    ".mark{paint-order:stroke;stroke:#fff;stroke-width:3}</style>\n";

static const struct {
    uz_field field;
    const char *what;
} COLOURS[] = {{UZ_FIELD_DISPLACEMENTS, "displacement"},
               {UZ_FIELD_VON_MISES, "von Mises stress"},
               {UZ_FIELD_PRESSURE, "contact pressure"}};
enum { N_COLOURS = sizeof COLOURS / sizeof COLOURS[0] };

/* Lengths of the displacements, the stress or the pressure (NaN where there is none), by node. */
static uz_status make_values(double **out, uz_scenery *scenery, const uz_field_body *body, uz_field colour,
                             const uz_hooks *hooks, uz_error *err)
{
    const uz_mesh *mesh = &scenery->model->mesh;
    uz_fields fields;
    uz_status status = uz_fields_of_body(&fields, body, scenery->answer, (unsigned)colour, hooks, err);
    if (status == UZ_OK && colour == UZ_FIELD_VON_MISES) {
        *out = fields.von_mises;
        fields.von_mises = NULL;
    } else if (status == UZ_OK && !(*out = uz_alloc_zero(mesh->n_nodes, sizeof **out))) {
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the colours of %lld nodes", (long long)mesh->n_nodes);
    } else if (status == UZ_OK && colour == UZ_FIELD_PRESSURE) {
        status = uz_nodal_pressure(*out, scenery->model, scenery->scene, fields.pressure, err);
    }
    uz_fields_clear(&fields);
    for (int64_t i = 0; status == UZ_OK && colour == UZ_FIELD_DISPLACEMENTS && i < mesh->n_nodes * mesh->dim; i++)
        (*out)[i / mesh->dim] = hypot((*out)[i / mesh->dim], scenery->answer->u[i]);
    return status;
}

/* From back to front: obstacles of a solid, the outline before the deformation, the body, obstacles of a plane, arrows.
 */
static uz_status put_body(uz_buffer *svg, uz_scenery *scenery, const uz_skin *skin, const uz_hooks *hooks,
                          uz_error *err)
{
    uz_raster raster;
    uz_skin_edges edges;
    uz_status status = uz_skin_edges_build(&edges, skin, &scenery->model->mesh, err);
    if (status != UZ_OK)
        return status;
    status = uz_raster_init(&raster, scenery->width, scenery->height, err);
    if (status == UZ_OK && uz_scenery_paint_obstacles(&raster, scenery)) {
        status = uz_raster_put_image(svg, &raster, err);
        uz_raster_wipe(&raster);
    }
    if (status == UZ_OK) {
        uz_scenery_put_outline(svg, scenery, &edges);
        status = uz_scenery_paint(&raster, scenery, skin, hooks, err);
    }
    if (status == UZ_OK && scenery->contacts_only)
        status = uz_scenery_paint_contacts(&raster, scenery, err);
    if (status == UZ_OK)
        status = uz_raster_put_image(svg, &raster, err);
    if (status == UZ_OK) {
        uz_scenery_put_edges(svg, scenery, &edges, &raster);
        uz_scenery_put_obstacles(svg, scenery);
        scenery->longest_arrow = uz_scenery_put_arrows(
            svg, scenery, scenery->model->mesh.dim == 3 && !scenery->contacts_only ? &raster : NULL);
    }
    uz_raster_clear(&raster);
    uz_skin_edges_clear(&edges);
    return status;
}

static uz_status draw(uz_buffer *svg, uz_scenery *scenery, const uz_field_body *body, const uz_picture *how,
                      const uz_hooks *hooks, uz_error *err)
{
    double *value = NULL, *pressure = NULL;
    uz_skin skin;
    uz_status status = uz_skin_build(&skin, &scenery->model->mesh, hooks, err);
    if (status == UZ_OK)
        status = make_values(&value, scenery, body, how->colour, hooks, err);
    if (status == UZ_OK && !(pressure = uz_alloc(scenery->model->m, sizeof *pressure)))
        status =
            uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld rows", (long long)scenery->model->m);
    if (status == UZ_OK)
        status = uz_contact_pressure(pressure, scenery->model, scenery->scene, scenery->answer->r, err);
    scenery->value = value;
    scenery->pressure = pressure;
    if (status == UZ_OK) {
        for (int64_t i = 0; i < scenery->model->m; i++)
            scenery->largest_push = fmax(scenery->largest_push, pressure[i]);
        scenery->contacts_only = how->colour == UZ_FIELD_PRESSURE;
        scenery->is_length = how->colour == UZ_FIELD_DISPLACEMENTS;
        scenery->low = scenery->contacts_only ? 0 : INFINITY;
        scenery->high = scenery->contacts_only ? 0 : -INFINITY;
        for (int64_t a = 0; a < scenery->model->mesh.n_nodes; a++) {
            scenery->low = fmin(scenery->low, scenery->value[a]);
            scenery->high = fmax(scenery->high, scenery->value[a]);
        }
        for (int i = 0; i < N_COLOURS; i++)
            if (COLOURS[i].field == how->colour)
                scenery->what = COLOURS[i].what;
        status = uz_scenery_fit(scenery, err);
    }
    if (status == UZ_OK) {
        const int height = scenery->height + uz_scenery_legend_height(scenery);
        uz_buffer_print(svg,
                        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" height=\"%d\" "
                        "role=\"img\">\n<title>",
                        scenery->width, height, scenery->width, height);
        uz_buffer_put_escaped(svg, how->title ? how->title : "deformed body");
        uz_buffer_print(svg, "</title>\n%s<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n", STYLE, scenery->width,
                        height);
        uz_buffer_print(svg, "<svg width=\"%d\" height=\"%d\">\n", scenery->width, scenery->height);
        status = put_body(svg, scenery, &skin, hooks, err);
    }
    if (status == UZ_OK) {
        uz_scenery_put_axes(svg, scenery);
        uz_buffer_print(svg, "</svg>\n");
        uz_scenery_put_legend(svg, scenery, how->title);
        uz_buffer_print(svg, "</svg>\n");
    }
    uz_free_all(value, pressure);
    uz_skin_clear(&skin);
    return status;
}

uz_status uz_scenery_check_answer(const uz_field_source *answer, const uz_body_model *model, uz_error *err)
{
    const int64_t n_u = model->mesh.n_nodes * model->mesh.dim;
    if (!answer->u || answer->n_u != n_u || answer->m != model->m || (model->m > 0 && !answer->r))
        return uz_fail(err, UZ_ERR_SIZE, "u", "a picture needs %lld displacements and %lld reactions", (long long)n_u,
                       (long long)model->m);
    for (int64_t i = 0; i < n_u; i++)
        if (!isfinite(answer->u[i]))
            return uz_fail(err, UZ_ERR_NOT_FINITE, "u", "the displacement %lld is not finite: there is no answer",
                           (long long)i);
    return UZ_OK;
}

uz_status uz_picture_deformed(char **svg, size_t *len, const uz_scene *scene, const uz_field_source *answer,
                              const uz_picture *how, const uz_hooks *hooks, uz_error *err)
{
    uz_body_model model;
    uz_field_body body = {.scene = scene};
    uz_buffer text = {0};
    uz_error_reset(err);
    *svg = NULL;
    *len = 0;
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, err);
    if (status == UZ_OK && how->width != 0 && (how->width < 200 || how->width > 4000))
        status =
            uz_fail(err, UZ_ERR_ARGUMENT, "", "the width of a picture must lie in 200 to 4000, it is %d", how->width);
    if (status == UZ_OK && !(how->factor >= 0 && isfinite(how->factor)))
        status = uz_fail(err, UZ_ERR_ARGUMENT, "", "the factor of the displacements must not be negative");
    bool known = false;
    for (int i = 0; i < N_COLOURS; i++)
        known = known || COLOURS[i].field == how->colour;
    if (status == UZ_OK && !known)
        status = uz_fail(err, UZ_ERR_ARGUMENT, "", "a picture shows displacements, von_mises or pressure");
    if (status == UZ_OK)
        status = uz_scenery_check_answer(answer, &model, err);
    if (status == UZ_OK)
        status = uz_field_body_init(&body, scene, &model, err);
    if (status == UZ_OK) {
        uz_scenery scenery = {.scene = scene,
                              .model = &model,
                              .answer = answer,
                              .factor = how->factor,
                              .view = how->view,
                              .z_up = how->z_up,
                              .width = how->width ? how->width : WIDTH};
        status = draw(&text, &scenery, &body, how, hooks, err);
    }
    if (status == UZ_OK)
        status = uz_buffer_finish(svg, len, &text, err);
    uz_buffer_drop(&text);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    return status;
}
