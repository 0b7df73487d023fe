/* uploads.h: the body of POST /v1/uploads on its way to the store. */
#ifndef SERVER_HTTP_UPLOADS_H
#define SERVER_HTTP_UPLOADS_H

#include "http/request.h"

/* The header block has come. False: rq->refused. */
bool uploads_begin(api *context, http_request *rq);
/* A piece of the body. False: rq->refused. */
bool uploads_take(api *context, http_request *rq, const char *data, size_t size);

#endif
