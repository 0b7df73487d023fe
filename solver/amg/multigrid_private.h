/* multigrid_private.h: what the files of the multigrid share. */
#ifndef UZ_MULTIGRID_PRIVATE_H
#define UZ_MULTIGRID_PRIVATE_H

#include "factor/factor.h"
#include "amg/amg.h"

/* One level and the way to the next, coarser one. A coarse level has k = number of modes dofs for each aggregate of the
 * finer one, in a row; where an aggregate has fewer independent modes, those left over are 0 everywhere and their
 * diagonal is 1. */
typedef struct {
    int64_t n;
    uz_csc A;        /* lower triangle; level 0: empty, it is the caller's K */
    double *inverse; /* n: 1 / a_jj */
    int64_t *ptr;    /* n + 1: the blocks of each row of the prolongation */
    int32_t *block;  /* ptr[n]: aggregate of each block */
    float *value;    /* ptr[n] x k */
    int64_t aggregates;
} uz_level;

enum { UZ_LEVELS_MOST = 24 };

/* Multigrid on smoothed aggregates. */
typedef struct {
    uz_multigrid base;
    int k;
    uz_level level[UZ_LEVELS_MOST]; /* the last one has no prolongation, only n */
    uz_factor *coarsest;
} uz_aggregates;
extern const uz_multigrid_kind uz_aggregates_kind;

struct uz_multigrid_room {
    uz_factor_workspace *ws;
    double *x[UZ_LEVELS_MOST], *b[UZ_LEVELS_MOST], *t[UZ_LEVELS_MOST]; /* n each; x and b from level 1 on */
    double *inverse;   /* level 0's where dofs are held: 0 there, which makes them vanish from every sweep; else NULL */
    uz_factor *coarse; /* K_FF where there is one level only; else NULL */
};
/* Of a matrix that is small enough; limit: of memory. */
uz_status uz_factor_coarsest(uz_factor **out, const uz_csc *A, size_t memory_limit, const uz_hooks *hooks,
                             uz_error *err);

/* Rows of a symmetric matrix of which only columns of the lower triangle are stored, in ascending order: a column waits
 * in the list of the row of its next entry. */
typedef struct {
    const uz_csc *A;
    int32_t *first, *next; /* n: list of waiting columns by row */
    int64_t *at;           /* n: next entry of each column */
    int32_t *column;       /* the row that was read: longest row */
    double *value;
    int64_t count;
} uz_row_walk;
bool uz_row_walk_init(uz_row_walk *walk, const uz_csc *A); /* false: no memory; clear it all the same */
void uz_row_walk_clear(uz_row_walk *walk);
void uz_row_walk_read(uz_row_walk *walk, int64_t i); /* i = 0, 1, 2, ... */

/* start (groups + 2, zero), member (n): those of 0..n-1 that are in each group, by of (n; -1: in none). Afterwards
 * start[g]..start[g + 1] are group g's. */
void uz_list_members(int64_t *start, int32_t *member, const int32_t *of, int64_t n, int64_t groups);

/* aggregate (n_nodes): the aggregate of each node, -1 for nodes that hang on no other strongly. node (n): the node of
 * each dof; inverse (n): as in uz_level. *count: aggregates. */
uz_status uz_aggregate(int32_t *aggregate, int64_t *count, const uz_csc *A, const double *inverse, const int32_t *node,
                       int64_t n_nodes, double threshold, uz_error *err);

/* basis (n x k): the modes of each aggregate made orthonormal, 0 where there are none; coarse (aggregates x k x k): the
 * modes in that basis, row by row: those of the coarse level. of (n): the aggregate of each dof, -1: none. */
uz_status uz_tentative(float *basis, float *coarse, const float *modes, const int32_t *of, int64_t n,
                       int64_t aggregates, int k, uz_error *err);
/* Fills the prolongation (I - omega D^-1 A) basis of the level. */
uz_status uz_prolong_smoothed(uz_level *level, const uz_csc *A, const float *basis, const int32_t *of, double omega,
                              int k, const uz_stop *stop, uz_error *err);
/* coarse = P'A P, lower triangle. */
uz_status uz_galerkin(uz_csc *coarse, const uz_level *level, const uz_csc *A, int k, const uz_stop *stop,
                      uz_error *err);

/* Rows between two questions whether to go on: a millisecond or so. */
enum { UZ_ROWS_AT_ONCE = 1024 };
/* Both functions above, and uz_multigrid_create, where it had to stop: UZ_ERR_CANCELLED. */
uz_status uz_fail_stopped(uz_error *err);

#endif
