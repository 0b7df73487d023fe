/* method.c: which engine runs. */
#include "methods/iterate.h"

/* The active set comes first: on the reference problems it ends in 1 to 10 steps from no contact at all, where
 * accelerated steps need hundreds, and in the scaled and bounded forms without ever forming D. Where it fails
 * (dependent rows in the guess, a form that can't) accelerated steps take over, and hand it a better guess once. */
enum { WARM_UP = 32 };

/* The active set came to nothing: the iterations go on. */
static bool gave_up(uz_end end)
{
    return end == UZ_END_STALLED || end == UZ_END_UNSOLVED;
}

static uz_status run_auto(uz_end *end, uz_iterate *it, uz_case *load, const uz_method_options *options,
                          uz_history *history, uz_error *err)
{
    uz_method_options phase = *options;
    phase.method = UZ_METHOD_ACCELERATED_RESTART;
    bool polish = options->stopping == UZ_STOP_CERTIFIED;
    if (polish && it->iteration == 0) {
        uz_status status = uz_active_set_run(end, it, load, &phase, history, err);
        if (status != UZ_OK || !gave_up(*end))
            return status;
        uz_iterate_go_back(it);
    }
    if (polish && it->iteration + WARM_UP < options->max_iterations)
        phase.max_iterations = it->iteration + WARM_UP;
    uz_status status = uz_gradient_run(end, it, load, &phase, history, err);
    if (status != UZ_OK || !polish || *end != UZ_END_ITERATIONS || phase.max_iterations == options->max_iterations)
        return status;
    phase.max_iterations = options->max_iterations;
    status = uz_active_set_run(end, it, load, &phase, history, err);
    if (status != UZ_OK || !gave_up(*end))
        return status;
    uz_iterate_go_back(it);
    return uz_gradient_run(end, it, load, &phase, history, err);
}

uz_status uz_method_run(uz_end *end, uz_iterate *it, uz_case *load, const uz_method_options *options,
                        uz_history *history, uz_error *err)
{
    if (options->method == UZ_METHOD_AUTO)
        return run_auto(end, it, load, options, history, err);
    if (options->method == UZ_METHOD_ACTIVE_SET)
        return uz_active_set_run(end, it, load, options, history, err);
    return uz_gradient_run(end, it, load, options, history, err);
}
