/* path: displacement and stress along a line through the body, as a table for people, as CSV or as JSON. */
#include "commands/fetch.h"
#include <string.h>

client_exit client_path(client_session *s)
{
    const client_options *o = s->options;
    const char *format = o->json ? "json" : o->format ? o->format : "table";
    char count[24];
    client_reply reply;
    snprintf(count, sizeof count, "%d", o->count);
    const client_query query[] = {
        {"from", o->from}, {"to", o->to}, {"count", o->count < 0 ? NULL : count}, {"case", o->case_name}, {NULL, NULL}};
    char *path = client_path_with_query(s, o->operand, strcmp(format, "json") == 0 ? "/path" : "/path.csv", query);
    client_exit code = client_get(s, &reply, path, NULL);
    if (code == CLIENT_OK)
        code = client_deliver_rows(s, reply.body.data ? reply.body.data : "", reply.body.len,
                                   strcmp(format, "table") == 0);
    client_reply_clear(&reply);
    return code;
}
