/* settings.h: what is asked of a solve. */
#ifndef UZ_SETTINGS_H
#define UZ_SETTINGS_H

#include "assembly/assembly.h"
#include "uzawa.h"

uz_status uz_check_settings(const uz_settings *settings, uz_error *err);

/* `exact` means rounding level: no certificate in double precision can be expected below this. */
#define UZ_EXACT_RELATIVE_ERROR 1e-12
/* The relative error that a certificate has to meet, before `balanced` knows better. */
double uz_requested_error(const uz_settings *settings);
/* Scenes, `balanced`: *requested becomes a tenth of what the mesh itself loses, as an answer tells it: u (d) is
 * 2^exponent times its free dofs. Digits beyond that describe the mesh, not the body. It stays as it is where
 * nothing is lost. Errors: MEMORY. */
uz_status uz_balance_request(double *requested, const uz_body_model *model, const uz_scene *scene, const double *u,
                             const double *prescribed, int exponent, uz_error *err);

#endif
