/* admin.c: what only an administrator asks for. */
#include "codec/codec.h"
#include "http/api.h"

#include <stdlib.h>

/* POST, because it costs as much as reading the whole file. */
void admin_check(api *context, http_request *rq, http_reply *reply)
{
    store_findings found;
    (void)rq;
    store_status status = store_check(context->store, &found);
    if (status != STORE_OK) {
        reply_store_failure(context, status, reply);
        return;
    }
    if (found.findings[0])
        log_write(context->log, LOG_ERROR, "database_damaged", (log_field[]){LOG_S("findings", found.findings), {0}});
    reply_json(reply, 200, codec_encode_findings(found.findings, found.jobs, found.seconds));
    free(found.findings);
}
