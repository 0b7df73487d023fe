/* uzawa.h: the one public header of the contact solver library. It includes its parts on scenes, on fields and on the
 * trade.
 *
 * The library answers one question: where does an elastic body touch, how hard, and how far can that
 * answer be from the exact one?  In the notation of Kanno, "An accelerated Uzawa method for application
 * to frictionless contact problem":
 *
 *     minimize 1/2 u'Ku - p'u   subject to   g(u) = h - N u >= 0
 *
 * K  d x d  stiffness, symmetric positive definite      u  d  displacement
 * N  m x d  outward contact normals, a row per contact  r  m  reaction, <= 0 (compression negative)
 * p  d      load                                        g  m  gap, >= 0
 * h  m      initial gap
 *
 * Units are the caller's own and consistent; nothing here depends on them.
 *
 * Contracts that hold for every function unless it says otherwise:
 *   - the return value says how a *call* failed; how a *solve* ended is uz_outcome in its summary;
 *   - *err (may be NULL) is written on failure only; the innermost cause wins;
 *   - outputs are NULL or zero at entry and published only on success;
 *   - every X_free takes NULL and half-built objects;
 *   - no function prints, exits, touches signal dispositions or keeps global state.
 */
#ifndef UZAWA_H
#define UZAWA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------ errors */

/* How a call failed. */
typedef enum {
    UZ_OK = 0,
    UZ_ERR_MEMORY,        /* an allocation failed, or a size would overflow */
    UZ_ERR_ARGUMENT,      /* the caller broke this header's contract */
    UZ_ERR_FORMAT,        /* Matrix Market text is malformed: see line */
    UZ_ERR_UNSUPPORTED,   /* well formed, but a kind that is not solved here (complex, pattern, ...) */
    UZ_ERR_SIZE,          /* shapes do not agree */
    UZ_ERR_NOT_FINITE,    /* NaN or Inf in the input, or produced by overflow */
    UZ_ERR_NOT_SYMMETRIC, /* K differs from K' */
    UZ_ERR_NOT_SPD,       /* K is not positive definite to working precision */
    UZ_ERR_FREE_BODY,     /* supports leave a rigid-body mode free */
    UZ_ERR_SCENE,         /* a scene that cannot be modelled: unknown group, inverted element, ... */
    UZ_ERR_LIMIT,         /* more memory than allowed */
    UZ_ERR_CANCELLED,     /* the cancel hook said so before there was an answer to return */
    UZ_ERR_IO,            /* reading or writing a file failed */
    UZ_ERR_INTERNAL       /* a bug: an invariant did not hold */
} uz_status;

/* What went wrong, for a person and for a program. */
typedef struct {
    uz_status status;
    char where[96];    /* which input: "K", "h", "/contacts/0/on" (JSON pointer into the problem); "" if none */
    int64_t line;      /* 1-based line of Matrix Market text, 0 if none */
    char message[512]; /* what is wrong and what to do, UTF-8, no trailing newline */
} uz_error;

/* Stable machine name of a status: "not_positive_definite", ... Never NULL. */
const char *uz_status_name(uz_status status);

/* ------------------------------------------------------- sparse matrices */

/* Compressed sparse columns. Rows ascend within a column and no entry occurs twice.
 * A symmetric matrix is stored as its lower triangle, diagonal included; the text says where. */
typedef struct {
    int64_t rows, cols;
    int64_t *ptr; /* cols + 1 */
    int64_t *idx; /* ptr[cols], row of each entry */
    double *val;  /* ptr[cols] */
} uz_csc;

/* Allocates ptr, idx, val for `nnz` entries, all zero. A previous content of *A is not freed. */
uz_status uz_csc_init(uz_csc *A, int64_t rows, int64_t cols, int64_t nnz, uz_error *err);
void uz_csc_clear(uz_csc *A); /* frees the arrays and zeroes *A */
uz_status uz_csc_copy(uz_csc *out, const uz_csc *A, uz_error *err);
uz_status uz_csc_transpose(uz_csc *out, const uz_csc *A, uz_error *err);

/* Builds a CSC matrix from `count` triplets (0-based), adding entries that occur twice in the order given. */
uz_status uz_csc_from_triplets(uz_csc *out, int64_t rows, int64_t cols, int64_t count, const int64_t *row,
                               const int64_t *col, const double *val, uz_error *err);

/* y += alpha A x and y += alpha A' x. x and y do not overlap. */
void uz_csc_gaxpy(double *y, const uz_csc *A, double alpha, const double *x);
void uz_csc_gaxpy_t(double *y, const uz_csc *A, double alpha, const double *x);
/* y += alpha A x for symmetric A given by its lower triangle. */
void uz_csc_symv(double *y, const uz_csc *A, double alpha, const double *x);

/* --------------------------------------------------------- Matrix Market */

typedef enum { UZ_MM_COORDINATE, UZ_MM_ARRAY } uz_mm_format;
typedef enum { UZ_MM_GENERAL, UZ_MM_SYMMETRIC } uz_mm_symmetry;

/* What the banner and the size line said. */
typedef struct {
    uz_mm_format format;
    uz_mm_symmetry symmetry;
    bool integer; /* field was "integer" */
    int64_t rows, cols, entries;
} uz_mm_info;

/* Reads a whole Matrix Market text of `len` bytes (NUL not needed) as a matrix. A symmetric file gives the
 * lower triangle (see info->symmetry); duplicates in a coordinate file are refused; exact zeros are kept.
 * max_bytes (0: none) bounds what the result may take. Errors: UZ_ERR_FORMAT, _UNSUPPORTED, _NOT_FINITE,
 * _LIMIT, _MEMORY, with the line. Source: Boisvert, Pozo, Remington, NISTIR 5935 (1996). */
uz_status uz_mm_read(uz_csc *out, uz_mm_info *info, const char *text, size_t len, size_t max_bytes, uz_error *err);

/* Reads a text that is a vector (n x 1 or 1 x n, array or coordinate); *out has *n numbers, the caller frees it. */
uz_status uz_mm_read_vector(double **out, int64_t *n, const char *text, size_t len, size_t max_bytes, uz_error *err);

/* Writes coordinate text that reads back bit for bit (shortest digits that do). *text is NUL-terminated, caller frees.
 */
uz_status uz_mm_write(char **text, size_t *len, const uz_csc *A, uz_mm_symmetry symmetry, uz_error *err);
/* Writes array text, n x 1. */
uz_status uz_mm_write_vector(char **text, size_t *len, const double *x, int64_t n, uz_error *err);

/* Reads the decimal number at the start of text[0..len): digits, one '.', an exponent, a sign; no NaN, Inf or hex.
 * Returns the bytes used, 0 if there is no number; *value is correctly rounded, +-Inf on overflow. */
size_t uz_parse_double(double *value, const char *text, size_t len);

/* Writes the shortest decimal that reads back as the finite x (of several the nearest one), in %g's style whatever the
 * locale. Returns its length, at most 24; out has room for UZ_DOUBLE_ROOM and gets no NUL. */
enum { UZ_DOUBLE_ROOM = 32 };
size_t uz_format_double(char *out, double x);
/* The same for integers: at most 20 digits. */
size_t uz_format_integer(char *out, uint64_t value);

/* -------------------------------------------------------------- problems */

/* A problem in matrices. K: lower triangle. N: general. p: d. h: m. */
typedef struct {
    uz_csc K, N;
    double *p, *h;
} uz_qp;
void uz_qp_clear(uz_qp *qp);
/* Full validation: shapes, finiteness. */
uz_status uz_qp_check(const uz_qp *qp, uz_error *err);
/* Replaces a general square K by its lower triangle; UZ_ERR_NOT_SYMMETRIC names the worst pair. The tolerance is
 * relative to the larger diagonal of the pair: 1e-12; within it the two halves are averaged. */
uz_status uz_symmetric_lower(uz_csc *K, uz_error *err);

#include "uzawa_scene.h" /* uz_scene: mesh, materials, supports, loads, contacts */

typedef enum { UZ_PROBLEM_MATRICES, UZ_PROBLEM_SCENE } uz_problem_kind;

/* One of several loads on the body of a problem. What it leaves out (NULL) is the problem's own. */
typedef struct {
    char name[64];  /* unique in its problem */
    double *p, *h;  /* matrices: d, m */
    uz_load *loads; /* scenes: in place of all of the scene's loads; an empty list may be non-NULL: no load */
    int64_t n_loads;
} uz_load_case;

typedef struct {
    uz_problem_kind kind;
    uz_qp qp;            /* UZ_PROBLEM_MATRICES */
    uz_scene scene;      /* UZ_PROBLEM_SCENE */
    uz_load_case *cases; /* n_cases of them; none: the problem's own load is the only one */
    int64_t n_cases;
} uz_problem;
void uz_problem_clear(uz_problem *problem);

/* -------------------------------------------------------------- settings */

typedef enum {
    UZ_METHOD_AUTO,                /* active_set, else conjugate; no factor or paper rule: accelerated_restart */
    UZ_METHOD_UZAWA,               /* Kanno, Algorithm 1 */
    UZ_METHOD_ACCELERATED,         /* Algorithm 2 without restart */
    UZ_METHOD_ACCELERATED_RESTART, /* Algorithm 2 */
    UZ_METHOD_ACTIVE_SET,          /* exact, by guessing which rows touch: condensed, or rows of one entry */
    UZ_METHOD_CONJUGATE,           /* projected conjugate gradients on the dual */
    UZ_METHOD_GIVEN,               /* results of uz_verify only: the answer is the caller's */
    UZ_METHOD_LINEAR /* results only: without contact rows u is one linear solve, whatever was asked for */
} uz_method;
typedef enum { UZ_OPERATOR_AUTO, UZ_OPERATOR_CONDENSED, UZ_OPERATOR_FACTORED, UZ_OPERATOR_MATRIX_FREE } uz_operator;
typedef enum { UZ_ORDERING_AUTO, UZ_ORDERING_CAMD, UZ_ORDERING_AMD, UZ_ORDERING_METIS } uz_ordering;
typedef enum { UZ_STOP_CERTIFIED, UZ_STOP_PAPER } uz_stopping;

typedef struct {
    uz_method method;
    uz_operator op;
    uz_ordering ordering;
    uz_stopping stopping;
    double relative_error;  /* certified: ||u - u*||_K / ||u||_K (uz_certificate) asked for, in (0, 1]; 0: rounding */
    bool balanced;          /* scenes: relative_error is a tenth of the estimated discretization error instead */
    double epsilon;         /* UZ_STOP_PAPER: stop when ||rho - r|| <= epsilon, a force */
    double alpha;           /* step size; 0: 1 / lambda_max(D) */
    int64_t max_iterations; /* >= 0 */
    double time_limit_s;    /* of the whole solve; INFINITY: none */
    bool semidefinite;      /* matrices: K is meant to be singular, its eigenvalues within rounding of 0 being 0 */
    size_t memory_limit; /* bytes for all of a solve; 0: none. AUTO goes on without a factor where one does not fit */
} uz_settings;
/* auto, certified 1e-8, 100000 iterations, no time limit. */
uz_settings uz_settings_default(void);

/* Names as in the HTTP interface ("accelerated_restart"); never NULL. uz_*_parse: false if the name is unknown. */
const char *uz_method_name(uz_method);
const char *uz_operator_name(uz_operator);
const char *uz_ordering_name(uz_ordering);
const char *uz_stopping_name(uz_stopping);
bool uz_method_parse(uz_method *out, const char *name);
bool uz_operator_parse(uz_operator *out, const char *name);
bool uz_ordering_parse(uz_ordering *out, const char *name);
bool uz_stopping_parse(uz_stopping *out, const char *name);

/* --------------------------------------------------------------- results */

/* How a solve ended. */
typedef enum {
    UZ_CONVERGED, /* the certificate meets the request; nothing else is called converged */
    UZ_ITERATION_LIMIT,
    UZ_TIME_LIMIT,
    UZ_PRECISION_LIMIT, /* more was asked than double precision holds here */
    UZ_PAPER_RULE,      /* the paper's stopping rule ended it before the certificate met the request */
    UZ_INFEASIBLE,
    UZ_DISMISSED,
    UZ_VERIFIED,     /* uz_verify: the certificate of the given answer meets the request */
    UZ_NOT_VERIFIED, /* uz_verify: it does not; the bound says how far it reaches */
    UZ_MESH_LIMIT    /* cells chosen here: the grid that would meet the request is larger than allowed */
} uz_outcome;
const char *uz_outcome_name(uz_outcome);

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
} uz_timings; /* seconds; queue and parse are the caller's */

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

#include "uzawa_trade.h" /* uz_trade: what accuracy took */

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
    uz_cost_option considered[3];
    int n_considered;
} uz_cost;

/* Where the iterations began. A state that is not one of this problem gives no more than its reactions, and a body that
 * only the obstacle holds begins at zero whatever was given. */
typedef enum { UZ_FROM_ZERO, UZ_FROM_REACTIONS, UZ_FROM_STATE } uz_origin;

/* What acts on the body at a group: force by direction and moment about the origin (plane: moment[2] alone). Rings: the
 * force along y; that along x is its sum around the ring, and there is no moment. */
typedef struct {
    char on[64];
    double force[3], moment[3];
} uz_resultant;

/* Something that makes the answer doubtful: as one of small deformation on a fixed contact geometry, or by its mesh. */
typedef struct {
    char code[24];     /* "large_rotation", ... */
    double value;      /* what was found, without unit */
    char message[160]; /* one sentence */
} uz_warning;

/* Scenes: what the answer comes to. */
typedef struct {
    double strain_energy; /* with that of springs */
    double contact_area;  /* tributary area of the rows with r < 0 */
    int64_t peak_node;    /* where max_pressure is; -1: no pressure */
    double peak_at[3];
    int64_t n_contacts, n_supports;
    uz_resultant *contacts,
        *supports;      /* in the scene's order. Where several supports hold a node, each has its share */
    uz_resultant loads; /* all of them; on is "" */
    /* What the forces and moments (about the first node, by the body's extent) leave over, relative to the sum of the
     * forces' sizes. */
    double imbalance;
    int n_warnings;
    uz_warning warnings[8];
} uz_evaluation;
void uz_evaluation_free(uz_evaluation *evaluation);

/* One grid that was tried for a box whose cells are chosen here. Of several load cases: the worst errors. */
typedef struct {
    int64_t cells[3], d, iterations;
    double discretization_error; /* estimated */
    double certified_error;      /* bound, of what the equations of this grid leave */
    double seconds;
} uz_rung;

enum { UZ_LADDER_RUNGS = 16 };

/* The grids in the order in which they were tried; the answer is on `cells`, which need not be the last of them. */
typedef struct {
    int dim, count;
    uz_rung rung[UZ_LADDER_RUNGS];
    int64_t cells[3];
} uz_ladder;

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
    int dim;                     /* scene: 2 or 3, else 0 */
    double force[3];             /* scene: force of the body on the obstacle's normal side, sum of -r n */
    double max_pressure;         /* scene: the largest of the result's pressure; NaN otherwise */
    double alpha, lambda_max;    /* NaN where no gradient step was taken */
    double discretization_error; /* scene: estimated relative energy-norm error of the mesh; NaN: not estimated */
    double total_error;       /* cells chosen here: sqrt(discretization_error^2 + the certificate's relative_error^2) */
    double infeasible_radius; /* infeasible: no u with all |u_j| below this is feasible; INFINITY: none at all */
    double requested_error;   /* the relative error that `converged` had to meet */
    uz_certificate certificate;
    uz_semicoercive semicoercive;
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
    const uz_ladder *ladder;         /* cells chosen here: the result's own; else NULL */
    uz_suggestion suggestion;        /* scenes */
} uz_summary;

/* Where a run stood when it ended: enough to go on as if it had not. Rows are the caller's.
 * A start that knows no more than reactions has rho NULL: a warm start. */
typedef struct {
    int64_t m;
    double *r;                           /* m, reactions; a warm start's are cut at 0 */
    double *rho;                         /* m or NULL: everything else below means something only beside it */
    double *Dr, *Drho, *best_r, *anchor; /* m */
    double alpha, tau;                   /* alpha 0: not chosen yet */
    double step_norm;                    /* of the last iteration, as in the history; NaN: no step was taken */
    double best_bound, best_relative;    /* of best_r; INFINITY: nothing was bounded yet */
    int64_t iteration, restarts, next_check, best_iteration;
    int64_t phase_end; /* iteration at which the phase ends; private to the methods, as is */
    int32_t phase;     /* of `auto` */
    uz_method method, made_by;
} uz_state;
void uz_state_free(uz_state *state);

typedef struct {
    uz_summary summary;
    int64_t d, m, n_nodes;
    double *u;         /* d; a scene's is n_nodes x dim by node, with the supported dofs, which d does not count */
    double *r;         /* m */
    double *g;         /* m */
    double *pressure;  /* scene: m, as UZ_FIELD_PRESSURE; else NULL */
    double *ray;       /* infeasible: m, y <= 0 with N'y = 0, h'y > 0, the proof; u, r, g are then NaN. Else NULL */
    uz_mesh_info mesh; /* scene only */
    uz_evaluation *evaluation;
    uz_ladder *ladder; /* box whose cells were chosen here */
    uz_history history;
    uz_trade trade;
    uz_state *state; /* where the iterations stood; NULL: nothing to continue */
} uz_result;
void uz_result_free(uz_result *result);

/* Asked between iterations and before every expensive step; from the solving thread. */
typedef struct {
    void *ctx;
    bool (*cancelled)(void *ctx);                           /* may be NULL */
    void (*progress)(void *ctx, const uz_history_row *row); /* may be NULL; after each iteration */
    void (*begins)(void *ctx, int64_t load_case);           /* may be NULL; before the first iteration of a case */
    /* may be NULL; cells chosen here: before each grid, the shares of the whole, 0 to 1, that it begins and ends with,
     * by estimate */
    void (*grid)(void *ctx, double from, double to);
} uz_hooks;

#include "uzawa_fields.h" /* uz_fields, uz_vtu_write, uz_picture: what an answer means */

/* ------------------------------------------------------------ factor cache */

/* Thread-safe, bounded in bytes, least recently used first out. Entries in use are never freed under their user. */
typedef struct uz_cache uz_cache;
uz_cache *uz_cache_new(size_t max_bytes); /* NULL: no memory */
void uz_cache_free(uz_cache *cache);      /* no solve may be running on it */

typedef struct {
    char digest[65]; /* SHA-256 of what determines the factor, hex */
    int64_t d, m, nnz, hits;
    size_t bytes;
} uz_cache_entry;
/* A snapshot, most recently used first; the caller frees *entries with free(). A factor that bodies share is counted
 * in the bytes of the first. */
uz_status uz_cache_list(uz_cache *cache, uz_cache_entry **entries, size_t *count, uz_error *err);

/* ------------------------------------------------------------------ solve */

/* What `balanced` asks for where the cells are chosen too. */
#define UZ_BALANCED_TOTAL_ERROR 5e-2

/* Solves one problem: the pipeline from scene or matrices to a certified result. `cache` may be NULL.
 * The problem is only read; one with load cases is for uz_solve_cases. Called from many threads at once with one
 * cache. Prepare each calling thread once with uz_thread_init. */
uz_status uz_solve(uz_result **out, const uz_problem *problem, const uz_settings *settings, uz_cache *cache,
                   const uz_hooks *hooks, uz_error *err);

/* The same for every load case of the problem (its own load where it has none), on one factor, with the right-hand
 * sides in blocks: *out is n = max(1, n_cases) results, in order; the caller frees each and the array, or all with
 * uz_results_free. settings->time_limit_s is of all cases together. When time is up or the solve is cancelled, cases
 * that had no turn are answered with what r = 0 gives, certified as any other. settings->memory_limit counts the
 * results too. The first case's timings have those of the body; for the others it is cached. Of several cases none
 * depends on its neighbours or its place, bit for bit, unless contact rows are left out (summary.kept): cases that need
 * more of them share those of a further round. One alone differs from one of several by rounding. starts: n, or
 * NULL; starts[i] NULL: from r = 0. A start with rho continues the run it was taken from, bit for bit where method,
 * operator and problem are the same ones (and the number of cases is 1 for both or for neither): its history begins
 * with the row after that run's last, and may have no rows; alpha is the state's. Where D r or the bound in it are not
 * those of this problem it counts as one without rho. A start without rho is checked before the first iteration, so
 * that the solution itself takes none. A start of another m is UZ_ERR_SIZE, one that is not finite UZ_ERR_NOT_FINITE,
 * one that no run can have left UZ_ERR_ARGUMENT. An error is that of the first case that fails as a call (its pointer
 * in err->where: "/cases/3/loads/0/on",
 * "/cases/3/p", "/cases/3/start"). The hook `begins` is called again for a case that goes on after others began.
 *
 * A box whose cells are chosen here (uz_box.automatic) is solved on a ladder of grids with cells near square, each
 * started from the contact pressure of the one before. relative_error then bounds the total error
 * sqrt(discretization^2 + algebraic^2), whose first part is an estimate (uz_summary.discretization_error) and whose
 * second is certified; `balanced` stands for UZ_BALANCED_TOTAL_ERROR. The answer is that of the coarsest grid found to
 * meet it in every case: no other that was tried or that the observed rate predicts saves a quarter of its dofs. What
 * could not be met ends in UZ_MESH_LIMIT or UZ_TIME_LIMIT, with the answer of the smallest total error. Starts and the
 * paper's stopping rule are UZ_ERR_ARGUMENT there. */
uz_status uz_solve_cases(uz_result ***out, const uz_problem *problem, const uz_settings *settings,
                         const uz_state *const *starts, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
void uz_results_free(uz_result **results, int64_t n);

/* Certifies somebody's answer: u as a uz_result has it (d, or n_nodes x dim) and r (m, caller's rows; positive parts
 * are counted as residual e3 and cut for the bound), with residuals, gaps and energies in twice the working precision.
 * The outcome is UZ_VERIFIED or UZ_NOT_VERIFIED by settings->relative_error, or by `balanced`; the result has the given
 * u and r, g(u), no history and no state. Supported dofs of a nodal u must have exactly the values that the scene gives
 * them: UZ_ERR_SCENE names the first node that has not, `where` is "u". UZ_ERR_NOT_FINITE: where "u" or "r". A problem
 * with load cases is UZ_ERR_ARGUMENT. */
uz_status uz_verify(uz_result **out, const uz_problem *problem, const double *u, const double *r,
                    const uz_settings *settings, uz_cache *cache, const uz_hooks *hooks, uz_error *err);

/* What a solve will take after the assembly, by the same model that chooses the operator (summary.cost): from the
 * pattern of the matrices, nothing is factored. Takes as long as assembly and symbolic analysis do. Errors: those of
 * uz_scene_to_qp; UZ_ERR_CANCELLED. A body that only the obstacle holds is UZ_ERR_FREE_BODY: no model counts its
 * rounds. */
typedef struct {
    int64_t d, m, factor_nnz; /* factor_nnz 0: no factor is made, or not known */
    double bytes, seconds;    /* matrices, factor and vectors together; all load cases */
    uz_operator op;
    bool fits; /* settings->memory_limit */
} uz_prediction;
uz_status uz_predict(uz_prediction *out, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                     uz_error *err);

/* Process-wide settings that a library must not choose alone: BLAS threads. Call once from main before threads start;
 * `workers` is how many threads will call uz_solve at once. */
void uz_process_init(int workers);
/* Per-thread cure for CHOLMOD's compiled-in OpenMP team (4 threads whatever the machine has). */
void uz_thread_init(void);

#ifdef __cplusplus
}
#endif
#endif
