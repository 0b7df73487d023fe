/* Stiffness and loads of whole bodies against plain assembly and against theory. */
#include "assembly/parts.h"
#include "harness.h"
#include "scene_fixture.h"

/* -------------------------------------------------------------- patch test */

/* u = linear in x and y at every node. */
static double *linear_field(const uz_mesh *mesh)
{
    double *u = zeros(2 * mesh->n_nodes);
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        const double x = mesh->xyz[2 * a], y = mesh->xyz[2 * a + 1];
        u[2 * a] = 1e-3 + 2e-3 * x + 7e-4 * y;
        u[2 * a + 1] = 3e-4 - 1e-3 * x + 5e-4 * y;
    }
    return u;
}

static void distort(uz_mesh *mesh, double by)
{
    mesh->uniform = false;
    for (int64_t a = 0; a < mesh->n_nodes; a++) {
        mesh->xyz[2 * a] += by * sin(5.0 * (double)a);
        mesh->xyz[2 * a + 1] += by * cos(3.0 * (double)a);
    }
}

/* K of the whole mesh, kept dense with all dofs, from element matrices added the plain way. */
static double *plain_stiffness(const uz_body_model *model)
{
    const int64_t n = model->mesh.n_nodes * 2;
    double ke[64], xy[3 * UZ_ELEMENT_NODES], *full = zeros(n * n);
    for (int64_t e = 0; e < model->mesh.n_elements; e++) {
        const int64_t *corner = model->mesh.node + 4 * e;
        uz_element element;
        uz_body_element(&element, xy, model, e);
        for (int i = 0; i < 8; i++)
            xy[i] = model->mesh.xyz[2 * corner[i / 2] + i % 2];
        CHECK(uz_element_stiffness(ke, &element) == UZ_SHAPE_GOOD);
        for (int i = 0; i < 8; i++)
            for (int j = 0; j < 8; j++)
                full[(2 * corner[i / 2] + i % 2) * n + 2 * corner[j / 2] + j % 2] += ke[8 * i + j];
    }
    return full;
}

/* A mesh of distorted quads must hold a linear displacement field in equilibrium: no force at its inner nodes. */
TEST(patch_test_on_distorted_quads)
{
    uz_scene scene = box_scene(4, 3, 4, 3);
    add_support(&scene, "left", 0, 0);
    uz_body_model model = build_body(&scene);
    const int64_t n = 2 * model.mesh.n_nodes;
    double inner = 0, outer = 0;
    distort(&model.mesh, 0.2);
    double *full = plain_stiffness(&model), *u = linear_field(&model.mesh);
    for (int64_t i = 0; i < n; i++) {
        const int64_t column = i / 2 % 5, row = i / 2 / 5;
        double force = 0;
        for (int64_t j = 0; j < n; j++)
            force += full[i * n + j] * u[j];
        if (column > 0 && column < 4 && row > 0 && row < 3)
            inner = fmax(inner, fabs(force));
        else
            outer = fmax(outer, fabs(force));
    }
    CHECK_MSG(inner < 1e-12 * outer, "inner %g outer %g", inner, outer);
    CHECK(uz_estimate_mesh_error(NULL, NULL, &model, NULL, u) < 1e-12);
    free(full);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* ------------------------------------------------------------------- bodies */

static void check_against_plain_assembly(bool distorted)
{
    uz_scene scene = box_scene(3, 2, 5, 4);
    uz_error err = {0};
    add_support(&scene, "left", 0, NAN);
    add_support(&scene, "bottom", NAN, 0.5);
    add_support(&scene, "right", 0.25, NAN);
    uz_body_model model = build_body(&scene);
    if (distorted) {
        uz_csc_clear(&model.K);
        uz_csc_clear(&model.K_fixed);
        distort(&model.mesh, 0.1);
        CHECK(uz_build_stiffness(&model, NULL, &err) == UZ_OK);
    }
    const int64_t n = model.mesh.n_nodes * 2;
    double *full = plain_stiffness(&model), *K = dense_symmetric(&model.K);
    double *fixed = zeros(model.d * model.n_fixed);
    int64_t missed = 0;
    for (int64_t k = 0; k < model.n_fixed; k++)
        for (int64_t q = model.K_fixed.ptr[k]; q < model.K_fixed.ptr[k + 1]; q++)
            fixed[model.K_fixed.idx[q] * model.n_fixed + k] = model.K_fixed.val[q];
    for (int64_t i = 0; i < n; i++)
        for (int64_t j = 0; j < n; j++) {
            const int64_t row = model.dof[i], col = model.dof[j];
            if (row < 0)
                continue;
            const double got = col >= 0 ? K[row * model.d + col] : fixed[row * model.n_fixed + (-1 - col)];
            missed += fabs(got - full[i * n + j]) > 1e-12 * full[0];
        }
    CHECK_INT(missed, 0);
    for (int64_t j = 0; j < model.d; j++) {
        CHECK(model.K.idx[model.K.ptr[j]] == j);
        for (int64_t q = model.K.ptr[j] + 1; q < model.K.ptr[j + 1]; q++)
            CHECK(model.K.idx[q - 1] < model.K.idx[q]);
    }
    free(full);
    free(K);
    free(fixed);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(assembled_columns_equal_plain_assembly)
{
    check_against_plain_assembly(false);
    check_against_plain_assembly(true);
}

TEST(inverted_element_is_named)
{
    uz_scene scene = box_scene(3, 2, 3, 2);
    uz_error err = {0};
    add_support(&scene, "left", 0, 0);
    uz_body_model model = build_body(&scene);
    uz_csc_clear(&model.K);
    uz_csc_clear(&model.K_fixed);
    model.mesh.uniform = false;
    model.mesh.xyz[2 * 6] = -5; /* node 6 belongs to elements 1, 2, 4, 5 */
    CHECK(uz_build_stiffness(&model, NULL, &err) == UZ_ERR_SCENE);
    CHECK_MSG(strstr(err.message, "element 1 (nodes 1, 2, 6, 5)"), "%s", err.message);
    CHECK_STR(err.where, "/mesh/elements");
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(tractions_add_up)
{
    uz_scene scene = box_scene(7, 3, 5, 2);
    add_support(&scene, "left", 0, 0);
    add_load(&scene, "right", 2, -3);
    add_load(&scene, "right", 1, 0.5);
    uz_qp qp;
    CHECK(uz_scene_to_qp(&qp, NULL, &scene, NULL) == UZ_OK);
    double fx = 0, fy = 0;
    for (int64_t i = 0; i < qp.K.cols; i += 2) {
        fx += qp.p[i];
        fy += qp.p[i + 1];
    }
    CHECK_REL(fx, 3.0 * 3 * 5, 1e-14); /* traction x height x thickness */
    CHECK_REL(fy, -2.5 * 3 * 5, 1e-14);
    uz_qp_clear(&qp);
    uz_scene_clear(&scene);
}

/* A bar on rollers pulled at its end: sigma_x = t exactly, so one element or many give the exact answer. */
static void check_bar(uz_model kind, double stiffness, double contraction)
{
    const double pull = 12.5, length = 8, height = 2;
    uz_scene scene = box_scene(length, height, 4, 3);
    scene.model = kind;
    add_support(&scene, "left", 0, NAN);
    add_support(&scene, "bottom", NAN, 0);
    add_load(&scene, "right", pull, 0);
    uz_body_model model = build_body(&scene);
    double *u = solve_linear(&model, &scene);
    for (int64_t a = 0; a < model.mesh.n_nodes; a++) {
        const double x = model.mesh.xyz[2 * a], y = model.mesh.xyz[2 * a + 1];
        CHECK(fabs(u[2 * a] - pull * x / stiffness) < 1e-12 * pull * length / stiffness);
        CHECK(fabs(u[2 * a + 1] + contraction * pull * y / stiffness) < 1e-12 * pull * length / stiffness);
    }
    CHECK(uz_estimate_mesh_error(NULL, NULL, &model, NULL, u) < 1e-12);
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(uniaxial_bar)
{
    const double E = 200e3, nu = 0.3;
    check_bar(UZ_PLANE_STRESS, E, nu);
    check_bar(UZ_PLANE_STRAIN, E / (1 - nu * nu), nu / (1 - nu));
}

static double cantilever_tip(int64_t nx, int64_t ny)
{
    uz_scene scene = box_scene(10, 1, nx, ny);
    add_support(&scene, "left", 0, 0);
    add_load(&scene, "right", 0, 0.5);
    uz_body_model model = build_body(&scene);
    double *u = solve_linear(&model, &scene);
    const double tip = u[2 * (model.mesh.n_nodes - 1) + 1];
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
    return tip;
}

/* Timoshenko's tip deflection of a slender cantilever: P L^3 / 3EI + P L / (k G A), k = 5/6. The quadratic error of the
 * mesh is extrapolated away. */
TEST(cantilever_approaches_beam_theory)
{
    const double L = 10, H = 1, E = 200e3, nu = 0.3, t = 5, P = 0.5 * H * t, I = t * H * H * H / 12;
    const double theory = P * L * L * L / (3 * E * I) + P * L / (5.0 / 6 * E / (2 * (1 + nu)) * t * H);
    const double coarse = cantilever_tip(30, 3), fine = cantilever_tip(60, 6);
    CHECK(coarse < fine && fine < theory);
    CHECK_REL(fine + (fine - coarse) / 3, theory, 3e-3);
}

/* Pulling the right side by a prescribed displacement instead of a force. */
TEST(prescribed_displacement_stretches_the_bar)
{
    const double stretch = 0.02;
    uz_scene scene = box_scene(8, 2, 4, 3);
    add_support(&scene, "left", 0, NAN);
    add_support(&scene, "bottom", NAN, 0);
    add_support(&scene, "right", stretch, NAN);
    uz_body_model model = build_body(&scene);
    double *u = solve_linear(&model, &scene);
    for (int64_t a = 0; a < model.mesh.n_nodes; a++) {
        CHECK(fabs(u[2 * a] - stretch * model.mesh.xyz[2 * a] / 8) < 1e-14);
        CHECK(fabs(u[2 * a + 1] + 0.3 * stretch * model.mesh.xyz[2 * a + 1] / 8) < 1e-14);
    }
    free(u);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(change_of_units_only_rescales)
{
    uz_scene mm = paper_scene(6, 2), m = paper_scene(6, 2);
    uz_qp a, b;
    m.box.size[0] = 0.06, m.box.size[1] = 0.02;
    m.thickness = 0.005;
    m.materials[0].young = 200e9;
    m.loads[0].v[1] = -0.05e6;
    m.loads[1].v[0] = 0.5e6;
    CHECK(uz_scene_to_qp(&a, NULL, &mm, NULL) == UZ_OK && uz_scene_to_qp(&b, NULL, &m, NULL) == UZ_OK);
    CHECK_INT(a.K.ptr[a.K.cols], b.K.ptr[b.K.cols]);
    for (int64_t q = 0; q < a.K.ptr[a.K.cols]; q++) /* N/mm and N/m */
        CHECK(fabs(1000 * a.K.val[q] - b.K.val[q]) < 1e-12 * 1e9);
    for (int64_t i = 0; i < a.K.cols; i++) /* N */
        CHECK(fabs(a.p[i] - b.p[i]) < 1e-12 * 10);
    uz_qp_clear(&a);
    uz_qp_clear(&b);
    uz_scene_clear(&mm);
    uz_scene_clear(&m);
}
