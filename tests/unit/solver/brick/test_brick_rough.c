/* Steps of conjugate gradients in single precision on a box: what they are, what their products are off by, and the
 * bound on the spectrum that they lead to.
 * not under ThreadSanitizer: test_slabs has them by threads */
#include "brick/grids.h"
#include "cg_steps.h"
#include "scene_fixture.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A block held on the left, with its multigrid. */
typedef struct {
    uz_body_model cells;
    uz_multigrid *mg;
    uz_cg cg;
    uz_csc diagonal;
} block;

static block open_block(const int64_t cells[3], const double size[3], double young, double poisson)
{
    block b = {.mg = NULL};
    uz_scene scene = box_scene(size[0], size[1], cells[0], cells[1]);
    uz_error err = {0};
    scene.model = UZ_SOLID;
    scene.box.dim = 3;
    scene.box.size[2] = size[2];
    scene.box.cells[2] = cells[2];
    snprintf(scene.box.element, sizeof scene.box.element, "hex8");
    scene.materials[0].young = young;
    scene.materials[0].poisson = poisson;
    add_support(&scene, "left", 0, 0);
    scene.supports[0].u[2] = 0;
    CHECK(uz_body_model_build(&b.cells, &scene, UZ_BODY_CELLS, &err) == UZ_OK && b.cells.brick);
    CHECK(uz_brick_multigrid(&b.mg, b.cells.brick, 0, &err) == UZ_OK);
    CHECK(uz_cg_init(&b.cg, b.mg, &err) == UZ_OK);
    CHECK(uz_brick_diagonal(&b.diagonal, b.cells.brick, &err) == UZ_OK);
    uz_scene_clear(&scene);
    return b;
}

static void close_block(block *b)
{
    uz_cg_clear(&b->cg);
    uz_multigrid_free(b->mg);
    uz_csc_clear(&b->diagonal);
    uz_body_model_clear(&b->cells);
}

TEST(steps_in_single_precision_are_those_of_conjugate_gradients)
{
    for (int unit = -400; unit <= 400; unit += 400) {
        block b = open_block((int64_t[]){12, 7, 10}, (double[]){60, 20, 30}, ldexp(2100, unit / 2), 0.3);
        double *r = calloc((size_t)b.mg->n, sizeof *r);
        CHECK(r);
        for (int64_t j = 0; j < b.mg->n; j++)
            r[j] = ldexp((double)(j * 7919 % 1000 - 500), unit);
        check_steps(b.mg, &b.diagonal, b.cg.room, r);
        free(r);
        close_block(&b);
    }
}

/* x: alternates from node to node along the axes of each component's parity, from these numbers, of -1, 0 and 1: single
 * precision has it to the last bit. */
static void alternate(double *x, const uz_brick *brick, int parity, const int first[3])
{
    for (int64_t node = 0; node < brick->n_nodes; node++) {
        const int64_t *n = brick->cells, i = node % (n[0] + 1), j = node / (n[0] + 1) % (n[1] + 1),
                      k = node / (n[0] + 1) / (n[1] + 1);
        for (int c = 0; c < 3; c++) {
            const int odd = parity ^ 1 << c;
            const bool down = ((odd & i) ^ (odd >> 1 & j) ^ (odd >> 2 & k)) & 1;
            if (brick->dof[3 * node + c] >= 0)
                x[brick->dof[3 * node + c]] = down ? -first[c] : first[c];
        }
    }
}

/* What rounding of the blocks does to x'K x, and what products in single precision are off by, over x'D x; *energy:
 * x'K x over that. */
static void find_errors(double *of_blocks, double *of_product, double *energy, const block *b, const double *x,
                        double *y)
{
    const uz_brick_grids *mg = (const uz_brick_grids *)b->mg;
    uz_multigrid_room *room = b->cg.room;
    double rounded[9 * UZ_BRICK_PARITIES], exact = 0.0, size = 0.0, other = 0.0;
    const double down = uz_brick_read(mg, room, x);
    const uz_brick_vectors v = {.x = room->v[0].b, .t = room->v[0].t, .inverse = room->v[0].inverse};
    const double single = uz_brick_curvature(&mg->level[0], &v, &room->planes) * mg->unit / (down * down);
    b->mg->kind->multiply(b->mg, &b->diagonal, room, y, x);
    for (int64_t j = 0; j < b->mg->n; j++) {
        exact += x[j] * y[j];
        size += x[j] * x[j] * b->diagonal.val[j];
    }
    for (int i = 0; i < 9 * UZ_BRICK_PARITIES; i++)
        rounded[i] = mg->unit * (double)mg->level[0].block[i];
    uz_brick_multiply(y, b->cells.brick, rounded, &room->product, x, NULL);
    for (int64_t j = 0; j < b->mg->n; j++)
        other += x[j] * y[j];
    *of_blocks = fabs(other - exact) / size;
    *of_product = fabs(single - exact) / size;
    *energy = exact / size;
}

TEST(products_in_single_precision_are_off_by_what_is_told)
{
    static const double size[][3] = {{24, 24, 24}, {24, 17, 31}, {24, 240, 5}}, poisson[] = {0.0, 0.3, 0.49};
    for (int k = 0; k < 9; k++) {
        block b = open_block((int64_t[]){12, 12, 12}, size[k / 3], 2100, poisson[k % 3]);
        double *x = calloc((size_t)b.mg->n, sizeof *x), *y = calloc((size_t)b.mg->n, sizeof *y), most = 0.0;
        CHECK(x && y);
        for (int of = 0; of < 13 * 8; of++) { /* of 27 those before the middle, which is 0: the others are opposite */
            const int first[3] = {of / 8 % 3 - 1, of / 24 % 3 - 1, of / 72 - 1};
            double of_blocks, of_product, energy;
            alternate(x, b.cells.brick, of % 8, first);
            find_errors(&of_blocks, &of_product, &energy, &b, x, y);
            most = fmax(most, of_blocks);
            CHECK_MSG(of_product <= b.mg->rough + FLT_EPSILON * energy, "%d, %d: %g", k, of, of_product);
        }
        const double allowed = b.mg->rough - FLT_EPSILON;
        CHECK_MSG(most <= allowed && most > 0.05 * allowed, "%d: %g for %g", k, most, allowed);
        free(x);
        free(y);
        close_block(&b);
    }
}

static const uz_multigrid_kind *original;
static int64_t cycles;

static uz_status count_cycles(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                              const double *r, uz_error *err)
{
    cycles++;
    return original->apply(mg, K, room, z, r, err);
}

/* The bound on the spectrum, with steps in single precision or without; `cycles`: those in double precision. */
static double bound_of(const int64_t cells[3], const double size[3], double poisson, bool rough)
{
    block b = open_block(cells, size, 2100, poisson);
    uz_amg *amg = NULL;
    uz_error err = {0};
    original = b.mg->kind;
    uz_multigrid_kind counting = *original;
    counting.apply = count_cycles;
    counting.step_roughly = rough ? original->step_roughly : NULL;
    cycles = 0;
    b.mg->kind = &counting;
    CHECK(uz_amg_of(&amg, b.mg, &b.diagonal, 0, NULL, &err) == UZ_OK);
    const double lambda = amg->info.lambda;
    b.mg->kind = original;
    free(amg); /* but not the multigrid, which the block has */
    close_block(&b);
    return lambda;
}

TEST(the_spectrum_is_bounded_in_single_precision_where_that_hides_little)
{
    static const double size[][3] = {{24, 24, 24}, {48, 17, 31}, {5, 40, 40}};
    for (int k = 0; k < 3; k++) {
        const double rough = bound_of((int64_t[]){16, 15, 14}, size[k], 0.3, true);
        CHECK_MSG(cycles < 5, "%lld cycles", (long long)cycles);
        const double exact = bound_of((int64_t[]){16, 15, 14}, size[k], 0.3, false);
        CHECK(cycles > 10);
        CHECK_MSG(rough < exact && rough > 0.95 * exact, "%d: %g for %g", k, rough, exact);
    }
    /* bends too easily */
    const double bar = bound_of((int64_t[]){200, 4, 4}, (double[]){200, 1, 1}, 0.3, true);
    CHECK(cycles > 10);
    CHECK(bar == bound_of((int64_t[]){200, 4, 4}, (double[]){200, 1, 1}, 0.3, false));
}
