/* group.h: a multigrid that a group of processes holds, with its part of K each (worker/main.c): the side that asks.
 *
 * K is whole here, too: its rows go to the processes once, each block of a node to one of them. After that vectors of
 * d pass, for each solve and not for each of its iterations. */
#ifndef UZ_GROUP_H
#define UZ_GROUP_H

#include "amg/amg.h"
#include "uzawa.h"

/* Tells the group that K's rows will come, so that each process has room ready when they do. */
void uz_group_expect(uz_process_group *group, const uz_csc *K);
/* Returns when all of K was sent, while the group makes its levels; *out is to be awaited before anything else is done
 * with it or the group. Dofs that are held are those of the last one who held some: of one room at a time. Errors:
 * NOT_SPD where the diagonal shows it; UNSUPPORTED: too large; MEMORY; INTERNAL: the group was lost
 * (uz_process_group_is_lost). */
uz_status uz_group_multigrid(uz_multigrid **out, uz_process_group *group, const uz_csc *K, const uz_modes *modes,
                             uz_error *err);
/* INTERNAL: the group was lost; mg may only be freed then. */
uz_status uz_group_await(uz_multigrid *mg, uz_error *err);

#endif
