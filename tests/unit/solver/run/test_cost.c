/* What is decided by counts alone. */
#include "body_fixture.h"
#include "core/alloc.h"
#include "harness.h"
#include "run/cost.h"
#include "scene/breadth.h"
#include "scene_fixture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

/* Of a cube of hex8 that an obstacle is under. */
static const uz_cost_size BODY = {.d = 100000,
                                  .m = 1000,
                                  .n_b = 1000,
                                  .k_entries = 4100000,
                                  .n_entries = 1000,
                                  .modes = 6,
                                  .active_set = true,
                                  .bounds = true,
                                  .cases = 1};

static uz_cost_size body_under(int64_t rows)
{
    uz_cost_size size = BODY;
    size.m = size.n_b = size.n_entries = rows;
    return size;
}

/* A solid of hex8 under few rows. */
static bool is_surely_free(uz_cost_plan *plan, int64_t nx, int64_t ny, int64_t nz, uz_operator asked, size_t limit)
{
    const uz_box box = {
        .size = {(double)nx, (double)ny, (double)nz}, .cells = {nx, ny, nz}, .dim = 3, .element = "hex8"};
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_box(&mesh, &box, &err) == UZ_OK, "%s", err.message);
    const int64_t d = 3 * mesh.n_nodes, m = 25;
    const uz_cost_size size = {
        .d = d, .m = m, .n_b = m, .k_entries = 41 * d, .n_entries = m, .modes = 6, .active_set = true, .bounds = true};
    const bool surely = uz_cost_is_surely_free(plan, &size, &mesh, UZ_OPERATOR_CONDENSED, asked, limit);
    uz_mesh_clear(&mesh);
    return surely;
}

TEST(a_large_cube_needs_no_order_of_a_factor)
{
    uz_cost_plan plan;
    CHECK(is_surely_free(&plan, 80, 80, 80, UZ_OPERATOR_AUTO, 0));
    CHECK_INT(plan.form[plan.chosen].op, UZ_OPERATOR_MATRIX_FREE);
    CHECK(plan.count > 1 && plan.form[0].op == UZ_OPERATOR_CONDENSED);
    CHECK(!is_surely_free(&plan, 80, 80, 80, UZ_OPERATOR_CONDENSED, 0));
}

/* Before there is an order, only forms with a factor have to pay for it: 100 passes of K. */
TEST(what_needs_no_order_does_not_pay_for_it)
{
    enum { CELLS = 40 };
    const uz_box box = {.size = {CELLS, CELLS, CELLS}, .cells = {CELLS, CELLS, CELLS}, .dim = 3, .element = "hex8"};
    uz_mesh mesh;
    uz_error err = {0};
    CHECK_MSG(uz_mesh_from_box(&mesh, &box, &err) == UZ_OK, "%s", err.message);
    const int64_t d = 3 * mesh.n_nodes;
    const uz_cost_size size = {.d = d,
                               .m = 25,
                               .n_b = 25,
                               .k_entries = 41 * d,
                               .n_entries = 25,
                               .modes = 6,
                               .active_set = true,
                               .bounds = true};
    const double layer = 3.0 * uz_mesh_breadth(&mesh);
    const uz_factor_info least = {.nnz = (int64_t)(9.0 * layer * layer), .flops = 6.0 * layer * layer * layer};
    uz_cost_plan counted, analysed;
    CHECK(uz_cost_is_surely_free(&counted, &size, &mesh, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0));
    uz_cost_decide(&analysed, &size, &least, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
    CHECK(counted.count == analysed.count && counted.count > 2);
    for (int k = 0; k < counted.count; k++) {
        const bool free = counted.form[k].op == UZ_OPERATOR_MATRIX_FREE;
        const double order = free ? 0.0 : 100.0 * (double)size.k_entries * uz_cost_machine()->entry_s;
        CHECK_REL(counted.form[k].setup_s, analysed.form[k].setup_s + order, 1e-6);
    }
    uz_mesh_clear(&mesh);
}

TEST(a_bar_and_a_small_cube_have_their_factor_counted)
{
    uz_cost_plan plan;
    CHECK(!is_surely_free(&plan, 2000, 4, 4, UZ_OPERATOR_AUTO, 0));
    CHECK(!is_surely_free(&plan, 8, 8, 8, UZ_OPERATOR_AUTO, 0));
}

TEST(a_factor_that_cannot_fit_is_not_counted)
{
    uz_cost_plan plan;
    CHECK(is_surely_free(&plan, 40, 40, 40, UZ_OPERATOR_AUTO, (size_t)1 << 30));
    CHECK(!plan.form[0].fits);
}

/* A K of a user's may have gaps in its diagonal, and fewer entries than rows. Its entries stand for a vector while it
 * is timed, and what lies behind them, here a page that can't be read, is none. */
TEST(the_rate_of_k_is_measured_within_its_entries)
{
    enum { ENTRIES = 1 << 18 };
    const int64_t d = 4 * ENTRIES;
    const size_t bytes = ENTRIES * sizeof(double), page = 1 << 16;
    char *room = mmap(NULL, bytes + page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    int64_t *ptr = calloc((size_t)d + 1, sizeof *ptr);
    int32_t *idx = malloc(ENTRIES * sizeof *idx);
    CHECK(room != MAP_FAILED && ptr && idx && mprotect(room + bytes, page, PROT_NONE) == 0);
    for (int64_t j = 0; j <= d; j++)
        ptr[j] = (j + 3) / 4;
    for (int32_t k = 0; k < ENTRIES; k++)
        idx[k] = 4 * k;
    const uz_settings settings = uz_settings_default();
    uz_csc K = {.rows = d, .cols = d, .ptr = ptr, .idx = idx, .val = (double *)(void *)room}, N = {.rows = 0};
    CHECK(uz_csc_init(&N, 0, d, 0, NULL) == UZ_OK);
    CHECK(uz_cost_size_of(&K, &N, NULL, NULL, 0, 0, &settings).entry_s == 0);
    for (int32_t k = 0; k < ENTRIES; k++) /* as many as rows: it is measured */
        idx[k] = k;
    for (int64_t j = 0; j <= d; j++)
        ptr[j] = j < ENTRIES ? j : ENTRIES;
    K.rows = K.cols = ENTRIES;
    CHECK(uz_cost_size_of(&K, &N, NULL, NULL, 0, 0, &settings).entry_s > 0);
    uz_csc_clear(&N);
    munmap(room, bytes + page);
    free(ptr);
    free(idx);
}

/* A cycle on tet4 takes about the time of one on hex8 of as many dofs: most of it is not reading K. */
TEST(a_multigrid_is_not_paid_by_entries_alone)
{
    uz_cost_size size = {
        .d = 100000, .m = 1000, .n_b = 1000, .n_entries = 1000, .modes = 6, .active_set = true, .bounds = true};
    double seconds[2];
    for (int k = 0; k < 2; k++) {
        uz_cost_plan plan;
        size.k_entries = (k == 0 ? 23 : 41) * size.d;
        uz_cost_decide(&plan, &size, NULL, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_MATRIX_FREE, 0);
        seconds[k] = plan.form[plan.chosen].setup_s + plan.form[plan.chosen].case_s;
    }
    CHECK_MSG(seconds[0] < seconds[1] && seconds[1] < 1.5 * seconds[0], "%g and %g s", seconds[0], seconds[1]);
}

/* As many steps as make it as dear as the form with a factor; the more, the dearer that is. */
TEST(patience_is_as_long_as_a_factor_is_dear)
{
    const uz_cost_size size = {.d = 100000, .cases = 2};
    uz_cost_plan plan = {
        .form = {{.op = UZ_OPERATOR_CONDENSED, .setup_s = 9, .case_s = 0.6, .next_s = 0.4, .fits = true},
                 {.op = UZ_OPERATOR_FACTORED, .setup_s = 1, .case_s = 1, .next_s = 1, .fits = false},
                 {.op = UZ_OPERATOR_MATRIX_FREE,
                  .setup_s = 2,
                  .case_s = 1.5,
                  .next_s = 0.5,
                  .steps = 40,
                  .setup_steps_s = 1.25,
                  .case_steps_s = 1.25,
                  .next_steps_s = 0.5,
                  .fits = true}},
        .count = 3,
        .chosen = 2};
    CHECK_INT(uz_cost_patience(&plan, &size), 120); /* (10 - 4) / (1.25 + 1.25 + 0.5) times as many more */
    plan.form[1].fits = true;
    CHECK_INT(uz_cost_patience(&plan, &size), 40);
    plan.form[0].fits = plan.form[1].fits = false;
    CHECK_INT(uz_cost_patience(&plan, &size), 0);
}

/* The first of many loads costs what one does; the others less where they begin at answers, or pass a factor together.
 */
TEST(further_loads_cost_less_without_a_factor)
{
    const uz_factor_info factor = {.nnz = 40000000, .flops = 1e11, .bytes = 320000000};
    uz_cost_size size = BODY;
    size.cases = 50;
    uz_cost_plan plan;
    uz_cost_decide(&plan, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
    CHECK(plan.count > 1);
    for (int k = 0; k < plan.count; k++) {
        const uz_cost_estimate *form = &plan.form[k];
        const double one = uz_cost_seconds(form, 0), many = uz_cost_seconds(form, 50);
        CHECK_REL(one, form->setup_s + form->case_s, 1e-12);
        CHECK(uz_cost_seconds(form, 1) <= one && uz_cost_seconds(form, 1) >= one);
        CHECK_REL(many, one + 49 * form->next_s, 1e-12);
        CHECK(form->op == UZ_OPERATOR_FACTORED ? form->next_s >= form->case_s : form->next_s < 0.7 * form->case_s);
    }
}

static double seconds_without_factor(uz_cost_size size)
{
    uz_cost_plan plan;
    uz_cost_decide(&plan, &size, NULL, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_MATRIX_FREE, 0);
    return uz_cost_seconds(&plan.form[plan.chosen], size.cases);
}

/* More dofs, a material that keeps its volume more, longer elements and more loads, each by itself, with a matrix and
 * by cells; below what cubes at a Poisson's ratio of 0.3 are nothing is spared. */
TEST(what_is_harder_costs_more)
{
    for (int cells = 0; cells < 2; cells++) {
        uz_cost_size plain = BODY;
        plain.by_cells = cells ? 2e7 : 0.0;
        plain.stretch = 1.8;
        plain.firmness = 1.0;
        uz_cost_size larger = plain, firmer = plain, longer = plain, slender = plain, more = plain, easier = plain,
                     rougher = plain;
        larger.d *= 2;
        larger.k_entries *= 2;
        firmer.firmness = 14.6; /* 0.49 */
        longer.stretch = 10.0;
        slender.slender = 10.0;
        more.cases = 10;
        easier.firmness = 0.6;
        rougher.irregular = true;
        const double base = seconds_without_factor(plain);
        CHECK(seconds_without_factor(larger) > 2.0 * base && seconds_without_factor(larger) < 2.5 * base);
        CHECK(seconds_without_factor(firmer) > 1.5 * base && seconds_without_factor(firmer) < 5.0 * base);
        CHECK(seconds_without_factor(longer) > 1.5 * base && seconds_without_factor(longer) < 10.0 * base);
        CHECK(seconds_without_factor(slender) > 1.1 * base && seconds_without_factor(slender) < 3.0 * base);
        CHECK(seconds_without_factor(more) > 2.0 * base && seconds_without_factor(more) < 10.0 * base);
        CHECK_REL(seconds_without_factor(easier), base, 1e-12);
        CHECK_REL(seconds_without_factor(rougher), cells ? base : 2.15 * base, cells ? 1e-12 : 0.16);
    }
}

/* Entries that come from memory have a rate of their own, which is K's. */
TEST(a_large_K_has_its_own_rate)
{
    uz_cost_size size = BODY;
    size.cycle_s = 1e-12; /* nothing */
    const double base = seconds_without_factor(size);
    size.entry_s = 3.0 * uz_cost_machine()->entry_s;
    CHECK_REL(seconds_without_factor(size), 3.0 * base, 0.1);
    size.cycle_s = 1e-9;
    const double cycles = seconds_without_factor(size);
    size.cycle_s = 2e-9;
    CHECK(seconds_without_factor(size) > 1.8 * cycles && seconds_without_factor(size) < 2.0 * cycles);
    enum { N = 600, WIDE = 500 }; /* enough entries to be timed */
    uz_csc K = {.rows = N, .cols = N}, none = {.rows = 0, .cols = N};
    K.ptr = calloc(N + 1, sizeof *K.ptr);
    K.idx = calloc((size_t)N * WIDE, sizeof *K.idx);
    K.val = calloc((size_t)N * WIDE, sizeof *K.val);
    none.ptr = calloc(N + 1, sizeof *none.ptr);
    CHECK(K.ptr && K.idx && K.val && none.ptr);
    for (int64_t wide = WIDE; wide > 0; wide -= WIDE - 1) {
        const uz_settings settings = uz_settings_default();
        for (int64_t j = 0; j <= N; j++)
            K.ptr[j] = j * wide;
        const uz_cost_size of = uz_cost_size_of(&K, &none, NULL, NULL, 0, 1, &settings);
        CHECK(wide == WIDE ? of.entry_s > 1e-11 && of.entry_s < 1e-6 : of.entry_s == 0.0);
        CHECK(wide == WIDE ? of.cycle_s > 1e-11 && of.cycle_s < 1e-6 : of.cycle_s == 0.0);
    }
    uz_free_all(K.ptr, K.idx, K.val, none.ptr);
}

/* Rates are of the kernels themselves: a sweep reads four bytes an entry and a step some forty a dof, neither faster
 * than a core computes; the least of several is the same again. */
TEST(cycles_have_rates_of_their_own)
{
    double sweep = INFINITY, step = INFINITY, least_sweep = INFINITY, least_step = INFINITY;
    for (int k = 0; k < 3; k++) {
        sweep = fmin(sweep, uz_amg_rate());
        step = fmin(step, uz_brick_rate(3));
    }
    for (int k = 0; k < 3; k++) {
        least_sweep = fmin(least_sweep, uz_amg_rate());
        least_step = fmin(least_step, uz_brick_rate(3));
    }
    CHECK_MSG(sweep > 2e-11 && sweep < 1e-7 && step > 1e-10 && step < 1e-6, "%g, %g s", sweep, step);
    CHECK_MSG(least_sweep < 2.0 * sweep && sweep < 2.0 * least_sweep, "%g, %g s", sweep, least_sweep);
    CHECK_MSG(least_step < 2.0 * step && step < 2.0 * least_step, "%g, %g s", step, least_step);
}

/* Poisson's ratio and the elements of a scene find their way to the price. */
TEST(a_scene_tells_how_hard_it_is)
{
    double seconds[4];
    for (int k = 0; k < 4; k++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE,
                              .scene = body_scene(UZ_SOLID, k == 2 ? "tet4" : "wedge6",
                                                  (double[3]){k == 3 ? 20.0 : 1.0, 1.0, 1.0}, (int64_t[3]){8, 8, 8})};
        uz_settings settings = uz_settings_default();
        uz_prediction asked;
        uz_error err = {0};
        settings.op = UZ_OPERATOR_MATRIX_FREE;
        if (k == 1)
            problem.scene.materials[0].poisson = 0.49;
        body_hold(&problem.scene, "left", 0, 0, 0);
        body_plane(&problem.scene, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
        CHECK_MSG(uz_predict(&asked, &problem, &settings, NULL, &err) == UZ_OK, "%s", err.message);
        CHECK_INT(asked.op, UZ_OPERATOR_MATRIX_FREE);
        seconds[k] = asked.seconds;
        uz_scene_clear(&problem.scene);
    }
    CHECK_MSG(seconds[1] > 1.5 * seconds[0] && seconds[3] > 1.5 * seconds[0], "%g, %g, %g s", seconds[0], seconds[1],
              seconds[3]);
    CHECK(seconds[2] < seconds[0]); /* fewer entries */
}

/* Tetrahedra of a grid, of a thin one too, and the same number of them between nodes that were drawn; other elements.
 */
TEST(tetrahedra_of_no_grid_are_irregular)
{
    static const struct {
        const char *element;
        int64_t deep;
        bool drawn;
    } bodies[] = {{"tet4", 8, false}, {"tet10", 8, false}, {"tet4", 3, false},
                  {"tet4", 8, true},  {"tet10", 8, true},  {"hex8", 8, true}};
    for (size_t k = 0; k < sizeof bodies / sizeof bodies[0]; k++) {
        uz_box box = {.size = {8, 8, (double)bodies[k].deep}, .cells = {8, 8, bodies[k].deep}, .dim = 3};
        uz_body_model model = {.brick = NULL};
        int64_t none[] = {0, 0};
        const uz_csc empty = {.rows = 1, .cols = 1, .ptr = none};
        const uz_scene scene = {.model = UZ_SOLID};
        const uz_settings settings = uz_settings_default();
        uz_error err = {0};
        uint64_t seed = k;
        snprintf(box.element, sizeof box.element, "%s", bodies[k].element);
        CHECK_MSG(uz_mesh_from_box(&model.mesh, &box, &err) == UZ_OK, "%s", err.message);
        for (int64_t i = 0; bodies[k].drawn && i < model.mesh.first[model.mesh.n_elements]; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            model.mesh.node[i] = (int64_t)(seed >> 33) % 729; /* corners of 8 x 8 x 8 cells */
        }
        const uz_cost_size size = uz_cost_size_of(&empty, &empty, &model, &scene, 0, 1, &settings);
        CHECK_MSG(size.irregular == (bodies[k].drawn && bodies[k].element[0] == 't'), "%s %lld deep%s",
                  bodies[k].element, (long long)bodies[k].deep, bodies[k].drawn ? ", drawn" : "");
        uz_mesh_clear(&model.mesh);
    }
}

/* An order that was made to know the price has been paid for, whatever is chosen. */
TEST(an_order_that_is_there_makes_no_form_dearer)
{
    const uz_cost_size size = body_under(100);
    for (int large = 0; large < 2; large++) {
        uz_factor_info factor = {.nnz = large ? 400000000 : 4000000, .flops = large ? 1e12 : 1e9, .bytes = 32000000};
        uz_cost_plan quick, slow;
        uz_cost_decide(&quick, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
        factor.order_s = 1000.0;
        uz_cost_decide(&slow, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
        CHECK_INT(slow.form[slow.chosen].op, quick.form[quick.chosen].op);
        CHECK_INT(slow.form[slow.chosen].op, large ? UZ_OPERATOR_MATRIX_FREE : UZ_OPERATOR_CONDENSED);
        for (int k = 0; k < slow.count; k++)
            CHECK_REL(slow.form[k].setup_s, quick.form[k].setup_s + 1000.0, 1e-12);
    }
}

/* It is chosen, where it would not be made, and of it only the contact that it was not made for is paid. */
TEST(a_factor_that_is_there_is_not_paid_again)
{
    const uz_cost_size size = body_under(100);
    uz_factor_info factor = {.nnz = 400000000, .flops = 1e12, .bytes = 32000000, .order_s = 1000.0};
    uz_cost_plan made, there, condensed;
    uz_cost_decide(&made, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
    CHECK_INT(made.form[made.chosen].op, UZ_OPERATOR_MATRIX_FREE);
    factor.factor_s = 1.0;
    uz_cost_decide(&there, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
    CHECK_INT(there.form[there.chosen].op, UZ_OPERATOR_CONDENSED);
    CHECK(there.form[0].setup_s < 1e-3 * made.form[0].setup_s);
    CHECK_REL(there.form[0].case_s, made.form[0].case_s, 1e-12);
    factor.condensing = 1e9;
    uz_cost_decide(&condensed, &size, &factor, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_AUTO, 0);
    CHECK_REL(condensed.form[0].flops, there.form[0].flops + 1e9, 1e-12);
    CHECK(condensed.form[0].setup_s > there.form[0].setup_s);
}

/* What is asked for by name has room for aggregates of another kind where the steps are many; a choice does without. */
TEST(a_form_without_another_takes_more_where_it_is_hard)
{
    uz_cost_size size = {.d = 100000, .m = 1000, .n_b = 1000, .k_entries = 4100000, .modes = 6, .bounds = true};
    double bytes[2][2];
    for (int hard = 0; hard < 2; hard++)
        for (int alone = 0; alone < 2; alone++) {
            uz_cost_plan plan;
            size.firmness = hard ? 14.6 : 1.0;
            size.alone = alone == 1;
            uz_cost_decide(&plan, &size, NULL, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_MATRIX_FREE, 0);
            bytes[hard][alone] = plan.form[plan.chosen].bytes;
        }
    CHECK_REL(bytes[0][1], bytes[0][0], 1e-15);
    CHECK_REL(bytes[1][0], bytes[0][0], 1e-15);
    CHECK(bytes[1][1] > 1.1 * bytes[1][0] && bytes[1][1] < 2.0 * bytes[1][0]);
}
