/* Boxes whose K is not assembled: products, diagonal and moved supports against the assembled matrix, residuals in
 * quadruple precision, the multigrid, and whole solves against a factor's. */
#include "brick/brick.h"
#include "brick/levels.h"
#include "certificate/residual.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"
#include "sanitized.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

/* A block held on the left, pressed from above on a plane under it, and pulled; nz 0: a plane body, of soft material in
 * plane strain. */
static uz_scene block_scene(int64_t nx, int64_t ny, int64_t nz, double poisson)
{
    uz_scene scene = box_scene(60, 20, nx, ny);
    if (nz > 0) {
        scene.model = UZ_SOLID;
        scene.box.dim = 3;
        scene.box.size[2] = 30;
        scene.box.cells[2] = nz;
        snprintf(scene.box.element, sizeof scene.box.element, "hex8");
    } else if (poisson > 0.3) {
        scene.model = UZ_PLANE_STRAIN;
    }
    scene.materials[0].poisson = poisson;
    add_support(&scene, "left", 0, 0);
    scene.supports[0].u[2] = 0;
    add_load(&scene, "top", 0, -0.05);
    add_load(&scene, "right", 0.5, 0);
    add_plane(&scene, "bottom", 0, 0, 0, 1);
    return scene;
}

/* The same body with K and without. */
typedef struct {
    uz_scene scene;
    uz_body_model whole, cells;
} twins;

static twins make_twins(int64_t nx, int64_t ny, int64_t nz, double poisson)
{
    twins t = {.scene = block_scene(nx, ny, nz, poisson)};
    uz_error err = {0};
    t.whole = build_body(&t.scene);
    CHECK(uz_body_model_build(&t.cells, &t.scene, UZ_BODY_CELLS, &err) == UZ_OK);
    CHECK(t.cells.brick != NULL);
    return t;
}

static void free_twins(twins *t)
{
    uz_body_model_clear(&t->whole);
    uz_body_model_clear(&t->cells);
    uz_scene_clear(&t->scene);
}

static void fill(double *x, int64_t n, uint64_t seed)
{
    qp_random rng = {seed};
    for (int64_t i = 0; i < n; i++)
        x[i] = random_signed(&rng);
}

static uz_multigrid *multigrid_of(const uz_body_model *model)
{
    uz_multigrid *mg = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_brick_multigrid(&mg, model->brick, 0, &err) == UZ_OK, "%s", err.message);
    return mg;
}

TEST(products_are_those_of_the_matrix)
{
    static const int64_t cells[][3] = {{1, 1, 1}, {2, 3, 1}, {7, 2, 3}, {8, 3, 2}, {9, 1, 4}, {16, 2, 2},
                                       {1, 1, 0}, {2, 5, 0}, {7, 3, 0}, {8, 4, 0}, {9, 1, 0}, {31, 2, 0}};
    for (size_t k = 0; k < sizeof cells / sizeof cells[0]; k++)
        for (int soft = 0; soft < 2; soft++) {
            twins t = make_twins(cells[k][0], cells[k][1], cells[k][2], soft ? 0.45 : 0.3);
            const int64_t d = t.whole.d;
            uz_multigrid *mg = multigrid_of(&t.cells);
            size_t bytes = 0;
            uz_multigrid_room *room = mg->kind->room(mg, &bytes);
            CHECK(room && bytes > 0);
            double *x = vector(d), *want = vector(d), *got = vector(d), most = 0.0;
            fill(x, d, k + 1);
            uz_csc_symv(want, &t.whole.K, 1.0, x);
            mg->kind->multiply(mg, &t.cells.K, room, got, x);
            for (int64_t j = 0; j < d; j++)
                most = fmax(most, fabs(want[j]));
            for (int64_t j = 0; j < d; j++) {
                CHECK(fabs(got[j] - want[j]) <= 1e-13 * most);
                const double diagonal = t.whole.K.val[t.whole.K.ptr[j]];
                CHECK_REL(t.cells.K.val[t.cells.K.ptr[j]], diagonal, 1e-14);
            }
            mg->kind->free_room(room);
            uz_multigrid_free(mg);
            free(x);
            free(want);
            free(got);
            free_twins(&t);
        }
}

TEST(energies_of_cells_are_those_of_elements)
{
    static const int64_t cells[][3] = {{1, 1, 1}, {9, 2, 3}, {20, 12, 24}, {1, 1, 0}, {9, 2, 0}, {130, 90, 0}};
    for (size_t k = 0; k < sizeof cells / sizeof cells[0]; k++) {
        twins t = make_twins(cells[k][0], cells[k][1], cells[k][2], 0.3);
        const int64_t n = t.whole.mesh.dim * t.whole.mesh.n_nodes;
        double *u = vector(n), want, got; /* supported dofs are moved, too */
        uz_error err = {0};
        fill(u, n, k + 1);
        CHECK(uz_strain_energy(&want, &t.whole, u, false, &err) == UZ_OK);
        CHECK(uz_strain_energy(&got, &t.cells, u, false, &err) == UZ_OK);
        CHECK_REL(got, want, 1e-13);
        free(u);
        free_twins(&t);
    }
}

static void check_moved_supports(int64_t nz)
{
    twins t = make_twins(5, 3, nz, 0.3);
    uz_error err = {0};
    t.scene.supports[0].u[0] = 0.01;
    t.scene.supports[0].u[2] = -0.02;
    const int64_t d = t.whole.d, m = t.whole.m;
    double *p = vector(d), *q = vector(d), *h = vector(m);
    CHECK(uz_body_model_load(p, h, NULL, &t.whole, &t.scene, &err) == UZ_OK);
    CHECK(uz_body_model_load(q, h, NULL, &t.cells, &t.scene, &err) == UZ_OK);
    double most = 0.0;
    for (int64_t j = 0; j < d; j++)
        most = fmax(most, fabs(p[j]));
    CHECK(most > 1.0);
    for (int64_t j = 0; j < d; j++)
        CHECK(fabs(p[j] - q[j]) <= 1e-13 * most);
    free(p);
    free(q);
    free(h);
    free_twins(&t);
}

TEST(moved_supports_load_the_body_alike)
{
    check_moved_supports(4);
    check_moved_supports(0);
}

/* The dof of a cell's matrix, cells and its nodes by component. */
static int64_t dof_of(const uz_brick *brick, const int64_t cell[3], int row)
{
    int64_t node = 0, step = 1;
    for (int c = 0; c < brick->axes; c++) {
        node += (cell[c] + uz_brick_corner[row / brick->axes][c]) * step;
        step *= brick->cells[uz_brick_axis_of(brick->axes, c)] + 1;
    }
    return brick->dof[brick->axes * node + row % brick->axes];
}

/* hi + lo of K x, cell by cell in quadruple precision. */
static void check_residuals(int64_t nz)
{
    twins t = make_twins(6, 2, nz, 0.3);
    const uz_brick *brick = t.cells.brick;
    const int64_t d = t.cells.d, m = t.cells.m;
    double *u = vector(d), *c = vector(d), *p = vector(d), *r = vector(m);
    uz_residuals got = {vector(d), vector(d), vector(d), vector(d), vector(d), brick};
    __float128 *want = calloc((size_t)d, sizeof *want), *changed = calloc((size_t)d, sizeof *changed);
    double *size = vector(d);
    uz_error err = {0};
    fill(u, d, 5);
    fill(r, m, 6);
    for (int64_t i = 0; i < m; i++)
        r[i] = -fabs(r[i]);
    for (int64_t j = 0; j < d; j++)
        c[j] = t.cells.N.ptr[j + 1] > t.cells.N.ptr[j] ? 1e-9 * u[d - 1 - j] : 0.0;
    const int dofs = uz_brick_dofs(brick->axes);
    for (int64_t e = 0; e < t.cells.mesh.n_elements; e++) {
        const int64_t *n = t.scene.box.cells, cell[3] = {e % n[0], e / n[0] % n[1], e / n[0] / n[1]};
        for (int row = 0; row < dofs; row++)
            for (int column = 0; column < dofs; column++) {
                const int64_t to = dof_of(brick, cell, row), from = dof_of(brick, cell, column);
                const double entry = brick->ke[row * dofs + column];
                if (to < 0 || from < 0)
                    continue;
                want[to] += (__float128)entry * u[from];
                changed[to] += (__float128)entry * c[from];
                size[to] += fabs(entry * u[from]);
            }
    }
    for (int64_t j = 0; j < d; j++) /* what is left is far below double precision */
        p[j] = (double)want[j];
    CHECK(uz_equilibrium_residual(&got, &t.cells.K, &t.cells.N, p, u, c, r, &err) == UZ_OK);
    for (int64_t j = 0; j < d; j++) {
        __float128 e = want[j] - p[j];
        for (int64_t k = t.cells.N.ptr[j]; k < t.cells.N.ptr[j + 1]; k++) {
            e -= (__float128)t.cells.N.val[k] * r[t.cells.N.idx[k]];
            size[j] += fabs(t.cells.N.val[k] * r[t.cells.N.idx[k]]);
        }
        const double n = (double)uz_most_terms(&t.cells.K, brick, &t.cells.N) + 2.0,
                     hidden = 0x1p-104 * n * n * size[j];
        CHECK(fabs((double)(e - got.e_u[j])) <= hidden + 0x1p-52 * fabs((double)e));
        CHECK(fabs((double)(changed[j] - got.Kc[j])) <= 1e-13 * (1.0 + fabs((double)changed[j])));
        CHECK(got.weight[j] == 1.0 / t.cells.K.val[j]);
    }
    double *room[] = {u, c, p, r, size, got.e, got.e_u, got.Ku, got.Kc, got.weight};
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        free(room[k]);
    free(want);
    free(changed);
    free_twins(&t);
}

TEST(residuals_are_exact_to_twice_the_precision)
{
    check_residuals(3);
    check_residuals(0);
}

/* r'M^-1 s = s'M^-1 r to single precision, r'M^-1 r > 0, zeros at held dofs; whatever was held before. */
static void check_symmetry(int64_t nx, int64_t ny, int64_t nz)
{
    twins t = make_twins(nx, ny, nz, 0.3);
    const int64_t d = t.cells.d;
    uz_multigrid *mg = multigrid_of(&t.cells);
    uz_error err = {0};
    uz_cg cg = {0};
    bool *held = calloc((size_t)d, sizeof *held);
    double *r = vector(d), *s = vector(d), *y = vector(d), *z = vector(d), *first = vector(d);
    CHECK(mg->levels > 2);
    CHECK(uz_cg_init(&cg, mg, &err) == UZ_OK);
    fill(r, d, 1);
    fill(s, d, 2);
    for (int64_t j = 0; j < d; j++)
        held[j] = t.cells.N.ptr[j + 1] > t.cells.N.ptr[j];
    for (int pass = 0; pass < 3; pass++) { /* free, held, free again */
        CHECK(uz_cg_hold(&cg, &t.cells.K, pass == 1 ? held : NULL, NULL, &err) == UZ_OK);
        CHECK(uz_multigrid_apply(mg, &t.cells.K, cg.room, z, r, &err) == UZ_OK);
        CHECK(uz_multigrid_apply(mg, &t.cells.K, cg.room, y, s, &err) == UZ_OK);
        double across = 0.0, back = 0.0, own = 0.0, other = 0.0;
        for (int64_t j = 0; j < d; j++) {
            across += s[j] * z[j];
            back += r[j] * y[j];
            own += r[j] * z[j];
            other += s[j] * y[j];
            CHECK(pass != 1 || !held[j] || (z[j] == 0.0 && y[j] == 0.0));
        }
        CHECK(own > 0.0 && other > 0.0);
        CHECK(fabs(across - back) <= 1e-5 * sqrt(own * other));
        if (pass == 0)
            memcpy(first, z, (size_t)d * sizeof *z);
        CHECK(pass != 2 || memcmp(first, z, (size_t)d * sizeof *z) == 0);
    }
    uz_cg_clear(&cg);
    uz_multigrid_free(mg);
    free(held);
    double *room[] = {r, s, y, z, first};
    for (size_t k = 0; k < sizeof room / sizeof room[0]; k++)
        free(room[k]);
    free_twins(&t);
}

TEST(the_cycle_is_symmetric_with_dofs_held_too)
{
    check_symmetry(12, 7, 10);
    check_symmetry(45, 31, 0);
}

/* Powers reach the largest eigenvalue of diag(K)^-1 K from below. */
static double largest_found(const uz_csc *K)
{
    double *x = vector(K->cols), *y = vector(K->cols), most = 0.0;
    fill(x, K->cols, 5);
    for (int step = 0; step < 200; step++) {
        double up = 0.0, down = 0.0;
        memset(y, 0, (size_t)K->cols * sizeof *y);
        uz_csc_symv(y, K, 1.0, x);
        for (int64_t j = 0; j < K->cols; j++) {
            up += x[j] * y[j];
            down += x[j] * x[j] * K->val[K->ptr[j]];
        }
        most = up / down;
        for (int64_t j = 0; j < K->cols; j++)
            x[j] = y[j] / K->val[K->ptr[j]] / most;
    }
    free(x);
    free(y);
    return most;
}

/* Were it less than that, the cycle could be indefinite, and what it certifies wrong; where it is more, it smooths
 * less.
 */
TEST(smoothers_are_made_for_the_largest_eigenvalue)
{
    static const int64_t cells[][3] = {{6, 6, 6}, {7, 5, 6}, {3, 4, 3}, {9, 2, 3}, {8, 1, 1}, {5, 1, 2},
                                       {6, 6, 0}, {7, 5, 0}, {3, 4, 0}, {9, 2, 0}, {8, 1, 0}, {6, 3, 0}};
    static const double poisson[] = {0, 0.3, 0.45, 0.499}, length[] = {60, 6};
    for (size_t k = 0; k < sizeof cells / sizeof cells[0]; k++)
        for (int of = 0; of < 8; of++) {
            uz_scene scene = block_scene(cells[k][0], cells[k][1], cells[k][2], poisson[of / 2]);
            scene.box.size[0] = length[of % 2];
            uz_body_model whole = build_body(&scene), by_cells;
            CHECK(uz_body_model_build(&by_cells, &scene, UZ_BODY_CELLS, NULL) == UZ_OK);
            uz_brick_smoother smoother;
            uz_brick_smoother_init(&smoother, by_cells.brick->axes, by_cells.brick->cells, by_cells.brick->ke, 1.0,
                                   (bool[3]){true, true, true});
            const double found = largest_found(&whole.K), most = smoother.most;
            CHECK_MSG(found <= most && most <= 1.25 * found, "%zu, %d: %g for %g", k, of, most, found);
            uz_body_model_clear(&whole);
            uz_body_model_clear(&by_cells);
            uz_scene_clear(&scene);
        }
}

/* Iterations to 1e-8 of the first residual. */
static int64_t iterations(const uz_scene *scene, double *lambda)
{
    uz_body_model model;
    uz_error err = {0};
    uz_amg *amg = NULL;
    uz_cg cg = {0};
    uz_cg_info info;
    CHECK(uz_body_model_build(&model, scene, UZ_BODY_CELLS, &err) == UZ_OK);
    CHECK(uz_amg_of(&amg, multigrid_of(&model), &model.K, 0, NULL, &err) == UZ_OK);
    CHECK(uz_cg_init(&cg, amg->mg, &err) == UZ_OK);
    double *x = vector(model.d), *b = vector(model.d);
    fill(b, model.d, 3);
    const uz_cg_stop stop = {.relative = 1e-8, .max_iterations = 200, .deadline = INFINITY};
    CHECK(uz_cg_solve(&info, x, &cg, &model.K, b, &stop, &err) == UZ_OK);
    CHECK(info.met);
    *lambda = amg->info.lambda;
    free(x);
    free(b);
    uz_cg_clear(&cg);
    uz_amg_free(amg);
    uz_body_model_clear(&model);
    return info.iterations;
}

TEST(iterations_do_not_grow_with_the_grid)
{
    static const struct {
        double size[3];
        int64_t cells[3];
    } bodies[] = {
        {{40, 40, 40}, {8, 8, 8}},     {{40, 40, 40}, {16, 16, 16}},  {{40, 40, 40}, {24, 24, 24}},
        {{40, 40, 40}, {21, 19, 23}},  {{400, 40, 40}, {16, 16, 16}}, {{4, 40, 40}, {16, 16, 16}},
        {{40, 400, 40}, {16, 16, 16}}, {{60, 20, 30}, {24, 5, 7}},    {{60, 20, 0}, {48, 16, 0}},
        {{60, 20, 0}, {96, 32, 0}},    {{60, 20, 0}, {288, 96, 0}},   {{60, 20, 0}, {101, 35, 0}},
        {{600, 20, 0}, {96, 32, 0}},   {{6, 20, 0}, {96, 32, 0}},     {{60, 60, 0}, {90, 7, 0}},
        {{60, 60, 0}, {5, 150, 0}},
    };
    for (size_t k = 0; k < sizeof bodies / sizeof bodies[0]; k += (size_t)step_of_cases()) {
        for (int hard = 0; hard < 2; hard++) {
            uz_scene scene = block_scene(2, 2, bodies[k].cells[2], hard ? 0.49 : 0.3);
            double lambda;
            memcpy(scene.box.size, bodies[k].size, sizeof scene.box.size);
            memcpy(scene.box.cells, bodies[k].cells, sizeof scene.box.cells);
            const int64_t count = iterations(&scene, &lambda);
            CHECK_MSG(count <= (hard ? 40 : 13) && lambda > (hard ? 0.01 : 0.15), "%zu, %d: %lld iterations, lambda %g",
                      k, hard, (long long)count, lambda);
            uz_scene_clear(&scene);
        }
    }
}

/* Both forms: the distance of the answers is within what both certificates say, and so are forces. */
static void check_solve(const uz_scene *scene, double relative_error)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *scene};
    uz_settings direct = uz_settings_default(), by_cells = direct;
    direct.op = UZ_OPERATOR_CONDENSED;
    direct.relative_error = 1e-10;
    by_cells.op = UZ_OPERATOR_MATRIX_FREE;
    by_cells.relative_error = relative_error;
    uz_result *want = solve_problem(&problem, &direct), *got = solve_problem(&problem, &by_cells);
    CHECK_INT(got->summary.outcome, UZ_CONVERGED);
    CHECK_INT(got->summary.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK(got->summary.certificate.relative_error <= relative_error);
    uz_body_model model = build_body(scene);
    double *e = vector(model.d), *v = vector(model.d), *Ke = vector(model.d), sum = 0.0;
    uz_restrict_nodal(e, &model, got->u);
    uz_restrict_nodal(v, &model, want->u);
    for (int64_t j = 0; j < model.d; j++)
        e[j] -= v[j];
    uz_csc_symv(Ke, &model.K, 1.0, e);
    for (int64_t j = 0; j < model.d; j++)
        sum += e[j] * Ke[j];
    /* and what rounding p and K's entries may make of it */
    const double bound = got->summary.certificate.absolute_error + want->summary.certificate.absolute_error +
                         1e-11 * want->summary.certificate.energy_norm;
    CHECK_MSG(sqrt(fmax(0.0, sum)) <= bound, "%g is beyond %g", sqrt(fmax(0.0, sum)), bound);
    CHECK_REL(got->summary.reaction_sum, want->summary.reaction_sum, 10 * relative_error);
    CHECK_REL(got->summary.certificate.energy_primal, want->summary.certificate.energy_primal, 10 * relative_error);
    free(e);
    free(v);
    free(Ke);
    uz_body_model_clear(&model);
    uz_result_free(want);
    uz_result_free(got);
}

TEST(solves_agree_with_a_factor)
{
    static const double poisson[] = {0.3, 0.45};
    for (int k = 0; k < 4; k++) {
        uz_scene scene = k < 2 ? block_scene(12, 5, 7, poisson[k]) : block_scene(61, 20, 0, poisson[k - 2]);
        check_solve(&scene, 1e-6);
        scene.supports[0].u[0] = 0.002;
        check_solve(&scene, 1e-8);
        uz_scene_clear(&scene);
    }
}

static uz_result *solve_by_cells(const uz_scene *scene, double relative_error)
{
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *scene};
    uz_settings settings = uz_settings_default();
    settings.op = UZ_OPERATOR_MATRIX_FREE;
    settings.relative_error = relative_error;
    uz_result *result = solve_problem(&problem, &settings);
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    return result;
}

/* Upside down the rows are upper bounds, not lower ones. In metres and pascals all but exponents stay. Coarser grids
 * leave few steps to the finest. */
static void check_mirrored(int64_t nx, int64_t ny, int64_t nz)
{
    uz_scene scene = block_scene(nx, ny, nz, 0.3), mirrored = block_scene(nx, ny, nz, 0.3),
             metres = block_scene(nx, ny, nz, 0.3);
    snprintf(mirrored.loads[0].on, sizeof mirrored.loads[0].on, "bottom");
    mirrored.loads[0].v[1] *= -1;
    snprintf(mirrored.contacts[0].on, sizeof mirrored.contacts[0].on, "top");
    mirrored.contacts[0].point[1] = 20;
    mirrored.contacts[0].normal[1] = -1;
    for (int c = 0; c < 3; c++)
        metres.box.size[c] *= 1e-3;
    metres.thickness *= 1e-3;
    metres.materials[0].young *= 1e6;
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++)
            metres.loads[k].v[c] *= 1e6;
    uz_result *one = solve_by_cells(&scene, 1e-8), *other = solve_by_cells(&mirrored, 1e-8),
              *third = solve_by_cells(&metres, 1e-8);
    CHECK(one->summary.active > 20 && one->summary.active < one->summary.kept - 20);
    CHECK_INT(other->summary.active, one->summary.active);
    CHECK_INT(third->summary.active, one->summary.active);
    CHECK_REL(other->summary.reaction_sum, one->summary.reaction_sum, 1e-7);
    CHECK_REL(third->summary.reaction_sum, one->summary.reaction_sum, 1e-7); /* newtons both */
    CHECK_MSG(one->summary.iterations <= 4, "%lld steps", (long long)one->summary.iterations);
    CHECK(third->summary.iterations <= 4 && other->summary.iterations <= 4);
    uz_result_free(one);
    uz_result_free(other);
    uz_result_free(third);
    uz_scene_clear(&scene);
    uz_scene_clear(&mirrored);
    uz_scene_clear(&metres);
}

TEST(mirrored_and_in_other_units_the_answer_is_the_same)
{
    check_mirrored(24, 8, 12);
    check_mirrored(120, 40, 0);
}

/* No row touches, or all do; and none is there. */
static void check_far_and_flat(int64_t nx, int64_t ny, int64_t nz)
{
    uz_scene scene = block_scene(nx, ny, nz, 0.3);
    scene.contacts[0].point[1] = -1;
    uz_result *far = solve_by_cells(&scene, 1e-8);
    CHECK_INT(far->summary.active, 0);
    uz_result_free(far);
    check_solve(&scene, 1e-8);
    scene.contacts[0].point[1] = 0;
    scene.n_loads = 1;
    scene.loads[0].v[1] = -50;
    scene.materials[0].poisson = 0;
    check_solve(&scene, 1e-7);
    scene.n_contacts = 0;
    uz_result *linear = solve_by_cells(&scene, 1e-8);
    CHECK_INT(linear->summary.method, UZ_METHOD_LINEAR);
    uz_result_free(linear);
    uz_scene_clear(&scene);
}

TEST(bodies_far_from_the_plane_and_pressed_flat_on_it)
{
    check_far_and_flat(9, 4, 6);
    check_far_and_flat(40, 13, 0);
}

/* A body that only moves, of cells that hardly bend: what ends short of the request has no exact solve, as there is no
 * matrix to make it with. */
TEST(what_has_no_matrix_has_no_exact_solve)
{
    static const double asked[] = {1e-4, 1e-5, 1e-6};
    uz_scene scene = block_scene(3, 3, 3, 0);
    const double size[3] = {1000, 1, 10};
    memcpy(scene.box.size, size, sizeof size);
    scene.supports[0].u[0] = 1;
    scene.n_loads = 0;
    scene.contacts[0].point[1] = -1e-4;
    uz_settings settings = uz_settings_default();
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    settings.op = UZ_OPERATOR_MATRIX_FREE;
    for (int k = 0; k < 3; k++) {
        settings.relative_error = asked[k];
        uz_result *result = solve_problem(&problem, &settings);
        double off = 0; /* of the true answer */
        for (int64_t i = 0; i < result->n_nodes; i++)
            off = fmax(off, fabs(result->u[3 * i] - 1));
        CHECK_INT(result->summary.op, UZ_OPERATOR_MATRIX_FREE);
        CHECK_MSG(off < 0.01 || result->summary.outcome != UZ_CONVERGED, "%g is off by %g", asked[k], off);
        uz_result_free(result);
    }
    scene.n_loads = 2; /* to be cleared */
    uz_scene_clear(&scene);
}

/* Where a factor takes longer, by far; what it is said to take before anything is assembled, and takes. */
TEST(auto_takes_boxes_of_many_cells_and_tells_their_memory)
{
    uz_scene scene = block_scene(24, 16, 20, 0.3);
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    uz_settings settings = uz_settings_default();
    uz_prediction predicted;
    uz_error err = {0};
    settings.relative_error = 1e-6;
    uz_result *result = solve_problem(&problem, &settings);
    const uz_cost *cost = &result->summary.cost;
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK_INT(result->summary.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK_MSG(fabs(cost->bytes / cost->actual_bytes - 1) < 0.2, "%g bytes of %g", cost->bytes, cost->actual_bytes);
    CHECK_MSG(uz_predict(&predicted, &problem, &settings, NULL, &err) == UZ_OK, "%s", err.message);
    CHECK_INT(predicted.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK_INT(predicted.d, result->d);
    CHECK(predicted.fits && predicted.bytes == cost->bytes);
    uz_result_free(result);
    settings.memory_limit = (size_t)(0.5 * predicted.bytes);
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_LIMIT);
    settings.memory_limit = 0;
    memcpy(problem.scene.box.cells, (int64_t[3]){6, 4, 5}, sizeof problem.scene.box.cells);
    result = solve_problem(&problem, &settings);
    CHECK_INT(result->summary.op, UZ_OPERATOR_CONDENSED);
    uz_result_free(result);
    uz_scene_clear(&scene);
}

static uz_operator chosen_for(const uz_scene *scene, int64_t cases, const uz_settings *settings)
{
    uz_load_case none[16] = {{.name = ""}};
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = *scene, .cases = none, .n_cases = cases};
    uz_prediction predicted;
    uz_error err = {0};
    CHECK_MSG(uz_predict(&predicted, &problem, settings, NULL, &err) == UZ_OK, "%s", err.message);
    return predicted.op;
}

/* A plane body is solved by its cells where that is cheaper even with what a factor spares later loads; what it takes,
 * and the answer of a factor. */
TEST(auto_takes_plane_bodies_of_many_cells)
{
    uz_scene scene = block_scene(270, 90, 0, 0.3);
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    uz_settings settings = uz_settings_default(), direct = settings;
    settings.relative_error = direct.relative_error = 1e-6;
    direct.op = UZ_OPERATOR_CONDENSED;
    uz_result *result = solve_problem(&problem, &settings), *want = solve_problem(&problem, &direct);
    const uz_cost *cost = &result->summary.cost;
    CHECK_INT(result->summary.outcome, UZ_CONVERGED);
    CHECK_INT(result->summary.op, UZ_OPERATOR_MATRIX_FREE);
    CHECK_MSG(fabs(cost->bytes / cost->actual_bytes - 1) < 0.2, "%g bytes of %g", cost->bytes, cost->actual_bytes);
    CHECK_INT(result->summary.active, want->summary.active);
    CHECK_REL(result->summary.reaction_sum, want->summary.reaction_sum, 1e-6);
    CHECK(4 * cost->actual_bytes < want->summary.cost.actual_bytes);
    uz_result_free(result);
    uz_result_free(want);
    CHECK_INT(chosen_for(&scene, 10, &settings), UZ_OPERATOR_MATRIX_FREE);
    CHECK_INT(chosen_for(&scene, 11, &settings), UZ_OPERATOR_CONDENSED);
    scene.box.size[0] = 401; /* twenty times as long as high */
    CHECK_INT(chosen_for(&scene, 0, &settings), UZ_OPERATOR_CONDENSED);
    scene.box.size[0] = 60;
    scene.materials[0].poisson = 0.46;
    CHECK_INT(chosen_for(&scene, 0, &settings), UZ_OPERATOR_MATRIX_FREE);
    scene.model = UZ_PLANE_STRAIN;
    CHECK_INT(chosen_for(&scene, 0, &settings), UZ_OPERATOR_CONDENSED);
    scene.materials[0].poisson = 0.3;
    CHECK_INT(chosen_for(&scene, 0, &settings), UZ_OPERATOR_MATRIX_FREE);
    scene.box.cells[1] = 60; /* 33,062 dofs */
    CHECK_INT(chosen_for(&scene, 0, &settings), UZ_OPERATOR_CONDENSED);
    uz_scene_clear(&scene);
}

/* Boxes by their cells up to the largest scenes; what has to be assembled up to where that takes minutes, or more than
 * the limit. */
TEST(what_is_predicted_of_large_boxes)
{
    uz_scene scene = block_scene(112, 112, 112, 0.3);
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    uz_settings settings = uz_settings_default();
    uz_prediction predicted;
    uz_error err = {0};
    if (!SANITIZED) {
        CHECK_INT(uz_predict(&predicted, &problem, &settings, NULL, &err), UZ_OK);
        CHECK(predicted.op == UZ_OPERATOR_MATRIX_FREE && predicted.d > 4000000 && predicted.d < 3 * 113 * 113 * 113);
    }
    problem.scene.box.grading[0] = 2;
    CHECK_INT(uz_predict(&predicted, &problem, &settings, NULL, &err), UZ_ERR_LIMIT);
    memcpy(problem.scene.box.cells, (int64_t[3]){50, 50, 50}, sizeof problem.scene.box.cells);
    settings.memory_limit = (size_t)100 << 20;
    CHECK_INT(uz_predict(&predicted, &problem, &settings, NULL, &err), UZ_ERR_LIMIT);
    uz_scene_clear(&scene);
}

/* Nearly incompressible cells are none that this multigrid is good for: a factor is made after all, of a K assembled
 * for it. */
TEST(auto_gives_up_cells_that_their_multigrid_is_bad_for)
{
    uz_scene scene = block_scene(18, 18, 18, 0.4999);
    const uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    uz_settings settings = uz_settings_default();
    uz_cache *cache = uz_cache_new((size_t)1 << 30);
    settings.relative_error = 1e-6;
    for (int k = 0; k < 2; k++) { /* the second time from the cache */
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK_MSG(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK_INT(result->summary.op, UZ_OPERATOR_CONDENSED);
        CHECK(result->summary.factor_cached == (k == 1));
        uz_result_free(result);
    }
    uz_cache_free(cache);
    uz_scene_clear(&scene);
}

/* What is no box of equal cells with bounds is solved with its matrix, as before. */
static void check_others(int64_t nz)
{
    uz_scene scene = block_scene(4, 3, nz, 0.3);
    uz_error err = {0};
    for (int k = 0; k < (nz > 0 ? 4 : 5); k++) {
        uz_scene other = scene;
        uz_contact round = scene.contacts[0];
        uz_support springs[2] = {scene.supports[0], {.kind = UZ_SUPPORT_SPRING, .on = "right", .spring = {1, 1, 1}}};
        if (k == 0)
            other.box.grading[1] = 2;
        if (k == 1)
            snprintf(other.box.element, sizeof other.box.element, nz > 0 ? "hex20" : "quad8");
        if (k == 2) {
            round = (uz_contact){.on = "bottom", .kind = UZ_OBSTACLE_ROUND, .point = {30, -100, 15}, .radius = 100};
            other.contacts = &round;
        }
        if (k == 3) {
            other.supports = springs;
            other.n_supports = 2;
        }
        if (k == 4)
            other.model = UZ_AXISYMMETRIC;
        uz_body_model model;
        CHECK_MSG(uz_body_model_build(&model, &other, UZ_BODY_CELLS, &err) == UZ_OK, "%s", err.message);
        CHECK(model.brick == NULL);
        CHECK(model.K.ptr[model.d] > (nz > 0 ? 8 : 4) * model.d);
        uz_body_model_clear(&model);
    }
    uz_scene_clear(&scene);
}

TEST(other_scenes_keep_their_matrix)
{
    check_others(3);
    check_others(0);
}
