/* turns.h: which method of iteration runs, and which one after it. */
#ifndef UZ_METHODS_TURNS_H
#define UZ_METHODS_TURNS_H

#include "methods/method.h"

/* What runs, with which options. */
typedef struct {
    const uz_method_kind *kind; /* NULL before the first */
    uz_method_options options;
    bool last; /* of several: whatever becomes of it, nothing follows */
} uz_method_turn;

/* The first method of a run, then the one after that which came to *end; false: there is none, and *end is how the run
 * ends. asked: what the settings ask for, with these options. Each is begun by uz_steps_begin, where it has steps, and
 * run. */
bool uz_method_next(uz_method_turn *turn, uz_end *end, uz_iterate *it, const uz_dual_load *load,
                    const uz_method_kind *asked, const uz_method_options *options);

#endif
