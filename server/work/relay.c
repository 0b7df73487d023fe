#include "work/relay.h"
#include "store/blobs.h"
#include "store/engine_base.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- the daemon's side */

/* Pieces of a blob follow each other in the inbox, each after its head. */
typedef struct {
    segment *inbox;
    size_t at, end;
    bool full; /* no memory */
} gathered;

static bool gather(void *ctx, const result_piece *piece)
{
    gathered *g = ctx;
    const size_t size = (size_t)piece->size, room = sizeof *piece + (size + 7) / 8 * 8;
    if (!segment_reach(g->inbox, g->end + room, true)) {
        g->full = true;
        return false;
    }
    result_piece head = *piece;
    head.data = NULL;
    memcpy(g->inbox->at + g->end, &head, sizeof head);
    if (size > 0)
        memcpy(g->inbox->at + g->end + sizeof head, piece->data, size);
    g->end += room;
    return true;
}

void relay_find_start(char start[33], const char *request, size_t len)
{
    static const char KEY[] = "\"job\"", BLANKS[] = " \t\r\n";
    start[0] = '\0';
    for (const char *at = request, *end = request + len; (at = memmem(at, (size_t)(end - at), KEY, sizeof KEY - 1));) {
        at += sizeof KEY - 1;
        for (int part = 0; part < 2 && at < end; part++) { /* the colon, and the quotation mark */
            while (at < end && strchr(BLANKS, *at))
                at++;
            at += at < end && *at == ":\""[part];
        }
        if (end - at > 32 && at[-1] == '"' && at[32] == '"' && strspn(at, "0123456789abcdef") == 32)
            snprintf(start, 33, "%.32s", at);
    }
}

void relay_answer(packet *answer, int *fd, store *s, const relay_rights *of, const packet *ask, segment *inbox,
                  size_t at)
{
    char id[sizeof ask->u.ask.id], name[CASE_NAME];
    snprintf(id, sizeof id, "%.*s", (int)sizeof id - 1, ask->u.ask.id);
    snprintf(name, sizeof name, "%.*s", (int)sizeof name - 1, ask->u.ask.name);
    *answer = (packet){.kind = MESSAGE_ANSWER, .status = STORE_ERROR, .u.answer = {.at = at}};
    *fd = -1;
    bool allowed = ask->u.ask.what == ASK_UPLOAD ? of->job != NULL : strcmp(id, of->start) == 0;
    for (size_t i = 0; i < of->n_uploads && ask->u.ask.what == ASK_UPLOAD; i++)
        allowed = allowed || strcmp(id, of->uploads[i]) == 0;
    if (!allowed) {
        answer->status = STORE_NOT_FOUND;
    } else if (ask->u.ask.what == ASK_UPLOAD) {
        answer->status = (int32_t)store_upload_descriptor(s, id, of->job, fd, &answer->u.answer.value);
    } else if (ask->u.ask.what == ASK_BLOB) {
        gathered g = {inbox, at, at, false};
        const result_key key = {id, ask->u.ask.number, ask->u.ask.named ? name : NULL};
        answer->status = (int32_t)s->engine->results->get(s, &key, ask->u.ask.after, gather, &g);
        answer->u.answer.size = g.end - at;
        if (g.full)
            answer->status = STORE_ERROR;
        if (answer->status == STORE_NOT_FOUND && result_blobs_missing(s, &key, -1) == STORE_DAMAGED)
            answer->status = STORE_DAMAGED;
    } else if (ask->u.ask.what == ASK_CASE) {
        store_case *found = NULL;
        size_t count = 0;
        answer->status = (int32_t)store_get_cases(s, id, name, &found, &count);
        answer->u.answer.value = count > 0 ? found[0].number : 0;
        store_cases_free(found, count);
    }
}

/* ---- the process's side */

typedef struct {
    store base;
    blobs uploads;
    int socket;
    segment *inbox;
    int upload; /* the descriptor of the upload that was asked for last, until it is opened; -1: none */
} relay;

static store_status ask(relay *r, const packet *question, packet *answer)
{
    int fd = -1;
    if (!message_send(r->socket, question, -1) || !message_receive(r->socket, answer, &fd) ||
        answer->kind != MESSAGE_ANSWER)
        _exit(1); /* the daemon is gone */
    if (r->upload >= 0)
        close(r->upload);
    r->upload = fd;
    if (answer->status != STORE_OK && answer->status != STORE_NOT_FOUND)
        store_set_message(&r->base, "the daemon could not read it");
    return (store_status)answer->status;
}

static store_status get_upload(store *s, const char *id, const char *client, upload_info *out)
{
    (void)client;
    packet question = {.kind = MESSAGE_ASK, .u.ask = {.what = ASK_UPLOAD}}, answer;
    snprintf(question.u.ask.id, sizeof question.u.ask.id, "%s", id);
    const store_status status = ask((relay *)s, &question, &answer);
    out->bytes = status == STORE_OK ? answer.u.answer.value : 0;
    return status;
}

static int open_upload(blobs *b, const char *id)
{
    relay *r = (relay *)(void *)((char *)b - offsetof(relay, uploads));
    const int fd = r->upload;
    (void)id; /* get_upload comes before it, always */
    r->upload = -1;
    errno = ENOENT;
    return fd;
}

static store_status get_pieces(store *s, const result_key *key, int64_t after,
                               bool (*take)(void *ctx, const result_piece *piece), void *ctx)
{
    relay *r = (relay *)s;
    packet question = {.kind = MESSAGE_ASK,
                       .u.ask = {.what = ASK_BLOB, .named = key->name, .number = key->number, .after = after}};
    packet answer;
    snprintf(question.u.ask.id, sizeof question.u.ask.id, "%s", key->job);
    snprintf(question.u.ask.name, sizeof question.u.ask.name, "%s", key->name ? key->name : "");
    const store_status status = ask(r, &question, &answer);
    size_t at = answer.u.answer.at;
    const size_t end = at + answer.u.answer.size;
    if (status == STORE_OK && !segment_reach(r->inbox, end, false))
        return STORE_ERROR;
    for (bool more = status == STORE_OK; more && at < end;) {
        result_piece piece;
        memcpy(&piece, r->inbox->at + at, sizeof piece);
        piece.data = r->inbox->at + at + sizeof piece;
        at += sizeof piece + ((size_t)piece.size + 7) / 8 * 8;
        more = take(ctx, &piece);
    }
    return status;
}

static store_status get_cases(store *s, const char *id, const char *name, store_case **cases, size_t *count)
{
    packet question = {.kind = MESSAGE_ASK, .u.ask = {.what = ASK_CASE}}, answer;
    snprintf(question.u.ask.id, sizeof question.u.ask.id, "%s", id);
    snprintf(question.u.ask.name, sizeof question.u.ask.name, "%s", name ? name : "");
    const store_status status = ask((relay *)s, &question, &answer);
    if (status != STORE_OK || answer.u.answer.value == 0)
        return status;
    *cases = calloc(1, sizeof **cases);
    if (!*cases)
        return STORE_ERROR;
    (*cases)[0].number = answer.u.answer.value; /* what it is asked for; the texts are not */
    *count = 1;
    return STORE_OK;
}

static void close_relay(store *s)
{
    relay *r = (relay *)s;
    if (r->upload >= 0)
        close(r->upload);
    store_base_end(s);
    free(r);
}

static const result_blobs RESULTS = {.get = get_pieces};
static const blob_operations BLOBS = {.open = open_upload};
static const store_engine ENGINE = {
    .close = close_relay, .get_cases = get_cases, .results = &RESULTS, .upload_get = get_upload};

store *relay_open(int socket, segment *inbox)
{
    char why[64];
    relay *r = calloc(1, sizeof *r);
    if (!r)
        return NULL;
    store_base_begin(&r->base, &ENGINE);
    r->socket = socket;
    r->inbox = inbox;
    r->upload = -1;
    r->uploads.does = &BLOBS;
    if (store_uploads_begin(&r->base, &r->uploads, why, sizeof why))
        return &r->base;
    close_relay(&r->base);
    return NULL;
}
