/* The reference of the work-precision figures against an independent exact solution in quadruple precision. */
#include "figures/reference.h"
#include "harness.h"
#include "obstacle.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

__attribute__((constructor)) static void settle(void)
{
    uz_process_init(2);
    uz_thread_init();
}

/* Both solve the problem; the reference starts from no row at all, and from all. */
static void agree(const uz_qp *qp, bool all_touch)
{
    quad_exact exact;
    reference found;
    bool *start = calloc((size_t)qp->N.rows + 1, sizeof *start);
    for (int64_t i = 0; all_touch && i < qp->N.rows; i++)
        start[i] = true;
    CHECK(quad_exact_solve(&exact, qp, NULL));
    CHECK(reference_solve(&found, qp, start));
    CHECK_INT(found.active, exact.n_active);
    CHECK_REL(found.energy, (double)exact.energy, 1e-14);
    CHECK_REL(found.norm * found.norm, (double)exact.norm2, 1e-14);
    CHECK_MSG(found.change < 1e-25, "last correction %g", found.change);
    double apart = 0, pressed = 0;
    for (int64_t j = 0; j < found.d; j++)
        apart = fmax(apart, (double)quad_abs(found.u[j] - exact.u[j]));
    for (int64_t i = 0; i < found.m; i++)
        pressed = fmax(pressed, (double)quad_abs(found.r[i] - exact.r[i]));
    CHECK_MSG(apart <= 1e-25 * found.norm, "u apart by %g", apart);
    CHECK_MSG(pressed <= 1e-24 * found.largest, "r apart by %g of %g", pressed, found.largest);
    reference_free(&found);
    quad_exact_free(&exact);
    free(start);
}

TEST(paper_body)
{
    uz_scene scene = paper_scene(9, 3);
    uz_qp qp;
    uz_error err = {0};
    CHECK(uz_scene_to_qp(&qp, NULL, &scene, &err) == UZ_OK);
    agree(&qp, false);
    agree(&qp, true);
    uz_qp_clear(&qp);
    uz_scene_clear(&scene);
}

TEST(membrane_between_bounds)
{
    uz_qp qp;
    uz_error err = {0};
    CHECK(obstacle_qp(&qp, 8, &err) == UZ_OK);
    agree(&qp, false);
    uz_qp_clear(&qp);
}

TEST(errors_are_measured)
{
    qp_random rng = {3};
    uz_qp qp = random_obstacle(&rng, 40, 2);
    bool start[40] = {false};
    reference x;
    CHECK(reference_solve(&x, &qp, start));
    double *u = vector(x.d), *r = vector(x.m);
    for (int64_t j = 0; j < x.d; j++)
        u[j] = (double)x.u[j];
    for (int64_t i = 0; i < x.m; i++)
        r[i] = (double)x.r[i];
    reference_error none = reference_compare(&x, u, r);
    CHECK(none.energy < 1e-15 && none.reaction < 1e-15 && none.mismatches == 0);
    u[7] += 1e-6; /* the energy of one dof's motion is its diagonal entry */
    r[0] = x.touching[0] ? 0 : -1e-9;
    reference_error some = reference_compare(&x, u, r);
    CHECK_REL(some.energy, 1e-6 * sqrt(qp.K.val[qp.K.ptr[7]]) / x.norm, 1e-6);
    CHECK_INT(some.mismatches, 1);
    CHECK(some.reaction > 0);
    free(u);
    free(r);
    reference_free(&x);
    uz_qp_clear(&qp);
}

TEST(a_row_on_two_dofs_is_refused)
{
    qp_random rng = {5};
    const qp_kind kind = {.d = 6, .m = 3, .condition = 10};
    uz_qp qp = random_qp(&rng, &kind);
    bool start[3] = {false};
    reference x;
    CHECK(!reference_solve(&x, &qp, start));
    reference_free(&x);
    uz_qp_clear(&qp);
}
