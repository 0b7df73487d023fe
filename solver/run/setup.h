/* setup.h: what is made of a problem before its loads, and kept in the cache: matrices, the contact
 * rows to solve with, a factor or a multigrid, and the dual operator. */
#ifndef UZ_SETUP_H
#define UZ_SETUP_H

#include "assembly/assembly.h"
#include "cache/parts.h"
#include "run/cost.h"
#include "dual/dual.h"
#include "factor/factor.h"
#include "obstacle/candidates.h"
#include "uzawa.h"

#include <pthread.h>

/* Immutable once built, but for what is under the mutex; shared by threads. */
typedef struct uz_setup {
    bool is_scene;
    struct uz_setup *base; /* at a place (uz_scene.place): the same body at none, which has K, factor and multigrid */
    uz_body_model model;   /* scenes: K, N and the mesh. Matrices: the problem itself has K and N */
    uz_csc no_rows;        /* matrices without contacts: 0 x d, as the problem's N may be a zeroed struct */
    uz_candidates rows;    /* which of the model's rows it is solved with (rows.h); in NULL: all */
    uz_csc N_in;           /* these, where some are left out */
    uz_shared_factor shared;
    const uz_law *law;       /* of its contacts */
    const uz_factor *factor; /* shared.factor; NULL: matrix_free */
    uz_amg *amg;             /* matrix_free, else NULL */
    uz_dual *dual;
    pthread_mutex_t mutex; /* guards doubt */
    double doubt;          /* NaN until somebody asks */
    int64_t terms;         /* uz_most_terms of K and all rows; none positive: there was no memory */
    double assemble_s, condense_s;
    uz_cost_plan plan; /* which form of the operator, and why */
    uz_reuse reused;   /* when it was made */
    size_t bytes;      /* its own, without a factor that the cache counts */
    uz_item *item;     /* its place in the cache, or NULL */
} uz_setup;

/* SHA-256, hex: of everything a setup is made from, the asked operator, ordering and memory limit included, and of
 * what the choice of its rows follows from; of K, for matrices (a scene's is found when a factor is looked for). cache
 * (or NULL): may have a name for it. */
typedef struct {
    char digest[65];
    uz_matrix_key K;
} uz_setup_key;
uz_status uz_setup_digest(uz_setup_key *key, const uz_problem *problem, const uz_candidates *wanted,
                          const uz_settings *settings, uz_cache *cache, uz_error *err);

/* Assembles (scenes) and chooses rows (`wanted` among them; NULL: none in particular): all but the operator. */
uz_status uz_setup_create(uz_setup **out, const uz_problem *problem, const uz_candidates *wanted,
                          const uz_settings *settings, uz_error *err);
/* A whole setup for a scene at a place: contact rows and dual operator are new, all else is that of `base`, the setup
 * of the scene at no place, which has to outlive *out. Neither has a key: nobody asks for a place again. */
uz_status uz_setup_move(uz_setup **out, uz_setup *base, const uz_problem *problem, const uz_candidates *wanted,
                        const uz_settings *settings, const uz_hooks *hooks, uz_error *err);
/* What follows uz_setup_create: the form of the operator by predicted cost and memory, and what it needs; with a cache
 * the factor and its analysis are found or kept there. key: of K, or empty: then filled where a factor is looked for in
 * a cache. UZ_ERR_LIMIT with the predicted bytes where no form fits. */
uz_status uz_setup_make_operator(uz_setup *setup, const uz_problem *problem, uz_matrix_key *key,
                                 const uz_settings *settings, uz_cache *cache, const uz_hooks *hooks, uz_error *err);
/* The same on the factor or the multigrid of setup->base. */
uz_status uz_setup_share_operator(uz_setup *setup, const uz_problem *problem, const uz_settings *settings,
                                  const uz_hooks *hooks, uz_error *err);
void uz_setup_free(uz_setup *setup);

/* The factor's bound on its inverse as one on that of K: e'K^-1 e is at most so many times the sum of e_j^2 / K_jj.
 * INFINITY: unknown, as the factor can't be trusted. */
double uz_setup_inverse_bound(uz_setup *setup, const uz_csc *K);
/* How far its factor may be trusted: uz_distrust, made at the first call and kept with the setup. Only certificates of
 * bodies whose condition leaves doubts ask. UZ_ERR_NOT_SPD is not kept: nothing is solved on such a setup. */
uz_status uz_setup_doubt(uz_setup *setup, double *doubt, const uz_csc *K, const uz_stop *stop, uz_error *err);

/* How a scene's body is built: with K assembled, or, where all that is asked of it can do without, by its cells. */
uz_body_extent uz_setup_extent(const uz_problem *problem, const uz_settings *settings);

/* Its matrices: the model's for a scene, the problem's otherwise. N has the rows it is solved with. */
const uz_csc *uz_setup_K(const uz_setup *setup, const uz_problem *problem);
const uz_csc *uz_setup_N(const uz_setup *setup, const uz_problem *problem);
const uz_csc *uz_setup_all_rows(const uz_setup *setup, const uz_problem *problem);

#endif
