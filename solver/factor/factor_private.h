/* factor_private.h: what the files of this folder share. */
#ifndef UZ_FACTOR_PRIVATE_H
#define UZ_FACTOR_PRIVATE_H

#include "factor/factor.h"

#include <stdatomic.h>
#include <suitesparse/cholmod.h>

typedef struct uz_refill uz_refill;

struct uz_analysis {
    atomic_int holders; /* creator and factors: the last one frees it */
    cholmod_factor *L;  /* symbolic, supernodal */
    int64_t n, nnz;     /* of K */
    int64_t n_last;
    int64_t *last;        /* n_last dofs, ascending */
    int64_t *position;    /* n: inverse of L->Perm */
    unsigned char *share; /* nsuper: see uz_share_tree */
    bool is_shared;       /* not all are of the rest */
    uz_order_choice chosen, considered[UZ_CHOICES];
    int n_considered;
    double seconds;
    _Atomic(uz_refill *) spare; /* what was found of the pattern for a factor that was made briefly; NULL: nothing */
};

/* Whose a supernode is: of two shares, none of which needs the other, or of the rest, which comes after both where L is
 * made or solved with, and before them where L' is. */
enum { UZ_REST = 2, UZ_SHARES };
/* nsuper: the share of each; all are of the rest where two threads would gain little. NULL: no memory. */
unsigned char *uz_share_tree(const cholmod_factor *L);
/* run(ctx, share) of both shares, by two threads where they have supernodes. */
void uz_run_shares(const uz_analysis *analysis, void (*run)(void *ctx, int share), void *ctx);
/* Worth two threads' time for itself. */
bool uz_is_large(int64_t columns, int64_t rows);

/* As uz_factor_solve_lanes of one block, by the shares: what both take from the rest is added up in another order. X
 * and Y: n x UZ_LANES; Y is room. */
uz_status uz_factor_solve_shares(const uz_factor *factor, double *X, double *Y, bool forward, uz_error *err);

/* What making the numbers of a factor takes (refill.c). once: for these of K alone. UZ_ERR_MEMORY. */
uz_status uz_refill_new(uz_refill **out, const uz_factor *factor, const uz_csc *K, bool once, uz_error *err);
/* Other values of the same pattern: of one not made for once. */
void uz_refill_renew(uz_refill *x, const uz_csc *K);
void uz_refill_free(uz_refill *x);
/* *refused: the first column, in the factor's order, whose pivot is not positive, with memory to be given back; n:
 * none. UZ_ERR_MEMORY. */
uz_status uz_refill_run(int64_t *refused, uz_refill *x, uz_factor *factor, uz_error *err);

struct uz_factor {
    uz_analysis *analysis;
    cholmod_factor L; /* the analysis's with numbers: only x and what says so are this factor's own */
    int64_t n;
    uz_factor_info info;
    uz_refill *refill; /* for uz_factor_again; NULL: not asked */
};

/* A factor with other supernodes here and there. */
typedef struct {
    const double *const *block; /* nsuper; NULL: the factor's own */
    const bool *held;           /* n: columns in whose place substitutions have 0 */
} uz_overlay;

struct uz_factor_workspace {
    cholmod_common common;
    const uz_overlay *overlay; /* of what uz_factor_solve_one solves with; NULL: none */
    double *panel;             /* room to gather rows in, grown on demand */
    size_t panel_size;
};

/* Starts a CHOLMOD workspace that never prints, never aborts and gives LL' supernodal factors with 64-bit integers. */
bool uz_cholmod_start(cholmod_common *common);

/* Memory for a factor of K is made ready while K is analysed. */
void uz_expect_factor(const uz_csc *K);

/* The graph of groups of dofs with equal neighbours (lower triangle without diagonal, pattern), freed by
 * cholmod_l_free_sparse; NULL: no memory. A: lower triangle. The n_last dofs `last` are in groups without others.
 * group[i] (n): the number of i's group, in the order of their first dofs. */
cholmod_sparse *uz_compress(int64_t *group, const uz_csc *A, const int64_t *last, int64_t n_last,
                            cholmod_common *common);

/* Fills perm (nodes) with a fill-reducing ordering of the graph of groups (not AUTO) that keeps the n_last groups
 * `last` at the end. */
uz_status uz_order(int64_t *perm, cholmod_sparse *graph, const int64_t *last, int64_t n_last, uz_ordering ordering,
                   cholmod_common *common, uz_error *err);
/* Moves `last` behind all others in perm (n) and keeps the order within both. */
uz_status uz_move_last(int64_t *perm, int64_t n, const int64_t *last, int64_t n_last, uz_error *err);

/* Fills L, chosen and considered of `analysis`. group (n): from uz_compress. rows: see uz_analysis_create, 0: the
 * contact has to be last. */
uz_status uz_choose(uz_analysis *analysis, cholmod_sparse *graph, const int64_t *group, int64_t rows,
                    uz_ordering ordering, cholmod_common *common, uz_error *err);

/* P K P' (lower triangle, columns unsorted); NULL: no memory. position: the factor's. place: where each entry of K
 * stands in it, or NULL. */
cholmod_sparse *uz_permute(const uz_csc *K, const int64_t *position, int64_t *place, cholmod_common *common);

/* The factor of K with some dofs held, by what changes of the factor of K, both of which outlive it (paths.c). */
typedef struct uz_paths uz_paths;
uz_status uz_paths_create(uz_paths **out, const uz_csc *K, const uz_factor *factor, uz_factor_workspace *ws,
                          uz_error *err);
void uz_paths_free(uz_paths *x);
size_t uz_paths_bytes(const uz_paths *x); /* x NULL is legal */
/* Flops, about, to get from the dofs that are held to those that are `fixed` (n). */
double uz_paths_work(uz_paths *x, const bool *fixed);
/* Holds these dofs and no others. *positive false: K without them is not positive definite to working precision, or it
 * had to stop (stop NULL: never); none is held then. */
uz_status uz_paths_hold(bool *positive, uz_paths *x, const bool *fixed, const uz_stop *stop, uz_error *err);
/* As uz_principal_solve. */
uz_status uz_paths_solve(double *v, uz_paths *x, uz_error *err);

/* Additions and multiplications of condensing `rows` rows on n_dofs dofs, by a symbolic factor in which these come last
 * or anywhere (uz_reach_gram); rows 0: each of the last ones has its own, which is there. Below 0: no memory. */
double uz_condensing_flops(const cholmod_factor *L, bool last, const int64_t *dofs, int64_t n_dofs, int64_t rows);

/* Fills info.rcond. UZ_ERR_NOT_SPD where K is singular to working precision. */
uz_status uz_find_least_pivot(uz_factor *factor, const uz_csc *K, uz_error *err);
/* After it: info.inverse_bound, and info.rcond may become less. */
uz_status uz_find_condition(uz_factor *factor, const uz_csc *K, cholmod_common *common, uz_error *err);

/* Gives ws->panel at least `need` entries. */
uz_status uz_need_panel(uz_factor_workspace *ws, size_t need, uz_error *err);

/* The symbolic supernodal factor of n dofs from that of their groups; NULL: no memory. */
cholmod_factor *uz_expand(const cholmod_factor *G, const int64_t *group, int64_t n, cholmod_common *common);

#endif
