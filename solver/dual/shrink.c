/* shrink.c: a guess of the active rows from one that holds far too many.
 *
 * Dropping the rows that pull brings the border of such a guess half of the way: where a sphere is held to a circle of
 * radius a, and touches one of radius a0, the pressure at r is as 2 (a^2 - r^2) - (a^2 - a0^2) over the root of
 * a^2 - r^2 (Johnson, Contact Mechanics, 1985, ch. 4; of a cylinder likewise), and pulls from the middle between a0^2
 * and a^2 on. So as wide a band of rows that press goes with those that pull. Within a circle that is no longer: where
 * many more would go, what pulls is no border all around, but a side on which the body lifts. */
#include "dual/sparse.h"

#include "core/alloc.h"
#include "core/order.h"
#include "law/sign.h"

#include <math.h>

/* What a bounded dof is in the last guess. */
typedef enum { FREE, PRESSES, PULLS } part;

/* The dofs with bounds, by their place in the list of these, and links between those that share an element. */
typedef struct {
    const uz_bounded *box;
    part *part;     /* n */
    int32_t *links; /* n: of what pulls, to the next dof outside; of what presses, how many more go behind it */
    int32_t (*pair)[2];
    int64_t n, n_pairs, pulling, pressing;
} band;

/* The place of a dof, -1: it has no bounds. */
static int64_t place_of(const uz_bounded *box, int64_t dof)
{
    const int64_t place = uz_order_seek(box->dof, NULL, box->n, dof);
    return place < box->n && box->dof[place] == dof ? place : -1;
}

static bool find_pairs(band *x, const uz_csc *K)
{
    int64_t room = 0;
    for (int64_t b = 0; b < x->n; b++) {
        const int64_t j = x->box->dof[b];
        for (int64_t k = K->ptr[j] + 1; k < K->ptr[j + 1]; k++) {
            const int64_t other = place_of(x->box, K->idx[k]);
            if (other < 0)
                continue;
            if (!uz_grow(&x->pair, x->n_pairs, 1, &room, sizeof *x->pair))
                return false;
            x->pair[x->n_pairs][0] = (int32_t)b;
            x->pair[x->n_pairs++][1] = (int32_t)other;
        }
    }
    return true;
}

static bool begin(band *x, const uz_sparse_load *load)
{
    const uz_bounded *box = load->box;
    *x = (band){.box = box, .n = box->n};
    x->part = uz_alloc(x->n, sizeof *x->part);
    x->links = uz_alloc_zero(x->n, sizeof *x->links);
    if (!x->part || !x->links)
        return false;
    for (int64_t b = 0; b < x->n; b++) {
        const int64_t row = box->holder[b];
        x->part[b] = row < 0 ? FREE : uz_reaction_pulls(box->r[row]) ? PULLS : PRESSES;
        x->pulling += x->part[b] == PULLS;
        x->pressing += x->part[b] == PRESSES;
    }
    return true;
}

/* links of what pulls. */
static void count_from_outside(band *x)
{
    for (bool changed = true; changed;) {
        changed = false;
        for (int64_t k = 0; k < x->n_pairs; k++)
            for (int side = 0; side < 2; side++) {
                const int32_t own = x->pair[k][side], other = x->pair[k][1 - side], next = x->links[other] + 1;
                if (x->part[own] != PULLS || x->part[other] == PRESSES || (x->part[other] == PULLS && next == 1) ||
                    (x->links[own] > 0 && x->links[own] <= next))
                    continue;
                x->links[own] = next;
                changed = true;
            }
    }
}

/* Integrals of that pressure over bands as wide as a cell: the outermost one pulls where a exceeds a0 by 2/3 of a cell,
 * the second where by 2.9; halfway to two cells the first pulls 1.4 times as much as the second presses. */
#define STRONGER 1.4

/* links of what presses: behind what pulls as many as that is wide; behind a single row one, where that pulls much
 * more. Returns how many have some. */
static int64_t count_inwards(band *x)
{
    const double *force = x->box->force;
    for (bool changed = true; changed;) {
        changed = false;
        for (int64_t k = 0; k < x->n_pairs; k++)
            for (int side = 0; side < 2; side++) {
                const int32_t own = x->pair[k][side], other = x->pair[k][1 - side],
                              left = x->links[other] - (x->part[other] == PRESSES ? 1 : 0);
                if (x->part[own] != PRESSES || x->part[other] == FREE || left <= x->links[own])
                    continue;
                if (x->part[other] == PULLS && left == 1 &&
                    fabs(force[x->box->dof[other]]) < STRONGER * fabs(force[x->box->dof[own]]))
                    continue;
                x->links[own] = left;
                changed = true;
            }
    }
    int64_t going = 0;
    for (int64_t b = 0; b < x->n; b++)
        going += x->part[b] == PRESSES && x->links[b] > 0;
    return going;
}

/* Of all rows that are held no more than a quarter pulls, where the circle that touches is half of theirs. */
#define MOST 0.25
/* Of rows that press no more go than this times those that pull. On grids of cells circles reach 1.3. */
#define MOST_GOING 1.5

/* Is there a dof beyond its bound? */
static bool is_missing(const band *x)
{
    const uz_bounded *box = x->box;
    bool missing = false;
    for (int64_t b = 0; b < x->n && !missing; b++) {
        const double u = box->u[box->dof[b]];
        missing = x->part[b] == FREE && (u > box->top[b] || u < box->bottom[b]);
    }
    return missing;
}

bool uz_bounded_shrink(const uz_sparse_load *load, bool *active)
{
    band x;
    bool shrinks = begin(&x, load) && x.pulling > 0 && (double)x.pulling <= MOST * (double)(x.pulling + x.pressing) &&
                   !is_missing(&x) && find_pairs(&x, load->load.K);
    if (shrinks) {
        count_from_outside(&x);
        const int64_t going = count_inwards(&x);
        shrinks = going > 0 && (double)going <= MOST_GOING * (double)x.pulling;
    }
    for (int64_t b = 0; shrinks && b < x.n; b++)
        if (x.part[b] == PULLS || (x.part[b] == PRESSES && x.links[b] > 0))
            active[x.box->holder[b]] = false;
    uz_free_all(x.part, x.links, x.pair);
    return shrinks;
}
