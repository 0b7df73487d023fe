/* output_vtu.c: /v1/jobs/{id}/result.vtu: mesh and fields for ParaView. */
#include "http/output.h"

uz_status output_vtu(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    return uz_vtu_write(file, len, of->scene, of->answer, of->options->fields, hooks, err);
}
