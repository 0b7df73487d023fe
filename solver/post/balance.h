/* balance.h: resultants of loads, contacts and supports, and the energy that they store. */
#ifndef UZ_FIELDS_BALANCE_H
#define UZ_FIELDS_BALANCE_H

#include "assembly/assembly.h"
#include "uzawa.h"

/* Fills out->contacts, supports, loads, imbalance and strain_energy; the names and zeros are there. u: n_nodes x dim;
 * r: m; scene: with the loads of the case. */
uz_status uz_balance_forces(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                            const double *r, uz_error *err);

/* Adds to out->warnings what makes the answer doubtful. */
uz_status uz_find_doubts(uz_evaluation *out, const uz_body_model *model, const uz_scene *scene, const double *u,
                         const double *r, uz_error *err);

#endif
