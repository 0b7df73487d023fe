/* energy_slope.h: is an answer of finite kinematics an equilibrium, by differences of the energy alone? */
#ifndef TESTS_ENERGY_SLOPE_H
#define TESTS_ENERGY_SLOPE_H

#include "body_fixture.h"
#include "finite/finite_body.h"
#include "qp_fixture.h"

/* The slope of the energy along a random motion that leaves supports where they are, and the nodes that stay (n_nodes):
 * those of contacts. By the sizes of forces. */
static inline double energy_slope(const uz_result *r, const uz_scene *scene, const bool *stays, qp_random *rng)
{
    uz_body_model model = body_model(scene);
    const int dim = r->mesh.dim;
    const int64_t n = dim * r->n_nodes;
    double *u = body_room(n, sizeof *u), *v = body_room(n, sizeof *v), *f = body_room(n, sizeof *f), norm = 0, work = 0;
    const double h = 1e-5; /* of fourth order, as flat elements have large third derivatives */
    static const double WAY[] = {-2, -1, 1, 2};
    uz_finite_measure at[4];
    uz_error err = {0};
    uz_scene part = *scene;
    CHECK_INT(uz_nodal_loads(f, &model, &part, &err), UZ_OK);
    for (int64_t i = 0; i < n; i++)
        v[i] = model.dof[i] < 0 && !model.frame_of ? 0 : random_signed(rng);
    for (int64_t a = 0; a < r->n_nodes; a++) {
        bool held = stays[a];
        for (int c = 0; c < dim; c++)
            held = held || model.dof[dim * a + c] < 0;
        for (int c = 0; c < dim; c++)
            v[dim * a + c] *= !held;
    }
    for (int s = 0; s < 4; s++) {
        for (int64_t i = 0; i < n; i++)
            u[i] = r->u[i] + WAY[s] * h * v[i];
        uz_finite_body(&at[s], NULL, NULL, &model, NULL, u, NULL);
    }
    for (int64_t i = 0; i < n; i++) {
        work += f[i] * v[i];
        norm += v[i] * v[i];
    }
    free(u);
    free(v);
    free(f);
    uz_body_model_clear(&model);
    const double slope = (8 * (at[2].energy - at[1].energy) - (at[3].energy - at[0].energy)) / (12 * h);
    return norm > 0 ? fabs(slope - work) / sqrt(norm) : 0;
}

#endif
