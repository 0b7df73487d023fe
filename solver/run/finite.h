/* finite.h: scenes of finite kinematics: large rotations and strains, contact where the body has gone.
 *
 *     uz_solve_finite    finite.c          load cases; the load put on in parts
 *     uz_finite_settle   finite_newton.c   the equilibrium under one part: contact problems on tangents
 *     uz_finite_place_find  finite_place.c  what follows from a displacement
 *     uz_finite_solve_qp finite_rows.c     a contact problem, of the rows that may press
 *     uz_finite_chord    finite_chord.c    steps on the factor of the last one
 *     uz_finite_turn     finite_turn.c     large steps of parts that turn
 *     uz_finite_correct  finite_pairs.c    what rows between bodies need in it
 *     uz_finite_hold_free  finite_free.c   bodies that only obstacles hold
 *     uz_finite_may_pass finite_passing.c  what a part may not have gone through
 *     uz_finite_report   finite_report.c   the answer as a result
 *     uz_finite_quantities  finite_quantities.c  the numbers that it was asked for
 *     uz_solve_weighed   weigh.c           whether small deformation is enough (kinematics AUTO) */
#ifndef UZ_RUN_FINITE_H
#define UZ_RUN_FINITE_H

#include "assembly/row_turn.h"
#include "cache/table.h"
#include "certificate/finite.h"
#include "core/hooks.h"
#include "finite/finite_body.h"
#include "finite/follower.h"
#include "obstacle/candidates.h"
#include "obstacle/obstacle.h"
#include "post/interpenetration.h"
#include "run/setup.h"
#include "uzawa.h"

/* The kind of run (solve.c): results as those of uz_solve_rounds. Every case is answered with its whole load, or with
 * the last part that has a stable equilibrium and the outcome UZ_UNSTABLE or UZ_INVERTED. Refuses what is not made for
 * it: errors at fixed moduli, bounds on the whole error. */
bool uz_is_finite(const uz_problem *problem);
uz_status uz_solve_finite(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                          const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
/* The same on a mesh of a sequence, whose refining asks for no other. near: displacements by node for each case, from
 * which its whole load is tried first; NULL of a case: none. Cases that are after others begin with these. effort: of
 * each case; NULL: all that it takes. */
typedef struct {
    double least; /* of the parts that a load is put on in, while none of it is borne; 0: as small as is worth it */
    int64_t qps;  /* contact problems, after which it ends as UZ_ITERATION_LIMIT; 0: as many as it takes */
} uz_finite_effort;
uz_status uz_solve_finite_near(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                               double *const *near, const uz_finite_effort *effort, const uz_hooks *hooks,
                               uz_error *err);

/* Another one: of kinematics AUTO with laws of finite strain, or a mesh that is chosen. Answers are those of small
 * deformation, of fixed kinematics, where that is not off by more than is tolerable, and under the linear law; else
 * those of uz_solve_finite. */
bool uz_is_weighed(const uz_problem *problem);
uz_status uz_solve_weighed(uz_result **results, const uz_problem *problem, const uz_settings *settings,
                           const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
/* Weighs an answer of small deformation to a problem without load cases, of kinematics AUTO: it gets summary.small, and
 * under a linear law stays with a warning; else *result becomes that of large deformation where it has to. started:
 * uz_seconds(), from which the time limit counts. */
uz_status uz_weigh_deformation(uz_result **result, const uz_problem *one, const uz_settings *settings,
                               const uz_hooks *hooks, double started, uz_error *err);

/* May an answer be one of large deformation, or be compared with it? */
bool uz_may_be_compared(const uz_scene *scene, const uz_body_model *model);

/* ---- shared by the files above */

/* One load. small: an answer that is to be compared, in the result's summary.small; NULL: none. */
typedef struct uz_finite_point uz_finite_point;
typedef struct {
    double part;                 /* of loads and prescribed displacements */
    const uz_finite_point *from; /* where it begins; NULL: at rest */
    uz_finite_point **to;        /* where it has come to; NULL: not wanted. The caller frees it */
    const double *near; /* of one from rest: displacements by node, about those of the answer; NULL: not known */
    uz_finite_effort effort;
} uz_finite_path;
void uz_finite_point_free(uz_finite_point *point);
/* path NULL: the whole load from rest. */
uz_status uz_solve_finite_load(uz_result **out, const uz_problem *one, const uz_settings *settings,
                               const uz_hooks *hooks, double deadline, const uz_result *small,
                               const uz_finite_path *path, uz_error *err);
uz_status uz_check_finite_settings(const uz_settings *settings, uz_error *err);
/* Of an answer on a mesh that is given: converged is mesh_limit where the whole error, or a quantity, is not known as
 * well as was asked. */
void uz_judge_finite(uz_result *result, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks);

/* A displacement, and what follows from it. Its rows are those of the body there. Free dofs of rigid groups are steps
 * from there: 0 here. */
typedef struct {
    double *u, *force, *loads; /* n: displacements by node, internal forces, loads: some may follow the body */
    double work;               /* of loads that follow, on the way here: they have no potential that is known */
    uz_finite_measure body;
    uz_body_model turned; /* the body, with rigid groups where they are here; rows are of it */
    double *given;        /* n_fixed: what is prescribed; of rigid groups the way to it from here */
    uz_body_model rows;
    double *h, *gap;  /* m of rows */
    double violation; /* the sum of the gaps that are negative */
} uz_finite_place;

typedef enum {
    UZ_PART_SETTLED,
    UZ_PART_UNSETTLED,     /* no equilibrium was found */
    UZ_PART_INDEFINITE,    /* one that is no minimum */
    UZ_PART_INVERTED,      /* the way to it turns elements inside out */
    UZ_PART_CONTRADICTORY, /* contact conditions that no displacement meets */
    UZ_PART_SWALLOWED,     /* an obstacle is inside of the body */
    UZ_PART_STOPPED        /* by time, or by the caller, or by a limit on iterations: run->stopped */
} uz_part;

/* An equilibrium, from which a path goes on: what it is under, and why it is not under the whole load of its case. */
struct uz_finite_point {
    double *u, *r, part; /* n, n_r; of prescribed displacements */
    int64_t n, n_r;
    uz_load *loads;
    int64_t n_loads;
    uz_finite_certificate certificate;
    uz_summary last; /* of the last contact problem; pointers are not to be read */
    bool whole;
    uz_part why;
    double tried;
    uz_outcome stopped;
};

typedef struct {
    const uz_problem *problem; /* of one case */
    uz_settings settings;      /* of the contact problems */
    double requested;          /* error of the answer; ... */
    bool balanced;             /* ... of which a tenth of the mesh's is enough */
    uz_hooks hooks;
    double deadline;
    uz_cache *cache;    /* of tangents: their ordering is found once */
    uz_matrix_key name; /* of the last one there: its pattern's digest, and its number */
    int64_t tangents;
    uz_scene scene; /* with supports and loads under `load`, of its own */
    double load;    /* t */
    const uz_finite_point
        *from; /* the way from there, or from rest (NULL) to `part` of the whole is put on in parts t */
    double part;
    uz_finite_effort effort;
    const double *near; /* n: from where the whole load is tried, until it was; NULL: nowhere but at rest */
    /* n_contacts: how deep nodes of the body at rest stand in the obstacle, which is set back by 1 - t of it, as
     * supports and loads are; 0 until a part of the load is asked for */
    double *overlap;
    uz_body_model base, tangent;
    uz_group outer;   /* all outer sides */
    bool pairs;       /* there is contact between bodies: */
    uz_csc wide;      /* the tangent's K with entries of their rows */
    const uz_csc *K;  /* of the last contact problem: that, or the tangent's own */
    uz_row_turn turn; /* of these rows at run->at */
    int64_t n, d;
    double *free_strain; /* n_elements: of the temperature under t; NULL: there is none */
    double *loads;       /* n: forces under t, but those that follow the body */
    bool follows;        /* there are such, */
    uz_csc skew;         /* and of the last tangent the skew part of their derivative (finite/follower.h) */
    double *prescribed;  /* n_fixed: under t */
    uz_finite_place at, trial;
    double *r; /* reactions of the rows that the last contact problem had, n_r of them */
    int64_t n_r;
    uz_candidates kept;          /* those of its rows that it was made with (finite_rows.c); in NULL: all */
    double *p, *v, *Kv;          /* d: room */
    double *step, norm;          /* n: the last step; in the energy's norm, 0: not known, infinite: the first */
    double penalty, hold, shift; /* of merits; what the last tangent had added, see finite_newton.c */
    double stiffest, grain;      /* of the undeformed body: its stiffest dof; what rounding may leave of an energy */
    int64_t step_qps;
    bool turned;     /* `at`, or the last trial, is not straight on from the place before (finite_turn.c) */
    bool unturned;   /* no part of it has turned on that way, as far as is known */
    uz_result *last; /* of the last contact problem: methods and factor */
    uz_timings spent;
    uz_outcome stopped;
    uz_finite_certificate certificate; /* of `at`, where a part has settled */
    uz_interpenetration passed;        /* the deepest of the parts on the way, and under what load that was */
    double passed_under;
    uz_finite found;
} uz_finite_run;

/* Room for a place, and what follows from its u; false in *fits: elements are inverted there, or there is no contact
 * geometry. */
uz_status uz_finite_place_init(uz_finite_place *place, const uz_finite_run *run, uz_error *err);
uz_status uz_finite_place_find(bool *fits, uz_finite_place *place, uz_finite_run *run, uz_error *err);
void uz_finite_place_clear(uz_finite_place *place);
/* What is prescribed there, and rigid groups as they are there. */
uz_status uz_finite_place_groups(uz_finite_place *place, const uz_finite_run *run, uz_error *err);
/* The free dofs (d) of a place, and the displacement (n) that others lead to from there by a straight step. */
void uz_finite_restrict(double *v, const uz_finite_place *place);
void uz_finite_lead(double *to, const uz_finite_place *place, const double *v);

/* Of a body that supports leave free (finite_free.c): run->tangent gets soft springs, which are at rest by `rest` (d)
 * from where the body is, as run->p has it; NULL: there. */
void uz_finite_hold_free(uz_finite_run *run, const double *rest);
/* Where it begins, at rest: run->tangent becomes its stiffness there, without what stress of warmth or pressures make
 * of motions that nothing holds yet. */
void uz_finite_begin_free(uz_finite_run *run);
/* Do the loads run->loads press the body at rest on, in all motions that supports leave free? UZ_ERR_FREE_BODY. */
uz_status uz_finite_check_pressed(const uz_finite_run *run, uz_error *err);

/* From run->at to the equilibrium under run->load. On UZ_PART_SETTLED run->at, r and certificate are those of the
 * equilibrium; else run->at is somewhere. */
uz_status uz_finite_settle(uz_part *out, uz_finite_run *run, uz_error *err);

/* Of a matrix in run->tangent or run->wide that no factor is known of (uz_finite_forget_factors), until the deadline;
 * its time counts. Where the reactions r (n_r) are of as many rows it begins with them. */
uz_status uz_finite_solve(uz_result **out, uz_finite_run *run, const uz_qp *qp, double *r, int64_t n_r, uz_error *err);
/* The contact problem of run->K, p and at.h: run->last, which is of all rows whatever run->kept becomes. */
uz_status uz_finite_solve_qp(uz_finite_run *run, uz_error *err);
bool uz_finite_is_solved(const uz_result *problem);
/* Those rows of a body that run->kept has (the caller clears N), and those of numbers of all rows. */
uz_status uz_finite_reduce(uz_csc *N, const uz_finite_run *run, const uz_body_model *rows, uz_error *err);
void uz_finite_gather(double *out, const uz_finite_run *run, const double *all);
/* The setup of run->K and of these rows of a place: that of a contact problem solved last, or, after
 * uz_finite_forget_factors, a new one. The caller releases it (run/setup_cache.h) to run->cache. */
uz_status uz_finite_acquire(uz_setup **out, uz_finite_run *run, const uz_finite_place *place, uz_error *err);

/* Of the step that run->last leads to: sqrt(v'K v) over the root of twice the energy; 0 where that energy is rounding.
 */
double uz_finite_step_norm(uz_finite_run *run);
double uz_finite_norm(uz_finite_run *run); /* of the step run->v */

/* A step from run->at on the setup of the contact problem that led there, as long as run->K is that problem's. to (n),
 * r (n_r): the place that it leads to and its reactions; norm: its own. *found false: rows that press would have to
 * open, or others are penetrated. */
uz_status uz_finite_chord(bool *found, double *norm, double *to, double *r, uz_finite_run *run, const uz_setup *setup,
                          uz_error *err);

/* Another tangent has another factor; its ordering stays. */
void uz_finite_forget_factors(uz_finite_run *run);
/* p less what run->tangent makes of the ways that supports still have to go from a place. *moved: are there any? */
void uz_finite_move_supports(bool *moved, uz_finite_run *run, const uz_finite_place *from);

/* run->trial.u, a linear step from run->at, becomes the place that it leads to if its parts turn, where that makes more
 * of a difference than the strain that the step is for (*turned); run->tangent is of no use then. */
uz_status uz_finite_turn(bool *turned, uz_finite_run *run, uz_error *err);

/* May a point go straight from x along `way`? Where it is within the obstacle it has to be so on the side where it went
 * in: what comes out behind, or nears it, has been led through the obstacle, and what would have stopped it is not seen
 * any more. */
bool uz_finite_may_go(const uz_obstacle *obstacle, const double *x, const double *way);
/* May the sides of contacts go straight from one displacement to another (n each), past round obstacles, which may be
 * smaller than a side, and past those of other bodies? What goes into one of these must not come out behind; nor
 * `beside`, as at a corner. */
uz_status uz_finite_may_pass(bool *may, const uz_finite_run *run, const double *from, const double *to, bool beside,
                             uz_error *err);

/* Of rows between bodies. run->K becomes the tangent with run->turn, and, where `hold`, room for stiffness along
 * those that were pressed. */
uz_status uz_finite_widen(uz_finite_run *run, bool hold, uz_error *err);
/* From the contact problem just solved to that on the whole tangent, which is not symmetric. */
uz_status uz_finite_correct(uz_finite_run *run, uz_error *err);
/* run->p += times what the skew part of loads that follow makes of v (d). nodal: room, 2 n. */
void uz_finite_add_skew(uz_finite_run *run, double times, const double *v, double *nodal);
/* Reactions of the rows `from` stay with their places among those of run->at, where places come and go as bodies slide.
 */
uz_status uz_finite_carry_reactions(uz_finite_run *run, const uz_body_model *from, uz_error *err);

/* run->K becomes the tangent at run->at with r times the curvature of gaps and stiffness `hold` along the pressed rows.
 */
uz_status uz_finite_hold_tangent(uz_finite_run *run, double hold, uz_error *err);
/* The problem's quantities, of the answer run->at, which has been evaluated. */
uz_status uz_finite_quantities(uz_result *answer, uz_finite_run *run, uz_error *err);

/* *out: the answer run->at under run->load. why: of the part beyond it that was tried last, `tried`. */
uz_status uz_finite_report(uz_result **out, uz_finite_run *run, uz_part why, double tried, uz_error *err);
/* Why a part was UZ_PART_STOPPED: the beginning of a sentence. */
const char *uz_explain_stop(uz_outcome stopped);
/* What a run holds, beside the largest of what its contact problems and its certificates take. rows: a body moved to a
 * place, NULL: not there yet. */
double uz_finite_bytes(const uz_body_model *base, const uz_body_model *rows, bool pairs);
/* How far the answer `small` is off from *result, that of run; its warning large_strain gets to know. UZ_ERR_MEMORY. */
uz_status uz_finite_compare(uz_small *out, const uz_finite_run *run, const uz_result *result, const uz_result *small,
                            uz_error *err);

#endif
