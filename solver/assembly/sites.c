/* sites.c: where the nodes of contact groups stand to obstacles that are no planes. */
#include "assembly/parts.h"

#include "core/alloc.h"
#include "core/error.h"

uz_status uz_find_sites(uz_body_model *model, const uz_scene *scene, uz_error *err)
{
    model->sites = uz_alloc_zero(scene->n_contacts, sizeof *model->sites);
    if (!model->sites)
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld contacts", (long long)scene->n_contacts);
    model->n_sites = scene->n_contacts;
    return UZ_OK;
}
