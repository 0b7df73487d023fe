/* output_surface.c: /v1/jobs/{id}/surface: what a viewer draws, as glTF. */
#include "codec/codec.h"
#include "http/output.h"

#define MOST_BYTES ((size_t)256000000) /* 413 above it; openapi.json says so */

uz_status output_surface(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    uz_surface surface;
    *file = NULL;
    uz_status status = uz_surface_compute(&surface, of->scene, of->answer, of->options->fields, MOST_BYTES, hooks, err);
    if (status == UZ_OK) {
        const codec_surface what = {&surface, of->scene, of->job_id, of->case_name};
        *file = codec_encode_surface(&what, len);
        status = *file ? UZ_OK : UZ_ERR_MEMORY;
    }
    uz_surface_clear(&surface);
    return status;
}
