/* mesh_error.c: what the mesh loses, of an answer that is there. */
#include "assembly/assembly.h"
#include "core/error.h"
#include "core/hooks.h"

#include <math.h>

uz_status uz_mesh_error(double *error, const uz_scene *scene, const uz_field_source *answer, const uz_hooks *hooks,
                        uz_error *err)
{
    uz_body_model model;
    *error = NAN;
    uz_error_reset(err);
    uz_status status = uz_body_model_outline(&model, scene, err);
    const int64_t n_u = status == UZ_OK ? model.mesh.n_nodes * model.mesh.dim : 0;
    if (status == UZ_OK && (!answer->u || answer->n_u != n_u))
        status = uz_fail(err, UZ_ERR_SIZE, "u", "an estimate needs %lld displacements", (long long)n_u);
    for (int64_t i = 0; status == UZ_OK && i < n_u; i++)
        if (!isfinite(answer->u[i]))
            status = uz_fail(err, UZ_ERR_NOT_FINITE, "u", "the displacement %lld is not finite: there is no answer",
                             (long long)i);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before the estimate");
    if (status == UZ_OK)
        *error = uz_estimate_mesh_error(&model, scene, answer->u);
    uz_body_model_clear(&model);
    return status;
}
