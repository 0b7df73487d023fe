/* trade.c: what accuracy took: /v1/jobs/{id}/work-precision. */
#include "http/jobs.h"
#include "http/results.h"
#include "work/trade.h"

#include <math.h>
#include <stdlib.h>

static uz_status compute_mesh_error(void *out, const uz_scene *scene, const uz_field_source *answer, unsigned which,
                                    const uz_hooks *hooks, uz_error *err)
{
    (void)which;
    return uz_mesh_error(out, scene, answer, hooks, err);
}

void trade_get(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    double *x = NULL;
    int64_t count = 0;
    results_place at = {.cases = NULL};
    codec_trade of = {.job_id = j.id};
    if (!jobs_load(context, rq, &j, reply) || !results_exist(&j, reply) || results_known(rq, &j, reply) ||
        !results_one(&at, context, &j, target_value(&rq->target, "case"), "a record", reply))
        goto done;
    of.case_name = at.name;
    const store_status status = store_get_vector(context->store, j.id, at.number, TRADE_VECTOR, &x, &count);
    if (status != STORE_OK && status != STORE_NOT_FOUND) {
        reply_store_failure(context, status, reply);
    } else if (status == STORE_NOT_FOUND || !trade_unpack(&of.trade, x, count)) {
        reply_refuse(reply, 409, "not_recorded", "What accuracy took was not recorded",
                     "the job ran under another version of the service: its history has the bounds of its iterations");
    } else if (!codec_read_trade(&of, at.summary)) {
        reply_no_memory(reply);
    } else {
        /* where the summary does not know the error of the mesh, from the answer */
        const bool known = !of.is_scene || !of.has_answer || isfinite(of.mesh_error);
        field_reader reader;
        size_t len = 0;
        const bool good = known || (fields_open(&reader, context, rq, &j, reply) &&
                                    fields_compute(&of.mesh_error, compute_mesh_error, &reader, at.number, 0, reply));
        if (!known)
            fields_close(&reader);
        if (good) {
            char *text = codec_encode_trade(&of, &len);
            reply_text(reply, 200, "application/json", text, len);
        }
    }
done:
    free(x);
    results_place_clear(&at);
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}
