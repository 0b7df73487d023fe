/* worker.h: the parts of uzawa-group: a multigrid whose finest level is spread over the processes of a group, and
 * conjugate gradients with it. All functions are collective, but for those that say so; what goes wrong ends the group.
 *
 * Vectors have four numbers for each node, the surplus ones 0, first those of this process's nodes and then those of
 * its ghosts: nodes of others that its own ones are coupled with. Where two systems are solved at once, in two lanes,
 * a node has eight, those of the first lane first. */
#ifndef UZ_GROUP_WORKER_H
#define UZ_GROUP_WORKER_H

#include "amg/multigrid_private.h"

#include <mpi.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

/* For any process alone. */
void end_group(const char *why);
void *new_room(int64_t count, size_t size); /* uninitialized */
void *new_zeros(int64_t count, size_t size);
/* Of one process alone: a thread that touches pages of room that will be taken soon. Zero at first. */
typedef struct {
    pthread_t thread;
    bool runs;
    atomic_bool over;
    char *at;
    size_t bytes;
} fresh_pages;
void fresh_begin(fresh_pages *fresh, int64_t bytes); /* as many as there will be, about; little is not worth it */
void fresh_end(fresh_pages *fresh);                  /* no more of them */
/* MPI_Waitall, asleep where it takes long. Nothing else waits: no call of MPI's that does is made. */
void wait_for(int count, MPI_Request *requests);

/* MPI_Allreduce in place, waiting so. */
void combine_all(void *x, int count, MPI_Datatype type, MPI_Op op);

/* Who has which nodes, and what passes between neighbours. */
typedef struct {
    int rank, size;
    int64_t here, ghosts, sent;
    int32_t *number;                                        /* ghosts: their numbers in the body, ascending */
    int32_t *send;                                          /* sent: own nodes that are others' ghosts, by process */
    int *send_count, *send_first, *take_count, *take_first; /* size: of send and of the ghosts */
    char *packed;
    size_t room;
    MPI_Request *request; /* 2 size */
} neighbours;
/* first (size + 1): the first node of each process. ptr (here + 1), column: neighbours of the own nodes, by number. */
void neighbours_init(neighbours *n, const int32_t *first, const int64_t *ptr, const int32_t *column);
/* ghosts' numbers of a node, `each` bytes, from those of the own nodes. */
void neighbours_fetch(neighbours *n, void *ghosts, const void *own, size_t each);
/* The same in two steps: room for `each` bytes of every node of `send`, which is to be filled, and the exchange. */
char *neighbours_room(neighbours *n, size_t each);
void neighbours_exchange(neighbours *n, void *ghosts, size_t each);
void neighbours_free(neighbours *n);

/* This process's part of the sweeps on a level that each has whole. */
typedef struct {
    bool divided; /* false: there is nothing to divide, and the rest is empty */
    int size;
    int64_t begin, end;       /* its nodes */
    int *count[2], *first[2]; /* size each: numbers of each process in a vector of the level, of one lane and of two */
    uz_level level;           /* own nodes among each other; the prolongation is that of the whole level */
    int64_t *outside_ptr;     /* end - begin + 1: blocks that couple them with others' nodes, */
    int32_t *outside_idx;     /* which, */
    float *outside, *sum;     /* the blocks, and their absolute sums, b for each node */
} shared_level;
/* loss, lost: as uz_hold_loss has them, after that; NULL: nothing is. */
void shared_init(shared_level *own, const uz_multigrid *base, const uz_multigrid_room *room, const neighbours *near,
                 const uz_blocks *loss, const bool *lost);
void shared_clear(shared_level *own);
/* z = M^-1 z, vectors of the level as uz_level_step has them. */
void shared_apply(const shared_level *own, const uz_multigrid *base, uz_multigrid_room *room, float *z, int lanes);

/* What is coarser than the finest level, each process has whole. */
typedef struct {
    float *inverse;     /* (here + ghosts) x b, of the finest level: 0 at dofs that are held */
    uz_multigrid *base; /* NULL: there is none */
    uz_multigrid_room *room;
    shared_level shared; /* of base */
} variant;

enum { VARIANT_WHOLE, VARIANT_HELD, VARIANTS };
enum { LANES = UZ_LANES_MOST };

typedef struct {
    neighbours near;
    int b, k;
    double strong;
    double *scale;  /* here x b: powers of two that make the diagonal about 1 */
    uz_level level; /* own nodes, then ghosts, whose rows are what couples them with the own ones */
    int64_t faces;  /* own nodes with ghosts, */
    int32_t *face;  /* which, */
    int32_t *rim;   /* and of each block in the rows of ghosts the place of its own node among them */
    float *outside; /* here x b: the absolute sums of what is coupled with ghosts */
    uz_blocks next; /* the next matrix; without numbers off the diagonal where there are coarser ones */
    uz_blocks loss; /* in its places: 0 but while dofs are held */
    float *modes;   /* next.nodes x k x k: of that */
    variant variant[VARIANTS];
    int lanes; /* of the solve at hand: 1 or LANES */
    float *rhs, *x, *t, *coarse;
    float *ghosts, *brim;          /* numbers of ghosts, and of faces: twice as many */
    double *coarse_r, *coarse_z;   /* next.nodes x k */
    float *diagonal;               /* here x 4: of A, 0 where dofs take no part; of rough.c */
    double *u, *f, *r, *z, *p, *q; /* vectors */
    double most;                   /* a bound on lambda_max(diag(K)^-1 M) */
    double unit[LANES];            /* of the residual that a solve began with */
    double square[LANES];          /* r'z */
    bool single;                   /* steps may be in single precision, */
    bool rough;                    /* and are: u, z and p are those of rough.c */
    int since;                     /* steps since the last residual in double precision */
    float length[LANES];           /* of the last of these steps, which x there has not taken yet */
    double before[LANES];          /* square before it, */
    double known[LANES];           /* and of the last residual in double precision */
} spread_system;

/* Rows of the own nodes: a node's blocks are those of others' nodes, its own, and of own ones after it, columns
 * ascending, row by row of the matrix. modes (here x b x k). */
typedef struct {
    const int32_t *first; /* size + 1 */
    int64_t *ptr;
    int32_t *column;
    double *value;
    float *mode;
    int b, k;
    double strong;
} spread_rows;
/* Frees the blocks and modes of the rows once they are in the levels. */
void system_create(spread_system *s, spread_rows *rows);
/* From now on VARIANT_HELD is without the dofs that held (here x b) marks. */
void system_hold(spread_system *s, const char *held);
void system_free(spread_system *s);
int64_t system_bytes(const spread_system *s, int which); /* of this process */
int system_levels(const spread_system *s, int which);

/* z = M^-1 r: one V-cycle. One lane. */
void system_precondition(spread_system *s, int which, double *z, const double *r);
/* From u and f, of so many lanes. u_is_zero: as is K u then. */
void system_begin(spread_system *s, int which, bool u_is_zero);
/* u has all steps that were made; they are over. */
void system_settle(spread_system *s);
/* r'z, of the worse lane. */
double system_square(const spread_system *s);
/* Steps of conjugate gradients until that is <= goal2; how many. In single precision that is believed where goal2 is at
 * least `believed` times that of the last residual in double precision. *flat: the last one was not made, as p'K p was
 * not positive. */
int system_steps(spread_system *s, int which, bool *flat, int most, double goal2, double believed);

/* ---- steps.c and rough.c share these */

/* r = f - K u in double precision. */
void system_residual(spread_system *s, int which, bool u_is_zero);
/* to (here) = r in single precision, by the units of the lanes, powers of two. */
void system_scale(const spread_system *s, float *to, const double *r, const double unit[LANES]);
/* brim (faces x 4 for each lane) = (D' - D) x - O x: what the own sweeps, of which D' + L + L' is the matrix, do not
 * see of A, but for its sign. Elsewhere that is 0. ghosts: of x, s->ghosts by meet_ghosts. */
void find_outside(const spread_system *s, float *brim, const float *x, const float *ghosts);
void meet_ghosts(spread_system *s, const float *x);
/* to += it. */
void add_to_faces(const spread_system *s, float *to, const float *brim);
/* The coarse correction of what the step's sweep down has left: step->coarse. */
void system_correct(spread_system *s, const variant *v, const uz_level_step *step);

/* From s->r. */
void rough_begin(spread_system *s, int which);
/* Steps as system_steps has them. *stuck: single precision leads no further; what there is is settled. */
int rough_steps(spread_system *s, int which, bool *stuck, int most, double goal2, double believed);

#endif
