/* element_type.c: the table of element types. */
#include "element/element_type.h"

#include <string.h>

/* One row each; the order is that of uz_element_kind. */
extern const uz_element_type uz_type_tri3;
extern const uz_element_type uz_type_quad4;
extern const uz_element_type uz_type_tri6;
extern const uz_element_type uz_type_quad8;
extern const uz_element_type uz_type_tet4;
extern const uz_element_type uz_type_hex8;
extern const uz_element_type uz_type_tet10;
extern const uz_element_type uz_type_hex20;
extern const uz_element_type uz_type_wedge6;
extern const uz_element_type uz_type_wedge15;

/* clang-format off */
const uz_element_type *const uz_element_types[UZ_ELEMENT_KINDS] = {
    [UZ_TRI3] = &uz_type_tri3,
    [UZ_QUAD4] = &uz_type_quad4,
    [UZ_TRI6] = &uz_type_tri6,
    [UZ_QUAD8] = &uz_type_quad8,
    [UZ_TET4] = &uz_type_tet4,
    [UZ_HEX8] = &uz_type_hex8,
    [UZ_TET10] = &uz_type_tet10,
    [UZ_HEX20] = &uz_type_hex20,
    [UZ_WEDGE6] = &uz_type_wedge6,
    [UZ_WEDGE15] = &uz_type_wedge15,
};
/* clang-format on */

const char *uz_element_name(uz_element_kind kind)
{
    return kind < UZ_ELEMENT_KINDS ? uz_element_types[kind]->name : "unknown";
}

bool uz_element_parse(uz_element_kind *out, const char *name)
{
    for (int i = 0; i < UZ_ELEMENT_KINDS; i++)
        if (strcmp(uz_element_types[i]->name, name) == 0) {
            *out = (uz_element_kind)i;
            return true;
        }
    return false;
}

int uz_element_node_count(uz_element_kind kind)
{
    return uz_element_types[kind]->nodes;
}
