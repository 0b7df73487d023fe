/* nodes.c: the daemons that share the store, and the drain of one of them. */
#include "store/nodes.h"
#include "codec/codec.h"
#include "http/api.h"

#include <string.h>

static void answer_nodes(api *context, http_reply *reply)
{
    store_node *nodes;
    size_t count;
    const store_status status = store_nodes(context->store, &nodes, &count);
    if (status == STORE_OK)
        reply_json(reply, 200, codec_encode_nodes(nodes, count));
    else
        reply_store_failure(context, status, reply);
    store_nodes_free(nodes, count);
}

void nodes_list(api *context, http_request *rq, http_reply *reply)
{
    (void)rq;
    answer_nodes(context, reply);
}

/* POST: it claims nothing from now on; DELETE: it does again. What it runs, it runs to its end. */
void nodes_drain(api *context, http_request *rq, http_reply *reply)
{
    const store_status status = store_drain(context->store, rq->name, strcmp(rq->method, "POST") == 0);
    if (status == STORE_NOT_FOUND)
        reply_refuse(reply, 404, "not_found", "Not found",
                     "no node of this name is alive: GET /v1/nodes lists them; a daemon's name is its option --node");
    else if (status != STORE_OK)
        reply_store_failure(context, status, reply);
    else
        answer_nodes(context, reply);
}
