/* multigrid_private.h: what the files of the multigrid share. */
#ifndef UZ_MULTIGRID_PRIVATE_H
#define UZ_MULTIGRID_PRIVATE_H

#include "core/cpu.h"
#include "factor/factor.h"
#include "amg/amg.h"

enum { UZ_PARTS_MOST = 4 };
enum { UZ_LANES_MOST = 2 }; /* systems that are solved at once */

/* A symmetric matrix in blocks of b x b, row by row within each: what nodes exert on nodes. b is 1, 2, 3 or 6. */
typedef struct {
    int64_t nodes;
    int b;
    int64_t *ptr;       /* nodes + 1 */
    int32_t *idx;       /* ptr[nodes]: the columns left of the diagonal, ascending */
    double *off, *diag; /* ptr[nodes] x b x b, nodes x b x b */
    /* Nodes from part[p] to part[p + 1] have blocks left of the diagonal among themselves alone; those after all parts
     * anywhere. What goes through the rows in order can take the parts at once. parts 0: not known.
     * seams > 0: of those after all parts, whose begin is seam[0], nodes from seam[s] to seam[s + 1] and those that
     * they have blocks with have none in common with others of these; together they are all: they can be taken at once,
     * too. */
    int parts, seams;
    int64_t part[UZ_PARTS_MOST + 1], seam[UZ_PARTS_MOST + 1];
} uz_blocks;
void uz_blocks_clear(uz_blocks *A);
/* Where in A->idx the column is, which must be there. */
int64_t uz_blocks_find(const uz_blocks *A, int64_t row, int32_t column);
/* y = A x, vectors with four numbers for each node and lane, the surplus ones 0 in x and anything in y. b <= 3. */
void uz_blocks_multiply(double *y, const uz_blocks *A, const double *x, int lanes);

/* What single precision has left off numbers, as whole numbers of a power of two: half a unit of the largest in single
 * precision is 2^31 of these. Of numbers from a quarter of the largest on nothing is lost, of the others no more than a
 * product loses anyway, as long as the largest is of the size of the diagonal. */
typedef struct {
    int32_t *value; /* NULL: not parted */
    double unit;
} uz_rests;

/* Which blocks stand below the diagonal in each column. */
typedef struct {
    int64_t *ptr;  /* nodes + 1 */
    int32_t *node; /* ptr[nodes]: their rows, ascending */
    int64_t *at;   /* where they are in A->idx */
} uz_below;
bool uz_below_init(uz_below *below, const uz_blocks *A); /* false: no memory; clear it all the same */
void uz_below_clear(uz_below *below);

/* One level and the way to the next, coarser one. A coarse level has a node for each aggregate of the finer one, with a
 * dof for each mode, or for each corner of elements with middles, with its own dofs; where an aggregate has fewer
 * independent modes, those left over are 0 everywhere. Dofs that are not there have rows of zeros. Sweeps are made in
 * single precision: the cycle is positive definite whatever their rounding is, as it is that of the rounded matrices.
 */
typedef struct {
    uz_blocks A; /* the last level: kept for what holding dofs takes from it; else without numbers, once the next level
                  * is made, level 0 as soon as it is in parts */
    float *off, *diag;            /* the same in single precision */
    uz_rests off_rest, diag_rest; /* level 0: what that has left off, with which both are A */
    float *inverse; /* nodes x b: 1 / a_jj, 0 where a dof is not there, which makes it vanish from every sweep */
    int64_t *ptr;   /* nodes + 1: the blocks of each node's rows of the prolongation */
    int32_t *block; /* ptr[nodes]: the aggregate of each, ascending */
    float *value;   /* ptr[nodes] x b x k */
    int64_t aggregates;
} uz_level;

enum { UZ_LEVELS_MOST = 24 };

/* Multigrid on smoothed aggregates. Level 0 is S K S with powers of two that make its diagonal about 1. */
typedef struct {
    uz_multigrid base;
    int shift;
    int64_t *slot;                  /* n: where each dof stands in vectors of level 0: node x 2^shift + place */
    double *scale;                  /* n: S */
    uz_level level[UZ_LEVELS_MOST]; /* the last one has no prolongation; one level only: K itself, none is filled */
    uz_factor *coarsest;
} uz_aggregates;
/* Of a slot; without a division, as each entry of K asks. */
static inline int64_t uz_slot_node(const uz_aggregates *mg, int64_t slot)
{
    return slot >> mg->shift;
}
static inline int64_t uz_slot_place(const uz_aggregates *mg, int64_t slot)
{
    return slot & (((int64_t)1 << mg->shift) - 1);
}
/* Where level 0 keeps one number for each dof of its nodes, b each, without the surplus of vectors. */
static inline int64_t uz_slot_number(const uz_aggregates *mg, int64_t slot)
{
    return uz_slot_node(mg, slot) * mg->level[0].A.b + uz_slot_place(mg, slot);
}
extern const uz_multigrid_kind uz_aggregates_kind;

/* One thread's. Levels of its own where dofs are held: off, diag and inverse of each, or NULL for those that are the
 * multigrid's. */
struct uz_multigrid_room {
    int levels;
    uz_factor_workspace *ws;
    float *x[UZ_LEVELS_MOST], *b[UZ_LEVELS_MOST], *t[UZ_LEVELS_MOST]; /* nodes x width each */
    double *coarse, *permuted;                                        /* of the coarsest level */
    double *to, *from;                                                /* vectors of a product with level 0: nodes x 4 */
    float *d;                                                         /* of level 0, for rough.c: nodes x 4 */
    const bool *held;
    uz_level own[UZ_LEVELS_MOST];
    uz_factor *coarsest; /* likewise; of K_FF where there is one level only */
};
/* More than one level. *bytes: grows by what they take. */
uz_status uz_hold_levels(uz_multigrid_room *room, const uz_aggregates *mg, const bool *held, size_t *bytes,
                         const uz_stop *stop, uz_error *err);
void uz_release_levels(uz_multigrid_room *room);
/* Less of the matrix that the multigrid was made of, K, which had `b` dofs for each node, in order: loss, in the places
 * of its level 0, which is scaled as that is. lost (nodes): rows of `loss` that are not 0; NULL: any. More levels than
 * one. The room is for K - loss then, until it is told again; apart: but for what level 0 has off the diagonal, which
 * the caller keeps himself. */
uz_status uz_hold_loss(uz_multigrid_room *room, const uz_multigrid *mg, uz_blocks *loss, const bool *lost, bool apart,
                       const uz_team *team, uz_error *err);

/* Vectors of a level have `width` numbers for each node; where two systems are solved at once, in two lanes, those of
 * the first lane, then those of the second. */
static inline int uz_width(int b)
{
    return b > 4 ? 8 : 4;
}

/* One level of a cycle, or parts of that: on the way down x = (D + L)^-1 b, t = b - A x and coarse = P't; on the way up
 * x += P coarse and x = (D + L')^-1 (b - L x), t being room, and afterwards L'x.
 * Dofs without an inverse take no part.
 *
 * Of conjugate gradients whose residual is kept swept (rough.c), instead of the sweep down: REDUCE: x = (D + L)^-1 b,
 * swept -= share (along + x), each lane by a share of its own, and t = -L'swept; RAISE: x = (D + L) swept. Instead of
 * the way up: PLACE: x = P coarse, and t = 0; RISE: x = (D + L')^-1 (D swept - t - L x), t += L'x, and of that t
 * product = swept'(D x + t) of each lane, in double precision; swept is 0 at dofs without an inverse. */
typedef struct {
    const uz_level *level;
    const float *inverse, *b;
    float *x, *t, *coarse; /* coarse: the next level's right-hand side on the way down, its answer on the way up */
    int k, lanes;
    float *swept, share[UZ_LANES_MOST]; /* of these alone */
    const float *along;
    double *product; /* lanes */
} uz_level_step;
enum {
    UZ_STEP_SWEEP_DOWN = 1,
    UZ_STEP_REDUCE = 2,
    UZ_STEP_RAISE = 4,
    UZ_STEP_RESTRICT = 8,
    UZ_STEP_PROLONG = 16,
    UZ_STEP_PLACE = 32,
    UZ_STEP_SWEEP_UP = 64,
    UZ_STEP_RISE = 128
};
void uz_level_take_step(const uz_level_step *step, int parts);

/* uz_blocks_multiply where A is in two parts, or all but its diagonal is. */
void uz_level_multiply_parts(double *y, const uz_level *level, const double *x, int lanes);
/* The numbers of A, at most 4, become those that single precision has left off: level 0, whose sweeps have the others.
 */
void uz_level_part(uz_level *level);
void uz_level_part_off(uz_level *level); /* those off the diagonal alone: where sweeps have another diagonal than A */
/* Block e of A->off, or that of node e of A->diag, from A or from its parts; room: size, b x b, where it may be put. */
UZ_INLINE const double *uz_level_block(double *room, const uz_level *level, bool own, int64_t e, int64_t size)
{
    const double *whole = own ? level->A.diag : level->A.off;
    const float *single = (own ? level->diag : level->off) + e * size;
    if (whole)
        return whole + e * size;
    const uz_rests *rest = own ? &level->diag_rest : &level->off_rest;
    for (int64_t k = 0; k < size; k++)
        room[k] = (double)single[k] + rest->unit * (double)rest->value[e * size + k];
    return room;
}

/* level (room->b[0]): S r by a power of two above the largest, which is returned; 0 or infinite: there is none. */
double uz_read_dofs(float *level, const uz_aggregates *mg, const double *r);

/* The step of level l, not the last, of this room's cycle; now: the level as it is there. */
uz_level_step uz_step_of(uz_level *now, const uz_aggregates *mg, const uz_multigrid_room *room, int l);

/* kind->solve_roughly and step_roughly. */
uz_status uz_solve_roughly(const uz_multigrid *mg, uz_multigrid_room *room, uz_cg_info *info, double *x, double *r,
                           const uz_cg_stop *stop, uz_error *err);
uz_status uz_step_roughly(const uz_multigrid *mg, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                          void *ctx, uz_error *err);

/* kind->step_both. */
uz_status uz_step_both(const uz_multigrid *mg, uz_multigrid_room *room, const uint64_t seed[2], uz_cg_visit visit,
                       void *const ctx[2], uz_error *err);

/* A V-cycle from level `from` down, more levels than one: room->x[from] = M^-1 room->b[from]. */
uz_status uz_cycle_below(const uz_aggregates *mg, uz_multigrid_room *room, int from, int lanes, uz_error *err);
/* The room is for cycles of two lanes, too, from now on. More levels than one. False: no memory. */
bool uz_room_for_lanes(uz_multigrid_room *room, const uz_multigrid *mg);

/* Takes K apart into level 0: slot, scale, level[0].A, its nodes in the order of K's, or, if it may be parted, in parts
 * (uz_blocks), each of them in that order; *node_of_group (modes->n_nodes): where its nodes went, -1:
 * nowhere. Errors: NOT_SPD where a diagonal entry or a pair of dofs shows it. */
uz_status uz_blocks_of_matrix(uz_aggregates *mg, int32_t *node_of_group, const uz_csc *K, const uz_modes *modes,
                              bool parted, uz_error *err);

/* The same of a matrix in blocks, whose numbers off the diagonal are taken, also on failure; dofs that are not there
 * (n) become those of the unit matrix. */
uz_status uz_blocks_take(uz_aggregates *mg, uz_blocks *from, const float *there, uz_error *err);
/* Those numbers, which level 0 has by now in parts, come back. */
uz_status uz_blocks_give_back(uz_blocks *to, const uz_aggregates *mg, uz_error *err);
/* uz_multigrid_create of blocks, which are taken so: without a limit of memory, and without what a solve asks of K
 * itself, `most`, `rough` and what single precision has left of level 0. *out NULL: they are better factored as they
 * are, and have their numbers, about. */
uz_status uz_multigrid_of_blocks(uz_multigrid **out, uz_blocks *A, const float *there, const uz_modes *modes,
                                 const uz_team *team, uz_error *err);

/* Column by column, lower triangle; dofs without an inverse become those of the unit matrix. */
uz_status uz_blocks_to_columns(uz_csc *out, const uz_blocks *A, const float *inverse, uz_error *err);

/* start (groups + 2, zero), member (n): those of 0..n-1 that are in each group, by of (n; -1: in none). Afterwards
 * start[g]..start[g + 1] are group g's. */
void uz_list_members(int64_t *start, int32_t *member, const int32_t *of, int64_t n, int64_t groups);

/* aggregate (nodes): the aggregate of each node, -1 for nodes that hang on no other strongly. *count: aggregates. */
uz_status uz_aggregate(int32_t *aggregate, int64_t *count, const uz_level *level, const uz_below *below,
                       double threshold, uz_error *err);
/* Numbers the aggregates anew, so that the next level is in parts as this one is, where it is and they are enough:
 * parts->parts, part and seam are filled as uz_blocks says, seams is 0. False: no memory. */
bool uz_part_aggregates(uz_blocks *parts, int32_t *aggregate, int64_t count, const uz_level *level,
                        const uz_below *below);
/* A (ptr, idx) gets the parts that its nodes were numbered by, if its blocks agree, and seams, where they are such.
 * False: no memory. */
bool uz_blocks_take_parts(uz_blocks *A, const uz_blocks *parts);

/* basis (nodes b x k): the modes of each aggregate made orthonormal, 0 where there are none; coarse (aggregates x k x
 * k): the modes in that basis, row by row: those of the coarse level. */
uz_status uz_tentative(float *basis, float *coarse, const float *modes, const int32_t *aggregate, int64_t nodes, int b,
                       int64_t aggregates, int k, uz_error *err);
/* Fills the prolongation (I - omega D^-1 A) basis of the level. */
uz_status uz_prolong_smoothed(uz_level *level, const uz_below *below, const float *basis, const int32_t *aggregate,
                              double omega, int k, const uz_stop *stop, uz_error *err);
/* Fills a prolongation to the nodes that are no middles, linear along edges, and *modes (nodes x b x k), which become
 * theirs. ends (nodes x 2): uz_modes; the ends of a middle are no middles. */
uz_status uz_prolong_linear(uz_level *level, float **modes, const int32_t *ends, int dim, int k, uz_error *err);
/* off, diag and inverse of the level, from A in double precision. NOT_SPD where a diagonal entry is negative. */
uz_status uz_level_round(uz_level *level, uz_error *err);
/* *range: lambda_max(D^-1 A), a little too large: powers reach it within some per cent from below. */
uz_status uz_level_range(double *range, const uz_level *level, uz_error *err);
/* What the next level loses, in the places of its matrix (`loss`, zeros at entry), with the dofs of this one that have
 * no inverse here, but do in the level. False: no memory. */
bool uz_level_loss(uz_blocks *loss, const uz_level *level, const float *inverse);
/* coarse = P'A P. */
uz_status uz_galerkin(uz_blocks *coarse, const uz_level *level, const uz_below *below, int k, const uz_team *team,
                      const uz_stop *stop, uz_error *err);
/* The first of the nodes whose part of a sum is the member's `ahead` places after this one; nodes: of the last one. */
static inline int64_t uz_team_first(const uz_team *team, int ahead, int64_t nodes)
{
    return team ? nodes * (team->member + ahead) / team->members : ahead * nodes;
}
/* The numbers of A, of which each member has its nodes' part. */
static inline void uz_team_sum(const uz_team *team, uz_blocks *A)
{
    const int64_t size = (int64_t)A->b * A->b;
    if (!team)
        return;
    team->sum(A->off, A->ptr[A->nodes] * size);
    team->sum(A->diag, A->nodes * size);
}

/* Nodes between two questions whether to go on: a millisecond or so. */
enum { UZ_ROWS_AT_ONCE = 512 };
/* The functions above, and uz_multigrid_create, where it had to stop: UZ_ERR_CANCELLED. */
uz_status uz_fail_stopped(uz_error *err);

/* Of a matrix that is small enough; limit: of memory. */
uz_status uz_factor_coarsest(uz_factor **out, const uz_csc *A, size_t memory_limit, const uz_hooks *hooks,
                             uz_error *err);

#endif
