/* Multigrid and conjugate gradients against a factor of the same matrix, in two and three dimensions.
 * not under ThreadSanitizer: two threads stand for processes, and meet at barriers alone */
#include "amg_pair.h"
#include "element/element_type.h"
#include "dual/form.h"

#include <pthread.h>

/* x'M^-1 y = y'M^-1 x, and x'M^-1 x > 0. */
static void check_definite(const pair *p)
{
    int64_t n = p->K.cols;
    double *x = random_vector(n, 1), *y = random_vector(n, 2), *Mx = vector(n), *My = vector(n);
    apply(p, Mx, x);
    apply(p, My, y);
    CHECK_REL(dot(x, My, n), dot(y, Mx, n), 1e-5);
    CHECK(dot(x, Mx, n) > 0.0 && dot(y, My, n) > 0.0);
    free(x);
    free(y);
    free(Mx);
    free(My);
}

/* e'K^-1 e <= e'M^-1 e / lambda: of a random e, and of the residuals that conjugate gradients find hardest, where it
 * must also be sharp within `slack`. */
static void check_bound(pair *p, double slack)
{
    int64_t n = p->K.cols;
    double *b = random_vector(n, 3), *x = vector(n), *w = vector(n), worst = 0.0;
    uz_error err = {0};
    for (int64_t steps = 0; steps <= 40; steps += 4) {
        uz_cg_stop stop = {.max_iterations = steps, .deadline = INFINITY};
        uz_cg_info info;
        memset(x, 0, (size_t)n * sizeof *x);
        CHECK(uz_cg_solve(&info, x, &p->cg, &p->K, b, &stop, &err) == UZ_OK);
        memcpy(w, p->cg.r, (size_t)n * sizeof *w);
        solve_exactly(p, w);
        double exact = dot(w, p->cg.r, n), bound = dot(p->cg.z, p->cg.r, n) / p->info.lambda;
        CHECK_MSG(exact <= bound, "%g > %g after %lld steps", exact, bound, (long long)steps);
        worst = fmax(worst, exact / bound);
    }
    CHECK_MSG(worst > slack, "the bound is %g times too large", 1.0 / worst);
    free(b);
    free(x);
    free(w);
}

/* What e'K^-1 e is bounded by where this much of it is enough, over what it is. */
static double bound_over_exact(const pair *p, double enough)
{
    int64_t n = p->K.cols;
    double *e = random_vector(n, 4), *w = vector(n), *no_load = vector(n), none = 0.0, value = 0.0;
    uz_error err = {0};
    uz_csc no_rows;
    uz_dual *dual = NULL;
    uz_dual_load *load = NULL;
    CHECK(uz_csc_init(&no_rows, 0, n, 0, &err) == UZ_OK);
    const uz_dual_source source = {.op = UZ_OPERATOR_MATRIX_FREE, .N = &no_rows, .amg = p->amg};
    CHECK(uz_dual_create(&dual, &source, NULL, &err) == UZ_OK);
    CHECK(uz_dual_load_create(&load, dual, &p->K, no_load, &none, &err) == UZ_OK);
    memcpy(w, e, (size_t)n * sizeof *w);
    solve_exactly(p, w);
    double exact = dot(e, w, n);
    CHECK(dual->form->inverse_norm(load, &value, e, enough * exact, &err) == UZ_OK);
    uz_dual_load_free(load);
    uz_dual_free(dual);
    uz_csc_clear(&no_rows);
    free(no_load);
    free(e);
    free(w);
    return value / exact;
}

/* Sharp where nothing is enough or what is enough is not reached, else not above that. */
static void check_norm(const pair *p)
{
    const double enough[] = {0.0, 0.9, 1.05, 1.5, 3.0, 100.0};
    for (int k = 0; k < 6; k++) {
        const double bound = bound_over_exact(p, enough[k]);
        CHECK_MSG(bound >= 1.0 - 1e-12 && bound <= fmax(1.02, enough[k]), "%.17g where %g is enough", bound, enough[k]);
    }
}

/* The solution to 4e-8 in the energy norm, and how many iterations it took. For nearly incompressible bodies rounding
 * ends the iterations not far below. */
static int64_t check_solution(pair *p)
{
    int64_t n = p->K.cols;
    double *b = vector(n), *x = vector(n), *exact = vector(n), *Ke = vector(n);
    uz_error err = {0};
    uz_cg_info info;
    uz_cg_stop stop = {.relative = 4e-8 * sqrt(p->info.lambda), .max_iterations = 2000, .deadline = INFINITY};
    for (int64_t j = 0; j < n; j++)
        b[j] = exact[j] = 1.0;
    solve_exactly(p, exact);
    CHECK(uz_cg_solve(&info, x, &p->cg, &p->K, b, &stop, &err) == UZ_OK);
    CHECK(info.met);
    double norm2 = dot(b, exact, n);
    for (int64_t j = 0; j < n; j++)
        exact[j] -= x[j];
    uz_csc_symv(Ke, &p->K, 1.0, exact);
    double error = sqrt(dot(Ke, exact, n) / norm2);
    CHECK_MSG(error <= 8e-8, "%g", error);
    free(b);
    free(x);
    free(exact);
    free(Ke);
    return info.iterations;
}

static void check_pair(pair *p, double slack, int64_t most)
{
    CHECK(p->info.levels > 1);
    check_definite(p);
    check_bound(p, slack);
    check_norm(p);
    int64_t iterations = check_solution(p);
    CHECK_MSG(iterations <= most, "%lld iterations, lambda %g", (long long)iterations, p->info.lambda);
}

TEST(plane_bodies_take_the_same_iterations_on_every_mesh)
{
    for (int64_t nx = 60; nx <= 120; nx += 30) {
        pair p = open_plane(paper_scene(nx, nx / 3), true);
        check_pair(&p, 0.2, 18);
        close_pair(&p);
    }
}

static void check_near(const float *x, const float *wanted, int64_t n, double tolerance)
{
    double off = 0.0, size = 0.0;
    for (int64_t i = 0; i < n; i++) {
        off = fmax(off, fabs((double)x[i] - (double)wanted[i]));
        size = fmax(size, fabs((double)wanted[i]));
    }
    CHECK_MSG(off <= tolerance * size && size > 0.0, "off by %g of %g", off, size);
}

/* A cycle and a product of two vectors at once are those of each. */
static void check_lanes(pair *p)
{
    const uz_aggregates *mg = (const uz_aggregates *)p->amg->mg;
    const uz_blocks *A = &mg->level[0].A;
    uz_multigrid_room *room = p->cg.room;
    const int64_t nodes = A->nodes, n = 4 * nodes;
    float *alone[2];
    double *x = vector(2 * n), *y = vector(2 * n), *one = vector(n), *image = vector(n);
    uz_error err = {0};
    CHECK(p->amg->mg->levels > 1 && uz_room_for_lanes(room, p->amg->mg));
    for (int l = 0; l < 2; l++) {
        double *b = random_vector(nodes * A->b, (uint64_t)(7 + l));
        alone[l] = malloc((size_t)n * sizeof *alone[l]);
        memset(one, 0, (size_t)n * sizeof *one);
        for (int64_t i = 0; i < nodes * A->b; i++) {
            one[i / A->b * 4 + i % A->b] = b[i];
            x[(i / A->b * 2 + l) * 4 + i % A->b] = b[i];
        }
        for (int64_t i = 0; i < n; i++)
            room->b[0][i] = (float)one[i];
        CHECK(uz_cycle_below(mg, room, 0, 1, &err) == UZ_OK);
        memcpy(alone[l], room->x[0], (size_t)n * sizeof *alone[l]);
        uz_level_multiply_parts(image, &mg->level[0], one, 1);
        for (int64_t i = 0; i < nodes * A->b; i++)
            one[i] = image[i / A->b * 4 + i % A->b];
        uz_level_multiply_parts(y, &mg->level[0], x, 2); /* the second lane is 0 the first time */
        for (int64_t i = 0; i < nodes * A->b; i++)
            CHECK(fabs(y[(i / A->b * 2 + l) * 4 + i % A->b] - one[i]) <= 1e-12 * (1.0 + fabs(one[i])));
        free(b);
    }
    for (int64_t i = 0; i < 2 * n; i++)
        room->b[0][i] = (float)x[i];
    CHECK(uz_cycle_below(mg, room, 0, 2, &err) == UZ_OK);
    for (int l = 0; l < 2; l++) {
        float *lane = malloc((size_t)n * sizeof *lane);
        for (int64_t i = 0; i < n; i++)
            lane[i] = room->x[0][(i / 4 * 2 + l) * 4 + i % 4];
        check_near(lane, alone[l], n, 1e-5);
        free(lane);
        free(alone[l]);
    }
    free(x);
    free(y);
    free(one);
    free(image);
}

/* Blocks in parts beside a diagonal that is whole, as a group has them. */
static void check_whole_diagonal(const pair *p)
{
    const uz_level *level = &((const uz_aggregates *)p->amg->mg)->level[0];
    const int64_t nodes = level->A.nodes, size = (int64_t)level->A.b * level->A.b, n = 4 * nodes;
    uz_level whole = *level;
    double *x = vector(n), *y = vector(n), *parted = vector(n), block[9];
    whole.A.diag = vector(nodes * size + 4);
    whole.diag = NULL;
    whole.diag_rest = (uz_rests){NULL, 0.0};
    for (int64_t i = 0; i < nodes; i++) {
        memcpy(whole.A.diag + i * size, uz_level_block(block, level, true, i, size), (size_t)size * sizeof block[0]);
        for (int c = 0; c < level->A.b; c++)
            x[4 * i + c] = sin((double)(4 * i + c));
    }
    uz_level_multiply_parts(parted, level, x, 1);
    uz_level_multiply_parts(y, &whole, x, 1);
    for (int64_t i = 0; i < n; i++)
        CHECK(i % 4 >= level->A.b || y[i] == parted[i]);
    uz_free_all(x, y, parted, whole.A.diag);
}

TEST(two_lanes_are_two_cycles)
{
    pair plane = open_plane(paper_scene(120, 40), true),
         solid = open_brick((const int64_t[]){12, 12, 12}, (const double[]){1, 1, 1}, 0.3);
    check_lanes(&plane);
    check_lanes(&solid);
    check_whole_diagonal(&plane);
    check_whole_diagonal(&solid);
    close_pair(&plane);
    close_pair(&solid);
}

/* Of K x as somebody finds it: the error in the norm of D^-1, over the size of x in that of D; D: the diagonal. */
static double error_of_product(const uz_csc *K, const double *y, const double *x, const long double *exact)
{
    double off = 0.0, size = 0.0;
    for (int64_t j = 0; j < K->cols; j++) {
        const double own = K->val[K->ptr[j]];
        off += pow((double)((long double)y[j] - exact[j]) / sqrt(own), 2);
        size += x[j] * x[j] * own;
    }
    return sqrt(off / size);
}

/* K is there in single precision and in what that leaves off: together they are as good as K in double precision. */
static void check_parts(pair *p)
{
    const uz_aggregates *mg = (const uz_aggregates *)p->amg->mg;
    const int64_t n = p->K.cols;
    double *x = random_vector(n, 11), *y = vector(n), *z = vector(n);
    long double *exact = calloc((size_t)n, sizeof *exact);
    double rounding = 0.0;
    uz_error err = {0};
    CHECK(mg->base.levels > 1 && !mg->level[0].A.off && !mg->level[0].A.diag);
    CHECK(uz_amg_rounding(&rounding, &p->K, &err) == UZ_OK);
    for (int smooth = 0; smooth < 2; smooth++) {
        for (int64_t j = 0; smooth && j < n; j++)
            x[j] = 1.0 + (double)j / (double)n;
        memset(exact, 0, (size_t)n * sizeof *exact);
        for (int64_t j = 0; j < n; j++)
            for (int64_t k = p->K.ptr[j]; k < p->K.ptr[j + 1]; k++) {
                const int64_t i = p->K.idx[k];
                exact[i] += (long double)p->K.val[k] * (long double)x[j];
                exact[j] += i != j ? (long double)p->K.val[k] * (long double)x[i] : 0.0L;
            }
        memset(y, 0, (size_t)n * sizeof *y);
        uz_csc_symv(y, &p->K, 1.0, x);
        p->amg->mg->kind->multiply(p->amg->mg, &p->K, p->cg.room, z, x);
        const double whole = error_of_product(&p->K, y, x, exact), parted = error_of_product(&p->K, z, x, exact);
        CHECK_MSG(parted < 1.5 * whole && parted < rounding, "%g, whole %g of %g", parted, whole, rounding);
    }
    free(x);
    free(y);
    free(z);
    free(exact);
}

TEST(nothing_is_lost_in_parts)
{
    pair p = open_plane(paper_scene(60, 20), true);
    check_parts(&p);
    close_pair(&p);
    p = open_plane(stretched(600, 20, 300, 10, 0.3), true);
    check_parts(&p);
    close_pair(&p);
    p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.499);
    check_parts(&p);
    close_pair(&p);
}

/* Two dofs at each node, and the six motions of a body in space. */
TEST(solids_that_are_held_across)
{
    pair p;
    uz_error err = {0};
    uz_modes modes;
    uz_scene scene = box_scene(10, 10, 11, 11);
    scene.model = UZ_SOLID;
    scene.box.dim = 3;
    scene.box.size[2] = 10;
    scene.box.cells[2] = 11;
    snprintf(scene.box.element, sizeof scene.box.element, "tet4");
    add_support(&scene, "left", 0, 0);
    add_support(&scene, "all", NAN, NAN);
    scene.supports[0].u[2] = scene.supports[1].u[2] = 0;
    uz_body_model model = build_body(&scene);
    CHECK(uz_modes_of_body(&modes, model.info.xyz, model.dof, model.mesh.n_nodes, 3, model.d, &err) == UZ_OK);
    CHECK_MSG(open_pair(&p, &model.K, &modes, &err), "%s", err.message);
    CHECK_MSG(p.info.lambda > 0.1 && p.info.iterations < 40, "%g by %lld steps", p.info.lambda,
              (long long)p.info.iterations);
    close_pair(&p);
    uz_body_model_clear(&model);
    uz_scene_clear(&scene);
}

TEST(a_bound_that_is_enough_takes_one_cycle)
{
    pair p = open_plane(paper_scene(60, 20), true);
    uz_multigrid_kind counting = uz_aggregates_kind;
    counting.apply = count_cycles;
    p.amg->mg->kind = &counting;
    int64_t taken[3];
    for (int k = 0; k < 3; k++) {
        const double enough[] = {0.0, 100.0, 0.9}; /* the first cycle is not far off */
        cycles = 0;
        (void)bound_over_exact(&p, enough[k]);
        taken[k] = cycles;
    }
    CHECK(taken[0] > taken[1] + 1);  /* making the load takes some, too */
    CHECK(taken[2] <= taken[0] + 2); /* what was begun goes on */
    p.amg->mg->kind = &uz_aggregates_kind;
    close_pair(&p);
}

TEST(bounds_end_near_the_least_ritz_value)
{
    pair p = open_brick((const int64_t[]){10, 10, 10}, (const double[]){1, 1, 1}, 0.3);
    CHECK_MSG(p.info.iterations <= 25, "%lld steps for the bound", (long long)p.info.iterations);
    check_bound(&p, 0.2);
    close_pair(&p);
}

TEST(plane_bodies_known_by_their_matrix_alone)
{
    pair p = open_plane(paper_scene(60, 20), false);
    check_pair(&p, 0.1, 40);
    close_pair(&p);
}

TEST(slender_bodies)
{
    pair p = open_plane(stretched(600, 20, 300, 10, 0.3), true);
    check_definite(&p);
    check_bound(&p, 0.1);
    check_norm(&p);
    close_pair(&p);
}

TEST(stretched_elements)
{
    pair p = open_plane(stretched(200, 20, 40, 40, 0.3), true);
    check_pair(&p, 0.05, 200);
    close_pair(&p);
}

TEST(nearly_incompressible)
{
    pair p = open_plane(stretched(60, 20, 60, 20, 0.4999), true);
    check_pair(&p, 0.001, 1000); /* 40 steps do not find the worst direction */
    close_pair(&p);
}

TEST(solid_bodies)
{
    pair p = open_brick((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3);
    check_pair(&p, 0.2, 20);
    close_pair(&p);
    p = open_brick((int64_t[]){12, 12, 3}, (double[]){10, 10, 1}, 0.3);
    check_pair(&p, 0.05, 60);
    close_pair(&p);
}

static uz_body_model build_solid(const char *element, int64_t cells, double length)
{
    static uz_material material = {.on = "all", .young = 1, .poisson = 0.3};
    static uz_support support = {.on = "left"};
    uz_scene scene = {.model = UZ_SOLID,
                      .box = {.size = {1, length, 1}, .cells = {cells, cells, cells}, .dim = 3},
                      .materials = &material,
                      .n_materials = 1,
                      .supports = &support,
                      .n_supports = 1};
    snprintf(scene.box.element, sizeof scene.box.element, "%s", element);
    return build_body(&scene);
}

/* A cube of tetrahedra, or a body that is as much longer along y. */
static uz_body_model build_tetrahedra(double length)
{
    return build_solid("tet4", 12, length);
}

/* Within the patience of who has another way. */
static uz_amg *amg_of_tetrahedra(const uz_body_model *model)
{
    uz_modes modes;
    uz_amg *amg = NULL;
    uz_error err = {0};
    CHECK(uz_modes_of_body(&modes, model->info.xyz, model->dof, model->mesh.n_nodes, 3, model->d, &err) == UZ_OK);
    CHECK_MSG(uz_amg_create(&amg, &model->K, &modes, 0, 100, NULL, &err) == UZ_OK, "%s", err.message);
    return amg;
}

TEST(coarse_levels_of_tetrahedra_are_small)
{
    uz_body_model model = build_tetrahedra(1);
    uz_amg *amg = amg_of_tetrahedra(&model);
    const uz_level *level = ((const uz_aggregates *)amg->mg)->level;
    const uz_blocks *fine = &level[0].A, *coarse = &level[1].A;
    CHECK(amg->info.levels > 1 && coarse->b == 6);
    CHECK(20 * coarse->nodes < fine->nodes);
    CHECK(36 * coarse->ptr[coarse->nodes] < 9 * fine->ptr[fine->nodes] / 2);
    CHECK(amg->info.lambda > 0.05);
    uz_amg_free(amg);
    uz_body_model_clear(&model);
}

/* The usual threshold does not see that they are stretched; the second one does. */
TEST(stretched_tetrahedra)
{
    uz_body_model model = build_tetrahedra(10);
    uz_amg *amg = amg_of_tetrahedra(&model);
    CHECK_MSG(amg->info.lambda > 0.05, "%g", amg->info.lambda);
    uz_amg_free(amg);
    uz_body_model_clear(&model);
}

/* The ends of edges with middles. */
static int32_t *ends_of(const uz_mesh *mesh)
{
    int32_t *ends = malloc(2 * (size_t)mesh->n_nodes * sizeof *ends);
    for (int64_t i = 0; i < 2 * mesh->n_nodes; i++)
        ends[i] = -1;
    for (int64_t e = 0; e < mesh->n_elements; e++) {
        const uz_element_type *type = uz_element_type_of((uz_element_kind)mesh->kind[e]);
        const int64_t *node = mesh->node + mesh->first[e];
        for (int m = type->corners; m < type->nodes; m++)
            for (int side = 0; side < 2; side++)
                ends[2 * node[m] + side] = (int32_t)node[type->edge[m - type->corners][side]];
    }
    return ends;
}

/* The sum of the squares of all entries off the diagonal, relative to that, does not depend on units. */
static double strength_of(const uz_csc *K)
{
    double sum = 0.0;
    for (int64_t j = 0; j < K->cols; j++)
        for (int64_t q = K->ptr[j] + 1; q < K->ptr[j + 1]; q++)
            sum += K->val[q] * K->val[q] / K->val[K->ptr[j]] / K->val[K->ptr[K->idx[q]]];
    return sum;
}

static void check_corners(const uz_level *level, const uz_csc *K)
{
    uz_csc columns = {0};
    uz_error err = {0};
    uz_blocks A = level->A;
    const int64_t off = 9 * A.ptr[A.nodes], diag = 9 * A.nodes;
    CHECK_INT(A.b, 3);
    CHECK_INT(3 * A.nodes, K->cols);
    A.off = vector(off);
    A.diag = vector(diag);
    for (int64_t e = 0; e < off; e++)
        A.off[e] = (double)level->off[e];
    for (int64_t e = 0; e < diag; e++)
        A.diag[e] = (double)level->diag[e];
    CHECK(uz_blocks_to_columns(&columns, &A, level->inverse, &err) == UZ_OK);
    CHECK_REL(strength_of(&columns), strength_of(K), 1e-5);
    uz_csc_clear(&columns);
    free(A.off);
    free(A.diag);
}

/* Of tet10 K on the corners is that of tet4, to rounding. Then fewer steps do than with aggregates of all nodes. */
TEST(quadratic_elements_go_to_their_corners)
{
    uz_body_model model = build_solid("tet10", 8, 1), linear = build_solid("tet4", 8, 1);
    int32_t *ends = ends_of(&model.mesh);
    int64_t steps[2];
    for (int known = 0; known < 2; known++) {
        uz_modes modes;
        uz_amg *amg = NULL;
        uz_error err = {0};
        CHECK(uz_modes_of_body(&modes, model.info.xyz, model.dof, model.mesh.n_nodes, 3, model.d, &err) == UZ_OK);
        modes.ends = known ? ends : NULL;
        CHECK_MSG(uz_amg_create(&amg, &model.K, &modes, 0, 0, NULL, &err) == UZ_OK, "%s", err.message);
        steps[known] = amg->info.iterations;
        if (known)
            check_corners(&((const uz_aggregates *)amg->mg)->level[1], &linear.K);
        uz_amg_free(amg);
    }
    CHECK_MSG(5 * steps[1] < 4 * steps[0], "%lld steps, %lld without", (long long)steps[1], (long long)steps[0]);
    free(ends);
    uz_body_model_clear(&model);
    uz_body_model_clear(&linear);
}

TEST(modes_of_a_free_body_meet_no_resistance)
{
    brick b = brick_make((int64_t[]){2, 2, 2}, (double[]){1, 2, 3}, 0.3, false);
    uz_modes modes;
    uz_error err = {0};
    CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK_INT(modes.count, 6);
    double *x = vector(b.d);
    for (int c = 0; c < modes.count; c++) {
        double *Kx = vector(b.d), energy, size = 0.0;
        for (int64_t i = 0; i < b.d; i++) {
            x[i] = (double)modes.value[i * modes.count + c];
            size += x[i] * x[i] * b.K.val[b.K.ptr[i]];
        }
        uz_csc_symv(Kx, &b.K, 1.0, x);
        energy = dot(x, Kx, b.d);
        CHECK_MSG(fabs(energy) <= 1e-12 * size && size > 0.0, "mode %d has the energy %g of %g", c, energy, size);
        free(Kx);
    }
    free(x);
    uz_modes_clear(&modes);
    brick_free(&b);
}

static uz_status refusal(brick *b, bool with_mesh, uz_error *err)
{
    uz_modes modes;
    uz_amg *amg = NULL;
    uz_status status = with_mesh ? uz_modes_of_body(&modes, b->xyz, b->dof, b->n_nodes, 3, b->d, err)
                                 : uz_modes_of_matrix(&modes, &b->K, err);
    CHECK(status == UZ_OK);
    status = uz_amg_create(&amg, &b->K, &modes, 0, 0, NULL, err);
    CHECK(amg == NULL);
    uz_amg_free(amg);
    return status;
}

TEST(free_and_indefinite_bodies_are_refused)
{
    for (int with_mesh = 0; with_mesh < 2; with_mesh++) {
        brick b = brick_make((int64_t[]){6, 6, 6}, (double[]){1, 1, 1}, 0.3, false);
        uz_error err = {0};
        CHECK_INT(refusal(&b, with_mesh, &err), UZ_ERR_NOT_SPD);
        CHECK(err.status == UZ_ERR_NOT_SPD && err.message[0] != '\0');
        brick_free(&b);
    }
    brick b = brick_make((int64_t[]){6, 6, 6}, (double[]){1, 1, 1}, 0.3, true);
    uz_error err = {0};
    for (int64_t k = b.K.ptr[400]; k < b.K.ptr[401]; k++)
        b.K.val[k] *= k == b.K.ptr[400] ? 0.1 : 1.0; /* a diagonal entry that its neighbours outweigh */
    CHECK_INT(refusal(&b, true, &err), UZ_ERR_NOT_SPD);
    b.K.val[b.K.ptr[7]] = -1.0;
    memset(&err, 0, sizeof err);
    CHECK_INT(refusal(&b, true, &err), UZ_ERR_NOT_SPD);
    CHECK(strstr(err.message, "dof 7 ") != NULL);
    brick_free(&b);
}

/* With held dofs the cycle is that of the body without them: they stay where they are, the rest is solved. A residual
 * that is there already is taken as it is. */
TEST(held_dofs)
{
    uz_scene scene = paper_scene(60, 20);
    pair p = open_plane(scene, true);
    int64_t n = p.K.cols;
    bool *held = calloc((size_t)n, sizeof *held);
    double *b = random_vector(n, 5), *x = vector(n), *r = vector(n), *y = vector(n), apart = 0.0, largest = 0.0;
    uz_cg_info info;
    uz_error err = {0};
    for (int64_t j = 0; j < n; j++) {
        held[j] = j % 7 == 0 || (j > n / 2 && j < n / 2 + 40);
        x[j] = held[j] ? 5.0 : 0.0;
    }
    CHECK(uz_cg_hold(&p.cg, &p.K, held, NULL, &err) == UZ_OK);
    uz_cg_stop stop = {.relative = 1e-10, .max_iterations = 200, .deadline = INFINITY};
    CHECK(uz_cg_solve(&info, x, &p.cg, &p.K, b, &stop, &err) == UZ_OK);
    CHECK_MSG(info.met && info.iterations < 30, "%lld iterations", (long long)info.iterations);
    memcpy(r, b, (size_t)n * sizeof *r);
    for (int64_t j = 0; j < n; j++) {
        CHECK(!held[j] || (x[j] == 5.0 && p.cg.z[j] == 0.0));
        y[j] = held[j] ? 5.0 : 0.0;
    }
    uz_csc_symv(r, &p.K, -1.0, x);
    memcpy(p.cg.r, b, (size_t)n * sizeof *b);
    uz_csc_symv(p.cg.r, &p.K, -1.0, y);
    double left = 0.0, right = 0.0;
    for (int64_t j = 0; j < n; j++) {
        left += held[j] ? 0.0 : r[j] * r[j];
        right += held[j] ? 0.0 : p.cg.r[j] * p.cg.r[j];
    }
    CHECK_MSG(left <= 1e-14 * right, "%g of %g", left, right);
    stop.begun = true;
    CHECK(uz_cg_solve(&info, y, &p.cg, &p.K, b, &stop, &err) == UZ_OK && info.met);
    for (int64_t j = 0; j < n; j++) {
        apart = fmax(apart, fabs(x[j] - y[j]));
        largest = fmax(largest, fabs(x[j]));
    }
    CHECK_MSG(apart <= 1e-6 * largest, "%g of %g", apart, largest);
    CHECK(uz_cg_hold(&p.cg, &p.K, NULL, NULL, &err) == UZ_OK);
    check_definite(&p);
    free(held);
    free(b);
    free(x);
    free(r);
    free(y);
    close_pair(&p);
}

/* The blocks of K / 2, as the multigrid has them but for its scales. */
static void half_of(uz_blocks *half, const pair *p)
{
    const uz_aggregates *mg = (const uz_aggregates *)p->amg->mg;
    const uz_blocks *A = &mg->level[0].A;
    const int b = A->b;
    *half = *A;
    half->off = calloc((size_t)(A->ptr[A->nodes] * b * b + 4), sizeof *half->off);
    half->diag = calloc((size_t)(A->nodes * b * b + 4), sizeof *half->diag);
    for (int64_t j = 0; j < p->K.cols; j++)
        for (int64_t k = p->K.ptr[j]; k < p->K.ptr[j + 1]; k++) {
            const int64_t s = mg->slot[j], t = mg->slot[p->K.idx[k]], I = uz_slot_node(mg, s), J = uz_slot_node(mg, t);
            const int64_t r = uz_slot_place(mg, s), c = uz_slot_place(mg, t);
            const double value = 0.5 * p->K.val[k];
            if (I == J) {
                half->diag[I * b * b + r * b + c] = half->diag[I * b * b + c * b + r] = value;
            } else {
                const int64_t at = I > J ? uz_blocks_find(A, I, (int32_t)J) : uz_blocks_find(A, J, (int32_t)I);
                half->off[at * b * b + (I > J ? r * b + c : c * b + r)] = value;
            }
        }
}

/* Of K less its half M^-1 is twice what it was, on all levels; in another order of the dofs it would not be. */
TEST(a_loss_of_the_matrix)
{
    pair p = open_brick((int64_t[]){11, 9, 7}, (double[]){1, 1, 1}, 0.3);
    const int64_t n = p.K.cols;
    double *r = random_vector(n, 3), *before = vector(n), *after = vector(n), most = 0.0, off = 0.0;
    uz_blocks half;
    uz_error err = {0};
    CHECK(p.info.levels > 1);
    CHECK(uz_multigrid_apply(p.amg->mg, &p.K, p.cg.room, before, r, &err) == UZ_OK);
    half_of(&half, &p);
    CHECK(uz_hold_loss(p.cg.room, p.amg->mg, &half, NULL, false, NULL, &err) == UZ_OK);
    free(half.off);
    free(half.diag);
    CHECK(uz_multigrid_apply(p.amg->mg, &p.K, p.cg.room, after, r, &err) == UZ_OK);
    for (int64_t j = 0; j < n; j++) {
        most = fmax(most, fabs(before[j]));
        off = fmax(off, fabs(after[j] - 2.0 * before[j]));
    }
    CHECK_MSG(off <= 1e-4 * most, "%g of %g", off, most);
    free(r);
    free(before);
    free(after);
    close_pair(&p);
}

/* Who says which rows have lost something gets what who does not gets. */
TEST(a_loss_of_some_rows)
{
    pair p = open_brick((int64_t[]){11, 9, 7}, (double[]){1, 1, 1}, 0.3);
    const int64_t n = p.K.cols;
    double *r = random_vector(n, 3), *told = vector(n), *whole = vector(n), *found = vector(n);
    bool *lost = calloc((size_t)n, sizeof *lost);
    uz_error err = {0};
    CHECK(uz_multigrid_apply(p.amg->mg, &p.K, p.cg.room, whole, r, &err) == UZ_OK);
    for (int says = 0; says < 2; says++) {
        uz_blocks half;
        half_of(&half, &p);
        const int64_t some = half.nodes / 4, size = (int64_t)half.b * half.b;
        memset(half.off + half.ptr[some] * size, 0,
               (size_t)((half.ptr[half.nodes] - half.ptr[some]) * size) * sizeof *half.off);
        memset(half.diag + some * size, 0, (size_t)((half.nodes - some) * size) * sizeof *half.diag);
        for (int64_t i = 0; i < some; i++)
            lost[i] = true;
        CHECK(uz_hold_loss(p.cg.room, p.amg->mg, &half, says ? lost : NULL, false, NULL, &err) == UZ_OK);
        CHECK(uz_multigrid_apply(p.amg->mg, &p.K, p.cg.room, says ? told : found, r, &err) == UZ_OK);
        free(half.off);
        free(half.diag);
    }
    CHECK(memcmp(told, found, (size_t)n * sizeof *told) == 0);
    CHECK(memcmp(told, whole, (size_t)n * sizeof *told) != 0);
    free(r);
    free(told);
    free(whole);
    free(found);
    free(lost);
    close_pair(&p);
}

/* Two threads in the place of processes. What they have to sum lies in one place until both have come. */
static pthread_barrier_t both_are_there;
static double *of_member[2];
static __thread int member;

static void sum_of_both(double *x, int64_t n)
{
    of_member[member] = x;
    pthread_barrier_wait(&both_are_there);
    for (int64_t k = 0; member == 0 && k < n; k++)
        of_member[0][k] = of_member[1][k] = of_member[0][k] + of_member[1][k];
    pthread_barrier_wait(&both_are_there);
}

typedef struct {
    const pair *p;
    const uz_modes *modes;
    const double *r;
    double *z[2]; /* M^-1 r, of K and of what is left of it */
    int member;
} team_mate;

static void *make_in_team(void *arg)
{
    const team_mate *x = arg;
    const uz_team team = {x->member, 2, sum_of_both};
    uz_multigrid *mg;
    uz_blocks half;
    size_t bytes;
    uz_error err = {0};
    member = x->member;
    CHECK(uz_multigrid_create(&mg, &x->p->K, x->modes, &team, 0, NULL, &err) == UZ_OK);
    uz_multigrid_room *room = mg->kind->room(mg, &bytes);
    CHECK(uz_multigrid_apply(mg, &x->p->K, room, x->z[0], x->r, &err) == UZ_OK);
    half_of(&half, x->p);
    CHECK(uz_hold_loss(room, mg, &half, NULL, false, &team, &err) == UZ_OK);
    free(half.off);
    free(half.diag);
    CHECK(uz_multigrid_apply(mg, &x->p->K, room, x->z[1], x->r, &err) == UZ_OK);
    mg->kind->free_room(room);
    uz_multigrid_free(mg);
    return NULL;
}

/* Those who divide the sums get the multigrid of one alone, each the same to the last bit. */
TEST(a_multigrid_by_two)
{
    brick b = brick_make((int64_t[]){11, 9, 7}, (double[]){1, 1, 1}, 0.3, true);
    pair p;
    uz_modes modes, same;
    uz_error err = {0};
    CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK(uz_modes_of_body(&same, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK(open_pair(&p, &b.K, &modes, &err));
    const int64_t n = p.K.cols;
    double *r = random_vector(n, 3), *alone = vector(n);
    team_mate mate[2];
    pthread_t thread[2];
    CHECK(uz_multigrid_apply(p.amg->mg, &p.K, p.cg.room, alone, r, &err) == UZ_OK);
    pthread_barrier_init(&both_are_there, NULL, 2);
    for (int k = 0; k < 2; k++) {
        mate[k] = (team_mate){&p, &same, r, {vector(n), vector(n)}, k};
        CHECK(pthread_create(&thread[k], NULL, make_in_team, &mate[k]) == 0);
    }
    for (int k = 0; k < 2; k++)
        pthread_join(thread[k], NULL);
    pthread_barrier_destroy(&both_are_there);
    for (int which = 0; which < 2; which++) {
        double most = 0.0, off = 0.0;
        for (int64_t j = 0; j < n; j++) {
            most = fmax(most, fabs(alone[j]));
            off = fmax(off, fabs(mate[0].z[which][j] - (which == 0 ? 1.0 : 2.0) * alone[j]));
        }
        CHECK_MSG(off <= 1e-4 * most, "%g of %g", off, most);
        CHECK(memcmp(mate[0].z[which], mate[1].z[which], (size_t)n * sizeof *alone) == 0);
        free(mate[0].z[which]);
        free(mate[1].z[which]);
    }
    free(r);
    free(alone);
    uz_modes_clear(&same);
    close_pair(&p);
    brick_free(&b);
}

/* Of a body's level 0, with unit rows where nodes have fewer dofs. weak: blocks lose so much, and tie no nodes. */
static void compare_blocks(const pair *p, double weak)
{
    uz_blocks whole, A;
    uz_csc columns = {0};
    uz_multigrid *made[2];
    uz_error err = {0};
    half_of(&whole, p);
    const int64_t n = whole.nodes * whole.b, size = (int64_t)whole.b * whole.b, count = whole.ptr[whole.nodes] * size;
    uz_modes modes = {.count = 3, .n_nodes = whole.nodes, .strong = 0.08};
    float *there = calloc((size_t)n, sizeof *there);
    modes.node = calloc((size_t)n, sizeof *modes.node);
    modes.value = calloc((size_t)(3 * n), sizeof *modes.value);
    for (int64_t j = 0; j < n; j++) {
        double *own = &whole.diag[j / 3 * size + j % 3 * 4];
        modes.node[j] = (int32_t)(j / 3);
        modes.value[3 * j + j % 3] = 1.0F;
        there[j] = *own > 0.0 ? 1.0F : 0.0F;
        *own *= j % 3 == 0 ? 0x1p20 : 1.0; /* scales differ */
    }
    A = whole;
    A.off = calloc((size_t)count + 4, sizeof *A.off);
    for (int64_t e = 0; e < count; e++)
        A.off[e] = weak * whole.off[e];
    memcpy(whole.off, A.off, (size_t)count * sizeof *A.off);
    CHECK_INT(uz_blocks_to_columns(&columns, &A, there, &err), UZ_OK);
    CHECK_INT(uz_multigrid_create(&made[0], &columns, &modes, NULL, 0, NULL, &err), UZ_OK);
    CHECK_INT(uz_multigrid_of_blocks(&made[1], &A, there, &modes, NULL, &err), UZ_OK);
    CHECK((made[1] == NULL) == (made[0]->levels == 1) && (made[1] == NULL) == (A.off != NULL));
    double most = 0.0, off = 0.0;
    for (int64_t e = 0; A.off && e < count; e++) {
        most = fmax(most, fabs(whole.off[e]));
        off = fmax(off, fabs(A.off[e] - whole.off[e]));
    }
    CHECK_MSG(off <= 0x1p-34 * most, "%g of %g", off, most); /* 2^-55 of the largest, as scaled by up to 2^10 twice */
    if (made[1]) {
        double *r = random_vector(n, 5), *z[2] = {vector(n), vector(n)};
        for (int k = 0; k < 2; k++) {
            size_t bytes;
            uz_multigrid_room *room = made[k]->kind->room(made[k], &bytes);
            CHECK_INT(uz_multigrid_apply(made[k], &columns, room, z[k], r, &err), UZ_OK);
            made[k]->kind->free_room(room);
        }
        CHECK(memcmp(z[0], z[1], (size_t)n * sizeof *r) == 0 && made[0]->bytes > made[1]->bytes);
        free(r);
        free(z[0]);
        free(z[1]);
    }
    uz_multigrid_free(made[0]);
    uz_multigrid_free(made[1]);
    uz_csc_clear(&columns);
    free(modes.node);
    free(modes.value);
    free(there);
    free(A.off);
    free(whole.off);
    free(whole.diag);
}

/* A matrix in blocks gives the multigrid of its columns to the last bit, or stays as it was. */
TEST(blocks_are_taken_as_they_are)
{
    brick b = brick_make((int64_t[]){11, 9, 7}, (double[]){1, 1, 1}, 0.3, true);
    pair p;
    uz_modes modes;
    uz_error err = {0};
    CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK(open_pair(&p, &b.K, &modes, &err));
    compare_blocks(&p, 1.0);
    compare_blocks(&p, 1e-9);
    close_pair(&p);
    brick_free(&b);
}

TEST(memory_is_bounded)
{
    brick b = brick_make((int64_t[]){9, 9, 9}, (double[]){1, 1, 1}, 0.3, true);
    uz_modes modes;
    uz_amg *amg = NULL;
    uz_error err = {0};
    CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
    CHECK_INT(uz_amg_create(&amg, &b.K, &modes, 100000, 0, NULL, &err), UZ_ERR_LIMIT);
    CHECK(amg == NULL && strstr(err.message, "100000") != NULL);
    brick_free(&b);
}

/* A flat body's cells have ten times the length along two axes: the bound on the spectrum takes more steps than who has
 * another way wants to wait for, which is seen before that; one of cubes takes fewer. */
TEST(patience_ends)
{
    enum { PATIENCE = 60 };
    const double sizes[2][3] = {{1, 1, 1}, {1, 0.1, 1}};
    for (int flat = 0; flat < 2; flat++) {
        brick b = brick_make((int64_t[]){10, 10, 10}, sizes[flat], 0.3, true);
        uz_modes modes;
        uz_amg *amg = NULL;
        uz_error err = {0};
        CHECK(uz_modes_of_body(&modes, b.xyz, b.dof, b.n_nodes, 3, b.d, &err) == UZ_OK);
        CHECK_INT(uz_amg_create(&amg, &b.K, &modes, 0, PATIENCE, NULL, &err), flat ? UZ_ERR_LIMIT : UZ_OK);
        if (flat) {
            const char *after = strstr(err.message, "as ");
            CHECK(amg == NULL && after && atoi(after + 3) > PATIENCE / 6 && atoi(after + 3) < PATIENCE / 2);
        } else {
            CHECK(amg->info.iterations < PATIENCE);
        }
        uz_amg_free(amg);
        brick_free(&b);
    }
}
