/* bound.h: a guaranteed bound on the whole error of an answer for a plane body or one of revolution, from a stress in
 * equilibrium.
 *
 * For a displacement u_h that supports and obstacle admit, and a stress sigma_h in equilibrium with the loads whose
 * pressure r_h on the obstacle is not negative, with the gap s_h that u_h leaves (Prager and Synge, "Approximations in
 * elasticity based on the concept of function space", Quart. Appl. Math. 5 (1947); with contact: Coorevits, Hild,
 * Hjiaj, SIAM J. Sci. Comput. 23 (2001))
 *
 *     1/2 |u - u_h|^2 + 1/2 |sigma - sigma_h|^2 + int r s_h + int r_h s  =  J(u_h) - D(sigma_h)  =:  G
 *
 * where all terms on the left are >= 0 and none is known, and all on the right is. D is maximized over polynomials on
 * macro elements: a quadratic problem with one unknown for each moment of an edge's displacement, of the kind that this
 * library solves (dual_problem.c). What comes back is taken for nothing but a stress, and looked at by code that has no
 * part in how it was made (check.c). */
#ifndef UZ_BOUND_BOUND_H
#define UZ_BOUND_BOUND_H

#include "assembly/assembly.h"
#include "core/hooks.h"
#include "obstacle/along.h"
#include "uzawa.h"

enum { UZ_BOUND_PARTS = 4, UZ_BOUND_POINTS = 6, UZ_BOUND_MOMENTS = 3, UZ_BOUND_LOOSE = 3 };

/* Does an edge face another one of the body (pairs.c)? What presses on a slave's edge does on the master's before it;
 * on one that is covered partly nothing may. */
typedef enum { UZ_BOUND_ALONE, UZ_BOUND_SLAVE, UZ_BOUND_PARTLY, UZ_BOUND_MASTER } uz_bound_facing;

/* A straight side of one or two elements, and what happens there. */
typedef struct {
    int64_t node[3];                   /* its ends, the first element on the left; its middle, -1: none */
    int64_t element[2];                /* the second -1: on the border */
    int side[2];                       /* number in the element */
    double axis[2][2];                 /* directions of its unknowns, orthonormal */
    bool held[2];                      /* along these: */
    double value[2];                   /* given displacement; 0 where free */
    int64_t contact;                   /* of the scene; -1: none */
    int64_t before, pieces;            /* what is before it: of body->before the first, how many; normal . u <= gap */
    bool turns;                        /* these are not one line: the normal turns along the edge, or leaps */
    bool presses;                      /* in the dual problem, which may leave out what is before an edge */
    double along[UZ_BOUND_MOMENTS][2]; /* where it turns: unit directions of the moments of what presses */
    double normal[2];                  /* of a slave and its masters: out of the slave */
    uz_bound_facing facing;
    double spring[2];   /* stiffness of the ground along x and y, force per length and area; 0: none */
    double traction[2]; /* of the loads, force per area, along x and y */
    double weight[2];   /* at the ends, linear between them: of rings their radius, which is 0 on the axis; else 1 */
} uz_bound_edge;

/* A part of a slave's edge, and the part of a master's that is before it. */
typedef struct {
    int64_t slave, master, contact; /* edges; of the scene */
    double part[2], on[2];          /* of each the same two places, 0 to 1 along it */
    double gap;                     /* along the slave's normal */
} uz_bound_segment;

/* A body as the continuum has it: what is between nodes, too. */
typedef struct {
    const uz_body_model *model; /* borrowed */
    int degree;   /* of the stresses: 1, with quadratic elements, and rings with axial forces in them, 2 */
    bool rings;   /* stresses, tractions and pressures are times the radius, as integrals need them */
    double depth; /* integrals are over the plane, with this and the weight: thickness, or 2 pi */
    int64_t n_edges;
    uz_bound_edge *edge;
    int64_t *edge_of; /* n_elements x 4: by the element's sides */
    int64_t n_segments;
    uz_bound_segment *segment; /* by slaves */
    double *force;             /* n_elements x 2: force per volume */
    double *free_strain;       /* n_elements; NULL: no temperature */
    uz_obstacle_pieces before; /* of all edges before obstacles */
    bool corners;              /* are there any among these obstacles? */
    double *map;     /* uz_bound_keep_maps: of each element, its stress's values by its unknowns; NULL: none kept */
    int64_t *map_at; /* n_elements: where an element's map is */
    int n_loose;     /* motions that only obstacles hold */
    double *motion;  /* n_loose x n_nodes x 2 */
    int n_pressed;   /* of uz_bound_hold: n_loose moments that the obstacle is to hold, as edge x (degree + 1) + a */
    int64_t pressed[UZ_BOUND_LOOSE];
    double
        pressed_at[UZ_BOUND_LOOSE]; /* what the dual problem has them at along the normal; NAN: the mean of the gap */
    char why[160];                  /* what of the scene is outside of what is proved, a clause; "": nothing */
} uz_bound_body;

/* model: of `scene`, at least its outline; borrowed. A scene that no bound is proved for is no failure: out->why says
 * what it is, and nothing else of *out means anything. UZ_ERR_MEMORY. */
uz_status uz_bound_body_make(uz_bound_body *out, const uz_body_model *model, const uz_scene *scene, uz_error *err);
void uz_bound_body_clear(uz_bound_body *body);

/* Puts middles of sides that are nearly amid them, as files with few digits have them, where they should be: the bound
 * is then one of that body. Returns how far one was off, the most, in parts of its side. Others stay. */
double uz_bound_straighten(uz_mesh *mesh);

/* Part of uz_bound_body_make: a contact of straight surfaces of the body. What is not is in body->why. UZ_ERR_MEMORY.
 */
uz_status uz_bound_take_pair(uz_bound_body *body, const uz_scene *scene, int64_t contact, uz_error *err);
/* W[a][b]: what of the b-th moment of a displacement along the master's edge there is in the a-th moment along the
 * slave's, over the segment. */
void uz_bound_segment_weights(double W[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS], const uz_bound_body *body,
                              const uz_bound_segment *segment);

/* Of a body that only obstacles hold in some motions: chooses what holds it in the dual problem. pressure: n_edges x
 * moments, what presses on obstacles by all that is known of it, 0 elsewhere. body->why where there is too little. */
void uz_bound_hold(uz_bound_body *body, const double *pressure);
/* That of an answer, from its pressure by nodes. out: n_edges x moments. */
void uz_bound_pressure_at_moments(double *out, const uz_bound_body *body, const double *pressure);
/* What a pressure, by resultants of an edge's moments, does on displacements at these, along x and y, into the
 * obstacle: what it does along the normal, which turns, or does not. */
void uz_bound_acts(double acts[UZ_BOUND_MOMENTS][2], const uz_bound_body *body, int64_t edge,
                   const double pressure[UZ_BOUND_MOMENTS]);
/* The work on a motion of such vectors: a polynomial of degree 1 along an edge, which has its moments. */
double uz_bound_work_on(const uz_bound_body *body, int motion, int64_t edge, double at[UZ_BOUND_MOMENTS][2]);
/* Which of the pressed moments an edge's a-th along the normal is; -1: none. */
int uz_bound_pressed(const uz_bound_body *body, int64_t edge, int a);
/* The mean along n of a motion over an edge with the a-th weight. */
double uz_bound_moved(const uz_bound_body *body, int motion, int64_t edge, int a, const double n[2]);
/* Part of uz_bound_body_make: n_loose and motion. */
uz_status uz_bound_loose_motions(uz_bound_body *body, uz_error *err);

/* Of the integrals over 0 to 1 of the products of the Bernstein polynomials that are an edge's weights the inverse, by
 * degree - 1. */
extern const double uz_bound_product_inverse[2][UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS];
/* The a-th Bernstein coefficient of the weight along an edge, of degree `body->degree`: what multiplies a constant
 * traction or stiffness. Where it is 0, at the axis, the traction is 0 for whatever stress: such moments of the
 * displacement are no unknowns. */
double uz_bound_weight(const uz_bound_body *body, int64_t edge, int a);
/* Length times depth: what means of the a-th moments are over. With the mean radius it is the area of a ring's side. */
double uz_bound_measure(const uz_bound_body *body, int64_t edge);
/* Coordinates of a node: on the axis of rings the radius is 0, whatever rounding made of it. */
void uz_bound_place(double at[2], const uz_bound_body *body, int64_t node);
/* The Bernstein polynomials of degree `moments` - 1 at a part of the way, 0 to 1. */
void uz_bound_bernstein(double phi[UZ_BOUND_MOMENTS], int moments, double part);
/* S: of a displacement whose moments along an edge are v, int |u|^2 times the weight is at least v'Sv, moments at the
 * axis apart. */
void uz_bound_springs(double S[UZ_BOUND_MOMENTS][UZ_BOUND_MOMENTS], const uz_bound_body *body, int64_t edge);
/* The obstacle before an edge, at a part of the way along it, 0 to 1: its gap, and the unit normal into it. */
double uz_bound_gap(double normal[2], const uz_bound_body *body, int64_t edge, double part);
/* The same by one of the pieces before it, of body->before. */
double uz_bound_piece_gap(double normal[2], const uz_bound_body *body, int64_t edge, int64_t piece, double part);
/* The line before an edge along which the normal does not turn. */
static inline const uz_obstacle_piece *uz_bound_line(const uz_bound_body *body, const uz_bound_edge *edge)
{
    return &body->before.at[edge->before];
}
/* The direction of the a-th moment of what presses: where the normal turns that of the polynomial next to it, so that a
 * traction along them, with coefficients that press, is nowhere against the normal. */
void uz_bound_normal(double normal[2], const uz_bound_body *body, int64_t edge, int a);
/* Directions of the unknowns of an edge's a-th moments: its axes, but where the normal turns and something presses,
 * where the first is that of uz_bound_normal. */
void uz_bound_axes(double axis[2][2], const uz_bound_body *body, int64_t edge, int a);
/* Part of uz_bound_body_make: what is before an edge, the i-th, of a contact; body->why where that is outside of what
 * is proved. UZ_ERR_MEMORY. */
uz_status uz_bound_take_obstacle(uz_bound_body *body, int64_t i, const uz_obstacle *obstacle, const char *on,
                                 uz_error *err);

/* The dual problem as min 1/2 v'Kv - p'v, h - Nv >= 0. An unknown is a mean of the displacement over an edge with one
 * of degree + 1 Bernstein polynomials as weight, along one of its axes (uz_bound_axes); -N'r are the resultants of the
 * pressure. dof   out: n_edges x (degree + 1) x 2: number of each unknown, -1: held, or at the axis. The caller frees
 * it Errors: UZ_ERR_SCENE (an element too distorted), _CANCELLED, _MEMORY. */
uz_status uz_bound_dual_problem(uz_qp *qp, int64_t **dof, const uz_bound_body *body, const uz_stop *stop,
                                uz_error *err);
/* The same without K, which stays empty: for another load on the same body. */
uz_status uz_bound_dual_load(uz_qp *qp, int64_t **dof, const uz_bound_body *body, const uz_stop *stop, uz_error *err);

/* Has the edge's a-th moment a row there? They come by edges and moments. */
bool uz_bound_has_row(const uz_bound_body *body, const int64_t *dof, int64_t edge, int a);
/* What that row has of a displacement that is 1 along the normal all along the edge: 1 but where that turns. */
double uz_bound_mean_along(const uz_bound_body *body, int64_t edge, int a);

/* The stress that belongs to the unknowns v, of rings times the radius: xx, yy, xy at the corners, of degree 2 also in
 * the middles of the edges 01, 12, 20, of each part of an element: n_elements x UZ_BOUND_PARTS x UZ_BOUND_POINTS x 3.
 * Part k has the corners k, k + 1 of the element and its centre (uz_bound_centre). The hoop stress is what radial
 * equilibrium makes it. On the axis all are 0, exactly: elsewhere of the stress itself energies would not be finite. */
uz_status uz_bound_stress(double *stress, const uz_bound_body *body, const int64_t *dof, const double *v,
                          const uz_stop *stop, uz_error *err);
/* Keeps what uz_bound_stress finds of each element by itself, which is most of its time, where that is not too large:
 * for bodies that it is called for many times. Errors as there. */
uz_status uz_bound_keep_maps(uz_bound_body *body, const uz_stop *stop, uz_error *err);
/* The point that parts an element: of a triangle the mean of its corners, of a quadrilateral the intersection of its
 * diagonals, where the conditions between the parts depend on each other; elsewhere there would be stresses of degree 1
 * in equilibrium too few, and an edge unknown without stiffness. */
void uz_bound_centre(double centre[2], const uz_bound_body *body, int64_t element);

/* Nodal forces (n_nodes x 2) of the scene's loads but temperature. UZ_ERR_SCENE, _MEMORY. */
uz_status uz_bound_loads(double *f, const uz_body_model *model, const uz_scene *scene, uz_error *err);

/* What a pressure (n_edges x moments, resultants) pushes nodes by, away from obstacles, as it works on displacements ->
 * push: n_nodes x 2; and the gap that u leaves at each -> open: n_nodes, INFINITY where nothing is before it. */
void uz_bound_push(double *push, double *open, const uz_bound_body *body, const double *pressure, const double *u);

/* Of a displacement between nodes, fully integrated: the potential energy, that of the strain alone, with springs', and
 * how far either is off at most. scene: with the loads of the case. UZ_ERR_MEMORY. */
uz_status uz_bound_potential(double *potential, double *strain, double *margin, const uz_bound_body *body,
                             const uz_scene *scene, const double *u, uz_error *err);

/* What check.c found, in energies: force times length. */
typedef struct {
    double gap;       /* int 1/2 |sigma_h - C eps(u_h)|^2 + int r_h s_h, with the terms of the violations and a
                       * margin for rounding: >= 0 */
    double lift;      /* norm of the displacement that takes u_h out of the obstacle */
    double norm;      /* of the strain of u_h that makes stress */
    double primal;    /* J(u_h), of the displacement between nodes and fully integrated */
    double dual;      /* D(sigma_h), from the stress */
    double defect;    /* what the residual works on u_h: J - D + defect is the gap but for the last two terms */
    double inside;    /* bound on the norm of what equilibrium within elements lacks: rounding */
    double turning;   /* the same of tractions that are not along a normal that turns, but for their moments */
    double least;     /* int |sigma_h - C eps(u_h)|^2, from below */
    double *residual; /* as many as unknowns: what edges lack of equilibrium */
    double *lifted;   /* n_nodes x 2: u_h with what takes its nodes out of the obstacle */
    double *pressure; /* n_edges x moments: r_h, as resultants */
    double *local;    /* n_elements: what each has of the gap; of what presses that at its side, where it is no less */
    bool pulls;       /* ... that what was chosen to hold the body would have to pull (uz_bound_hold) */
    char fault[160];  /* what is wrong, a clause: nothing is proved; "" */
} uz_bound_check_result;

/* u: n_nodes x 2. lift: n_nodes x 2, zero at supports: what is to take u out of obstacles whose normal turns; NULL: the
 * check finds something by itself, which it does for what this leaves in them, too, and has larger norms. scene: with
 * the loads of the case. The caller clears *out. UZ_ERR_MEMORY. */
uz_status uz_bound_check(uz_bound_check_result *out, const uz_bound_body *body, const uz_scene *scene,
                         const int64_t *dof, int64_t n_dofs, const double *u, const double *lift, const double *stress,
                         uz_error *err);

/* With each of n lifts, of which some may be NULL: the one that proves most, whatever the residual. */
uz_status uz_bound_check_lifts(uz_bound_check_result *out, const uz_bound_body *body, const uz_scene *scene,
                               const int64_t *dof, int64_t n_dofs, const double *u, const double *const *lifts, int n,
                               const double *stress, uz_error *err);

void uz_bound_check_clear(uz_bound_check_result *result);

/* Bound on the norm of all that equilibrium lacks, with that of the residual in the norm of K^-1. */
double uz_bound_lacking(const uz_bound_check_result *checked, double residual_norm);
/* The bound on |u - u_h| with the norm of the residual in that of K^-1 (K of the dual problem). As the moments q of a
 * displacement have q'Kq <= |u|^2, this is a norm of the residual over all displacements of the continuum. */
double uz_bound_error(const uz_bound_check_result *checked, double residual_norm);

#endif
