/* Contact problems of large deformation that have the rows that may press, of more than 32. */
#include "body_fixture.h"
#include "qp_fixture.h"

static uz_scene strip(const char *element, double length, double height, int64_t nx, int64_t ny, double young)
{
    uz_scene s = body_scene(UZ_PLANE_STRAIN, element, (double[3]){length, height, 0}, (int64_t[3]){nx, ny, 0});
    s.materials[0].young = young;
    s.materials[0].law = UZ_ELASTIC_ST_VENANT_KIRCHHOFF;
    s.kinematics = UZ_KINEMATICS_FINITE;
    return s;
}

/* In one step of at most so many contact problems. */
static uz_result *solve(const uz_scene *s, int64_t qps)
{
    uz_result *result = body_solve_to(s, 1e-8);
    const uz_finite *f = &result->summary.finite;
    CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
    CHECK_MSG(f->steps == 1 && f->qps <= qps && f->failed == 0, "%lld steps, %lld contact problems",
              (long long)f->steps, (long long)f->qps);
    CHECK(f->load == 1 && f->definite && f->residual <= 1e-8 && f->least_det > 0);
    return result;
}

/* A cantilever over a plane that falls away: rows at its root are those within reach at first, and its end is where it
 * comes to lie. */
TEST(a_row_that_was_far_presses)
{
    uz_scene s = strip("quad8", 10, 0.2, 20, 1, 1.2e6);
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_FORCE, "right", 0, -20, 0);
    body_plane(&s, "bottom", (double[3]){0, -0.05, 0}, (double[3]){0.1, 1, 0});
    uz_result *result = solve(&s, 6);
    const double *end = NULL;
    for (int64_t i = 0; i < result->n_nodes; i++)
        if (hypot(result->mesh.xyz[2 * i] - 10, result->mesh.xyz[2 * i + 1]) < 1e-9)
            end = result->u + 2 * i;
    CHECK(end);
    CHECK_MSG(fabs(end[1] + 0.05 + 0.1 * (10 + end[0])) < 1e-8, "%.9g", end[1]);
    CHECK(result->summary.active == 1 && result->summary.force[1] > 1 && result->summary.force[1] < 20);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* What a pressure that follows the body adds to a step is found with the rows of its contact problem, of which most are
 * far from the roller. */
TEST(a_pressed_strip_over_a_roller_takes_few_problems)
{
    uz_scene s = strip("quad4", 8, 1, 44, 3, 1);
    body_hold(&s, "left", 0, 0, NAN);
    body_load(&s, UZ_LOAD_PRESSURE, "top", 0.00225, 0, 0);
    uz_contact *roller = body_plane(&s, "bottom", (double[3]){6.5, -2.8, 0}, (double[3]){0, 1, 0});
    roller->kind = UZ_OBSTACLE_ROUND;
    roller->radius = 2.8;
    uz_result *result = solve(&s, 5);
    CHECK(result->summary.active > 0);
    uz_result_free(result);
    uz_scene_clear(&s);
}
