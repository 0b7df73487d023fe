/* The bound holds for the displacements that are told, along the axes, also where supports hold turned dofs. */
#include "body_fixture.h"
#include "internal_forces.h"

#include "assembly/assembly.h"

/* A block that inclined supports carry far away, as a whole: no strain but that of rounding. */
TEST(a_block_carried_far_by_inclined_supports)
{
    static const double far[] = {1, 1e3, 1e6};
    for (int k = 0; k < 6; k++) {
        const bool solid = k >= 3;
        const int dim = solid ? 3 : 2;
        uz_scene s = body_scene(solid ? UZ_SOLID : UZ_PLANE_STRAIN, solid ? "hex8" : "quad4", (double[3]){2, 1, 1},
                                (int64_t[3]){3, 2, 2});
        const double n[3][3] = {{1, 0.3, solid ? 0.1 : 0}, {-0.2, 1, solid ? 0.4 : 0}, {0.3, -0.1, 1}};
        for (int c = 0; c < dim; c++)
            body_hold_normal(&s, "top", n[c], far[k % 3] * (1 + c));
        uz_error err = {0};
        uz_body_model model;
        uz_result *x = body_solve(&s, 1e-8);
        CHECK(uz_body_model_build(&model, &s, UZ_BODY_HELD, &err) == UZ_OK);
        const int64_t total = x->n_nodes * dim;
        double *d = body_room(total, sizeof *d), *f = body_room(total, sizeof *f), energy = 0;
        for (int64_t i = 0; i < total; i++)
            d[i] = x->u[i] - x->u[i % dim]; /* exact: they are close to each other */
        CHECK(internal_forces(f, &model, d));
        for (int64_t i = 0; i < total; i++)
            energy += f[i] * d[i];
        CHECK_MSG(energy <= x->summary.certificate.absolute_error * x->summary.certificate.absolute_error,
                  "%dD, moved by %g: off by %g, bound %g", dim, far[k % 3], sqrt(energy),
                  x->summary.certificate.absolute_error);
        free(d);
        free(f);
        uz_body_model_clear(&model);
        uz_result_free(x);
        uz_scene_clear(&s);
    }
}

/* The claim is about the bound that is told, not about what it was before it was widened. */
TEST(an_answer_is_not_verified_beyond_its_bound)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE};
    uz_scene *s = &problem.scene;
    *s = body_scene(UZ_PLANE_STRAIN, "quad4", (double[3]){2, 1, 1}, (int64_t[3]){3, 2, 2});
    body_hold_normal(s, "top", (double[3]){1, 0.3, 0}, 1);
    body_hold_normal(s, "top", (double[3]){-0.2, 1, 0}, 2);
    uz_result *x = body_solve(s, 0), *all = NULL, *less = NULL;
    uz_settings settings = uz_settings_default();
    uz_error err = {0};
    settings.relative_error = 1;
    CHECK_MSG(uz_verify(&all, &problem, x->u, x->r, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(all->summary.outcome, UZ_VERIFIED);
    settings.relative_error = 0.999 * all->summary.certificate.relative_error;
    CHECK(uz_verify(&less, &problem, x->u, x->r, &settings, NULL, NULL, &err) == UZ_OK);
    CHECK(less->summary.certificate.relative_error > settings.relative_error);
    CHECK_INT(less->summary.outcome, UZ_NOT_VERIFIED);
    CHECK(strlen(less->summary.message) > 0);
    uz_result_free(x);
    uz_result_free(all);
    uz_result_free(less);
    uz_scene_clear(s);
}
