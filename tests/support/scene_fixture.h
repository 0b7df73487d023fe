/* scene_fixture.h: scenes and small dense algebra for the tests of scenes and assembly. */
#ifndef TESTS_SCENE_FIXTURE_H
#define TESTS_SCENE_FIXTURE_H

#include "assembly/assembly.h"
#include "core/alloc.h"
#include "harness.h"
#include "uzawa.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A rectangle at the origin with steel-like material on all, nothing else. Each list has room for 4 items. */
static inline uz_scene box_scene(double width, double height, int64_t nx, int64_t ny)
{
    uz_scene scene = {.model = UZ_PLANE_STRESS, .thickness = 5};
    scene.box = (uz_box){.size = {width, height}, .cells = {nx, ny}, .element = "quad4", .dim = 2};
    scene.materials = calloc(4, sizeof *scene.materials);
    scene.supports = calloc(4, sizeof *scene.supports);
    scene.loads = calloc(8, sizeof *scene.loads);
    scene.contacts = calloc(4, sizeof *scene.contacts);
    scene.materials[0] = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3};
    scene.n_materials = 1;
    return scene;
}

static inline void add_support(uz_scene *scene, const char *on, double ux, double uy)
{
    uz_support *support = &scene->supports[scene->n_supports++];
    *support = (uz_support){.u = {ux, uy, NAN}};
    snprintf(support->on, sizeof support->on, "%s", on);
}

static inline void add_load(uz_scene *scene, const char *on, double tx, double ty)
{
    uz_load *load = &scene->loads[scene->n_loads++];
    *load = (uz_load){.v = {tx, ty}};
    snprintf(load->on, sizeof load->on, "%s", on);
}

static inline void add_plane(uz_scene *scene, const char *on, double px, double py, double nx, double ny)
{
    uz_contact *contact = &scene->contacts[scene->n_contacts++];
    *contact = (uz_contact){.point = {px, py}, .normal = {nx, ny}};
    snprintf(contact->on, sizeof contact->on, "%s", on);
}

/* The body of the paper's example: mm, N, MPa. */
static inline uz_scene paper_scene(int64_t nx, int64_t ny)
{
    uz_scene scene = box_scene(60, 20, nx, ny);
    add_support(&scene, "left", 0, 0);
    add_load(&scene, "top", 0, -0.05);
    add_load(&scene, "right", 0.5, 0);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    return scene;
}

/* The matrices of the paper's body with nx x nx / 3 cells and another Young's modulus. The caller clears them. */
static inline uz_qp paper_qp(int64_t nx, double young)
{
    uz_scene scene = paper_scene(nx, nx / 3);
    uz_mesh_info info;
    uz_error err = {0};
    uz_qp qp;
    scene.materials[0].young = young;
    CHECK(uz_scene_to_qp(&qp, &info, &scene, &err) == UZ_OK);
    uz_mesh_info_clear(&info);
    uz_scene_clear(&scene);
    return qp;
}

static inline double *zeros(int64_t n)
{
    double *x = uz_alloc_zero(n, sizeof *x);
    if (!x)
        abort();
    return x;
}

/* Dense n x n, row by row, from a lower triangle. */
static inline double *dense_symmetric(const uz_csc *A)
{
    const int64_t n = A->cols;
    double *full = zeros(n * n);
    for (int64_t j = 0; j < n; j++)
        for (int64_t q = A->ptr[j]; q < A->ptr[j + 1]; q++)
            full[A->idx[q] * n + j] = full[j * n + A->idx[q]] = A->val[q];
    return full;
}

/* A = L L' in place (lower triangle). False: not positive definite. */
static inline bool dense_cholesky(double *A, int64_t n)
{
    for (int64_t j = 0; j < n; j++) {
        for (int64_t i = j; i < n; i++) {
            double sum = A[i * n + j];
            for (int64_t k = 0; k < j; k++)
                sum -= A[i * n + k] * A[j * n + k];
            if (i == j && !(sum > 0))
                return false;
            A[i * n + j] = i == j ? sqrt(sum) : sum / A[j * n + j];
        }
    }
    return true;
}

/* x = (L L')^-1 x. */
static inline void dense_solve(double *x, const double *L, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        for (int64_t k = 0; k < i; k++)
            x[i] -= L[i * n + k] * x[k];
        x[i] /= L[i * n + i];
    }
    for (int64_t i = n - 1; i >= 0; i--) {
        for (int64_t k = i + 1; k < n; k++)
            x[i] -= L[k * n + i] * x[k];
        x[i] /= L[i * n + i];
    }
}

/* The body of a scene that is known to be good. */
static inline uz_body_model build_body(const uz_scene *scene)
{
    uz_body_model model;
    uz_error err = {0};
    uz_status status = uz_body_model_build(&model, scene, UZ_BODY_SUPPORTED, &err);
    CHECK_MSG(status == UZ_OK, "%s: %s", err.where, err.message);
    if (status != UZ_OK)
        exit(1);
    return model;
}

/* Nodal displacements of the body without its obstacle. */
static inline double *solve_linear(const uz_body_model *model, const uz_scene *scene)
{
    const int64_t total = model->mesh.n_nodes * 2;
    double *p = zeros(model->d), *h = zeros(model->m + 1);
    double *fixed = zeros(model->n_fixed + 1), *nodal = zeros(total);
    double *L = dense_symmetric(&model->K);
    uz_error err = {0};
    CHECK(uz_body_model_load(p, h, fixed, model, scene, &err) == UZ_OK);
    CHECK(dense_cholesky(L, model->d));
    dense_solve(p, L, model->d);
    uz_recover_nodal(nodal, model, p, fixed);
    uz_free_all(p, h, fixed, L);
    return nodal;
}

#endif
