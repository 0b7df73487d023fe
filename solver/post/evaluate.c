#include "post/evaluate.h"

#include "core/alloc.h"
#include "core/error.h"
#include "post/balance.h"
#include "post/parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void uz_evaluation_free(uz_evaluation *evaluation)
{
    if (!evaluation)
        return;
    free(evaluation->contacts);
    free(evaluation->supports);
    free(evaluation);
}

static uz_status make_evaluation(uz_evaluation **out, const uz_scene *scene, uz_error *err)
{
    uz_evaluation *e = uz_alloc_zero(1, sizeof *e);
    *out = e;
    if (!e)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a summary");
    e->n_contacts = scene->n_contacts;
    e->n_supports = scene->n_supports;
    e->peak_node = -1;
    e->contacts = uz_alloc_zero(e->n_contacts, sizeof *e->contacts);
    e->supports = uz_alloc_zero(e->n_supports, sizeof *e->supports);
    if (!e->contacts || !e->supports)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld resultants",
                       (long long)(e->n_contacts + e->n_supports));
    for (int64_t i = 0; i < e->n_contacts; i++)
        memcpy(e->contacts[i].on, scene->contacts[i].on, sizeof e->contacts[i].on);
    for (int64_t i = 0; i < e->n_supports; i++)
        memcpy(e->supports[i].on, scene->supports[i].on, sizeof e->supports[i].on);
    return UZ_OK;
}

/* Force, area and peak of the contact: the obstacle pushes a row's node along its normal by -push (m, uz_row_forces),
 * and `on` is pushed the other way where the other side has the rows. */
static void evaluate_contact(uz_result *result, uz_evaluation *e, const uz_body_model *model, const double *push)
{
    const uz_law *law = model->law;
    uz_summary *summary = &result->summary;
    const uz_mesh_info *mesh = &result->mesh;
    summary->dim = mesh->dim;
    summary->max_pressure = 0.0;
    for (int64_t i = 0; i < result->m; i++) {
        const int64_t node = mesh->contact_node[i];
        const bool swapped = model->sites && model->sites[mesh->contact_of[i]].swapped;
        for (int axis = 0; axis < mesh->dim; axis++)
            summary->force[axis] -= (swapped ? -push[i] : push[i]) * mesh->contact_normal[i * mesh->dim + axis];
        if (law->kind->active(law, NULL, &result->r[i], 1) > 0)
            e->contact_area += mesh->contact_area[i];
        if (!(result->pressure[i] > summary->max_pressure))
            continue;
        summary->max_pressure = result->pressure[i];
        e->peak_node = node;
        for (int axis = 0; axis < mesh->dim; axis++)
            e->peak_at[axis] = mesh->xyz[node * mesh->dim + axis];
    }
}

uz_status uz_evaluate(uz_result *result, const uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    uz_status status = make_evaluation(&result->evaluation, scene, err);
    if (status != UZ_OK)
        return status;
    result->summary.evaluation = result->evaluation;
    result->pressure = uz_alloc(result->m, sizeof *result->pressure);
    if (!result->pressure)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the pressure on %lld rows", (long long)result->m);
    status = uz_contact_pressure(result->pressure, model, scene, result->r, err);
    if (status != UZ_OK)
        return status;
    double *push = uz_alloc(result->m, sizeof *push);
    if (!push)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the forces of %lld rows", (long long)result->m);
    uz_row_forces(push, model, result->r);
    evaluate_contact(result, result->evaluation, model, push);
    free(push);
    status = uz_find_doubts(result->evaluation, model, scene, result->u, result->r, err);
    if (status != UZ_OK)
        return status;
    return uz_balance_forces(result->evaluation, model, scene, result->u, result->r, err);
}
