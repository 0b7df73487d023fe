/* The example of the paper, and the error estimate. */
#include "assembly/assembly.h"
#include "core/alloc.h"
#include "harness.h"
#include "scene_fixture.h"

/* The contact problem reduced to reactions, by Gauss-Seidel with projection: slow, short, and unlike the methods. */
typedef struct {
    double energy, reaction_sum, lambda_max, *u;
    int64_t active;
} reference;

static double largest_eigenvalue(const double *D, int64_t m)
{
    double x[64], y[64], norm = 1;
    for (int64_t i = 0; i < m; i++)
        x[i] = 1 + 0.1 * (double)(i % 3);
    for (int step = 0; step < 3000; step++) {
        norm = 0;
        for (int64_t i = 0; i < m; i++) {
            y[i] = 0;
            for (int64_t j = 0; j < m; j++)
                y[i] += D[i * m + j] * x[j];
            norm += y[i] * y[i];
        }
        norm = sqrt(norm);
        for (int64_t i = 0; i < m; i++)
            x[i] = y[i] / norm;
    }
    return norm;
}

static reference solve_contact(const uz_qp *qp)
{
    const int64_t d = qp->K.cols, m = qp->N.rows;
    double *L = dense_symmetric(&qp->K), *D = zeros(m * m), *u = zeros(d);
    double *Ku = zeros(d), r[64] = {0}, g[64], unit[64] = {0};
    reference out = {0};
    CHECK(dense_cholesky(L, d));
    for (int64_t j = 0; j < m; j++) {
        memset(u, 0, (size_t)d * sizeof *u);
        unit[j] = 1;
        uz_csc_gaxpy_t(u, &qp->N, 1, unit);
        unit[j] = 0;
        dense_solve(u, L, d);
        memset(g, 0, sizeof g);
        uz_csc_gaxpy(g, &qp->N, 1, u);
        for (int64_t i = 0; i < m; i++)
            D[i * m + j] = g[i];
    }
    memcpy(u, qp->p, (size_t)d * sizeof *u);
    dense_solve(u, L, d);
    memcpy(g, qp->h, (size_t)m * sizeof *g);
    uz_csc_gaxpy(g, &qp->N, -1, u); /* g = g0 - D r from here on, kept up to date */
    for (int sweep = 0; sweep < 20000; sweep++)
        for (int64_t i = 0; i < m; i++) {
            const double change = fmin(0, r[i] + g[i] / D[i * m + i]) - r[i];
            r[i] += change;
            for (int64_t k = 0; k < m; k++)
                g[k] -= D[k * m + i] * change;
        }
    memcpy(u, qp->p, (size_t)d * sizeof *u);
    uz_csc_gaxpy_t(u, &qp->N, 1, r);
    dense_solve(u, L, d);
    uz_csc_symv(Ku, &qp->K, 1, u);
    for (int64_t i = 0; i < d; i++)
        out.energy += (0.5 * Ku[i] - qp->p[i]) * u[i];
    for (int64_t i = 0; i < m; i++) {
        out.reaction_sum += r[i];
        out.active += r[i] < 0;
    }
    out.lambda_max = largest_eigenvalue(D, m);
    out.u = u;
    uz_free_all(L, D, Ku);
    return out;
}

TEST(paper_body_has_its_reference_values)
{
    uz_scene scene = paper_scene(30, 10);
    uz_qp qp;
    uz_mesh_info info;
    uz_error err;
    CHECK(uz_scene_to_qp(&qp, &info, &scene, &err) == UZ_OK);
    CHECK(uz_qp_check(&qp, &err) == UZ_OK);
    CHECK_INT(qp.K.cols, 660);
    CHECK_INT(qp.N.rows, 30);
    CHECK_INT(info.n_nodes, 31 * 11);
    CHECK_INT(info.n_elements, 300);
    for (int64_t i = 0; i < 30; i++) {
        CHECK_INT(info.contact_node[i], i + 1);
        CHECK_REL(info.contact_area[i], i == 29 ? 5.0 : 10.0, 1e-13);
        CHECK(info.contact_normal[2 * i] == 0 && info.contact_normal[2 * i + 1] == 1);
        CHECK(qp.h[i] == 0);
    }
    reference ref = solve_contact(&qp);
    CHECK_REL(ref.energy, -3.9608186040e-3, 1e-9);
    CHECK_REL(ref.reaction_sum, -10.51371700, 1e-8);
    CHECK_REL(ref.lambda_max, 9.427e-4, 1e-3);
    CHECK_INT(ref.active, 22);
    free(ref.u);
    uz_qp_clear(&qp);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
}

static double estimate_paper_body(int64_t nx, int64_t ny)
{
    uz_scene scene = paper_scene(nx, ny);
    uz_body_model model = build_body(&scene);
    uz_qp qp = {model.K, model.N, zeros(model.d), zeros(model.m)};
    uz_error err = {0};
    CHECK(uz_body_model_load(qp.p, qp.h, NULL, &model, &scene, &err) == UZ_OK);
    reference ref = solve_contact(&qp);
    double *nodal = zeros(model.mesh.n_nodes * 2);
    uz_recover_nodal(nodal, &model, ref.u, NULL);
    const double estimate = uz_estimate_mesh_error(NULL, NULL, &model, NULL, nodal);
    uz_free_all(nodal, ref.u, qp.p, qp.h);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
    return estimate;
}

/* The true error of 30 x 10 is about 2.2e-2, by extrapolation; its order is below 1 because of the clamped corners. */
TEST(estimated_error_of_the_paper_body)
{
    const double coarse = estimate_paper_body(15, 5), fine = estimate_paper_body(30, 10);
    CHECK_REL(fine, 2.2e-2, 0.1);
    CHECK_MSG(fine < 0.75 * coarse, "%g at 15 x 5, %g at 30 x 10", coarse, fine);
}

/* Where loads are the only work, ||u - u_h||^2 = W - W_h with W = p'u. The estimate over the true error lies between
 * low and high. Returns W by extrapolation; `exact` may be 0: that one. */
static double check_bent_beam(const char *element, uz_formulation formulation, double exact, double low, double high)
{
    double work[3], estimate[3];
    for (int k = 0; k < 3; k++) {
        uz_scene scene = box_scene(6, 1, 12 << k, 2 << k);
        snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
        scene.formulation = formulation;
        add_support(&scene, "left", 0, 0);
        add_load(&scene, "right", 0, 1);
        uz_body_model model = build_body(&scene);
        double *u = solve_linear(&model, &scene);
        work[k] = estimate[k] = 0;
        const double share = 5.0 / (double)(2 << k); /* force of one edge */
        for (int64_t j = 0; j <= 2 << k; j++)
            work[k] += share * (j == 0 || j == 2 << k ? 0.5 : 1) * u[2 * (j * ((12 << k) + 1) + (12 << k)) + 1];
        estimate[k] = uz_estimate_mesh_error(NULL, NULL, &model, NULL, u);
        free(u);
        uz_body_model_clear(&model);
        uz_scene_clear(&scene);
    }
    const double ratio = (work[1] - work[0]) / (work[2] - work[1]);
    const double limit = work[2] + (work[2] - work[1]) / (ratio - 1);
    exact = exact > 0 ? exact : limit;
    for (int k = 0; k < 3; k++) {
        const double truth = sqrt(1 - work[k] / exact);
        CHECK_MSG(estimate[k] > low * truth && estimate[k] < high * truth, "%s, mesh %d: true %g, estimated %g",
                  element, k, truth, estimate[k]);
    }
    return limit;
}

/* The held corners are singular, and what incompatible modes miss there is a larger part of their small error. */
TEST(estimated_error_of_a_bent_beam)
{
    const double exact = check_bent_beam("quad4", UZ_FORMULATION_INCOMPATIBLE, 0, 0.6, 1.1);
    check_bent_beam("quad4", UZ_FORMULATION_STANDARD, exact, 0.8, 1.6);
    check_bent_beam("tri3", UZ_FORMULATION_STANDARD, exact, 0.825, 1.1);
}
