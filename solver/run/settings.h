/* settings.h: what is asked of a solve. */
#ifndef UZ_SETTINGS_H
#define UZ_SETTINGS_H

#include "uzawa.h"

uz_status uz_check_settings(const uz_settings *settings, uz_error *err);

/* `exact` means rounding level: no certificate in double precision can be expected below this. */
#define UZ_EXACT_RELATIVE_ERROR 1e-12
/* The relative error that a certificate has to meet, before `balanced` knows better. */
double uz_requested_error(const uz_settings *settings);

#endif
