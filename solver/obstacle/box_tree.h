/* box_tree.h: which of many things is nearest to a point, or lies in a box. A balanced tree of bounding boxes: halves
 * of the things by the median of their centres along the widest axis. Boxes may reach to infinity. */
#ifndef UZ_OBSTACLE_BOX_TREE_H
#define UZ_OBSTACLE_BOX_TREE_H

#include "uzawa.h"

typedef struct {
    int dim, levels;
    int64_t n;
    int64_t *item; /* n: leaf after leaf */
    double *box;   /* 2^levels x 2 dim: node k has children 2k and 2k + 1, the root is 1; lowest, then highest corner */
} uz_box_tree;

/* box: n x 2 dim, lowest and highest corner of each thing. O(n log n). Error: UZ_ERR_MEMORY. */
uz_status uz_box_tree_init(uz_box_tree *out, int64_t n, int dim, const double *box, uz_error *err);
void uz_box_tree_clear(uz_box_tree *tree);

/* The squared distance of a thing from the point in question; anything beyond `best` where it is more than that. */
typedef double uz_item_distance(const void *ctx, int64_t item, const double *x, double best);
/* The nearest thing whose squared distance is at most `farthest`, of several the one of least number; -1 where there is
 * none. Boxes beyond that are not looked into. Allocates nothing. */
int64_t uz_box_tree_nearest(const uz_box_tree *tree, const double *x, double farthest, uz_item_distance *distance,
                            const void *ctx);

/* The squared distance of x from a box (2 dim). */
double uz_box_distance(const double *box, int dim, const double *x);

/* Called with each thing of the leaves that meet the box (2 dim) until it returns true. Returns whether it did. */
typedef bool uz_item_visit(void *ctx, int64_t item);
bool uz_box_tree_meet(const uz_box_tree *tree, const double *box, uz_item_visit *visit, void *ctx);

#endif
