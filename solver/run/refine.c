/* refine.c: iterative refinement of an answer whose certificate misses the request.
 *
 * With u and r given, e = p + N'r - K u and f = h - N u in double-double precision, what is missing is the solution of
 * the contact problem of the correction: K c = e + N's with gaps f - N c >= 0 and r + s <= 0. It is solved on the
 * factor that is there, with the relative error that u itself was found with; so each pass takes as many digits again,
 * while the condition of K leaves any (Higham, Accuracy and Stability of Numerical Algorithms, chapter 12). The rows in
 * contact are chosen anew at the size of the correction: of rows that repeat each other up to rounding it is the
 * tightest that has to bear the reaction. */
#include "certificate/exact.h"
#include "certificate/residual.h"
#include "core/alloc.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hooks.h"
#include "methods/exchange.h"
#include "precise/precise.h"
#include "run/run.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* IN_VAIN: so many iterations without any bound are a doubt whether there is an answer. */
enum { MAX_PASSES = 20, FEW_ROWS = 1024, IN_VAIN = 4096 };

/* At this relative error there is nothing to gain: u itself is rounded. */
#define ROUNDED (16.0 * DBL_EPSILON)

/* So many passes that do not gain this much are the last. A pass in which rows change places is one: it only resolves
 * what the reactions that moved leave, and the next one is exact again. */
#define LEAST_GAIN 0.5
enum { PATIENCE = 3 };

/* Where solves are not exact: a correction that takes an answer to what is asked is as good as this part of that. Its
 * own error is small in the norm of the body as the rows hold it, and up to some hundred times larger in that of the
 * whole body, where this is long. */
#define SPARE     1e-3
#define LEAST_AIM 1e-10

typedef struct {
    uz_run *run;
    uz_csc Nt;
    uz_residuals res;     /* d each */
    double *zero, *e, *c; /* d */
    double *f, *s, *r;    /* m; s, r in scaled rows */
    double *g, *ray;      /* m */
    bool *active;         /* m */
    bool contradictory;   /* the rows of the last correction are, `ray` says why */
} refinement;

/* c and s for e and f. error: of the answer that is corrected, relative. */
static uz_status correct(refinement *x, double error, uz_error *err)
{
    const uz_run *run = x->run;
    const uz_dual *dual = run->work.dual->dual;
    const int64_t pressing = run->work.it.law->kind->active(run->work.it.law, NULL, x->r, run->m);
    const bool small = dual->can->cheap_steps || run->m <= FEW_ROWS || pressing <= FEW_ROWS ||
                       run->work.it.made_by == UZ_METHOD_DUAL_ACTIVE_SET;
    const bool exchange = dual->rows_may_depend && small;
    uz_dual_load *correction = NULL;
    for (int64_t i = 0; i < run->m; i++)
        x->f[i] = exchange || x->active[i] ? x->f[i] : INFINITY;
    uz_status status = uz_dual_load_create(&correction, run->asked->setup->dual,
                                           uz_setup_K(run->asked->setup, run->asked->problem), x->e, x->f, err);
    uz_stop stop = {run->asked->hooks, run->asked->deadline};
    const double aim = fmax(LEAST_AIM, SPARE * run->work.requested / error);
    if (status == UZ_OK)
        status = uz_dual_load_aim(correction, exchange ? NAN : aim, &stop, err);
    if (status == UZ_OK && exchange) {
        uz_exchange_end ended;
        int64_t steps = INT64_MAX;
        status = uz_exchange_run(&ended, &steps, x->s, x->g, x->ray, x->active, x->r, x->run->work.it.law, correction,
                                 &stop, err);
        x->contradictory = ended == UZ_EXCHANGE_RAY || ended == UZ_EXCHANGE_UNDECIDED;
    } else if (status == UZ_OK) { /* rows that can't depend on each other, or are too many: those that press stay */
        uz_active_end ended;
        correction->equations = true; /* they bear a correction, which may pull */
        status = uz_dual_load_solve_active(correction, &ended, x->s, x->g, x->active, err);
        for (int64_t i = 0; i < run->m; i++)
            x->s[i] = ended == UZ_ACTIVE_SOLVED ? x->s[i] : 0.0;
    }
    if (status == UZ_OK)
        status = uz_dual_load_recover(correction, x->c, x->s, false, err);
    uz_dual_load_free(correction);
    return status;
}

/* One pass: the refined answer takes the place of the latest, unless the rows contradict each other or the run was told
 * to stop. */
static uz_status refine_once(refinement *x, uz_answer *latest, uz_error *err)
{
    uz_run *run = x->run;
    const double *scale = run->work.dual->dual->row_scale;
    uz_status status = uz_equilibrium_residual(&x->res, uz_setup_K(run->asked->setup, run->asked->problem),
                                               uz_setup_N(run->asked->setup, run->asked->problem), run->load.p,
                                               latest->u, x->zero, latest->r, err);
    for (int64_t j = 0; j < run->d; j++)
        x->e[j] = -x->res.e_u[j];
    for (int64_t i = 0; i < run->m; i++) {
        x->f[i] = uz_gap_of_row(&x->Nt, i, run->load.h, latest->u, NULL);
        x->r[i] = latest->r[i] / scale[i];
    }
    run->work.it.law->kind->active(run->work.it.law, x->active, latest->r, run->m); /* the rows that press */
    if (status == UZ_OK)
        status = correct(x, latest->certificate.relative_error, err);
    uz_stop stop = {run->asked->hooks, run->asked->deadline};
    if (status != UZ_OK || x->contradictory || uz_stop_is_due(&stop)) /* half a correction is none */
        return status;
    for (int64_t j = 0; j < run->d; j++)
        latest->u[j] += x->c[j];
    for (int64_t i = 0; i < run->m; i++)
        latest->r[i] = scale[i] * (x->r[i] + x->s[i]);
    run->work.it.law->kind->project(run->work.it.law, latest->r, run->m);
    return uz_run_certify_answer(run, latest, err);
}

static void copy_answer(uz_answer *to, const uz_answer *from, const uz_run *run)
{
    memcpy(to->u, from->u, (size_t)run->d * sizeof(double));
    memcpy(to->r, from->r, (size_t)run->m * sizeof(double));
    memcpy(to->g, from->g, (size_t)run->m * sizeof(double));
    to->certificate = from->certificate;
}

/* Where the method ended because it can't do better; elsewhere it is asked for more, or nothing is asked for. */
static bool is_worth_it(const uz_run *run)
{
    double error = run->answer.certificate.relative_error;
    const uz_end how = run->work.end;
    bool ended = how == UZ_END_SOLVED || how == UZ_END_UNDECIDED || how == UZ_END_STALLED || how == UZ_END_NEXT;
    uz_stop stop = {run->asked->hooks, run->asked->deadline};
    return ended && error > run->work.requested && error > ROUNDED && !uz_stop_is_due(&stop);
}

uz_status uz_run_refine(uz_run *run, uz_error *err)
{
    refinement x = {.run = run, .res.brick = run->asked->setup->model.brick};
    double **of_d[] = {&x.res.e, &x.res.e_u, &x.res.Ku, &x.res.Kc, &x.zero, &x.e, &x.c};
    double **of_m[] = {&x.f, &x.s, &x.r, &x.g, &x.ray};
    bool ok = true;
    uz_answer latest = {0};
    if (!is_worth_it(run))
        return UZ_OK;
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        ok = (*of_d[k] = uz_alloc_zero(run->d, sizeof(double))) && ok;
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        ok = (*of_m[k] = uz_alloc_zero(run->m, sizeof(double))) && ok;
    x.active = uz_alloc_zero(run->m, sizeof *x.active);
    uz_status status =
        ok && x.active ? UZ_OK : uz_fail(err, UZ_ERR_MEMORY, "", "no memory to refine %lld dofs", (long long)run->d);
    if (status == UZ_OK)
        status = uz_csc_transpose(&x.Nt, uz_setup_N(run->asked->setup, run->asked->problem), err);
    if (status == UZ_OK)
        status = uz_answer_allocate(&latest, run->d, run->m, err);
    if (status == UZ_OK)
        copy_answer(&latest, &run->answer, run);
    /* What no bound is known of goes on while a factor solves for it; other solves leave as much as there was. */
    const bool exact = run->work.dual->dual->can->needs_factor;
    for (int pass = 0, idle = 0;
         status == UZ_OK && idle < PATIENCE && !x.contradictory && pass < MAX_PASSES && is_worth_it(run); pass++) {
        const double before = run->answer.certificate.relative_error, left = latest.certificate.residual.total;
        status = refine_once(&x, &latest, err);
        const bool unbounded = isinf(before), better = latest.certificate.relative_error < before;
        if (status == UZ_OK && (better || unbounded)) {
            copy_answer(&run->answer, &latest, run);
            run->result->summary.refinements += better;
        }
        if (run->work.end == UZ_END_NEXT && pass > 0 && isinf(run->answer.certificate.relative_error))
            break; /* the guess is not nearly right, and something else is there to be tried */
        const bool gained = unbounded ? exact || latest.certificate.residual.total < LEAST_GAIN * left ||
                                            isfinite(latest.certificate.relative_error)
                                      : run->answer.certificate.relative_error < LEAST_GAIN * before;
        idle = gained ? 0 : idle + 1;
    }
    if (x.contradictory && isinf(run->answer.certificate.relative_error)) {
        memcpy(run->work.it.ray, x.ray, (size_t)run->m * sizeof *x.ray);
        run->work.end = UZ_END_RAY; /* to be proved by the original data */
    }
    for (size_t k = 0; k < sizeof of_d / sizeof of_d[0]; k++)
        free(*of_d[k]);
    for (size_t k = 0; k < sizeof of_m / sizeof of_m[0]; k++)
        free(*of_m[k]);
    free(x.active);
    uz_csc_clear(&x.Nt);
    uz_answer_clear(&latest);
    return status;
}

/* Of a body that rows keep from moving at all an error has nothing to be relative to, so that it is right or not: the
 * reactions in doubles, which balance the load or don't, tell it where longer ones are cut somewhere, too. */
static uz_status certify_rest(uz_run *run, uz_answer *answer, int bits, uz_error *err)
{
    uz_certify_input input;
    bool rests = true; /* with reactions that are numbers */
    for (int64_t j = 0; j < run->d && rests; j++)
        rests = answer->u[j] == 0.0;
    for (int64_t i = 0; i < run->m && rests; i++)
        rests = isfinite(answer->r[i]);
    if (!rests)
        return UZ_OK;
    mpf_t *u = uz_precise_numbers(run->d, bits), *r = uz_precise_numbers(run->m, bits);
    uz_status status = u && r ? uz_run_certify_input(&input, run, answer, err)
                              : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for %lld dofs", (long long)run->d);
    for (int64_t i = 0; status == UZ_OK && i < run->m; i++)
        mpf_set_d(r[i], answer->r[i]);
    if (status == UZ_OK)
        status = uz_certify_exact(&answer->certificate, answer->u, (const mpf_t *)u, (const mpf_t *)r, &input, err);
    uz_precise_free(u, run->d);
    uz_precise_free(r, run->m);
    return status;
}

/* The answer in numbers of so many bits, if there is one, and its certificate; or a proof that there is none. *solved:
 * there is one. p: the load, or 0: that rows contradict each other has nothing to do with it. */
static uz_status solve_precisely(uz_run *run, bool *solved, const double *p, int bits, uz_error *err)
{
    const uz_stop stop = {run->asked->hooks, run->asked->deadline};
    const uz_csc *K = uz_setup_K(run->asked->setup, run->asked->problem),
                 *N = uz_setup_N(run->asked->setup, run->asked->problem);
    uz_precise_end ended = UZ_PRECISE_LEFT;
    uz_certify_input input;
    uz_answer answer = {0};
    mpf_t *u = uz_precise_numbers(run->d, bits), *r = uz_precise_numbers(run->m, bits);
    uz_status status = uz_answer_allocate(&answer, run->d, run->m, err);
    if (status == UZ_OK && !(u && r))
        status = uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer on %lld dofs", (long long)run->d);
    if (status == UZ_OK)
        status = uz_precise_solve(&ended, u, r, K, N, p, run->load.h, bits, &stop, err);
    for (int64_t i = 0; status == UZ_OK && i < run->m; i++)
        answer.r[i] = uz_precise_round(r[i]);
    if (status == UZ_OK && ended == UZ_PRECISE_RAY)
        status = uz_run_take_ray(run, answer.r, err);
    *solved = ended == UZ_PRECISE_SOLVED;
    for (int64_t j = 0; status == UZ_OK && *solved && j < run->d; j++)
        answer.u[j] = uz_precise_round(u[j]);
    if (status == UZ_OK && *solved && p == run->load.p)
        status = uz_run_certify_answer(run, &answer, err);
    if (status == UZ_OK && *solved && p == run->load.p && isinf(answer.certificate.relative_error))
        status = certify_rest(run, &answer, bits, err);
    /* Then the answer that was there: its u may be nearer than v as doubles hold it, entry by entry. */
    for (int k = 0; status == UZ_OK && *solved && p == run->load.p && k < 2; k++) {
        const uz_certificate *now = &answer.certificate, *before = &run->answer.certificate;
        const double by_doubles = now->absolute_error;
        if (!(now->relative_error <= run->work.requested))
            status = uz_run_certify_input(&input, run, &answer, err);
        if (status == UZ_OK && !(now->relative_error <= run->work.requested))
            status = uz_certify_exact(&answer.certificate, answer.u, (const mpf_t *)u, (const mpf_t *)r, &input, err);
        bool held = true; /* reactions, in these units; they may be in the caller's */
        for (int64_t i = 0; i < run->m && now->absolute_error < by_doubles; i++) {
            answer.r[i] = uz_precise_round(r[i]);
            held = held && isfinite(answer.r[i]);
        }
        if (status != UZ_OK || !held)
            break;
        if (now->relative_error < before->relative_error ||
            (isinf(before->relative_error) && now->absolute_error < before->absolute_error)) {
            const uz_answer swap = run->answer;
            run->answer = answer;
            answer = swap;
            run->work.end = UZ_END_STALLED;
            run->result->summary.refinements++;
        } else {
            copy_answer(&answer, &run->answer, run);
        }
        if (before->relative_error <= run->work.requested)
            break;
    }
    uz_answer_clear(&answer);
    uz_precise_free(u, run->d);
    uz_precise_free(r, run->m);
    return status;
}

uz_status uz_run_decide(uz_run *run, uz_error *err)
{
    const uz_stop stop = {run->asked->hooks, run->asked->deadline};
    const uz_end end = run->work.end;
    const uz_certificate *c = &run->answer.certificate;
    const bool in_vain = end == UZ_END_ITERATIONS && run->work.it.iteration >= IN_VAIN && isinf(c->relative_error),
               gave_up = end == UZ_END_UNDECIDED || end == UZ_END_STALLED || end == UZ_END_SOLVED ||
                         end == UZ_END_UNSOLVED || in_vain;
    const double enough = fmax(run->work.requested, ROUNDED),
                 seconds = end == UZ_END_UNDECIDED || isinf(c->relative_error) ? 1.0 : 0.1, start = uz_seconds();
    bool solved = false, tried = false;
    uz_status status = UZ_OK;
    /* What contradicts itself in few bits need not in more, where entries of a row are far apart. Units of the load may
     * be too far from those of an answer that rows hold; in many bits the caller's do as well. */
    /* Of a body by its cells there is only the diagonal of K. */
    const bool has_K = !run->asked->setup->model.brick;
    for (int bits = UZ_PRECISE_BITS; gave_up && has_K && bits <= UZ_PRECISE_MORE_BITS;) {
        if (status == UZ_OK && !run->result->ray && c->relative_error > enough &&
            uz_precise_is_small(run->d, run->m, bits, seconds) && !uz_stop_is_due(&stop)) {
            status = solve_precisely(run, &solved, run->load.p, bits, err);
            tried = true;
        }
        bits *= UZ_PRECISE_MORE_BITS / UZ_PRECISE_BITS;
        if (status == UZ_OK && bits > UZ_PRECISE_MORE_BITS && run->load.exponent != 0 && tried && !run->result->ray &&
            c->relative_error > enough) {
            status = uz_run_round_to_units(run, err);
            uz_run_restore_units(run);
            bits = UZ_PRECISE_BITS;
        }
    }
    /* Loads may move the body so much farther than the rows are apart that no bits see these contradict each other. */
    if (status == UZ_OK && tried && solved && isinf(c->absolute_error)) {
        double *zero = uz_alloc_zero(run->d, sizeof *zero);
        status = zero ? solve_precisely(run, &solved, zero, UZ_PRECISE_BITS, err)
                      : uz_fail(err, UZ_ERR_MEMORY, "", "no memory for the answer on %lld dofs", (long long)run->d);
        free(zero);
    }
    run->result->summary.timings.certify += uz_seconds() - start;
    return status;
}
