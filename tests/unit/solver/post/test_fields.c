/* Fields against what theory says of the answers they are made from. */
#include "assembly/parts.h"
#include "post/parts.h"
#include "scene_fixture.h"

#include "core/random.h"

/* A mesh that nobody built a scene of: nodes, one element or a few, groups by hand. */
typedef struct {
    uz_scene scene;
    uz_body_model model;
    uz_field_body body;
    uz_material material;
} loose_body;

/* u = G x at every node of a mesh, G dim x dim row by row. */
static double *linear_motion(const uz_mesh *mesh, const double *G)
{
    const int dim = mesh->dim;
    double *u = zeros(mesh->n_nodes * dim);
    for (int64_t i = 0; i < mesh->n_nodes * dim; i++)
        for (int j = 0; j < dim; j++)
            u[i] += G[i % dim * dim + j] * mesh->xyz[i / dim * dim + j];
    return u;
}

/* nodes of the reference element, moved a little and scaled by `size`. */
static void shake(double *xyz, uz_element_kind kind, uz_model model, double size)
{
    static const double SHIFT[UZ_ELEMENT_NODES][3] = {
        {0.03, -0.05, 0.02}, {-0.06, 0.04, 0.05}, {0.07, 0.02, -0.03}, {0.01, 0.06, 0.04}, {-0.02, 0.03, 0.05},
        {0.05, -0.04, 0.01}, {0.02, 0.05, -0.06}, {-0.03, 0.01, 0.02}, {0.02, 0.02, 0.01}, {0.01, -0.02, 0.03}};
    const int dim = uz_element_type_of(kind)->dim, nodes = uz_element_node_count(kind);
    const double(*local)[3] = uz_element_type_of(kind)->local;
    for (int a = 0; a < nodes; a++)
        for (int c = 0; c < dim; c++)
            xyz[a * dim + c] = size * (local[a][c] + 0.3 * SHIFT[a][c]) + (model == UZ_AXISYMMETRIC && c == 0 ? 3 : 0);
}

static void loose_init(loose_body *b, uz_element_kind kind, uz_model model, double size)
{
    memset(b, 0, sizeof *b);
    uz_mesh *mesh = &b->model.mesh;
    const int nodes = uz_element_node_count(kind);
    mesh->dim = uz_element_type_of(kind)->dim;
    mesh->n_nodes = nodes;
    mesh->n_elements = 1;
    mesh->xyz = zeros(nodes * mesh->dim);
    shake(mesh->xyz, kind, model, size);
    mesh->kind = calloc(1, 1);
    mesh->kind[0] = (unsigned char)kind;
    mesh->first = calloc(2, sizeof *mesh->first);
    mesh->first[1] = nodes;
    mesh->node = calloc((size_t)nodes, sizeof *mesh->node);
    for (int a = 0; a < nodes; a++)
        mesh->node[a] = a;
    mesh->groups = calloc(1, sizeof *mesh->groups);
    mesh->n_groups = 1;
    mesh->groups[0] = (uz_group){.name = "all", .kind = UZ_GROUP_ELEMENTS, .everything = true};
    b->material = (uz_material){.on = "all", .young = 200e3, .poisson = 0.3, .expansion = 1e-5};
    b->scene = (uz_scene){.model = model, .thickness = 2, .materials = &b->material, .n_materials = 1};
    CHECK(uz_take_materials(&b->model, &b->scene, NULL) == UZ_OK);
    CHECK(uz_field_body_init(&b->body, &b->scene, &b->model, NULL) == UZ_OK);
}

static void loose_clear(loose_body *b)
{
    uz_field_body_clear(&b->body);
    uz_body_model_clear(&b->model);
}

static double largest(const double *x, int64_t n)
{
    double most = 0;
    for (int64_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* Hooke's law in space, from a strain tensor. */
static void hooke(double stress[6], const double strain[6], double young, double poisson)
{
    const double mu = young / (2 * (1 + poisson)), lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
    const double trace = strain[0] + strain[1] + strain[2];
    for (int c = 0; c < 6; c++)
        stress[c] = 2 * mu * strain[c] + (c < 3 ? lambda * trace : 0);
}

static void check_uniform(uz_element_kind kind, uz_model model, double size)
{
    static const double PLANE[4] = {2e-3, 1e-3, -3e-3, 5e-4},
                        SPACE[9] = {2e-3, 1e-3, 4e-4, -3e-3, 5e-4, 2e-4, 1e-3, -6e-4, -1e-3};
    loose_body b;
    loose_init(&b, kind, model, size);
    const int dim = b.model.mesh.dim, nodes = (int)b.model.mesh.n_nodes, k = b.body.components;
    double *u = linear_motion(&b.model.mesh, dim == 2 ? PLANE : SPACE);
    double strain[6], stress[6];
    if (dim == 2) {
        memcpy(strain, (double[6]){2e-3, 5e-4, 0, -1e-3, 0, 0}, sizeof strain);
        if (model == UZ_PLANE_STRESS)
            strain[2] = -0.3 / 0.7 * 2.5e-3;
    } else {
        memcpy(strain, (double[6]){2e-3, 5e-4, -1e-3, -1e-3, -2e-4, 7e-4}, sizeof strain);
    }
    hooke(stress, strain, 200e3, 0.3);
    double *got_stress = zeros(nodes * k), *got_strain = zeros(nodes * k);
    CHECK(uz_field_recover(got_stress, got_strain, &b.body, u, NULL, NULL) == UZ_OK);
    for (int a = 0; a < nodes; a++)
        for (int c = 0; c < k; c++) {
            CHECK_MSG(fabs(got_stress[a * k + c] - stress[c]) <= 1e-12 * largest(stress, 6), "%s %d node %d: %d %g %g",
                      uz_element_name(kind), model, a, c, got_stress[a * k + c], stress[c]);
            CHECK_MSG(fabs(got_strain[a * k + c] - strain[c]) <= 1e-12 * largest(strain, 6), "%s %d node %d: %d %g %g",
                      uz_element_name(kind), model, a, c, got_strain[a * k + c], strain[c]);
        }
    free(u);
    free(got_stress);
    free(got_strain);
    loose_clear(&b);
}

TEST(uniform_stress_is_exact_in_every_element)
{
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++)
        for (double size = 1e-3; size < 1e4; size *= 1e3) {
            if (uz_element_type_of((uz_element_kind)kind)->dim == 3) {
                check_uniform((uz_element_kind)kind, UZ_SOLID, size);
            } else {
                check_uniform((uz_element_kind)kind, UZ_PLANE_STRESS, size);
                check_uniform((uz_element_kind)kind, UZ_PLANE_STRAIN, size);
            }
        }
}

/* A ring that grows by u = a x everywhere: strain a along the radius and around it. */
TEST(a_ring_has_its_hoop_stress)
{
    for (int kind = 0; kind <= UZ_QUAD8; kind++) {
        loose_body b;
        loose_init(&b, (uz_element_kind)kind, UZ_AXISYMMETRIC, 1);
        const int nodes = (int)b.model.mesh.n_nodes;
        double *u = linear_motion(&b.model.mesh, (double[4]){1e-3, 0, 0, -2e-3});
        double stress[6], *got = zeros(nodes * 4), *strain = zeros(nodes * 4);
        hooke(stress, (double[6]){1e-3, -2e-3, 1e-3}, 200e3, 0.3);
        CHECK(uz_field_recover(got, strain, &b.body, u, NULL, NULL) == UZ_OK);
        for (int a = 0; a < nodes; a++)
            for (int c = 0; c < 4; c++)
                CHECK_MSG(fabs(got[a * 4 + c] - stress[c]) <= 1e-11 * largest(stress, 6), "%s: %g %g",
                          uz_element_name((uz_element_kind)kind), got[a * 4 + c], stress[c]);
        free(u);
        free(got);
        free(strain);
        loose_clear(&b);
    }
}

/* Quadratic elements find a stress that is linear, at every node. */
TEST(linear_stress_is_exact_in_quadratic_elements)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++) {
        loose_body b;
        const uz_element_kind kind = (uz_element_kind)i;
        if (uz_element_type_of(kind)->nodes == uz_element_type_of(kind)->corners)
            continue;
        loose_init(&b, kind, uz_element_type_of(kind)->dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN, 2);
        const int dim = b.model.mesh.dim, nodes = (int)b.model.mesh.n_nodes, k = b.body.components;
        const double(*local)[3] = uz_element_type_of(kind)->local;
        double *u = zeros(nodes * dim), *got = zeros(nodes * k), stress[6];
        for (int a = 0; a < nodes; a++) { /* straight sides: the reference element itself */
            for (int c = 0; c < dim; c++)
                b.model.mesh.xyz[a * dim + c] = local[a][c];
            u[a * dim] = 1e-3 * local[a][0] * local[a][1];
            u[a * dim + 1] = -5e-4 * local[a][0] * local[a][0];
        }
        CHECK(uz_field_recover(got, NULL, &b.body, u, NULL, NULL) == UZ_OK);
        for (int a = 0; a < nodes; a++) {
            hooke(stress, (double[6]){1e-3 * local[a][1], 0, 0, 0.5 * (1e-3 * local[a][0] - 1e-3 * local[a][0])}, 200e3,
                  0.3);
            for (int c = 0; c < k; c++)
                CHECK_MSG(fabs(got[a * k + c] - stress[c]) <= 1e-10, "%s node %d: %d %g %g", uz_element_name(kind), a,
                          c, got[a * k + c], stress[c]);
        }
        free(u);
        free(got);
        loose_clear(&b);
    }
}

static void check_heated(uz_model model, bool free_to_grow, const double stress[4])
{
    loose_body b;
    loose_init(&b, UZ_QUAD4, model, 1);
    uz_load warm = {.kind = UZ_LOAD_TEMPERATURE, .on = "all", .value = 100};
    b.scene.loads = &warm;
    b.scene.n_loads = 1;
    uz_field_body_clear(&b.body);
    CHECK(uz_field_body_init(&b.body, &b.scene, &b.model, NULL) == UZ_OK);
    const double growth = !free_to_grow ? 0 : model == UZ_PLANE_STRAIN ? 1.3e-3 : 1e-3;
    double *u = linear_motion(&b.model.mesh, (double[4]){growth, 0, 0, growth}), got[16], strain[16];
    CHECK(uz_field_recover(got, strain, &b.body, u, NULL, NULL) == UZ_OK);
    for (int i = 0; i < 16; i++)
        CHECK_MSG(fabs(got[i] - stress[i % 4]) <= 1e-9, "model %d: %d is %g, not %g", model, i % 4, got[i],
                  stress[i % 4]);
    CHECK(model != UZ_PLANE_STRESS || !free_to_grow || fabs(strain[2] - 1e-3) <= 1e-15);
    free(u);
    loose_clear(&b);
}

/* 100 degrees at 1e-5: free 1e-3. What is held has -E alpha T / (1 - k nu), k the directions held beside it. */
TEST(warmth_makes_stress_only_where_it_is_held)
{
    check_heated(UZ_PLANE_STRESS, true, (double[4]){0, 0, 0, 0});
    check_heated(UZ_AXISYMMETRIC, true, (double[4]){0, 0, 0, 0});
    check_heated(UZ_PLANE_STRAIN, true, (double[4]){0, 0, -200, 0});
    check_heated(UZ_PLANE_STRESS, false, (double[4]){-200 / 0.7, -200 / 0.7, 0, 0});
    check_heated(UZ_PLANE_STRAIN, false, (double[4]){-500, -500, -500, 0});
    check_heated(UZ_AXISYMMETRIC, false, (double[4]){-500, -500, -500, 0});
}

/* Eigenvalues have the invariants of the tensor, whatever its directions. */
TEST(principal_stresses_have_the_invariants)
{
    uint64_t random = 7;
    for (int i = 0; i < 500; i++) {
        double s[6], p[3], scale = pow(10, floor(20 * uz_uniform(&random)) - 10);
        for (int c = 0; c < 6; c++)
            s[c] = scale * (uz_uniform(&random) - 0.5);
        if (i % 5 == 0)
            s[4] = s[5] = 0;
        uz_principal(p, s, 6);
        const double trace = s[0] + s[1] + s[2],
                     square = s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]);
        const double det = s[0] * (s[1] * s[2] - s[4] * s[4]) - s[3] * (s[3] * s[2] - s[4] * s[5]) +
                           s[5] * (s[3] * s[4] - s[1] * s[5]);
        CHECK(p[0] >= p[1] && p[1] >= p[2]);
        CHECK(fabs(p[0] + p[1] + p[2] - trace) <= 1e-14 * scale);
        CHECK(fabs(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - square) <= 1e-14 * scale * scale);
        CHECK(fabs(p[0] * p[1] * p[2] - det) <= 1e-14 * scale * scale * scale);
        const double a = p[0] - p[1], b = p[1] - p[2], c = p[2] - p[0];
        CHECK(fabs(uz_von_mises(s, 6) - sqrt(0.5 * (a * a + b * b + c * c))) <= 1e-13 * scale);
        if (i % 5 == 0) {
            double q[3];
            uz_principal(q, s, 4);
            for (int k = 0; k < 3; k++)
                CHECK(fabs(p[k] - q[k]) <= 1e-14 * scale);
            CHECK(fabs(uz_von_mises(s, 4) - uz_von_mises(s, 6)) <= 1e-14 * scale);
        }
    }
}

TEST(gauss_points_carry_the_elements_own_stress)
{
    for (int kind = 0; kind < UZ_ELEMENT_KINDS; kind++) {
        loose_body b;
        const bool solid = uz_element_type_of((uz_element_kind)kind)->dim == 3;
        loose_init(&b, (uz_element_kind)kind, solid ? UZ_SOLID : UZ_PLANE_STRAIN, 1);
        static const double PLANE[4] = {1e-3, 0, 0, 0}, SPACE[9] = {1e-3};
        double *u = linear_motion(&b.model.mesh, solid ? SPACE : PLANE), stress[6];
        const int64_t n = uz_field_gauss_count(&b.body);
        const int k = b.body.components, dim = b.model.mesh.dim;
        double *element = zeros(n), *point = zeros(n * dim), *got = zeros(n * k);
        hooke(stress, (double[6]){1e-3}, 200e3, 0.3);
        CHECK_INT(n, uz_element_rule((uz_element_kind)kind, b.scene.model)->count);
        CHECK(uz_field_gauss(element, point, got, &b.body, u, NULL, NULL) == UZ_OK);
        for (int64_t g = 0; g < n; g++) {
            CHECK(element[g] == 0 && fabs(point[g * dim]) < 1.2);
            for (int c = 0; c < k; c++)
                CHECK(fabs(got[g * k + c] - stress[c]) <= 1e-12 * stress[0]);
        }
        free(u);
        free(element);
        free(point);
        free(got);
        loose_clear(&b);
    }
}

/* Nodal and Gauss stress of a warm box, as one array of n numbers. */
static double *stress_of_box(int64_t *n, uz_scene *scene, const double *u, bool alike)
{
    uz_body_model model;
    uz_field_body body;
    CHECK(uz_body_model_build(&model, scene, UZ_BODY_OUTLINE, NULL) == UZ_OK && model.mesh.uniform);
    model.mesh.uniform = alike;
    CHECK(uz_field_body_init(&body, scene, &model, NULL) == UZ_OK);
    const int64_t nodal = model.mesh.n_nodes * body.components, points = uz_field_gauss_count(&body);
    *n = nodal + points * body.components;
    double *stress = zeros(*n), *element = zeros(points), *point = zeros(points * model.mesh.dim);
    CHECK(uz_field_recover(stress, NULL, &body, u, NULL, NULL) == UZ_OK);
    CHECK(uz_field_gauss(element, point, stress + nodal, &body, u, NULL, NULL) == UZ_OK);
    free(element);
    free(point);
    uz_field_body_clear(&body);
    uz_body_model_clear(&model);
    return stress;
}

/* Elements of one shape and material share their strain operators: that changes nothing but roundings. */
TEST(equal_elements_have_the_stress_of_single_ones)
{
    static const uz_formulation ALL[] = {UZ_FORMULATION_STANDARD, UZ_FORMULATION_BBAR, UZ_FORMULATION_INCOMPATIBLE};
    uint64_t seed = 5;
    for (int k = 0; k < 6; k++) {
        uz_scene scene = box_scene(60, 20, 5, 4);
        scene.model = k < 3 ? UZ_PLANE_STRAIN : UZ_PLANE_STRESS;
        scene.formulation = ALL[k % 3];
        add_support(&scene, "left", 0, 0);
        scene.materials[0].expansion = 1e-5;
        scene.loads[scene.n_loads++] = (uz_load){.on = "all", .kind = UZ_LOAD_TEMPERATURE, .value = 30};
        double *u = zeros(6 * 5 * 2);
        for (int i = 0; i < 6 * 5 * 2; i++)
            u[i] = 0.01 * (uz_uniform(&seed) - 0.5);
        int64_t n, n_single;
        double *one = stress_of_box(&n, &scene, u, true), *single = stress_of_box(&n_single, &scene, u, false);
        CHECK_INT(n, n_single);
        const double size = largest(single, n);
        for (int64_t i = 0; i < n; i++)
            CHECK(fabs(one[i] - single[i]) <= 1e-12 * size);
        free(one);
        free(single);
        free(u);
        uz_scene_clear(&scene);
    }
}
