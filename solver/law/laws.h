/* laws.h: the kinds of contact laws, for the table. */
#ifndef UZ_LAWS_H
#define UZ_LAWS_H

#include "law/law.h"

extern const uz_law_kind uz_frictionless; /* frictionless.c */

#endif
