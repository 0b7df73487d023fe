/* deck.c: decks of Abaqus and CalculiX, which the service makes requests of. */
#include "request/build.h"
#include "show/report.h"

#include <stdlib.h>
#include <string.h>

bool client_is_deck(const char *path)
{
    return path && client_ends_in(path, ".inp", true);
}

/* A line for each note; those of what does not matter only where `all`. */
static void tell(client_session *s, const json_t *notes, bool all)
{
    const json_t *note;
    size_t i;
    json_array_foreach(notes, i, note)
    {
        const char *effect = client_json_text(note, "effect");
        if (!all && strcmp(effect, "irrelevant") == 0)
            continue;
        fprintf(s->err, "uzawa: line %" JSON_INTEGER_FORMAT ": ", json_integer_value(json_object_get(note, "line")));
        client_print_safe(s->err, client_json_text(note, "keyword"));
        fputs(": ", s->err);
        client_print_safe(s->err, client_json_text(note, "text"));
        fputc('\n', s->err);
    }
}

client_exit client_build_deck(client_session *s, json_t **request, const char *path, bool all)
{
    json_t *asked = json_object(), *reply = NULL;
    client_exit code =
        asked ? client_put_file(s, asked, "abaqus", path) : client_complain(s, CLIENT_LOCAL, "no memory");
    *request = NULL;
    if (code == CLIENT_OK && s->options->leave_out)
        json_object_set_new(asked, "leave_out", json_true());
    char *body = code == CLIENT_OK ? json_dumps(asked, JSON_COMPACT) : NULL;
    if (code == CLIENT_OK && !body)
        code = client_complain(s, CLIENT_LOCAL, "no memory");
    if (code == CLIENT_OK) {
        client_request post = client_request_new(s, "POST", "/v1/decks");
        post.body = body;
        post.body_len = strlen(body);
        post.repeatable = true; /* nothing is stored */
        code = client_ask_json(s, &reply, &post);
    }
    if (code == CLIENT_OK && !s->options->quiet)
        tell(s, json_object_get(reply, "notes"), all);
    if (code == CLIENT_OK)
        *request = json_incref(json_object_get(reply, "request"));
    if (code == CLIENT_OK && !json_is_object(*request))
        code = client_complain(s, CLIENT_SERVER_ERROR, "the reply has no request; is this the right server?");
    free(body);
    json_decref(asked);
    json_decref(reply);
    return code;
}
