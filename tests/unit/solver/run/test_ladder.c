/* Boxes whose cells are chosen: which grids there are, which are tried, what their answers are worth. */
#include "run/transfer.h"
#include "ladder_fixture.h"
#include "internal_forces.h"

enum { X, Y };

/* ---- grids */

TEST(dofs_of_a_grid_are_those_of_its_mesh)
{
    for (int k = 0; k < UZ_ELEMENT_KINDS; k++) {
        const uz_element_kind kind = (uz_element_kind)k;
        const double size[3] = {3, 1.3, 1.1};
        const int64_t cells[3] = {0};
        const uz_scene s = body_scene(uz_element_type_of(kind)->dim == 3 ? UZ_SOLID : UZ_PLANE_STRAIN,
                                      uz_element_name(kind), size, cells);
        const uz_grids grids = uz_grids_of_box(&s.box, 0);
        for (int64_t n = grids.first; n < grids.first + 4; n++) {
            const uz_box box = uz_grid(&grids, n);
            uz_mesh mesh;
            CHECK_INT(uz_mesh_from_box(&mesh, &box, NULL), UZ_OK);
            CHECK_REL(uz_grid_dofs(&grids, n), (double)(mesh.n_nodes * mesh.dim), 0);
            uz_mesh_clear(&mesh);
        }
        uz_scene done = s;
        uz_scene_clear(&done);
    }
}

/* However slender or flat, the first grid is a small one, and finer ones follow. */
TEST(first_grids_are_small_and_near_square)
{
    const double sizes[][3] = {{60, 20, 0}, {1, 1e4, 0}, {100, 100, 1}, {1e-3, 1, 1e-3}, {5, 5, 5}, {1e6, 1, 30}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        const bool solid = sizes[k][2] > 0;
        uz_box box = {.size = {sizes[k][0], sizes[k][1], sizes[k][2]}, .dim = solid ? 3 : 2, .automatic = true};
        strcpy(box.element, solid ? "hex8" : "quad4");
        const uz_grids grids = uz_grids_of_box(&box, 0);
        const uz_box first = uz_grid(&grids, grids.first);
        CHECK_MSG(!first.automatic && uz_grid_dofs(&grids, grids.first) < 60e3, "box %zu", k);
        for (int axis = 0; axis < box.dim; axis++)
            CHECK(first.cells[axis] >= 2);
        CHECK(uz_grid_dofs(&grids, grids.first + 1) > uz_grid_dofs(&grids, grids.first));
    }
    uz_scene s = paper(1);
    const uz_box box = grid_of(&s, 7);
    CHECK(box.cells[X] == 21 && box.cells[Y] == 7);
    uz_scene_clear(&s);
}

TEST(next_grids_follow_the_observed_rate)
{
    uz_scene s = paper(1);
    const uz_grids grids = uz_grids_of_box(&s.box, 4e6);
    uz_tried tried[3] = {{4, 0.16}, {8, 0.08}, {16, 0.04}};
    CHECK_REL(uz_observed_rate(&tried[0], &tried[1], 1), 1.0, 1e-12);
    CHECK_INT(uz_next_grid(&grids, tried, 1, 0.01), 8); /* one grid says little: at most twice as fine */
    CHECK_INT(uz_next_grid(&grids, tried, 3, 0.03), 22);
    CHECK_INT(uz_next_grid(&grids, tried, 3, 0.0399), 17);
    CHECK_INT(uz_next_grid(&grids, tried, 3, 1e-6), 0); /* out of reach */
    const uz_tried worse[2] = {{4, 0.1}, {8, 0.11}};
    CHECK_INT(uz_next_grid(&grids, worse, 2, 0.05), 24); /* an error that does not fall yet */
    const uz_tried unseen[5] = {{4, 0.40}, {8, 0.37}, {24, 0.33}, {72, 0.31}, {216, 0.30}}; /* smaller than a cell */
    CHECK_INT(uz_next_grid(&grids, unseen, 3, 0.05), 72);
    CHECK_INT(uz_next_grid(&grids, unseen, 4, 0.05), 216);
    CHECK_INT(uz_next_grid(&grids, unseen, 5, 0.05), 0);
    const uz_tried corner[3] = {{8, 0.2}, {24, 0.2 / sqrt(3)}, {72, 0.2 / 3}}; /* a rate that will not get better */
    CHECK_INT(uz_next_grid(&grids, corner, 3, 0.04), 213);
    CHECK_INT(uz_next_grid(&grids, corner, 3, 0.004), 0);
    const uz_grids small = uz_grids_of_box(&s.box, uz_grid_dofs(&grids, 20));
    CHECK_INT(uz_next_grid(&small, tried, 3, 0.03), 20);
    const uz_tried failed = {8, 0.08}, passed = {24, 0.08 / 3}, near = {15, 0.08 * 8 / 15};
    CHECK_INT(uz_grid_between(&grids, &failed, &passed, 0.05), 14);
    CHECK_INT(uz_grid_between(&grids, &failed, &near, 0.05), 0); /* saves too little */
    uz_scene_clear(&s);
}

/* ---- answers */

static double total_at(const uz_scene *scene, int64_t n, double requested)
{
    uz_scene s = *scene;
    s.box = grid_of(scene, n);
    uz_result *result = body_solve(&s, 0.1 * requested);
    const double total = uz_total_error(NULL, &result->summary);
    uz_result_free(result);
    return total;
}

static void check_coarsest(const uz_scene *scene, double requested)
{
    const uz_settings settings = asking(requested);
    const uz_grids grids = uz_grids_of_box(&scene->box, 0);
    uz_result *result = solve(scene, &settings);
    const uz_grid_sequence *sequence = result->grids;
    const uz_summary *s = &result->summary;
    int64_t n = grids.first, passes = 0;
    CHECK_INT(s->outcome, UZ_CONVERGED);
    CHECK(uz_total_error(NULL, s) <= requested && s->grids == sequence);
    CHECK_REL(uz_total_error(NULL, s), hypot(s->discretization_error, s->certificate.relative_error), 1e-12);
    while (uz_grid(&grids, n).cells[X] < sequence->cells[X] && n < 1000)
        n++;
    CHECK(uz_grid(&grids, n).cells[X] == sequence->cells[X] && uz_grid(&grids, n).cells[Y] == sequence->cells[Y]);
    CHECK_INT(result->n_nodes, (sequence->cells[X] + 1) * (sequence->cells[Y] + 1));
    for (int64_t k = grids.first; k <= n && passes == 0; k++)
        if (total_at(scene, k, requested) <= requested)
            passes = k;
    CHECK_MSG(passes > 0 && uz_grid_dofs(&grids, passes) > 0.75 * uz_grid_dofs(&grids, n),
              "%g: grid %lld meets it, the ladder ended at %lld", requested, (long long)passes, (long long)n);
    uz_result_free(result);
}

TEST(ladder_ends_at_the_coarsest_grid)
{
    uz_scene s = paper(1);
    check_coarsest(&s, 0.05);
    check_coarsest(&s, 0.03);
    check_coarsest(&s, 0.02);
    check_coarsest(&s, 0.012);
    uz_scene_clear(&s);
}

TEST(smooth_problems_converge_at_the_textbook_rate)
{
    static const struct {
        uz_model model;
        const char *element;
        double requested;
    } KINDS[] = {{UZ_PLANE_STRAIN, "quad4", 0.01},
                 {UZ_PLANE_STRESS, "tri3", 0.02},
                 {UZ_SOLID, "hex8", 0.03},
                 {UZ_SOLID, "tet4", 0.05}};
    for (size_t k = 0; k < sizeof KINDS / sizeof *KINDS; k++) {
        uz_scene s = column(KINDS[k].model, KINDS[k].element);
        const uz_settings settings = asking(KINDS[k].requested);
        uz_result *result = solve(&s, &settings);
        const uz_grid_sequence *grids = result->grids;
        const uz_grid_level *first = &grids->level[0], *last = &grids->level[grids->count - 1];
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        const double rate = log(first->discretization_error / last->discretization_error) /
                            log((double)last->cells[X] / (double)first->cells[X]);
        CHECK_MSG(grids->count > 1 && fabs(rate - 1) < 0.12, "%s: order %g after %d grids", KINDS[k].element, rate,
                  grids->count);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

/* u of a coarse quad4 grid at the nodes of one `times` as fine, which contains it. */
static void put_on_finer(double *fine, const double *coarse, const uz_box *box, int64_t times)
{
    const int64_t row = box->cells[X] + 1, fine_row = times * box->cells[X] + 1;
    for (int64_t j = 0; j <= times * box->cells[Y]; j++)
        for (int64_t i = 0; i < fine_row; i++) {
            const int64_t a = i / times < box->cells[X] ? i / times : box->cells[X] - 1;
            const int64_t b = j / times < box->cells[Y] ? j / times : box->cells[Y] - 1;
            const double x = (double)(i - a * times) / (double)times, y = (double)(j - b * times) / (double)times;
            const double weight[4] = {(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y};
            for (int c = 0; c < 2; c++)
                for (int corner = 0; corner < 4; corner++)
                    fine[(j * fine_row + i) * 2 + c] +=
                        weight[corner] * coarse[((b + corner / 2) * row + a + corner % 2) * 2 + c];
        }
}

/* ||u||_E^2 of nodal displacements. */
static double energy(const uz_body_model *model, const double *u)
{
    const int64_t n = model->mesh.n_nodes * model->mesh.dim;
    double *force = body_room(n, sizeof *force), sum = 0;
    CHECK(internal_forces(force, model, u));
    for (int64_t i = 0; i < n; i++)
        sum += force[i] * u[i];
    free(force);
    return sum;
}

/* The error against a grid so much finer that its own does not count. */
TEST(total_error_is_within_a_factor_of_two)
{
    enum { TIMES = 12 };
    const double requests[] = {0.05, 0.03, 0.02};
    for (size_t k = 0; k < sizeof requests / sizeof *requests; k++) {
        uz_scene s = paper(1), reference = s;
        const uz_settings settings = asking(requests[k]);
        uz_result *result = solve(&s, &settings);
        reference.box = s.box;
        reference.box.automatic = false;
        for (int axis = 0; axis < 2; axis++)
            reference.box.cells[axis] = TIMES * result->grids->cells[axis];
        uz_result *fine = body_solve(&reference, 1e-8);
        uz_body_model model = body_model(&reference);
        uz_box box = s.box;
        memcpy(box.cells, result->grids->cells, sizeof box.cells);
        double *e = body_room(fine->n_nodes * 2, sizeof *e);
        put_on_finer(e, result->u, &box, TIMES);
        for (int64_t i = 0; i < fine->n_nodes * 2; i++)
            e[i] -= fine->u[i];
        const double error = sqrt(energy(&model, e) / energy(&model, fine->u));
        CHECK_MSG(error < 2 * requests[k], "asked for %g, off by %g", requests[k], error);
        CHECK_MSG(error < 2 * uz_total_error(NULL, &result->summary) &&
                      error > 0.5 * uz_total_error(NULL, &result->summary),
                  "said %g, off by %g", uz_total_error(NULL, &result->summary), error);
        free(e);
        uz_body_model_clear(&model);
        uz_result_free(fine);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

TEST(units_change_nothing)
{
    uz_scene in_mm = paper(1), in_m = paper(1e-3);
    const uz_settings settings = asking(0.015);
    uz_result *a = solve(&in_mm, &settings), *b = solve(&in_m, &settings);
    CHECK_INT(a->grids->count, b->grids->count);
    for (int i = 0; i < a->grids->count && i < b->grids->count; i++) {
        CHECK_INT(a->grids->level[i].cells[X], b->grids->level[i].cells[X]);
        CHECK_REL(b->grids->level[i].discretization_error, a->grids->level[i].discretization_error, 1e-6);
    }
    CHECK(memcmp(a->grids->cells, b->grids->cells, sizeof a->grids->cells) == 0);
    uz_result_free(a);
    uz_result_free(b);
    uz_scene_clear(&in_mm);
    uz_scene_clear(&in_m);
}

TEST(elements_gradings_and_levels)
{
    static const char *const ELEMENTS[] = {"tri3", "tri6", "quad8"};
    for (size_t k = 0; k < sizeof ELEMENTS / sizeof *ELEMENTS; k++) {
        uz_scene s = paper(1);
        strcpy(s.box.element, ELEMENTS[k]);
        s.box.grading[X] = 4;
        uz_settings settings = asking(0);
        settings.balanced = true;
        uz_result *result = solve(&s, &settings);
        CHECK_INT(result->summary.outcome, UZ_CONVERGED);
        CHECK(result->summary.requested_error == UZ_BALANCED_TOTAL_ERROR);
        const double *x = result->mesh.xyz;
        const int64_t last = (strcmp(ELEMENTS[k], "tri3") == 0 ? 1 : 2) * result->grids->cells[X];
        const double first_cell = x[2 * (last / result->grids->cells[X])] - x[0];
        CHECK(x[2 * last] - x[2 * (last - last / result->grids->cells[X])] > 3.99 * first_cell);
        uz_result_free(result);
        uz_scene_clear(&s);
    }
}

/* ---- load cases */

TEST(worst_case_decides)
{
    uz_scene s = paper(1);
    uz_problem problem = problem_of_scene(&s);
    uz_load light[2] = {s.loads[0], s.loads[1]};
    uz_load_case cases[2] = {{.name = "own"}, {.name = "pulled", .loads = light, .n_loads = 2}};
    light[0].v[Y] = -0.2;
    problem.cases = cases;
    problem.n_cases = 2;
    const uz_settings settings = asking(0.02);
    uz_result **results = NULL;
    CHECK_INT(uz_solve_cases(&results, &problem, &settings, NULL, NULL, NULL, NULL), UZ_OK);
    double worst = 0;
    for (int i = 0; results && i < 2; i++) {
        CHECK_INT(results[i]->summary.outcome, UZ_CONVERGED);
        CHECK(uz_total_error(NULL, &results[i]->summary) <= 0.02 && results[i]->grids);
        worst = fmax(worst, results[i]->summary.discretization_error);
    }
    for (int i = 0; results && i < results[0]->grids->count; i++)
        if (results[0]->grids->level[i].cells[X] == results[0]->grids->cells[X])
            CHECK_REL(results[0]->grids->level[i].discretization_error, worst, 1e-12);
    uz_results_free(results, 2);
    uz_scene_clear(&s);
}

/* ---- limits */

typedef struct {
    int grids, cancel_at; /* grids begun; the one in which it is cancelled */
    double last;
    bool back;
} watcher;

static void note_grid(void *ctx, const uz_grid_start *grid)
{
    watcher *w = ctx;
    w->back = w->back || grid->from < 0 || grid->to > 1 || grid->to < grid->from || grid->number != w->grids + 1 ||
              isnan(grid->error) != (w->grids == 0) || !(grid->unknowns > 0);
    /* three grids tell how they go on, fewer do not */
    w->back = w->back || !(w->grids < 3 ? isnan(grid->seconds_left) : grid->seconds_left > 0);
    w->last = grid->to;
    w->grids++;
}

static bool cancel_late(void *ctx)
{
    const watcher *w = ctx;
    return w->cancel_at > 0 && w->grids >= w->cancel_at;
}

static uz_status solve_watched(uz_result **out, watcher *w, double requested)
{
    uz_scene s = paper(1);
    const uz_problem problem = problem_of_scene(&s);
    const uz_settings settings = asking(requested);
    const uz_hooks hooks = {.ctx = w, .cancelled = cancel_late, .grid = note_grid};
    uz_status status = uz_solve(out, &problem, &settings, NULL, &hooks, NULL);
    uz_scene_clear(&s);
    return status;
}

TEST(progress_covers_the_whole)
{
    watcher w = {0};
    uz_result *result = NULL;
    CHECK_INT(solve_watched(&result, &w, 0.01), UZ_OK);
    CHECK(result && result->grids->count == w.grids && w.grids > 2 && !w.back && w.last > 0.9);
    uz_result_free(result);
}

TEST(cancelled_ladders_give_the_best_grid)
{
    for (int at = 1; at <= 3; at++) {
        watcher w = {.cancel_at = at};
        uz_result *result = NULL;
        uz_status status = solve_watched(&result, &w, 0.01);
        if (at == 1) {
            CHECK_INT(status, UZ_ERR_CANCELLED);
            continue;
        }
        CHECK_INT(status, UZ_OK);
        CHECK(result && result->summary.outcome == UZ_DISMISSED && strstr(result->summary.message, "by request"));
        CHECK(result && result->grids->count == at - 1 && isfinite(uz_total_error(NULL, &result->summary)));
        uz_result_free(result);
    }
}

TEST(time_limit_ends_a_ladder)
{
    uz_scene s = paper(1);
    uz_settings settings = asking(3e-3);
    settings.time_limit_s = 0.02;
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_TIME_LIMIT);
    CHECK(result->grids->count >= 1 && strstr(result->summary.message, "time_limit_s"));
    uz_result_free(result);
    settings.time_limit_s = 0;
    result = solve(&s, &settings);
    CHECK(result->summary.outcome == UZ_TIME_LIMIT && result->grids->count == 1);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(memory_limit_ends_a_ladder)
{
    uz_scene s = paper(1);
    uz_settings settings = asking(3e-3);
    settings.memory_limit = 3000000;
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_MESH_LIMIT);
    CHECK_MSG(result->grids->count > 1 && strstr(result->summary.message, "bytes"), "%s", result->summary.message);
    CHECK(uz_total_error(NULL, &result->summary) > 3e-3 && result->summary.cost.actual_bytes <= 3e6);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* Nothing is tried that would not get there anyway. */
TEST(what_is_out_of_reach_is_not_climbed_to)
{
    uz_scene s = paper(1);
    uz_settings settings = asking(0);
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_MESH_LIMIT);
    CHECK(result->grids->count <= 4 && result->d < 100000 && result->summary.message[0]);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* What the equations can't give, no mesh gives: an iteration limit stays one. */
TEST(unsolved_equations_end_a_ladder)
{
    uz_scene s = paper(1);
    uz_settings settings = asking(0.01);
    settings.method = UZ_METHOD_UZAWA;
    settings.max_iterations = 1;
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_ITERATION_LIMIT);
    CHECK(result->grids->count == 1);
    uz_result_free(result);
    uz_scene_clear(&s);
}

/* Obstacles that contradict each other leave no answer on any grid. */
TEST(infeasible_boxes_end_at_once)
{
    uz_scene s = paper(1);
    strcpy(s.supports[0].on, "top");
    body_plane(&s, "bottom", (double[3]){0, -0.5, 0}, (double[3]){0, -1, 0});
    const uz_settings settings = asking(0.01);
    uz_result *result = solve(&s, &settings);
    CHECK_INT(result->summary.outcome, UZ_INFEASIBLE);
    CHECK(result->grids->count == 1 && result->ray && strstr(result->summary.message, "contradict"));
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(chosen_cells_are_for_solving_only)
{
    uz_scene s = paper(1);
    uz_problem problem = problem_of_scene(&s);
    uz_settings settings = asking(0.05);
    uz_result *result = NULL;
    uz_error err = {0};
    uz_qp qp;
    CHECK_INT(uz_scene_check(&s, &err), UZ_OK);
    CHECK_INT(uz_scene_to_qp(&qp, NULL, &s, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/mesh/box/cells");
    const double none = 0;
    CHECK_INT(uz_verify(&result, &problem, &none, &none, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    settings.stopping = UZ_STOP_PAPER;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_ARGUMENT);
    settings.stopping = UZ_STOP_CERTIFIED;
    double r[1] = {0};
    const uz_state start = {.m = 1, .r = r};
    const uz_state *starts[1] = {&start};
    uz_result **results = NULL;
    CHECK_INT(uz_solve_cases(&results, &problem, &settings, starts, NULL, NULL, &err), UZ_ERR_ARGUMENT);
    CHECK_STR(err.where, "start");
    s.box.size[X] = -1;
    problem.scene = s;
    CHECK_INT(uz_solve(&result, &problem, &settings, NULL, NULL, &err), UZ_ERR_SCENE);
    CHECK_STR(err.where, "/mesh/box/size/0");
    uz_scene_clear(&s);
}

/* ---- the start of the next grid */

static void check_transfer(uz_model model, const char *element)
{
    const double size[3] = {6, 2, 2.5};
    const int64_t coarse[3] = {6, 3, 2}, fine[3] = {9, 4, 5};
    uz_scene s = body_scene(model, element, size, coarse);
    body_hold(&s, "left", 0, 0, model == UZ_SOLID ? 0 : NAN);
    body_hold(&s, "right", 0, 0, model == UZ_SOLID ? 0 : NAN);
    body_load(&s, UZ_LOAD_TRACTION, "top", 0, -1, 0);
    body_plane(&s, "bottom", (double[3]){0, 0, 0}, (double[3]){0, 1, 0});
    body_plane(&s, "top", (double[3]){0, 3, 0}, (double[3]){0, -1, 0});
    s.all_candidates = true;
    uz_result *result = body_solve(&s, 1e-6);
    const uz_box box = s.box;
    for (int64_t i = 0; i < result->m; i++) /* linear in x, and of each contact its own */
        result->pressure[i] = result->mesh.contact_of[i] == 0
                                  ? 1 + result->mesh.xyz[result->mesh.contact_node[i] * result->mesh.dim]
                                  : 0.25;
    memcpy(s.box.cells, fine, sizeof fine);
    uz_body_model next = body_model(&s);
    uz_state *start = NULL;
    CHECK_INT(uz_transfer_start(&start, result, &box, &next, NULL), UZ_OK);
    CHECK(start && start->m == next.m && next.m > 0);
    /* the supported ends have no rows, so that the pressure falls to 0 there */
    for (int64_t i = 0; start && i < next.m; i++) {
        const double x = next.info.xyz[next.info.contact_node[i] * next.info.dim];
        const double want = -next.info.contact_area[i] * (next.info.contact_of[i] == 0 ? 1 + x : 0.25);
        CHECK_MSG(x < 1 || x > 5 || fabs(start->r[i] - want) <= 1e-12 * fabs(want), "%s at %g: %g, not %g", element, x,
                  start->r[i], want);
    }
    uz_state_free(start);
    uz_body_model_clear(&next);
    uz_result_free(result);
    uz_scene_clear(&s);
}

TEST(pressure_is_transferred)
{
    check_transfer(UZ_PLANE_STRESS, "quad4");
    check_transfer(UZ_PLANE_STRAIN, "tri3");
    check_transfer(UZ_PLANE_STRESS, "quad8");
    check_transfer(UZ_PLANE_STRESS, "tri6");
    check_transfer(UZ_SOLID, "hex8");
    check_transfer(UZ_SOLID, "tet10");
}

/* The iterations that a ladder's last grid took from the coarser one's pressure, and from zero. */
TEST(coarser_grids_save_iterations)
{
    uz_scene s = paper(1);
    uz_settings settings = asking(0.015);
    settings.method = UZ_METHOD_ACCELERATED_RESTART;
    uz_result *warm = solve(&s, &settings), *cold = NULL;
    memcpy(s.box.cells, warm->grids->cells, sizeof s.box.cells);
    s.box.automatic = false;
    settings.relative_error *= 0.1;
    cold = solve(&s, &settings);
    CHECK_INT(warm->summary.outcome, UZ_CONVERGED);
    CHECK_INT(warm->summary.origin, UZ_FROM_REACTIONS);
    printf("# %lld iterations, %lld from zero\n", (long long)warm->summary.iterations,
           (long long)cold->summary.iterations);
    CHECK(warm->summary.iterations < cold->summary.iterations);
    uz_result_free(warm);
    uz_result_free(cold);
    uz_scene_clear(&s);
}
