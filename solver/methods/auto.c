/* auto.c: which methods run, and in which order, where none was asked for. */
#include "methods/iterate.h"
#include "methods/kinds.h"

/* The active set comes first: on the reference problems it ends in 1 to 10 steps from no contact at all, where
 * conjugate steps need 30 to 100, and in the scaled and bounded forms without ever forming D. Where it fails
 * (dependent rows in the guess, a form that can't) conjugate steps take over, and hand it a better guess once. Where D
 * is applied by inner iterations accelerated steps do: with rows that depend on each other a direction's curvature is
 * less than what the inner iterations leave, and conjugate steps go astray. */
enum { WARM_UP = 32 };

/* Where auto stands: kept in the iterate, so that a run can go on from there. */
enum { FIRST_GUESS, WARMING_UP, SECOND_GUESS, ITERATING };

/* Is the phase over, but not the run? */
static bool phase_over(uz_end end, const uz_iterate *it, const uz_method_options *options)
{
    if (it->phase == WARMING_UP)
        return end == UZ_END_ITERATIONS && it->iteration < options->max_iterations;
    return it->phase != ITERATING && (end == UZ_END_STALLED || end == UZ_END_UNSOLVED);
}

static void warm_up(uz_iterate *it)
{
    it->phase = WARMING_UP;
    it->phase_end = it->iteration + WARM_UP;
}

static uz_status run(uz_end *end, uz_iterate *it, uz_dual_load *load, const uz_method_options *options,
                     uz_history *history, uz_error *err)
{
    uz_method_options phase = *options;
    phase.method = UZ_METHOD_ACCELERATED_RESTART;
    if (options->stopping != UZ_STOP_CERTIFIED || !it->law->kind->one_sided)
        return uz_steps_run(end, it, load, &phase, history, err);
    if (load->dual->can->exact || !uz_method_conjugate.exact)
        phase.method = UZ_METHOD_CONJUGATE;
    if (options->again)
        warm_up(it);
    for (;;) {
        const bool guess = it->phase == FIRST_GUESS || it->phase == SECOND_GUESS;
        const bool short_phase = it->phase == WARMING_UP && it->phase_end < options->max_iterations;
        phase.max_iterations = short_phase ? it->phase_end : options->max_iterations;
        uz_status status = guess ? uz_method_active_set.run(end, it, load, &phase, history, err)
                                 : uz_steps_run(end, it, load, &phase, history, err);
        if (status != UZ_OK || !phase_over(*end, it, options))
            return status;
        if (it->phase == FIRST_GUESS)
            warm_up(it);
        else
            it->phase++;
        if (it->phase != SECOND_GUESS) /* guesses that came to nothing leave r at the best that was found */
            uz_iterate_go_back(it);
    }
}

const uz_method_kind uz_method_auto = {.method = UZ_METHOD_AUTO, .name = "auto", .run = run};
