/* memory.h: how much memory and how many processors this process may use. */
#ifndef SERVER_MEMORY_H
#define SERVER_MEMORY_H

#include <stddef.h>

/* Bytes of the machine, or of the control group (version 2 or 1) where that allows less. */
size_t memory_available(void);
/* Processors that it may run on, or the time of so many, where its control group (version 2) allows less; at least 1.
 */
int processors_available(void);

/* What is freed stays in one heap, touched: a page given back to the system is dear to get again, and each of glibc's
 * eight arenas for each processor would keep pages of its own. Who calls this sees to it that not too much lies free.
 */
void memory_keep_heap(void);

/* What is kept of bodies: a sixth of all, so that the first of two processes, which has half of it, keeps a solid of a
 * twentieth of all; at least 1 GB. */
size_t memory_for_cache(size_t available);
/* What one of `workers` solves may take: 80 % of all, less the cache, divided; at least 64 MB. */
size_t memory_share(size_t available, size_t cache, int workers);

#endif
