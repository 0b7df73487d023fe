/* method.c: which engine runs. */
#include "methods/method.h"

/* Accelerated iterations are cheap and find nearly the right contact set; the active set then ends in a few dense
 * factorizations what they would do in hundreds of products. Where the steps of the active set need no D, they cost
 * less than forming it: then it starts at once, and D is formed only if it fails. */
enum { WARM_UP = 32 };

static uz_status run_auto(uz_end *end, uz_iterate *it, uz_case *load, const uz_method_options *options,
                          uz_history *history, uz_error *err)
{
    uz_method_options phase = *options;
    phase.method = UZ_METHOD_ACCELERATED_RESTART;
    bool polish = options->stopping == UZ_STOP_CERTIFIED;
    if (polish && it->iteration == 0 && uz_case_active_set_is_cheap(load)) {
        uz_status status = uz_active_set_run(end, it, load, &phase, history, err);
        if (status != UZ_OK || *end != UZ_END_STALLED)
            return status;
    }
    if (polish && it->iteration + WARM_UP < options->max_iterations)
        phase.max_iterations = it->iteration + WARM_UP;
    uz_status status = uz_gradient_run(end, it, load, &phase, history, err);
    if (status != UZ_OK || !polish || *end != UZ_END_ITERATIONS || phase.max_iterations == options->max_iterations)
        return status;
    phase.max_iterations = options->max_iterations;
    status = uz_active_set_run(end, it, load, &phase, history, err);
    if (status != UZ_OK || *end != UZ_END_STALLED)
        return status;
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
