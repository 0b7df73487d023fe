/* block.h: several loads on one body, together wherever the factor or K is read. */
#ifndef UZ_BLOCK_H
#define UZ_BLOCK_H

#include "run/run.h"

typedef struct uz_block uz_block; /* one thread; used for one group of cases after the other */

/* blocks * UZ_LANES cases at most at a time, on a body with a condensed operator; all is borrowed. */
uz_status uz_block_create(uz_block **out, uz_setup *setup, const uz_problem *problem, int64_t blocks, uz_error *err);
void uz_block_free(uz_block *block);

/* The runs of a group: begun by the caller, with body and load case, and ended by the caller. */
uz_run *uz_block_runs(uz_block *block);

/* From loads to results, for the first `count` runs. *failed: the index of the case that an error is about. */
uz_status uz_block_solve(uz_block *block, int64_t count, int64_t *failed, uz_error *err);

#endif
