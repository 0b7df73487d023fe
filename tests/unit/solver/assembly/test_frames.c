/* Dofs of contact nodes turned into normal and tangents: the same problem as in x and y. */
#include "assembly/parts.h"
#include "core/alloc.h"
#include "scene_fixture.h"

#include <float.h>

/* A plate with every kind of contact node: free ones, one held in x only, one with two planes. */
static uz_scene oblique_scene(void)
{
    uz_scene scene = box_scene(60, 20, 24, 8);
    add_support(&scene, "left", 0.001, NAN);
    add_support(&scene, "right", NAN, 0);
    add_load(&scene, "top", 0.01, -0.05);
    add_load(&scene, "right", 0.5, 0);
    add_load(&scene, "bottom", 0.003, -0.002);
    add_plane(&scene, "bottom", 0, -0.0001, 0.28, 0.96);
    add_plane(&scene, "right", 60.0005, 0, -1, 0);
    return scene;
}

/* The rows of the scene's contacts on dofs along the axes, from what is told of the contacts. */
static uz_csc rows_along_axes(const uz_body_model *model)
{
    int64_t row[200], col[200], count = 0;
    double val[200];
    uz_csc N;
    for (int64_t i = 0; i < model->m; i++)
        for (int c = 0; c < 2; c++) {
            const int64_t dof = model->dof[2 * model->info.contact_node[i] + c];
            if (dof < 0 || model->info.contact_normal[2 * i + c] == 0)
                continue;
            row[count] = i;
            col[count] = dof;
            val[count++] = -model->info.contact_normal[2 * i + c];
        }
    CHECK(count <= 200);
    CHECK_INT(uz_csc_from_triplets(&N, model->m, model->d, count, row, col, val, NULL), UZ_OK);
    return N;
}

static uz_result *solve_to_the_end(const uz_problem *problem)
{
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = 1e-11;
    CHECK_MSG(uz_solve(&result, problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    if (!result)
        exit(1);
    CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s", result->summary.message);
    return result;
}

static double largest_difference(const double *a, const double *b, int64_t n)
{
    double most = 0;
    for (int64_t i = 0; i < n; i++)
        most = fmax(most, fabs(a[i] - b[i]));
    return most;
}

static double largest(const double *a, int64_t n)
{
    double most = 0;
    for (int64_t i = 0; i < n; i++)
        most = fmax(most, fabs(a[i]));
    return most;
}

TEST(answers_are_those_of_dofs_along_the_axes)
{
    uz_problem scene = {.kind = UZ_PROBLEM_SCENE, .scene = oblique_scene()}, plain = {.kind = UZ_PROBLEM_MATRICES};
    uz_mesh_info info;
    uz_body_model model = build_body(&scene.scene);
    double *p = zeros(model.d), *fixed = zeros(model.n_fixed), *nodal = zeros(2 * model.mesh.n_nodes);
    const int64_t contacts = scene.scene.n_contacts;
    plain.qp.h = zeros(model.m);
    CHECK(uz_body_model_load(p, plain.qp.h, fixed, &model, &scene.scene, NULL) == UZ_OK);
    uz_csc N = rows_along_axes(&model);
    double *h = plain.qp.h;
    scene.scene.n_contacts = 0;
    CHECK(uz_scene_to_qp(&plain.qp, &info, &scene.scene, NULL) == UZ_OK);
    CHECK_INT(info.n_rotated, 0);
    scene.scene.n_contacts = contacts;
    free(plain.qp.h);
    uz_csc_clear(&plain.qp.N);
    plain.qp.N = N;
    plain.qp.h = h;

    uz_result *turned = solve_to_the_end(&scene), *straight = solve_to_the_end(&plain);
    const int64_t m = model.m;
    CHECK_INT(m, 34);
    CHECK(straight->summary.active > 5 && straight->summary.active < m);
    CHECK_INT(turned->summary.active, straight->summary.active);
    CHECK_REL(turned->summary.certificate.energy_dual, straight->summary.certificate.energy_dual, 1e-12);
    CHECK_REL(turned->summary.certificate.energy_primal, straight->summary.certificate.energy_primal, 1e-12);
    CHECK(largest_difference(turned->r, straight->r, m) < 1e-11 * largest(straight->r, m));
    CHECK(largest_difference(turned->g, straight->g, m) < 1e-11 * largest(straight->g, m));
    for (int64_t i = 0; i < 2 * model.mesh.n_nodes; i++)
        nodal[i] = model.dof[i] >= 0 ? straight->u[model.dof[i]] : fixed[-1 - model.dof[i]];
    CHECK(largest_difference(turned->u, nodal, 2 * model.mesh.n_nodes) < 1e-11 * largest(nodal, model.d));
    double force[2] = {0};
    for (int64_t i = 0; i < 2 * m; i++)
        force[i % 2] -= straight->r[i / 2] * model.info.contact_normal[i];
    CHECK(largest_difference(turned->summary.force, force, 2) < 1e-11 * largest(force, 2));
    uz_result_free(turned);
    uz_result_free(straight);
    uz_mesh_info_clear(&info);
    uz_problem_clear(&plain);
    uz_body_model_clear(&model);
    uz_problem_clear(&scene);
    uz_free_all(p, fixed, nodal);
}

/* K = Q K0 Q', where K0 is that of the scene without its contacts. */
TEST(stiffness_is_rotated)
{
    uz_scene scene = oblique_scene();
    scene.box.cells[0] = 4;
    scene.box.cells[1] = 2;
    uz_body_model model = build_body(&scene);
    scene.n_contacts = 0;
    uz_body_model plain = build_body(&scene);
    const int64_t d = model.d;
    double *K = dense_symmetric(&model.K), *K0 = dense_symmetric(&plain.K), *x = zeros(2 * model.mesh.n_nodes);
    CHECK_INT(plain.d, d);
    CHECK_INT(model.info.n_rotated, 3); /* the first of the 5 nodes is held in x, the last in y */
    for (int64_t j = 0; j < d; j++) {   /* column j of K0 Q' by the displacement that dof j is, and of Q K0 Q' */
        double *e = zeros(d), *column = zeros(d);
        e[j] = 1;
        uz_recover_nodal(x, &model, e, NULL);
        uz_restrict_nodal(e, &plain, x);
        for (int64_t i = 0; i < d; i++)
            for (int64_t k = 0; k < d; k++)
                column[i] += K0[i * d + k] * e[k];
        uz_recover_nodal(x, &plain, column, NULL);
        uz_restrict_nodal(column, &model, x);
        for (int64_t i = 0; i < d; i++)
            CHECK(fabs(column[i] - K[i * d + j]) < 1e-14 * K0[0]);
        free(e);
        free(column);
    }
    uz_free_all(K, K0, x);
    uz_body_model_clear(&model);
    uz_body_model_clear(&plain);
    uz_scene_clear(&scene);
}

static int64_t entries_of_row(const uz_csc *N, int64_t row, double *last)
{
    int64_t count = 0;
    for (int64_t k = 0; k < N->ptr[N->cols]; k++)
        if (N->idx[k] == row) {
            count++;
            *last = N->val[k];
        }
    return count;
}

TEST(a_plane_costs_one_dof_per_node)
{
    uz_scene scene = oblique_scene();
    uz_body_model model = build_body(&scene);
    const uz_csc *N = &model.N;
    int64_t touched = 0;
    double value = 0;
    for (int64_t j = 0; j < N->cols; j++)
        touched += N->ptr[j + 1] > N->ptr[j];
    CHECK_INT(touched, model.m - 1); /* both planes bound the only free dof of the corner node */
    for (int64_t i = 0; i < 25; i++) {
        CHECK_INT(entries_of_row(N, i, &value), 1);
        CHECK_REL(value, i == 0 ? -0.96 : i == 24 ? -0.28 : -1.0, 1e-15);
    }
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* The node of two planes is turned to the first: a row of one entry, and one of two unless both normals are the same.
 */
static void check_corner(double first_x, double first_y, double x, double y, int64_t turned, int64_t entries)
{
    uz_scene scene = box_scene(3, 2, 3, 2);
    double value = 0;
    add_support(&scene, "left", 0, 0);
    add_plane(&scene, "right", 3, 0, first_x, first_y);
    add_plane(&scene, "top", 0, 2, x, y);
    uz_body_model model = build_body(&scene);
    CHECK_INT(model.m, 6);
    CHECK_INT(model.info.contact_node[2], 11);
    CHECK_INT(model.info.contact_node[5], 11);
    CHECK_INT(entries_of_row(&model.N, 2, &value), 1);
    CHECK_INT(entries_of_row(&model.N, 5, &value), entries);
    CHECK_INT(model.info.n_rotated, turned);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(a_node_of_two_planes_is_turned_to_the_first)
{
    check_corner(-3, 1, 0, -1, 3, 2);
    check_corner(-3, 1, 1, -5, 5, 2);
    check_corner(-3, 1, 1, 3, 5, 1); /* at right angles */
    check_corner(-3, 1, -9, 3, 5, 1);
    check_corner(-1, 0, 1, -1, 2, 2); /* the corner has a row along x: it stays */
    check_corner(-1, 0, 0, -1, 0, 1);
}

TEST(recovering_and_restricting_are_inverse)
{
    uz_scene scene = oblique_scene();
    uz_body_model model = build_body(&scene);
    double *u = zeros(model.d), *back = zeros(model.d), *nodal = zeros(2 * model.mesh.n_nodes);
    for (int64_t i = 0; i < model.d; i++)
        u[i] = sin((double)i);
    uz_recover_nodal(nodal, &model, u, NULL);
    uz_restrict_nodal(back, &model, nodal);
    CHECK(largest_difference(u, back, model.d) < 4 * DBL_EPSILON);
    const int64_t node = model.info.rotated_node[3]; /* minus the row of N is the displacement along the normal */
    CHECK_INT(model.info.contact_node[4], node);
    double *Nu = zeros(model.m);
    uz_csc_gaxpy(Nu, &model.N, 1, u);
    CHECK(fabs(Nu[4] + 0.28 * nodal[2 * node] + 0.96 * nodal[2 * node + 1]) < 4 * DBL_EPSILON);
    uz_free_all(Nu, u, back, nodal);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

/* Entries of N where nodes have moved along the normals of a circle to `off` of their way across them. */
static int64_t entries_of_moved(double off)
{
    uz_scene scene = box_scene(4, 1, 8, 2), moved;
    const double center[2] = {1.3, -41};
    uz_body_model at, model;
    uz_error err = {0};
    add_support(&scene, "top", 0, 0);
    add_plane(&scene, "bottom", center[0], center[1], 0, 0);
    scene.contacts[0].kind = UZ_OBSTACLE_ROUND;
    scene.contacts[0].radius = 40;
    model = build_body(&scene);
    double *place = zeros(2 * model.mesh.n_nodes);
    for (int64_t i = 0; i < model.mesh.n_nodes; i++) {
        const double x = model.mesh.xyz[2 * i] - center[0], y = model.mesh.xyz[2 * i + 1] - center[1];
        place[2 * i] = -0.01 * x - off * y;
        place[2 * i + 1] = -0.01 * y + off * x;
    }
    moved = scene;
    moved.place = place;
    CHECK_MSG(uz_body_model_move(&at, &model, &moved, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(at.m, 9);
    const int64_t entries = at.N.ptr[at.d];
    uz_body_model_clear(&at);
    uz_body_model_clear(&model);
    free(place);
    uz_scene_clear(&scene);
    return entries;
}

TEST(what_moves_along_its_normals_keeps_one_dof_per_node)
{
    CHECK_INT(entries_of_moved(2e-14), 9);
    CHECK_INT(entries_of_moved(1e-11), 18);
}

/* ------------------------------------------------------------------ three directions */

/* One brick whose nodes are all contact nodes; node a has the directions of mask bits held. */
static uz_body_model brick(int64_t element[8], int64_t dof[24], const int *held)
{
    static int64_t first[2] = {0, 8};
    static double xyz[24] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
    static uz_group all = {.name = "all", .kind = UZ_GROUP_ELEMENTS, .everything = true};
    uz_body_model model = {0};
    model.mesh = (uz_mesh){.dim = 3, .n_nodes = 8, .n_elements = 1, .xyz = xyz, .first = first, .node = element};
    model.mesh.groups = &all;
    model.mesh.n_groups = 1;
    model.dof = dof;
    for (int64_t i = 0; i < 24; i++) {
        element[i % 8] = i % 8;
        dof[i] = held[i / 3] >> (i % 3) & 1 ? -1 : i;
    }
    return model;
}

static void check_frame(const uz_body_model *model, int64_t node, const double n[3])
{
    const double *Q = uz_node_frame(model, node);
    double local[3], square = 0;
    if (!Q) {
        test_fail(__FILE__, __LINE__, "node %lld is not turned", (long long)node);
        return;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double dot = 0;
            for (int c = 0; c < 3; c++)
                dot += Q[3 * i + c] * Q[3 * j + c];
            CHECK(fabs(dot - (i == j)) < 4 * DBL_EPSILON);
        }
    uz_to_frame(local, model, node, n);
    for (int c = 0; c < 3; c++)
        if (model->dof[3 * node + c] < 0) {
            CHECK(Q[4 * c] == 1 && local[c] == n[c]);
        } else {
            square += local[c] * local[c];
            CHECK(fabs(local[c]) < 4 * DBL_EPSILON || local[c] > 0.3);
        }
    double length = 0;
    for (int c = 0; c < 3; c++)
        length += model->dof[3 * node + c] >= 0 ? n[c] * n[c] : 0;
    CHECK_REL(square, length, 1e-15);
}

/* T ke T' with T put together as a matrix. */
static void check_rotated_element(const uz_body_model *model)
{
    enum { N = 24 };
    static double T[N][N], ke[N][N], want[N][N], half[N][N];
    memset(T, 0, sizeof T);
    memset(half, 0, sizeof half);
    memset(want, 0, sizeof want);
    for (int a = 0; a < 8; a++)
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                T[3 * a + i][3 * a + j] =
                    uz_node_frame(model, a) ? uz_node_frame(model, a)[3 * i + j] : (double)(i == j);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            ke[i][j] = sin(i + 1.0) * sin(j + 1.0) + cos(i * j);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            for (int k = 0; k < N; k++)
                half[i][j] += T[i][k] * ke[k][j];
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            for (int k = 0; k < N; k++)
                want[i][j] += half[i][k] * T[j][k];
    int count;
    const int64_t *node = uz_mesh_element(&model->mesh, 0, &count);
    CHECK(uz_are_rotated(model, node, count));
    uz_turn_stiffness(&ke[0][0], model, node, count);
    CHECK(largest_difference(&ke[0][0], &want[0][0], N * N) < 1e-14);
}

TEST(frames_in_space)
{
    static const int held[8] = {0, 1, 2, 4, 3, 5, 7, 0};
    const double normals[3][3] = {{2.0 / 3, -1.0 / 3, 2.0 / 3}, {-0.48, 0.6, -0.64}, {0.6, 0.8, 0}};
    for (int k = 0; k < 3; k++) {
        int64_t element[8], dof[24];
        const double *n = normals[k];
        uz_contact contact = {.on = "all", .normal = {n[0], n[1], n[2]}};
        uz_scene scene = {.contacts = &contact, .n_contacts = 1};
        uz_body_model model = brick(element, dof, held);
        CHECK(uz_find_sites(&model, NULL, &scene, NULL) == UZ_OK); /* a plane has none but their list */
        CHECK(uz_choose_frames(&model, &scene, NULL) == UZ_OK);
        for (int64_t a = 0; a < 8; a++) {
            int axes = 0;
            for (int c = 0; c < 3; c++)
                axes += !(held[a] >> c & 1) && n[c] != 0;
            if (axes >= 2)
                check_frame(&model, a, n);
            else
                CHECK(!uz_node_frame(&model, a));
        }
        check_rotated_element(&model);
        uz_free_all(model.sites, model.frame_of, model.info.rotated_node, model.info.frame);
    }
}
