/* state.h: where a run stood, as one vector of the store. */
#ifndef SERVER_WORK_STATE_H
#define SERVER_WORK_STATE_H

#include "uzawa.h"

#include <stdint.h>

/* The name of the vector in the store. */
#define STATE_VECTOR "state"

/* *out: *count numbers, freed by the caller; NULL: no memory. */
double *state_pack(const uz_state *state, int64_t *count);

/* The state in x[0..count), freed with uz_state_free. NULL: no memory, or written by another version, or damaged: the
 * run then begins elsewhere, which costs time and nothing else. */
uz_state *state_unpack(const double *x, int64_t count);

/* Where only reactions are known. */
uz_state *state_from_reactions(const double *r, int64_t m);

#endif
