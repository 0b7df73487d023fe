/* reserve.h: what allocates from a reserve of touched pages (uzawa.h). */
#ifndef UZ_CORE_RESERVE_H
#define UZ_CORE_RESERVE_H

#include "uzawa.h"

/* Starts the thread that touches pages, which else comes when it is needed first: a process that is confined by then
 * may start none. */
void uz_reserve_start(uz_reserve *reserve);
/* A block of some `bytes` is going to be taken: their pages are made ready meanwhile, as far as `ready` of
 * uz_reserve_new allows. */
void uz_reserve_expect(uz_reserve *reserve, size_t bytes);
/* So many bytes are going to be allocated by malloc, and no block is taken meanwhile: as many of those that are kept
 * become memory of the heap, by moving their pages there, and are not made ready again before a block has taken as
 * much. Where that fails all that is kept goes back to the system. */
void uz_reserve_give_to_heap(uz_reserve *reserve, size_t bytes);
/* How many it was given since the reserve was emptied last: for bodies without a factor. */
size_t uz_reserve_lent(uz_reserve *reserve);
/* An uninitialized block, on a huge page boundary; NULL: no memory. */
void *uz_reserve_take(uz_reserve *reserve, size_t bytes);
/* Of a block that was taken; 0: it was not. */
size_t uz_reserve_size(uz_reserve *reserve, const void *block);
/* Frees it; false: it was not taken here. */
bool uz_reserve_give(uz_reserve *reserve, void *block);

#endif
