/* form.h: what a form of the dual operator consists of, for who writes one (docs/architecture/dual-form.md).
 *
 * A form is one file with a constant uz_dual_form and one row of the table in choice.c. Its structs begin with a
 * uz_dual and a uz_dual_load; dual.c makes them, zeroed, fills in what all forms share, and frees them.
 *
 * A form may assume: K, N, p and h are whole in this process, rows of N scaled, K sorted and positive definite. All
 * calls with one load come from one thread, one after the other, and in the same order wherever the same problem is
 * solved: an operation may be collective. Several loads on one operator may be at work at the same time.
 * A form must not: write a uz_dual after `create`, but under the mutexes of its lazy part; keep `stop` or vectors that
 * it was handed; fail because of a stop (UZ_ERR_CANCELLED: from `create` only); print, or change what D is. */
#ifndef UZ_DUAL_FORM_H
#define UZ_DUAL_FORM_H

#include "dual/cost.h"
#include "dual/dual.h"

#include <pthread.h>

/* What is made at the first need, by whoever needs it, under the mutex `making`; pointers are published to loads under
 * it and never change. It may be held for seconds: see uz_lock_while. lambda_max is written under both and may be read
 * under either. Order: making, known. */
typedef struct uz_dual_lazy {
    pthread_mutex_t making, known;
    double lambda_max[2]; /* of D and of W D W, which is [0], too, without weights; NaN until known */
} uz_dual_lazy;

typedef struct {
    int64_t d, m, n_b; /* n_b: dofs that N touches */
    bool bounds;       /* each row bounds a dof, and they are more than a few */
} uz_dual_shape;

/* Operations: as the function of this name in dual.h, unless it says more. Those that may be NULL say so. */
struct uz_dual_form {
    uz_dual_abilities can;
    size_t dual_size, load_size;               /* of its structs */
    bool (*suits)(const uz_dual_shape *shape); /* is it the one to take? NULL: only when asked for, or for its price */

    /* Adds what the form takes to a cost that holds what K, N, the factor (predicted for this form; NULL: it needs
     * none) and the vectors of certificates take. */
    void (*add_cost)(uz_cost_estimate *cost, const uz_cost_size *size, const uz_factor_info *factor,
                     const uz_cost_rates *rates);

    uz_status (*create)(uz_dual *dual, const uz_stop *stop, uz_error *err); /* also `bytes`, `rows_may_depend` */
    void (*clear)(uz_dual *dual);                                           /* half-built ones too */

    /* psi0, g0, bytes, room for both corrections, and its own vectors. */
    uz_status (*load)(uz_dual_load *load, const double *p, uz_error *err);
    void (*unload)(uz_dual_load *load);                                         /* half-built ones too */
    uz_status (*aim)(uz_dual_load *load, double relative_error, uz_error *err); /* NULL: exact */
    uz_status (*prepare)(uz_dual_load *load, uz_error *err);                    /* NULL: nothing to make */
    /* Between begin true and false D is applied to vectors of about one size, which is not that of reactions, to this
     * relative accuracy; 0: to that of the answer. NULL: exact. */
    void (*probe)(uz_dual_load *load, bool begin, double accuracy);

    uz_status (*apply)(uz_dual_load *load, double *Dr, const double *r, uz_error *err);
    bool (*column)(uz_dual_load *load, double *column, int64_t i); /* false, or NULL: it takes an application */
    /* NULL: none. *can: true at entry. */
    uz_status (*inverse_column)(uz_dual_load *load, bool *can, double *column, int64_t i, uz_error *err);
    /* *bound2: the square of the bound, INFINITY at entry; load->correction: the correction. */
    uz_status (*correct)(uz_dual_load *load, double *bound2, const double *r, const double *g, const bool *close);
    /* u (d) = u(r), and where `corrected` load->kept added. */
    uz_status (*recover)(uz_dual_load *load, double *u, const double *r, bool corrected, uz_error *err);
    uz_status (*solve_active)(uz_dual_load *load, uz_active_end *end, double *r, double *g, bool *active,
                              uz_error *err);               /* *end: UNSOLVED at entry */
    bool (*guess_active)(uz_dual_load *load, bool *active); /* NULL: none */
    /* As a uz_inverse_norm, sharp to a hundredth where time allows and it is not below `enough`. load: a uz_dual_load.
     * NULL: has a factor. */
    uz_status (*inverse_norm)(void *load, double *value, double *e, double enough, uz_error *err);

    /* can.lanes; y = L^-1 P p, whose entry k stands at y[k stride], and x (d) is room: g0 and the rest as `load`, and
     * y += L^-1 P N'r and, where corrected, the kept correction. */
    uz_status (*load_lane)(uz_dual_load *load, const double *y, int64_t stride, double *x, uz_error *err);
    uz_status (*add_reactions)(uz_dual_load *load, double *y, int64_t stride, double *x, const double *r,
                               bool corrected, uz_error *err);
};

extern const uz_dual_form uz_dual_condensed, uz_dual_factored, uz_dual_matrix_free, uz_dual_distributed;

#endif
