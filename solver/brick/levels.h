/* levels.h: the grids of a brick's multigrid, and what is done on one of them. Vectors of a grid are in single
 * precision, by component, padded as a uz_brick_level says, and 0 at held dofs and in the padding. */
#ifndef UZ_BRICK_LEVELS_H
#define UZ_BRICK_LEVELS_H

#include "brick/private.h"

enum { UZ_BRICK_LEVELS_MOST = 24, UZ_BRICK_SHARES = 4 };

/* Linear interpolation along one axis, from a grid to the next finer one. */
typedef struct {
    int64_t fine, coarse; /* cells; equal: every node is its own */
    bool halves;          /* two cells become one everywhere */
    int32_t *below;       /* fine + 1: the coarse node at or before a fine one ... */
    float *beyond;        /* fine + 1: ... and the share of the one after it */
    int32_t *first;       /* coarse + 1: the first fine node that a coarse one has a share in ... */
    float *share;         /* (coarse + 1) x UZ_BRICK_SHARES: ... and those of that and the next ones */
} uz_brick_axis;

enum { UZ_BRICK_DEGREE_MOST = 4 };

/* A polynomial of diag(K)^-1 K, in steps d = p d + q diag(K)^-1 r, x += d. */
typedef struct {
    double most; /* a bound on the largest eigenvalue of diag(K)^-1 K */
    int degree;
    float p[UZ_BRICK_DEGREE_MOST], q[UZ_BRICK_DEGREE_MOST];
} uz_brick_smoother;
/* Of a grid of so many cells, each with ke / unit, whatever dofs are held; coarser: along which axes the next one is.
 */
void uz_brick_smoother_init(uz_brick_smoother *out, int axes, const int64_t cells[3], const double *ke, double unit,
                            const bool coarser[3]);
/* A bound on lambda_max(diag(K)^-1 M) of a cycle that smooths so on the first grid. */
double uz_brick_bound_on_cycle(const uz_brick_smoother *s);

typedef struct {
    int axes;
    int64_t cells[3];
    double cell[3];
    int halvings[3];             /* along each axis, from the first grid */
    int64_t stride, plane, size; /* numbers in a line, a plane with a register more, and in all of one component */
    float block[9 * UZ_BRICK_PARITIES];
    float diagonal[3]; /* what one cell gives to a node, by component */
    uz_brick_smoother smoother;
    uz_brick_axis to[3]; /* the next grid; not of the last one */
} uz_brick_level;

/* Of all components, and what kernels read beyond. */
static inline int64_t uz_brick_numbers(const uz_brick_level *level)
{
    return level->axes * level->size + 2 * UZ_BRICK_PAD;
}

/* false: no memory; clear it all the same. */
bool uz_brick_axis_init(uz_brick_axis *axis, int64_t fine, int64_t coarse);
void uz_brick_axis_clear(uz_brick_axis *axis);

/* What a thread needs of a grid. inverse: 1 / K_jj, 0 at held dofs. */
typedef struct {
    float *x, *b, *t, *d; /* t: not of the last; d may be t */
    const float *inverse;
} uz_brick_vectors;

/* Room of sweeps, for each thread that may share them: of each step two planes of sums; the sums of a line, a line, and
 * of planes beside a slab what its steps make of x and d, x first; of each plane, what it adds to a sum. */
typedef struct {
    int most;
    double *of_plane;
    struct uz_brick_room {
        float *plane[UZ_BRICK_DEGREE_MOST][2], *sums, *line, *beside;
    } of[UZ_ASIDE_MOST];
} uz_brick_planes;
/* false: no memory; clear it all the same. *bytes: of it. */
bool uz_brick_planes_init(uz_brick_planes *room, const uz_brick_level *level, size_t *bytes);
void uz_brick_planes_clear(uz_brick_planes *room);

/* x by the smoother from 0, t = b - K x at free dofs. */
void uz_brick_smooth_down(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room);
/* x += P coarse (x of the next grid), then the smoother from there. */
void uz_brick_smooth_up(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                        const float *coarse, const uz_brick_planes *room);
/* t = b - K x at free dofs. */
void uz_brick_residual(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room);
/* t = K x at free dofs, 0 at others; b is not read. Returns x't. */
double uz_brick_curvature(const uz_brick_level *level, const uz_brick_vectors *v, const uz_brick_planes *room);
/* coarse->b = P't, 0 at its held dofs. */
void uz_brick_restrict(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                       const uz_brick_vectors *coarse, const uz_brick_planes *room);
/* x = P coarse->x at free dofs, 0 at others. */
void uz_brick_prolong(const uz_brick_level *level, const uz_brick_level *next, const uz_brick_vectors *v,
                      const uz_brick_vectors *coarse, const uz_brick_planes *room);
/* x += P coarse at free dofs of plane k, which begins at `plane`, its components so many numbers apart; inverse,
 * coarse: of all. */
void uz_brick_prolong_plane(const uz_brick_level *level, const uz_brick_level *next, const float *inverse,
                            const float *coarse, float *line, int64_t k, float *plane, int64_t apart);

#endif
