/* grids.h: which grids a box whose cells are chosen may have, and which of them to try next. Pure functions.
 *
 * Grids are numbered by n: cells_i = max(least, round(n * size_i / unit)). Cells are near square; n is the number of
 * cells along the shortest side, unless the box is so slender or so flat that even its coarsest grid of square cells
 * would be a large one. A grading of the box is kept. */
#ifndef UZ_SCENE_GRIDS_H
#define UZ_SCENE_GRIDS_H

#include "uzawa.h"

typedef struct {
    uz_box box;       /* as asked for */
    int order;        /* 1, or 2 where edges have a node in their middle */
    int64_t first;    /* n of the coarsest grid */
    int64_t least;    /* cells along any side */
    double per_n[3];  /* cells along a side for each n */
    double most_dofs; /* no grid has more */
} uz_grids;

/* most_dofs <= 0: what a scene may have. A box that cannot be meshed has grids all the same: the mesh refuses them. */
uz_grids uz_grids_of_box(const uz_box *box, double most_dofs);
/* Those of its box. Solids that may have large deformation have fewer dofs. */
uz_grids uz_grids_of_scene(const uz_scene *scene, double most_dofs);
/* The box with the cells of grid n. */
uz_box uz_grid(const uz_grids *grids, int64_t n);
/* Displacements of its nodes. */
double uz_grid_dofs(const uz_grids *grids, int64_t n);

/* What a grid was found to be. n: its number, or of other meshes what grows as it does, the root (cubic in space) of
 * the number of nodes. error > 0: the largest total error of all load cases. */
typedef struct {
    double n, error;
} uz_tried;

/* q of error ~ n^-q as two grids show it, coarser first, kept between what a corner and what a smooth solution can have
 * (at most a little beyond the order of the elements). */
double uz_observed_rate(const uz_tried *coarse, const uz_tried *fine, int order);

/* The next grid after `count` >= 1 of them, none of which met the request, in ascending order; 0: none may be tried,
 * because of most_dofs or because even the largest is not expected to meet it. */
int64_t uz_next_grid(const uz_grids *grids, const uz_tried *tried, int count, double requested);
/* A coarser grid than `passed`, finer than `failed`, that is expected to meet the request with less than three quarters
 * of its dofs; 0: there is none. */
int64_t uz_grid_between(const uz_grids *grids, const uz_tried *failed, const uz_tried *passed, double requested);

#endif
