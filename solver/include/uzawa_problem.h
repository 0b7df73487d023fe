/* uzawa_problem.h: what is asked: a problem, its load cases, and how to solve it. Part of uzawa.h. */
#ifndef UZAWA_PROBLEM_H
#define UZAWA_PROBLEM_H

#include "uzawa_matrices.h"
#include "uzawa_scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* -------------------------------------------------------------- problems */

typedef enum { UZ_PROBLEM_MATRICES, UZ_PROBLEM_SCENE } uz_problem_kind;

/* One of several loads on the body of a problem. What it leaves out (NULL) is the problem's own. */
typedef struct {
    char name[64];  /* unique in its problem */
    double *p, *h;  /* matrices: d, m */
    uz_load *loads; /* scenes: in place of all of the scene's loads; an empty list may be non-NULL: no load */
    int64_t n_loads;
    /* Kinematics FINITE: the answer begins where that of an earlier case is, whose name this is; "": at rest. */
    char after[64];
    bool has_part; /* loads and prescribed displacements are `part` times as large */
    double part;
    /* In the list of whoever made the problem one item may stand for several cases, the points of a path: so many more
     * cases than items there are before this one. Refusals name the item. */
    int64_t surplus;
} uz_load_case;

/* One number that a scene is solved for. */
typedef enum {
    UZ_QUANTITY_CONTACT_FORCE, /* the sum of the contact forces of `on`: integral of the pressure, >= 0 */
    UZ_QUANTITY_REACTION,      /* of the supports of `on` along `direction`, as it acts on the body */
    UZ_QUANTITY_DISPLACEMENT,  /* mean over the group `on`, along `direction` */
    UZ_QUANTITY_MEAN_PRESSURE, /* of the contacts of `on`, over the part of their sides between `low` and `high` */
    UZ_QUANTITY_STRAIN_ENERGY, /* of the whole body, with its springs */
    UZ_QUANTITIES              /* how many */
} uz_quantity_kind;
typedef struct {
    uz_quantity_kind kind;
    char name[64];          /* what it is called in the result; unique in its problem */
    char on[64];            /* a contact's, a support's or a group's name; contacts: "" is all of them */
    double direction[3];    /* unit */
    double low[3], high[3]; /* window, coordinates before anything moves */
    bool asked;             /* refusals call it "/solver/accuracy", others "/quantities/i": those without this one */
} uz_quantity;

typedef struct {
    uz_problem_kind kind;
    uz_qp qp;            /* UZ_PROBLEM_MATRICES */
    uz_scene scene;      /* UZ_PROBLEM_SCENE */
    uz_load_case *cases; /* n_cases of them; none: the problem's own load is the only one */
    int64_t n_cases;
    uz_quantity *quantities; /* scenes: n_quantities of them; only the first may be `asked` */
    int64_t n_quantities;
} uz_problem;
void uz_problem_clear(uz_problem *problem);
/* The scene with the loads of case i, from 0; its own where that has none, or is none. It borrows all it has. */
uz_scene uz_scene_of_case(const uz_problem *problem, int64_t i);

/* -------------------------------------------------------------- settings */

typedef enum {
    UZ_METHOD_AUTO,                /* active_set, else dual_active_set and conjugate by turns; no factor or paper rule:
                                    * accelerated_restart */
    UZ_METHOD_UZAWA,               /* Kanno, Algorithm 1 */
    UZ_METHOD_ACCELERATED,         /* Algorithm 2 without restart */
    UZ_METHOD_ACCELERATED_RESTART, /* Algorithm 2 */
    UZ_METHOD_ACTIVE_SET,          /* exact, by guessing which rows touch: condensed, or rows of one entry */
    UZ_METHOD_CONJUGATE,           /* projected conjugate gradients on the dual */
    UZ_METHOD_DUAL_ACTIVE_SET,     /* exact, one row after the other, with an updated factor */
    UZ_METHOD_GIVEN,               /* results of uz_verify only: the answer is the caller's */
    UZ_METHOD_LINEAR /* results only: without contact rows u is one linear solve, whatever was asked for */
} uz_method;
typedef enum {
    UZ_OPERATOR_AUTO,
    UZ_OPERATOR_CONDENSED,
    UZ_OPERATOR_FACTORED,
    UZ_OPERATOR_MATRIX_FREE,
    UZ_OPERATOR_DISTRIBUTED /* matrix_free by a group of processes: uz_hooks.group; never what AUTO becomes */
} uz_operator;
typedef enum { UZ_ORDERING_AUTO, UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS } uz_ordering;
typedef enum { UZ_STOP_CERTIFIED, UZ_STOP_PAPER } uz_stopping;
/* The rows of N that steps on the reactions are taken on. */
typedef enum {
    UZ_ROW_SCALING_AUTO, /* NONE for the methods of the paper by name, with its stopping rule and with an alpha, else
                            UNIT */
    UZ_ROW_SCALING_NONE, /* as they are given */
    UZ_ROW_SCALING_UNIT  /* each multiplied, with its h, by the power of two that makes its norm about 1 */
} uz_row_scaling;

typedef struct {
    uz_method method;
    uz_operator op;
    uz_ordering ordering;
    uz_stopping stopping;
    double relative_error; /* certified: ||u - u*||_K / ||u||_K (uz_certificate) asked for, in (0, 1]; 0: rounding */
    bool balanced;         /* scenes: relative_error is a tenth of the estimated discretization error instead */
    bool guaranteed;       /* scenes: bound the whole error, where that can be proved (uz_guarantee) */
    double total_error;    /* scenes on a given mesh: whole relative error that `converged` has to meet, too; 0: any */
    double quantity_error; /* > 0: half the interval of the problem's first quantity, relative to its middle, that
                            * `converged` has to meet as well; 0: none is asked for */
    double epsilon;        /* UZ_STOP_PAPER: stop when ||rho - r|| <= epsilon, a force */
    uz_row_scaling row_scaling;
    double alpha;           /* step size, of the rows that row_scaling leaves; 0: 1 / lambda_max(D) */
    int64_t max_iterations; /* >= 0 */
    double time_limit_s;    /* of the whole solve; INFINITY: none */
    bool semidefinite;      /* matrices: K is meant to be singular, its eigenvalues within rounding of 0 being 0 */
    bool step;              /* matrices: on the way to an answer that has a certificate of its own. What the method
                             * solves exactly, on a factor, gets none: its numbers are NaN. rcond is a rough estimate */
    size_t memory_limit; /* bytes for all of a solve; 0: none. AUTO goes on without a factor where one does not fit */
} uz_settings;
/* auto, certified 1e-8, 100000 iterations, no time limit. */
uz_settings uz_settings_default(void);

/* Names as in the HTTP interface ("accelerated_restart"); never NULL. uz_method_parse: false if the name is unknown. */
const char *uz_method_name(uz_method);
bool uz_method_parse(uz_method *out, const char *name);
/* The same of any enumeration of these: the name of a value ("unknown": it has none), the value of a name (-1: none).
 */
typedef enum {
    UZ_CHOICE_OPERATOR,
    UZ_CHOICE_ORDERING,
    UZ_CHOICE_STOPPING,
    UZ_CHOICE_ROW_SCALING,
    UZ_CHOICE_KINEMATICS,
    UZ_CHOICE_QUANTITY,
    UZ_CHOICE_OUTCOME
} uz_choice;
const char *uz_choice_name(uz_choice of, unsigned value);
int uz_choice_find(uz_choice of, const char *name);

#ifdef __cplusplus
}
#endif

#endif
