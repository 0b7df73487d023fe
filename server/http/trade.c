/* trade.c: what accuracy took: /v1/jobs/{id}/work-precision. */
#include "http/jobs.h"
#include "http/results.h"
#include "work/trade.h"

#include <math.h>
#include <stdlib.h>

/* False with a 409 for a job of an earlier version, which kept no record. */
static bool read_record(uz_trade *out, api *context, const job *j, int64_t number, http_reply *reply)
{
    double *x = NULL;
    int64_t count = 0;
    store_status status = store_get_vector(context->store, j->id, number, TRADE_VECTOR, &x, &count);
    bool good = status == STORE_OK && trade_unpack(out, x, count);
    free(x);
    if (status != STORE_OK && status != STORE_NOT_FOUND)
        reply_store_failure(context, status, reply);
    else if (!good)
        reply_refuse(reply, 409, "not_recorded", "What accuracy took was not recorded",
                     "the job ran under another version of the service: its history has the bounds of its iterations");
    return good;
}

/* Where the summary does not know it, from the answer. False with a reply. */
static bool find_mesh_error(codec_trade *of, api *context, const http_request *rq, const job *j, int64_t number,
                            http_reply *reply)
{
    field_reader reader;
    if (!of->is_scene || !of->has_answer || isfinite(of->mesh_error))
        return true;
    const bool done =
        fields_open(&reader, context, rq, j, reply) && fields_mesh_error(&of->mesh_error, &reader, number, reply);
    fields_close(&reader);
    return done;
}

void trade_get(api *context, http_request *rq, http_reply *reply)
{
    job j = {0};
    if (jobs_load(context, rq, &j, reply) && results_exist(&j, reply) && !results_known(rq, &j, reply)) {
        results_place at;
        codec_trade of = {.job_id = j.id};
        size_t len = 0;
        if (results_one(&at, context, rq, &j, "a record", reply) &&
            read_record(&of.trade, context, &j, at.number, reply)) {
            of.case_name = at.name;
            if (!codec_read_trade(&of, at.summary))
                reply_no_memory(reply);
            else if (find_mesh_error(&of, context, rq, &j, at.number, reply)) {
                char *text = codec_encode_trade(&of, &len);
                reply_text(reply, 200, "application/json", text, len);
            }
        }
        results_place_clear(&at);
    }
    jobs_check_still_there(context, &j, reply);
    job_clear(&j);
}
