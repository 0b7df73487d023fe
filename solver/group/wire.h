/* wire.h: what a process that solves (group.c) and the first process of a group (worker/main.c) say to each other.
 *
 * A stream in both directions, numbers as this machine writes them. Each message begins with a head; what follows it
 * stands below. The client asks, the group answers each question with one message; EXPECT, BODY,
 * ROWS and FREE have no answer.
 *
 *     <- HELLO                       a: processes
 *     -> EXPECT  a: bytes that the blocks' values in the rows of each process will take, about. No answer
 *     -> GRAPH   a: nodes n; n + 1 offsets and the neighbours of each node (int32)
 *     <- PARTS   a: processes; of each node the process that is to have it (n int32)
 *     -> BODY    a: nodes n, b: dofs of each, c: modes, x: uz_modes.strong; of each process its nodes and its blocks
 *                (int64). No answer
 *     -> ROWS    a: nodes, b: blocks, c: their process; the blocks' values (row by row, double), number of blocks of
 *                each node (int32), the blocks' columns (int32), the modes of the nodes' dofs (float). Nodes come by
 *                process, and are numbered so from now on; a message has nodes of one process only, and of the blocks
 *                among these the upper triangle
 *     <- MADE    after the last of them. a: levels, b: bytes, x: `most`, y: seconds
 *     -> HOLD    a byte for each dof: held or not           <- MADE
 *     -> BEGIN   a: system, b: 1: from 0, c: 1, or 2 for two right-hand sides at once; unless from 0 the start of
 *                each (double); right-hand side of each (double)
 *                                                        <- STATE   x: r'M^-1 r, here and below of the worse one
 *     -> STEPS   a: system, b: at most so many, x: until r'M^-1 r is not above it; y: single precision is believed
 *                that where sqrt(x) is not below y times the root of the last one in double precision
 *     <- STATE   a: made, fewer where there is no more to gain, b: 1 where p'K p was not positive, x: r'M^-1 r
 *     -> AGAIN   a: system; from the true residual          <- STATE   x: r'M^-1 r
 *     -> FETCH   a: system                                  <- VECTOR  x of each
 *     -> APPLY   a: system; r                               <- VECTOR  M^-1 r
 *     -> FREE    the body `id`
 *
 * The group ends when its stream does. What fails there for any other reason than the numbers of a matrix ends it. */
#ifndef UZ_GROUP_WIRE_H
#define UZ_GROUP_WIRE_H

#include <stdint.h>

typedef enum {
    UZ_WIRE_HELLO = 1,
    UZ_WIRE_EXPECT,
    UZ_WIRE_GRAPH,
    UZ_WIRE_PARTS,
    UZ_WIRE_BODY,
    UZ_WIRE_ROWS,
    UZ_WIRE_MADE,
    UZ_WIRE_HOLD,
    UZ_WIRE_BEGIN,
    UZ_WIRE_STEPS,
    UZ_WIRE_STATE,
    UZ_WIRE_AGAIN,
    UZ_WIRE_FETCH,
    UZ_WIRE_VECTOR,
    UZ_WIRE_APPLY,
    UZ_WIRE_FREE
} uz_wire_kind;

/* Both sides have to be of one build. */
#define UZ_WIRE_VERSION 11

typedef struct {
    int32_t kind, version; /* uz_wire_kind, UZ_WIRE_VERSION */
    int64_t id;            /* of the body */
    int64_t a, b, c;
    double x, y;
} uz_wire_head;

/* Systems of a body: K, and K_FF of the dofs that are not held. */
enum { UZ_WIRE_WHOLE = 0, UZ_WIRE_FREE_DOFS = 1 };

enum { UZ_WIRE_STEPS_MOST = 64, UZ_WIRE_BODIES = 16 };

#endif
