/* scene_norm.h: what a relative error of a scene is relative to. */
#ifndef TESTS_SCENE_NORM_H
#define TESTS_SCENE_NORM_H

#include "assembly/assembly.h"
#include "certificate/bound.h"
#include "judge.h"

#include <stdlib.h>

/* Where supports move the body, known->norm becomes that of the whole body. */
static inline void take_whole_norm(truth *known, const uz_body_model *model, const uz_scene *scene)
{
    double *p = calloc((size_t)(model->d + model->m + model->n_fixed) + 1, sizeof *p), *u = p, norm;
    double *prescribed = p + model->d + model->m;
    if (!p)
        abort();
    if (known->feasible && uz_body_model_load(p, p + model->d, prescribed, model, scene, NULL) == UZ_OK &&
        uz_is_moved(model, prescribed)) {
        for (int64_t j = 0; j < model->d; j++)
            u[j] = (double)known->best.u[j];
        if (uz_whole_norm(&norm, model, u, prescribed, NULL) == UZ_OK)
            known->norm = uz_bound_reference(norm, (double)known->norm, 0,
                                             uz_is_loaded(model, scene) ? UZ_ACTING_LOADS : UZ_ACTING_NOTHING);
    }
    free(p);
}

#endif
