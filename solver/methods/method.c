/* method.c: the table of methods. */
#include "methods/kinds.h"

#include "core/error.h"

#include <string.h>

static const uz_method_kind *const kinds[] = {
    &uz_method_auto,       &uz_method_uzawa,     &uz_method_accelerated,     &uz_method_accelerated_restart,
    &uz_method_active_set, &uz_method_conjugate, &uz_method_dual_active_set,
};

const uz_method_kind *uz_method_kind_of(uz_method method)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (kinds[i]->method == method)
            return kinds[i];
    return NULL;
}

const char *uz_method_name(uz_method method)
{
    const uz_method_kind *kind = uz_method_kind_of(method);
    if (kind)
        return kind->name;
    return method == UZ_METHOD_GIVEN ? "given" : method == UZ_METHOD_LINEAR ? "linear" : "unknown";
}

bool uz_method_parse(uz_method *out, const char *name)
{
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (strcmp(kinds[i]->name, name) == 0) {
            *out = kinds[i]->method;
            return true;
        }
    return false;
}

uz_status uz_method_find(const uz_method_kind **out, uz_method method, const uz_law *law, uz_error *err)
{
    *out = uz_method_kind_of(method);
    if (!*out)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "there is no such method");
    if ((*out)->one_sided && !law->kind->one_sided)
        return uz_fail(err, UZ_ERR_ARGUMENT, "", "the method %s can't with the contact law %s", (*out)->name,
                       law->kind->name);
    return UZ_OK;
}
