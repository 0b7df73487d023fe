/* grids.h: the multigrid of a brick as its files see it. */
#ifndef UZ_BRICK_GRIDS_H
#define UZ_BRICK_GRIDS_H

#include "brick/levels.h"

typedef struct {
    uz_multigrid base;
    const uz_brick *brick;
    double unit;                         /* of K on all grids */
    double block[9 * UZ_BRICK_PARITIES]; /* of the first one, in double precision, unit 1 */
    uz_brick_level level[UZ_BRICK_LEVELS_MOST];
    float *inverse[UZ_BRICK_LEVELS_MOST];
    double ke[UZ_BRICK_DOFS * UZ_BRICK_DOFS]; /* of a cell of the last one */
    double *coarsest;                         /* the factor of its K, n x n */
    int64_t n_coarsest;
} uz_brick_grids;

struct uz_multigrid_room {
    int levels;
    uz_brick_vectors v[UZ_BRICK_LEVELS_MOST];
    float *held[UZ_BRICK_LEVELS_MOST]; /* the inverses of each grid with more dofs held; NULL: there are none */
    double *held_coarsest;             /* and the factor of the last */
    uz_brick_planes planes;
    double *coarse; /* a vector of the last grid */
    uz_brick_product product;
};

/* A factor of the last grid's K, its held dofs, where inverse is 0, being rows of the unit matrix. */
uz_status uz_brick_factor_coarsest(double **out, const uz_brick_grids *mg, const float *inverse, const uz_stop *stop,
                                   uz_error *err);
/* Where the node of the next finer grid stands in its vectors that is nearest to node (i, j, k) of a grid. */
int64_t uz_brick_nearest(const uz_brick_level *level, const uz_brick_level *finer, int64_t i, int64_t j, int64_t k);
/* inverse of a grid from that of the next finer one. */
void uz_brick_next_inverse(float *inverse, const uz_brick_level *level, const uz_brick_level *finer,
                           const float *above);
/* room->v[first].x from room->v[first].b, with the grids from `first` on. */
void uz_brick_cycle(const uz_brick_grids *mg, const uz_multigrid_room *room, int first);

/* room->v[0].b = down r (n), 0 at held dofs, down a power of two by which single precision holds it, which is returned:
 * 0 of what is 0 or has numbers that are none. */
double uz_brick_read(const uz_brick_grids *mg, const uz_multigrid_room *room, const double *r);

/* direction = z + beta direction (n each), by all threads. */
void uz_brick_turn(float *direction, const float *z, float beta, int64_t n);

/* As uz_multigrid_kind says. */
uz_status uz_brick_step_roughly(const uz_multigrid *base, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                                void *ctx, uz_error *err);
uz_status uz_brick_start(const uz_multigrid *base, uz_multigrid_room *room, bool *found, double *u, bool *held,
                         const double *p, const uz_limits *limits, const uz_stop *stop, uz_error *err);

#endif
