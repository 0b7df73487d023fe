/* private.h: what the files of the brick share. */
#ifndef UZ_BRICK_PRIVATE_H
#define UZ_BRICK_PRIVATE_H

#include "brick/brick.h"
#include "core/aside.h"

/* Lines of nodes begin so many nodes apart from each other or a multiple of it: registers of either precision. */
enum { UZ_BRICK_PAD = 8 };

static inline int64_t uz_brick_stride(int64_t cells)
{
    return (cells + 1 + UZ_BRICK_PAD - 1) / UZ_BRICK_PAD * UZ_BRICK_PAD;
}

/* ke by parities, 9 numbers each, of which the plane needs those of its two components and its four parities only,
 * symmetric, divided by `unit`. Bits of a parity are those of components. The largest entry off the blocks, or that
 * resists what all corners do alike and counts as 0, relative to the largest of all. */
double uz_brick_blocks(double block[9 * UZ_BRICK_PARITIES], int axes, const double *ke, double unit);
/* ke of a cell of another size; false: it is out of range. */
bool uz_brick_stiffness(double *ke, const uz_brick *brick, const double size[3]);

/* Slabs of planes of nodes, or of layers of cells, that threads share (core/aside.h): so many of them where there are
 * so many planes with so many numbers together, at most `most`. A slab does what lies below it once more, which takes a
 * quarter of it at most. */
int uz_brick_slabs(int64_t planes, int64_t numbers, int most);
/* The first plane of a slab; that of the slab after the last one is the number of planes. What is over goes to those
 * below, of which the first has nothing to do once more. */
static inline int64_t uz_brick_slab(int64_t planes, int slab, int slabs)
{
    return (planes * slab + slabs - 1) / slabs;
}

/* K times a vector in double precision, plane by plane. One room per solve, for `most` threads. */
typedef struct {
    int64_t stride, plane; /* numbers in a line and in a plane of nodes, of one component */
    int most;
    double *of_plane; /* what each adds to x'y */
    struct uz_brick_product_room {
        double *in[2], *out[2], *sums;
    } of[UZ_ASIDE_MOST];
} uz_brick_product;
bool uz_brick_product_init(uz_brick_product *room, const uz_brick *brick); /* false: no memory; clear it all the same */
void uz_brick_product_clear(uz_brick_product *room);
/* y (d) = K x, with block of uz_brick_blocks, unit 1; supported dofs are moved by `value`, or NULL: not. x NULL: 0. */
void uz_brick_multiply(double *y, const uz_brick *brick, const double *block, uz_brick_product *room, const double *x,
                       const double *value);
/* y = K x, likewise. Returns x'y. */
double uz_brick_curve(double *y, const uz_brick *brick, const double *block, uz_brick_product *room, const double *x);

#endif
