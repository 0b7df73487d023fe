/* hooks.h: asking the caller whether to go on. */
#ifndef UZ_CORE_HOOKS_H
#define UZ_CORE_HOOKS_H

#include "core/clock.h"
#include "uzawa.h"

/* hooks, and the hook itself, may be NULL. */
static inline bool uz_cancelled(const uz_hooks *hooks)
{
    return hooks && hooks->cancelled && hooks->cancelled(hooks->ctx);
}

/* When work that takes a while has to stop: once it is cancelled, or deadline (uz_seconds()) has come. Asked at the
 * cancellation points: between units of work of a few milliseconds. NULL: never. */
typedef struct {
    const uz_hooks *hooks;
    double deadline;
} uz_stop;

static inline bool uz_stop_is_due(const uz_stop *stop)
{
    return stop && (uz_cancelled(stop->hooks) || uz_seconds() >= stop->deadline);
}

#endif
