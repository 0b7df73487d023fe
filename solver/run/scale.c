/* scale.c: loads in units in which their squares neither over- nor underflow.
 *
 * u and r are homogeneous of degree 1 in (p, h), and so is every bound; energies are of degree 2. Powers of two are
 * exact, so what is solved is the same problem bit for bit, and answers differ by the power alone. Loads of usual sizes
 * are left as they are. */
#include "core/alloc.h"
#include "core/error.h"
#include "linalg/pieces.h"
#include "run/run.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Loads and gaps between 2^-USUAL and 2^USUAL are left alone. */
enum { USUAL = 60 };

/* log2 of how large the answer may be in the energy norm, by what drives it: the load, dof by dof, and rows that u = 0
 * penetrates. -INFINITY: nothing does. */
static double drive(const uz_run *run, double *row_room)
{
    const uz_csc *K = uz_setup_K(run->asked->setup, run->asked->problem),
                 *N = uz_setup_all_rows(run->asked->setup, run->asked->problem);
    double most = -INFINITY;
    memset(row_room, 0, (size_t)run->all * sizeof *row_room);
    for (int64_t j = 0; j < run->d; j++) {
        const double stiffness = K->ptr[j] < K->ptr[j + 1] ? K->val[K->ptr[j]] : 0.0;
        if (!(stiffness > 0.0)) /* refused, but elsewhere */
            continue;
        most = fmax(most, log2(fabs(run->load.p[j])) - 0.5 * log2(stiffness));
        for (int64_t k = N->ptr ? N->ptr[j] : 0; N->ptr && k < N->ptr[j + 1]; k++)
            row_room[N->idx[k]] = fmax(row_room[N->idx[k]], fabs(N->val[k]) / sqrt(stiffness));
    }
    for (int64_t i = 0; i < run->all; i++)
        if (run->load.h_all[i] < 0.0 && row_room[i] > 0.0)
            most = fmax(most, log2(-run->load.h_all[i]) - log2(row_room[i]));
    return most;
}

static void multiply(double *x, int64_t n, int exponent)
{
    for (int64_t i = 0; x && i < n; i++)
        x[i] = ldexp(x[i], exponent);
}

uz_status uz_run_scale_load(uz_run *run, uz_error *err)
{
    uz_load_vectors *load = &run->load;
    const double force = uz_long_max(run->d, run->load.p);
    double depth = 0.0;
    for (int64_t i = 0; i < run->all; i++)
        depth = fmax(depth, -run->load.h_all[i]);
    if ((force == 0.0 || (force > ldexp(1.0, -USUAL) && force < ldexp(1.0, USUAL))) &&
        (depth == 0.0 || (depth > ldexp(1.0, -USUAL) && depth < ldexp(1.0, USUAL))))
        return UZ_OK;
    /* in the order of a scene's */
    double *own = load->owned ? load->owned : uz_alloc(run->d + run->all, sizeof *own);
    double *row_room = uz_alloc(run->all, sizeof *row_room);
    if (own && row_room && !load->owned) {
        load->n_owned = run->d + run->all;
        load->owned = memcpy(own, load->p, (size_t)run->d * sizeof *own);
        if (run->all > 0)
            memcpy(own + run->d, load->h_all, (size_t)run->all * sizeof *own);
        load->p = own;
        load->h = load->h_all = own + run->d;
    }
    if (!own || !row_room) {
        uz_free_all(own == load->owned ? NULL : own, row_room);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a load on %lld dofs", (long long)run->d);
    }
    const double size = drive(run, row_room);
    int least = -2 * DBL_MAX_EXP, most = 2 * DBL_MAX_EXP;
    free(row_room);
    /* the exponents by which loads can be multiplied without losing a bit */
    for (int64_t i = 0; i < load->n_owned; i++) {
        int exponent;
        if (load->owned[i] == 0.0)
            continue;
        frexp(load->owned[i], &exponent);
        const int down = DBL_MIN_EXP - exponent, up = DBL_MAX_EXP - exponent;
        least = down < 0 ? (down > least ? down : least) : 0;
        most = up < most ? up : most;
    }
    if (isfinite(size))
        load->exponent = (int)fmax(least, fmin(most, -floor(size)));
    multiply(load->owned, load->n_owned, load->exponent);
    run->work.exponent = load->exponent;
    return UZ_OK;
}

/* What a multiplication has lost to underflow, so that a bound stays one: towards `side`. */
static double outward(double x, int exponent, double side)
{
    const double y = ldexp(x, exponent);
    return ldexp(y, -exponent) == x || !isfinite(x) ? y : nextafter(y, copysign(INFINITY, side));
}

static void scale_residual(uz_residual *e, int exponent)
{
    e->e1 = ldexp(e->e1, exponent);
    e->e2 = ldexp(e->e2, exponent);
    e->e3 = ldexp(e->e3, exponent);
    e->e4 = ldexp(e->e4, 2 * exponent);
    e->total = hypot(hypot(e->e1, e->e2), hypot(e->e3, e->e4));
}

static void scale_row(uz_history_row *row, int exponent)
{
    row->dual_objective = ldexp(row->dual_objective, 2 * exponent);
    row->step_norm = ldexp(row->step_norm, exponent);
    row->error_bound = outward(row->error_bound, exponent, 1.0);
    scale_residual(&row->residual, exponent);
}

uz_status uz_state_copy(uz_state **out, const uz_state *from, const uz_candidates *rows, bool gather, int exponent,
                        uz_error *err)
{
    uz_state *s = uz_alloc_zero(1, sizeof *s);
    bool ok = true;
    *out = NULL;
    if (!s)
        return uz_no_memory(err, "a state");
    *s = *from;
    s->m = !rows ? from->m : gather ? rows->count : rows->m;
    double **to[] = {&s->r, &s->rho, &s->Dr, &s->Drho, &s->best_r, &s->anchor};
    for (size_t k = 0; k < sizeof to / sizeof to[0]; k++) {
        const double *given = *to[k];
        *to[k] = given ? uz_alloc(s->m, sizeof *given) : NULL;
        ok = ok && (*to[k] || !given);
        if (*to[k] && !rows)
            memcpy(*to[k], given, (size_t)s->m * sizeof *given);
        else if (*to[k] && gather)
            uz_candidates_gather(*to[k], given, rows);
        else if (*to[k])
            uz_candidates_scatter(*to[k], given, rows);
        for (int64_t i = 0; *to[k] && exponent != 0 && i < s->m; i++) {
            const double y = ldexp((*to[k])[i], exponent);
            (*to[k])[i] = isfinite(y) ? y : 0.0; /* of another load, and of no use to this one */
        }
    }
    s->step_norm = ldexp(s->step_norm, exponent);
    s->best_bound = outward(s->best_bound, exponent, 1.0);
    if (ok)
        *out = s;
    else
        uz_state_free(s);
    return ok ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the state of %lld contacts", (long long)from->m);
}

/* What was given is told as it was: a load whose units would lose some of it keeps its own. */
void uz_run_scale_given(uz_run *run)
{
    uz_load_vectors *load = &run->load;
    double *vectors[] = {run->answer.u, run->answer.r};
    const int64_t sizes[] = {run->d, run->answer.m};
    bool exact = true;
    for (int k = 0; k < 2; k++)
        for (int64_t i = 0; i < sizes[k]; i++)
            exact = exact && ldexp(ldexp(vectors[k][i], load->exponent), -load->exponent) == vectors[k][i];
    for (int k = 0; exact && k < 2; k++)
        multiply(vectors[k], sizes[k], load->exponent);
    if (!exact)
        multiply(load->owned, load->n_owned, -load->exponent);
    load->exponent = exact ? load->exponent : 0;
}

uz_status uz_run_round_to_units(uz_run *run, uz_error *err)
{
    uz_answer *answer = &run->answer;
    uz_certificate *certificate = &answer->certificate;
    const uz_csc *K = uz_setup_K(run->asked->setup, run->asked->problem);
    double *vectors[] = {answer->u, answer->r}, apart = 0.0; /* >= the norm of what u is moved by */
    const int64_t sizes[] = {run->d, answer->m};
    const int exponent = run->load.exponent;
    bool lost = false, beyond = false;
    for (int k = 0; exponent != 0 && !run->result->ray && k < 2; k++)
        for (int64_t i = 0; i < sizes[k]; i++) {
            const double told = ldexp(vectors[k][i], -exponent), back = ldexp(told, exponent);
            beyond = beyond || !isfinite(told);
            lost = lost || (back != vectors[k][i] && isfinite(told));
            if (k == 0 && back != vectors[k][i]) /* ||u||_K is at most the sum of those of its entries */
                apart += (1.0 + 0x1p-40) * fabs(back - vectors[k][i]) * sqrt(K->val[K->ptr[i]]);
            vectors[k][i] = isfinite(told) ? back : vectors[k][i];
        }
    const uz_certificate before = *certificate;
    uz_status status = lost ? uz_run_certify_answer(run, answer, err) : UZ_OK;
    /* Reactions may have lost more than u. What bounded u before bounds it still, but for what it was moved by. */
    if (lost && before.absolute_error + apart < certificate->absolute_error) {
        const uz_residual residual = certificate->residual, relative = certificate->relative_residual;
        *certificate = before;
        certificate->residual = residual;
        certificate->relative_residual = relative;
        certificate->absolute_error = nextafter(before.absolute_error + apart, INFINITY);
        const double least = before.energy_norm - apart - certificate->absolute_error; /* that ||u*||_K can be */
        certificate->relative_error = least > 0.0 ? (1.0 + 0x1p-40) * certificate->absolute_error / least : INFINITY;
    }
    if (exponent != 0 && (beyond || !isfinite(ldexp(certificate->absolute_error, -exponent))))
        certificate->absolute_error = certificate->relative_error = certificate->gap =
            INFINITY; /* no double holds it */
    return status;
}

void uz_run_restore_units(uz_run *run)
{
    const int exponent = -run->load.exponent;
    uz_answer *answer = &run->answer;
    uz_certificate *c = &answer->certificate;
    if (exponent == 0)
        return;
    multiply(run->load.owned, run->load.n_owned, exponent);
    multiply(answer->u, run->d, exponent);
    multiply(answer->r, answer->m, exponent);
    multiply(answer->g, answer->m, exponent);
    c->absolute_error = outward(c->absolute_error, exponent, 1.0);
    c->gap = outward(c->gap, 2 * exponent, 1.0);
    c->energy_primal = outward(c->energy_primal, 2 * exponent, 1.0);
    c->energy_dual = outward(c->energy_dual, 2 * exponent, -1.0);
    c->energy_norm = ldexp(c->energy_norm, exponent);
    scale_residual(&c->residual, exponent);
    run->result->summary.infeasible_radius = outward(run->result->summary.infeasible_radius, exponent, -1.0);
    run->work.reach = outward(run->work.reach, exponent, -1.0);
    run->load.exponent = 0;
}

uz_status uz_run_unscale_history(uz_run *run, uz_error *err)
{
    uz_result *result = run->result;
    uz_state *state = result->state;
    const int exponent = -run->work.exponent;
    if (exponent == 0)
        return UZ_OK;
    for (int64_t k = 0; k < result->history.count; k++)
        scale_row(&result->history.rows[k], exponent);
    uz_status status = state ? uz_state_copy(&result->state, state, NULL, false, exponent, err) : UZ_OK;
    uz_state_free(state);
    run->work.exponent = 0;
    return status;
}

static bool asks_cancelled(void *ctx)
{
    const uz_scaled_hooks *own = ctx;
    return own->outer->cancelled && own->outer->cancelled(own->outer->ctx);
}

static void tells_progress(void *ctx, const uz_history_row *row)
{
    const uz_scaled_hooks *own = ctx;
    uz_history_row told = *row;
    scale_row(&told, own->exponent);
    if (own->outer->progress)
        own->outer->progress(own->outer->ctx, &told);
}

const uz_hooks *uz_run_hooks(uz_scaled_hooks *room, const uz_run *run)
{
    const uz_hooks *outer = run->asked->hooks;
    if (run->work.exponent == 0 || !outer)
        return outer;
    *room = (uz_scaled_hooks){
        .outer = outer,
        .exponent = -run->work.exponent,
        .hooks = {.ctx = room, .cancelled = asks_cancelled, .progress = tells_progress},
    };
    return &room->hooks;
}
