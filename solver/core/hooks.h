/* hooks.h: asking the caller whether to go on. */
#ifndef UZ_CORE_HOOKS_H
#define UZ_CORE_HOOKS_H

#include "uzawa.h"

/* hooks, and the hook itself, may be NULL. */
static inline bool uz_cancelled(const uz_hooks *hooks)
{
    return hooks && hooks->cancelled && hooks->cancelled(hooks->ctx);
}

#endif
