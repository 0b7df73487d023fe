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

/* How long work that takes a while may go on: until it is cancelled, or deadline (uz_seconds()) has come. Asked between
 * units of work of a few milliseconds. NULL: for ever. */
typedef struct {
    const uz_hooks *hooks;
    double deadline;
} uz_leave;

static inline bool uz_leave_is_over(const uz_leave *leave)
{
    return leave && (uz_cancelled(leave->hooks) || uz_seconds() >= leave->deadline);
}

#endif
