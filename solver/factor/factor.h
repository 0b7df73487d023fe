/* factor.h: the sparse Cholesky factor P K P' = L L' with the dofs of the contact last. The only folder that knows
 * CHOLMOD (Chen, Davis, Hager, Rajamanickam, ACM TOMS 35 (2008), algorithm 887). */
#ifndef UZ_FACTOR_H
#define UZ_FACTOR_H

#include "core/hooks.h"
#include "uzawa.h"

typedef struct uz_analysis uz_analysis;                 /* immutable after creation: shared by any number of factors */
typedef struct uz_factor uz_factor;                     /* immutable after creation: shared by any number of threads */
typedef struct uz_factor_workspace uz_factor_workspace; /* one per thread */

/* What an order of elimination costs: entries of the supernodal L, and additions and multiplications of the
 * factorization, with those of Z (see reach) where the contact is not last. */
typedef struct {
    uz_ordering ordering; /* not AUTO */
    bool contact_last;
    int64_t nnz;
    double flops;
} uz_order_choice;
enum { UZ_CHOICES = 4 };

typedef struct {
    uz_ordering ordering; /* the one that was used */
    bool contact_last;    /* false also where nothing had to be last */
    int64_t n, nnz;       /* of L, lower triangle */
    double flops;
    uz_order_choice considered[UZ_CHOICES]; /* n_considered; the used one among them */
    int n_considered;
    size_t bytes;
    size_t room;  /* bytes beside these and a copy of K while it is made */
    double rcond; /* an estimate of the least eigenvalue of K after diagonal scaling, rather too large; kept with L */
    /* At least lambda_max(D^1/2 (L L')^-1 D^1/2), D = diag(K), but for a probability below 1e-12: some 50 times that
     * where few directions are soft, more where all are alike, and then small. So ||L^-1 P e||^2 is at most so many
     * times the sum of e_j^2 / K_jj. INFINITY: unknown. */
    double inverse_bound;
    double order_s; /* what the analysis took, whoever waited for it */
    double factor_s;
    double condensing; /* flops to condense contact: uz_factor_describe_for */
    /* The analysis's own: where dof i stands in the factor's order (n), and the n_last dofs, ascending, that come last:
     * 0 where none has to. */
    const int64_t *position, *last;
    int64_t n_last;
} uz_factor_info;

/* What the pattern of K (lower triangle, n x n) alone decides: the order of elimination and the supernodes; values are
 * not read. last: the n_last dofs, ascending, that come after all others in the elimination (Schur complement
 * ordering). Equal patterns give equal factors, bit for bit, whether an analysis is their own or shared. `cancelled` is
 * asked once it is there. It may be freed before the factors made from it.
 * rows: 0, or of N on these dofs, or combinations of them, that may also be eliminated among the others: by the flops
 * of both (uz_reach_gram takes the place of uz_factor_last_block). */
uz_status uz_analysis_create(uz_analysis **out, const uz_csc *K, const int64_t *last, int64_t n_last, int64_t rows,
                             uz_ordering ordering, const uz_hooks *hooks, uz_error *err);
void uz_analysis_free(uz_analysis *analysis);
size_t uz_analysis_bytes(const uz_analysis *analysis);
/* What a factor made from it will be: everything but rcond, inverse_bound and factor_s. */
uz_factor_info uz_analysis_describe(const uz_analysis *analysis);

/* Factors K (lower triangle, n x n), whose pattern must be the one that was analysed. memory_limit 0: none. `cancelled`
 * is asked before the factorization, as CHOLMOD itself can't be interrupted. Errors: NOT_SPD names the pivot, LIMIT the
 * predicted bytes, ARGUMENT another size or number of entries than the analysis's. */
uz_status uz_factor_create(uz_factor **out, const uz_csc *K, const uz_analysis *analysis, size_t memory_limit,
                           const uz_hooks *hooks, uz_error *err);
/* The same of a K that is solved with a few times: its rcond is that of the pivots alone, and inverse_bound unknown. */
uz_status uz_factor_create_briefly(uz_factor **out, const uz_csc *K, const uz_analysis *analysis, size_t memory_limit,
                                   const uz_hooks *hooks, uz_error *err);
/* An estimate of K's rcond, as in uz_factor_info, by one linear solve. UZ_ERR_MEMORY. */
uz_status uz_factor_estimate_rcond(double *rcond, const uz_factor *factor, const uz_csc *K, uz_error *err);
/* A factor without numbers, which nobody shares: of use once uz_factor_again has made them. Its condition stays
 * unknown. UZ_ERR_MEMORY. */
uz_status uz_factor_new(uz_factor **out, const uz_analysis *analysis, uz_error *err);
/* The numbers of such a factor for a K of the pattern that was analysed, in the memory that it has, with what was found
 * of the pattern kept for the next time. K that is singular but to rounding is not refused. Errors:
 * ARGUMENT another size or number of entries than the analysis's; NOT_SPD: of no use then but for another attempt;
 * MEMORY. */
uz_status uz_factor_again(uz_factor *factor, const uz_csc *K, uz_error *err);
void uz_factor_free(uz_factor *factor);
uz_factor_info uz_factor_describe(const uz_factor *factor);
/* What it was made from, for other matrices of its pattern; ends with uz_analysis_free. */
uz_analysis *uz_factor_analysis(const uz_factor *factor);
/* Are the n dofs (ascending) among those that come last? Always where n = 0. */
bool uz_factor_ends_with(const uz_factor *factor, const int64_t *dofs, int64_t n);
/* With the additions and multiplications that condensing rows on these dofs takes, as uz_analysis_create counts them
 * with the same numbers. UZ_ERR_MEMORY. */
uz_status uz_factor_describe_for(uz_factor_info *out, const uz_factor *factor, const int64_t *dofs, int64_t n_dofs,
                                 int64_t rows, uz_error *err);

uz_factor_workspace *uz_factor_workspace_new(void); /* NULL: no memory */
void uz_factor_workspace_free(uz_factor_workspace *ws);

/* Vectors in the factor's own order: permuted[k] = x[perm[k]]. */
void uz_factor_permute(const uz_factor *factor, double *permuted, const double *x);
void uz_factor_unpermute(const uz_factor *factor, double *x, const double *permuted);
/* In place on a vector x (n) in the factor's order: x = L^-1 x (forward), or x = L'^-1 x. UZ_ERR_MEMORY. */
uz_status uz_factor_solve_one(const uz_factor *factor, uz_factor_workspace *ws, double *x, bool forward, uz_error *err);
/* x = K^-1 b (n each, x may be b), by way of room (n). */
uz_status uz_factor_solve(const uz_factor *factor, uz_factor_workspace *ws, double *x, const double *b, double *room,
                          uz_error *err);

/* The same for blocks of UZ_LANES vectors that stand side by side: entry k of vector l at X[k * UZ_LANES + l], n rows,
 * one block after the other. An answer depends neither on what the other lanes hold nor on the lane. Permutations are
 * of one block. */
enum { UZ_LANES = 8 };
void uz_factor_permute_lanes(const uz_factor *factor, double *permuted, const double *X);
void uz_factor_unpermute_lanes(const uz_factor *factor, double *X, const double *permuted);
uz_status uz_factor_solve_lanes(const uz_factor *factor, double *X, int64_t blocks, bool forward, uz_error *err);

/* The rows and columns of L at the `last` dofs as a dense lower triangle, n_last x n_last column-major, strict upper
 * part zero; order[k] is the dof of row k (ascending position), where[k] its position. It is the Cholesky factor of the
 * Schur complement of K on these dofs: checked by the elimination structure, UZ_ERR_INTERNAL if it is not. */
uz_status uz_factor_last_block(const uz_factor *factor, double *block, int64_t *order, int64_t *where, uz_error *err);

/* Solves that begin and end at a few dofs: the supernodes of the dofs and of all that depends on them in the
 * elimination. Immutable; the factor must outlive it. Vectors (n) are in the factor's order. */
typedef struct uz_reach uz_reach;
uz_status uz_reach_create(uz_reach **out, const uz_factor *factor, const int64_t *dofs, int64_t n_dofs, uz_error *err);
void uz_reach_free(uz_reach *reach);
/* x = L^-1 x, x zero but at the dofs; it stays zero outside the reach. */
uz_status uz_reach_forward(const uz_reach *reach, uz_factor_workspace *ws, double *x, uz_error *err);
/* x = L'^-1 x, but only on the reach; the rest of x is left as it was. */
uz_status uz_reach_backward(const uz_reach *reach, uz_factor_workspace *ws, double *x, uz_error *err);
/* D (m x m, lower triangle; the rest zero) = N K^-1 N' = Z'Z with Z = L^-1 P N', for N (m x n) zero but on the dofs of
 * the reach: all right-hand sides at once, by supernodes, each with those that lead there. */
uz_status uz_reach_gram(double *D, const uz_reach *reach, const uz_csc *N, uz_error *err);

/* The factor of K_FF, F the dofs that are not fixed (n): K (lower triangle) with these dofs held. factor: of K, whose
 * order is used; factor and ws are borrowed for the object's life. *out is NULL on success when K_FF is not positive
 * definite to working precision, or where it had to stop (stop NULL: never). */
typedef struct uz_principal uz_principal;
uz_status uz_principal_create(uz_principal **out, const uz_csc *K, const bool *fixed, const uz_factor *factor,
                              uz_factor_workspace *ws, const uz_stop *stop, uz_error *err);
/* The same K with other dofs fixed, at the price of what changes where that is less. *positive false, as *out NULL: to
 * be freed, or asked again. */
uz_status uz_principal_hold(bool *positive, uz_principal *part, const uz_csc *K, const bool *fixed, const uz_stop *stop,
                            uz_error *err);
void uz_principal_free(uz_principal *part);
/* The most that it has taken so far. */
size_t uz_principal_bytes(const uz_principal *part);
/* x_F = K_FF^-1 x_F in place; x (n) at fixed dofs is neither read nor written. */
uz_status uz_principal_solve(double *x, uz_principal *part, uz_error *err);

/* head[i] (n): the first dof of i's group: dofs with the same neighbours in a matrix (A: its lower triangle), as those
 * of a node have, and either all or none of them among the n_last dofs `last`. false: no memory. */
bool uz_group_dofs(int64_t *head, const uz_csc *A, const int64_t *last, int64_t n_last);

/* Makes CHOLMOD allocate its big blocks with uz_malloc_huge. Process-wide: called once, by uz_process_init. */
void uz_factor_use_huge_pages(void);
/* BLAS may use so many threads, where they are more than two, in a large factorization of large supernodes, one at a
 * time; elsewhere it has one. Process-wide: called once at most, by uz_process_init. */
void uz_factor_use_threads(int threads);
/* The big blocks, which are the factor's above all, come from the reserve from now on. Process-wide: called once at
 * most, after uz_factor_use_huge_pages and before anything is factored; the reserve outlives every factor. */
void uz_factor_use_reserve(uz_reserve *used);
/* A body gets no factor, and takes so many bytes: the reserve, if there is one, leaves them to it. */
void uz_factor_expect_none(size_t bytes);

#endif
