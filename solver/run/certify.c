/* certify.c: the certificate of what a run has: its input, answers from reactions, and proofs that there is none. */
#include "run/run.h"
#include "dual/form.h"

#include "certificate/infeasible.h"
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/blas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

uz_status uz_run_recover(uz_run *run, uz_answer *answer, const double *r, bool with_correction, uz_error *err)
{
    const double *scale = run->work.dual->dual->row_scale;
    uz_status status = uz_dual_load_recover(run->work.dual, answer->u, r, with_correction, err);
    for (int64_t i = 0; i < answer->m; i++)
        answer->r[i] = scale[i] * r[i];
    if (status == UZ_OK && answer == &run->answer) {
        /* The certificate looks at K, N and loads, the estimate of the mesh's error at each element: they don't need
         * each other. Loads in other units are left out: u is not yet what is told. */
        const uz_request *asked = run->asked;
        const uz_scene scene = uz_scene_of_case(asked->problem, asked->index);
        const bool may = asked->setup->is_scene && !asked->in_block && run->load.exponent == 0;
        uz_ahead_free(run->work.ahead);
        run->work.ahead =
            may ? uz_ahead_start(&asked->setup->model, &scene, run->answer.u, run->load.prescribed) : NULL;
    }
    return status;
}

uz_status uz_run_certify_answer(uz_run *run, uz_answer *answer, uz_error *err)
{
    uz_certify_input input;
    uz_status status = uz_run_certify_input(&input, run, answer, err);
    if (status == UZ_OK)
        status = uz_certify(&answer->certificate, answer->r, answer->g, answer->u, &input, err);
    return status;
}

/* Stiffnesses that differ by no more: their roots are in energy norms. */
#define ALIKE 100

/* e'K^-1 e = ||L^-1 P e||^2: half a linear solve. Without a factor it is the operator's affair. */
static uz_status inverse_norm(void *ctx, double *value, double *e, double enough, uz_error *err)
{
    (void)enough;
    uz_run *run = ctx;
    const uz_factor *factor = run->asked->setup->factor;
    double *x = run->work.scratch;
    uz_factor_permute(factor, x, e);
    uz_status status = uz_factor_solve_one(factor, run->work.ws, x, true, err);
    const double norm = uz_norm(run->d, x);
    *value = norm * norm;
    return status;
}

static uz_status measure_doubt(void *ctx, double *doubt, uz_error *err)
{
    uz_run *run = ctx;
    const uz_request *asked = run->asked;
    const uz_stop stop = {asked->hooks, asked->deadline};
    return uz_setup_doubt(asked->setup, doubt, uz_setup_K(asked->setup, asked->problem), &stop, err);
}

/* Are all elements about as stiff, and is nothing as soft as a spring? Else what one of them is pressed by would be
 * rounding beside the motion of the others. */
static bool is_alike(const uz_body_model *model)
{
    double least = INFINITY, most = 0;
    for (int64_t k = 0; k < model->n_materials; k++) {
        const double stiffness = uz_most_stiffness(model->materials[k].lame);
        least = fmin(least, stiffness);
        most = fmax(most, stiffness);
    }
    return !model->spring && most <= ALIKE * least;
}

uz_acting uz_run_acting(const uz_run *run, const uz_csc *N, const double *h, const double *u)
{
    const uz_load_vectors *load = &run->load;
    if (load->loaded)
        return UZ_ACTING_LOADS;
    if (!load->moved || !uz_may_press(N, h, u))
        return UZ_ACTING_NOTHING;
    const uz_body_model *model = &run->asked->setup->model;
    return is_alike(model) && uz_is_together(model, N, h, u) ? UZ_ACTING_ROWS : UZ_ACTING_LOADS;
}

uz_status uz_run_certify_input(uz_certify_input *input, uz_run *run, const uz_answer *answer, uz_error *err)
{
    const uz_request *asked = run->asked;
    uz_setup *setup = asked->setup;
    const uz_csc *K = uz_setup_K(setup, asked->problem);
    const bool all_rows = answer->m == run->all;
    double whole_norm = 0.0;
    uz_work *work = &run->work;
    if (!work->ws) /* loads of a block may need no linear solve */
        work->ws = uz_factor_workspace_new();
    if (!work->scratch && setup->factor)
        work->scratch = uz_alloc(run->d, sizeof(double));
    if (!work->ws || (setup->factor && !work->scratch))
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer on %lld dofs", (long long)run->d);
    const uz_status status =
        run->load.moved ? uz_whole_norm(&whole_norm, &setup->model, answer->u, run->load.prescribed, err) : UZ_OK;
    if (status != UZ_OK)
        return status;
    const uz_csc *N = all_rows ? uz_setup_all_rows(setup, asked->problem) : uz_setup_N(setup, asked->problem);
    const double *h = all_rows ? run->load.h_all : run->load.h;
    *input = (uz_certify_input){
        .K = K,
        .brick = setup->model.brick,
        .N = N,
        .p = run->load.p,
        .h = h,
        .inverse_norm = setup->factor ? inverse_norm : setup->dual->form->inverse_norm,
        .measure_doubt = setup->factor ? measure_doubt : NULL,
        .ctx = setup->factor ? (void *)run : (void *)work->dual,
        .terms = setup->terms,
        .rcond = run->result->summary.rcond,
        .inverse_bound = setup->factor ? uz_factor_describe(setup->factor).inverse_bound : INFINITY,
        .spares = setup->factor && uz_factor_describe(setup->factor).nnz >= UZ_CERTIFY_SPARES,
        .moved = run->load.moved,
        .acting = uz_run_acting(run, N, h, answer->u),
        .whole_norm = whole_norm,
        .sharp = 0.5 * run->work.requested,
    };
    return UZ_OK;
}

uz_status uz_run_check_ray(uz_run *run, uz_error *err)
{
    uz_iterate *it = &run->work.it;
    const uz_csc *N = uz_setup_N(run->asked->setup, run->asked->problem);
    const double *scale = run->work.dual->dual->row_scale, *g0 = run->work.dual->g0;
    for (int64_t i = 0; i < run->m; i++) {
        it->ray[i] *= scale[i];
        it->r_next[i] = g0[i] / scale[i];
    }
    run->work.end = UZ_END_UNDECIDED;
    return uz_ray_is_likely(it->ray, N, run->load.h, it->r_next, it->gamma) ? uz_run_take_ray(run, it->ray, err)
                                                                            : UZ_OK;
}

uz_status uz_run_take_ray(uz_run *run, double *y, uz_error *err)
{
    const uz_csc *N = uz_setup_N(run->asked->setup, run->asked->problem);
    double radius, *copy;
    uz_status status = uz_prove_ray(&radius, y, N, run->load.h, err);
    if (status != UZ_OK || !(radius > run->work.reach))
        return status;
    if (!(copy = uz_alloc(run->m, sizeof *copy)))
        return uz_fail(err, UZ_ERR_MEMORY, "N", "no memory for the proof of infeasibility");
    memcpy(copy, y, (size_t)run->m * sizeof *copy);
    free(run->work.far);
    run->work.far = NULL;
    run->work.reach = radius;
    if (isinf(radius)) {
        run->work.end = UZ_END_RAY;
        run->result->ray = copy;
        run->result->summary.infeasible_radius = radius;
    } else {
        run->work.far = copy;
    }
    return UZ_OK;
}

uz_status uz_answer_allocate(uz_answer *answer, int64_t d, int64_t m, uz_error *err)
{
    answer->m = m;
    answer->u = uz_alloc_zero(d, sizeof(double));
    answer->r = uz_alloc_zero(m, sizeof(double));
    answer->g = uz_alloc_zero(m, sizeof(double));
    if (answer->u && answer->r && answer->g)
        return UZ_OK;
    return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer on %lld dofs", (long long)d);
}

void uz_answer_clear(uz_answer *answer)
{
    uz_free_all(answer->u, answer->r, answer->g);
    memset(answer, 0, sizeof *answer);
}
