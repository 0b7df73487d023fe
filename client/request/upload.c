/* upload: a file that requests then name, sent once. */
#include "request/build.h"
#include "show/report.h"

#include <gnutls/crypto.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool client_is_packed(const char *name)
{
    const char *end = strrchr(name, '.');
    return end && strcmp(end, ".gz") == 0;
}

bool client_ends_in(const char *path, const char *ending, bool packed)
{
    const size_t all = strlen(path), length = strlen(ending), end = packed && client_is_packed(path) ? all - 3 : all;
    return end > length && strncasecmp(path + end - length, ending, length) == 0;
}

/* The id is the digest of the bytes, so that a file that comes twice is stored once: it may be sent again. */
static client_exit send_bytes(client_session *s, json_t **upload, const char *name, const client_buffer *file)
{
    client_request request = client_request_new(s, "POST", "/v1/uploads");
    request.body = file->data;
    request.body_len = file->len;
    request.body_type = "Content-Type: application/octet-stream";
    if (client_is_packed(name))
        request.headers[0] = "Content-Encoding: gzip";
    client_exit code = client_ask_json(s, upload, &request);
    if (code == CLIENT_OK && !*client_json_text(*upload, "id"))
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply names no upload; is this the right server?");
    return code;
}

client_exit client_upload_once(client_session *s, char id[65], const char *name, const client_buffer *file)
{
    unsigned char digest[32];
    json_t *upload = NULL;
    /* The id is the SHA-256 (FIPS 180-4) of the bytes in hexadecimal digits. Whatever goes wrong with asking for it is
     * met, and told, when the bytes are sent. */
    if (!client_is_packed(name) && gnutls_hash_fast(GNUTLS_DIG_SHA256, file->data, file->len, digest) == 0) {
        char path[100];
        client_reply reply;
        for (size_t i = 0; i < sizeof digest; i++)
            snprintf(id + 2 * i, 3, "%02x", digest[i]);
        snprintf(path, sizeof path, "/v1/uploads/%s", id);
        client_request request = client_request_new(s, "GET", path);
        bool known = client_http_send(s->http, &reply, &request) == CLIENT_HTTP_ANSWERED && reply.status == 200;
        client_reply_clear(&reply);
        if (known)
            return CLIENT_OK;
    }
    client_exit code = send_bytes(s, &upload, name, file);
    snprintf(id, 65, "%s", client_json_text(upload, "id"));
    json_decref(upload);
    return code;
}

client_exit client_upload(client_session *s)
{
    char message[512];
    client_buffer file;
    json_t *upload = NULL;
    if (!client_file_read(&file, s->options->operand, message, sizeof message))
        return client_complain(s, CLIENT_LOCAL, message);
    client_exit code = send_bytes(s, &upload, s->options->operand, &file);
    free(file.data);
    if (code == CLIENT_OK && s->options->json)
        code = client_print_json(s, upload);
    else if (code == CLIENT_OK) {
        client_print_safe(s->out, client_json_text(upload, "id"));
        fputc('\n', s->out);
    }
    json_decref(upload);
    return code;
}
