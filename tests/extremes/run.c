/* run.c: one problem, solved in every way, against its truth. */
#include "extremes.h"

#include "assembly/assembly.h"
#include "scene_norm.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const WAY_NAMES[WAYS] = {"default", "exact", "cached", "factored", "active", "free"};

static uz_settings settings_of(way how)
{
    uz_settings s = uz_settings_default();
    s.max_iterations = 20000;
    if (how == WAY_EXACT)
        s.relative_error = 0;
    if (how == WAY_ACTIVE)
        s.method = UZ_METHOD_ACTIVE_SET;
    if (how == WAY_FREE) {
        s.op = UZ_OPERATOR_MATRIX_FREE;
        s.max_iterations = 2000;
    }
    if (how == WAY_FACTORED) {
        s.method = UZ_METHOD_ACCELERATED_RESTART;
        s.op = UZ_OPERATOR_FACTORED;
        s.relative_error = 1e-6;
        s.max_iterations = 2000;
    }
    return s;
}

/* The outcome by name, "error NAME" for a call that failed. */
static const char *describe(char *room, size_t size, uz_status status, const uz_result *result)
{
    if (status != UZ_OK)
        return name_of(room, size, "error %s", uz_status_name(status));
    return uz_choice_name(UZ_CHOICE_OUTCOME, result->summary.outcome);
}

static bool is_missed(owed what, way how, uz_status status, const uz_result *result)
{
    bool plain = how == WAY_DEFAULT || how == WAY_CACHED;
    if (status == UZ_ERR_INTERNAL)
        return true;
    if (what == OWED_ERROR)
        return status == UZ_OK;
    if (how == WAY_FREE && status == UZ_ERR_NOT_SPD)
        return false;
    if (what == OWED_ANSWER)
        return status != UZ_OK || (plain && result->summary.outcome != UZ_CONVERGED);
    return what == OWED_PROOF && plain && (status != UZ_OK || result->summary.outcome != UZ_INFEASIBLE);
}

/* The displacements by dof. A scene's result lists them by node. */
static double *by_dof(const uz_result *result, const uz_body_model *model, int64_t d)
{
    double *u = calloc((size_t)d + 1, sizeof *u);
    if (!u)
        abort();
    if (!model)
        memcpy(u, result->u, (size_t)d * sizeof *u);
    else
        uz_restrict_nodal(u, model, result->u);
    return u;
}

typedef struct {
    suite *all;
    const char *family_name, *name;
    const uz_problem *problem;
    const uz_qp *qp;            /* NULL: the scene has no matrices */
    const uz_body_model *model; /* scene */
    owed what;
} task;

static void run_way(const task *t, const truth *known, way how, uz_cache *cache)
{
    char room[64];
    uz_result *result = NULL;
    uz_error err = {0};
    uz_settings settings = settings_of(how);
    judgement j = {.verdict = JUDGED_OK, .certified = NAN, .error = NAN, .floor = NAN, .ratio = NAN};
    uz_status status = uz_solve(&result, t->problem, &settings, cache, NULL, &err);
    if (status == UZ_OK && t->qp) {
        double *u = by_dof(result, t->model, t->qp->K.cols);
        j = judge(known, t->qp, result, u);
        free(u);
    } else if (status == UZ_OK) {
        j = condemn(j, "solved although there are no matrices");
    } else if (t->what != OWED_ERROR) {
        snprintf(j.why, sizeof j.why, "%.150s", err.message);
    }
    add_row(t->all, t->family_name, t->name, WAY_NAMES[how], describe(room, sizeof room, status, result), &j,
            is_missed(t->what, how, status, result));
    uz_result_free(result);
}

/* Rows that the default way finds in contact: a start for the reference. */
static bool *guess_contact(const uz_problem *problem, int64_t m)
{
    bool *touch = calloc((size_t)m + 1, sizeof *touch);
    uz_settings settings = settings_of(WAY_DEFAULT);
    uz_result *result = NULL;
    if (!touch)
        abort();
    if (uz_solve(&result, problem, &settings, NULL, NULL, NULL) == UZ_OK)
        for (int64_t i = 0; i < m; i++)
            touch[i] = result->r[i] < 0;
    uz_result_free(result);
    return touch;
}

static void run_ways(const task *t)
{
    truth known = {0};
    uz_cache *cache = uz_cache_new((size_t)1 << 26);
    if (t->qp) {
        bool *touch = guess_contact(t->problem, t->qp->N.rows);
        known = find_truth(t->qp, touch);
        if (t->model)
            take_whole_norm(&known, t->model, &t->problem->scene);
        free(touch);
    }
    run_way(t, &known, WAY_DEFAULT, cache);
    if (t->what != OWED_ERROR) {
        run_way(t, &known, WAY_EXACT, NULL);
        run_way(t, &known, WAY_CACHED, cache);
        run_way(t, &known, WAY_FACTORED, NULL);
        run_way(t, &known, WAY_ACTIVE, NULL);
        run_way(t, &known, WAY_FREE, NULL);
    }
    truth_clear(&known);
    uz_cache_free(cache);
}

void run_matrices(suite *all, const char *family_name, const char *name, uz_qp qp, owed what)
{
    uz_problem problem = {.kind = UZ_PROBLEM_MATRICES, .qp = qp};
    task t = {all, family_name, name, &problem, &problem.qp, NULL, what};
    if (wants_family(all, family_name))
        run_ways(&t);
    uz_problem_clear(&problem);
}

void run_scene(suite *all, const char *family_name, const char *name, uz_scene scene, owed what)
{
    uz_problem problem = {.kind = UZ_PROBLEM_SCENE, .scene = scene};
    uz_qp qp = {0};
    uz_body_model model = {0};
    if (wants_family(all, family_name)) {
        bool known = uz_body_model_build(&model, &scene, UZ_BODY_SUPPORTED, NULL) == UZ_OK &&
                     uz_scene_to_qp(&qp, NULL, &scene, NULL) == UZ_OK;
        task t = {all, family_name, name, &problem, known ? &qp : NULL, known ? &model : NULL, what};
        run_ways(&t);
    }
    uz_qp_clear(&qp);
    uz_body_model_clear(&model);
    uz_problem_clear(&problem);
}
