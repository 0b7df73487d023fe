/* check.h: what the files of the check have in common. */
#ifndef UZ_BOUND_CHECK_H
#define UZ_BOUND_CHECK_H

#include "bound/bound.h"
#include "bound/walk.h"

typedef struct {
    uz_bound_check_result *out;
    const uz_bound_body *body;
    const uz_mesh *mesh;
    int moments;
    double *resultant;   /* n_edges x moments x 2: of the stress's tractions on the elements beside the edge */
    double *pressure;    /* n_edges x moments: r_h, as resultants */
    double *moved;       /* n_nodes x 2: room */
    double *lift;        /* n_nodes x 2: w, as far as it is of the nodes */
    const double *given; /* ... the part of it that came with the answer; NULL: none */
    double *gap;         /* n_elements: int 1/2 |sigma_h - C eps(u_h)|^2, from above */
    double sum, scale;   /* of elements: int 1/2 |sigma_h - C eps(u_h)|^2; of the sizes of what it is made of */
    double margin;       /* of the strain energy: what its integration may be off by */
    double own_margin;   /* of the complementary energy */
    double springs;      /* of the gap: int 1/2 |t + k u_h|^2 / k, t the traction where springs hold */
    double strain, complementary, inside, farthest; /* farthest: the largest displacement along an axis */
    double turning;                                 /* square of the result's */
    /* Of bulges, the part of w that is zero at all nodes: square of their norm, the gap of their elements, and the work
     * that the tractions do on them. */
    double bulge, bulged, bulge_work;
    double settled[UZ_BOUND_LOOSE]; /* what is taken off the pressures that hold motions, for equilibrium */
    const double *limit; /* n_edges x moments: what presses may pull as well, by so much at most; NULL: it may not, and
                          * presses by what it likes */
} examination;

/* Of the energies and works of elements: rounding of their sums. */
#define UZ_SUM_ROUNDING 1e-14

/* What depends on whether bodies are plane or of rings. A part is given by its corners and the values at its points; *
 * margin: what integration may be off by is added. */
typedef struct {
    /* int sigma : C^-1 : sigma / 2 over a part. lacks: what its equilibrium lacks at each corner, div sigma + force,
     * linear between them; of rings r times that, along the axis. */
    double (*part)(double lacks[3][2], double *margin, const examination *x, double corner[3][2], const double *s,
                   int64_t e);
    double (*expansion)(const examination *x, double corner[3][2], const double *s, double free_strain, int64_t e);
    /* int (eps(u) - expansion) : C : (eps(u) - expansion) / 2 over an element */
    double (*energy)(double *margin, const examination *x, const double *u, double free_strain, int64_t e);
    /* u of the element's nodes less a rigid motion, which no stress in equilibrium works on */
    void (*less_motion)(double v[2 * UZ_ELEMENT_NODES], const uz_element *element, int nodes);
} uz_check_of;

extern const uz_check_of uz_check_of_rings; /* check_ring.c */

/* Rings: is u zero along the radius, and the stress, wherever an element is on the axis? */
bool uz_is_finite_at_axis(const examination *x, const double *u, const double *stress, int64_t e);
/* An element with its own coordinates: those of equal boxes are one box's. */
void uz_take_element(uz_element *element, double xyz[3 * UZ_ELEMENT_NODES], const examination *x, int64_t e);
double uz_twice_area(double corner[3][2]);
/* Gradients of the coordinates that are 1 at a corner. */
void uz_triangle_slopes(double slope[3][2], double corner[3][2]);

/* An element's part of the sums, and the resultants of its tractions. */
void uz_examine_element(examination *x, const double *u, const double *stress, int64_t e);
/* Of the resultants, which are less the edge's load (uz_less_load): its pressure, and what is missing of equilibrium,
 * by the axes of its moments: of supports minus what they do. Springs take whatever acts: nothing is missing there. */
void uz_examine_tractions(double missing[UZ_BOUND_MOMENTS][2], examination *x, const double *u, int64_t i);
/* What presses at a moment that holds a motion has to be >= 0, else there is a fault. */
void uz_look_at_holding(examination *x, double pressure);
/* Of an edge that holds motions and whose normal turns, until they are settled: what is missing at its moments, along x
 * and y, if it presses by what the stress has there. */
void uz_missing_before(double missing[UZ_BOUND_MOMENTS][2], const examination *x, int64_t edge);
/* The part of a pressure that may be there. */
double uz_admit_pressure(const examination *x, int64_t moment, double pressure);
/* int sigma : expansion over a part, from the values at its points. */
double uz_expansion_work(const examination *x, double corner[3][2], const double *s, double free_strain, int64_t e);
/* The strain energy of the displacement between its nodes; *margin: what its integration may be off by. */
double uz_energy_of(double *margin, const examination *x, const double *u, bool with_expansion, int64_t e);
/* 1/2 int k |u|^2 of the springs along the edges. */
double uz_spring_energy(const examination *x, const double *u);
/* Of the loads but temperature, as the discrete problem has them: the edges have to agree with that. */
double uz_work_of_loads(const examination *x, const uz_scene *scene, const double *u, uz_status *status, uz_error *err);
/* What presses along an edge does on the gap: of the whole, and of its element. */
void uz_add_contact_gap(examination *x, const uz_bound_edge *edge, double work);

/* Means of a quadratic polynomial over an edge with the Bernstein polynomials of degree `moments` - 1 as weights. */
void uz_edge_means(double m[UZ_BOUND_MOMENTS], const double b[3], int moments);
/* A displacement (n_nodes x 2) along n on an edge: the Bernstein coefficients of a quadratic polynomial, from its
 * values at the ends and, where there is a node, in the middle. */
void uz_along_edge(double b[3], const double *u, const int64_t node[3], const double n[2]);
/* What was given to take the answer out of the obstacle, added to Bernstein coefficients along n. */
void uz_add_given(double b[3], const examination *x, const uz_bound_edge *edge, const double n[2]);

/* What rounding of places may be, as far as that is nothing to the displacements: a length. */
double uz_place_rounding(const examination *x);
/* The displacement of a node along what supports leave to it that is 1 along a normal; false: there is none. */
bool uz_way_along(double way[2], const uz_body_model *model, int64_t node, const double normal[2]);
/* Takes the load of an edge, the i-th, from the resultants of tractions. */
void uz_less_load(double *resultant, const examination *x, const uz_bound_edge *edge, int64_t i);
/* Makes w at a node (-1: none) at least `by` against the normal into the obstacle, along what supports leave to it. */
void uz_lift_node(examination *x, int64_t node, const double normal[2], double by);

/* Edges that face each other, check_pairs.c, once the tractions are known: what presses does on the masters, too; its
 * work is in the gap and in D, that of what they lack in the defect; UZ_ERR_MEMORY. Then w, where surfaces are in each
 * other; and what that comes to, once it is known at all nodes. */
uz_status uz_press_masters(examination *x, const double *u, const int64_t *dof, uz_error *err);
void uz_take_pairs_apart(examination *x, const double *u);
void uz_look_at_pairs(examination *x, const double *u);
/* Middles of slaves' edges go as the ends of w leave them straight. */
void uz_middle_slaves(examination *x);
/* What a displacement v (n_nodes x 2) does along a segment: the slave's less the master's, along the normal, as
 * uz_along_edge. */
void uz_along_segment(double b[3], const examination *x, const uz_bound_segment *segment, const double *v);
/* The work of a pressure (n_edges x moments, resultants) on such a polynomial. */
double uz_segment_work(const examination *x, const uz_bound_segment *segment, const double *pressure,
                       const double b[3]);

/* Makes w at a node (-1: none) go on by so much against the normal; false: supports leave no way. */
bool uz_lift_more(examination *x, int64_t node, const double normal[2], double by);

/* Edges along which the normal turns, check_turning.c. The first looks at the stress's tractions and where u_h leaves
 * its nodes: pressure, gap, w at the nodes and what is not along the normal, of which turned (moments x 2) are the
 * resultants that are missing. The second takes nodes on where corners are still in them: did it? The third, once w is
 * known at all nodes, bulges what is still in the obstacle out of it. */
void uz_examine_turning(double turned[UZ_BOUND_MOMENTS][2], examination *x, const double *u, int64_t edge);
bool uz_lift_turning(examination *x, const double *u, int64_t edge);
void uz_look_at_turning(examination *x, const double *u, int64_t edge);
/* Tractions that are missing on an edge and orthogonal to the polynomials of the degree there: int |delta|^2 along it.
 */
void uz_count_turning(examination *x, const uz_bound_edge *edge, double left);
/* Along such an edge: bulges out what |n . w - om| is more than m s, where s is the gap that u leaves and not below
 * zero: their norm, and the work of the pressure on them. */
void uz_bulge_excess(examination *x, const double *u, const double *w, double om, double m, const double *pressure,
                     int64_t edge);

#endif
