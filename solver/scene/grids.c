#include "scene/grids.h"

#include "scene/box.h"
#include "scene/check.h"
#include "scene/scene.h"

#include <math.h>

/* With fewer cells across, the averages of the stresses have too little to be compared with: the estimate would say too
 * little. */
enum { FIRST_LINEAR = 4, FIRST_QUADRATIC = 2 };

/* A coarsest grid of square cells beyond these has longer ones instead. */
#define FIRST_CELLS_2D 4096.0
#define FIRST_CELLS_3D 8192.0
/* And beyond this part of the dofs that there may be: by longer ones yet, step by step. */
#define FIRST_PART 0.5
#define LONGER     1.1

/* The next grid is aimed at a little less than what is asked for: missing it by a hair would take another one. */
#define AIM 0.97

/* Rates: of an error that does not fall yet, for so many steps at most; by how much two that are the same may differ.
 */
#define HARDLY_FALLS 0.3
#define STEADY       0.15
enum { MOST_IDLE = 4 };

/* A step back must save this share of the dofs. */
#define WORTH_SAVING 0.25

/* ---- the family */

/* Cells of a grid whose cells have this length. */
static double count_cells(const uz_box *box, double length, int64_t least)
{
    double count = 1.0;
    for (int axis = 0; axis < box->dim; axis++)
        count *= fmax((double)least, box->size[axis] / length);
    return count;
}

/* Cells of this length on the coarsest grid. */
static void take_length(uz_grids *grids, double length)
{
    for (int axis = 0; axis < grids->box.dim && axis < 3; axis++) {
        const double cells = grids->box.size[axis] / length / (double)grids->first;
        grids->per_n[axis] = cells > 0.0 && isfinite(cells) ? cells : 1.0;
    }
}

uz_grids uz_grids_of_box(const uz_box *box, double most_dofs)
{
    uz_grids grids = {.box = *box, .order = uz_box_lattice_of(box).order, .most_dofs = UZ_SCENE_MAX_DOFS};
    if (most_dofs > 0.0)
        grids.most_dofs = fmin(most_dofs, grids.most_dofs);
    grids.box.automatic = false;
    grids.first = grids.order == 2 ? FIRST_QUADRATIC : FIRST_LINEAR;
    grids.least = grids.order == 2 ? 1 : 2;
    const double most = box->dim == 3 ? FIRST_CELLS_3D : FIRST_CELLS_2D;
    double shortest = INFINITY, longest = 0.0;
    for (int axis = 0; axis < box->dim; axis++) {
        shortest = fmin(shortest, box->size[axis]);
        longest = fmax(longest, box->size[axis]);
    }
    double length = shortest / (double)grids.first; /* of the coarsest grid's cells; by bisection where too many */
    if (length > 0.0 && isfinite(longest) && count_cells(box, length, grids.least) > most) {
        double low = length;
        length = longest;
        for (int i = 0; i < 60; i++) {
            const double middle = sqrt(low) * sqrt(length);
            if (count_cells(box, middle, grids.least) > most)
                low = middle;
            else
                length = middle;
        }
    }
    take_length(&grids, length);
    for (; uz_grid_dofs(&grids, grids.first) > FIRST_PART * grids.most_dofs && length < longest; length *= LONGER)
        take_length(&grids, LONGER * length);
    return grids;
}

uz_grids uz_grids_of_scene(const uz_scene *scene, double most_dofs)
{
    const bool limited = scene->model == UZ_SOLID && uz_may_be_finite(scene);
    return uz_grids_of_box(&scene->box, limited ? UZ_MOST_FINITE_DOFS : most_dofs);
}

uz_box uz_grid(const uz_grids *grids, int64_t n)
{
    uz_box box = grids->box;
    for (int axis = 0; axis < 3; axis++) {
        const double cells = fmin((double)UZ_SCENE_MAX_DOFS, round((double)n * grids->per_n[axis]));
        box.cells[axis] = axis >= box.dim ? 0 : cells > (double)grids->least ? (int64_t)cells : grids->least;
    }
    return box;
}

double uz_grid_dofs(const uz_grids *grids, int64_t n)
{
    const uz_box box = uz_grid(grids, n);
    return uz_box_node_count(&box) * box.dim;
}

/* ---- the next one */

double uz_observed_rate(const uz_tried *coarse, const uz_tried *fine, int order)
{
    const double rate = log(coarse->error / fine->error) / log(fine->n / coarse->n);
    return isnan(rate) ? (double)order : fmin(order + 0.25, fmax(0.25, rate));
}

/* The n at which the error is expected to be what is aimed at. */
static double expect(const uz_tried *from, double rate, double requested)
{
    return from->n * pow(from->error / (AIM * requested), 1.0 / rate);
}

int64_t uz_next_grid(const uz_grids *grids, const uz_tried *tried, int count, double requested)
{
    const uz_tried *last = &tried[count - 1];
    const bool solid = grids->box.dim == 3;
    const double rate = count > 1 ? uz_observed_rate(last - 1, last, grids->order) : grids->order;
    /* little is known after one grid, and a solid grows with the cube */
    const double growth = count > 1 ? (solid ? 2.0 : 3.0) : (solid ? 1.6 : 2.0);
    const double wanted = expect(last, rate, requested);
    int64_t top = (int64_t)last->n, beyond = top + 1; /* the largest n whose grid is allowed, by bisection */
    while (uz_grid_dofs(grids, beyond) <= grids->most_dofs)
        beyond *= 2;
    while (beyond - top > 1) {
        const int64_t middle = top + (beyond - top) / 2;
        if (uz_grid_dofs(grids, middle) <= grids->most_dofs)
            top = middle;
        else
            beyond = middle;
    }
    /* The rate that no later grid is expected to exceed. An error that hardly falls is that of a contact or a corner
     * smaller than a cell, and falls with the order of the elements once the grid sees it; it may stay so for a few
     * grids. */
    int idle = 0;
    while (idle + 1 < count &&
           uz_observed_rate(&tried[count - idle - 2], &tried[count - idle - 1], grids->order) <= HARDLY_FALLS)
        idle++;
    const bool steady =
        count > 2 && idle == 0 && fabs(rate - uz_observed_rate(last - 2, last - 1, grids->order)) < STEADY;
    const double hope = steady || idle >= MOST_IDLE ? rate : grids->order;
    if ((double)top <= last->n || (count > 2 && expect(last, hope, requested) > 2.0 * (double)top))
        return 0;
    const double next = fmin(fmin(ceil(wanted), ceil(growth * last->n)), (double)top);
    return next > last->n ? (int64_t)next : (int64_t)last->n + 1;
}

int64_t uz_grid_between(const uz_grids *grids, const uz_tried *failed, const uz_tried *passed, double requested)
{
    const double rate = uz_observed_rate(failed, passed, grids->order);
    const double wanted = ceil(expect(failed, rate, requested));
    if (!(wanted < passed->n))
        return 0;
    const int64_t n = wanted > failed->n ? (int64_t)wanted : (int64_t)failed->n + 1;
    const bool saves = uz_grid_dofs(grids, n) <= (1.0 - WORTH_SAVING) * uz_grid_dofs(grids, (int64_t)passed->n);
    return (double)n < passed->n && saves ? n : 0;
}
