/* ends.h: the last jobs that ended here, for those who wait for them: what they would read in a database that is
 * another machine's. Only who has seen that a job had not ended may ask: he is told what it was when it ended, whatever
 * has become of it since. */
#ifndef SERVER_WORK_ENDS_H
#define SERVER_WORK_ENDS_H

#include "store/store.h"

typedef struct ends ends;

ends *ends_new(void);    /* NULL: no memory */
void ends_free(ends *e); /* NULL is fine */
/* A job as it was claimed, and what its run has left, which is on disk. What is large, or no success, is not kept. */
void ends_keep(ends *e, const job *claimed, const store_outcome *outcome, double finished);
/* A copy, freed by the caller; false: it is not kept, and *out is zero. */
bool ends_find(ends *e, const char *id, job *out);

#endif
