/* output_history.c: /v1/jobs/{id}/history and /history.csv: how a run went. */
#include "codec/codec.h"
#include "http/output.h"

uz_status output_history(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    (void)hooks;
    (void)err;
    *file = codec_encode_history(of->case_name, of->rows, of->n_rows, len);
    return *file ? UZ_OK : UZ_ERR_MEMORY;
}

uz_status output_history_csv(char **file, size_t *len, const output_source *of, const uz_hooks *hooks, uz_error *err)
{
    (void)hooks;
    (void)err;
    *file = codec_encode_history_csv(of->rows, of->n_rows, len);
    return *file ? UZ_OK : UZ_ERR_MEMORY;
}
