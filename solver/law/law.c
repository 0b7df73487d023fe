/* law.c: the table of contact laws. */
#include "law/laws.h"

#include <stddef.h>

static const uz_law_kind *const kinds[] = {
    &uz_frictionless,
};

const uz_law uz_law_frictionless = {.kind = &uz_frictionless};

const uz_law_kind *uz_law_kind_at(int i)
{
    return i >= 0 && (size_t)i < sizeof kinds / sizeof kinds[0] ? kinds[i] : NULL;
}
