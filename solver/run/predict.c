/* predict.c: what a solve will take, from the pattern of its matrices: nothing is factored. */
#include "core/error.h"
#include "dual/form.h"
#include "run/cost.h"
#include "dual/dual.h"
#include "factor/factor.h"
#include "run/rows.h"
#include "run/settings.h"
#include "uzawa.h"

#include <stdlib.h>

/* The form and what it takes, of K and N; the analysis of a factor where there is to be one. */
static uz_status predict(uz_prediction *out, const uz_csc *K, const uz_csc *N, int dim, int64_t cases,
                         const uz_settings *settings, const uz_hooks *hooks, uz_error *err)
{
    const size_t limit = settings->memory_limit;
    const bool free_asked = settings->op != UZ_OPERATOR_AUTO && !uz_dual_form_of(settings->op)->can.needs_factor;
    uz_cost_plan plan = {.chosen = -1};
    uz_analysis *analysis = NULL;
    int64_t *dofs = NULL, n_b = 0;
    uz_status status = uz_dual_contact_dofs(&dofs, &n_b, N, err);
    if (status != UZ_OK)
        return status;
    const uz_cost_size size = uz_cost_size_of(K, N, n_b, dim, cases, settings);
    const bool no_factor = free_asked || (limit > 0 && uz_cost_analysis_bytes(&size) > (double)limit);
    const uz_operator form = uz_dual_choose(N, n_b, no_factor ? UZ_OPERATOR_AUTO : settings->op);
    if (no_factor) {
        uz_cost_decide(&plan, &size, NULL, form, settings->op, limit);
    } else {
        int64_t last = uz_dual_form_of(form)->can.contact_last ? n_b : 0;
        int64_t rows = uz_cost_is_one_to_one(N, last) ? 0 : N->rows;
        status = uz_analysis_create(&analysis, K, dofs, last, rows, settings->ordering, hooks, err);
        if (status == UZ_OK) {
            uz_factor_info info = uz_analysis_describe(analysis);
            out->factor_nnz = info.nnz;
            uz_cost_decide(&plan, &size, &info, form, settings->op, limit);
        }
        uz_analysis_free(analysis);
    }
    free(dofs);
    if (status != UZ_OK)
        return status;
    const uz_cost_estimate *e = &plan.form[plan.chosen >= 0 ? plan.chosen : 0];
    out->fits = plan.chosen >= 0;
    out->op = e->op;
    out->bytes = e->bytes;
    out->seconds = e->setup_s + (double)(cases > 0 ? cases : 1) * e->case_s;
    if (!uz_dual_form_of(out->op)->can.needs_factor)
        out->factor_nnz = 0;
    return UZ_OK;
}

uz_status uz_predict(uz_prediction *out, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                     uz_error *err)
{
    uz_qp made = {.p = NULL};
    const uz_qp *qp = &problem->qp;
    bool scene = problem->kind == UZ_PROBLEM_SCENE;
    *out = (uz_prediction){.d = 0};
    uz_status status = uz_check_settings(settings, err);
    int64_t m = problem->qp.N.rows;
    if (status == UZ_OK && scene) {
        /* the matrices of a scene with the rows that its solve begins with */
        uz_mesh_info info = {0};
        uz_candidates rows = {0};
        uz_csc N = {0};
        status = uz_scene_to_qp(&made, &info, &problem->scene, err);
        m = made.N.rows;
        if (status == UZ_OK)
            status = uz_choose_rows(&rows, made.h, m, &info, &problem->scene, NULL, err);
        if (status == UZ_OK && rows.in) {
            status = uz_candidates_reduce(&N, &made.N, &rows, err);
            uz_csc_clear(&made.N);
            made.N = N;
        }
        uz_candidates_clear(&rows);
        uz_mesh_info_clear(&info);
        qp = &made;
    }
    if (status == UZ_OK) {
        out->d = qp->K.cols;
        out->m = m;
        status =
            predict(out, &qp->K, &qp->N, scene ? problem->scene.box.dim : 0, problem->n_cases, settings, hooks, err);
    }
    uz_qp_clear(&made);
    return status;
}
