/* spread.h: K by blocks of nodes, for processes that have some nodes each. */
#ifndef UZ_GROUP_SPREAD_H
#define UZ_GROUP_SPREAD_H

#include "amg/amg.h"
#include "uzawa.h"

/* Every node gets as many dofs as the fullest has; those that it does not have are rows of the unit matrix, times the
 * largest diagonal entry of the node. */
typedef struct {
    int64_t d, nodes, size; /* size = nodes x bs */
    int64_t bs, modes;
    int32_t *node;               /* d: of each dof */
    int32_t *offset, *neighbour; /* nodes + 1, offset[nodes]: the graph, without loops; by uz_spread_number sorted, and
                                    of neighbours of the same process those after a node alone */
    int32_t *part;               /* nodes: the process of each, 0 until they are divided */
    int32_t *order, *number;     /* nodes: by process, and of each node its place in that order */
    int64_t *place;              /* d: number of its node x bs + which of its dofs */
    int64_t *dof;                /* size: the reverse; -1: the node has fewer */
} uz_spread;

/* All but part, order, number; of `place` only which dof of its node it is. Errors: NOT_SPD where a diagonal entry is
 * not positive; UNSUPPORTED: too large for 32 bits. */
uz_status uz_spread_init(uz_spread *map, const uz_csc *K, const uz_modes *modes, uz_error *err);
/* part, by where nodes are. *divided false, and nothing done: that is not known, or cuts too many couplings. */
uz_status uz_spread_divide(bool *divided, uz_spread *map, const uz_modes *modes, int64_t processes, uz_error *err);
/* order, number, place, dof; the graph becomes the blocks of each node's rows, less the one on the diagonal. */
uz_status uz_spread_number(uz_spread *map, int64_t processes, uz_error *err);
void uz_spread_clear(uz_spread *map);
/* Blocks in the rows of a node, once they are numbered. */
static inline int64_t uz_spread_blocks(const uz_spread *map, int64_t node)
{
    return map->offset[node + 1] - map->offset[node] + 1;
}

/* The rows of one process, some at a time: among its own nodes the upper triangle. */
typedef struct {
    int64_t process;       /* by the caller */
    int64_t nodes, blocks; /* of the current ones */
    int32_t *counts;       /* nodes: blocks of each, */
    int32_t *columns;      /* blocks: and their columns, ascending */
    double *values;        /* blocks x bs x bs: row by row of the matrix */
    float *modes;          /* nodes x bs x modes */
    int32_t *read;         /* of all nodes: entries of the column of its first dof up to the last one that was read */
    int64_t at, end, room; /* nodes in map->order that come next, and the one after the last; blocks at once */
    const uz_csc *K;
    const uz_modes *from;
} uz_spread_rows;
/* K and modes are kept until uz_spread_rows_clear, also after a failure. */
uz_status uz_spread_begin(uz_spread_rows *rows, const uz_spread *map, const uz_csc *K, const uz_modes *modes,
                          uz_error *err);
bool uz_spread_next(uz_spread_rows *rows, const uz_spread *map); /* false: there are no more */
void uz_spread_rows_clear(uz_spread_rows *rows);

#endif
