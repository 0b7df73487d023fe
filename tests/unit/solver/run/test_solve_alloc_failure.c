/* Each allocation of a solve fails once: the call must say so, publish nothing, keep nothing and free everything.
 * Linked with malloc, calloc, realloc and free wrapped; CHOLMOD's allocations come through here too. */
#include "failing_heap.h"
#include "harness.h"
#include "qp_fixture.h"
#include "sanitized.h"
#include "scene_fixture.h"
#include "two_boxes.h"

#include <suitesparse/SuiteSparse_config.h>

enum { MOST_ALLOCATIONS = 100000 };

/* CHOLMOD allocates through pointers; the first two of them are set by uz_process_init. BLAS is out of reach. */
__attribute__((constructor)) static void settle_process(void)
{
    uz_process_init(2);
    uz_thread_init();
    SuiteSparse_config.realloc_func = realloc;
    SuiteSparse_config.free_func = free;
}

typedef struct {
    const char *name;
    uz_problem problem;
    uz_settings settings;
    bool cached; /* through a cache, twice */
    long step;   /* between the allocations that fail */
} scenario;

/* What is offered between grids is an answer as one that is returned, and not met yet: what was asked for. */
static void look_at_offer(void *ctx, uz_result *const *results, int64_t n)
{
    const uz_summary *summary = &results[0]->summary;
    *(int *)ctx += 1;
    CHECK_INT(n, 1);
    CHECK_INT(summary->outcome, UZ_TIME_LIMIT);
    CHECK(summary->grids == results[0]->grids && summary->grids->count > 0 && summary->message[0]);
    CHECK(summary->evaluation == results[0]->evaluation && results[0]->u && isfinite(results[0]->u[0]));
}

static bool is_doubted(const uz_result *result)
{
    bool doubted = false;
    for (int i = 0; result->evaluation && i < result->evaluation->n_warnings; i++)
        doubted = doubted || strcmp(result->evaluation->warnings[i].code, "large_deformation") == 0;
    return doubted;
}

/* Solves once or twice; whether every call ended as it may: with an answer or with UZ_ERR_MEMORY. */
static void attempt(const scenario *s, long n)
{
    uz_cache *cache = s->cached ? uz_cache_new(1 << 30) : NULL;
    bool no_cache = s->cached && !cache;
    for (int k = 0; !no_cache && k < (s->cached ? 2 : 1); k++) {
        uz_result *result = (uz_result *)&heap;
        uz_error err = {0};
        bool failed_before = heap.failed;
        int offers = 0;
        const uz_hooks hooks = {.ctx = &offers, .keep = look_at_offer};
        uz_status status = uz_solve(&result, &s->problem, &s->settings, cache, &hooks, &err);
        bool fair = status == UZ_OK || (status == UZ_ERR_MEMORY && heap.failed && !failed_before);
        CHECK_MSG(fair, "%s: allocation %ld ends in %s: %s", s->name, n, uz_status_name(status), err.message);
        CHECK_MSG((status == UZ_OK) == (result != NULL), "%s: allocation %ld", s->name, n);
        CHECK_INT(err.status, status);
        if (status == UZ_OK)
            CHECK_MSG(offers == (result->grids && isfinite(s->settings.time_limit_s) ? result->grids->count - 1 : 0) ||
                          heap.failed,
                      "%s: allocation %ld: %d offers", s->name, n, offers);
        if (status == UZ_OK)
            CHECK_MSG(result->summary.outcome == UZ_CONVERGED, "%s: allocation %ld: %s", s->name, n,
                      uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome));
        const uz_scene *scene = &s->problem.scene; /* without memory for a comparison the answer stays, and says so */
        if (status == UZ_OK && s->problem.kind == UZ_PROBLEM_SCENE && scene->model == UZ_PLANE_STRAIN &&
            scene->kinematics == UZ_KINEMATICS_AUTO && scene->materials[0].law == UZ_ELASTIC_LINEAR)
            CHECK_MSG(result->summary.small.compared || is_doubted(result), "%s: allocation %ld", s->name, n);
        uz_result_free(result);
    }
    uz_cache_free(cache);
}

/* The 1st, 2nd, ... allocation fails until none is left that could. Returns how many there were. */
static long fail_each(const scenario *s)
{
    const long step = s->step > 0 ? s->step : 1;
    for (long n = 0; n<MOST_ALLOCATIONS; n = step> 1 ? n + step : next_allocation(n)) {
        heap_watch(n);
        attempt(s, n);
        heap.watching = false;
        CHECK_MSG(heap.live == 0, "%s: allocation %ld fails and %d blocks leak", s->name, n, heap.live);
        if (!heap.failed)
            return n;
    }
    return -1;
}

static void check_scenario(const char *name, uz_problem problem, uz_method method, uz_operator op, uz_ordering ordering,
                           bool cached)
{
    scenario s = {name, problem, uz_settings_default(), cached, 1};
    s.settings.semidefinite = true; /* heard only where K is singular */
    s.settings.method = method;
    s.settings.op = op;
    s.settings.ordering = ordering;
    const bool scene = problem.kind == UZ_PROBLEM_SCENE,
               chosen = scene && (problem.scene.box.automatic || problem.scene.refine);
    const bool refined = scene && problem.scene.refine;
    s.settings.time_limit_s = refined ? 1000 : s.settings.time_limit_s;
    const bool finite = scene && problem.scene.kinematics == UZ_KINEMATICS_FINITE;
    /* few elements of large deformation are divided twice, in thousands of allocations, in contact in tens of them */
    s.step = !finite                                                                              ? 1
             : problem.scene.n_contacts > 0 && problem.scene.contacts[0].kind == UZ_OBSTACLE_BODY ? 997
                                                                                                  : 97;
    s.settings.relative_error = refined  ? (finite ? 0.6 : 0.04)
                                : chosen ? (finite ? 0.15 : 0.02)
                                         : 1e-4; /* two or three grids */
    s.settings.balanced = scene && !chosen && !finite && problem.scene.materials[0].law == UZ_ELASTIC_LINEAR;
    long count = fail_each(&s);
    printf("# %s: %ld allocations\n", name, count);
    CHECK_MSG(count > 50, "%s: %ld allocations", name, count);
    uz_problem_clear(&s.problem);
}

static uz_problem scene_problem(void)
{
    return (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(6, 2)};
}

/* On a ball that is pushed aside, followed for some passes. */
static uz_problem moving_problem(void)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(4, 2, 4, 2)};
    add_support(&problem.scene, "top", 0.5, -0.05);
    add_plane(&problem.scene, "bottom", 2, -5, 0, 1);
    problem.scene.contacts[0].kind = UZ_OBSTACLE_ROUND;
    problem.scene.contacts[0].radius = 5;
    problem.scene.kinematics = UZ_KINEMATICS_MOVING;
    return problem;
}

/* Squeezed on the ball, in one part of the load, at a law of finite strain. */
static uz_problem finite_problem(void)
{
    uz_problem problem = moving_problem();
    problem.scene.box.cells[0] = 2;
    problem.scene.box.cells[1] = 1;
    problem.scene.model = UZ_PLANE_STRAIN;
    problem.scene.kinematics = UZ_KINEMATICS_FINITE;
    problem.scene.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    return problem;
}

/* Of two blocks, of which the upper one is carried along the other. */
static uz_problem pair_problem(void)
{
    const box_part a = {{0, 0}, {1, 0.5}, {2, 1}, "quad4"}, b = {{0.2, 0.52}, {0.5, 0.5}, {1, 1}, "quad4"};
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = two(UZ_PLANE_STRAIN, UZ_ELASTIC_NEO_HOOKE, &a, &b, NULL)};
    body_hold(&problem.scene, "abottom", 0, 0, NAN);
    body_hold(&problem.scene, "btop", 0.1, -0.1, NAN);
    touch(&problem.scene, "bbottom", "atop");
    return problem;
}

/* A body that is squeezed on a ball, where small deformation turns out not to be enough. */
static uz_problem weighed_problem(uz_elasticity law)
{
    uz_problem problem = finite_problem();
    problem.scene.kinematics = UZ_KINEMATICS_AUTO;
    problem.scene.materials[0].law = law;
    return problem;
}

/* A block that its load alone presses on a plane, by either model. */
static uz_problem pressed_on_problem(uz_kinematics kinematics)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(1, 1, 2, 2)};
    add_support(&problem.scene, "left", 0, NAN);
    add_plane(&problem.scene, "bottom", 0, 0, 0, 1);
    add_load(&problem.scene, "top", 0, -0.1 * problem.scene.materials[0].young);
    problem.scene.model = UZ_PLANE_STRAIN;
    problem.scene.kinematics = kinematics;
    if (kinematics == UZ_KINEMATICS_FINITE)
        problem.scene.materials[0].law = UZ_ELASTIC_NEO_HOOKE;
    return problem;
}

/* The same scene for some of its numbers. */
static uz_problem asking_problem(void)
{
    static const uz_quantity LIST[] = {
        {.kind = UZ_QUANTITY_CONTACT_FORCE, .name = "force", .on = "bottom"},
        {.kind = UZ_QUANTITY_REACTION, .name = "reaction", .on = "left", .direction = {0, 1}},
        {.kind = UZ_QUANTITY_DISPLACEMENT, .name = "way", .on = "top", .direction = {0, 1}},
        {.kind = UZ_QUANTITY_MEAN_PRESSURE, .name = "pressure", .low = {-1, -1}, .high = {100, 1}},
        {.kind = UZ_QUANTITY_STRAIN_ENERGY, .name = "energy"}};
    uz_problem problem = scene_problem();
    problem.n_quantities = sizeof LIST / sizeof LIST[0];
    problem.quantities = malloc(sizeof LIST);
    if (!problem.quantities)
        abort();
    memcpy(problem.quantities, LIST, sizeof LIST);
    return problem;
}

/* Large deformation on a spring, with a rigid side and a force beside another. */
static uz_problem finite_supports_problem(void)
{
    uz_problem problem = asking_problem();
    uz_scene *scene = &problem.scene;
    uz_scene_clear(scene);
    *scene = finite_problem().scene;
    snprintf(scene->supports[0].on, sizeof scene->supports[0].on, "left");
    add_support(scene, "top", NAN, NAN);
    add_support(scene, "right", NAN, NAN);
    scene->supports[1].kind = UZ_SUPPORT_SPRING;
    scene->supports[1].spring[1] = 1;
    scene->supports[2].kind = UZ_SUPPORT_RIGID;
    for (int c = 0; c < 3; c++)
        scene->supports[2].turn[c] = NAN;
    add_load(scene, "bottom", 0.1, 0);
    uz_load *beside = &scene->loads[scene->n_loads - 1];
    beside->kind = UZ_LOAD_FORCE;
    beside->has_point = true;
    beside->point[1] = -1;
    return problem;
}

/* A block on a ball, which it stands in between its nodes. */
static uz_problem block_problem(void)
{
    uz_problem problem = asking_problem();
    uz_scene *scene = &problem.scene;
    uz_scene_clear(scene);
    *scene = box_scene(4, 2, 2, 1);
    add_support(scene, "left", 0, NAN);
    add_support(scene, "top", NAN, -0.05);
    add_plane(scene, "bottom", 2, -5, 0, 1);
    scene->contacts[0].kind = UZ_OBSTACLE_ROUND;
    scene->contacts[0].radius = 5;
    return problem;
}

/* A cube whose matrix is not assembled, on some grids. */
static uz_problem cells_problem(void)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(4, 4, 4, 4)};
    uz_scene *scene = &problem.scene;
    scene->model = UZ_SOLID;
    scene->box.dim = 3;
    scene->box.size[2] = 4;
    scene->box.cells[2] = 3;
    snprintf(scene->box.element, sizeof scene->box.element, "hex8");
    add_support(scene, "left", 0.01, 0);
    scene->supports[0].u[2] = 0;
    add_load(scene, "top", 0, -5);
    add_plane(scene, "bottom", 0, 0, 0, 1);
    return problem;
}

static uz_problem obstacle_problem(void)
{
    qp_random rng = {3};
    return problem_of(random_obstacle(&rng, 20, 2));
}

/* Rows that are not those of an identity, two of them alike. */
static uz_problem dependent_problem(void)
{
    qp_random rng = {4};
    qp_kind kind = {.d = 8, .m = 6, .condition = 10, .dependent = true};
    return problem_of(random_qp(&rng, &kind));
}

/* Fewer rows than dofs that they touch: the contact stays among the other dofs. */
static uz_problem leaning_problem(void)
{
    qp_random rng = {5};
    qp_kind kind = {.d = 12, .m = 4, .condition = 10};
    return problem_of(random_qp(&rng, &kind));
}

/* A chain on a spring so weak that only refinement brings what is asked for, with every bound written twice, the second
 * time up to rounding. */
static uz_problem weak_problem(void)
{
    enum { D = 12 };
    double *K = vector(D * D), *N = vector(2 * D * D);
    uz_qp qp = {.p = vector(D), .h = vector(2 * D)};
    for (int64_t j = 0; j < D; j++) {
        K[j * D + j] = j == 0 ? 1 + 1e-12 : j + 1 < D ? 2 : 1;
        if (j > 0)
            K[j * D + j - 1] = K[(j - 1) * D + j] = -1;
        N[j * D + j] = 1;
        N[(D + j) * D + j] = 0.3;
        qp.h[j] = 0.5;
        qp.h[D + j] = 0.15;
        qp.p[j] = j % 4 == 3 ? -1 : 1;
    }
    qp.K = csc_from_dense(K, D, D, true);
    qp.N = csc_from_dense(N, 2 * D, D, false);
    free(K);
    free(N);
    return problem_of(qp);
}

TEST(scenes)
{
    check_scenario("scene", scene_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    check_scenario("cells", cells_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE, UZ_ORDERING_AUTO, true);
    check_scenario("cached scene", scene_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_CAMD, true);
    uz_problem chosen = scene_problem();
    chosen.scene.box.automatic = true;
    check_scenario("chosen cells", chosen, UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    uz_problem refined = scene_problem();
    refined.scene.refine = true;
    check_scenario("refined mesh", refined, UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    check_scenario("factored scene", scene_problem(), UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_FACTORED,
                   UZ_ORDERING_METIS, false);
}

/* A slender cantilever between two walls, whose end reaches the one that its rows were left out of. */
TEST(moving_contact)
{
    check_scenario("moving contact", moving_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    check_scenario("finite strain", finite_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    uz_problem refined = finite_problem();
    refined.scene.refine = true;
    check_scenario("refined at finite strain", refined, UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    uz_problem chosen = finite_problem();
    chosen.scene.box.automatic = true;
    check_scenario("chosen cells at finite strain", chosen, UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    check_scenario("finite strain on springs", finite_supports_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO,
                   UZ_ORDERING_AUTO, false);
    check_scenario("two bodies", pair_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
}

TEST(small_deformation_is_compared)
{
    check_scenario("linear law", weighed_problem(UZ_ELASTIC_LINEAR), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO,
                   false);
    check_scenario("law of finite strain", weighed_problem(UZ_ELASTIC_NEO_HOOKE), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO,
                   UZ_ORDERING_AUTO, false);
    check_scenario("held by contact alone", pressed_on_problem(UZ_KINEMATICS_AUTO), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO,
                   UZ_ORDERING_AUTO, false);
    check_scenario("held by contact alone at finite strain", pressed_on_problem(UZ_KINEMATICS_FINITE), UZ_METHOD_AUTO,
                   UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
}

/* The answer stays, whatever the bound on its whole error lacks. */
TEST(guaranteed_bound)
{
    scenario s = {"guaranteed", scene_problem(), uz_settings_default(), false, 1};
    s.settings.guaranteed = true;
    CHECK(fail_each(&s) > 200);
    uz_problem_clear(&s.problem);
}

TEST(guaranteed_intervals)
{
    scenario s = {"intervals", block_problem(), uz_settings_default(), false, 1};
    s.settings.guaranteed = true;
    CHECK(fail_each(&s) > 400);
    uz_problem_clear(&s.problem);
}

TEST(quantities)
{
    check_scenario("quantities", asking_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AUTO, false);
    check_scenario("quantities without a factor", asking_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE,
                   UZ_ORDERING_AUTO, false);
}

TEST(rows_left_out)
{
    uz_problem slender = {.kind = UZ_PROBLEM_SCENE, .scene = box_scene(60, 2, 260, 1)};
    add_support(&slender.scene, "left", 0, 0);
    add_load(&slender.scene, "right", 0, 4);
    add_plane(&slender.scene, "bottom", 0, -0.5, 0, 1);
    add_plane(&slender.scene, "top", 0, 4, 0, -1);
    uz_result *x = NULL;
    const uz_settings settings = uz_settings_default();
    CHECK_INT(uz_solve(&x, &slender, &settings, NULL, NULL, NULL), UZ_OK);
    CHECK(x->summary.rounds > 1 && x->summary.added > 0);
    uz_result_free(x);
    /* As its rows are many, each attempt is slow. */
    scenario s = {"rows left out", slender, settings, false, SANITIZED ? 31 : 17};
    CHECK(fail_each(&s) > 50);
    uz_problem_clear(&slender);
}

TEST(matrices)
{
    check_scenario("obstacle", obstacle_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_CONDENSED, UZ_ORDERING_AMD, false);
    check_scenario("iterated obstacle", obstacle_problem(), UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED,
                   UZ_ORDERING_AMD, true);
    check_scenario("conjugate obstacle", obstacle_problem(), UZ_METHOD_CONJUGATE, UZ_OPERATOR_CONDENSED,
                   UZ_ORDERING_AMD, false);
    check_scenario("sparse active set", obstacle_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_FACTORED, UZ_ORDERING_AMD,
                   false);
    check_scenario("cached factored obstacle", obstacle_problem(), UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_FACTORED,
                   UZ_ORDERING_AMD, true);
}

/* Large enough for coarse levels. */
TEST(matrix_free)
{
    for (int graded = 0; graded < 2; graded++) { /* by its cells, and by a matrix */
        uz_problem fine = scene_problem();
        fine.scene.box.cells[0] = 30;
        fine.scene.box.cells[1] = 20;
        fine.scene.box.grading[0] = graded ? 1.01 : 1;
        check_scenario(graded ? "matrix-free scene" : "matrix-free cells", fine, UZ_METHOD_AUTO,
                       UZ_OPERATOR_MATRIX_FREE, UZ_ORDERING_AUTO, false);
    }
    check_scenario("matrix-free rows", dependent_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE, UZ_ORDERING_AUTO,
                   true);
    check_scenario("matrix-free independent rows", leaning_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_MATRIX_FREE,
                   UZ_ORDERING_AUTO, false);
}

TEST(dependent_rows)
{
    check_scenario("dependent rows", dependent_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_CONDENSED, UZ_ORDERING_AMD,
                   false);
    check_scenario("refined", weak_problem(), UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_CONDENSED, UZ_ORDERING_AMD, false);
    check_scenario("exchanged", dependent_problem(), UZ_METHOD_ACTIVE_SET, UZ_OPERATOR_FACTORED, UZ_ORDERING_AMD,
                   false);
}

TEST(leaning_rows)
{
    check_scenario("leaning rows", leaning_problem(), UZ_METHOD_AUTO, UZ_OPERATOR_CONDENSED, UZ_ORDERING_AUTO, false);
    check_scenario("iterated leaning rows", leaning_problem(), UZ_METHOD_ACCELERATED_RESTART, UZ_OPERATOR_CONDENSED,
                   UZ_ORDERING_METIS, true);
}

/* Several loads; every second one goes on from an earlier run. */
static void attempt_cases(const uz_problem *problem, const uz_settings *settings, const uz_state *const *starts, long n)
{
    uz_result **results = (uz_result **)&heap;
    uz_error err = {0};
    uz_status status = uz_solve_cases(&results, problem, settings, starts, NULL, NULL, &err);
    bool fair = status == UZ_OK || (status == UZ_ERR_MEMORY && heap.failed);
    CHECK_MSG(fair, "cases: allocation %ld ends in %s: %s", n, uz_status_name(status), err.message);
    CHECK((status == UZ_OK) == (results != NULL));
    for (int64_t i = 0; results && i < problem->n_cases; i++)
        CHECK_INT(results[i]->summary.outcome, UZ_CONVERGED);
    uz_results_free(results, problem->n_cases);
}

static void attempt_verification(const uz_problem *problem, const uz_settings *settings, const uz_result *answer,
                                 long n)
{
    uz_result *result = (uz_result *)&heap;
    uz_error err = {0};
    uz_status status = uz_verify(&result, problem, answer->u, answer->r, settings, NULL, NULL, &err);
    bool fair = status == UZ_OK || (status == UZ_ERR_MEMORY && heap.failed);
    CHECK_MSG(fair, "verification: allocation %ld ends in %s: %s", n, uz_status_name(status), err.message);
    CHECK((status == UZ_OK) == (result != NULL));
    if (result)
        CHECK_INT(result->summary.outcome, UZ_VERIFIED);
    uz_result_free(result);
}

/* True when an allocation failed, so that there may be more. */
static bool end_watching(const char *name, long n)
{
    heap.watching = false;
    CHECK_MSG(heap.live == 0, "%s: allocation %ld fails and %d blocks leak", name, n, heap.live);
    return heap.failed;
}

static void check_cases(uz_operator op, uz_method method, int64_t count)
{
    uz_problem problem = scene_problem();
    uz_settings settings = uz_settings_default();
    const uz_state *starts[16] = {NULL};
    uz_result *earlier = NULL;
    long n = 0;
    settings.op = op;
    settings.method = method;
    settings.max_iterations = 3;
    CHECK_INT(uz_solve(&earlier, &problem, &settings, NULL, NULL, NULL), UZ_OK);
    settings.max_iterations = 100000;
    settings.relative_error = 1e-6;
    problem.cases = calloc((size_t)count, sizeof *problem.cases);
    problem.n_cases = count;
    for (int64_t i = 1; i < count; i += 2)
        starts[i] = earlier->state;
    for (bool more = true; more && n < MOST_ALLOCATIONS; n = next_allocation(n)) {
        heap_watch(n);
        attempt_cases(&problem, &settings, starts, n);
        more = end_watching("cases", n);
    }
    printf("# %lld cases, %s: %ld allocations\n", (long long)count, uz_choice_name(UZ_CHOICE_OPERATOR, op), n);
    CHECK(n > 100 && n < MOST_ALLOCATIONS);
    uz_result_free(earlier);
    uz_problem_clear(&problem);
}

TEST(load_cases)
{
    check_cases(UZ_OPERATOR_CONDENSED, UZ_METHOD_AUTO, 10);
    check_cases(UZ_OPERATOR_FACTORED, UZ_METHOD_ACCELERATED_RESTART, 2);
}

TEST(verification)
{
    uz_problem problem = scene_problem();
    uz_settings settings = uz_settings_default();
    uz_result *answer = NULL;
    long n = 0;
    CHECK_INT(uz_solve(&answer, &problem, &settings, NULL, NULL, NULL), UZ_OK);
    settings.relative_error = 1e-6;
    for (bool more = true; more && n < MOST_ALLOCATIONS; n = next_allocation(n)) {
        heap_watch(n);
        attempt_verification(&problem, &settings, answer, n);
        more = end_watching("verification", n);
    }
    printf("# verification: %ld allocations\n", n);
    CHECK(n > 50 && n < MOST_ALLOCATIONS);
    uz_result_free(answer);
    uz_problem_clear(&problem);
}

/* Held by the obstacle only: a block on rollers, and two free-free pairs of dofs. */
TEST(semicoercive)
{
    uz_scene rolled = box_scene(6, 2, 3, 1);
    add_support(&rolled, "left", 0, (double)NAN);
    add_load(&rolled, "top", 0, -1);
    add_plane(&rolled, "bottom", 0, 0, 0, 1);
    check_scenario("rolled scene", (uz_problem){.kind = UZ_PROBLEM_SCENE, .scene = rolled}, UZ_METHOD_AUTO,
                   UZ_OPERATOR_AUTO, UZ_ORDERING_AMD, false);
    static const double K[16] = {1, -1, 0, 0, -1, 1, 0, 0, 0, 0, 1, -1, 0, 0, -1, 1};
    static const double N[12] = {1, 0, 0, 0, 0, -1, 1, 0, 0, 0, 0, 1};
    uz_qp qp = {.p = vector(4), .h = vector(3)};
    qp.K = csc_from_dense(K, 4, 4, true);
    qp.N = csc_from_dense(N, 3, 4, false);
    for (int64_t j = 0; j < 4; j++)
        qp.p[j] = 1 + (double)j;
    check_scenario("floating springs", problem_of(qp), UZ_METHOD_AUTO, UZ_OPERATOR_AUTO, UZ_ORDERING_AMD, true);
}
