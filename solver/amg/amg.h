/* amg.h: linear solves with K without a factor of it: conjugate gradients, preconditioned by multigrid of smoothed
 * aggregates (Vanek, Mandel, Brezina, Computing 56 (1996)), and a bound on the spectrum that makes their residuals
 * bounds on their errors.
 *
 * With M the preconditioner and 0 < lambda <= lambda_min(M^-1 K):
 *
 *     e'K^-1 e <= e'M^-1 e / lambda                                  for any e, at the price of one cycle;
 *     e'K^-1 e  = w'(e + s) + s'K^-1 s,  s = e - K w                 for any w, as sharp as w is good.
 *
 * Nothing here keeps a pointer to K: it is handed to every call, so that an object may outlive the K it was made of as
 * long as the next one has the same numbers. */
#ifndef UZ_AMG_H
#define UZ_AMG_H

#include "core/hooks.h"
#include "uzawa.h"

#include <math.h>

/* ----------------------------------------------------------- nodes and modes */

enum { UZ_MODES_MOST = 6 };

/* Which dofs move together, and what K hardly resists: the near-null space that coarse levels must have. */
typedef struct {
    int count;       /* modes, at most UZ_MODES_MOST */
    int64_t n_nodes; /* groups of dofs */
    int32_t *node;   /* n: group of each dof */
    float *value;    /* n x count, row by row */
    double strong;   /* couplings weaker than this, relative to the diagonal, form no aggregates; coarser levels, whose
                        matrices are fuller, halve it each (Vanek, Mandel, Brezina 1996, (5.2)) */
    const double *xyz;   /* n_nodes x dim, the caller's: where they are; NULL: unknown */
    const int32_t *ends; /* n_nodes x 2, the caller's: the ends of the edge that a node is the middle of, or -1; NULL:
                            there are no middles */
    int dim;
} uz_modes;
/* From the matrix alone: nodes are groups of dofs with the same neighbours, the modes move all dofs that have the same
 * place in their groups alike (translations, where dofs are displacements). */
uz_status uz_modes_of_matrix(uz_modes *out, const uz_csc *K, uz_error *err);
/* Rigid-body modes. xyz: n_nodes x dim; dof: n_nodes x dim, the dof of a node's displacement along each axis, or
 * negative; n dofs in all. */
uz_status uz_modes_of_body(uz_modes *out, const double *xyz, const int64_t *dof, int64_t n_nodes, int dim, int64_t n,
                           uz_error *err);
void uz_modes_clear(uz_modes *modes);

/* ---------------------------------------------------------------- multigrid */

typedef struct uz_multigrid uz_multigrid;           /* immutable after creation */
typedef struct uz_multigrid_room uz_multigrid_room; /* one per thread; each kind has its own */

struct uz_cg_info;
struct uz_cg_stop;

/* bottom <= u <= top at some dofs. */
typedef struct {
    int64_t n;
    const int64_t *dof;         /* n, ascending; NULL: all */
    const double *bottom, *top; /* n; infinite: there is none */
} uz_limits;

/* A step of conjugate gradients, by so much along the direction, from r'M^-1 r = before to after. Returns whether they
 * are to go on. */
typedef bool (*uz_cg_visit)(void *ctx, double along, double before, double after);

/* What a kind of multigrid does. M^-1 is symmetric and positive definite, also with dofs held. */
typedef struct {
    /* z = M^-1 r (n); z and r do not overlap. */
    uz_status (*apply)(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z, const double *r,
                       uz_error *err);
    /* y = K x in double precision; y and x do not overlap. */
    void (*multiply)(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *y, const double *x);
    /* The same; returns x'y. NULL: it is as fast to look at both again. */
    double (*curve)(const uz_multigrid *mg, uz_multigrid_room *room, double *y, const double *x);
    /* x += K_FF^-1 r as conjugate gradients in single precision know it, r (n) what they have left: for residuals that
     * are looked at afterwards. *info: `met` false where single precision may not reach the tolerance, x is then as far
     * as it came (iterations 0: as it was, and r too). NULL: there is none. */
    uz_status (*solve_roughly)(const uz_multigrid *mg, uz_multigrid_room *room, struct uz_cg_info *info, double *x,
                               double *r, const struct uz_cg_stop *stop, uz_error *err);
    /* The same steps from a residual r (n), until the visitor ends them, or rounding does: of the matrix in single
     * precision that the cycle is made of, which is K but for `rough`. NULL: there is none. */
    uz_status (*step_roughly)(const uz_multigrid *mg, uz_multigrid_room *room, const double *r, uz_cg_visit visit,
                              void *ctx, uz_error *err);
    /* The same of two residuals r at once, each with a visitor's context of its own, until both are ended, of K in
     * double precision: a third more than steps of one. They are drawn by these seeds: x'r is normal, for any x, with
     * a variance of x'M x or more. More levels than one; the room can only be freed then. NULL: there is none. */
    uz_status (*step_both)(const uz_multigrid *mg, uz_multigrid_room *room, const uint64_t seed[2], uz_cg_visit visit,
                           void *const ctx[2], uz_error *err);
    /* What a thread needs to apply it, *bytes of it; NULL: no memory. */
    uz_multigrid_room *(*room)(const uz_multigrid *mg, size_t *bytes);
    void (*free_room)(uz_multigrid_room *room); /* NULL and half-built ones too */
    /* From now on, in this room, M stands for K_FF, where held (n, to be kept until the next call; NULL: none) marks
     * the dofs that are not in F: what r has at held dofs is ignored, z is 0 there. *bytes: what the room has grown by
     * since it was made. CANCELLED where it had to stop; the room may then only be freed, or told again. */
    uz_status (*hold)(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, const bool *held, size_t *bytes,
                      const uz_stop *stop, uz_error *err);
    /* Where the contact problem, 1/2 u'Ku - p'u minimal within limits, is well begun: u (n), and which of the limits
     * hold it (held: as many as they are), by coarser grids. *found false: there are none, or it had to stop. No dof
     * may be held; none is afterwards. NULL: nothing is known. */
    uz_status (*start)(const uz_multigrid *mg, uz_multigrid_room *room, bool *found, double *u, bool *held,
                       const double *p, const uz_limits *limits, const uz_stop *stop, uz_error *err);
    void (*free)(uz_multigrid *mg);
    /* Whole solves, where they are elsewhere; NULL: by conjugate gradients here. As uz_cg_solve, which leaves info at
     * 0, but that x at held dofs counts as 0; r: cg->r, of K as it is here. count: of systems that are solved at once,
     * 1 or 2, x, r and b being n for each; info: of the worse one. */
    uz_status (*solve)(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, struct uz_cg_info *info,
                       double *x, double *r, const double *b, int count, const struct uz_cg_stop *stop, uz_error *err);
} uz_multigrid_kind;

/* Of a tolerance the most that single precision may hide. */
#define UZ_HIDDEN 0.1

/* What every kind begins with. */
struct uz_multigrid {
    const uz_multigrid_kind *kind;
    int64_t n;
    int levels;
    size_t bytes;
    double most;  /* a bound on lambda_max(diag(K)^-1 M) */
    double rough; /* |x'(A - K)x| is at most so many times x'diag(K)x and FLT_EPSILON x'K x, A what steps in single
                     precision have for K and what they round on the way */
    double drift; /* what single precision hides of a change, relative, in the energy norm; 0: not known */
    bool knows_K; /* without being handed it: of that only the diagonal is read, and need be there */
};

/* Processes that make the same of the same: sums over nodes they divide. sum: x (n) becomes the sum of all members', to
 * the last bit the same for each. */
typedef struct {
    int member, members;
    void (*sum)(double *x, int64_t n);
} uz_team;

/* A V-cycle on smoothed aggregates for K (lower triangle). team: NULL: there is one process alone.
 * Errors: NOT_SPD where a diagonal entry or the coarsest matrix shows it; LIMIT where memory_limit (0: none) would be
 * passed; CANCELLED where it had to stop (stop NULL: never). */
uz_status uz_multigrid_create(uz_multigrid **out, const uz_csc *K, const uz_modes *modes, const uz_team *team,
                              size_t memory_limit, const uz_stop *stop, uz_error *err);
void uz_multigrid_free(uz_multigrid *mg);
/* kind->apply. */
uz_status uz_multigrid_apply(const uz_multigrid *mg, const uz_csc *K, uz_multigrid_room *room, double *z,
                             const double *r, uz_error *err);

/* ------------------------------------------------------- conjugate gradients */

/* The room of a solve; made for one multigrid, used by one thread. */
typedef struct {
    const uz_multigrid *mg;
    const bool *held; /* of uz_cg_hold */
    uz_multigrid_room *room;
    int64_t n;
    size_t bytes, grown; /* of all this; what holding dofs adds */
    double *r, *z, *p;   /* n each */
} uz_cg;
uz_status uz_cg_init(uz_cg *cg, const uz_multigrid *mg, uz_error *err);
/* Solves from now on are for K_FF: see uz_multigrid_kind. */
uz_status uz_cg_hold(uz_cg *cg, const uz_csc *K, const bool *held, const uz_stop *stop, uz_error *err);
void uz_cg_clear(uz_cg *cg);

typedef struct uz_cg_stop {
    double absolute, relative; /* of sqrt(r'M^-1 r): stop at the larger of absolute and relative times the first one */
    int64_t max_iterations;
    const uz_hooks *hooks; /* asked in each iteration; may be NULL */
    double deadline;       /* uz_seconds() */
    bool begun;            /* cg->r is b - K x already, at free dofs */
    bool unchecked; /* the caller looks at the residual himself: where the recurrence meets the tolerance, its own
                       is told in `last` and cg->r, and the true one is not computed. Kinds that solve then leave cg->r
                       as it is */
    /* Asked once, where the norm has come down to the larger of these, with x and cg->r = b - K x as they are there, at
     * held dofs too: the goal from there on, INFINITY: none, the solve ends. Then all is in double precision. NULL:
     * nobody is asked, as by kinds that solve. */
    double (*look)(void *ctx);
    void *ctx;
    double look_absolute, look_relative;
} uz_cg_stop;

typedef struct uz_cg_info {
    int64_t iterations;
    double first, last; /* sqrt(r'M^-1 r) at the start, and of the true residual at the end */
    bool met;           /* the tolerance was reached; false: limit, cancel, deadline, or rounding */
    bool looked;        /* stop->look was asked, */
    bool ended;         /* and ended the solve */
} uz_cg_info;

/* Limit, cancel, or deadline. */
bool uz_cg_should_stop(const uz_cg_info *info, const uz_cg_stop *stop);
/* The next direction: cg->p = cg->z + beta cg->p, by the threads there are. */
void uz_cg_turn(uz_cg *cg, double beta);

/* NOT_SPD: some p'K p was not positive. */
uz_status uz_cg_fail_direction(uz_error *err);

/* x (n): in, a start; out, nearer to K^-1 b. At held dofs it stays as it is, and K x has its part. The residual of the
 * x that is returned stands in cg->r. UZ_ERR_NOT_SPD: some p'K p was not positive. */
uz_status uz_cg_solve(uz_cg_info *info, double *x, uz_cg *cg, const uz_csc *K, const double *b, const uz_cg_stop *stop,
                      uz_error *err);

/* ---------------------------------------------------------------- the whole */

typedef struct {
    int levels;
    size_t bytes;
    double lambda;      /* <= lambda_min(M^-1 K), but for a probability below 1e-12; of uz_amg_of_definite a guess */
    double rcond;       /* estimate of lambda_min(diag(K)^-1 K), rather too small */
    double create_s;    /* seconds of the multigrid */
    double spectrum_s;  /* and of the bounds */
    int64_t iterations; /* that the bound on the spectrum took */
    double least;       /* <= |lambda| of every eigenvalue of diag(K)^-1 K, but for a probability below 1e-12, whatever
                           M is (uz_amg_probe); 0: not known, M is to be trusted */
    double rounding;    /* with it: a product K x here is off by at most so many times the norm of diag(K)^1/2 x, in the
                           norm of diag(K)^-1 */
} uz_amg_info;

/* Immutable after creation: shared by any number of threads. */
typedef struct {
    uz_multigrid *mg;
    uz_amg_info info;
} uz_amg;

/* Of any multigrid for K, which is taken, also on failure. patience: LIMIT where so many steps do not bound the
 * spectrum, or are seen not to, as conjugate gradients would then be slow too; 0: as many as it takes. NOT_SPD where K
 * is singular to working precision. */
uz_status uz_amg_of(uz_amg **out, uz_multigrid *mg, const uz_csc *K, int patience, const uz_hooks *hooks,
                    uz_error *err);
/* The same where K is known to be definite, as that of a body is by its assembly: without bounds, which uz_amg_probe
 * finds then. */
uz_status uz_amg_of_definite(uz_amg **out, uz_multigrid *mg, uz_error *err);
typedef struct uz_amg_trials uz_amg_trials;
/* Finds info.least by solves with K that are checked here, so that what is certified by it needs no word of the program
 * that holds M, whose kind has `solve`; and a guess at info.lambda, where there is none yet. UNSUPPORTED: the solves
 * are not those of K, or too rough. NOT_SPD: they show that K is not definite. */
uz_status uz_amg_probe(uz_amg *amg, uz_amg_trials *trials, double rounding, const uz_hooks *hooks, uz_error *err);
/* Room for these solves, and the right-hand sides of the first of them: of K alone, which is kept. NULL: no memory. Of
 * one probe. */
uz_amg_trials *uz_amg_draw(const uz_csc *K);
void uz_amg_trials_free(uz_amg_trials *trials); /* NULL is fine */
/* info.rounding, which uz_amg_probe is given: of K alone. */
uz_status uz_amg_rounding(double *rounding, const uz_csc *K, uz_error *err);
/* With smoothed aggregates. Takes the content of *modes, also on failure. Errors as uz_multigrid_create; NOT_SPD and
 * LIMIT as uz_amg_of. Aggregates of another kind are tried where the usual ones do badly: with patience where they
 * would have to be refused, or nearly, without it where they are slow. */
uz_status uz_amg_create(uz_amg **out, const uz_csc *K, uz_modes *modes, size_t memory_limit, int patience,
                        const uz_hooks *hooks, uz_error *err);
void uz_amg_free(uz_amg *amg);

/* The root of what rounding may have made negative; INFINITY of what is no number, so that overflow never looks like 0.
 */
static inline double uz_root(double square)
{
    if (isnan(square))
        return INFINITY;
    return square > 0.0 ? sqrt(square) : 0.0;
}

/* Seconds that sweeps forwards and backwards over a level take on this machine for each entry of its lower triangle,
 * which is more than a core has for itself: the least of several, in about six milliseconds. */
double uz_amg_rate(void);
/* Predicted bytes of a uz_amg for a matrix of n dofs and nnz entries in its lower triangle. */
double uz_amg_predict_bytes(int64_t n, int64_t nnz, int modes);

#endif
