/* finite_place.c: a displacement, and what follows from it: forces, rigid groups, and the rows of contact there. */
#include "run/finite.h"

#include "assembly/parts.h"
#include "core/alloc.h"
#include "core/error.h"

#include <math.h>
#include <string.h>

uz_status uz_finite_place_init(uz_finite_place *place, const uz_finite_run *run, uz_error *err)
{
    place->u = uz_alloc_zero(run->n, sizeof *place->u);
    place->force = uz_alloc_zero(run->n, sizeof *place->force);
    place->loads = uz_alloc_zero(run->n, sizeof *place->loads);
    place->given = uz_alloc_zero(run->base.n_fixed, sizeof *place->given);
    return place->u && place->force && place->loads && place->given
               ? UZ_OK
               : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the place of %lld nodes",
                         (long long)run->base.mesh.n_nodes);
}

static void forget_rows(uz_finite_place *place)
{
    uz_body_model_clear(&place->rows);
    uz_body_turned_clear(&place->turned);
    uz_free_all(place->h, place->gap);
    place->h = place->gap = NULL;
}

void uz_finite_place_clear(uz_finite_place *place)
{
    forget_rows(place);
    uz_free_all(place->u, place->force, place->loads, place->given);
    memset(place, 0, sizeof *place);
}

void uz_finite_restrict(double *v, const uz_finite_place *place)
{
    static const double NOTHING[3] = {0};
    const uz_body_model *model = &place->turned;
    uz_restrict_nodal(v, model, place->u);
    for (int64_t k = 0; k < model->n_rigid; k++)
        uz_set_motion(v, model, &model->rigid[k], NOTHING, NOTHING);
}

void uz_finite_lead(double *to, const uz_finite_place *place, const double *v)
{
    const uz_body_model *model = &place->turned;
    const int dim = model->mesh.dim;
    uz_recover_nodal(to, model, v, place->given);
    for (int64_t a = 0; a < model->mesh.n_nodes && model->n_rigid > 0; a++) {
        double rigid[3];
        uz_rigid_part(rigid, model, a, place->u);
        for (int c = 0; c < dim; c++)
            to[a * dim + c] += rigid[c];
    }
}

/* Gaps as the rows have them, with supports where the load has them. */
static uz_status find_gaps(uz_finite_place *place, uz_finite_run *run, uz_error *err)
{
    const int64_t m = place->rows.m;
    uz_finite_restrict(run->v, place);
    place->h = uz_alloc(m, sizeof *place->h);
    place->gap = uz_alloc(m, sizeof *place->gap);
    if (!place->h || !place->gap)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld gaps", (long long)m);
    const uz_status status = uz_initial_gaps(place->h, place->given, &place->rows, &run->scene, err);
    if (status != UZ_OK)
        return status;
    for (int64_t i = 0; i < m; i++)
        place->h[i] += (1 - run->load) * run->overlap[place->rows.info.contact_of[i]];
    memcpy(place->gap, place->h, (size_t)m * sizeof *place->gap);
    uz_csc_gaxpy(place->gap, &place->rows.N, -1, run->v);
    place->violation = 0;
    for (int64_t i = 0; i < m; i++)
        place->violation += fmax(0, -place->gap[i]);
    return UZ_OK;
}

uz_status uz_finite_place_groups(uz_finite_place *place, const uz_finite_run *run, uz_error *err)
{
    uz_body_turned_clear(&place->turned);
    memcpy(place->given, run->prescribed, (size_t)run->base.n_fixed * sizeof *place->given);
    uz_rigid_ways(place->given, &run->base, run->prescribed, place->u);
    return uz_body_turned(&place->turned, &run->base, place->u, err);
}

uz_status uz_finite_place_find(bool *fits, uz_finite_place *place, uz_finite_run *run, uz_error *err)
{
    uz_error own = {0};
    forget_rows(place);
    uz_finite_body(&place->body, place->force, NULL, &run->base, run->free_strain, place->u, NULL);
    *fits = place->body.least_det > 0 && isfinite(place->body.energy);
    if (!*fits)
        return UZ_OK;
    memcpy(place->loads, run->loads, (size_t)run->n * sizeof *place->loads);
    uz_status status = run->follows ? uz_follower_loads(place->loads, &run->base, &run->scene, place->u, &own) : UZ_OK;
    run->scene.place = place->u;
    if (status == UZ_OK)
        status = uz_finite_place_groups(place, run, &own);
    if (status == UZ_OK)
        status = uz_body_model_move(&place->rows, &place->turned, &run->scene, &own);
    if (status == UZ_OK)
        status = find_gaps(place, run, &own);
    run->scene.place = NULL;
    if (status == UZ_ERR_SCENE && (run->found.qps > 0 || run->near)) { /* the scene is good: the place is not */
        *fits = false;
        return UZ_OK;
    }
    if (status != UZ_OK && err)
        *err = own;
    return status;
}
