/* quantities.h: intervals for the numbers that a scene is solved for. */
#ifndef UZ_QUANTITIES_H
#define UZ_QUANTITIES_H

#include "post/functional.h"
#include "run/setup.h"

/* What of an answer of large deformation is not as of small; ctx: `of`. */
typedef struct {
    void *of;
    uz_functional_place place;
    const char *why; /* why no mesh's part can be told; NULL: it can */
    double left;     /* what the equations leave, in the energy norm, */
    double forces;   /* and of the forces on free dofs: their length */
    /* w (d): K w = load - K_fixed held + N'y with N w = gap at the rows that press, y (m) 0 at others, K the tangent.
     * *solved false: there is none. */
    uz_status (*solve)(void *of, bool *solved, double *w, double *y, const bool *pressing,
                       const uz_functional *functional, uz_error *err);
    /* v'K v / 2 of a displacement by node, that of rows left out; and uz_finite_error_energy at the answer. */
    uz_status (*energy)(void *of, double *energy, const double *v, uz_error *err);
    uz_status (*errors)(void *of, double *energy, double *eta2, const double *z, double own, double times,
                        uz_error *err);
} uz_quantity_large;

/* What is needed beside the answer. */
typedef struct {
    const uz_problem *problem;
    const uz_settings *settings;
    const uz_scene *scene; /* with the loads of the case */
    const uz_body_model *model;
    const uz_csc *K; /* those that `dual` is of: where springs on rows hold the body, with them */
    const uz_dual *dual;
    const uz_quantity_large
        *place;                   /* NULL: small deformation; else there are neither K nor `dual`, nor what is theirs */
    const double *weight;         /* m: of the springs on rows that K has; NULL: none */
    const uz_candidates *rows;    /* which of the model's rows the dual has; NULL, or in NULL: all */
    const double *h, *prescribed; /* of all rows; of supported dofs */
    const uz_stop *stop;
} uz_quantity_work;

/* Fills answer->evaluation's quantities; u, r, the certificate and the rest of the evaluation are there. Takes a solve
 * on the factor and two looks at each element for each of them. UZ_ERR_MEMORY, _SCENE (uz_functional_make). */
uz_status uz_find_quantities(uz_result *answer, const uz_quantity_work *work, uz_error *err);

#endif
