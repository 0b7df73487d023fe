/* Solves by other processes: what is certified holds whatever they answer. Small systems that were once certified
 * wrongly (K = diag(2, 1), whose multigrid had one level that left a dof alone), by a stand-in and by uzawa-group.
 * in the ordinary build too, by_processes: MPI and PETSc are not made for sanitizers */
#include "core/aside.h"
#include "dual/form.h"
#include "group/group.h"
#include "harness.h"
#include "qp_fixture.h"
#include "sanitized.h"
#include "stand_in.h"
#include "work/group_process.h"

#include <limits.h>
#include <poll.h>

__attribute__((constructor)) static void settle_threads(void)
{
    uz_process_init(2);
}

static uz_process_group *group_of(void *ctx, char *why, size_t size)
{
    (void)why;
    (void)size;
    return ctx;
}

static uz_status solve_by(uz_result **result, const uz_problem *problem, uz_operator op, uz_process_group *group,
                          uz_error *err)
{
    uz_settings settings = uz_settings_default();
    const uz_hooks hooks = {.ctx = group, .group = group_of};
    settings.op = op;
    settings.relative_error = 1e-8;
    return uz_solve(result, problem, &settings, NULL, group ? &hooks : NULL, err);
}

static double distance(const uz_csc *K, const double *u, const double *v)
{
    double *e = vector(K->cols), *Ke = vector(K->cols), sum = 0.0;
    for (int64_t j = 0; j < K->cols; j++)
        e[j] = u[j] - v[j];
    uz_csc_symv(Ke, K, 1.0, e);
    for (int64_t j = 0; j < K->cols; j++)
        sum += e[j] * Ke[j];
    free(e);
    free(Ke);
    return sqrt(fmax(0.0, sum));
}

typedef enum { MUST_CONVERGE, MAY_END, MUST_FAIL } expectation;

/* Takes the problem. Whatever comes out, its bound covers its distance from the answer by a factor. */
static void check_problem(const char *name, uz_qp qp, uz_process_group *group, expectation wanted)
{
    uz_problem problem = problem_of(qp);
    uz_result *exact = NULL, *got = NULL;
    uz_error err = {0};
    CHECK_MSG(solve_by(&exact, &problem, UZ_OPERATOR_CONDENSED, NULL, &err) == UZ_OK, "%s: %s", name, err.message);
    const uz_status status = solve_by(&got, &problem, UZ_OPERATOR_DISTRIBUTED, group, &err);
    if (wanted == MUST_FAIL)
        CHECK_MSG(status == UZ_ERR_INTERNAL || status == UZ_ERR_UNSUPPORTED || status == UZ_ERR_NOT_SPD,
                  "%s: status %d", name, (int)status);
    if (wanted == MUST_CONVERGE)
        CHECK_MSG(status == UZ_OK && got->summary.outcome == UZ_CONVERGED, "%s: %s, outcome %d, error %g", name,
                  err.message, got ? (int)got->summary.outcome : -1,
                  got ? got->summary.certificate.relative_error : NAN);
    if (status == UZ_OK && exact) {
        const double off = distance(&problem.qp.K, got->u, exact->u), bound = got->summary.certificate.absolute_error,
                     slack = exact->summary.certificate.absolute_error;
        CHECK_MSG(off <= bound + slack, "%s: off by %g, certified %g", name, off, bound);
    }
    uz_result_free(exact);
    uz_result_free(got);
    uz_problem_clear(&problem);
}

/* Dofs that nothing couples, the first of them against an obstacle. */
static uz_qp diagonal(int64_t d, const double *stiffness)
{
    double *K = vector(d * d), *N = vector(d);
    uz_qp qp = {.p = vector(d), .h = vector(1)};
    for (int64_t j = 0; j < d; j++) {
        K[j * d + j] = stiffness[j];
        qp.p[j] = stiffness[j] * (1.0 + 0.5 * (double)j);
    }
    N[0] = 1.0;
    qp.h[0] = 0.25;
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, 1, d, false);
    free(K);
    free(N);
    return qp;
}

static void check_small_systems(uz_process_group *group, expectation wanted)
{
    static const double SPREAD[] = {1e-6, 1.0, 1e6, 1e3, 1e-3}, TWO[] = {2.0, 1.0}, THREE[] = {3.0, 5.0, 7.0};
    qp_random rng = {7};
    check_problem("1 x 1", diagonal(1, TWO), group, wanted);
    check_problem("diag(2, 1)", diagonal(2, TWO), group, wanted);
    check_problem("3 x 3", diagonal(3, THREE), group, wanted);
    check_problem("a spread of 1e12", diagonal(5, SPREAD), group, wanted);
    check_problem("springs", random_obstacle(&rng, 17, 1), group, wanted);
    for (int64_t d = 2; d <= 22; d += 4)
        check_problem("random", random_qp(&rng, &(qp_kind){.d = d, .m = 1 + d / 4, .condition = 10.0 * (double)d}),
                      group, wanted);
    /* steps in single precision lead nowhere there */
    check_problem("ill-conditioned", random_qp(&rng, &(qp_kind){.d = 10, .m = 2, .condition = 1e6}), group, wanted);
}

/* As a bound on lambda_max(diag(K)^-1 M): what is said of a residual is then possible whatever it is. */
#define ANYTHING 1e12

/* A group ends with what it holds, so that each problem has one of its own. */
static void check_stand_in(stand_in_fault fault, int honest_solves, double most, expectation wanted)
{
    static const double TWO[] = {2.0, 1.0}, FOUR[] = {1.0, 2.0, 1.0, 9.0};
    for (int k = 0; k < 4; k++) {
        stand_in *s = malloc(sizeof *s);
        uz_process_group *group = uz_process_group_new(stand_in_start(s, fault, honest_solves, most));
        qp_random rng = {11};
        uz_qp qp = k == 0   ? diagonal(2, TWO)
                   : k == 1 ? diagonal(4, FOUR)
                   : k == 2 ? random_obstacle(&rng, 12, 1)
                            : random_qp(&rng, &(qp_kind){.d = 10, .m = 3, .condition = 20});
        char name[64];
        snprintf(name, sizeof name, "fault %d after %d solves, problem %d", (int)fault, honest_solves, k);
        check_problem(name, qp, group, wanted);
        uz_process_group_free(group);
        pthread_join(s->thread, NULL);
        free(s);
    }
}

TEST(an_honest_group_gives_certified_answers)
{
    stand_in *s = malloc(sizeof *s);
    uz_process_group *group = uz_process_group_new(stand_in_start(s, STAND_IN_HONEST, 0, 1.0));
    check_small_systems(group, MUST_CONVERGE);
    uz_process_group_free(group);
    pthread_join(s->thread, NULL);
    free(s);
}

/* More of them than threads, some without a node: rows come as threads have made them, of each process in order. */
TEST(rows_of_many_processes_are_made_by_threads)
{
    CHECK(uz_aside_begin(3) >= 1);
    uz_aside_allow(3);
    stand_in *s = malloc(sizeof *s);
    const int stream = stand_in_start_many(s, UZ_ASIDE_MOST + 3, STAND_IN_HONEST, 0, 1.0);
    uz_process_group *group = uz_process_group_new(stream);
    check_small_systems(group, MUST_CONVERGE);
    uz_process_group_free(group);
    pthread_join(s->thread, NULL);
    free(s);
}

/* From the first solve on, which is that of a random load. */
TEST(solves_that_are_not_those_of_K_are_refused)
{
    check_stand_in(STAND_IN_DROPS, 0, 1.0, MUST_FAIL);
    check_stand_in(STAND_IN_LIES, 0, 1.0, MUST_FAIL);
    check_stand_in(STAND_IN_SOFTER, 0, 1.0, MUST_FAIL);
    check_stand_in(STAND_IN_SHIFTS, 0, 1.0, MUST_FAIL);
    check_stand_in(STAND_IN_NEGATIVE, 0, 1.0, MUST_FAIL);
    check_stand_in(STAND_IN_SKEW, 0, 1.0, MAY_END);
    check_stand_in(STAND_IN_DROPS, 0, ANYTHING, MUST_FAIL);
    check_stand_in(STAND_IN_LIES, 0, ANYTHING, MUST_FAIL);
}

/* The bound at the end takes nobody's word either. */
TEST(solves_that_go_wrong_later_are_not_certified)
{
    enum { FAULTS = STAND_IN_NEGATIVE - STAND_IN_DROPS + 1, SOLVES = 7 };
    for (int k = 0; k < FAULTS * SOLVES * 2; k += step_of_cases())
        check_stand_in((stand_in_fault)(STAND_IN_DROPS + k / 2 / SOLVES), 2 + k / 2 % SOLVES,
                       k % 2 == 0 ? 1.0 : ANYTHING, MAY_END);
}

/* A body on a stand-in, with a load and no rows. */
typedef struct {
    stand_in *s;
    uz_process_group *group;
    uz_qp qp;
    uz_amg *amg;
    uz_csc no_rows;
    uz_dual *dual;
    uz_dual_load *load;
    double none;
} far_body;

static void far_begin(far_body *b, double weak)
{
    uz_error err = {0};
    uz_modes modes;
    uz_multigrid *mg;
    double rounding;
    qp_random rng = {5};
    memset(b, 0, sizeof *b);
    b->s = malloc(sizeof *b->s);
    b->group = uz_process_group_new(stand_in_start(b->s, STAND_IN_HONEST, 0, fmax(1.0, weak)));
    b->s->weak = weak;
    b->qp = random_qp(&rng, &(qp_kind){.d = 40, .m = 1, .condition = 300.0});
    CHECK(uz_csc_init(&b->no_rows, 0, 40, 0, &err) == UZ_OK);
    CHECK(uz_modes_of_matrix(&modes, &b->qp.K, &err) == UZ_OK);
    CHECK(uz_group_multigrid(&mg, b->group, &b->qp.K, &modes, &err) == UZ_OK);
    uz_modes_clear(&modes);
    CHECK(uz_amg_rounding(&rounding, &b->qp.K, &err) == UZ_OK && rounding > 0.0);
    CHECK(uz_group_await(mg, &err) == UZ_OK);
    CHECK(uz_amg_of_definite(&b->amg, mg, &err) == UZ_OK);
    uz_amg_trials *trials = uz_amg_draw(&b->qp.K);
    CHECK_MSG(uz_amg_probe(b->amg, trials, rounding, NULL, &err) == UZ_OK, "%s", err.message);
    uz_amg_trials_free(trials);
    const uz_dual_source source = {.op = UZ_OPERATOR_DISTRIBUTED, .N = &b->no_rows, .amg = b->amg};
    CHECK(uz_dual_create(&b->dual, &source, NULL, &err) == UZ_OK);
    CHECK(uz_dual_load_create(&b->load, b->dual, &b->qp.K, b->qp.p, &b->none, &err) == UZ_OK);
}

static void far_end(far_body *b)
{
    uz_dual_load_free(b->load);
    uz_dual_free(b->dual);
    uz_amg_free(b->amg);
    uz_csc_clear(&b->no_rows);
    uz_process_group_free(b->group);
    pthread_join(b->s->thread, NULL);
    free(b->s);
    uz_qp_clear(&b->qp);
}

/* Its bound on e'K^-1 e, e = K w for a w whose energy is `exact`, and the steps that it takes. */
static double bound_of(far_body *b, int which, double enough, double *exact, int64_t *steps)
{
    const int64_t d = b->qp.K.cols, before = b->s->steps;
    double *w = vector(d), *e = vector(d), value = NAN;
    uz_error err = {0};
    qp_random rng = {(uint64_t)which};
    *exact = 0.0;
    for (int64_t j = 0; j < d; j++)
        w[j] = random_signed(&rng);
    uz_csc_symv(e, &b->qp.K, 1.0, w);
    for (int64_t j = 0; j < d; j++)
        *exact += w[j] * e[j];
    CHECK(b->dual->form->inverse_norm(b->load, &value, e, enough * *exact, &err) == UZ_OK);
    CHECK_MSG(value >= *exact * (1.0 - 1e-12), "%.17g for %.17g", value, *exact);
    *steps = b->s->steps - before;
    free(w);
    free(e);
    return value;
}

TEST(a_bound_is_as_sharp_as_it_has_to_be_and_found_once)
{
    far_body b;
    double exact;
    int64_t sharp, blunt, steps;
    far_begin(&b, 1.0);
    const double first = bound_of(&b, 17, 0.0, &exact, &sharp);
    CHECK_MSG(first <= 1.02 * exact, "%g for %g", first, exact);
    CHECK(bound_of(&b, 17, 0.0, &exact, &steps) == first);
    CHECK_INT(steps, 0);
    CHECK(bound_of(&b, 18, 100.0, &exact, &blunt) <= 100.0 * exact);
    CHECK_MSG(blunt < sharp, "%lld and %lld steps", (long long)blunt, (long long)sharp);
    CHECK(bound_of(&b, 18, 200.0, &exact, &steps) <= 200.0 * exact); /* it was good enough for less */
    CHECK_INT(steps, 0);
    CHECK(bound_of(&b, 18, 0.0, &exact, &steps) <= 1.02 * exact); /* but not for this */
    CHECK(steps > 0);
    far_end(&b);
}

/* The norm that steps stop by says nothing of diag(K): two trials do all the same. */
TEST(trials_go_on_until_their_residuals_are_small)
{
    far_body b[2];
    far_begin(&b[0], 1.0);
    far_begin(&b[1], 1e16);
    CHECK_MSG(b[1].amg->info.least >= 0.1 * b[0].amg->info.least, "%g and %g", b[1].amg->info.least,
              b[0].amg->info.least);
    far_end(&b[0]);
    far_end(&b[1]);
}

/* Only where rounding may have led the recurrence away from it. */
TEST(a_residual_is_found_anew_where_steps_may_have_drifted)
{
    static const double RELATIVE[] = {1e-4, 1e-13};
    far_body b;
    far_begin(&b, 1.0);
    for (int k = 0; k < 2; k++) {
        double *x = vector(b.qp.K.cols);
        const int64_t before = b.s->again;
        const uz_cg_stop stop = {.relative = RELATIVE[k], .max_iterations = 1000, .deadline = INFINITY};
        uz_cg cg;
        uz_cg_info info;
        uz_error err = {0};
        CHECK(uz_cg_init(&cg, b.amg->mg, &err) == UZ_OK);
        CHECK(uz_cg_solve(&info, x, &cg, &b.qp.K, b.qp.p, &stop, &err) == UZ_OK);
        CHECK(info.met && info.last <= RELATIVE[k] * info.first);
        CHECK(k == 0 ? b.s->again == before : b.s->again > before);
        uz_cg_clear(&cg);
        free(x);
    }
    far_end(&b);
}

/* With a positive diagonal, and a negative eigenvalue between the others. */
static uz_qp indefinite(qp_random *rng, int64_t d)
{
    double *K = random_spd(rng, d, 10, 1), *v = vector(d), *N = vector(d), square = 0.0, work = 0.0;
    uz_qp qp = {.p = vector(d), .h = vector(1)};
    for (int64_t i = 0; i < d; i++) {
        v[i] = random_unit(rng) < 0.5 ? -1.0 : 1.0;
        square += v[i] * v[i];
        qp.p[i] = random_signed(rng);
    }
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++)
            work += v[i] * K[i * d + j] * v[j];
    for (int64_t i = 0; i < d; i++)
        for (int64_t j = 0; j < d; j++)
            K[i * d + j] -= 1.2 * work / square / square * v[i] * v[j];
    N[0] = 1.0;
    qp.h[0] = 0.1;
    qp.K = csc_from_dense(K, d, d, true);
    qp.N = csc_from_dense(N, 1, d, false);
    free(K);
    free(v);
    free(N);
    return qp;
}

TEST(an_indefinite_K_is_refused)
{
    qp_random rng = {3};
    for (int k = 0; k < 12; k++) {
        stand_in *s = malloc(sizeof *s);
        uz_process_group *group = uz_process_group_new(stand_in_start(s, STAND_IN_HONEST, 0, 1.0));
        uz_problem problem = problem_of(indefinite(&rng, 4 + 4 * k));
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK_INT(solve_by(&result, &problem, UZ_OPERATOR_DISTRIBUTED, group, &err), UZ_ERR_NOT_SPD);
        uz_result_free(result);
        uz_problem_clear(&problem);
        uz_process_group_free(group);
        pthread_join(s->thread, NULL);
        free(s);
    }
}

/* ---- the program itself */

/* Where uzawa-group is, beside the folder of this program; false: it was not built. */
static bool find_program(void)
{
    char path[PATH_MAX], rest[2 * PATH_MAX + 32];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof path - 1);
    path[length > 0 ? length : 0] = '\0';
    for (int k = 0; k < 2; k++) {
        char *slash = strrchr(path, '/');
        if (!slash)
            return false;
        *slash = '\0';
    }
    snprintf(rest, sizeof rest, "%s/uzawa-group", path);
    if (access(rest, X_OK) != 0 || system("command -v mpirun >/dev/null") != 0)
        return false;
    const char *before = getenv("PATH");
    snprintf(rest, sizeof rest, "%s:%s", path, before ? before : "/usr/bin:/bin");
    setenv("PATH", rest, 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    setenv("OMPI_MCA_btl_vader_single_copy_mechanism", "none", 1);
    return true;
}

static void check_program(const char *command)
{
    group_process process = {0};
    CHECK(group_process_begin(&process, command, NULL));
    struct pollfd waiting = {.fd = process.listener, .events = POLLIN};
    CHECK(poll(&waiting, 1, 60000) == 1);
    const int stream = group_process_accept(&process);
    CHECK(stream >= 0);
    uz_process_group *group = uz_process_group_new(stream);
    check_small_systems(group, MUST_CONVERGE);
    uz_process_group_free(group);
    group_process_reap(&process);
}

TEST(small_systems_by_processes)
{
    if (SANITIZED || !find_program()) {
        test_skip("uzawa-group needs PETSc and Open MPI (make deps-group), and no sanitizer");
        return;
    }
    check_program("exec mpirun --oversubscribe -n 1 {program}");
    check_program("exec mpirun --oversubscribe -n 2 {program}");
}
