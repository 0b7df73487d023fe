/* uzawa.h: the public header of the contact solver library: this file includes its parts, each of which can be
 * included alone.
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

#include "uzawa_base.h"     /* errors */
#include "uzawa_matrices.h" /* sparse matrices, Matrix Market, a problem in matrices */
#include "uzawa_scene.h"    /* mesh, materials, supports, loads, contacts */
#include "uzawa_problem.h"  /* problems, load cases, settings */
#include "uzawa_trade.h"    /* what accuracy took */
#include "uzawa_results.h"  /* summary, certificate, history, state */
#include "uzawa_fields.h"   /* what an answer means: fields, files, pictures */

#ifdef __cplusplus
extern "C" {
#endif

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

/* uz_mesh_read of a file that may come again: its mesh stays in the cache under the file's digest (hex, of the caller's
 * choice: no other file may have it), and *out has a use of it, whose arrays are only to be read, until it is cleared;
 * the cache must last as long. Small files, and those of a cache that is NULL, are read as by uz_mesh_read. */
uz_status uz_mesh_read_kept(uz_given_mesh *out, uz_cache *cache, const char *digest, const char *format,
                            const char *text, size_t len, size_t max_bytes, uz_error *err);

/* ----------------------------------------------------------------- reserve */

/* Memory that factors are made in, and that is kept when they are freed as long as both together take at most `most`
 * bytes: pages that went back to the system are dear to get again. Thread-safe. */
typedef struct uz_reserve uz_reserve;
uz_reserve *uz_reserve_new(size_t most, size_t ready); /* NULL: no memory */
void uz_reserve_free(uz_reserve *reserve);             /* after every factor; NULL is fine */
/* Touches some fresh memory, tens of megabytes, where less is kept than `ready` and the largest factor took since the
 * reserve was emptied last; true: it is still less. To be called while nobody waits for a solve. */
bool uz_reserve_fill(uz_reserve *reserve);
void uz_reserve_empty(uz_reserve *reserve);   /* gives all that is kept to the system */
size_t uz_reserve_bytes(uz_reserve *reserve); /* that are kept */

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
 * depends on its neighbours or its place, bit for bit, unless there is no factor, so that a case begins at answers to
 * those before it, or contact rows are left out (summary.kept): cases that need more of them share those of a further
 * round. One alone differs from one of several by rounding. starts: n, or
 * NULL; starts[i] NULL: from r = 0. A start with rho continues the run it was taken from, bit for bit where method,
 * operator and problem are the same ones (and the number of cases is 1 for both or for neither): its history begins
 * with the row after that run's last, and may have no rows; alpha is the state's. Where D r or the bound in it are not
 * those of this problem it counts as one without rho. A start without rho is checked before the first iteration, so
 * that the solution itself takes none. A start of another m is UZ_ERR_SIZE, one that is not finite UZ_ERR_NOT_FINITE,
 * one that no run can have left UZ_ERR_ARGUMENT. An error is that of the first case that fails as a call (its pointer
 * in err->where: "/cases/3/loads/0/on",
 * "/cases/3/p", "/cases/3/start"). The hook `begins` is called again for a case that goes on after others began.
 *
 * A box whose cells are chosen here (uz_box.automatic) is solved on a sequence of grids with cells near square, each
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
 * uz_scene_to_qp; UZ_ERR_CANCELLED; UZ_ERR_LIMIT: matrices that take minutes to analyse, or more than the memory
 * limit. A body that only the obstacle holds is UZ_ERR_FREE_BODY: no model counts its rounds. */
typedef struct {
    int64_t d, m, factor_nnz; /* factor_nnz 0: no factor is made, or not known */
    double bytes, seconds;    /* matrices, factor and vectors together; all load cases */
    uz_operator op;
    bool fits; /* settings->memory_limit */
    /* Bytes of an answer of kinematics AUTO that is compared with large deformation, which only the answer of small
     * deformation tells; of kinematics FINITE `bytes` are those of it. 0: that is never done */
    double compared_bytes;
} uz_prediction;
uz_status uz_predict(uz_prediction *out, const uz_problem *problem, const uz_settings *settings, const uz_hooks *hooks,
                     uz_error *err);

/* Process-wide settings that a library must not choose alone: BLAS threads. Call once from main before threads start;
 * `workers` is how many threads will call uz_solve at once. */
void uz_process_init(int workers);
/* After it: so many threads may be used in solves from now on, that of the caller among them, while no solve runs. */
void uz_process_threads(int threads);
/* The same while a solve runs, but for a factorization by BLAS that has begun. From any thread. */
void uz_process_threads_now(int threads);
/* Starts the threads of solves, and lets BLAS allocate now what it works in, for each of its threads: later, where
 * memory has ended, it would try for ever. */
void uz_process_warm(void);
/* Measures now what predictions and the choice of an operator need to know of the machine, some 15 ms once in a
 * process: else the first solve that needs it does. */
void uz_process_measure(void);
/* After it, at most once: factors are made in the reserve, which has to outlive them. */
void uz_process_reserve(uz_reserve *reserve);
/* Per-thread cure for CHOLMOD's compiled-in OpenMP team (4 threads whatever the machine has). */
void uz_thread_init(void);

#ifdef __cplusplus
}
#endif
#endif
