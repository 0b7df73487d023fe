/* verify.c: the certificate of an answer that somebody else made. */
#include "run/setup_cache.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "core/vector3.h"
#include "linalg/linalg.h"
#include "run/problem.h"
#include "run/run.h"
#include "run/settings.h"
#include "run/solve.h"
#include "scene/scene.h"

#include <math.h>
#include <string.h>

/* What a component of a rigid node's displacement has to be: by the motion that the anchors of its group tell, but for
 * what is prescribed of it. */
static double rigid_at(const uz_run *run, const double *u, int64_t node, int c)
{
    const uz_body_model *model = &run->asked->setup->model;
    const uz_support *supports = run->asked->problem->scene.supports;
    const uz_rigid_group *group = uz_rigid_group_of(model, node);
    const uz_support *support = &supports[group->support];
    double t[3], w[3], r[3] = {0}, turned[3];
    uz_rigid_motion(t, w, model, group, NULL, u);
    for (int k = 0; k < 3; k++) {
        t[k] = isnan(support->u[k]) ? t[k] : ldexp(support->u[k], -run->load.exponent);
        w[k] = isnan(support->turn[k]) ? w[k] : ldexp(support->turn[k], -run->load.exponent);
        r[k] = k < model->mesh.dim ? model->mesh.xyz[node * model->mesh.dim + k] - group->point[k] : 0;
    }
    if (model->kind == UZ_AXISYMMETRIC)
        return c == 1 ? t[1] : 0;
    uz_cross3(turned, w, r);
    return t[c] + turned[c];
}

/* The free dofs of a nodal u. Supported ones must be where the scene holds them, and hanging nodes where those are that
 * they lie amid: the error that is bounded is one among displacements that do so, and no other has an energy that could
 * be compared. */
static uz_status take_nodal(uz_run *run, const double *u, uz_error *err)
{
    const uz_body_model *model = &run->asked->setup->model;
    int dim = model->mesh.dim;
    uz_restrict_nodal(run->answer.u, model, u);
    for (int64_t i = 0; i < model->mesh.n_nodes * dim; i++) {
        int64_t dof = model->dof[i], node = i / dim;
        double given = uz_along_dof(model, node, (int)(i % dim), u + node * dim);
        double rounding = 2 * uz_turning_error(model, node, u); /* there and back */
        const double held = uz_is_rigid(model, node) ? rigid_at(run, u, node, (int)(i % dim))
                            : dof == UZ_NO_DOF && uz_is_tied(model, node)
                                ? uz_tied_along(model, node, (int)(i % dim), u)
                            : dof == UZ_NO_DOF ? uz_mesh_value_amid(&model->mesh, node, u + i % dim, dim)
                            : dof < 0          ? ldexp(run->load.prescribed[-1 - dof], -run->load.exponent)
                                               : given;
        if (!(fabs(given - held) <= rounding) && uz_is_rigid(model, node))
            return uz_fail(err, UZ_ERR_SCENE, "u",
                           "node %lld is of a rigid group: as the group is held and moves, its displacement along %s "
                           "must be %.17g, it is given as %.17g",
                           (long long)node, uz_dof_name(model, node, (int)(i % dim)), held, given);
        if (!(fabs(given - held) <= rounding) && dof == UZ_NO_DOF && uz_is_tied(model, node))
            return uz_fail(err, UZ_ERR_SCENE, "u",
                           "node %lld is tied: its displacement along %s must be %.17g, it is given as %.17g",
                           (long long)node, uz_dof_name(model, node, (int)(i % dim)), held, given);
        if (!(fabs(given - held) <= rounding) && dof == UZ_NO_DOF)
            return uz_fail(err, UZ_ERR_SCENE, "u",
                           "node %lld hangs amid others: its displacement along %s must be %.17g, it is given as %.17g",
                           (long long)node, uz_dof_name(model, node, (int)(i % dim)), held, given);
        if (!(fabs(given - held) <= rounding))
            return uz_fail(err, UZ_ERR_SCENE, "u",
                           "node %lld is supported: its displacement along %s must be %.17g, it is given as %.17g",
                           (long long)node, uz_dof_name(model, node, (int)(i % dim)), held, given);
    }
    return UZ_OK;
}

/* Certifies u and r on the setup of the run. The certificate cuts reactions at 0; the result shows what was given. */
static uz_status verify(uz_run *run, const double *u, const double *r, uz_error *err)
{
    const uz_request *asked = run->asked;
    const uz_setup *setup = asked->setup;
    const uz_mesh *mesh = &setup->model.mesh;
    const size_t size_r = (size_t)run->all * sizeof *r;
    uz_summary *summary = &run->result->summary;
    uz_answer *answer = &run->answer;
    uz_certify_input input;
    uz_status status = uz_run_load(run, err);
    if (status == UZ_OK)
        status = uz_answer_allocate(answer, run->d, run->all, err);
    const int64_t n_u = setup->is_scene ? mesh->n_nodes * mesh->dim : run->d;
    if (status == UZ_OK && ((n_u > 0 && !u) || (run->all > 0 && !r)))
        status = uz_fail(err, UZ_ERR_ARGUMENT, u ? "r" : "u", "there is no %s to verify", u ? "r" : "u");
    if (status == UZ_OK)
        status = uz_check_finite(u, n_u, "u", err);
    if (status == UZ_OK)
        status = uz_check_finite(r, run->all, "r", err);
    if (status == UZ_OK && setup->is_scene)
        status = take_nodal(run, u, err);
    else if (status == UZ_OK)
        memcpy(answer->u, u, (size_t)run->d * sizeof *u);
    if (status == UZ_OK && size_r > 0)
        memcpy(answer->r, r, size_r);
    if (status == UZ_OK)
        uz_run_scale_given(run);
    double start = uz_seconds();
    if (status == UZ_OK && setup->amg) /* its certificate solves with what a load keeps */
        status = uz_dual_load_create(&run->work.dual, setup->dual, uz_setup_K(setup, asked->problem), run->load.p,
                                     run->load.h, err);
    if (status == UZ_OK && asked->settings->balanced && setup->is_scene)
        status = uz_balance_request(&run->work.requested, &setup->model, &asked->problem->scene, answer->u,
                                    run->load.prescribed, run->load.exponent, err);
    if (status == UZ_OK)
        status = uz_run_certify_input(&input, run, answer, err);
    if (status == UZ_OK)
        status = uz_certify(&answer->certificate, answer->r, answer->g, answer->u, &input, err);
    summary->timings.certify = uz_seconds() - start;
    if (status != UZ_OK)
        return status;
    uz_run_restore_units(run);
    summary->certificate = answer->certificate;
    if (size_r > 0)
        memcpy(answer->r, r, size_r);
    uz_milestones_resume(&run->work.milestones, uz_run_time(run));
    uz_milestones_pause(&run->work.milestones);
    uz_milestones_note(&run->work.milestones, UZ_MILESTONE_OF_CERTIFICATE, summary->certificate.relative_error, 0, 0);
    summary->outcome = summary->certificate.relative_error <= run->work.requested ? UZ_VERIFIED : UZ_NOT_VERIFIED;
    summary->method = UZ_METHOD_GIVEN;
    summary->alpha = NAN;
    summary->lambda_max = NAN;
    return uz_report_answer(run, err);
}

uz_status uz_verify(uz_result **out, const uz_problem *problem, const double *u, const double *r,
                    const uz_settings *settings, uz_cache *cache, const uz_hooks *hooks, uz_error *err)
{
    uz_run run = {.asked = NULL};
    uz_request asked = {.problem = problem, .settings = settings, .hooks = hooks};
    *out = NULL;
    uz_error_reset(err);
    if (problem->kind == UZ_PROBLEM_SCENE && problem->scene.kinematics == UZ_KINEMATICS_MOVING)
        return uz_fail(err, UZ_ERR_SCENE, "/kinematics",
                       "an answer is verified with its contacts as they are before anything moves: ask for \"fixed\"");
    if (problem->kind == UZ_PROBLEM_SCENE &&
        (problem->scene.kinematics == UZ_KINEMATICS_FINITE || uz_has_finite_law(&problem->scene)))
        return uz_fail(
            err, UZ_ERR_SCENE, "/kinematics",
            "answers of finite kinematics are certified where they are made only: ask for \"fixed\", and for "
            "linear laws");
    if (problem->n_cases > 0)
        return uz_fail(err, UZ_ERR_ARGUMENT, "/cases", "an answer to one load is verified, not to load cases");
    uz_status status = uz_check_settings(settings, err);
    if (status == UZ_OK)
        status = uz_check_problem(problem, err);
    if (status == UZ_OK && uz_cancelled(hooks))
        status = uz_fail(err, UZ_ERR_CANCELLED, "", "cancelled before it began");
    if (status != UZ_OK)
        return status;
    asked.started = uz_seconds();
    asked.deadline = asked.started + settings->time_limit_s;
    status = uz_setup_acquire(&asked.setup, &asked.reused, cache, problem, NULL, settings, hooks, err);
    if (status == UZ_OK)
        status = uz_run_begin(&run, &asked, err);
    if (status == UZ_OK)
        status = verify(&run, u, r, err);
    if (status == UZ_OK && !problem->scene.refine)
        status = uz_look_at_few_elements(&run.result, problem, settings, cache, hooks, asked.started, err);
    if (status == UZ_OK) {
        *out = run.result;
        run.result = NULL;
    }
    uz_run_end(&run);
    uz_setup_release(cache, asked.setup);
    return status;
}
