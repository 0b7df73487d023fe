/* uzawa_results.h: what is answered: summary, certificate, history, state, and the hooks of a running solve. Part of
 * uzawa.h. */
#ifndef UZAWA_RESULTS_H
#define UZAWA_RESULTS_H

#include "uzawa_problem.h"
#include "uzawa_trade.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --------------------------------------------------------------- results */

/* How a solve ended. */
typedef enum {
    UZ_CONVERGED, /* the certificate meets the request; nothing else is called converged */
    UZ_ITERATION_LIMIT,
    UZ_TIME_LIMIT,
    UZ_PRECISION_LIMIT, /* more was asked than double precision holds here */
    UZ_PAPER_RULE,      /* the paper's stopping rule ended it before the certificate met the request */
    UZ_INFEASIBLE,      /* no u is feasible: an exact ray was found */
    UZ_DISMISSED,
    UZ_VERIFIED,     /* uz_verify: the certificate of the given answer meets the request */
    UZ_NOT_VERIFIED, /* uz_verify: it does not; the bound says how far it reaches */
    UZ_MESH_LIMIT,   /* cells chosen here: the grid that would meet the request is larger than allowed */
    UZ_OUT_OF_REACH, /* every feasible u, if there is one, is at least infeasible_radius away, and none was certified */
    UZ_LOOSE,        /* semicoercive: no load presses the body on what would hold it; u is one place of many */
    UZ_MOVING_GEOMETRY, /* gaps and normals taken where the answer moves the surfaces to did not settle; the last answer
                         */
    UZ_UNSTABLE, /* finite: no stable equilibrium was reached under the whole load; the answer is that of the last part
                  * of it that has one (uz_finite.load) */
    UZ_INVERTED, /* finite: likewise, where beyond that part elements turn inside out */
    UZ_UNHELD    /* semicoercive, one of several load cases: its load pushes the body away from what would hold it, or
                  * along what nothing holds, and there is no answer; alone it is refused (UZ_ERR_FREE_BODY) */
} uz_outcome;

/* KKT residual of the paper, section 4: e1 = Ku - p - N'r, e2 = min(g, 0), e3 = max(r, 0), e4 = -g.r; 2-norms. */
typedef struct {
    double total, e1, e2, e3, e4;
} uz_residual;

typedef struct {
    double relative_error; /* bound on ||u - u*||_K over the energy norm of u*; INFINITY: nothing could be certified */
    double absolute_error; /* bound on ||u - u*||_K, sqrt(2 gap) */
    double gap;            /* pi(v) - psi(r) for the feasible v that the certificate built */
    double energy_primal;  /* pi(v) */
    double energy_dual;    /* psi(r) */
    double energy_norm;    /* ||u||_K; where supports move: over all dofs, without rigid motion (uz_bound_reference) */
    uz_residual residual;  /* absolute */
    uz_residual relative_residual; /* force by ||p||, length by the gap scale, energy by |psi| */
} uz_certificate;

typedef struct {
    double queue, parse, assemble, order, factor, condense, iterate, certify, total;
} uz_timings;                                              /* seconds; queue and parse are the caller's */
void uz_timings_add(uz_timings *sum, const uz_timings *t); /* all but queue and parse */

/* One row of the convergence history. Columns as in the HTTP interface. */
typedef struct {
    int64_t iteration;
    double seconds;        /* since the first iteration */
    double dual_objective; /* psi(r) */
    uz_residual residual;
    double step_norm;   /* ||rho - r||, the paper's stopping quantity; 0 in row 0 */
    double error_bound; /* bound on ||u - u*||_K of the best answer held so far; INFINITY until there is one */
    int64_t contacts;   /* rows with r < 0 */
    bool restart;
} uz_history_row;

typedef struct {
    uz_history_row *rows;
    int64_t count, capacity;
    int64_t stride; /* iterations between rows: 1 until the history is thinned */
} uz_history;

/* What an earlier solve had left in the cache: matrices of a scene; ordering and symbolic analysis (same pattern of K);
 * factor (same K); operator (same K and N). */
typedef struct {
    bool assembly, ordering, factor, op;
} uz_reuse;

/* A body that only the obstacle holds: K is singular, and the load presses the body on. */
typedef struct {
    int64_t free_modes; /* motions without stiffness, the null space of K; 0: the body is held by its supports */
    int64_t held;       /* rows proved to be in contact, on which the answer's uniqueness and its bound rest */
    int64_t held_by[8]; /* the first of them */
    int64_t rounds;     /* regularized problems solved to find them */
} uz_semicoercive;

/* What one form of the operator was expected to take. */
typedef struct {
    uz_operator op;
    double seconds, bytes;
    bool fits; /* the memory limit */
} uz_cost_option;

/* What a solve was expected to take after assembly, and what it took. bytes: matrices, factor and vectors together. */
typedef struct {
    double seconds, bytes, flops;
    double actual_seconds, actual_bytes;
    int actual_threads; /* that shared in some part of it, at most; that of the caller among them */
    uz_cost_option considered[4];
    int n_considered;
} uz_cost;

/* Where the iterations began. A state that is not one of this problem gives no more than its reactions, and a body that
 * only the obstacle holds begins at zero whatever was given. */
typedef enum { UZ_FROM_ZERO, UZ_FROM_REACTIONS, UZ_FROM_STATE } uz_origin;

/* What acts on the body at a group: force by direction and moment about the origin (plane: moment[2] alone). Rings: the
 * force along y; what acts along the radius sums to nothing around them, and there is no moment. */
typedef struct {
    char on[64];
    double force[3], moment[3];
    /* A support UZ_SUPPORT_RIGID: how its point is moved and the group turned (radians), and the moment about the
     * point.
     */
    bool rigid;
    double point[3], moved[3], turned[3], about[3];
} uz_resultant;

/* How one contact presses, whichever way it looks. Of a contact between bodies: on the sides that have the rows. */
typedef struct {
    double normal_force;  /* the sum of the forces along each place's normal, >= 0; of rings all around */
    double area;          /* of what touches */
    double mean_pressure; /* normal_force by area; NaN: nothing touches */
    double max_pressure;
    double center[3]; /* mean place of these forces, of rings in the half plane; NaN: there are none */
} uz_contact_total;

/* What the sides of one surface of a contact between two are taken for: in words, as the result has it. */
typedef struct {
    char group[64], shape[12];
    int64_t contact;
    bool slave;            /* its nodes have the rows */
    int64_t parts;         /* what corners divide it into; the shape is that of the largest */
    int dim;               /* of point and axis: 3, or 0 where the shape has none */
    double point[3];       /* centre, or a point of the axis */
    double axis[3];        /* unit; of a plane its normal; 0 of a sphere */
    double radius, tube;   /* 0: has none. Of a cone at `point`; of a torus of its middle circle and of its section */
    double slope;          /* of a cone: the radius grows by it along the axis */
    double largest_offset; /* length from the sides to the smooth surface */
    double largest_turn;   /* degrees from side to side where the surface is taken to be smooth */
    int64_t corners;       /* nodes at which sides turn by more than the feature angle, but as those of a curve may */
    double corner_turn;    /* degrees: the most that they do */
    bool free_form;        /* in space: some curved part is on no known shape */
} uz_contact_surface;

/* Something that makes the answer doubtful: as one of small deformation on a fixed contact geometry, or by its mesh. */
typedef struct {
    char code[24];     /* "large_rotation", ... */
    double value;      /* what was found, without unit */
    char message[160]; /* one sentence */
} uz_warning;

/* How the deformed surfaces of one contact stand to each other, measured at points that no row stands at. Lengths. */
typedef struct {
    double depth;  /* the largest overlap; 0: none, NaN: the contact has no sides to look at */
    double at[3];  /* where, on the deformed surface; 0 where there is none */
    double side;   /* size of the side there */
    double motion; /* the largest sum of the displacements of two points that face each other */
    double facets; /* the largest distance, near the contact, of facets from the smooth surface that they stand for */
    double facets_left; /* the same where the contact does not make up for it */
} uz_overlap;

/* Scenes: where the contact's geometry was taken, and what that leaves. Errors are in the energy norm, relative to the
 * certificate's. */
typedef struct {
    uz_kinematics kind; /* FIXED, or MOVING, FINITE: where the answer is, in `passes` solves */
    int64_t passes;
    double change;  /* MOVING: what the last pass changed. FIXED: what another would, where AUTO tried it, else NaN */
    double left;    /* MOVING: what further passes would change, by the rate at which they get smaller */
    double sliding; /* FIXED: how far gaps and normals are off where the answer has moved the surfaces to
                     * (post/sliding.c); NaN: not known */
} uz_geometry;

/* Scenes of kinematics FINITE: how the answer was reached, and what its certificate (certificate/finite.h) found. */
typedef struct {
    double load;    /* the part of loads and prescribed displacements that the answer is for: 1 is the whole. Of a case
                     * after another one: of the way from those of that one's answer */
    double part;    /* of cases with a part, or after another one: that of the scene's prescribed displacements, and of
                     * loads that both cases have, which the answer is for; else NaN */
    int64_t steps;  /* parts in which the load was put on, without those that failed */
    int64_t failed; /* and those */
    int64_t qps;    /* contact problems on a tangent that were solved, all together */
    int64_t most;   /* of these in one step that did not fail */
    int64_t held; /* those whose tangent had stiffness along pressed rows: they keep it stable, or it has just turned */
    int64_t shifted;  /* those where that was not enough, and stiffness of the undeformed body was added */
    double least_det; /* of the deformation gradient, at quadrature points and corners */
    double residual;  /* by which the answer's own Newton step would change it: in the norm of the tangent, relative to
                       * the root of twice the strain energy. An estimate of its error, not a bound */
    double least_gap; /* of points sampled on the deformed sides of the contacts: a length, < 0: within the obstacle */
    double displacement; /* the largest of a node: a length */
    bool definite;       /* the tangent is positive definite among motions that leave the pressed rows closed */
} uz_finite;

/* Scenes of kinematics AUTO whose rotations or strains were not surely small: what large deformation makes of them, by
 * their own laws, and by St. Venant and Kirchhoff's in place of the linear one, which it is where strains are small. */
typedef struct {
    bool compared;
    double error;   /* of small deformation: relative, of the displacements, of the resultants or of the root of the
                     * strain energy, whichever is most; INFINITY: large deformation has no answer under the whole load */
    const char *in; /* which of them: "displacements", "forces", "energy"; where asked for "stress", "quantities" */
    double load;    /* the part of it that it has a stable equilibrium under */
} uz_small;

/* A quantity of uz_problem: where its value for the body itself, without a mesh, is by estimate. */
typedef struct {
    uz_quantity_kind kind;
    char name[64];
    double found;            /* of this answer on this mesh */
    double value, low, high; /* the middle of the interval, and its ends; value alone where the others are NaN */
    double mesh, equations;  /* parts of half its width: what the mesh loses by estimate, what the solve leaves */
    char why[96];            /* why there is no interval; else "" */
    bool guaranteed;         /* the interval is proved (uz_settings.guaranteed); mesh is then half of it */
    char unproved[96];       /* asked for and not proved: a clause; else "" */
} uz_quantity_found;

/* A number of an answer that nothing bounds: where it goes with finer grids, by those that were solved (post/trend.h).
 */
typedef struct {
    /* by estimate, of the body itself. NaN: no range, and value is that of this mesh; high INFINITY: no limit is seen
     */
    double value, low, high;
    double order;  /* observed: what it is off falls as the size of elements to this power; NaN: none was */
    int64_t grids; /* that tell it: of different sizes of elements */
    char why[112]; /* why there is no range, or no order; else "" */
} uz_trend;

/* Where the body is stressed most, by the nodal stress of uz_fields. */
typedef struct {
    int64_t node; /* -1: nothing was measured, or no node has an element */
    double value, at[3];
    double size; /* of the elements around it: the root of their mean area or volume */
    uz_trend trend;
} uz_peak;

/* Scenes: what the answer comes to. */
typedef struct {
    double strain_energy; /* with that of springs */
    double spring_energy;
    double spring_error;     /* the square of what springs at nodes are off by, in the energy norm */
    double potential_energy; /* strain_energy less the work of the loads, over the whole body: that of the certificate
                              * leaves out what supported dofs add by themselves, and the loads' work on them */
    double kept_energy;  /* in neither of both: of warmth across the plane, in plane strain, which nothing changes. Of
                          * finite kinematics 0, and in both */
    double contact_area; /* tributary area of the rows with r < 0 */
    int64_t peak_node;   /* where max_pressure is; -1: no pressure */
    double peak_at[3];
    double peak_size;    /* of the side there: the root of its row's area in space, the area in the plane */
    uz_trend peak, area; /* of max_pressure and contact_area */
    bool stressed;       /* the scene asks for the two below */
    uz_peak von_mises;   /* von Mises' stress */
    uz_peak used;        /* that stress by the yield stress: the least of the materials around a node that have one */
    int64_t n_contacts, n_supports;
    uz_contact_total *totals; /* n_contacts */
    uz_resultant *contacts,
        *supports;      /* in the scene's order. Where several supports hold a node, each has its share */
    uz_resultant loads; /* all of them; on is "" */
    double loads_size;  /* the sum of the lengths of the forces on nodes that they are: they may hold each other */
    int64_t n_surfaces; /* of contacts between two surfaces, `on` and `with` of each */
    uz_contact_surface *surfaces;
    /* What the forces and moments (about the first node, by the body's extent) leave over, relative to the sum of the
     * forces' sizes. */
    double imbalance;
    uz_overlap *overlap; /* n_contacts */
    double approach;     /* see uz_contact_approach in post/overlap.h; a length, 0: nothing is pressed */
    double nonlinear;    /* of small deformation that large deformation could replace: what it leaves out, by
                          * uz_measure_nonlinear in post/balance.h; NaN: not measured */
    int n_warnings;
    uz_warning warnings[8];
    int64_t n_quantities;
    uz_quantity_found *quantities; /* in the problem's order */
    double asked;                  /* uz_settings.quantity_error */
    /* Where the mesh is refined: what each element has of the half width of the interval of the first quantity, if one
     * is asked for, as parts of its sum; or of the square of the error and of that of its adjoint, where both are
     * proved. NULL: neither. */
    double *share;
} uz_evaluation;
void uz_evaluation_free(uz_evaluation *evaluation);

/* Scenes: a guaranteed bound on the whole error, of mesh and equations together (bound/bound.h). */
typedef struct {
    bool asked, proved;
    double bound; /* on the energy norm of u - u_h, u of the continuum; INFINITY: none */
    double
        relative; /* the same over a lower bound of the norm of the stress of u; INFINITY where that is not positive */
    double primal, dual; /* energies that enclose the continuum's minimum, of a u_h that does not enter the obstacle */
    int64_t unknowns;    /* of the dual problem */
    double straightened; /* it is of a body with straight sides, whose middles were off by so much of a side; 0: none */
    double seconds;
    char why[160]; /* asked for and not proved: a clause; else "" */
} uz_guarantee;

/* One grid that was tried where cells are chosen or elements bisected. Of several load cases: the worst errors. */
typedef struct {
    int64_t cells[3]; /* of a box whose cells are chosen and whose elements are not bisected, else 0 */
    int64_t n_elements, d, iterations;
    double discretization_error;       /* estimated */
    double certified_error;            /* bound, of what the equations of this grid leave */
    double error;                      /* by which the request is judged (uz_asked_error) */
    double max_pressure, contact_area; /* of the case at hand; NaN: it has no answer here */
    double seconds;
} uz_grid_level;

enum { UZ_GRID_LEVELS = 40 };

/* The grids in the order in which they were tried; the answer is on one which need not be the last of them. */
typedef struct {
    int dim, count;
    uz_grid_level level[UZ_GRID_LEVELS];
    int64_t cells[3]; /* box whose cells are chosen: with them, or before elements were bisected; else 0 */
    int64_t n_elements;
    bool refined;
    int64_t n_bisected, *bisected; /* refined: makes its mesh, by uz_scene.bisected, from that which was given; round
                                    * after round how many elements, then which of them are to be bisected, once where
                                    * -2 stands before how many; those that become 4 or 8 of their kind are told by -1
                                    * before all rounds */
} uz_grid_sequence;

typedef struct {
    uz_outcome outcome;
    uz_origin origin;
    uz_method method;
    uz_operator op;
    uz_ordering ordering;
    int64_t d, m, iterations, restarts;
    int64_t refinements; /* corrections by the residual of the original data that made the certificate better */
    int64_t active;      /* rows with r < 0 */
    int64_t kept;        /* rows that the last round solved with, of m; the others are proved not to matter */
    int64_t added;       /* those of them that the first round had left out */
    int64_t rounds;      /* bodies that were solved: 1 unless a row that was left out turned out to matter */
    double reaction_sum, max_penetration;
    int dim;                    /* scene: 2 or 3, else 0 */
    double force[3];            /* scene: force of the body on the obstacle's normal side, sum of -r n */
    double max_pressure;        /* scene: the largest of the result's pressure; NaN otherwise */
    uz_row_scaling row_scaling; /* NONE, also where scaling all rows alike changed nothing, or UNIT */
    double alpha;               /* step size, of the rows that row_scaling says; NaN where no gradient step was taken */
    double lambda_max;          /* of N K^-1 N' with the caller's rows; NaN where no gradient step needed it */
    /* Scene: estimated energy-norm error of the mesh, relative to the strain that makes stress; NaN: no estimate. */
    double discretization_error;
    double stress_share;      /* scene: the energy norm of that strain over ||u||_K, 1 without temperature; else 0 */
    double infeasible_radius; /* out of reach: every feasible u has an entry of at least this; INFINITY: infeasible */
    uz_guarantee guarantee;
    double requested_error; /* the relative error that `converged` had to meet */
    uz_certificate certificate;
    uz_semicoercive semicoercive;
    uz_geometry geometry;
    uz_finite finite; /* geometry.kind FINITE only */
    uz_small small;
    bool factor_cached; /* everything about the body was */
    uz_reuse reused;
    bool contact_last; /* the dofs that N touches are eliminated after all others */
    int64_t factor_nnz;
    size_t factor_bytes;
    double factor_flops; /* additions and multiplications */
    double rcond;
    uz_cost cost;
    uz_timings timings;
    char message[256];               /* one sentence on the outcome where it is not `converged`; "" otherwise */
    const uz_evaluation *evaluation; /* scenes with an answer: the result's own; else NULL */
    const uz_grid_sequence *grids;   /* cells chosen or elements bisected: the result's own; else NULL */
} uz_summary;

/* The whole relative error in the energy norm: where one is proved, its bound; else the root of the sum of the squares
 * of *equations, what moving contacts left (uz_geometry.left), and, of a scene, the estimate of what its mesh loses.
 * INFINITY: not known. *equations: the
 * certificate's, of a scene relative to the strain that makes stress. May be NULL. */
double uz_total_error(double *equations, const uz_summary *summary);
/* What a request is met by where cells are chosen: the total error, or half the interval of the first quantity relative
 * to its middle where that was asked for. INFINITY: not known. */
double uz_asked_error(const uz_summary *summary);

/* Where a run stood when it ended: enough to go on as if it had not. Rows are the caller's.
 * A start that knows no more than reactions has rho NULL: a warm start. */
typedef struct {
    int64_t m;
    double *r;                           /* m, reactions; a warm start's are cut at 0 */
    double *rho;                         /* m or NULL: everything else below means something only beside it */
    double *Dr, *Drho, *best_r, *anchor; /* m */
    double alpha, tau;                   /* alpha 0: not chosen yet */
    bool as_given;                    /* alpha is of the rows as the caller wrote them; false: scaled to a norm of 1 */
    double step_norm;                 /* of the last iteration, as in the history; NaN: no step was taken */
    double best_bound, best_relative; /* of best_r; INFINITY: nothing was bounded yet */
    int64_t iteration, restarts, next_check, best_iteration;
    int64_t phase_end; /* iteration at which the phase ends; private to the methods, as is */
    int32_t phase;     /* of `auto` */
    uz_method method, made_by;
} uz_state;
void uz_state_free(uz_state *state);

typedef struct {
    uz_summary summary;
    int64_t d, m, n_nodes;
    double *u;        /* d; a scene's is n_nodes x dim by node, with the supported dofs, which d does not count */
    double *r;        /* m */
    double *g;        /* m */
    double *pressure; /* scene: m, as UZ_FIELD_PRESSURE; else NULL */
    double *place; /* scene: n_nodes x dim, the displacement at which its contacts were found, and with uz_scene.place
                      are found again; NULL: before anything moved */
    double *free_strain; /* of large deformation with temperature: n_free_strain, expansion times rise of each element,
                            for uz_scene.free_strain; else NULL */
    int64_t n_free_strain;
    double *ray;       /* infeasible: m, y <= 0 with N'y = 0, h'y > 0, the proof, rounded; out of reach: what bounds
                          infeasible_radius, h'y / ||N'y||_1. u, r, g are then NaN. Else NULL */
    uz_mesh_info mesh; /* scene only */
    uz_evaluation *evaluation;
    uz_grid_sequence *grids; /* cells chosen or elements bisected here; owns its list */
    uz_history history;
    uz_trade trade;
    uz_state *state; /* where the iterations stood; NULL: nothing to continue */
} uz_result;
void uz_result_free(uz_result *result);

/* Where a search for a grid stands, before it solves on the next one. */
typedef struct {
    double from, to;     /* shares of the whole, 0 to 1, that this grid begins and ends with, by estimate */
    int64_t number;      /* its own, from 1 */
    double unknowns;     /* displacements of its nodes */
    double error, asked; /* by which the request is judged: of the grid before, NaN for the first; what is asked for */
    /* Until the request is met, by how cost and error went from grid to grid so far; NaN: they do not tell yet. */
    double seconds_left;
} uz_grid_start;

/* The processes of an operator distributed, at the other end of a stream: a program of its own, uzawa-group. */
typedef struct uz_process_group uz_process_group;
uz_process_group *uz_process_group_new(int stream); /* has the descriptor from now on. NULL: no memory; it is closed */
/* It ended in the middle of a solve, whose error is then INTERNAL. */
bool uz_process_group_is_lost(const uz_process_group *group);
void uz_process_group_free(uz_process_group *group); /* and the processes end */

/* Asked between iterations and before every expensive step; from the solving thread. */
typedef struct {
    void *ctx;
    bool (*cancelled)(void *ctx);                           /* may be NULL */
    void (*progress)(void *ctx, const uz_history_row *row); /* may be NULL; after each iteration */
    void (*begins)(void *ctx, int64_t load_case);           /* may be NULL; before the first iteration of a case */
    void (*grid)(void *ctx, const uz_grid_start *grid); /* may be NULL; where the mesh is chosen: before each grid */
    /* May be NULL; where the mesh is chosen and the time limited: before each grid but the first, the max(1, n_cases)
     * results that the call would return if the time ended now. They are there during this call only. */
    void (*keep)(void *ctx, uz_result *const *results, int64_t n);
    /* may be NULL; the operator distributed: the group of processes to solve with, for as long as the call lasts. NULL:
     * none could be had; `why` (size bytes) then says so */
    uz_process_group *(*group)(void *ctx, char *why, size_t size);
} uz_hooks;

#ifdef __cplusplus
}
#endif

#endif
