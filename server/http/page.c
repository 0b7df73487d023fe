/* page.c: GET / and GET /page/{name}: the web page. It needs no token: it is the same for everybody and asks for one
 * itself. Its policy allows nothing but its own files and this service, and no code or style within the document
 * (W3C Content Security Policy 3). */
#include "http/page.h"
#include "http/api.h"

#include <string.h>

static const char POLICY[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; frame-ancestors 'none'; form-action 'none'";

void page_get(api *context, http_request *rq, http_reply *reply)
{
    const char *name = rq->name[0] ? rq->name : "index.html"; /* GET / */
    (void)context;
    page_file file;
    for (size_t i = 0; (file = page_file_at(i)).name; i++) {
        if (strcmp(file.name, name) != 0)
            continue;
        reply->status = 200;
        reply->type = file.type;
        reply->body = (char *)(uintptr_t)file.plain; /* only read: body_is_static */
        reply->len = file.plain_len;
        reply->body_is_static = true;
        reply->packed = file.gzip;
        reply->packed_len = file.gzip_len;
        reply->cacheable = true;
        reply->immutable = strcmp(name, "index.html") != 0; /* the other names have a hash of the content in them */
        reply->tag_by_body = true;
        reply->policy = POLICY;
        return;
    }
    reply_refuse(reply, 404, "not_found", "Not found", "the page has no file of this name");
}
