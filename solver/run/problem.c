/* problem.c: checks on a problem, and its load cases one by one. */
#include "run/problem.h"

#include "core/error.h"
#include "linalg/linalg.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_check_problem(const uz_problem *problem, uz_error *err)
{
    if (problem->n_cases < 0 || (problem->n_cases > 0 && !problem->cases))
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "the problem's load cases are missing");
    uz_status status = problem->kind == UZ_PROBLEM_MATRICES ? uz_qp_check(&problem->qp, err) : UZ_OK;
    const bool scene = problem->kind == UZ_PROBLEM_SCENE;
    for (int64_t i = 0; status == UZ_OK && i < problem->n_cases; i++) {
        const uz_load_case *one = &problem->cases[i];
        if (scene ? one->p || one->h : one->loads != NULL)
            status = uz_fail(err, UZ_ERR_ARGUMENT, "", "%s",
                             scene ? "a load case of a scene has loads, not p or h"
                                   : "a load case of a problem in matrices has p and h, not loads");
        if (status == UZ_OK)
            status = uz_check_finite(one->p, problem->qp.K.cols, "p", err);
        if (status == UZ_OK)
            status = uz_check_finite(one->h, problem->qp.N.rows, "h", err);
        if (status != UZ_OK)
            uz_error_name_case(err, i);
    }
    return status;
}

void uz_error_name_case(uz_error *err, int64_t i)
{
    char prefix[32];
    if (!err)
        return;
    bool pointer = err->where[0] == '/' || err->where[0] == '\0';
    size_t length = (size_t)snprintf(prefix, sizeof prefix, "/cases/%lld%s", (long long)i, pointer ? "" : "/");
    memmove(err->where + length, err->where, sizeof err->where - length);
    memcpy(err->where, prefix, length);
    err->where[sizeof err->where - 1] = '\0';
}

uz_scene uz_scene_of_case(const uz_problem *problem, int64_t i)
{
    uz_scene scene = problem->scene;
    if (i >= 0 && i < problem->n_cases && problem->cases[i].loads) {
        scene.loads = problem->cases[i].loads;
        scene.n_loads = problem->cases[i].n_loads;
    }
    return scene;
}

uz_problem uz_problem_of_case(const uz_problem *problem, int64_t i)
{
    uz_problem one = *problem;
    one.cases = NULL;
    one.n_cases = 0;
    one.scene = uz_scene_of_case(problem, i);
    if (problem->n_cases > 0 && problem->cases[i].p)
        one.qp.p = problem->cases[i].p;
    if (problem->n_cases > 0 && problem->cases[i].h)
        one.qp.h = problem->cases[i].h;
    return one;
}

void uz_problem_clear(uz_problem *problem)
{
    if (!problem)
        return;
    if (problem->kind == UZ_PROBLEM_SCENE)
        uz_scene_clear(&problem->scene);
    else
        uz_qp_clear(&problem->qp);
    for (int64_t i = 0; problem->cases && i < problem->n_cases; i++) {
        free(problem->cases[i].p);
        free(problem->cases[i].h);
        free(problem->cases[i].loads);
    }
    free(problem->cases);
    memset(problem, 0, sizeof *problem);
}
