/* body_parts.h: the connected parts of a body, and how each can move as a whole.
 *
 * A small rigid motion is q = (translation t, rotation w times size) about the centre of its part:
 *     u(x) = t + w x (x - centre) / size.
 * In the plane only t_x, t_y and w_z are there, in a body of revolution only t_y, along its axis. A support that holds
 * the direction n at x forbids one combination of q, the row (n, (x - centre) / size x n). A part stays in place when
 * these rows span all of its motions. */
#ifndef UZ_ASSEMBLY_BODY_PARTS_H
#define UZ_ASSEMBLY_BODY_PARTS_H

#include "assembly/assembly.h"

enum { UZ_MOTIONS = 6 };

typedef struct {
    int64_t node; /* one of its nodes */
    double low[3], high[3];
    int rank;
    double held[UZ_MOTIONS][UZ_MOTIONS]; /* rank orthonormal rows: combinations of q that are forbidden */
} uz_part;

typedef struct {
    int dim;
    int motions;                         /* 3 in the plane, 1 of revolution, 6 in space */
    double unit[UZ_MOTIONS][UZ_MOTIONS]; /* motions of them: unit vectors of q, translations first */
    int64_t count, *of;                  /* of: n_nodes, the part of each node */
    uz_part *list;                       /* count, by their first nodes */
} uz_parts;

/* The parts, and what supports and springs hold of them. uz_parts_clear also after a failure. */
uz_status uz_find_parts(uz_parts *parts, const uz_body_model *model, uz_error *err);
void uz_parts_clear(uz_parts *parts);
/* Its steps: the motions of such a body; with of and count, the parts as they lie; what supports and springs hold. */
void uz_parts_begin(uz_parts *parts, const uz_body_model *model);
uz_status uz_list_parts(uz_parts *parts, const uz_mesh *mesh, uz_error *err);
void uz_hold_by_supports(uz_parts *parts, const uz_body_model *model);
/* A part reaches as far as this node. */
void uz_part_reach(uz_part *p, const uz_mesh *mesh, int64_t node);

double uz_part_size(const uz_part *p);

/* v (n) becomes what the orthonormal rows of basis (rank x n) leave of it, scaled to length 1: Gram and Schmidt, twice
 * for accuracy. False: nothing is left. */
bool uz_reject_rows(double *v, const double *basis, int64_t rank, int64_t n);
/* Appends v to the orthonormal rows, of which there is room for UZ_MOTIONS, unless they span it already. */
void uz_extend_rows(double rows[][UZ_MOTIONS], int *n, const double v[UZ_MOTIONS]);
/* The direction n (dim) is held, at x (dim) or at a node, whose part it is. */
void uz_hold_part_at(uz_parts *parts, uz_part *p, const double *x, const double *n);
void uz_hold_part(uz_parts *parts, const uz_mesh *mesh, int64_t node, const double *n);
/* Place of a node in its part, from the centre, over the size: a motion q moves it by q[0..2] + q[3..5] x place. */
void uz_place_in_part(double place[3], const uz_part *p, const uz_mesh *mesh, int64_t node);
/* Orthonormal motions that nothing holds, translations first. Returns how many. */
int uz_free_motions(double mode[UZ_MOTIONS][UZ_MOTIONS], const uz_parts *parts, const uz_part *p);

/* A motion in words: "translation along x", "rotation about (30, 0)"; directed: "translation along +x", "rotation about
 * (30, 0), clockwise". */
void uz_name_part_motion(char *text, size_t size, const uz_parts *parts, const uz_part *p, const double q[UZ_MOTIONS],
                         bool directed);

#endif
