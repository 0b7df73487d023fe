#include "obstacle/box_tree.h"

#include "core/alloc.h"
#include "core/error.h"
#include "core/select.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* LEAF things at most share a leaf. Halving 2^62 things takes fewer than MOST_LEVELS levels. */
enum { LEAF = 4, MOST_LEVELS = 64 };

/* A node and the range of items below it. */
typedef struct {
    int64_t node, first, end;
} part;

static part half_of(part whole, int side)
{
    const int64_t middle = whole.first + (whole.end - whole.first) / 2;
    return (part){2 * whole.node + side, side ? middle : whole.first, side ? whole.end : middle};
}

/* The middle of a box along an axis; of one that reaches to infinity its finite end. */
static double centre(const double *box, int dim, int64_t item, int axis)
{
    const double low = box[2 * dim * item + axis], high = box[2 * dim * item + dim + axis];
    if (isfinite(low) && isfinite(high))
        return 0.5 * low + 0.5 * high;
    return isfinite(low) ? low : isfinite(high) ? high : 0;
}

/* The box of a node's items, and those below it: halves by the median along the axis in which centres are spread most.
 */
static void build_node(uz_box_tree *tree, uz_placed *list, const double *box, part of)
{
    const int dim = tree->dim;
    double *own = tree->box + 2 * dim * of.node, most = -1;
    int axis = 0;
    for (int c = 0; c < dim; c++) {
        double low = INFINITY, high = -INFINITY;
        own[c] = INFINITY;
        own[dim + c] = -INFINITY;
        for (int64_t i = of.first; i < of.end; i++) {
            const double *its = box + 2 * dim * list[i].item, at = centre(box, dim, list[i].item, c);
            own[c] = fmin(own[c], its[c]);
            own[dim + c] = fmax(own[dim + c], its[dim + c]);
            low = fmin(low, at);
            high = fmax(high, at);
        }
        if (high - low > most) {
            most = high - low;
            axis = c;
        }
    }
    if (of.end - of.first > LEAF) {
        for (int64_t i = of.first; i < of.end; i++)
            list[i].along = centre(box, dim, list[i].item, axis);
        uz_select_first(list + of.first, of.end - of.first, half_of(of, 0).end - of.first);
        build_node(tree, list, box, half_of(of, 0));
        build_node(tree, list, box, half_of(of, 1));
    }
}

uz_status uz_box_tree_init(uz_box_tree *out, int64_t n, int dim, const double *box, uz_error *err)
{
    *out = (uz_box_tree){.dim = dim, .n = n, .levels = 1};
    for (int64_t most = n; most > LEAF; most = most - most / 2)
        out->levels++;
    out->item = uz_alloc(n, sizeof *out->item);
    out->box = uz_alloc(2 * dim * ((int64_t)1 << out->levels), sizeof *out->box);
    uz_placed *list = uz_alloc(n, sizeof *list);
    if (!out->item || !out->box || !list) {
        free(list);
        uz_box_tree_clear(out);
        return uz_fail(err, UZ_ERR_MEMORY, "", "no memory for a search tree of %lld boxes", (long long)n);
    }
    for (int64_t i = 0; i < n; i++)
        list[i].item = i;
    if (n > 0)
        build_node(out, list, box, (part){1, 0, n});
    for (int64_t i = 0; i < n; i++)
        out->item[i] = list[i].item;
    free(list);
    return UZ_OK;
}

void uz_box_tree_clear(uz_box_tree *tree)
{
    uz_free_all(tree->item, tree->box);
    memset(tree, 0, sizeof *tree);
}

double uz_box_distance(const double *box, int dim, const double *x)
{
    double sum = 0;
    for (int c = 0; c < dim; c++) {
        const double off = fmax(fmax(box[c] - x[c], x[c] - box[dim + c]), 0);
        sum += off * off;
    }
    return sum;
}

int64_t uz_box_tree_nearest(const uz_box_tree *tree, const double *x, double farthest, uz_item_distance *distance,
                            const void *ctx)
{
    struct {
        part of;
        double distance;
    } stack[MOST_LEVELS];
    int64_t found = -1;
    double best = farthest;
    int depth = 0;
    stack[depth].of = (part){1, 0, tree->n};
    stack[depth++].distance = 0;
    while (tree->n > 0 && depth-- > 0) {
        const part of = stack[depth].of;
        if (stack[depth].distance > best)
            continue;
        if (of.end - of.first > LEAF) {
            const part halves[2] = {half_of(of, 0), half_of(of, 1)};
            const double *box = tree->box + 2 * tree->dim * halves[0].node; /* that of the other follows it */
            const double far[2] = {uz_box_distance(box, tree->dim, x),
                                   uz_box_distance(box + 2 * tree->dim, tree->dim, x)};
            const int later = far[1] < far[0] ? 0 : 1;
            stack[depth].of = halves[later];
            stack[depth++].distance = far[later];
            stack[depth].of = halves[1 - later];
            stack[depth++].distance = far[1 - later];
            continue;
        }
        for (int64_t i = of.first; i < of.end; i++) {
            const double d = distance(ctx, tree->item[i], x, best);
            if (d < best || (d == best && isfinite(d) && (found < 0 || tree->item[i] < found))) {
                best = d;
                found = tree->item[i];
            }
        }
    }
    return found;
}

bool uz_box_tree_meet(const uz_box_tree *tree, const double *box, uz_item_visit *visit, void *ctx)
{
    part stack[MOST_LEVELS];
    int depth = 0;
    if (tree->n > 0)
        stack[depth++] = (part){1, 0, tree->n};
    while (depth > 0) {
        const part of = stack[--depth];
        const double *low = tree->box + 2 * tree->dim * of.node, *high = low + tree->dim;
        bool meets = true;
        for (int c = 0; c < tree->dim && meets; c++)
            meets = !(low[c] > box[tree->dim + c] || box[c] > high[c]);
        if (!meets)
            continue;
        if (of.end - of.first > LEAF) {
            stack[depth++] = half_of(of, 1);
            stack[depth++] = half_of(of, 0);
            continue;
        }
        for (int64_t i = of.first; i < of.end; i++)
            if (visit(ctx, tree->item[i]))
                return true;
    }
    return false;
}
