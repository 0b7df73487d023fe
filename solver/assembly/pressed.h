/* pressed.h: does a load hold a body on its obstacles?
 *
 * Let the columns of Z span the null space of K. A motion z = Z y that no row resists, N z <= 0, changes the energy
 * 1/2 u'Ku - p'u by -p'z: there is a solution only if p'z <= 0 for all of them, and it is the only one as to z only if
 * p'z < 0 (Fichera 1964; Kikuchi and Oden, "Contact problems in elasticity" (1988), section 6.3). By Farkas' lemma the
 * first means that Z'p = (N Z)'x for some x >= 0: the contact forces balance the load in every mode. */
#ifndef UZ_PRESSED_H
#define UZ_PRESSED_H

#include "uzawa.h"

typedef enum {
    UZ_PRESSED_ON,
    UZ_PUSHED_AWAY,   /* some z has N z <= 0, p'z > 0: the energy has no lower bound */
    UZ_COSTS_NOTHING, /* some z has N z <= 0, p'z = 0 */
} uz_pressing;

/* Z: d x k, column by column; p: d; N: m x d. y (k): the coefficients of such a motion, unless it is pressed on.
 * tolerance: of loads on a mode, relative to the loads that balance in it. strict: look for UZ_COSTS_NOTHING too. */
uz_status uz_load_on_modes(uz_pressing *how, double *y, const double *Z, int64_t k, const uz_csc *N, const double *p,
                           double tolerance, bool strict, uz_error *err);

#endif
