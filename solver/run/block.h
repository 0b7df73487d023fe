/* block.h: several loads on one setup, together wherever the factor or K is read. */
#ifndef UZ_BLOCK_H
#define UZ_BLOCK_H

#include "run/run.h"

typedef struct uz_block uz_block; /* one thread; used for one group of loads after the other */

/* blocks * UZ_LANES loads at most at a time, on a setup with a condensed operator; all is borrowed. *runs: of the
 * block, one for each load. */
uz_status uz_block_create(uz_block **out, uz_run **runs, uz_setup *setup, const uz_problem *problem, int64_t blocks,
                          uz_error *err);
void uz_block_free(uz_block *block);

/* From loads to results, for `count` requests in_block, which must outlive the runs. The caller takes the results and
 * ends all of the runs, also after a failure. *failed: which request an error is about. */
uz_status uz_block_solve(uz_block *block, const uz_request *asked, int64_t count, int64_t *failed, uz_error *err);

#endif
