/* upload: a file that requests then name, sent once. */
#include "report.h"
#include "session.h"

#include <stdlib.h>
#include <string.h>

/* The id is the digest of the bytes, so that a file that comes twice is stored once: it may be sent again. */
static client_exit send_bytes(client_session *s, json_t **upload, const client_buffer *file)
{
    const char *end = strrchr(s->options->operand, '.');
    client_request request = client_request_new(s, "POST", "/v1/uploads");
    request.body = file->data;
    request.body_len = file->len;
    request.body_type = "Content-Type: application/octet-stream";
    if (end && strcmp(end, ".gz") == 0)
        request.headers[0] = "Content-Encoding: gzip";
    return client_ask_json(s, upload, &request);
}

client_exit client_upload(client_session *s)
{
    char message[512];
    client_buffer file;
    json_t *upload = NULL;
    if (!client_file_read(&file, s->options->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    client_exit code = send_bytes(s, &upload, &file);
    free(file.data);
    const char *id = client_json_text(upload, "id");
    if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, upload);
    else if (code == CLIENT_OK && !*id)
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply names no upload; is this the right server?");
    else if (code == CLIENT_OK) {
        client_print_safe(s->out, id);
        fputc('\n', s->out);
    }
    json_decref(upload);
    return code;
}
