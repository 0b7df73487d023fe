/* encode_npz.c: a result as arrays of NumPy's. */
#include "codec/codec.h"

#include <stdlib.h>

char *codec_encode_result_npz(const codec_result *result, size_t *len)
{
    static const uz_fields NONE = {.dim = 0};
    const codec_result *r = result;
    const uz_fields *f = r->fields ? r->fields : &NONE;
    const int dim = r->dim > 1 ? r->dim : 0, k = f->components;
    const int64_t each = dim > 0 ? dim : 1;
    char *head = codec_encode_result_head(r), *file = NULL;
    const uz_npz_array list[] = {
        {.name = "result.json", .text = head},
        {.name = "reactions", .x = r->reactions, .rows = r->m},
        {.name = "gaps", .x = r->gaps, .rows = r->m},
        {.name = "pressure", .x = r->pressure, .rows = r->m},
        {.name = "ray", .x = r->ray, .rows = r->m},
        {.name = "displacements", .x = r->displacements, .rows = r->n_u / each, .columns = dim},
        {.name = "contact_status", .x = f->contact_status, .rows = f->m, .whole = true},
        {.name = "stress", .x = f->stress, .rows = f->n_nodes, .columns = k},
        {.name = "principal", .x = f->principal, .rows = f->n_nodes, .columns = 3},
        {.name = "von_mises", .x = f->von_mises, .rows = f->n_nodes},
        {.name = "strain", .x = f->strain, .rows = f->n_nodes, .columns = k},
        {.name = "stress_gauss_elements", .x = f->gauss_element, .rows = f->n_points, .whole = true},
        {.name = "stress_gauss_points", .x = f->gauss_point, .rows = f->n_points, .columns = f->dim},
        {.name = "stress_gauss_stress", .x = f->gauss_stress, .rows = f->n_points, .columns = k},
        {.name = "nodes", .x = r->nodes, .rows = r->n_nodes / each, .columns = dim},
        {.name = "contact_nodes", .x = r->contact_nodes, .rows = r->m, .whole = true},
    };
    if (head)
        uz_npz_write(&file, len, list, sizeof list / sizeof list[0], NULL); /* leaves NULL on failure */
    free(head);
    return file;
}
