/* What a solve takes over from earlier ones with a body that is like its own but not the same. */
#include "run/setup_cache.h"
#include "certificate/certificate.h"
#include "body_fixture.h"
#include "harness.h"
#include "qp_fixture.h"
#include "scene_fixture.h"

/* Keeps the rows that `keep` names, from the first. */
static void keep_rows(uz_qp *qp, bool (*keep)(int64_t row))
{
    int64_t m = 0, at = 0, *row = calloc((size_t)qp->N.rows, sizeof *row);
    for (int64_t i = 0; i < qp->N.rows; i++) {
        row[i] = keep(i) ? m : -1;
        if (row[i] >= 0)
            qp->h[m++] = qp->h[i];
    }
    for (int64_t j = 0, k = 0; j < qp->N.cols; j++) {
        for (; k < qp->N.ptr[j + 1]; k++)
            if (row[qp->N.idx[k]] >= 0) {
                qp->N.idx[at] = (int32_t)row[qp->N.idx[k]];
                qp->N.val[at++] = qp->N.val[k];
            }
        qp->N.ptr[j + 1] = at;
    }
    qp->N.rows = m;
    free(row);
}

static bool every_third(int64_t row)
{
    return row % 3 == 0;
}

static bool all_but_every_third(int64_t row)
{
    return row % 3 != 0;
}

static uz_result *solve(uz_cache *cache, uz_qp qp, const uz_settings *settings)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = qp};
    uz_result *result = NULL;
    uz_error err = {0};
    CHECK_MSG(uz_solve(&result, &problem, settings, cache, NULL, &err) == UZ_OK, "%s", err.message);
    CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
    uz_problem_clear(&problem);
    return result;
}

/* Solves with the cache and without; the answers are within the certified errors of both, and `reused` is told. */
static void check_reuse(uz_cache *cache, uz_qp (*make)(void), bool ordering, bool factor, bool op)
{
    uz_settings settings = uz_settings_default();
    uz_result *with = solve(cache, make(), &settings), *without = solve(NULL, make(), &settings);
    uz_reuse reused = with->summary.reused;
    CHECK_INT(reused.ordering, ordering);
    CHECK_INT(reused.factor, factor);
    CHECK_INT(reused.op, op);
    CHECK_INT(with->summary.factor_cached, op);
    CHECK(!without->summary.reused.ordering && !without->summary.reused.factor && !without->summary.reused.op);
    CHECK_INT(with->summary.active, without->summary.active);
    double difference = 0, size = 0;
    for (int64_t j = 0; j < with->d; j++) {
        difference = fmax(difference, fabs(with->u[j] - without->u[j]));
        size = fmax(size, fabs(without->u[j]));
    }
    CHECK_MSG(difference <= 1e-7 * size, "differs by %g of %g", difference, size);
    if (ordering)
        CHECK(with->summary.timings.order == 0);
    if (factor)
        CHECK(with->summary.timings.factor == 0);
    uz_result_free(with);
    uz_result_free(without);
}

static uz_qp whole(void)
{
    return paper_qp(30, 200e3);
}

static uz_qp softer(void)
{
    return paper_qp(30, 120e3);
}

static uz_qp other_gaps(void)
{
    uz_qp qp = whole();
    for (int64_t i = 0; i < qp.N.rows; i++)
        qp.h[i] = 1e-5 * (double)(i % 4);
    return qp;
}

static uz_qp fewer_contacts(void)
{
    uz_qp qp = whole();
    keep_rows(&qp, all_but_every_third);
    return qp;
}

static uz_qp few_contacts(void)
{
    uz_qp qp = whole();
    keep_rows(&qp, every_third);
    return qp;
}

static uz_qp no_contacts(void)
{
    uz_qp qp = whole();
    qp.N.rows = 0;
    qp.N.ptr[qp.N.cols] = 0;
    memset(qp.N.ptr, 0, (size_t)(qp.N.cols + 1) * sizeof *qp.N.ptr);
    return qp;
}

TEST(what_is_alike_is_reused)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_thread_init();
    check_reuse(cache, whole, false, false, false);
    check_reuse(cache, whole, true, true, true);
    check_reuse(cache, other_gaps, true, true, true);
    check_reuse(cache, softer, true, false, false);        /* same pattern, other values */
    check_reuse(cache, fewer_contacts, true, true, false); /* same K, some of its contacts */
    check_reuse(cache, few_contacts, true, true, false);
    check_reuse(cache, no_contacts, true, true, false);
    check_reuse(cache, fewer_contacts, true, true, true);
    uz_cache_free(cache);
}

/* A factor with other dofs at its end serves a contact by the paths of its dofs. */
TEST(more_contacts_are_found_along_their_paths)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_thread_init();
    check_reuse(cache, few_contacts, false, false, false);
    check_reuse(cache, whole, true, true, false);
    check_reuse(cache, few_contacts, true, true, true);
    check_reuse(cache, softer, false, false, false);
    uz_cache_free(cache);
    cache = uz_cache_new(1 << 30);
    check_reuse(cache, no_contacts, false, false, false);
    check_reuse(cache, whole, true, true, false);
    check_reuse(cache, no_contacts, true, true, true);
    uz_cache_free(cache);
}

static void check_methods(uz_qp (*first)(void), uz_qp (*second)(void))
{
    static const uz_method methods[] = {UZ_METHOD_AUTO, UZ_METHOD_ACCELERATED_RESTART, UZ_METHOD_ACTIVE_SET};
    uz_thread_init();
    for (size_t k = 0; k < sizeof methods / sizeof methods[0]; k++) {
        uz_cache *cache = uz_cache_new(1 << 30);
        uz_settings settings = uz_settings_default();
        uz_result_free(solve(cache, first(), &settings));
        settings.method = methods[k];
        uz_result *result = solve(cache, second(), &settings);
        CHECK(result->summary.reused.factor);
        uz_result_free(result);
        uz_cache_free(cache);
    }
}

TEST(every_method_on_the_factor_of_another_contact)
{
    check_methods(whole, fewer_contacts);
    check_methods(few_contacts, whole);
    check_methods(few_contacts, fewer_contacts);
    check_methods(no_contacts, whole);
}

TEST(scenes_share_too)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_settings settings = uz_settings_default();
    uz_thread_init();
    for (int round = 0; round < 3; round++) {
        uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(12, 4)};
        problem.scene.materials[0].young = round < 2 ? 200e3 : 70e3;
        uz_result *result = NULL;
        uz_error err = {0};
        CHECK(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK);
        CHECK_INT(result->summary.reused.assembly, round == 1);
        CHECK_INT(result->summary.reused.op, round == 1);
        CHECK_INT(result->summary.reused.ordering, round > 0);
        uz_result_free(result);
        uz_problem_clear(&problem);
    }
    uz_cache_free(cache);
}

/* Bodies that share a factor, in a cache that holds nothing: the factor lives as long as one of them is in use. */
TEST(shared_factors_are_freed_once)
{
    uz_cache *cache = uz_cache_new(0);
    uz_thread_init();
    check_reuse(cache, whole, false, false, false);
    check_reuse(cache, whole, false, false, false);
    check_reuse(cache, fewer_contacts, false, false, false);
    uz_cache_entry *entries;
    size_t count = 7;
    uz_error err;
    CHECK_INT(uz_cache_list(cache, &entries, &count, &err), UZ_OK);
    CHECK_INT(count, 0);
    free(entries);
    uz_cache_free(cache);
}

static uz_result *solve_plate(uz_cache *cache, double relative_error, double load)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(160, 64)};
    uz_settings settings = uz_settings_default();
    uz_result *result = NULL;
    uz_error err = {0};
    settings.relative_error = relative_error;
    problem.scene.loads[1].v[0] = load;
    CHECK_MSG(uz_solve(&result, &problem, &settings, cache, NULL, &err) == UZ_OK, "%s", err.message);
    uz_problem_clear(&problem);
    return result;
}

/* Certificates on large factors spare a half solve where that is sharp enough; a job that asks for more gets it,
 * however many the body has served. */
TEST(spared_solves_are_done_for_those_who_ask_for_more)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_thread_init();
    for (int k = 0; k < 10; k++) {
        uz_result *result = solve_plate(cache, 1e-8, 0.5 + 0.01 * k);
        CHECK(result->summary.factor_nnz >= UZ_CERTIFY_SPARES && result->summary.outcome == UZ_CONVERGED);
        uz_result_free(result);
    }
    for (double asked = 1e-8; asked > 2e-12; asked *= 0.6) {
        uz_result *result = solve_plate(cache, asked, 0.5);
        const double reached = result->summary.certificate.relative_error;
        CHECK_MSG(result->summary.outcome == UZ_CONVERGED && reached <= asked && result->summary.refinements == 0,
                  "%g asked, %g reached", asked, reached);
        uz_result_free(result);
    }
    uz_cache_free(cache);
}

static double error_of_solid(int64_t cells, double asked, bool large)
{
    const double size[3] = {4, 4, 2};
    const int64_t along[3] = {cells, cells, cells / 2};
    uz_settings settings = uz_settings_default();
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = body_scene(UZ_SOLID, "hex8", size, along)};
    uz_result *result = NULL;
    uz_error err = {0};
    settings.op = UZ_OPERATOR_CONDENSED;
    settings.relative_error = asked;
    body_hold(&problem.scene, "left", 0, 0, 0);
    body_load(&problem.scene, UZ_LOAD_TRACTION, "top", 0, 0, -5);
    body_plane(&problem.scene, "bottom", (double[3]){0, 0, -1e-4}, (double[3]){0, 0, 1});
    CHECK_MSG(uz_solve(&result, &problem, &settings, NULL, NULL, &err) == UZ_OK, "%s", err.message);
    const double error = result->summary.certificate.relative_error;
    CHECK_INT(result->summary.factor_nnz >= UZ_CERTIFY_SPARES, large);
    CHECK_MSG(error <= asked, "%g", error);
    uz_result_free(result);
    uz_problem_clear(&problem);
    return error;
}

/* A solid's factor is large where a plane body of as many dofs has a small one: that is what sparing goes by. */
TEST(solids_spare_by_the_size_of_their_factor)
{
    uz_thread_init();
    CHECK(error_of_solid(16, 1e-8, true) > 3 * error_of_solid(16, 1e-13, true));
    CHECK(error_of_solid(6, 1e-8, false) == error_of_solid(6, 1e-13, false));
}

/* Above UZ_CERTIFY_SPARES: the rounding of the factor is so far from doubtful that nobody measures it, and the
 * certificate is the same from the first answer on. */
TEST(certificates_of_a_large_body)
{
    uz_cache *cache = uz_cache_new(1 << 30);
    uz_settings settings = uz_settings_default();
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = paper_scene(180, 60)};
    double first = 0;
    for (int k = 0; k < 4; k++) {
        uz_result *result = NULL;
        CHECK_INT(uz_solve(&result, &problem, &settings, cache, NULL, NULL), UZ_OK);
        const double error = result->summary.certificate.relative_error;
        first = k == 0 ? error : first;
        CHECK_STR(uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome), "converged");
        CHECK_MSG(error == first && result->summary.factor_nnz >= UZ_CERTIFY_SPARES, "%g, at first %g", error, first);
        uz_result_free(result);
    }
    uz_setup *setup = NULL;
    uz_reuse reused;
    CHECK_INT(uz_setup_acquire(&setup, &reused, cache, &problem, NULL, &settings, NULL, NULL), UZ_OK);
    CHECK(reused.op && isnan(setup->doubt));
    uz_setup_release(cache, setup);
    uz_problem_clear(&problem);
    uz_cache_free(cache);
}
