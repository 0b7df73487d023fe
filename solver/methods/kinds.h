/* kinds.h: the methods of iteration, for the table. */
#ifndef UZ_METHOD_KINDS_H
#define UZ_METHOD_KINDS_H

#include "methods/method.h"

extern const uz_method_kind uz_method_auto, uz_method_active_set, uz_method_dual_active_set, uz_method_conjugate;
extern const uz_method_kind uz_method_uzawa, uz_method_accelerated, uz_method_accelerated_restart; /* gradient.c */

#endif
